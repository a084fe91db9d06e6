"""From coarse grids to a plan that is accurate between its nodes and touches down at its end."""

import math
from dataclasses import replace

from gaitopt.ocp.carrying import solution_of
from gaitopt.ocp.diagnosis import ROUNDING
from gaitopt.ocp.ipopt import STOPPED
from gaitopt.ocp.landing import Landing, shifted
from gaitopt.ocp.step import NEAR, SAME, Attempt, Step
from gaitopt.ocp.swing import early_touchdown
from gaitopt.status import Status

MOST_DOUBLINGS = 2
"""Grids are doubled so often for a contact mode that is violated between the points at which it is held."""

MOST_LANDINGS = 3
"""A plan that touches down early is solved so often again with its touchdown kept from that."""

GAIN = 1e-4
"""Share of the objective for which the node at which the touchdown is armed is moved further."""

CALLED_OFF = (Status.INTERRUPTED, Status.TIME_LIMIT)
"""Endings after which nothing more is tried."""


def approached(own: Attempt) -> Step:
    """Return the solution on the problem's own grid, found through coarser ones."""
    problem, guess = own.problem, own.guess
    path, before, barrier = problem.transcription.approach(problem.word), None, SAME
    known = guess.solution_for(problem.word)
    if known is not None:
        path, before, barrier = path[-1:], known, NEAR
    step = None
    for method in path:
        if step is not None:
            before = solution_of(step.transcription, step.outcome)
        last, step = step, own.run(method, before, barrier)
        if step.outcome.status in STOPPED and last is not None:
            return last.stopped(step.outcome)
        if step.outcome.status in CALLED_OFF:
            return step
        if not step.outcome.status.ok:
            break
        # On another grid a swing foot rests on its least height at other points.
        barrier = SAME if problem.limits.clearance is None else NEAR
    assert step is not None
    if step.outcome.status.ok or len(path) == 1:
        return step
    return own.run(path[-1], None, SAME)  # the coarse grid has misled


def refined(own: Attempt, step: Step) -> Step:
    """Return the solution once it is accurate enough, or refinement ends."""
    problem, doublings = own.problem, MOST_DOUBLINGS
    tolerance = problem.transcription.tolerance
    while step.outcome.status.ok and math.isfinite(tolerance):
        if step.error > tolerance:
            step = step.polished()
        finer, rough = None, step.error > tolerance
        if rough:
            finer = step.method.finer()
        if finer is None and doublings and (rough or step.between.outside > ROUNDING or step.scuffs()):
            finer, doublings = step.method.doubled(problem.word), doublings - 1
        if finer is None:
            break
        last, step = step, own.run(finer, solution_of(step.transcription, step.outcome), SAME)
        if step.outcome.status in STOPPED:
            return last.stopped(step.outcome)
    return step


def landed(own: Attempt, step: Step) -> Step:
    """Return a solution that does not touch down before its end, where one is found nearby."""
    tries = MOST_LANDINGS if math.isfinite(own.problem.transcription.tolerance) else 0
    for number in range(tries):
        early = early_touchdown(step.transcription, own.problem, step.x) if step.outcome.status.ok else None
        if early is None:
            break
        later = _held_to(own, step, replace(early.landing, least=early.landing.least * 4**number))
        if not later.outcome.status.ok:
            return later if later.outcome.status in CALLED_OFF else step
        step = later
    return _armed_in_time(own, step)


def _held_to(own: Attempt, step: Step, landing: Landing) -> Step:
    """Solve again from a solution, its touchdown held to a landing; the solution is kept if that is interrupted."""
    own.landing = landing
    later = refined(own, own.run(step.method, solution_of(step.transcription, step.outcome), NEAR))
    return step.stopped(later.outcome) if later.outcome.status in CALLED_OFF else later


def _armed_in_time(own: Attempt, step: Step) -> Step:
    """Return the cheapest solution nearby whose touchdown is armed at another node, where there is a choice."""
    for side in (-1, 1):
        while landing := shifted(step.transcription.phases, step.transcription.structure.landing, side):
            later = _held_to(own, step, landing)
            if later.outcome.status in CALLED_OFF:
                return later
            gained = step.outcome.objective - later.outcome.objective
            if not later.outcome.status.ok or gained <= GAIN * abs(step.outcome.objective):
                break
            if early_touchdown(later.transcription, own.problem, later.x) is not None:
                break
            step = later
    return step
