"""Collocation of the second-order equations of motion at Lobatto points, with inverse dynamics.

The accelerations at the nodes and inside an interval are unknowns.  They are interpolated by a polynomial, whose first
and second integrals are rates and angles (no copies of those inside the interval).  The equations of motion are imposed
as  M a + h - W^T f - E u = 0  at every point, so no matrix is inverted and each block of the NLP has a few hundred
operations.  Lobatto points contain the nodes: contact forces there are exact, and accelerations, which are continuous
within a phase because torques are, are shared by both neighbouring intervals.  With s points the order is 2 s - 2
(Hairer, Lubich & Wanner, Geometric Numerical Integration, II.1.4).
"""

import functools
from dataclasses import replace

import casadi as ca
import numpy as np
from attrs import evolve, field, frozen
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.lazy import Deferred, LazyField
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.keys import Key, Kind
from gaitopt.ocp.transcription.method import Method
from gaitopt.ocp.transcription.scheme import Point, Scheme
from gaitopt.parameters import whole_number

MOST_POINTS = 6
"""Largest number of points of a refined method; beyond, the torque grid limits the accuracy of a plan."""


@dataclass(frozen=True)
class Lobatto(Scheme):
    """Collocation at the nodes and at the inner points of Lobatto's quadrature.

    Attributes
    ----------
    points : int
        Number of points of an interval, both nodes included.
    """

    points: int = 4
    merged = True

    @property
    def inner(self) -> tuple[float, ...]:  # type: ignore[override]
        """Zeros of P'_(s-1), shifted to (0, 1)."""
        return tuple(float(c) for c in lobatto_points(self.points)[1:-1])

    def node_unknowns(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return the accelerations of a node."""
        return tuple(Key(Kind.ACCELERATION, name) for name in dynamics.moving)

    def inner_unknowns(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return the accelerations of all inner points, point by point."""
        inner = range(1, self.points - 1)
        return tuple(key.at(i) for i in inner for key in self.node_unknowns(dynamics))

    def residuals(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return the equations of motion."""
        return tuple(Key(Kind.EQUATION_OF_MOTION, name) for name in dynamics.moving)

    def node(self, dynamics: PhaseDynamics, state: ca.SX, torque: ca.SX, unknowns: ca.SX, p: ca.SX) -> Point:
        """Return the point with the accelerations `unknowns`."""
        balance = _PointBalance(Deferred(lambda: dynamics.balance(state, unknowns, torque, p)))
        force, residual = Deferred(lambda: balance.parts[1]), Deferred(lambda: balance.parts[0])
        return Point(state, torque, unknowns, force, residual, dynamics.slip_speed(state))

    def advance(
        self, dynamics: PhaseDynamics, left: Point, right: Point, unknowns: ca.SX, length: ca.SX, p: ca.SX
    ) -> tuple[ca.SX, list[Point]]:
        """Return the difference between the right node and the end of the polynomial, and the inner points."""
        inner = ca.vertsplit(unknowns, dynamics.n_a)
        accelerations = ca.horzcat(left.acceleration, *inner, right.acceleration)
        places, speeds = dynamics.parts(left.state)
        fractions, count = lobatto_points(self.points), self.points - 1
        # One column for each inner point and for the end.
        integrated = ca.horzcat(speeds, length * accelerations) @ _state_integrals(self.points)
        positions = ca.repmat(places, 1, count) + length * integrated[:, count:]
        states = ca.horzsplit(dynamics.join(positions, integrated[:, :count]))

        points, rise = [], right.torque - left.torque
        for fraction, acceleration, definition in zip(fractions[1:-1].tolist(), inner, states[:-1], strict=True):
            torque = left.torque + rise * fraction
            point = self.node(dynamics, ca.SX.sym("inner state", dynamics.n_x), torque, acceleration, p)
            points.append(replace(point, definition=definition))
        return right.state - states[-1], points


@dataclass(frozen=True, eq=False)
class _PointBalance:
    """Residual of the equations of motion and contact force of a point, derived together when one is first read."""

    parts: LazyField[tuple[ca.SX, ca.SX]] = LazyField()


@functools.cache
def lobatto_points(count: int) -> Array:
    """Return the points of Lobatto's quadrature on [0, 1], shape (count,)."""
    inner = Legendre.basis(count - 1).deriv().roots()
    return (1 + np.concatenate([[-1.0], np.sort(np.real(inner)), [1.0]])) / 2


@functools.cache
def integrals(count: int) -> tuple[Array, Array]:
    """Return the first and second integrals of the Lagrange polynomials up to each point.

    Both have shape (count, count): row i integrates from 0 to point i, column j is the polynomial of point j.
    """
    at = lobatto_points(count)
    once, twice = np.empty((count, count)), np.empty((count, count))
    for j in range(count):
        others = np.delete(at, j)
        basis = Polynomial.fromroots(others) / np.prod(at[j] - others)
        once[:, j], twice[:, j] = basis.integ(1)(at), basis.integ(2)(at)
    return once, twice


@functools.cache
def _state_integrals(count: int) -> ca.DM:
    """Return the matrix from speeds and accelerations times the length of an interval to speeds and displacements.

    Its shape is (count + 1, 2 (count - 1)): columns are the speeds at all points but the first, then the displacements
    divided by the length.
    """
    once, twice = integrals(count)
    speeds = np.vstack([np.ones(count - 1), once[1:].T])
    return ca.DM(np.hstack([speeds, np.vstack([lobatto_points(count)[1:], twice[1:].T])]))


@functools.cache
def end_slopes(count: int) -> Array:
    """Return the derivatives of the Lagrange polynomials at the end of the interval, shape (count,)."""
    at = lobatto_points(count)
    bases = [Polynomial.fromroots(np.delete(at, j)) / np.prod(at[j] - np.delete(at, j)) for j in range(count)]
    return np.array([basis.deriv()(1.0) for basis in bases])


@check_arguments
@frozen(kw_only=True)
class Collocation(Method):
    """Transcription by Lobatto collocation in second-order form with inverse dynamics.

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
    points : int
        Collocation points of an interval, nodes included: 3 is the Hermite-Simpson method (order 4), 4 has order 6.
        Mesh refinement raises it by one at a time.
    tolerance : float
        Largest error between nodes, see :class:`gaitopt.ocp.transcription.method.Method`.

    Examples
    --------
    >>> Collocation(intervals=20).name
    'collocation, 4 Lobatto points'
    """

    points: int = field(default=4, validator=whole_number(3, 8))

    @property
    def name(self) -> str:
        """Name with the number of points."""
        return f"collocation, {self.points} Lobatto points"

    @property
    def scheme(self) -> Lobatto:
        """Lobatto collocation."""
        return Lobatto(self.points)

    def refine(self) -> "Collocation | None":
        """Return the method with one more point."""
        return evolve(self, points=self.points + 1) if self.points < MOST_POINTS else None
