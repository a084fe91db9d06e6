"""Search for the limits that conflict in an infeasible problem, among those that its elastic form relaxes."""

import math
from collections.abc import Sequence

import numpy as np
from attrs import evolve

from gaitopt.motion.conflict import Conflict
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.active_set import Newton
from gaitopt.ocp.nlp.elastic import ElasticForm, ElasticResult
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.solution.relaxable_limits import RelaxableLimit
from gaitopt.progress import Observer
from gaitopt.status import Status

FEASIBLE = 1e-5
"""Weighted sum of the slacks below which a motion satisfies all limits; for feasible problems it is below 1e-7."""

FARTHEST = 5.0
"""Largest change of a limit, in units of its size, that is predicted by its multiplier and tried."""

PROHIBITIVE = 100.0
"""Factor of the price of limits that are not to be exceeded."""


SAFETY_FACTOR = 1.02
"""Factor of the missing amount in the value that is reported as sufficient."""

ELASTIC_TOLERANCE, ELASTIC_ITERATIONS, ITERATIONS_PER_PHASE = 1e-6, 80, 40
"""Tolerance of an elastic solve, and its largest number of iterations: the larger of a number and that for each phase.

Most take 15 to 50 iterations; with three phases some take 104.
"""


class ElasticLimits:
    """The elastic form of a problem, whose objective is replaced by the excess over its limits.

    Parameters
    ----------
    elastic : ElasticForm
    limits : sequence of RelaxableLimit
        Its limits; the last ones may have no side in `elastic`.
    data : array
        Data of the problem.
    solver : NlpSolver
    observer : Observer
    """

    def __init__(
        self,
        elastic: ElasticForm,
        limits: Sequence[RelaxableLimit],
        data: Array,
        solver: NlpSolver,
        observer: Observer,
    ) -> None:
        self._elastic, self.limits, self._data, self._solver, self._observer = elastic, limits, data, solver, observer
        self.prices = np.array([1 / limit.size for limit in limits[: elastic.n_limits]])

    def minimise_from(self, x: Array) -> ElasticResult:
        """Return the motion near a point with the least excess over the limits."""
        return self._minimise(x, self.prices)

    def find_sufficient_friction(self, x: Array) -> float:
        """Return the friction coefficient whose cones contain all forces of a motion; nan if it is not determined."""
        return math.nan

    def exceed_only(
        self, members: list[int], x: Array, multipliers: tuple[Array, Array] | None = None
    ) -> ElasticResult:
        """Return the motion near a point that exceeds some limits as little as possible and, if possible, no others."""
        prices = PROHIBITIVE * self.prices
        prices[members] = self.prices[members]
        return self._minimise(x, prices, multipliers)

    def _minimise(self, x: Array, prices: Array, multipliers: tuple[Array, Array] | None = None) -> ElasticResult:
        return self._elastic.minimise(x, self._data, prices, self._solver, self._observer, multipliers)

    def excess(self, result: ElasticResult, *, without: list[int] | None = None) -> float:
        """Return the weighted sum of the slacks, without those of some limits."""
        weighted = self.prices * result.slacks
        return float(weighted.sum() - weighted[without or []].sum())

    def is_feasible(self, result: ElasticResult) -> bool:
        """Return whether a motion satisfies all limits."""
        return result.status.ok and self.excess(result) <= FEASIBLE

    def suffices(self, number: int, result: ElasticResult) -> bool:
        """Return whether a motion satisfies all limits but one."""
        return result.status.ok and self.excess(result, without=[number]) <= FEASIBLE

    def find_conflicts(self, result: ElasticResult) -> tuple[Conflict, ...] | ElasticResult:
        """Return the conflicting limits: each one whose relaxation alone suffices or, if none exists, a smallest set.

        A limit that suffices alone belongs to every set of conflicting limits.  Conditions of the contact sequence,
        for which no value suffices, are listed only if no limit suffices.  If nothing suffices alone, there are
        several conflicts: limits are then removed from those exceeded as long as relaxing the others suffices.

        Parameters
        ----------
        result : ElasticResult
            The motion of least excess found.

        Returns
        -------
        tuple of Conflict, or ElasticResult
            A feasible motion if one is found in the process: `result` is then not the motion of least excess.
        """
        candidates = [int(i) for i in np.flatnonzero(result.active * FARTHEST > self.excess(result))]
        conflicts: list[tuple[float, Conflict]] = []
        for may_suffice in (True, False):
            for number in candidates:
                if self._may_suffice(number, result) is not may_suffice:
                    continue
                alone = self._relax_alone(number, result)
                if self.is_feasible(alone):
                    return alone
                if self.suffices(number, alone):
                    conflicts.append((self.excess(alone), self.record_conflict(number, alone, separable=True)))
            ordered = [conflict for _, conflict in sorted(conflicts, key=lambda entry: entry[0])]
            sufficient = tuple(conflict for conflict in ordered if not math.isnan(conflict.sufficient))
            if sufficient:
                return sufficient
        return tuple(ordered) or self.relax_from_guess() or self._find_joint_conflict(result)

    def relax_from_guess(self) -> tuple[Conflict, ...] | ElasticResult:
        """Return the limits that suffice alone if the search starts at the guess, or a feasible motion; () if none."""
        return ()

    def _may_suffice(self, number: int, result: ElasticResult) -> bool:
        """Return whether a limit has an admissible value at which, to first order, it is not exceeded."""
        limit = self.limits[number]
        if not limit.is_least or limit.unit == "rad" or isinstance(limit.value, tuple):
            return True
        return limit.value * self.prices[number] >= self.excess(result) / result.active[number]

    def _relax_alone(self, number: int, result: ElasticResult) -> ElasticResult:
        """Return the motion that exceeds one limit and, if possible, no others."""
        if self.excess(result, without=[number]) <= FEASIBLE:
            return result
        alone = self.exceed_only([number], result.x, result.multipliers)
        if alone.status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        return alone

    def list_excesses(self, result: ElasticResult) -> tuple[Conflict, ...]:
        """Return the limits that a motion exceeds, which suffices if all of them are relaxed."""
        numbers = self._find_exceeded_limits(result)
        return tuple(self.record_conflict(number, result, separable=len(numbers) == 1) for number in numbers)

    def _find_exceeded_limits(self, result: ElasticResult) -> list[int]:
        return [int(i) for i in np.flatnonzero(self.prices * result.slacks > FEASIBLE)]

    def _find_joint_conflict(self, result: ElasticResult) -> tuple[Conflict, ...]:
        members = self._find_exceeded_limits(result)
        for number in sorted(members, key=lambda member: self.prices[member] * result.slacks[member]):
            rest = [member for member in members if member != number]
            if not rest:
                break
            reduced = self.exceed_only(rest, result.x, result.multipliers)
            if reduced.status is Status.INTERRUPTED:
                raise KeyboardInterrupt
            if reduced.status.ok and self.excess(reduced, without=rest) <= FEASIBLE:
                members, result = rest, reduced
        return self.list_excesses(result)

    def record_conflict(self, number: int, result: ElasticResult, *, separable: bool) -> Conflict:
        """Return the record of a limit that is exceeded in a motion."""
        limit, missing = self.limits[number], float(result.slacks[number])
        side = self._elastic.find_excesses(result.x, self._data)[1][number]
        is_lower = side is not None and side.is_lower
        value = limit.value
        if isinstance(value, tuple):
            value = value[0] if is_lower else value[1]
        return Conflict(
            name=limit.name,
            setting=limit.setting,
            limit=value,
            missing=missing,
            sufficient=self._sufficient(limit, value, is_lower, missing, result.x),
            unit=limit.unit,
            separable=separable,
            item=limit.item,
        )

    def _sufficient(self, limit: RelaxableLimit, value: float, is_lower: bool, missing: float, x: Array) -> float:
        """Return the value of a limit at which a motion is admissible; nan if no admissible value is known."""
        if limit.setting == "friction":
            return self.find_sufficient_friction(x)
        if limit.is_least or (isinstance(limit.value, tuple) and is_lower):
            least = value - SAFETY_FACTOR * missing
            return least if least >= 0 or limit.unit == "rad" else math.nan
        return value + SAFETY_FACTOR * missing


def elastic_solver(solver: NlpSolver, phases: int = 1) -> NlpSolver:
    """Return the solver of elastic problems with a number of phases that has the limits of a given solver."""
    ipopt = solver.fallback if isinstance(solver, Newton) else solver
    if not isinstance(ipopt, Ipopt):
        return solver
    iterations = min(ipopt.max_iterations, max(ELASTIC_ITERATIONS, ITERATIONS_PER_PHASE * phases))
    return evolve(ipopt, tolerance=max(ipopt.tolerance, ELASTIC_TOLERANCE), max_iterations=iterations)


def friction_of_cones(friction: float, forward: Array, backward: Array) -> float:
    """Return the friction coefficient whose cones contain all forces of a motion; nan if a normal force is negative.

    Parameters
    ----------
    friction : float
        Coefficient of the cones.
    forward, backward : arrays
        Distances of the tangential forces from both sides of their cones, in the same order.
    """
    if (forward + backward <= 0).any():
        return math.nan
    ratio = float(np.max(np.abs(forward - backward) / (forward + backward), initial=0.0))
    return friction * max(1.0, SAFETY_FACTOR * ratio)
