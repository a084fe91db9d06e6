"""Numbers of a solve: structure, data and bounds of one problem."""

import math

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.keys import Kind, Unknown
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.statement.stability_bound import LEAST_RADIUS
from gaitopt.ocp.statement.well_posedness import allows_paradox
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule
from gaitopt.ocp.transcription.method import Method
from gaitopt.ocp.transcription.nlp_builder import MARGINS
from gaitopt.ocp.transcription.phase_complementarity import TimeStepping
from gaitopt.ocp.transcription.relaxation import Relaxation
from gaitopt.ocp.transcription.transcription import Structure, Transcription, transcribe


def structure(
    problem: GaitProblem, method: Method, relaxation: Relaxation | None = None, schedule: GuardSchedule | None = None
) -> Structure:
    """Return the structure of a problem's NLP; an open contact sequence needs a relaxation."""
    if relaxation is None:
        problem.sequence.require_closed("A smooth NLP")
    robot, limits = problem.robot, problem.limits
    torques, is_open = limits.torques(robot.actuators), problem.sequence.has_open_phases
    return Structure(
        robot=robot,
        sequence=problem.sequence,
        objective=problem.objective,
        scheme=TimeStepping() if is_open else method.scheme,
        counts=method.intervals_for(problem.sequence),
        powered=tuple(name for name, limit in zip(robot.actuators, torques, strict=True) if limit > 0),
        free_slope=len(set(problem.slope_range)) > 1,
        free=tuple(problem.free),
        rate_limited=not is_open and any(map(math.isfinite, limits.torque_rates(robot.actuators))),
        cleared=limits.clearance is not None,
        inertia_limited=not is_open and _is_inertia_limited(problem),
        placed=method.fractions is not None and relaxation is None,
        schedule=schedule,
        relaxation=relaxation,
        stabilised=problem.stability is not None,
        fed_back=problem.stability is not None and problem.stability.gain_limit > 0,
        radius_weight=0.0 if problem.stability is None else problem.stability.weight,
    )


def transcribe_problem(problem: GaitProblem, method: Method, schedule: GuardSchedule | None = None) -> Transcription:
    """Transcribe a problem with a closed contact sequence, on the grid of a method."""
    transcription = transcribe(structure(problem, method, schedule=schedule))
    fractions = method.fractions_for(problem.sequence)
    return transcription if fractions is None else transcription.place_nodes(fractions)


def _is_inertia_limited(problem: GaitProblem) -> bool:
    """Return whether the sliding inertia is constrained: whether some slip of the sequence may be ill posed."""
    if not any(mode.slips for mode in problem.sequence.phases):
        return False
    angles = problem.limits.angles(problem.robot.angles)
    margin = problem.margins.sliding_inertia
    return any(allows_paradox(problem.robot, values, angles, margin) for values in problem.corners)


def data_vector(problem: GaitProblem) -> Array:
    """Return the numbers of a problem in its NLP: robot parameters, margins that enter constraints, the clearance."""
    margins = [getattr(problem.margins, name) for name in MARGINS]
    clearance = [] if problem.limits.clearance is None else [problem.limits.clearance]
    return np.concatenate([problem.robot.vector(problem.values), margins, clearance])


def nlp_data(
    transcription: Transcription, problem: GaitProblem, x: Array | None = None, *, exact: bool = False
) -> Array:
    """Return all data of an NLP: those of its problem, the places of its nodes, and sign changes of the joint powers.

    Parameters
    ----------
    transcription : Transcription
    problem : GaitProblem
    x : (n_variables,) array, optional
        Decision vector in which sign changes are located.  Without it, the absolute work is bounded from above.
    exact : bool
        Whether the data are used to evaluate the objective at `x` instead of solving from it.
    """
    changes = transcription.locate_sign_changes(x, touching=exact)
    return np.concatenate([data_vector(problem), transcription.node_fractions, changes])


def bounds(transcription: Transcription, problem: GaitProblem) -> Bounds:
    """Return the bounds of a problem."""
    x_lower, x_upper = _bounds_of_unknowns(transcription, problem)
    g_lower, g_upper = transcription.row_bounds.copy()
    rows, limits, margins = transcription.constraints, problem.limits, problem.margins
    speed, actuators = rows.find(Kind.SPEED), problem.robot.actuators
    g_lower[speed], g_upper[speed] = problem.speed_range.lower, problem.speed_range.upper
    g_upper[rows.find(Kind.STEP_DURATION)] = limits.longest_step
    g_lower[rows.find(Kind.SEPARATION)] = margins.separation
    g_upper[rows.find(Kind.TOUCHDOWN_DIRECTION)] = -margins.touchdown_rate
    g_lower[rows.find(Kind.TOUCHDOWN_AHEAD)] = margins.touchdown_armed
    g_lower[rows.find(Kind.NORMAL_FORCE)] = margins.normal_force
    g_lower[rows.find(Kind.SLIDING_INERTIA)] = margins.sliding_inertia
    for actuator, rate in zip(actuators, limits.torque_rates(actuators), strict=True):
        places = rows.find(Kind.TORQUE_RATE, actuator)
        g_lower[places], g_upper[places] = -rate, rate
    return Bounds(x_lower, x_upper, g_lower, g_upper)


def _bounds_of_unknowns(transcription: Transcription, problem: GaitProblem) -> tuple[Array, Array]:
    """Return the lower and upper bounds of the decision vector."""
    layout, limits, robot = transcription.variables, problem.limits, problem.robot
    lower, upper = np.full(layout.size, -math.inf), np.full(layout.size, math.inf)
    low, high = np.array(limits.angles(robot.angles)).T[:, :, None]
    lower[layout[Unknown.ANGLES]], upper[layout[Unknown.ANGLES]] = low, high
    lower[layout[Unknown.RATES]], upper[layout[Unknown.RATES]] = -limits.rate, limits.rate
    for actuator, torque in zip(robot.actuators, limits.torques(robot.actuators), strict=True):
        places = layout.find(Kind.TORQUE, actuator)
        lower[places], upper[places] = -torque, torque
    lower[layout[Unknown.DURATION]], upper[layout[Unknown.DURATION]] = limits.shortest_phase, limits.longest_step
    lower[layout[Unknown.IMPULSE][1]] = 0.0
    step = problem.step_length_range
    lower[layout[Unknown.TRAVEL]], upper[layout[Unknown.TRAVEL]] = max(step.lower, 1e-3), step.upper
    if Unknown.SLOPE in layout:
        lower[layout[Unknown.SLOPE]], upper[layout[Unknown.SLOPE]] = problem.slope_range
    if problem.stability is not None:
        lower[layout[Unknown.RADIUS]], upper[layout[Unknown.RADIUS]] = LEAST_RADIUS, problem.stability.radius
        gains = layout.find(Kind.GAIN)
        lower[gains], upper[gains] = -problem.stability.gain_limit, problem.stability.gain_limit
    for name, ends in problem.free.items():
        lower[layout.find(Kind.DESIGN, name)], upper[layout.find(Kind.DESIGN, name)] = ends
    if Unknown.OPEN_IMPACT in layout:
        lower[layout[Unknown.OPEN_IMPACT]] = 0.0
    for kind in (Kind.POSITIVE_POWER, Kind.NEGATIVE_POWER):
        lower[layout.find(kind)] = 0.0
    for slack in transcription.slacks:
        places = layout.find(Kind.SLACK, slack.name)
        lower[places], upper[places] = slack.lower, slack.upper
    if transcription.structure.scheme.nodal:
        _bound_slides(transcription, problem, lower, upper)
    else:
        _bound_open_slide(transcription, problem, lower, upper)
    return lower, upper


def _bound_slides(transcription: Transcription, problem: GaitProblem, lower: Array, upper: Array) -> None:
    """Bound slide and speed of the foot in slip phases."""
    for phase in transcription.phases:
        if phase.mode.slips:
            slide, speed = transcription.variables[Unknown.SLIDE, phase.number]
            lower[slide[0]] = upper[slide[0]] = 0.0
            ends_at_rest = speed[-1] in transcription.resting
            lower[speed], upper[speed] = _speed_bounds(phase, problem.margins.slip_speed, ends_at_rest)


def _bound_open_slide(transcription: Transcription, problem: GaitProblem, lower: Array, upper: Array) -> None:
    """Bound contact forces and the motion of the foot in open phases, and fix the modes of the others."""
    layout, sequence = transcription.variables, problem.sequence
    slide, speed = layout[Unknown.SLIDE]
    lower[slide[0]] = upper[slide[0]] = 0.0
    for kind in (Kind.CONTACT_NORMAL, Kind.CONTACT_FRICTION, Kind.SLIP_SPEED):
        lower[layout.find(kind)] = 0.0
    lower[layout.find(Kind.CONTACT_NORMAL)] = problem.margins.normal_force
    modes = [(sequence.impact, speed[:1]), *((phase.mode, speed[list(phase.nodes)]) for phase in transcription.phases)]
    for mode, places in modes:
        if mode is Mode.STICK:
            lower[places] = upper[places] = 0.0
        elif mode.sign > 0:
            lower[places] = np.maximum(lower[places], 0.0)
        elif mode.sign < 0:
            upper[places] = np.minimum(upper[places], 0.0)


def _speed_bounds(phase: Phase, margin: float, ends_at_rest: bool) -> tuple[Array, Array]:
    """Return bounds of the foot speed at the nodes of a phase.

    The least speed decreases to zero towards a start at rest and towards the transition that ends the slip.
    """
    part = phase.fractions
    least = np.full(part.size, margin)
    if phase.starts_at_rest or phase.starts_open:
        least *= np.minimum(1, 2 * part) ** 2  # a slide that starts on the cone starts with zero acceleration
    if phase.following is not None:
        least *= np.minimum(1, 2 * (1 - part))
    most = np.full(part.size, math.inf)
    most[0] = 0.0 if phase.starts_at_rest else math.inf
    most[-1] = 0.0 if ends_at_rest else math.inf
    return (least, most) if phase.mode.sign > 0 else (-most, -least)
