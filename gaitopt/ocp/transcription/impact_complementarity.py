"""Complementarity form of an impact whose mode is open."""

import casadi as ca

from gaitopt.ocp.nlp.keys import Key, Kind, Row, Unknown, equation
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder
from gaitopt.ocp.transcription.relaxation import Pair

UNKNOWNS = (Key(Kind.IMPULSE, "forward"), Key(Kind.IMPULSE, "backward"), Key(Kind.SLIP_SPEED_AFTER_IMPACT))
"""a, b and c of the impact law; impulses per mass, so that all of it is in m/s."""

_NAMES = ("slip speed beside forward impulse", "slip speed beside backward impulse", "impact cone beside slip speed")
"""Names of the pairs: the right side beside the left one."""


def open_impact(
    frame: NlpBuilder, local: BlockVariables, impulse: ca.SX, speed: ca.SX, friction: ca.SX, mass: ca.SX
) -> tuple[list[Row], ca.SX, ca.SX]:
    """Return rows, values and penalty that let the landing foot stick or slip as the impact law has it.

    Parameters
    ----------
    frame : Frame
    local : BlockVariables
        Local variables of the touchdown, which gain a, b and c, and the slacks of the relaxation.
    impulse : SX, shape (2, 1) [N s]
    speed : SX [m/s]
        Of the landing foot after the impact.
    friction, mass : SX
        Coulomb coefficient; total mass [kg].
    """
    unknowns = local.add("open impact", frame.variables[Unknown.OPEN_IMPACT])
    tangential, normal = ca.vertsplit(impulse / mass)
    # The first pair, of normal impulse and normal velocity, holds as it is: the foot does not bounce.
    forward, backward, slip = ca.vertsplit(unknowns)
    law = frame.robot.contact_model.impact
    left, right = law.pairs((normal, forward, backward), slip, (ca.SX(1, 1), speed), friction)
    pairs = [Pair(*pair) for pair in zip(_NAMES, left[1:], right[1:], strict=True)]
    table, values, penalty = frame.relax(local, Unknown.RELAXATION, pairs)
    return (
        [equation(Kind.IMPULSE_PARTS), *table],
        ca.vertcat(tangential - forward + backward, values),
        penalty,
    )
