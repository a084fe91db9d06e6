"""Elastic form of an NLP: each selected limit is relaxed by a slack, and the weighted sum of the slacks is minimised.

minimise    prices' s + 1/2 proximal |(x - reference) / sizes|^2
subject to  lower <= g <= upper  without the relaxed sides,
            v_i + c_i s_k >= lower_i or v_i - c_i s_k <= upper_i  for the relaxed sides,  s >= 0,

where v_i is a constraint row or an unknown and all sides of one limit have the same slack s_k.  The optimum has s = 0
if the NLP is feasible near the initial point.  The proximal term, whose weight is small, makes the minimum unique.
"""

import functools
import math
from typing import Protocol

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.nlp import Derivatives, Nlp
from gaitopt.ocp.nlp.nlp_solver import NlpResult, NlpSolver
from gaitopt.progress import Observer
from gaitopt.status import Status

PROXIMAL = 1e-4
"""Weight of the proximal term."""

BARRIER = 1e-2
"""Barrier parameter of a warm start with other prices."""


@dataclass(frozen=True)
class RelaxedSide:
    """One side of the bounds of a constraint row or of an unknown that a slack relaxes.

    Attributes
    ----------
    limit : int
        Number of the limit, and of its slack.
    is_row : bool
        Whether `index` is that of a constraint row; otherwise it is that of an unknown.
    index : int
    is_lower : bool
        Whether the lower bound is relaxed; otherwise the upper one is.
    scale : float
        Excess over the bound per unit of the slack.
    """

    limit: int
    is_row: bool
    index: int
    is_lower: bool
    scale: float = 1.0


@dataclass(frozen=True, eq=False)
class ElasticResult:
    """Result of an elastic solve.

    Attributes
    ----------
    status : Status
    x : (n_variables,) array
        Unknowns of the original NLP.
    slacks : (n_limits,) array
        Excess over each limit, in its unit.
    active : (n_limits,) array
        Sum of the absolute multipliers of each limit, relative to its price: 0 for a limit that is not active.
    iterations : int
    multipliers : arrays
        Multipliers of the bounds and constraints of the elastic NLP.
    """

    status: Status
    x: Array
    slacks: Array
    active: Array
    iterations: int
    multipliers: tuple[Array, Array]


class ElasticForm(Protocol):
    """A problem with elastic limits; see :class:`ElasticNlp`, whose attributes and methods it has."""

    @property
    def sides(self) -> tuple[RelaxedSide, ...]:
        """Relaxed sides of the bounds."""

    @property
    def n_limits(self) -> int:
        """Number of slacks."""

    def find_excesses(self, x: Array, data: Array) -> tuple[Array, list[RelaxedSide | None]]:
        """Return the excess of a point over each limit, and the side of largest excess."""

    def minimise(
        self,
        x: Array,
        data: Array,
        prices: Array,
        solver: NlpSolver,
        observer: Observer,
        multipliers: tuple[Array, Array] | None = None,
    ) -> ElasticResult:
        """Minimise the weighted sum of the slacks."""


class ElasticNlp:
    """An NLP with elastic limits.

    Parameters
    ----------
    nlp : Nlp
    bounds : Bounds
    sides : tuple of RelaxedSide
    sizes : (n_variables,) array
        Typical sizes of the unknowns.
    least : (n_variables,) array
        Lower bounds of the unknowns that are not relaxed.
    """

    def __init__(self, nlp: Nlp, bounds: Bounds, sides: tuple[RelaxedSide, ...], sizes: Array, least: Array) -> None:
        self._original, self.sides, self._sizes = nlp, sides, sizes
        self.n_limits = 1 + max(side.limit for side in sides)
        self.nlp = _assemble(nlp, sides, self.n_limits)
        self._limits = np.array([_bound(bounds, side) for side in sides])
        self._bounds = self._relax_bounds(bounds, least)

    def minimise(
        self,
        x: Array,
        data: Array,
        prices: Array,
        solver: NlpSolver,
        observer: Observer,
        multipliers: tuple[Array, Array] | None = None,
    ) -> ElasticResult:
        """Minimise the weighted sum of the slacks.

        Parameters
        ----------
        x : (n_variables,) array
            Initial point and centre of the proximal term.
        data : (n_z,) array
        prices : (n_limits,) array
            Weight of each slack.
        solver : NlpSolver
        observer : Observer
        multipliers : arrays, optional
            Multipliers at the initial point, from which the solver is warm-started.
        """
        all_data = np.concatenate([data, prices, x, 1 / self._sizes])
        initial = np.concatenate([x, self.find_excesses(x, data)[0]])
        result = solver.minimise(self.nlp, initial, all_data, self._bounds, observer, multipliers, BARRIER)
        n = self._original.n_variables
        slacks, active = np.maximum(result.x[n:], 0), self._activity(result, prices)
        return ElasticResult(result.status, result.x[:n], slacks, active, result.iterations, result.multipliers)

    def zero_multipliers(self) -> tuple[Array, Array]:
        """Return multipliers of zero, with which the solver stays near its initial point."""
        return np.zeros(self.nlp.n_variables), np.zeros(self.nlp.n_constraints)

    @defer_interrupt()
    def find_excesses(self, x: Array, data: Array) -> tuple[Array, list[RelaxedSide | None]]:
        """Return the excess of a point over each limit, shape (n_limits,), and the side of largest excess, if any."""
        g = np.asarray(self._original.derivatives["jac_g"](x, data)[0]).ravel()
        excesses = np.zeros(self.n_limits)
        worst: list[RelaxedSide | None] = [None] * self.n_limits
        for side, bound in zip(self.sides, self._limits, strict=True):
            value = g[side.index] if side.is_row else x[side.index]
            excess = (bound - value if side.is_lower else value - bound) / side.scale
            if excess > excesses[side.limit]:
                excesses[side.limit], worst[side.limit] = excess, side
        return excesses, worst

    def _activity(self, result: NlpResult, prices: Array) -> Array:
        """Return the sums of the absolute multipliers; those of both sides of a fixed value cancel."""
        net: dict[tuple[int, bool, int], float] = {}
        multipliers = result.multipliers[1][self._original.n_constraints :]
        for side, multiplier in zip(self.sides, multipliers, strict=True):
            key = (side.limit, side.is_row, side.index)
            net[key] = net.get(key, 0.0) + float(multiplier) * side.scale
        sums = np.bincount([limit for limit, *_ in net], np.abs([*net.values()]), self.n_limits)
        return sums / prices

    def _relax_bounds(self, bounds: Bounds, least: Array) -> Bounds:
        """Return the bounds of the elastic NLP: the relaxed sides become rows."""
        x_lower, x_upper = bounds.x_lower.copy(), bounds.x_upper.copy()
        g_lower, g_upper = bounds.g_lower.copy(), bounds.g_upper.copy()
        is_lower = np.array([side.is_lower for side in self.sides])
        for side in self.sides:
            lower, upper = (g_lower, g_upper) if side.is_row else (x_lower, x_upper)
            (lower if side.is_lower else upper)[side.index] = -math.inf if side.is_lower else math.inf
        return Bounds(
            np.concatenate([np.maximum(x_lower, least), np.zeros(self.n_limits)]),
            np.concatenate([x_upper, np.full(self.n_limits, math.inf)]),
            np.concatenate([g_lower, np.where(is_lower, self._limits, -math.inf)]),
            np.concatenate([g_upper, np.where(is_lower, math.inf, self._limits)]),
        )


@functools.lru_cache(maxsize=16)
def _assemble(nlp: Nlp, sides: tuple[RelaxedSide, ...], n_limits: int) -> Nlp:
    """Return the elastic NLP; its data are those of the NLP, the prices, the reference and the inverse sizes."""
    n, m, count = nlp.n_variables, nlp.n_constraints, len(sides)
    n_data = nlp.derivatives["grad_f"].size1_in(1)
    x, z = ca.MX.sym("x", n + n_limits), ca.MX.sym("z", n_data + n_limits + 2 * n)
    inner, slacks = x[:n], x[n:]
    data, prices, reference, inverse = ca.vertsplit(z, [0, n_data, n_data + n_limits, n_data + n_limits + n, z.numel()])
    shift = (inner - reference) * inverse
    f = ca.dot(prices, slacks) + PROXIMAL / 2 * ca.dot(shift, shift)
    gradient = ca.vertcat(PROXIMAL * shift * inverse, prices)

    g, jacobian = nlp.derivatives["jac_g"](inner, data)
    selection = _select(sides, n, m)
    signs = [side.scale if side.is_lower else -side.scale for side in sides]
    slack_part = ca.DM.triplet(list(range(count)), [side.limit for side in sides], signs, count, n_limits)
    both = ca.vertcat(g, inner)
    g_all = ca.vertcat(g, ca.mtimes(selection, both) + ca.mtimes(slack_part, slacks))
    stacked = ca.vertcat(jacobian, ca.MX(ca.DM.eye(n)))
    jac_all = ca.blockcat([[jacobian, ca.MX(m, n_limits)], [ca.mtimes(ca.MX(selection), stacked), ca.MX(slack_part)]])

    def hessian(weight: ca.MX, multipliers: ca.MX) -> ca.MX:
        on_rows = multipliers[:m] + ca.mtimes(selection[:, :m].T, multipliers[m:])
        curvature = nlp.derivatives["hess_lag"](inner, data, 0, on_rows)
        return ca.diagcat(curvature + weight * PROXIMAL * ca.diag(inverse * inverse), ca.MX(n_limits, n_limits))

    inputs = x, z, ca.MX.sym("lam_f"), ca.MX.sym("lam_g", m + count)
    derivatives = Derivatives(inputs, (f, gradient), (g_all, jac_all), hessian)
    return Nlp(
        functions={"x": x, "p": z, "f": f, "g": g_all},
        derivatives=derivatives,
        objective=ca.Function("objective", [x, z], [f]),
        n_variables=n + n_limits,
        n_constraints=m + count,
        independent=nlp.independent,  # each further row contains a slack
    )


def _bound(bounds: Bounds, side: RelaxedSide) -> float:
    lower, upper = (bounds.g_lower, bounds.g_upper) if side.is_row else (bounds.x_lower, bounds.x_upper)
    return float((lower if side.is_lower else upper)[side.index])


def _select(sides: tuple[RelaxedSide, ...], n: int, m: int) -> ca.DM:
    """Return the matrix that selects the relaxed values from constraint rows and unknowns, shape (sides, m + n)."""
    columns = [side.index if side.is_row else m + side.index for side in sides]
    return ca.DM.triplet(list(range(len(sides))), columns, [1.0] * len(sides), len(sides), m + n)
