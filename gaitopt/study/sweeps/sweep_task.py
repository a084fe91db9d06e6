"""Tasks of a sweep in a worker: gaits continued from point to point, and the verified best gait of a point."""

import math
from collections.abc import Mapping

from gaitopt.motion.gait import Gait
from gaitopt.ocp.initial.cost_prediction import predict_cost
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.start_selection import SAME_COST
from gaitopt.study.multistart import (
    COARSE_SOLVER,
    best,
    coarsen,
    default_starts,
    estimate_cost_factor,
    objective,
    select_candidates,
    select_leading,
    skip_refinement,
    solve_coarse,
    solve_cold,
    solve_start,
    verify_best,
    verify_by_cost,
)
from gaitopt.study.sweeps.sweep_grid import SweepGrid, SweepPoint, SweepTask


def solve_task(grid: SweepGrid, task: SweepTask, *results: Gait | None) -> Gait:
    """Run a task of a sweep: a gait from default starts or neighbours, or the verified best gait of a point.

    Warm starts from neighbours are solved on the problem's grid with a large tolerance and without refinement; only
    the best is solved to the tolerance, refined and verified.
    """
    problem = grid.problem_at(task.point)
    gaits = [(kind, point, gait) for (kind, point), gait in zip(task.inputs, results, strict=True) if gait is not None]
    known = {kind: gait for kind, point, gait in gaits if point == task.point}
    if task.kind == "point":
        return _solve_best(problem, list(known.values()), grid.starts)
    if task.kind == "cold" or not gaits:
        return _solve_default_starts(problem, grid.starts)
    return _continue_best(grid, task, known, {point: gait for _, point, gait in gaits if point != task.point})


def solve_unstored_task(grid: SweepGrid, task: SweepTask, *results: Gait | None) -> Gait:
    """Run a task of a sweep in a worker if only the gaits of the points are stored.

    Motions of the other gaits are not evaluated before they are sent: they warm-start solves by their unknowns.
    """
    gait = solve_task(grid, task, *results)
    return gait.postpone_evaluation() if gait.status.ok and task.kind != "point" else gait


def _solve_default_starts(problem: GaitProblem, starts: int) -> Gait:
    """Return the best gait from the default starts of a problem, on the grid on which gaits are continued."""
    leading = select_leading(problem, solve_coarse(problem, default_starts(problem, starts)))
    if not leading.status.ok or skip_refinement(problem).transcription == coarsen(problem).transcription:
        return leading
    again = solve_start(skip_refinement(problem), leading, COARSE_SOLVER)
    return estimate_cost_factor(again, leading) if again.status.ok else leading


def _solve_best(problem: GaitProblem, gaits: list[Gait], starts: int) -> Gait:
    """Return the gait of lowest cost, solved to the tolerance and verified; the next one is solved if this fails."""
    coarse = sorted((gait for gait in gaits if gait.status.ok), key=objective)
    fine = [] if coarse else list(gaits)
    for candidate in select_candidates(coarse) if coarse else ():
        fine.append(solve_start(problem, candidate))
        result = verify_by_cost(problem, fine[-1:])
        if result.status.ok:
            return result
    if not any(gait.status.ok for gait in fine):
        fine += solve_cold(problem, starts)
    return verify_best(problem, fine)


def _continue_best(
    grid: SweepGrid, task: SweepTask, known: Mapping[str, Gait], neighbours: Mapping[SweepPoint, Gait]
) -> Gait:
    """Return the better of the cold gait of a point and the one continued from its best neighbour, or a failure.

    If a neighbour leads to the known forward gait, that gait is taken without a solve.
    """
    problem, forward = grid.problem_at(task.point), known.get("forward")
    reached = [known["cold"]] if "cold" in known else []
    for point, start in sorted(neighbours.items(), key=lambda item: objective(item[1])):
        if start.status.ok:
            if forward is not None and on_one_branch(problem, forward, grid.problem_at(point), start):
                reached.append(forward)
            else:
                reached.append(solve_start(skip_refinement(problem), start, COARSE_SOLVER))
            if reached[-1].status.ok:
                break
    return best(reached or [*neighbours.values()] or [*known.values()])


def on_one_branch(one: GaitProblem, gait: Gait, other: GaitProblem, neighbour: Gait) -> bool:
    """Return whether a neighbour continued to a problem leads to the gait known there, or to one of higher cost.

    The cost predicted from a neighbour to first order (:func:`gaitopt.ocp.initial.cost_prediction.predict_cost`) is
    below the known cost by the curvature of the branch between the two, or since another branch has lower cost.  The
    curvature of one branch gives the same difference in both directions; two branches do not.  Differences within the
    estimated errors of the costs are ignored.
    """
    if not gait.status.ok:
        return False
    gain = objective(gait) - predict_cost(skip_refinement(one), neighbour)
    back = objective(neighbour) - predict_cost(skip_refinement(other), gait)
    tolerance = (SAME_COST + _cost_error(one, gait) + _cost_error(other, neighbour)) * abs(objective(gait))
    return gain <= tolerance or abs(gain - back) <= 2 * tolerance


def _cost_error(problem: GaitProblem, gait: Gait) -> float:
    """Return the estimated relative error of a cost due to its grid, at most the tolerance; 0 on a stated grid."""
    error, tolerance = gait.solver.cost_error, problem.transcription.largest_cost_error
    return min(error, tolerance) if math.isfinite(error) and math.isfinite(tolerance) else 0.0
