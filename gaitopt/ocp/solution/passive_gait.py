"""Passive walking cycles, as initial guesses of an optimisation."""

import math
from collections.abc import Mapping

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Motion
from gaitopt.ocp.bounds import bounds, data_vector, structure
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.trajectory import reconstruct_motion
from gaitopt.ocp.statement.criteria import TorqueSquared
from gaitopt.ocp.statement.initial_guess import LinearGuess
from gaitopt.ocp.statement.limits import Limits
from gaitopt.ocp.transcription.collocation import Collocation
from gaitopt.ocp.transcription.transcription import Transcription, transcribe
from gaitopt.progress import silent
from gaitopt.status import Status


@check_arguments
def passive_cycle(
    robot: Robot, slope: float, parameters: Mapping[str, float] | None = None, *, intervals: int = 40
) -> Motion:
    """Find a passive gait: a cycle in which the robot walks down a slope without torque and without slip.

    Parameters
    ----------
    robot : Robot
    slope : float [rad]
    parameters : mapping of str to float, optional
    intervals : int

    Returns
    -------
    Motion
        One step; ``FromMotion(motion)`` starts another optimisation from it.

    Raises
    ------
    InputError
        If no passive cycle is found on this slope.

    Examples
    --------
    >>> import math
    >>> from gaitopt import compass_biped
    >>> cycle = passive_cycle(compass_biped(), math.radians(1))
    >>> round(cycle.period, 4), round(cycle.travel, 4)
    (0.7446, 0.4714)
    """
    problem = GaitProblem(
        robot=robot,
        sequence=ContactSequence.parse("stick | stick"),
        parameters=parameters or {},
        friction=math.inf,
        slope=slope,
        objective=TorqueSquared(),
        limits=Limits(torque=math.inf),
        name="passive cycle",
    )
    transcription = transcribe(structure(problem, Collocation(intervals=intervals)))
    limits = _without_torque(transcription, bounds(transcription, problem))
    x = np.clip(initial_point(transcription, problem, LinearGuess()), limits.x_lower, limits.x_upper)
    outcome = Ipopt().minimise(transcription.nlp, x, data_vector(problem), limits, silent)
    if outcome.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    if not outcome.status.ok:
        raise InputError(
            f"No passive cycle of robot {robot.name!r} was found at a slope of {math.degrees(slope):g} deg "
            f"({outcome.message}); try another slope."
        )
    return reconstruct_motion(transcription, problem.values, outcome.x)


def _without_torque(transcription: Transcription, limits: Bounds) -> Bounds:
    """Return bounds that fix all torques at zero."""
    lower, upper = limits.x_lower.copy(), limits.x_upper.copy()
    torques = transcription.variables[Unknown.TORQUE]
    lower[torques] = upper[torques] = 0.0
    return Bounds(lower, upper, limits.g_lower, limits.g_upper)
