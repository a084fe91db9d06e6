"""Time stepping with an open contact mode: the foot may stick or slip in every interval.

Each interval has one acceleration, torque and contact force, the equations of motion at its middle, and Coulomb's law
as complementarity pairs with the foot speed at its end (J. J. Moreau, Unilateral contact and dry friction in finite
freedom dynamics, 1988).  The scheme is of low order where the contact mode changes and only proposes phases; the closed
contact sequence is then solved by an accurate scheme, which adds torque-rate limits and friction margins.
"""

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.impact_law import PlasticFrictional
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.keys import Key, Kind, Unknown
from gaitopt.ocp.transcription.relaxation import Pair
from gaitopt.ocp.transcription.scheme import Point, Scheme

CONTACT = (
    Key(Kind.CONTACT_NORMAL),
    Key(Kind.CONTACT_FRICTION, "forward"),
    Key(Kind.CONTACT_FRICTION, "backward"),
    Key(Kind.SLIP_SPEED),
)
"""Unknowns f_n, a and b per weight, with f_t = a - b, and c [m/s]."""

_PAIRS = (
    "complementarity of slip speed and forward friction",
    "complementarity of slip speed and backward friction",
    "complementarity of friction cone and slip speed",
)


FRICTION_PAIRS = len(_PAIRS)


@dataclass(frozen=True)
class TimeStepping(Scheme):
    """Implicit steps with the contact force of an open mode."""

    inner = (0.5,)
    nodal = False
    inner_table = Unknown.CONTACT

    def node_unknowns(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return an empty tuple: accelerations belong to intervals."""
        return ()

    def inner_unknowns(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return the parts of the contact force and the slip speed."""
        return CONTACT

    def residuals(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return the equations of motion, those of the stance foot first."""
        return tuple(Key(Kind.EQUATION_OF_MOTION, name) for name in ("foot", "contact", *dynamics.robot.angles))

    def defects(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return the equations of the positions; rates follow from the equations of motion."""
        return tuple(Key(Kind.DYNAMICS, name) for name in dynamics.moving)

    def node(self, dynamics: PhaseDynamics, state: ca.SX, torque: ca.SX, unknowns: ca.SX, p: ca.SX) -> Point:
        """Return the point at a node, which has a state only."""
        empty = ca.SX(0, 1)
        return Point(state, torque, empty, empty, empty)

    def advance(
        self, dynamics: PhaseDynamics, left: Point, right: Point, unknowns: ca.SX, length: ca.SX, p: ca.SX
    ) -> tuple[ca.SX, list[Point]]:
        """Return the defect of the positions, and the middle with its equations of motion and friction pairs."""
        (place, speed), (place_after, speed_after) = dynamics.parts(left.state), dynamics.parts(right.state)
        normal, forward, backward, slip = ca.vertsplit(unknowns)
        state, acceleration = (left.state + right.state) / 2, (speed_after - speed) / length
        force = ca.vertcat(forward - backward, normal)
        residual = dynamics.balance_of(state, acceleration, left.torque, force, p)
        parts, velocity = (normal, forward, backward), (ca.SX(1, 1), speed_after[-1])
        sides = PlasticFrictional().pairs(parts, slip, velocity, dynamics.friction(p))
        pairs = [Pair(*pair) for pair in zip(_PAIRS, sides[0][1:], sides[1][1:], strict=True)]
        middle = Point(state, left.torque, acceleration, force * dynamics.weight(p), residual, slip, pairs)
        return place_after - place - length * (speed + speed_after) / 2, [middle]

    def smooth_weights(self) -> Array:
        """Return the weights of the midpoint rule."""
        return self.kinked_weights()

    def kinked_weights(self) -> Array:
        """Return the weights of the midpoint rule."""
        return np.array([0.0, 1.0, 0.0])
