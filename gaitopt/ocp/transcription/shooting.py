"""Multiple shooting: each interval is integrated by classical Runge-Kutta steps from its left node."""

import casadi as ca
from attrs import evolve, field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.motion.printable import format_count
from gaitopt.ocp.nlp.keys import Key
from gaitopt.ocp.transcription.method import Method
from gaitopt.ocp.transcription.scheme import Point, Scheme
from gaitopt.parameters import whole_number

MOST_SUBSTEPS = 8
"""Largest number of substeps of a refined method."""


@dataclass(frozen=True)
class RungeKutta(Scheme):
    """Classical fourth-order steps, the same number in each half of an interval.

    The middle of the interval is a point of the trajectory, at which the path constraints apply as well.

    Attributes
    ----------
    substeps : int
        Number of steps in each half.
    """

    substeps: int = 1
    inner = (0.5,)

    def node_unknowns(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return an empty tuple: accelerations are functions of the state."""
        return ()

    def inner_unknowns(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return an empty tuple: the middle is a function of the left node."""
        return ()

    def residuals(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return an empty tuple."""
        return ()

    def node(self, dynamics: PhaseDynamics, state: ca.SX, torque: ca.SX, unknowns: ca.SX, p: ca.SX) -> Point:
        """Return the point by forward dynamics."""
        rate, force = dynamics.flow(state, torque, p)
        return Point(state, torque, dynamics.parts(rate)[1], force, ca.SX(0, 1), dynamics.slip_speed(state))

    def advance(
        self, dynamics: PhaseDynamics, left: Point, right: Point, unknowns: ca.SX, length: ca.SX, p: ca.SX
    ) -> tuple[ca.SX, list[Point]]:
        """Return the difference between the right node and the integrated end, and the middle."""
        middle, end = dynamics.interval(left.state, left.torque, right.torque, length, p, substeps=self.substeps)
        halfway = self.node(dynamics, middle, (left.torque + right.torque) / 2, unknowns, p)
        return right.state - end, [halfway]


@check_arguments
@frozen(kw_only=True)
class MultipleShooting(Method):
    """Transcription by multiple shooting with fourth-order Runge-Kutta steps.

    Attributes
    ----------
    intervals : int or tuple of int, optional
        Number of intervals of each phase.  A single number is that of a sticking phase; slip phases of the same
        sequence are short and have a quarter of it.  By default nodes are placed where the torques jump.
    cost_tolerance : float, optional
        Largest estimated relative error of the objective due to the grid, see
        :class:`gaitopt.ocp.transcription.method.Method`.
    fractions : tuple of tuple of float, optional
        Instants of the nodes of each phase as fractions of its duration; equal intervals if `intervals` is stated.
    substeps : int
        Number of Runge-Kutta steps in each half of an interval; mesh refinement doubles it.
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
        return f"multiple shooting, {format_count(self.substeps, 'substep')}"

    @property
    def scheme(self) -> RungeKutta:
        """Runge-Kutta steps."""
        return RungeKutta(self.substeps)

    def refine(self) -> "MultipleShooting | None":
        """Return the method with twice the substeps."""
        return evolve(self, substeps=2 * self.substeps) if self.substeps < MOST_SUBSTEPS else None
