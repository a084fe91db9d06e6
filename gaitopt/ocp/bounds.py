"""Numbers of a solve: the structure, data and bounds of one problem."""

import math
from dataclasses import dataclass

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule
from gaitopt.ocp.transcription.impact_complementarity import OPEN_IMPACT
from gaitopt.ocp.transcription.impact_constraints import ARMED, DIRECTION
from gaitopt.ocp.transcription.method import Method
from gaitopt.ocp.transcription.nlp_builder import MARGINS
from gaitopt.ocp.transcription.relaxation import Relaxation
from gaitopt.ocp.transcription.transcription import Structure, Transcription


@dataclass(frozen=True, eq=False)
class Bounds:
    """Bounds of variables and constraint rows.

    Attributes
    ----------
    x_lower, x_upper : (n_variables,) arrays
    g_lower, g_upper : (n_constraints,) arrays
    """

    x_lower: Array
    x_upper: Array
    g_lower: Array
    g_upper: Array


def structure(
    problem: GaitProblem, method: Method, relaxation: Relaxation | None = None, landing: GuardSchedule | None = None
) -> Structure:
    """Return what decides the equations of a problem's programme; an open contact sequence needs a relaxation."""
    if relaxation is None:
        problem.sequence.require_closed("A smooth programme")
    robot, limits = problem.robot, problem.limits
    torques = limits.torques(robot.actuators)
    return Structure(
        robot=robot,
        sequence=problem.sequence,
        objective=problem.objective,
        scheme=method.scheme,
        counts=method.intervals_for(problem.sequence),
        powered=tuple(name for name, limit in zip(robot.actuators, torques, strict=True) if limit > 0),
        free_slope=len(set(problem.slope_range)) > 1,
        rate_limited=any(map(math.isfinite, limits.torque_rates(robot.actuators))),
        cleared=limits.clearance is not None,
        landing=landing,
        relaxation=relaxation,
    )


def data_vector(problem: GaitProblem) -> Array:
    """Return the data of a solve: robot parameters, the margins that enter constraints, a clearance asked for."""
    margins = [getattr(problem.margins, name) for name in MARGINS]
    clearance = [] if problem.limits.clearance is None else [problem.limits.clearance]
    return np.concatenate([problem.robot.vector(problem.values), margins, clearance])


def bounds(transcription: Transcription, problem: GaitProblem) -> Bounds:
    """Return the bounds of a problem."""
    layout, limits = transcription.variables, problem.limits
    lower, upper = np.full(layout.size, -math.inf), np.full(layout.size, math.inf)
    torque = np.array(limits.torques(problem.robot.actuators))[:, None]
    low, high = np.array(limits.angles(problem.robot.angles)).T[:, :, None]
    lower[layout["angles"]], upper[layout["angles"]] = low, high
    symmetric: dict[str, float | Array] = {"rates": limits.rate, "torque": torque}
    for name, size in symmetric.items():
        lower[layout[name]], upper[layout[name]] = -size, size
    lower[layout["duration"]], upper[layout["duration"]] = limits.shortest_phase, limits.longest_step
    lower[layout["impulse"][1]] = 0.0
    step = problem.step_range
    lower[layout["travel"]], upper[layout["travel"]] = max(step.lower, 1e-3), step.upper
    if "slope" in layout:
        lower[layout["slope"]], upper[layout["slope"]] = problem.slope_range
    for name in layout.tables:
        if "power" in name or name == OPEN_IMPACT:
            lower[layout[name]] = 0.0
    for phase in transcription.phases:
        if phase.mode.slips:
            slide, speed = layout[f"slide {phase.number}"]
            lower[slide[0]] = upper[slide[0]] = 0.0
            low, high = _speed_bounds(phase, problem.margins.slip_speed)
            lower[speed], upper[speed] = low, high

    g_lower, g_upper = transcription.row_bounds.copy()
    rows = {
        "speed": (problem.speed_range.lower, problem.speed_range.upper),
        "step duration": (0.0, limits.longest_step),
        "separation of the trailing foot": (problem.margins.separation, math.inf),
        DIRECTION: (-math.inf, -problem.margins.touchdown_rate),
        ARMED: (problem.margins.touchdown_armed, math.inf),
    }
    for name, rate in zip(problem.robot.actuators, limits.torque_rates(problem.robot.actuators), strict=True):
        rows[f"torque rate of {name}"] = (-rate, rate)
    for table, names in transcription.constraints.rows.items():
        for name, places in zip(names, transcription.constraints[table], strict=True):
            if name in rows:
                g_lower[places], g_upper[places] = rows[name]
            elif name.startswith("normal force"):
                g_lower[places] = problem.margins.normal_force
    return Bounds(lower, upper, g_lower, g_upper)


def _speed_bounds(phase: Phase, margin: float) -> tuple[Array, Array]:
    """Return bounds of the foot speed at the phase's nodes, fading to zero towards an end at rest."""
    part = np.linspace(0, 1, phase.count + 1)
    least = np.full(part.size, margin)
    if phase.starts_at_rest or phase.starts_open:
        least *= np.minimum(1, 2 * part) ** 2  # a slide that starts on the cone starts with zero acceleration
    if phase.ends_at_rest:
        least *= np.minimum(1, 2 * (1 - part))
    most = np.full(part.size, math.inf)
    most[0] = 0.0 if phase.starts_at_rest else math.inf
    most[-1] = 0.0 if phase.ends_at_rest else math.inf
    return (least, most) if phase.mode.sign > 0 else (-most, -least)
