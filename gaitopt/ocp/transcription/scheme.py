"""Schemes: the unknowns and equations of the motion within one interval."""

import functools
from abc import ABC, abstractmethod
from dataclasses import field

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.lazy import LazyField
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.keys import Key, Kind, Unknown
from gaitopt.ocp.transcription.relaxation import Pair


@dataclass(frozen=True, eq=False)
class Point:
    """The motion at one instant of a phase, as expressions.

    Attributes
    ----------
    state : SX, shape (n_x, 1)
    torque : SX, shape (n_u, 1)
    acceleration : SX, shape (n_a, 1)
    force : SX, shape (2, 1) [N]
    residual : SX
        Residual of the equations of motion; empty if the acceleration is not an unknown.  It and the force may be
        deferred, since they are not used at both ends of an interval.
    slip_speed : SX [m/s]
        Absolute speed of the foot.
    pairs : list of Pair
        Complementarity pairs of friction, if the contact mode is open.
    definition : SX or None
        Expression for which the symbols of `state` stand; None if `state` itself is an expression of the unknowns.
        Derivatives need fewer operations if the state is a simple function of many unknowns.
    """

    state: ca.SX
    torque: ca.SX
    acceleration: ca.SX
    force: LazyField[ca.SX] = LazyField()
    residual: LazyField[ca.SX] = LazyField()
    slip_speed: ca.SX = field(default_factory=lambda: ca.SX(0))
    pairs: list[Pair] = field(default_factory=list)
    definition: ca.SX | None = None


class Scheme(ABC):
    """Integration of an interval between two nodes.

    A custom scheme is derived from this class and used by a :class:`gaitopt.ocp.transcription.method.Method`.  States
    and torques at the nodes are unknowns of every scheme, torques are linear between nodes, and friction cone, slip
    direction and joint powers are constrained at the nodes and at the inner points of the scheme.

    Attributes
    ----------
    inner : tuple of float
        Fractions of the interval, strictly between 0 and 1, at which the motion is known besides the nodes.
    nodal : bool
        Whether torques, powers and forces are known at the nodes.  If not, each interval has one torque, and all
        constraints apply at the inner points.
    inner_table : Unknown
        Table of the unknowns inside the intervals.
    merged : bool
        Whether the equations of an interval have few common subexpressions, so that the NLP need not merge them.
    """

    inner: tuple[float, ...]
    nodal: bool = True
    inner_table: Unknown = Unknown.INNER_ACCELERATION
    merged: bool = False

    @abstractmethod
    def node_unknowns(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return the keys of a node's unknowns besides state and torque."""

    @abstractmethod
    def inner_unknowns(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return the keys of the unknowns inside an interval."""

    @abstractmethod
    def residuals(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return the keys of the residuals of a point."""

    def defects(self, dynamics: PhaseDynamics) -> tuple[Key, ...]:
        """Return the keys of the defects between a node and the next."""
        return tuple(Key(Kind.DYNAMICS, name) for name in dynamics.state_names)

    @abstractmethod
    def node(self, dynamics: PhaseDynamics, state: ca.SX, torque: ca.SX, unknowns: ca.SX, p: ca.SX) -> Point:
        """Return the point at a node with its unknowns."""

    @abstractmethod
    def advance(
        self, dynamics: PhaseDynamics, left: Point, right: Point, unknowns: ca.SX, length: ca.SX, p: ca.SX
    ) -> tuple[ca.SX, list[Point]]:
        """Return the defects between the nodes of an interval, and the inner points.

        Parameters
        ----------
        left, right : Point
            Nodes at both ends.
        unknowns : SX
            Unknowns inside the interval.
        length : SX [s]
            Length of the interval.
        """

    @property
    def fractions(self) -> Array:
        """Fractions of start, inner points and end, shape (len(inner) + 2,)."""
        return np.array([0.0, *self.inner, 1.0])

    @property
    def power_fractions(self) -> Array:
        """Fractions of the interval between which the joint powers are interpolated, at least four if `nodal`."""
        return self.fractions if len(self.inner) != 1 or not self.nodal else np.linspace(0.0, 1.0, 4)

    def smooth_weights(self) -> Array:
        """Return weights of start, inner points and end for a smooth integrand, shape (len(inner) + 2,).

        They integrate polynomials through all points exactly; Simpson's rule and Lobatto's rules are of this kind.
        """
        return _interpolatory_weights(tuple(self.inner))

    def kinked_weights(self) -> Array:
        """Return trapezoidal weights, which do not underestimate the integral over a kink."""
        gaps = np.diff([0.0, *self.inner, 1.0])
        return (np.append(gaps, 0.0) + np.append(0.0, gaps)) / 2


@functools.cache
def _interpolatory_weights(inner: tuple[float, ...]) -> Array:
    """Return the weights that integrate polynomials through the ends of [0, 1] and some inner points exactly."""
    at = np.array([0.0, *inner, 1.0])
    powers = np.arange(at.size)
    weights = np.asarray(np.linalg.solve(np.vander(at, increasing=True).T, 1 / (powers + 1)))
    weights.flags.writeable = False
    return weights
