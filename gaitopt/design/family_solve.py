"""Solution of a family: gaits with common parameters, one NLP of all gaits, and gaits with the optimal parameters."""

import math
import re
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np
from attrs import evolve

from gaitopt.dataclass import dataclass
from gaitopt.design.family import Family
from gaitopt.design.family_gaits import FamilyGaits
from gaitopt.design.shared_quantities import list_shared_unknowns
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.ocp.bounds import bounds, nlp_data, transcribe_problem
from gaitopt.ocp.initial.solution_transfer import solution_of, transfer_solution
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.feasibility_refinement import refine_feasibility
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.joint_nlp import SHARE_OF_SUM, JointLayout, join_nlps
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.nlp_solver import CONVERGED, NlpResult, NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.grid_solve import GridSolution
from gaitopt.ocp.solution.mesh_refinement import find_coarsest_grid
from gaitopt.ocp.solution.single_start import assemble_gait
from gaitopt.ocp.solver import solve
from gaitopt.ocp.statement.free_parameters import clip_values
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.ocp.statement.warm_start import FromMotion, WarmStart
from gaitopt.ocp.transcription.collocation import Collocation
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule
from gaitopt.ocp.transcription.method import Method
from gaitopt.ocp.transcription.transcription import Transcription
from gaitopt.progress import SolveObserver
from gaitopt.status import Status

ROUNDS = 3
"""Largest number of solves of the NLP of all gaits on the grids of the problems."""

SAME_DESIGN = 1e-6
"""Change of the parameters in a round, relative to their ranges, below which the gaits are not solved again."""

NEAR_DESIGN = 0.05
"""Change of the parameters in a round, relative to their ranges, after which no further round follows."""

SAME_OBJECTIVE = 1e-6
"""Relative change of the objective below which gaits on a common grid are not solved again."""

COARSE_TOLERANCE = 1e-4
"""Tolerance of Ipopt on the coarsest grids."""

COARSE_BARRIER, FINE_BARRIER = 1e-2, 1e-5
"""Barrier parameters of the warm starts of the NLP of all gaits on the coarsest grids and on those of the problems."""


def solve_family(family: Family, solver: NlpSolver, observer: SolveObserver) -> FamilyGaits:
    """Find the parameters and the gaits of a family; see :meth:`gaitopt.Family.solve`."""
    started = time.perf_counter()
    solve_gaits = _solve_on_common_grid if family.shared else _solve_on_refined_grids
    return replace(solve_gaits(family, solver, observer), solve_seconds=time.perf_counter() - started)


def _solve_on_common_grid(family: Family, solver: NlpSolver, observer: SolveObserver) -> FamilyGaits:
    """Return the gaits that share torques or gains, starting from gaits that do not.

    The sign changes of the joint powers are located in each solution, and the NLP is solved again, until the objective
    no longer changes.
    """
    methods = [problem.transcription for problem in family.problems]
    problems = [
        problem.replace(transcription=evolve(method, intervals=method.intervals_for(problem.sequence)))
        for problem, method in zip(family.problems, methods, strict=True)
    ]
    family = replace(family, problems=problems)
    design = {name: problems[0].values[name] for name in problems[0].free}
    coarse = [problem.replace(transcription=evolve(problem.transcription, tolerance=math.inf)) for problem in problems]
    first = _solve_in_turn(lambda problem, observe: _solve_first(problem, design, observe), coarse, observer)
    best = _conclude(family, first, design)
    iterations = 0
    for number in range(ROUNDS if best.status.ok else 0):
        joint = _solve_jointly(family, best.gaits, solver, observer, FINE_BARRIER if number else COARSE_BARRIER)
        iterations, change = iterations + joint.iterations, abs(joint.objective - best.objective)
        if joint.status.ok:
            joint = _conclude(family, joint.gaits, joint.design)
        best = joint if joint.status.ok or not number or joint.status is Status.INTERRUPTED else best
        smooth = all(problem.objective.smooth for problem in problems)
        if not joint.status.ok or smooth or (number and change <= SAME_OBJECTIVE * abs(joint.objective)):
            break
    if not best.status.ok and best.status is not Status.INTERRUPTED and iterations:
        best = replace(best, message=best.message + _advise_bounds(family))
    return replace(best, iterations=iterations)


def _advise_bounds(family: Family) -> str:
    """Return the advice to use bounds if torques are shared: exact targets nearly contradict each other."""
    targets = {name: getattr(family.problems[0], name) for name in ("speed", "step_length")}
    exact = {name: value for name, value in targets.items() if isinstance(value, float)}
    if "torques" not in family.shared or not exact:
        return ""
    examples = ", ".join(f"{name}=({0.99 * value:.4g}, {1.01 * value:.4g})" for name, value in exact.items())
    return (
        f"; gaits that share their torques can rarely have exactly the same {' and '.join(exact)}: use bounds "
        f"such as {examples}"
    )


def _solve_on_refined_grids(family: Family, solver: NlpSolver, observer: SolveObserver) -> FamilyGaits:
    """Return the gaits that share parameters, each on a grid refined for it."""
    coarse = _solve_on_coarsest_grids(family, solver, observer)
    if not coarse.status.ok:
        return coarse
    guesses = [FromMotion(gait.motion) for gait in coarse.gaits]
    best, iterations = _solve_each(family, guesses, coarse.design, observer), coarse.iterations
    for number in range(ROUNDS if best.status.ok else 0):
        joint = _solve_jointly(family, best.gaits, solver, observer, FINE_BARRIER)
        iterations, change = iterations + joint.iterations, _compare_designs(family, joint.design, best.design)
        if not joint.status.ok:
            if number == 0 or joint.status is Status.INTERRUPTED:
                best = replace(best, status=joint.status, message=joint.message)
            break
        if change < SAME_DESIGN:
            break
        # The optimal parameters hardly change: the grids that were refined for the gaits are still suitable.
        result = _conclude(family, joint.gaits, joint.design)
        if change >= NEAR_DESIGN or not result.status.ok:
            result = _solve_each(family, [WarmStart(gait) for gait in joint.gaits], joint.design, observer)
        best = result if number == 0 or result.status.ok or result.status is Status.INTERRUPTED else best
        if change < NEAR_DESIGN or not result.status.ok:
            break
    return replace(best, iterations=iterations)


def _compare_designs(family: Family, one: Mapping[str, float], other: Mapping[str, float]) -> float:
    """Return the largest difference of two sets of parameters, relative to their ranges."""
    return max(abs(one[name] - other[name]) / (ends[1] - ends[0]) for name, ends in family.problems[0].free.items())


def _solve_on_coarsest_grids(family: Family, solver: NlpSolver, observer: SolveObserver) -> FamilyGaits:
    """Return the gaits on the coarsest grids, from the start values of the parameters."""
    problems = [
        problem.replace(transcription=evolve(find_coarsest_grid(problem), tolerance=math.inf))
        for problem in family.problems
    ]
    coarse = replace(family, problems=problems)
    design = {name: problems[0].values[name] for name in problems[0].free}
    gaits = _solve_in_turn(lambda problem, observe: _solve_first(problem, design, observe), problems, observer)
    first = _conclude(family, gaits, design)
    if isinstance(solver, Ipopt):
        solver = evolve(solver, tolerance=max(solver.tolerance, COARSE_TOLERANCE))
    return _solve_jointly(coarse, gaits, solver, observer, COARSE_BARRIER) if first.status.ok else first


def _solve_in_turn(
    solve_one: Callable[[GaitProblem, SolveObserver], Gait], problems: Sequence[GaitProblem], observer: SolveObserver
) -> list[Gait]:
    """Return the gait of each problem; after an interrupt, all others are interrupted at their first iteration."""
    gaits: list[Gait] = []
    for problem in problems:
        gaits.append(solve_one(problem, observer))
        if gaits[-1].status is Status.INTERRUPTED:
            observer = _interrupt
    return gaits


def _interrupt(_: object) -> None:
    raise KeyboardInterrupt


def _solve_first(problem: GaitProblem, design: Mapping[str, float], observer: SolveObserver) -> Gait:
    """Return the gait with the parameters at their start; if none exists, with its own optimal parameters."""
    gait = solve(problem.fix_parameters(design), observer=observer)
    return gait if gait.status.ok or gait.status is Status.INTERRUPTED else solve(problem, observer=observer)


def _solve_each(
    family: Family, guesses: Sequence[Guess], design: Mapping[str, float], observer: SolveObserver
) -> FamilyGaits:
    """Return the gaits with some values of the parameters, each on a grid refined for it."""
    stated = [
        problem.fix_parameters(design).replace(guess=guess)
        for problem, guess in zip(family.problems, guesses, strict=True)
    ]
    gaits = _solve_in_turn(lambda problem, observe: solve(problem, observer=observe), stated, observer)
    return _conclude(family, gaits, design)


def _conclude(family: Family, gaits: Sequence[Gait], design: Mapping[str, float]) -> FamilyGaits:
    """Return the gaits with their weighted cost, and the status of the first one that is not solved."""
    weights = tuple(family.weights or ())
    costs = [weight * gait.solver.objective for weight, gait in zip(weights, gaits, strict=True)]
    failed = next(((i, gait) for i, gait in enumerate(gaits, start=1) if not gait.status.ok), None)
    # The gaits are solved with the shared parameters fixed; their records state that these were free.
    free = {name: list(ends) for name, ends in family.problems[0].free.items()}
    return FamilyGaits(
        gaits=tuple(gait.replace_fields(problem={**gait.problem, "free": free}) for gait in gaits),
        design=dict(design),
        weights=weights,
        objective=max(costs) if family.worst_case else sum(costs),
        status=Status.SOLVED if failed is None else failed[1].status,
        message=CONVERGED if failed is None else f"gait {failed[0]}: {failed[1].solver.message}",
        iterations=0,
        solve_seconds=0.0,
    )


@dataclass(frozen=True, eq=False)
class _Member:
    """A gait in the NLP of all gaits: its problem, grid, bounds, data, initial point, multipliers, shared unknowns."""

    problem: GaitProblem
    method: Method
    transcription: Transcription
    limits: Bounds
    data: Array
    x: Array
    multipliers: tuple[Array, Array]
    shared: tuple[int, ...]

    @classmethod
    def of(cls, problem: GaitProblem, gait: Gait, names: Sequence[str] = ()) -> "_Member":
        """Return the member of a problem that starts from a gait with nearly the same parameters."""
        solution = gait.solution
        if solution is None:
            raise ValueError("a solved gait has a solution")
        method = evolve(problem.transcription, intervals=solution.intervals, fractions=solution.fractions)
        points = re.search(r"(\d+) Lobatto", str(gait.problem["transcription"]))
        if isinstance(method, Collocation) and points:
            method = evolve(method, points=int(points[1]))
        landing = gait.problem.get("landing")
        schedule = GuardSchedule(**landing) if landing else None
        transcription = transcribe_problem(problem, method, schedule)
        x = np.zeros(transcription.variables.size)
        x, multipliers = transfer_solution(solution, transcription, x)
        if problem.free:
            x[transcription.variables[Unknown.DESIGN][:, 0]] = [gait.motion.parameters[name] for name in problem.free]
        limits, data = bounds(transcription, problem), nlp_data(transcription, problem, x)
        shared = list_shared_unknowns(transcription, names)
        return cls(problem, method, transcription, limits, data, x, multipliers, shared)

    def read(self, outcome: NlpResult, gait: Gait) -> Gait:
        """Return the gait of a result with its parameters fixed, on the grid that was refined for a gait."""
        layout, free = self.transcription.variables, self.problem.free
        parameters = outcome.x[layout[Unknown.DESIGN][:, 0]] if free else ()
        design = {
            name: float(value) for name, value in clip_values(dict(zip(free, parameters, strict=True)), free).items()
        }
        problem = self.problem.fix_parameters(design).without_guess()
        structure = self.transcription.structure
        transcription = transcribe_problem(problem, self.method, structure.schedule)
        known = solution_of(self.transcription, outcome)
        x, multipliers = transfer_solution(known, transcription, np.zeros(transcription.variables.size))
        limits, data = bounds(transcription, problem), nlp_data(transcription, problem, x)
        objective, g = (np.asarray(value).ravel() for value in transcription.nlp.values(x, data))
        outcome = replace(outcome, x=x, g=g, objective=float(objective[0]), multipliers=multipliers, data=None)
        solution = GridSolution(problem, self.method, transcription, limits, data, outcome)
        if math.isfinite(problem.transcription.tolerance):
            solution = solution.check_plan()
        result = assemble_gait(solution, {"intervals": list(structure.counts), "transcription": self.method.name})
        if len(self.shared) > len(free):  # the other shared quantities are not optimal for this gait alone
            result = result.without_certificate()
        return result.replace_fields(solver=result.solver.replace_fields(cost_error=gait.solver.cost_error))


def _solve_jointly(
    family: Family, gaits: Sequence[Gait], solver: NlpSolver, observer: SolveObserver, barrier: float
) -> FamilyGaits:
    """Solve the NLP of all gaits from gaits with common parameters."""
    members = [_Member.of(problem, gait, family.shared) for problem, gait in zip(family.problems, gaits, strict=True)]
    layout = JointLayout(
        tuple(member.transcription.nlp for member in members),
        tuple(member.shared for member in members),
        family.worst_case,
    )
    weights = np.array(family.weights)
    data = np.concatenate([*(member.data for member in members), weights])
    x, multipliers = _initial_point(layout, members, weights)
    nlp, limits = join_nlps(layout), _join_bounds(layout, members)
    outcome = solver.minimise(nlp, x, data, limits, observer, multipliers, barrier)
    if outcome.status.ok:
        shared = slice(layout.n_shared)
        x = np.concatenate(
            [np.clip(outcome.x[shared], limits.x_lower[shared], limits.x_upper[shared]), outcome.x[layout.n_shared :]]
        )
        outcome = refine_feasibility(nlp, replace(outcome, x=x), data, limits)
    results = [
        member.read(_part(layout, outcome, i, weights[i]), gait)
        for i, (member, gait) in enumerate(zip(members, gaits, strict=True))
    ]
    names = list(family.problems[0].free)
    design = {name: results[0].motion.parameters[name] for name in names}
    joint = _conclude(family, results, design)
    return replace(joint, status=outcome.status, message=outcome.message, iterations=outcome.iterations)


def _initial_point(
    layout: JointLayout, members: Sequence[_Member], weights: Array
) -> tuple[Array, tuple[Array, Array]]:
    """Return the initial point and the multipliers of the NLP of all gaits."""
    x = layout.gather([member.x for member in members])
    on_bounds, on_rows = np.zeros(layout.n_variables), np.zeros(layout.rows[-1][-1] + 1)
    shares = np.full(weights.size, 1 / weights.size) if layout.worst_case else np.ones(weights.size)
    for member, columns, rows, factor in zip(members, layout.columns, layout.rows, shares * weights, strict=True):
        on_bounds[columns] = factor * member.multipliers[0]
        on_rows[rows] = factor * member.multipliers[1]
    if not layout.worst_case:
        return x, (on_bounds, on_rows)
    costs = [
        weight * float(member.transcription.nlp.values(member.x, member.data)[0])
        for weight, member in zip(weights, members, strict=True)
    ]
    x[layout.n_shared] = max(costs)
    return x, (on_bounds, np.append(on_rows, -shares))


def _join_bounds(layout: JointLayout, members: Sequence[_Member]) -> Bounds:
    """Return the bounds of the NLP of all gaits."""
    lower, upper = (layout.gather([getattr(m.limits, name) for m in members]) for name in ("x_lower", "x_upper"))
    columns = [list(member.shared) for member in members]
    common = slice(layout.n_shared)
    lower[common] = np.max([m.limits.x_lower[each] for m, each in zip(members, columns, strict=True)], axis=0)
    upper[common] = np.min([m.limits.x_upper[each] for m, each in zip(members, columns, strict=True)], axis=0)
    rows = [np.concatenate([getattr(m.limits, name) for m in members]) for name in ("g_lower", "g_upper")]
    if layout.worst_case:
        lower[layout.n_shared], upper[layout.n_shared] = -np.inf, np.inf
        rows = [np.append(rows[0], np.zeros(len(members))), np.append(rows[1], np.full(len(members), np.inf))]
    return Bounds(lower, upper, *rows)


def _part(layout: JointLayout, outcome: NlpResult, number: int, weight: float) -> NlpResult:
    """Return the result of one gait, with multipliers per unit of the objective of this gait."""
    columns, rows = layout.columns[number], layout.rows[number]
    if layout.worst_case:
        share = -outcome.multipliers[1][len(outcome.g) - len(layout.nlps) + number]
        weight *= SHARE_OF_SUM + max(share, 0.0)
    x = outcome.x[columns]
    return replace(
        outcome,
        x=x,
        g=outcome.g[rows],
        objective=float("nan"),
        multipliers=(outcome.multipliers[0][columns] / weight, outcome.multipliers[1][rows] / weight),
    )
