"""Points of the optimality conditions with one set of active constraints, and their linearisation.

For an active set A the conditions are equations in the free unknowns x, the multipliers m of the active rows and the
parameter s:

    slope(x, m, s) = 0  in the free unknowns,    g(x, s) = b(s)  in the active rows.

Unknowns at an active bound move with it.  Constraints are counted in one vector, the unknowns first, then the rows.
"""

from typing import TYPE_CHECKING

import numpy as np
import scipy  # which imports its parts when they are used
from numpy.typing import NDArray

from gaitopt.continuation.optimal.parametric_nlp import ParametricNlp
from gaitopt.dataclass import dataclass
from gaitopt.locks import cached_property
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.optimality_system import SOFT, DataSlopes, OptimalityFactors, OptimalityValues
from gaitopt.ocp.problem import GaitProblem

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

NEGLIGIBLE = 1e-13
"""Square of the distance of a unit gradient from the others below which it depends on them."""


@dataclass(frozen=True, eq=False)
class ActiveSet:
    """Active bounds and rows.

    Attributes
    ----------
    sides : (n,) int array
        1 if the upper bound is active, -1 if the lower one is, 0 otherwise; 1 for equalities.
    equal : (n,) bool array
        Equalities.
    size : int
        Number of unknowns.
    """

    sides: NDArray[np.int8]
    equal: NDArray[np.bool_]
    size: int

    @cached_property
    def free(self) -> NDArray[np.intp]:
        """Indices of the unknowns at no bound."""
        return np.flatnonzero(self.sides[: self.size] == 0)

    @cached_property
    def fixed(self) -> NDArray[np.bool_]:
        """Whether each unknown is at an active bound."""
        return np.asarray(self.sides[: self.size] != 0)

    @cached_property
    def rows(self) -> NDArray[np.intp]:
        """Indices of the active rows, counted from the first row."""
        return np.flatnonzero(self.sides[self.size :])

    @property
    def count(self) -> int:
        """Number of free unknowns and active rows."""
        return int(self.free.size + self.rows.size)

    @property
    def inequalities(self) -> NDArray[np.intp]:
        """Indices of the active inequalities."""
        return np.flatnonzero((self.sides != 0) & ~self.equal)

    def switch(self, index: int, side: int) -> "ActiveSet":
        """Return the set in which a constraint is active at a side, or inactive if `side` is 0."""
        sides = self.sides.copy()
        sides[index] = side
        return ActiveSet(sides, self.equal, self.size)


@dataclass(frozen=True, eq=False)
class KktPoint:
    """Unknowns, multipliers of all rows for the scaled objective, and the value of the parameter."""

    x: Array
    multipliers: Array
    value: float


class KktLinearisation:
    """Values and derivatives of the optimality conditions at a point, for one active set.

    Parameters
    ----------
    nlp : ParametricNlp
    point : KktPoint
        Its fixed unknowns are moved to their bounds.
    active : ActiveSet
    """

    def __init__(self, nlp: ParametricNlp, point: KktPoint, active: ActiveSet) -> None:
        self.nlp, self.active = nlp, active
        self.lower, self.upper = nlp.lower.at(point.value), nlp.upper.at(point.value)
        self.bound = np.where(active.sides < 0, self.lower, self.upper)
        self.bound_slope = np.where(active.sides < 0, nlp.lower.slope, nlp.upper.slope)
        n = nlp.size
        x = np.where(active.fixed, self.bound[:n], point.x)
        multipliers = np.where(active.sides[n:] != 0, point.multipliers, 0.0)
        self.point, self.data = KktPoint(x, multipliers, point.value), nlp.data.at(point.value)
        self.values: OptimalityValues = nlp.system.evaluate(x, multipliers, self.data)

    @cached_property
    def problem(self) -> GaitProblem:
        """The gait problem at this value of the parameter."""
        return self.nlp.problem_at(self.point.value)

    @property
    def residual(self) -> Array:
        """Residuals: slope in the free unknowns, and distances of the active rows from their bounds."""
        active, values, n = self.active, self.values, self.nlp.size
        return np.concatenate([values.slope[active.free], (values.g - self.bound[n:])[active.rows]])

    @cached_property
    def derivatives(self) -> tuple["csc_matrix", "csc_matrix"]:
        """Jacobian of the rows and Hessian of the scaled Lagrangian."""
        return self.nlp.system.differentiate(self.point.x, self.point.multipliers, self.data)

    @property
    def jacobian(self) -> "csc_matrix":
        """Jacobian of the rows."""
        return self.derivatives[0]

    @property
    def hessian(self) -> "csc_matrix":
        """Hessian of the scaled Lagrangian."""
        return self.derivatives[1]

    @cached_property
    def slopes(self) -> DataSlopes:
        """Derivatives with respect to the parameter through the data alone."""
        return self.nlp.system.differentiate_by_data(
            self.point.x, self.point.multipliers, self.data, self.nlp.data.slope
        )

    @cached_property
    def by_value(self) -> tuple[Array, Array]:
        """Derivatives of slope and rows with respect to the parameter; the fixed unknowns move with their bounds."""
        moves = np.where(self.active.fixed, self.bound_slope[: self.nlp.size], 0.0)
        slope, g = self.slopes.slope, self.slopes.g
        if np.any(moves):
            slope, g = slope + self.hessian @ moves, g + self.jacobian @ moves
        return slope, g

    @cached_property
    def matrix(self) -> "csc_matrix":
        """Derivative of the residuals with respect to the free unknowns and the multipliers of the active rows."""
        active, sparse = self.active, scipy.sparse
        rows = self.jacobian[:, active.free].tocsr()[active.rows]
        hessian = self.hessian[:, active.free][active.free]
        return sparse.bmat([[hessian, rows.T], [rows, -SOFT * sparse.identity(active.rows.size)]], format="csc")

    @cached_property
    def column(self) -> Array:
        """Derivative of the residuals with respect to the parameter."""
        slope, g = self.by_value
        return np.concatenate([slope[self.active.free], (g - self.bound_slope[self.nlp.size :])[self.active.rows]])

    @cached_property
    def factors(self) -> OptimalityFactors:
        """Factors of the matrix."""
        rows = self.active.sides[self.nlp.size :] != 0
        return self.nlp.system.factorise(self.point.x, self.point.multipliers, self.data, rows, self.active.fixed)

    @cached_property
    def negative(self) -> int:
        """Number of negative eigenvalues of the reduced Hessian."""
        return self.factors.negative

    def solve(self, right: Array) -> Array:
        """Return the packed vector that the matrix maps to a right side."""
        active, n = self.active, self.nlp.size
        full = np.zeros(active.sides.size)
        full[active.free], full[n + active.rows] = right[: active.free.size], right[active.free.size :]
        solution = self.factors.solve(full)
        return np.concatenate([solution[active.free], solution[n + active.rows]])

    @cached_property
    def by_parameter(self) -> Array:
        """Derivative of the packed vector with respect to the parameter along the curve; large near a turning point."""
        return -self.solve(self.column)

    @cached_property
    def dependent(self) -> int:
        """Number of active rows whose gradients depend on those of the others; 0 if LICQ is satisfied."""
        sparse, sizes = scipy.sparse, self.nlp.sizes[self.active.free]
        rows = self.jacobian[:, self.active.free].tocsr()[self.active.rows] @ sparse.diags(sizes)
        lengths = np.sqrt(np.asarray(rows.multiply(rows).sum(axis=1)).ravel())
        rows = sparse.diags(1 / np.maximum(lengths, np.finfo(float).tiny)) @ rows
        products = (rows @ rows.T + NEGLIGIBLE * sparse.identity(rows.shape[0])).tocsc()
        options = {"SymmetricMode": True}
        factors = sparse.linalg.splu(products, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options)
        return int(np.count_nonzero(np.abs(factors.U.diagonal()) < 10 * NEGLIGIBLE))

    @cached_property
    def margins(self) -> Array:
        """Slack of each inactive constraint, signed multiplier of each active one; inf without a bound, (n,) array.

        All are positive at a solution with strict complementarity.
        """
        positions = np.concatenate([self.point.x, self.values.g])
        multipliers = np.concatenate([-self.values.slope, self.point.multipliers])
        slacks = np.minimum(positions - self.lower, self.upper - positions)
        sides = self.active.sides
        return np.where(self.active.equal, np.inf, np.where(sides != 0, sides * multipliers, slacks))

    @property
    def cost(self) -> float:
        """Objective."""
        return self.values.f

    @property
    def bound_multipliers(self) -> Array:
        """Multipliers of the bounds of the unknowns for the scaled objective, (n_variables,) array."""
        return np.where(self.active.fixed, -self.values.slope, 0.0)

    @cached_property
    def cost_slope(self) -> float:
        """Derivative of the optimal cost with respect to the parameter, that of the Lagrangian (envelope theorem)."""
        on_bounds, on_rows, n = self.bound_multipliers, self.point.multipliers, self.nlp.size
        moves = on_bounds @ self.bound_slope[:n] + on_rows @ self.bound_slope[n:]
        typical = self.nlp.transcription.nlp.typical
        system, x = self.nlp.system, self.point.x
        by_data = system.differentiate_lagrangian(x, on_rows, self.data, self.nlp.data.slope)
        return by_data - typical * float(moves)

    @property
    def strictness(self) -> float:
        """Least multiplier of an active inequality or slack of an inactive one, positive at strict optima."""
        return float(self.margins.min())

    def respond_to_multiplier(self, index: int, side: int) -> Array:
        """Return the change of all multipliers by a unit multiplier of an inactive constraint, (n,) array.

        Parameters
        ----------
        index : int
        side : int
            Side of the constraint.
        """
        n, active = self.nlp.size, self.active
        gradient = np.zeros(n)
        if index < n:
            gradient[index] = side
        else:
            gradient = side * self.jacobian[index - n].toarray().ravel()
        packed = self.solve(np.concatenate([-gradient[active.free], np.zeros(active.rows.size)]))
        x, multipliers = np.zeros(n), np.zeros(active.sides.size)
        x[active.free], multipliers[n + active.rows] = packed[: active.free.size], packed[active.free.size :]
        slope = self.hessian @ x + self.jacobian.T @ multipliers[n:] + gradient
        multipliers[:n] = np.where(active.fixed, -slope, 0.0)
        return multipliers

    def nearest_side(self, index: int) -> int:
        """Return the side of the nearer bound of a constraint."""
        n = self.nlp.size
        position = self.point.x[index] if index < n else self.values.g[index - n]
        return 1 if self.upper[index] - position <= position - self.lower[index] else -1

    def differentiate_margin(self, index: int) -> tuple[Array, float]:
        """Return the derivatives of a margin with respect to free unknowns and active multipliers, and the parameter.

        That of an inactive constraint is the slack at its nearer bound.
        """
        active, n = self.active, self.nlp.size
        row, side = np.zeros(active.count), int(active.sides[index])
        slope, g = self.by_value
        if side and index >= n:  # the multiplier of a row
            row[active.free.size + np.searchsorted(active.rows, index - n)] = side
            return row, 0.0
        if side:  # the multiplier of a bound
            row[: active.free.size] = -side * self.hessian[:, [index]].toarray().ravel()[active.free]
            row[active.free.size :] = -side * self.jacobian[:, [index]].toarray().ravel()[active.rows]
            return row, -side * float(slope[index])
        side = self.nearest_side(index)
        limit = (self.nlp.upper if side > 0 else self.nlp.lower).slope[index]
        if index >= n:
            row[: active.free.size] = -side * self.jacobian[index - n].toarray().ravel()[active.free]
            return row, side * float(limit - g[index - n])
        row[np.searchsorted(active.free, index)] = -side
        return row, side * float(limit)

    def pack(self, x: Array, multipliers: Array) -> Array:
        """Return free unknowns and multipliers of active rows as one vector."""
        return np.concatenate([x[self.active.free], multipliers[self.active.rows]])

    def move(self, change: Array, value: float) -> KktPoint:
        """Return the point after a change of the packed vector, at a value of the parameter."""
        x, multipliers = self.point.x.copy(), self.point.multipliers.copy()
        count = self.active.free.size
        x[self.active.free] += change[:count]
        multipliers[self.active.rows] += change[count:]
        return KktPoint(x, multipliers, value)
