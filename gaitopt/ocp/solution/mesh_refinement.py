"""From coarse grids to a plan that is accurate between its nodes and touches down at its end."""

import math
from dataclasses import replace

from gaitopt.errors import InputError
from gaitopt.ocp.initial.solution_transfer import solution_of
from gaitopt.ocp.nlp.ipopt import STOPPED
from gaitopt.ocp.solution.diagnosis import ROUNDING
from gaitopt.ocp.solution.grid_solve import BARRIER_NEARBY_PROBLEM, BARRIER_SAME_PROBLEM, GridSolution, SingleStart
from gaitopt.ocp.solution.swing_foot_checks import early_touchdown
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule, shift_arming
from gaitopt.status import Status

MOST_DOUBLINGS = 2
"""Grids are doubled so often for a contact mode that is violated between the points at which it is held."""

MAX_GUARD_REPAIRS = 3
"""A plan that touches down early is solved so often again with its touchdown kept from that."""

GAIN = 1e-4
"""Share of the objective for which the node at which the touchdown is armed is moved further."""

STOPPED_EARLY = (Status.INTERRUPTED, Status.TIME_LIMIT)
"""Endings after which nothing more is tried."""


def approach_through_coarse_grids(own: SingleStart) -> GridSolution:
    """Return the solution on the problem's own grid, found through coarser ones."""
    problem, guess = own.problem, own.guess
    path, before, barrier = problem.transcription.approach(problem.sequence), None, BARRIER_SAME_PROBLEM
    known = guess.solution_for(problem.sequence)
    if known is not None:
        path, before, barrier = path[-1:], known, BARRIER_NEARBY_PROBLEM
    step = None
    for method in path:
        if step is not None:
            before = solution_of(step.transcription, step.outcome)
        last, step = step, own.run(method, before, barrier)
        if step.outcome.status in STOPPED and last is not None:
            return last.stopped(step.outcome)
        if step.outcome.status in STOPPED_EARLY:
            return step
        if not step.outcome.status.ok:
            break
        # On another grid a swing foot rests on its least height at other points.
        barrier = BARRIER_SAME_PROBLEM if problem.limits.clearance is None else BARRIER_NEARBY_PROBLEM
    if step is None:
        raise InputError(f"{type(problem.transcription).__name__}.approach must return at least one grid, got none.")
    if step.outcome.status.ok or len(path) == 1:
        return step
    return own.run(path[-1], None, BARRIER_SAME_PROBLEM)  # the coarse grid has misled


def refine_mesh(own: SingleStart, step: GridSolution) -> GridSolution:
    """Return the solution once it is accurate enough, or refinement ends."""
    problem, doublings = own.problem, MOST_DOUBLINGS
    tolerance = problem.transcription.tolerance
    while step.outcome.status.ok and math.isfinite(tolerance):
        if not step.error <= tolerance:
            step = step.polished()
        finer, rough = None, not step.error <= tolerance
        if rough:
            finer = step.method.finer()
        if finer is None and doublings and (rough or step.between.outside > ROUNDING or step.scuffs()):
            finer, doublings = step.method.doubled(problem.sequence), doublings - 1
        if finer is None:
            break
        last, step = step, own.run(finer, solution_of(step.transcription, step.outcome), BARRIER_SAME_PROBLEM)
        if step.outcome.status in STOPPED:
            return last.stopped(step.outcome)
    return step.reject_unsound() if math.isfinite(tolerance) else step


def repair_early_touchdown(own: SingleStart, step: GridSolution) -> GridSolution:
    """Return a solution that does not touch down before its end, where one is found nearby."""
    tries = MAX_GUARD_REPAIRS if math.isfinite(own.problem.transcription.tolerance) else 0
    for number in range(tries):
        early = early_touchdown(step.transcription, own.problem, step.x) if step.outcome.status.ok else None
        if early is None:
            break
        later = _solve_with_guard(own, step, replace(early.landing, least=early.landing.least * 4**number))
        if not later.outcome.status.ok:
            return later if later.outcome.status in STOPPED_EARLY else step
        step = later
    return _improve_arming_node(own, step)


def _solve_with_guard(own: SingleStart, step: GridSolution, landing: GuardSchedule) -> GridSolution:
    """Solve again from a solution, its touchdown held to a landing; the solution is kept if that is interrupted."""
    own.landing = landing
    later = refine_mesh(
        own, own.run(step.method, solution_of(step.transcription, step.outcome), BARRIER_NEARBY_PROBLEM)
    )
    return step.stopped(later.outcome) if later.outcome.status in STOPPED_EARLY else later


def _improve_arming_node(own: SingleStart, step: GridSolution) -> GridSolution:
    """Return the cheapest solution nearby whose touchdown is armed at another node, where there is a choice."""
    for side in (-1, 1):
        while landing := shift_arming(step.transcription.phases, step.transcription.structure.landing, side):
            later = _solve_with_guard(own, step, landing)
            if later.outcome.status in STOPPED_EARLY:
                return later
            gained = step.outcome.objective - later.outcome.objective
            if not later.outcome.status.ok or not gained > GAIN * abs(step.outcome.objective):
                break
            if early_touchdown(later.transcription, own.problem, later.x) is not None:
                break
            step = later
    return step
