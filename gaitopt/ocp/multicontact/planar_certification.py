"""Certificate of the optimal gait of a planar robot on its grid, and derivatives of its cost."""

import functools
import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.certificate import Certificate, Sensitivity
from gaitopt.motion.motion import Array
from gaitopt.ocp.initial.cost_prediction import evaluate_lagrangian, evaluate_nlp
from gaitopt.ocp.multicontact.early_touchdown import share_of_clearance
from gaitopt.ocp.multicontact.planar_bounds import planar_bounds, planar_data
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_relaxable import typical_planar_sizes
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.nlp_solver import NlpResult
from gaitopt.ocp.nlp.second_order import check_second_order
from gaitopt.ocp.solution.certification import make_certificate
from gaitopt.ocp.solution.sensitivity import (
    Number,
    change_entry,
    list_limit_values,
    list_margins,
    list_pairs,
    list_parameters_and_targets,
    list_sizes,
    rank_sensitivities,
)


def certify_planar(
    problem: PlanarProblem, transcription: PlanarTranscription, bounds: Bounds, outcome: NlpResult
) -> Certificate | None:
    """Return the certificate of a solution on one grid; None if the solve failed.

    Parameters
    ----------
    problem : PlanarProblem
    transcription : PlanarTranscription
    bounds : Bounds
        Bounds of the solve, which may exceed those of the problem to exclude an invalid touchdown.  Those that are no
        part of the clearance are constant in the derivatives of the cost.
    outcome : NlpResult
    """
    if not outcome.status.ok:
        return None
    data, sizes = planar_data(problem), typical_planar_sizes(transcription, problem)
    check = check_second_order(transcription.nlp, outcome.x, outcome.multipliers, data, bounds, sizes)
    sensitivities = _cost_sensitivities(problem, transcription, bounds, outcome)
    return make_certificate(check, (transcription.variables, transcription.constraints), sensitivities)


def _cost_sensitivities(
    problem: PlanarProblem, transcription: PlanarTranscription, bounds: Bounds, outcome: NlpResult
) -> tuple[Sensitivity, ...]:
    """Return the derivative of the optimal objective with respect to every number that affects it."""
    raised = np.flatnonzero(bounds.g_lower > planar_bounds(transcription, problem).g_lower).tolist()
    shares = np.array([share_of_clearance(transcription, row) for row in raised])
    stated = bounds.g_lower[raised]
    depends = np.isclose(stated, problem.limits.clearance * shares, rtol=1e-9, atol=0.0)

    @functools.cache
    def evaluate_at(numbers: tuple[float, ...]) -> tuple[float, Array]:
        """Return the values of the NLP, which do not depend on its bounds."""
        return evaluate_nlp(transcription.nlp, outcome.x, np.array(numbers))

    @defer_interrupt()
    def evaluate(changed: PlanarProblem) -> float:
        values, limits = evaluate_at(tuple(planar_data(changed).tolist())), planar_bounds(transcription, changed)
        limits.g_lower[raised] = np.where(depends, changed.limits.clearance * shares, stated)
        return evaluate_lagrangian(values, outcome.x, outcome.multipliers, limits)

    return rank_sensitivities(list_planar_numbers(problem), evaluate, transcription.nlp.typical)


def list_planar_numbers(problem: PlanarProblem) -> Iterator[Number]:
    """Yield the finite numbers of a problem: parameters of robot and ground, targets, limits and margins."""
    limits, robot = problem.limits, problem.robot
    yield from list_parameters_and_targets(problem)
    yield from list_sizes(problem, "torque", dict(zip(robot.actuators, limits.torques(robot.actuators), strict=True)))
    pairs = dict(zip(robot.coordinates, limits.coordinates(robot.coordinates), strict=True))
    yield from list_pairs(problem, "coordinate", pairs)
    heights = limits.heights(robot.points)
    for point, height in heights.items():
        yield Number(
            f"height_limit of {point}", height, functools.partial(change_entry, problem, "height", heights, point)
        )
    yield from list_limit_values(problem, ("rate", "shortest_phase", "longest_step", "clearance", "impulse"))
    yield from list_margins(problem)
    for place, impulse in enumerate(problem.impulses):
        for side, value in enumerate(impulse.limits):
            if value == 0 or math.isinf(value):  # a limit of zero determines the sign of the impulse
                continue
            bound, subject = ("lower", "upper")[side], f"{impulse.actuator} {impulse.moment} {impulse.event}"
            name = f"{bound} limit of the impulse of {subject}"
            yield Number(name, value, functools.partial(_change_impulse, problem, place, side))


def _change_impulse(problem: PlanarProblem, place: int, side: int, value: float) -> PlanarProblem:
    """Return a problem with another limit of an impulse of an actuator."""
    impulse, impulses = problem.impulses[place], list(problem.impulses)
    limits = (value, impulse.limits[1]) if side == 0 else (impulse.limits[0], value)
    impulses[place] = replace(impulse, limits=limits)
    return problem.replace(impulses=tuple(impulses))
