"""Time stepping with an open contact mode: the foot may stick or slip in every interval.

One acceleration, torque and contact force in each interval, the equations of motion at its middle, Coulomb's law as
complementarity pairs with the foot speed at its end (J. J. Moreau, Unilateral contact and dry friction in finite
freedom dynamics, 1988).  It is of low order where the contact mode changes, and only proposes phases: the closed
contact sequence is then solved by an accurate scheme.  Torque-rate limits and friction margins are left to that.
"""

from dataclasses import dataclass

import casadi as ca
import numpy as np

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
"""f_n, a and b per weight, with f_t = a - b, and c [m/s]."""

_PAIRS = ("slip speed beside forward friction", "slip speed beside backward friction", "cone beside slip speed")


FRICTION_PAIRS = len(_PAIRS)


@dataclass(frozen=True)
class TimeStepping(Scheme):
    """Implicit steps with the contact force of an open mode."""

    inner = (0.5,)
    nodal = False
    inner_table = Unknown.CONTACT

    def node_unknowns(self, stance: PhaseDynamics) -> tuple[Key, ...]:
        """Return nothing: accelerations belong to intervals."""
        return ()

    def inner_unknowns(self, stance: PhaseDynamics) -> tuple[Key, ...]:
        """Return the parts of the contact force and the slip speed."""
        return CONTACT

    def residuals(self, stance: PhaseDynamics) -> tuple[Key, ...]:
        """Return the equations of motion, those of the stance foot first."""
        return tuple(Key(Kind.EQUATION_OF_MOTION, name) for name in ("foot", "contact", *stance.robot.angles))

    def defects(self, stance: PhaseDynamics) -> tuple[Key, ...]:
        """Return the equations of the positions; rates follow from the equations of motion."""
        return tuple(Key(Kind.DYNAMICS, name) for name in stance.moving)

    def node(self, stance: PhaseDynamics, state: ca.SX, torque: ca.SX, unknowns: ca.SX, p: ca.SX) -> Point:
        """Return the point at a node, of which the state alone is known."""
        empty = ca.SX(0, 1)
        return Point(state, torque, empty, empty, empty)

    def advance(
        self, stance: PhaseDynamics, left: Point, right: Point, unknowns: ca.SX, step: ca.SX, p: ca.SX
    ) -> tuple[ca.SX, list[Point]]:
        """Return the gap of the positions, and the middle with its equations of motion and friction pairs."""
        (place, speed), (place_after, speed_after) = stance.parts(left.state), stance.parts(right.state)
        normal, forward, backward, slip = ca.vertsplit(unknowns)
        state, acceleration = (left.state + right.state) / 2, (speed_after - speed) / step
        force = ca.vertcat(forward - backward, normal)
        residual = stance.balance_of(state, acceleration, left.torque, force, p)
        parts, velocity = (normal, forward, backward), (ca.SX(1, 1), speed_after[-1])
        sides = PlasticFrictional().pairs(parts, slip, velocity, stance.friction(p))
        pairs = [Pair(*pair) for pair in zip(_PAIRS, sides[0][1:], sides[1][1:], strict=True)]
        middle = Point(state, left.torque, acceleration, force * stance.weight(p), residual, slip, pairs)
        return place_after - place - step * (speed + speed_after) / 2, [middle]

    def smooth_weights(self) -> Array:
        """Return the weights of the midpoint rule."""
        return self.kinked_weights()

    def kinked_weights(self) -> Array:
        """Return the weights of the midpoint rule."""
        return np.array([0.0, 1.0, 0.0])
