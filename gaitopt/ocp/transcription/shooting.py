"""Multiple shooting: each interval is integrated by classical Runge-Kutta steps from its left node."""

from dataclasses import dataclass

import casadi as ca
from attrs import evolve, field, frozen

from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.ocp.nlp.keys import Key
from gaitopt.ocp.transcription.method import Method
from gaitopt.ocp.transcription.scheme import Point, Scheme
from gaitopt.parameters import whole_number

MOST_SUBSTEPS = 8
"""Refinement of the integration ends here; a plan still too coarse then fails its replay and is reported as such."""


@dataclass(frozen=True)
class RungeKutta(Scheme):
    """Classical fourth-order steps, the same number in each half of an interval.

    The middle of the interval is a point of the trajectory, at which the path constraints are held too.

    Attributes
    ----------
    substeps : int
        Steps in each half.
    """

    substeps: int = 1
    inner = (0.5,)

    def node_unknowns(self, stance: PhaseDynamics) -> tuple[Key, ...]:
        """Return nothing: accelerations follow from the state."""
        return ()

    def inner_unknowns(self, stance: PhaseDynamics) -> tuple[Key, ...]:
        """Return nothing: the middle follows from the left node."""
        return ()

    def residuals(self, stance: PhaseDynamics) -> tuple[Key, ...]:
        """Return nothing."""
        return ()

    def node(self, stance: PhaseDynamics, state: ca.SX, torque: ca.SX, unknowns: ca.SX, p: ca.SX) -> Point:
        """Return the point by forward dynamics."""
        rate, force = stance.flow(state, torque, p)
        return Point(state, torque, stance.parts(rate)[1], force, ca.SX(0, 1), stance.slip_speed(state))

    def advance(
        self, stance: PhaseDynamics, left: Point, right: Point, unknowns: ca.SX, step: ca.SX, p: ca.SX
    ) -> tuple[ca.SX, list[Point]]:
        """Return the gap between the integrated end and the right node, and the middle."""
        middle, end = stance.interval(left.state, left.torque, right.torque, step, p, substeps=self.substeps)
        halfway = self.node(stance, middle, (left.torque + right.torque) / 2, unknowns, p)
        return right.state - end, [halfway]


@frozen(kw_only=True)
class MultipleShooting(Method):
    """Transcription by multiple shooting with fourth-order Runge-Kutta steps.

    Attributes
    ----------
    intervals : int or tuple of int
        Intervals of each phase.  A single number is meant for a sticking phase; slip phases beside one are short
        and get a quarter of it.
    substeps : int
        Runge-Kutta steps in each half of an interval; doubled where the accuracy asks for it.
    tolerance : float
        Largest error between nodes, see :class:`gaitopt.ocp.transcription.method.Method`.

    Examples
    --------
    >>> from gaitopt import ContactSequence
    >>> MultipleShooting(intervals=40).intervals_for(ContactSequence.parse("slip+ stick | slip+"))
    (10, 40)
    """

    substeps: int = field(default=1, validator=whole_number(1, 64))

    @property
    def name(self) -> str:
        """Name with the number of substeps."""
        return f"multiple shooting, {self.substeps} substeps"

    @property
    def scheme(self) -> RungeKutta:
        """Runge-Kutta steps."""
        return RungeKutta(self.substeps)

    def finer(self) -> "MultipleShooting | None":
        """Return the method with twice the substeps."""
        return evolve(self, substeps=2 * self.substeps) if self.substeps < MOST_SUBSTEPS else None
