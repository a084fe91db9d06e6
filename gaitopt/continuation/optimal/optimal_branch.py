"""Branches of optimal gaits over a parameter, as plain arrays."""

from dataclasses import field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.motion.summary import plain


@check_arguments
@dataclass(frozen=True, eq=False, kw_only=True)
class OptimalSpecialPoint:
    """A special point of a branch of optimal gaits.

    Strict complementarity or the second-order conditions fail there, or the optimal cost is stationary.

    Attributes
    ----------
    kind : str
        ``"activation"``: a slack vanishes and the constraint becomes active; ``"deactivation"``: its multiplier
        vanishes and it becomes inactive; ``"turning_point"``: the reduced Hessian is singular; ``"cost_extremum"``: the
        derivative of the optimal cost with respect to the parameter is zero.
    value, width : float
        Parameter, and the error of its location.
    cost : float
    constraint : str
        Name and place of the constraint; empty for the other kinds.
    before, after : str
        ``"active"`` or ``"inactive"``, in the direction of the branch; otherwise the contact sequence.
    state : (n,) array
        State after touchdown [rad, rad/s, m/s].
    turns : bool
        Whether the parameter turns back.
    place : int
        Number of gaits of the branch before this point.

    Examples
    --------
    >>> import numpy as np
    >>> print(OptimalSpecialPoint(kind="activation", value=0.2, width=1e-16, cost=1.0, before="inactive",
    ...                           after="active", constraint="impact friction cone", state=np.zeros(4)))
    activation at 0.2: impact friction cone
    """

    kind: str
    value: float
    width: float
    cost: float
    constraint: str = ""
    before: str
    after: str
    state: Array = field(repr=False)
    turns: bool = False
    place: int = 0

    def __str__(self) -> str:
        return f"{self.kind} at {self.value:.10g}" + (f": {self.constraint}" if self.constraint else "")

    @property
    def label(self) -> str:
        """Kind for tables and figures."""
        return self.kind.replace("_", " ")


@check_arguments
@dataclass(frozen=True, eq=False, kw_only=True)
class OptimalBranch:
    """A branch of optimal gaits of one contact sequence on one grid.

    Attributes
    ----------
    kind : str
        ``"optimal"``.
    sequence : str
    names : tuple of str
        Coordinates of the state after touchdown.
    values : (K,) array
        Parameter of each gait, in order along the branch.
    costs, cost_slopes, cost_errors : (K,) arrays
        Objective, its derivative with respect to the parameter (envelope theorem), and the estimated relative
        difference of the objective from its value on an infinitely fine grid; nan if it is not known.
    states : (K, n) array
        State after touchdown [rad, rad/s, m/s].
    multipliers : (K, n) complex array
        Multipliers of the gait with its torques in open loop, from the replay; nan without one.
    replayed, passed : (K,) bool arrays
        Whether the gait was replayed in the event-driven simulator, and whether the replay agrees with the plan.
    state_errors : (K,) array
        Largest difference of the state after the replayed step from the planned one.
    negative : (K,) int array
        Number of negative eigenvalues of the reduced Hessian; 0 at a minimum.
    dependent : (K,) int array
        Number of active constraints whose gradients depend on the others; 0 if LICQ is satisfied.
    strictness : (K,) array
        Least multiplier of an active inequality or slack of an inactive one, scaled; positive if strict complementarity
        holds.
    active : (K,) int array
        Number of active inequalities.
    special : tuple of OptimalSpecialPoint
        In order along the branch.
    begin, end : str
        Reasons for which the branch ends on either side.
    parent : int or None
        Number of the branch at whose special point this one was started.

    Examples
    --------
    >>> from gaitopt import Collocation, GaitProblem, Limits, compass_biped
    >>> from gaitopt.continuation import trace_optimum
    >>> problem = GaitProblem(robot=compass_biped(), sequence="stick | stick", friction=0.25, speed=0.6,
    ...                       step_length=0.45, limits=Limits(torque=6), objective="torque_squared",
    ...                       transcription=Collocation(intervals=10))
    >>> branch = trace_optimum(problem, {"friction": (0.25, 0.15)}).branches[0]
    >>> bool(branch.minimum.all()), branch.special[0].kind
    (True, 'activation')
    """

    kind: str = "optimal"
    sequence: str
    names: tuple[str, ...]
    values: Array
    costs: Array
    cost_slopes: Array
    cost_errors: Array
    states: Array
    multipliers: NDArray[np.complex128]
    replayed: NDArray[np.bool_]
    passed: NDArray[np.bool_]
    state_errors: Array
    negative: NDArray[np.int_]
    dependent: NDArray[np.int_]
    strictness: Array
    active: NDArray[np.int_]
    special: tuple[OptimalSpecialPoint, ...]
    begin: str = "start"
    end: str
    parent: int | None = None

    def __repr__(self) -> str:
        ends = f" from {self.values[0]:.6g} to {self.values[-1]:.6g}" if self.values.size else ""
        counts = f"gaits: {self.values.size}{ends}, special points: {len(self.special)}"
        return f"OptimalBranch('{self.sequence}', {counts}, end: {self.end})"

    @property
    def minimum(self) -> NDArray[np.bool_]:
        """Whether each gait is a strict local minimum, shape (K,)."""
        return np.asarray(self.negative == 0)

    @property
    def radii(self) -> Array:
        """Spectral radius of each replayed gait; nan without a replay, shape (K,)."""
        known = np.isfinite(self.multipliers).any(axis=1)
        radii = np.max(np.where(np.isfinite(self.multipliers), np.abs(self.multipliers), 0.0), axis=1, initial=0.0)
        return np.where(known, radii, np.nan)

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether the multipliers of each replayed gait lie inside the unit circle, shape (K,)."""
        return np.asarray(self.radii < 1)

    def special_of(self, kind: str) -> tuple[OptimalSpecialPoint, ...]:
        """Return the special points of a kind."""
        return tuple(point for point in self.special if point.kind == kind)

    def record(self) -> dict[str, Any]:
        """Return the branch as plain data; a multiplier is a pair [real part, imaginary part]."""
        radii = self.radii
        points = [
            {
                "value": float(value),
                "state": dict(zip(self.names, self.states[k].tolist(), strict=True)),
                "multipliers": [[one.real, one.imag] for one in self.multipliers[k].tolist() if np.isfinite(one)],
                "radius": float(radii[k]),
                "stable": bool(radii[k] < 1) if self.replayed[k] else None,
                "cost": float(self.costs[k]),
                "cost_slope": float(self.cost_slopes[k]),
                "cost_error": float(self.cost_errors[k]),
                "minimum": bool(self.minimum[k]),
                "dependent": int(self.dependent[k]),
                "strictness": float(self.strictness[k]),
                "active": int(self.active[k]),
                "replay": ("passed" if self.passed[k] else "failed") if self.replayed[k] else None,
                "state_error": float(self.state_errors[k]),
            }
            for k, value in enumerate(self.values)
        ]
        special = [
            {name: getattr(point, name) for name in ("kind", "value", "width", "cost", "constraint", "before", "after")}
            | {"state": dict(zip(self.names, point.state.tolist(), strict=True)), "turns": point.turns}
            for point in self.special
        ]
        facts = {"kind": self.kind, "period": 1, "sequence": self.sequence, "points": points, "special": special}
        return plain(facts | {"begin": self.begin, "end": self.end, "parent": self.parent})


@check_arguments
@dataclass(frozen=True, kw_only=True)
class LowestCostChange:
    """A value of the parameter at which another contact sequence has the lowest cost.

    Attributes
    ----------
    value, width : float
        Parameter, and the error of its location.
    cost : float
        Cost of both gaits; without a crossing, that of the nearest gait above the value, or nan.
    before, after : str
        Contact sequence of lowest cost below and above the value; empty if no gait is known there.
    crossing : bool
        Whether the costs of two branches are equal; otherwise a branch ends.

    Examples
    --------
    >>> change = LowestCostChange(value=0.15, width=1e-12, cost=2.5, before="slip+ stick | slip+",
    ...                           after="stick | stick")
    >>> change.crossing
    True
    """

    value: float
    width: float
    cost: float
    before: str
    after: str
    crossing: bool = True


@check_arguments
@dataclass(frozen=True, eq=False, kw_only=True)
class OptimalDiagram:
    """Branches of the optimal gaits of a problem over one parameter.

    Attributes
    ----------
    robot : str
    objective : str
    parameter, unit : str
        The values of an angle are in rad.
    parameters : dict of str to float
        All other parameters of robot and ground in SI units.
    ends : (float, float)
        Range of the parameter.
    branches : tuple of OptimalBranch
    borders : tuple of LowestCostChange
        Borders between the ranges in which a contact sequence has the lowest cost, in increasing order.
    complete : bool
        Whether all requested branches were followed.
    targets : dict of str to float
        The fixed ones of ``speed`` [m/s] and ``step_length`` [m]; empty for files of earlier versions.

    Examples
    --------
    >>> OptimalDiagram(robot="compass_biped", objective="torque_squared", parameter="friction", unit="1",
    ...                parameters={}, ends=(0.1, 0.25), branches=())
    OptimalDiagram('compass_biped', 'friction', branches: 0, gaits: 0, special points: 0)
    """

    robot: str
    objective: str
    parameter: str
    unit: str
    parameters: dict[str, float]
    ends: tuple[float, float]
    branches: tuple[OptimalBranch, ...]
    borders: tuple[LowestCostChange, ...] = ()
    complete: bool = True
    targets: dict[str, float] = field(default_factory=dict)

    def __repr__(self) -> str:
        points = sum(branch.values.size for branch in self.branches)
        special = sum(len(branch.special) for branch in self.branches)
        counts = f"branches: {len(self.branches)}, gaits: {points}, special points: {special}"
        return f"OptimalDiagram({self.robot!r}, {self.parameter!r}, {counts})"

    def records(self) -> dict[str, Any]:
        """Return the diagram as plain data for JSON."""
        names = ("robot", "objective", "parameter", "unit", "complete")
        borders = [
            {name: getattr(border, name) for name in ("value", "width", "cost", "before", "after", "crossing")}
            for border in self.borders
        ]
        branches = [branch.record() for branch in self.branches]
        return plain({name: getattr(self, name) for name in names}) | {
            "branches": branches,
            "ratios": [],
            "borders": plain(borders),
        }
