"""Complementarity form of an impact with an open mode."""

import casadi as ca

from gaitopt.ocp.nlp.keys import Key, Kind, Row, Unknown, equation
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder
from gaitopt.ocp.transcription.relaxation import Pair

UNKNOWNS = (Key(Kind.IMPULSE, "forward"), Key(Kind.IMPULSE, "backward"), Key(Kind.SLIP_SPEED_AFTER_IMPACT))
"""Unknowns a, b and c of the impact law; impulses per mass, so that all are in m/s."""

_NAMES = (
    "complementarity of slip speed and forward impulse",
    "complementarity of slip speed and backward impulse",
    "complementarity of impact cone and slip speed",
)
"""Names of the pairs: right side, left side."""


def open_impact(
    builder: NlpBuilder, local: BlockVariables, impulse: ca.SX, speed: ca.SX, friction: ca.SX, mass: ca.SX
) -> tuple[list[Row], ca.SX, ca.SX]:
    """Return rows, values and penalty of the impact law of the landing foot, which may stick or slip.

    Parameters
    ----------
    builder : NlpBuilder
    local : BlockVariables
        Local variables of the touchdown; a, b, c and the slacks of the relaxation are added to them.
    impulse : SX, shape (2, 1) [N s]
    speed : SX [m/s]
        Speed of the landing foot after the impact.
    friction, mass : SX
        Coulomb coefficient; total mass [kg].
    """
    unknowns = local.add("open impact", builder.variables[Unknown.OPEN_IMPACT])
    tangential, normal = ca.vertsplit(impulse / mass)
    # The first pair, of normal impulse and normal velocity, is satisfied: the foot does not bounce.
    forward, backward, slip = ca.vertsplit(unknowns)
    law = builder.robot.contact_model.impact
    left, right = law.pairs((normal, forward, backward), slip, (ca.SX(1, 1), speed), friction)
    pairs = [Pair(*pair) for pair in zip(_NAMES, left[1:], right[1:], strict=True)]
    table, values, penalty = builder.relax(local, Unknown.RELAXATION, pairs)
    return (
        [equation(Kind.IMPULSE_PARTS), *table],
        ca.vertcat(tangential - forward + backward, values),
        penalty,
    )
