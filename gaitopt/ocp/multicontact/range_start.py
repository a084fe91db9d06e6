"""Second start of a problem with ranges of speed or step length whose plan is inaccurate: from fixed values."""

from collections.abc import Callable, Iterator

from attrs import evolve

from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.ocp.multicontact.planar_guess import FromPlanarGait
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.status import Status

MOST_FIXED_ITERATIONS = 300
"""Largest number of iterations of an NLP with fixed values: those that converged to a gait took up to 174."""

MOST_NEARBY_ITERATIONS = 60
"""Largest number of iterations of an NLP that starts from such a gait: it takes 39 if it converges to a gait."""


def solve_from_range_ends(
    problem: PlanarProblem, failure: PlanarGait, solver: Ipopt, solve_once: Callable[[PlanarProblem, Ipopt], PlanarGait]
) -> PlanarGait:
    """Return a gait solved from one with fixed speed and step length, or that one, or the failure.

    A foot that touches down too early is raised by repairs that start at the rejected plan, which may lead to none
    although another speed in the range has a gait.  From this gait, the solve may reach the optimum of the range.

    Parameters
    ----------
    problem : PlanarProblem
        A problem with a closed contact sequence.
    failure : PlanarGait
        Its inaccurate plan.
    solver : Ipopt
    solve_once : callable
        Solves a problem from its guess with a solver.
    """
    limited, nearby = (
        evolve(solver, max_iterations=min(solver.max_iterations, most))
        for most in (MOST_FIXED_ITERATIONS, MOST_NEARBY_ITERATIONS)
    )
    solved = [failure]
    for targets in _list_targets(problem, failure):
        solved.append(solve_once(problem.replace(**targets), limited))
        if not solved[-1].status.ok:
            if solved[-1].status is Status.INTERRUPTED:
                return failure.replace_fields(status=Status.INTERRUPTED)
            continue
        fixed = solved[-1]
        solved.append(solve_once(problem.replace(guess=FromPlanarGait(fixed)), nearby))
        if solved[-1].status is Status.INTERRUPTED:
            return failure.replace_fields(status=Status.INTERRUPTED)
        improved = solved[-1].status.ok and solved[-1].solver.objective <= fixed.solver.objective
        return _conclude(solved, solved[-1] if improved else fixed, targets, is_fixed=not improved)
    return failure


def _list_targets(problem: PlanarProblem, failure: PlanarGait) -> Iterator[dict[str, float]]:
    """Yield fixed values of the targets that have ranges: the ends away from an inaccurate plan, then the middles."""
    stated = ("speed", problem.speed, failure.speed), ("step_length", problem.step_length, failure.step_length)
    ranges = {
        name: (*target, value) for name, target, value in stated if isinstance(target, tuple) and target[0] < target[1]
    }
    if ranges:
        yield {
            name: upper if value - lower <= upper - value else lower for name, (lower, upper, value) in ranges.items()
        }
        yield {name: (lower + upper) / 2 for name, (lower, upper, _) in ranges.items()}


def _conclude(solved: list[PlanarGait], gait: PlanarGait, targets: dict[str, float], *, is_fixed: bool) -> PlanarGait:
    """Return a gait with a note on its start, and with the iterations and the time of all solves."""
    units = {"speed": "m/s", "step_length": "m"}
    values = " and ".join(f"{name} = {value:.4g} {units[name]}" for name, value in targets.items())
    report, reason = gait.solver, "the plan solved from the initial guess is not accurate"
    note = f"{reason}: the solve started from the gait with {values}"
    warnings = report.warnings
    if is_fixed:
        note = f"{reason}: the gait is that with {values}"
        warnings = (
            f"No accurate plan was found in the stated range of {' and '.join(targets)}, so the gait was solved with "
            f"{values}: it need not be the optimum of the range. Start from it (--guess), or change the range.",
            *warnings,
        )
    return gait.replace_fields(
        solver=report.replace_fields(
            message=f"{report.message}; {note}",
            warnings=warnings,
            iterations=sum(each.solver.iterations for each in solved),
            build_seconds=sum(each.solver.build_seconds for each in solved),
            solve_seconds=sum(each.solver.solve_seconds for each in solved),
        )
    )
