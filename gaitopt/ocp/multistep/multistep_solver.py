"""Solution of a problem of several steps."""

import math
from dataclasses import replace

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.model.coordinate_entries import full_coordinates
from gaitopt.model.step_check import require_valid_step
from gaitopt.motion.motion import Array, Jump, Motion
from gaitopt.motion.sampling import TouchdownState, make_jump
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.multistep.foothold_ground import passes_change
from gaitopt.ocp.multistep.multistep_gait import MultiStepGait
from gaitopt.ocp.multistep.multistep_problem import FOOT_SPEED, MultiStepProblem
from gaitopt.ocp.multistep.multistep_transcription import MultiStepTranscription, transcribe_steps
from gaitopt.ocp.multistep.terrain_check import find_scuffs
from gaitopt.ocp.nlp.feasibility_refinement import refine_feasibility
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpResult
from gaitopt.ocp.solution.grid_solve import STOPPED_EARLY
from gaitopt.ocp.solution.trajectory import check_between_nodes, read_parameters, reconstruct_motion
from gaitopt.ocp.statement.initial_guess import LinearGuess
from gaitopt.ocp.statement.warm_start import FromMotion
from gaitopt.ocp.transcription.method import Method
from gaitopt.parameters import check_type
from gaitopt.progress import SolveObserver, silent
from gaitopt.status import Status

MOST_DOUBLINGS = 2
"""Largest number of times that the intervals are doubled until the plan is accurate between its nodes."""


@check_arguments
def solve_steps(
    problem: MultiStepProblem, *, solver: Ipopt | None = None, observer: SolveObserver = silent
) -> MultiStepGait:
    """Find an optimal gait of several steps.

    The intervals of all steps are doubled, at most twice, until the motion between the nodes agrees with them to the
    tolerance of the transcription of the first step; a less accurate solution on a finer grid is discarded.  If the
    swing foot is below the terrain in some steps, the problem is solved again with constraints on its height in them.

    Parameters
    ----------
    problem : MultiStepProblem
        Each step is started from its own guess, which may be a gait (:class:`gaitopt.WarmStart`).
    solver : Ipopt, optional
    observer : callable, optional
        Receives an :class:`gaitopt.progress.Iteration` per iteration.

    Returns
    -------
    MultiStepGait
        A numerical failure raises no exception: check its status, then verify it
        (:func:`gaitopt.simulation.verify_steps`).

    Raises
    ------
    InputError
        If the argument is not a MultiStepProblem, or the robot fails the check of its leg exchange.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, compass_biped
    >>> step = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.3, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared")
    >>> gait = solve_steps(MultiStepProblem(steps=(step, step.replace(step_length=0.5))))
    >>> gait.status.ok, [round(plan.travel, 6) for plan in gait.plans]
    (True, [0.45, 0.5])
    """
    check_type("problem", problem, MultiStepProblem, "a MultiStepProblem(...)")
    if not isinstance(solver, Ipopt | None):
        raise InputError(f"solver must be an Ipopt(...), got {solver!r}.")
    require_valid_step(problem.robot)
    solver = (solver or Ipopt()).start_clock()
    methods: list[Method] = [step.transcription for step in problem.resolved_steps]
    constrained = _steps_with_clearance(problem)
    gait = kept = None
    iterations = doublings = 0
    while True:
        transcription = transcribe_steps(problem, tuple(methods), constrained)
        x = _initial_point(transcription, None if gait is None else gait.plans)
        outcome = solver.minimise(transcription.nlp, x, transcription.data, transcription.limits, observer)
        if outcome.status.ok:
            outcome = refine_feasibility(transcription.nlp, outcome, transcription.data, transcription.limits)
        iterations += outcome.iterations
        gait = _gait(transcription, outcome, iterations)
        scuffing = set(find_scuffs(problem, gait.motion)) if gait.status.ok and problem.terrain is not None else set()
        if scuffing - constrained:
            constrained |= scuffing
            continue
        finer = [method.double_intervals(step.sequence) for method, step in zip(methods, problem.steps, strict=True)]
        better = kept is None or (not scuffing and gait.error_between_nodes < kept.error_between_nodes)
        if kept is not None and not (gait.status.ok and better):
            return _keep_coarser(kept, gait)
        accurate = not scuffing and gait.error_between_nodes <= problem.steps[0].transcription.tolerance
        if not gait.status.ok or accurate or doublings == MOST_DOUBLINGS or None in finer:
            return _report_scuffs(gait, scuffing)
        kept = None if scuffing else gait
        doublings += 1
        methods = [method for method in finer if method is not None]


def _keep_coarser(kept: MultiStepGait, finer: MultiStepGait) -> MultiStepGait:
    """Return the solution of a coarser grid, with the status of the solve on the finer one if that was stopped."""
    kept = replace(kept, iterations=finer.iterations)
    if finer.status not in STOPPED_EARLY:
        return kept
    message = f"{finer.message}; the result is the solution before this refinement"
    return replace(kept, status=finer.status, message=message)


def _report_scuffs(gait: MultiStepGait, scuffing: set[int]) -> MultiStepGait:
    """Return a gait, with the status of an inaccurate plan if the swing foot is below the terrain in some steps."""
    if not gait.status.ok or not scuffing:
        return gait
    message = f"{gait.message}; the swing foot is below the terrain in steps {sorted(scuffing)}, counted from 0"
    return replace(gait, status=Status.PLAN_INACCURATE, message=message)


def _steps_with_clearance(problem: MultiStepProblem) -> set[int]:
    """Return the numbers of the steps with a clearance in which the swing foot passes a change of the terrain.

    It begins at the previous foothold, which is that of the first step at the start.
    """
    if problem.terrain is None:
        return set()
    requested = {number for number, step in enumerate(problem.steps) if step.limits.clearance is not None}
    changes = {number for number in range(len(problem.steps)) if passes_change(problem.terrain, problem.ground, number)}
    return requested & (changes | {number + 1 for number in changes})


def _initial_point(transcription: MultiStepTranscription, plans: tuple[Motion, ...] | None) -> Array:
    """Return the initial point: the guess of each step, or its motion in an earlier solution."""
    pieces = []
    for number, (step, problem) in enumerate(
        zip(transcription.steps, transcription.problem.resolved_steps, strict=True)
    ):
        guess = problem.guess or LinearGuess()
        if plans is not None:
            guess = FromMotion(plans[number])
        pieces.append(initial_point(step, problem, guess))
    x = np.zeros(transcription.nlp.n_variables)
    x[: transcription.offsets[-1]] = np.concatenate(pieces)
    if not transcription.problem.periodic:
        layout = transcription.steps[0].variables
        typical = pieces[-1][np.concatenate([layout[Unknown.ANGLES][:, 0], layout[Unknown.RATES][:, 0]])]
        x[list(transcription.last.values())] = np.append(typical, 0.0)[: len(transcription.last)]
    return np.clip(x, transcription.limits.x_lower, transcription.limits.x_upper)


def _gait(transcription: MultiStepTranscription, outcome: NlpResult, iterations: int) -> MultiStepGait:
    problem, x, limits = transcription.problem, np.nan_to_num(outcome.x), transcription.limits
    error, plans = 0.0, []
    for number, (step, stated) in enumerate(zip(transcription.steps, problem.resolved_steps, strict=True)):
        part = transcription.step_unknowns(x, number)
        values = read_parameters(step, stated, part)
        motion = reconstruct_motion(step, values, part)
        plans.append(replace(motion, jumps=(_jump(transcription, x, number, motion),)))
        error = max(error, check_between_nodes(step, values, part).drift) if outcome.status.ok else math.inf
    violation = np.maximum(limits.g_lower - outcome.g, outcome.g - limits.g_upper).max(initial=0.0)
    status = outcome.status
    if status.ok and not error <= 1e3 * problem.resolved_steps[0].transcription.tolerance:
        status = Status.PLAN_INACCURATE
    return MultiStepGait(
        problem=problem,
        status=status,
        plans=tuple(plans),
        objective=outcome.objective,
        iterations=iterations,
        constraint_violation=float(violation),
        error_between_nodes=error,
        message=outcome.message,
    )


def _jump(transcription: MultiStepTranscription, x: Array, number: int, motion: Motion) -> Jump:
    """Return the touchdown at the end of a step, after which the next step begins."""
    problem, last = transcription.problem, motion.segments[-1]
    ends = number + 1 == len(problem.resolved_steps) and not problem.periodic
    place = number if ends else (number + 1) % len(problem.resolved_steps)
    following = problem.resolved_steps[place]
    if ends:
        columns = transcription.last
    else:
        layout, offset = transcription.steps[place].variables, transcription.offsets[place]
        rates = layout[Unknown.RATES][:, 0] + offset
        columns = dict(zip((f"{name}_rate" for name in problem.robot.angles), rates.tolist(), strict=True))
        if following.sequence.impact.slips:
            columns[FOOT_SPEED] = int(layout[Unknown.SLIDE, 0][1, 0]) + offset
    rates_after = x[[columns[f"{name}_rate"] for name in problem.robot.angles]]
    v_next = full_coordinates(rates_after, float(x[columns[FOOT_SPEED]]) if FOOT_SPEED in columns else 0.0)
    p = problem.robot.vector(motion.parameters)
    layout, offset = transcription.steps[number].variables, transcription.offsets[number]
    touchdown = TouchdownState(
        step=0,
        time=float(last.time[-1]),
        mode=following.sequence.impact,
        impulse=x[layout[Unknown.IMPULSE][:, 0] + offset],
        q=last.q[:, -1],
        v_minus=last.v[:, -1],
        v_plus=np.asarray(problem.robot.unswap(last.q[:, -1], v_next, p)).ravel(),
    )
    return make_jump(problem.robot, p, touchdown)
