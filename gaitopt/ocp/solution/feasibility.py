"""Feasibility of a problem: its elastic form on the coarsest grid, and the conflicting limits."""

import math

import numpy as np
from attrs import evolve

from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.motion import Array, Motion
from gaitopt.ocp.bounds import bounds, data_vector, structure
from gaitopt.ocp.initial.deviation_start import solve_deviations
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.nlp.active_set import Newton
from gaitopt.ocp.nlp.elastic import ElasticNlp, ElasticResult
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.keys import Kind, Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.relaxable_limits import RelaxableLimit, list_limits, relaxed_sides, typical_sizes
from gaitopt.ocp.solution.trajectory import read_parameters, reconstruct_motion
from gaitopt.ocp.statement.criteria import TorqueSquared
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.ocp.transcription.method import Method
from gaitopt.ocp.transcription.relaxation import Relaxation
from gaitopt.ocp.transcription.transcription import transcribe
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

SHORTEST = 1e-2
"""Fraction of the shortest duration of a phase that remains as its bound."""


class ElasticProblem:
    """A gait problem whose limits are elastic, on one grid; the objective is replaced by the excess over the limits.

    Parameters
    ----------
    problem : GaitProblem
    method : Method
        Grid and scheme.
    solver : NlpSolver
    observer : Observer
    relaxation : Relaxation, optional
        Relaxation of the complementarity pairs of an open contact sequence.
    pair_parameter : float
        Its parameter t.
    """

    def __init__(
        self,
        problem: GaitProblem,
        method: Method,
        solver: NlpSolver,
        observer: Observer,
        relaxation: Relaxation | None = None,
        pair_parameter: float = 1.0,
    ) -> None:
        # The conditions on a motion do not depend on the objective: an objective without further unknowns is used.
        self.problem, self._solver, self._observer = problem.replace(objective=TorqueSquared()), solver, observer
        with defer_interrupt():
            self.transcription = transcribe(structure(self.problem, method, relaxation))
            limits = bounds(self.transcription, self.problem)
            self.limits = list_limits(self.transcription, self.problem)
            least = np.full(self.transcription.variables.size, -math.inf)
            least[self.transcription.variables[Unknown.DURATION]] = SHORTEST * problem.limits.shortest_phase
            sizes = typical_sizes(self.transcription, self.problem)
            sides = relaxed_sides(self.limits, limits)
            self._elastic = ElasticNlp(self.transcription.nlp, limits, sides, sizes, least)
        self._data = np.append(data_vector(self.problem), [] if relaxation is None else pair_parameter)
        self.prices = np.array([1 / limit.size for limit in self.limits[: self._elastic.n_limits]])

    def minimise_excess(self, guess: Guess) -> ElasticResult:
        """Return the motion near a guess with the least excess over the limits."""
        with defer_interrupt():
            x = initial_point(self.transcription, self.problem, guess)
            if self.problem.stability is not None:
                x = solve_deviations(self.transcription, x, self._data)
        return self._minimise(x, self.prices)

    def exceed_only(self, members: list[int], near: ElasticResult) -> ElasticResult:
        """Return the motion that exceeds the given limits as little as possible and, if possible, no others."""
        prices = PROHIBITIVE * self.prices
        prices[members] = self.prices[members]
        return self._minimise(near.x, prices, near.multipliers)

    def _minimise(self, x: Array, prices: Array, multipliers: tuple[Array, Array] | None = None) -> ElasticResult:
        return self._elastic.minimise(x, self._data, prices, self._solver, self._observer, multipliers)

    def excess(self, result: ElasticResult, *, without: list[int] | None = None) -> float:
        """Return the weighted sum of the slacks, without those of some limits."""
        weighted = self.prices * result.slacks
        return float(weighted.sum() - weighted[without or []].sum())

    def is_feasible(self, result: ElasticResult) -> bool:
        """Return whether a motion satisfies all limits."""
        return result.status.ok and self.excess(result) <= FEASIBLE

    def motion(self, result: ElasticResult) -> Motion:
        """Return the motion of a result."""
        with defer_interrupt():
            values = read_parameters(self.transcription, self.problem, result.x)
            return reconstruct_motion(self.transcription, values, result.x)

    def find_conflicts(self, result: ElasticResult) -> tuple[Conflict, ...] | ElasticResult:
        """Return the conflicting limits: each one whose relaxation alone suffices or, if there is none, a smallest set.

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
                if alone.status.ok and self.excess(alone, without=[number]) <= FEASIBLE:
                    conflicts.append((self.excess(alone), self._conflict(number, alone, separable=True)))
            ordered = [conflict for _, conflict in sorted(conflicts, key=lambda entry: entry[0])]
            sufficient = tuple(conflict for conflict in ordered if not math.isnan(conflict.sufficient))
            if sufficient:
                return sufficient
        return tuple(ordered) or self._find_joint_conflict(result)

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
        alone = self.exceed_only([number], result)
        if alone.status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        return alone

    def list_excesses(self, result: ElasticResult) -> tuple[Conflict, ...]:
        """Return the limits that a motion exceeds, which suffices if all of them are relaxed."""
        numbers = self._find_exceeded_limits(result)
        return tuple(self._conflict(number, result, separable=len(numbers) == 1) for number in numbers)

    def _find_exceeded_limits(self, result: ElasticResult) -> list[int]:
        return [int(i) for i in np.flatnonzero(self.prices * result.slacks > FEASIBLE)]

    def _find_joint_conflict(self, result: ElasticResult) -> tuple[Conflict, ...]:
        members = self._find_exceeded_limits(result)
        for number in sorted(members, key=lambda member: self.prices[member] * result.slacks[member]):
            rest = [member for member in members if member != number]
            if not rest:
                break
            reduced = self.exceed_only(rest, result)
            if reduced.status is Status.INTERRUPTED:
                raise KeyboardInterrupt
            if reduced.status.ok and self.excess(reduced, without=rest) <= FEASIBLE:
                members, result = rest, reduced
        return self.list_excesses(result)

    def _conflict(self, number: int, result: ElasticResult, *, separable: bool) -> Conflict:
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
        )

    def _sufficient(self, limit: RelaxableLimit, value: float, is_lower: bool, missing: float, x: Array) -> float:
        """Return the value of a limit at which a motion is admissible; nan if no admissible value is known."""
        if limit.setting == "friction":
            return self._sufficient_friction(x)
        if limit.is_least or (isinstance(limit.value, tuple) and is_lower):
            least = value - SAFETY_FACTOR * missing
            return least if least >= 0 or limit.unit == "rad" else math.nan
        return value + SAFETY_FACTOR * missing

    @defer_interrupt()
    def _sufficient_friction(self, x: Array) -> float:
        """Return the friction coefficient whose cones contain all forces of a motion; nan with slip, tension or any."""
        sequence, rows = self.problem.sequence, self.transcription.constraints
        if any(mode.slips for mode in (*sequence.phases, sequence.impact)):
            return math.nan  # friction also determines how the foot slides
        g = np.asarray(self.transcription.nlp.derivatives["jac_g"](x, self._data)[0]).ravel()
        forward, backward = (
            g[np.concatenate([rows.find(kind) for kind in kinds])]
            for kinds in (
                (Kind.FORWARD_CONE, Kind.FORWARD_IMPACT_CONE),
                (Kind.BACKWARD_CONE, Kind.BACKWARD_IMPACT_CONE),
            )
        )
        if self.problem.sequence.is_open or (forward + backward <= 0).any():
            return math.nan
        ratio = float(np.max(np.abs(forward - backward) / (forward + backward)))
        return self.problem.friction * max(1.0, SAFETY_FACTOR * ratio)


def elastic_solver(solver: NlpSolver, phases: int = 1) -> NlpSolver:
    """Return the solver of elastic problems with a number of phases that has the limits of a given solver."""
    ipopt = solver.fallback if isinstance(solver, Newton) else solver
    if not isinstance(ipopt, Ipopt):
        return solver
    iterations = min(ipopt.max_iterations, max(ELASTIC_ITERATIONS, ITERATIONS_PER_PHASE * phases))
    return evolve(ipopt, tolerance=max(ipopt.tolerance, ELASTIC_TOLERANCE), max_iterations=iterations)
