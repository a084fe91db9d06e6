"""Conflicting limits of the gait of a planar robot, and a start from a motion that satisfies all limits."""

import functools
import math
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
from attrs import evolve

from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.gait import IMPLAUSIBLE
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.planar_motion import PlanarMotion
from gaitopt.ocp.multicontact.elastic_plan import ElasticPlan
from gaitopt.ocp.multicontact.planar_bounds import planar_bounds, planar_data, planar_structure
from gaitopt.ocp.multicontact.planar_guess import FromPlanarGait
from gaitopt.ocp.multicontact.planar_plan import plan_parameters, reconstruct_planar_motion
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_relaxable import ARMED, list_planar_limits, typical_planar_sizes
from gaitopt.ocp.multicontact.planar_remarks import (
    report_implausible_robot,
    report_suspects,
    report_unmet_arming,
)
from gaitopt.ocp.multicontact.planar_start import planar_start, set_start_parameters
from gaitopt.ocp.multicontact.planar_transcription import transcribe_planar
from gaitopt.ocp.nlp.elastic import ElasticResult
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.keys import Kind, Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.solution.conflict_search import (
    ELASTIC_TOLERANCE,
    FEASIBLE,
    SAFETY_FACTOR,
    ElasticLimits,
    friction_of_cones,
)
from gaitopt.progress import Observer
from gaitopt.status import Status

SHORTEST = 1e-2
"""Fraction of the shortest duration of a phase that remains as its bound."""

MOST_ELASTIC_ITERATIONS = 300
"""Largest number of iterations of an elastic solve: a compass with double support takes 192."""

MOST_ITERATIONS_ALONE = 150
"""Largest number of iterations of a solve in which one limit alone is elastic; those that suffice took 42 to 109."""

LEAST_SHARE = 1e-3
"""Least friction that is tried, as a share of that of the cones."""

MOST_TRIALS, RESOLUTION = 5, 1.1
"""Largest number of friction coefficients tried, and ratio of a sufficient to an insufficient one that is accepted."""

RETRY = (Status.INFEASIBLE, Status.ITERATION_LIMIT, Status.FAILED, Status.ACCEPTABLE, Status.DIVERGING)
"""Statuses after which a motion that satisfies all limits is sought."""


class PlanarElastic(ElasticLimits):
    """The gait problem of a planar robot whose limits are elastic, on the grid of the problem.

    Parameters
    ----------
    problem : PlanarProblem
    solver : NlpSolver
    observer : Observer
    """

    def __init__(self, problem: PlanarProblem, solver: NlpSolver, observer: Observer) -> None:
        # The conditions on a motion do not depend on the objective: an objective without further unknowns is used.
        self.problem = problem.replace(objective="torque_squared")
        with defer_interrupt():
            self.transcription = transcribe_planar(planar_structure(self.problem))
            bounds = planar_bounds(self.transcription, self.problem)
            limits = list_planar_limits(self.transcription, self.problem)
            least = np.full(self.transcription.variables.size, -math.inf)
            least[self.transcription.variables[Unknown.DURATION]] = SHORTEST * problem.limits.shortest_phase
            sizes = typical_planar_sizes(self.transcription, self.problem)
            self._relax = functools.partial(ElasticPlan, self.problem, self.transcription, bounds, limits, sizes, least)
            self._guess = planar_start(self.transcription, self.problem)
            elastic = self._relax()
        super().__init__(elastic, limits, planar_data(self.problem), solver, observer)
        self.insufficient: tuple[str, ...] = ()

    def minimise_excess(self) -> ElasticResult:
        """Return the motion near the guess of the problem with the least excess over the limits."""
        return self.minimise_from(self._guess)

    def relax_from_guess(self) -> tuple[Conflict, ...] | ElasticResult:
        """Return the limits that suffice alone if the search starts at the guess, or a feasible motion; () if none.

        The motion of least excess may nearly stand still, and from there no single limit suffices.  The condition
        `armed` of the robot is treated as a limit; the others of the contact sequence are relaxed if no limit suffices.
        The names of the relaxed limits are stored in `insufficient` if none suffices.  With free parameters none is
        relaxed: the conclusion for their initial values is sought first.
        """
        if self.problem.free:
            return ()
        numbers = sorted({side.limit for side in self._elastic.sides})
        conditions = [number for number in numbers if self.limits[number].keeps_fixed]
        armed = [number for number in conditions if self.limits[number].name == ARMED]
        for group in ([*(number for number in numbers if number not in conditions), *armed], conditions):
            conflicts: list[tuple[float, Conflict]] = []
            for number in group:
                alone = self._relax_only(number)
                if self.is_feasible(alone):
                    return alone
                if self.suffices(number, alone):
                    conflicts.append((self.excess(alone), self.record_conflict(number, alone, separable=True)))
            if conflicts:
                return tuple(conflict for _, conflict in sorted(conflicts, key=lambda entry: entry[0]))
        self.insufficient = tuple(self.limits[number].name for number in numbers)
        return ()

    def _relax_only(self, number: int) -> ElasticResult:
        """Return the motion near the guess that exceeds one limit as little as possible and no others."""
        solver = self._solver
        if isinstance(solver, Ipopt):
            solver = evolve(solver, max_iterations=min(solver.max_iterations, MOST_ITERATIONS_ALONE))
        result = self._relax(only=number).minimise(
            self._guess, self._data, self.prices[[number]], solver, self._observer
        )
        if result.status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        slacks, active = np.zeros((2, self.prices.size))
        slacks[number], active[number] = result.slacks[0], result.active[0]
        return replace(result, slacks=slacks, active=active)

    def motion(self, result: ElasticResult) -> PlanarMotion:
        """Return the motion of a result."""
        with defer_interrupt():
            values = plan_parameters(self.transcription, self.problem, result.x)
            return reconstruct_planar_motion(self.transcription, values, result.x)

    def find_sufficient_friction(self, x: Array) -> float:
        """Return a friction coefficient for which a motion exists near another one, close to the smallest.

        It is at most that of the cones which contain all forces of the motion `x`, which minimises the excess of the
        forces and not their ratio.  Smaller coefficients are tried by bisection.  nan with slip, tension or ``any``.
        """
        high = self._find_friction_of_cones(x)
        if not math.isfinite(high):
            return math.nan
        low = max(self.problem.friction, LEAST_SHARE * high)
        index = self.problem.robot.index("friction")
        for _ in range(MOST_TRIALS):
            if high <= RESOLUTION * low:
                break
            trial, data = math.sqrt(low * high), self._data.copy()
            data[index] = trial
            result = self._elastic.minimise(x, data, self.prices, self._solver, self._observer)
            if result.status is Status.INTERRUPTED:
                raise KeyboardInterrupt
            if self.is_feasible(result):
                x, high = result.x, min(high, SAFETY_FACTOR * trial)
            else:
                low = trial
        return high

    @defer_interrupt()
    def _find_friction_of_cones(self, x: Array) -> float:
        """Return the friction coefficient whose cones contain all forces of a motion."""
        phases, rows = self.transcription.phases, self.transcription.constraints
        if any(mode.slips for phase in phases for mode in (*phase.state, *(phase.outcome or ()))):
            return math.nan  # friction also determines how the contacts slide
        g = np.asarray(self.transcription.nlp.derivatives["jac_g"](x, self._data)[0]).ravel()
        forward, backward = (
            np.concatenate([rows.find(kind) for kind in kinds])
            for kinds in (
                (Kind.CONE_FORWARD, Kind.IMPACT_CONE_FORWARD, Kind.LIFT_OFF_FORWARD),
                (Kind.CONE_BACKWARD, Kind.IMPACT_CONE_BACKWARD, Kind.LIFT_OFF_BACKWARD),
            )
        )
        bounded = np.isfinite(self.transcription.row_bounds[0][forward])  # lift-off: in the last interval only
        return friction_of_cones(self.problem.friction, g[forward[bounded]], g[backward[bounded]])


def conclude_planar_failure(
    problem: PlanarProblem,
    failure: PlanarGait,
    solver: Ipopt,
    observer: Observer,
    solve_once: Callable[[PlanarProblem], PlanarGait],
) -> PlanarGait:
    """Return the gait solved from a motion that satisfies all limits, or the failure with its reason.

    The motion of least excess over all limits is determined near the guess.  If it exceeds none, the problem is solved
    from it; otherwise the problem is infeasible near the guess, and the conflicting limits are reported, unless sizes
    or directions of the robot are implausible.

    Parameters
    ----------
    problem : PlanarProblem
        A problem with a closed contact sequence.
    failure : PlanarGait
        Result of a solve that failed.
    solver : Ipopt
    observer : Observer
    solve_once : callable
        Solves a problem from its guess.
    """
    started = time.perf_counter()
    tolerance = max(solver.tolerance, ELASTIC_TOLERANCE)
    limited = evolve(
        solver, permute=False, tolerance=tolerance, max_iterations=min(solver.max_iterations, MOST_ELASTIC_ITERATIONS)
    )
    elastic = PlanarElastic(problem, limited, observer)
    is_implausible = bool(report_implausible_robot(problem, problem.values))
    try:
        nearest = elastic.minimise_excess()
        conflicts = () if is_implausible else _find_conflicts(elastic, nearest)
    except KeyboardInterrupt:
        return failure.replace_fields(status=Status.INTERRUPTED)
    if isinstance(conflicts, ElasticResult):
        nearest, conflicts = conflicts, ()
    if elastic.is_feasible(nearest):
        guess = FromPlanarGait(failure.replace_fields(motion=elastic.motion(nearest)))
        gait = solve_once(problem.replace(guess=guess))
        return gait if gait.status.ok or gait.status is Status.INTERRUPTED else failure
    if nearest.status is Status.INTERRUPTED:
        return failure.replace_fields(status=Status.INTERRUPTED)
    if not conflicts and problem.free:
        return _conclude_with_fixed_parameters(problem, failure, solver, observer, solve_once)
    if is_implausible:
        return failure.replace_fields(solver=failure.solver.replace_fields(message=IMPLAUSIBLE, violations=()))
    if not conflicts and (nearest.status is not Status.PLAN_INACCURATE or elastic.excess(nearest) <= FEASIBLE):
        message = failure.solver.message + _list_insufficient(elastic.insufficient)
        suspects = report_suspects(problem, ()) if elastic.insufficient else ()
        warnings = (*failure.solver.warnings, *suspects)
        return failure.replace_fields(solver=failure.solver.replace_fields(message=message, warnings=warnings))
    report = failure.solver.replace_fields(
        message="no feasible motion found near the initial guess: the smallest possible violation of the limits is not "
        "zero" + _list_insufficient(elastic.insufficient),
        conflicts=conflicts,
        warnings=(
            *failure.solver.warnings,
            *report_unmet_arming(problem, conflicts),
            *report_suspects(problem, conflicts),
        ),
        solve_seconds=failure.solver.solve_seconds + time.perf_counter() - started,
    )
    return failure.replace_fields(status=Status.INFEASIBLE, solver=report)


def _find_conflicts(elastic: PlanarElastic, nearest: ElasticResult) -> tuple[Conflict, ...] | ElasticResult:
    """Return the conflicting limits, or a feasible motion found in the process; () if nothing is known."""
    if elastic.is_feasible(nearest) or nearest.status in (Status.INTERRUPTED, Status.TIME_LIMIT):
        return ()
    return elastic.find_conflicts(nearest) if nearest.status.ok else elastic.relax_from_guess()


def _list_insufficient(names: tuple[str, ...]) -> str:
    """Return a sentence on the limits of which none suffices alone; empty if there are none."""
    return f". None of these limits suffices if it alone is relaxed: {', '.join(names)}" if names else ""


def _conclude_with_fixed_parameters(
    problem: PlanarProblem,
    failure: PlanarGait,
    solver: Ipopt,
    observer: Observer,
    solve_once: Callable[[PlanarProblem], PlanarGait],
) -> PlanarGait:
    """Return the conclusion with free parameters at their initial values; limits that suffice then always suffice."""
    start = set_start_parameters(problem).values
    fixed = problem.fix_parameters({name: start[name] for name in problem.free})
    concluded = conclude_planar_failure(fixed, failure, solver, observer, solve_once)
    if concluded.status.ok:
        gait = solve_once(problem.replace(guess=FromPlanarGait(concluded)))
        return gait if gait.status.ok or gait.status is Status.INTERRUPTED else failure
    if not concluded.solver.conflicts:
        return concluded
    message = f"{concluded.solver.message} with the free parameters at their initial values"
    return concluded.replace_fields(solver=concluded.solver.replace_fields(message=message))
