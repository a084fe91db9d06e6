"""What a worker does in a sweep: coarse gaits continued from point to point, and the proven best of a point."""

from collections.abc import Mapping

from gaitopt.motion.gait import Gait
from gaitopt.ocp.initial.cost_prediction import predict_cost
from gaitopt.ocp.problem import GaitProblem
from gaitopt.study.multistart import (
    ALIKE,
    COARSE_SOLVER,
    best,
    coarsen,
    default_starts,
    halve_intervals,
    objective,
    select_leading,
    solve_coarse,
    solve_cold,
    solve_fine,
    solve_start,
    verify_best,
)
from gaitopt.study.sweeps.sweep_grid import SweepGrid, SweepPoint, SweepTask


def solve_task(grid: SweepGrid, duty: SweepTask, *found: Gait | None) -> Gait:
    """Do one task of a sweep: a coarse gait from starts of its own or from neighbours, or the proven best of a point.

    Neighbours are tried on a grid half as fine, which tells good gaits from bad ones at a fraction of the cost; only
    what has proved best there is solved on the problem's own grid.
    """
    problem = grid.problem_at(duty.point)
    gaits = [(kind, point, gait) for (kind, point), gait in zip(duty.given, found, strict=True) if gait is not None]
    own = {kind: gait for kind, point, gait in gaits if point == duty.point}
    if duty.kind == "point":
        return _proven_best(problem, list(own.values()), grid.starts)
    if duty.kind == "cold" or not gaits:
        return _cold(problem, grid.starts)
    return _continued(grid, duty, own, {point: gait for _, point, gait in gaits if point != duty.point})


def _cold(problem: GaitProblem, starts: int) -> Gait:
    """Return the leading gait from starts of a problem's own, on the grid on which gaits are continued."""
    leader = select_leading(problem, solve_coarse(problem, default_starts(problem, starts)))
    if not leader.status.ok or halve_intervals(problem).transcription == coarsen(problem).transcription:
        return leader
    again = solve_start(halve_intervals(problem), leader, COARSE_SOLVER)
    return again if again.status.ok else leader


def _proven_best(problem: GaitProblem, found: list[Gait], starts: int) -> Gait:
    coarse = sorted((gait for gait in found if gait.status.ok), key=objective)
    ready = solve_fine(problem, coarse) if coarse else found
    if not any(gait.status.ok for gait in ready):
        ready = [*ready, *solve_cold(problem, starts)]
    return verify_best(problem, ready)


def _continued(grid: SweepGrid, duty: SweepTask, own: Mapping[str, Gait], beside: Mapping[SweepPoint, Gait]) -> Gait:
    """Return the best of a point's own cold gait and one from its best neighbour; a failure is handed on.

    Where a neighbour would only lead to the forward gait again, that one is taken.
    """
    problem, forward = grid.problem_at(duty.point), own.get("forward")
    reached = [own["cold"]] if "cold" in own else []
    for point, start in sorted(beside.items(), key=lambda item: objective(item[1])):
        if start.status.ok:
            if forward is not None and on_one_branch(problem, forward, grid.problem_at(point), start):
                reached.append(forward)
            else:
                reached.append(solve_start(halve_intervals(problem), start, COARSE_SOLVER))
            if reached[-1].status.ok:
                break
    return best(reached or [*beside.values()] or [*own.values()])


def on_one_branch(one: GaitProblem, gait: Gait, other: GaitProblem, neighbour: Gait) -> bool:
    """Whether a neighbour, continued to a problem, would only lead to the gait that is known there, or to a dearer one.

    What a neighbour promises to first order (:func:`gaitopt.ocp.initial.cost_prediction.foreseen`) undercuts what is
    known by what the branch is curved between the two, and by what could be gained from another branch.  A curved
    branch promises just as much the other way round, two branches do not.
    """
    if not gait.status.ok:
        return False
    gain = objective(gait) - predict_cost(halve_intervals(one), neighbour)
    back = objective(neighbour) - predict_cost(halve_intervals(other), gait)
    alike = ALIKE * abs(objective(gait))
    return gain <= alike or abs(gain - back) <= 2 * alike
