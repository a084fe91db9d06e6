"""Thresholds in the conditions that arm the contacts of a robot: too high ones, and robots with others."""

import math
from dataclasses import replace

import casadi as ca
import numpy as np

from gaitopt.interrupts import defer_interrupt
from gaitopt.lazy import Deferred
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.ground_penetration import list_parts
from gaitopt.motion.planar_motion import PlanarMotion
from gaitopt.ocp.multicontact.planar_bounds import planar_bounds, planar_data, planar_structure
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_start import planar_start
from gaitopt.ocp.multicontact.planar_transcription import transcribe_planar
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.keys import Kind
from gaitopt.progress import Observer
from gaitopt.status import Status


def lower_arming_thresholds(robot: PlanarRobot, shift: float) -> PlanarRobot:
    """Return a robot whose thresholds in `armed` are lower by a shift, in the unit of the expressions.

    Examples
    --------
    >>> from gaitopt.model.robots.flat_foot_walker import flat_foot_walker
    >>> robot = flat_foot_walker()
    >>> q, p = [0.0] * robot.n_q, robot.vector(robot.resolve({}))
    >>> i = robot.contact_index("heel A")
    >>> f"{float(lower_arming_thresholds(robot, 0.1).arming(q, q, p)[i] - robot.arming(q, q, p)[i]):.3f}"
    '0.100'
    """

    def build() -> ca.Function:
        arming = robot.arming
        inputs = [ca.SX.sym(arming.name_in(i), arming.size1_in(i)) for i in range(arming.n_in())]
        shifts = [shift * contact.conditional for contact in robot.contacts]
        return ca.Function("arming", inputs, [arming(*inputs) + ca.DM(shifts)], arming.name_in(), arming.name_out())

    return replace(robot, arming=Deferred(build))


def find_missing_arming(problem: PlanarProblem, solver: Ipopt, observer: Observer) -> dict[str, float]:
    """Return by how much the expression `armed` of contacts is too low in a motion whose touchdowns do not require it.

    Without such a motion near the guess, or if all its touchdowns are armed, the thresholds are no probable cause, and
    the result is empty.

    Parameters
    ----------
    problem : PlanarProblem
        A problem with a closed contact sequence.
    solver : Ipopt
    observer : Observer

    Raises
    ------
    KeyboardInterrupt
        If the solve is interrupted.
    """
    with defer_interrupt():
        transcription = transcribe_planar(planar_structure(problem))
        bounds = planar_bounds(transcription, problem)
        rows = transcription.constraints.find(Kind.ARMED).ravel()
        bounds.g_lower[rows] = -math.inf
        x = planar_start(transcription, problem, None)
    if not rows.size:
        return {}
    outcome = solver.minimise(transcription.nlp, x, planar_data(problem), bounds, observer, None)
    if outcome.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    if not outcome.status.ok:
        return {}
    names = [transcription.constraints.entries[row][1].of for row in rows]
    missing = zip(names, -outcome.g[rows], strict=True)
    return {name: float(value) for name, value in missing if value > -problem.margins.touchdown_armed}


def find_least_arming(robot: PlanarRobot, motion: PlanarMotion) -> float:
    """Return the least value of `armed` of contacts at their touchdowns in a motion; inf if none is conditional."""
    p, values = robot.vector(motion.parameters), [math.inf]
    for part in list_parts(robot, motion):
        armed = np.asarray(robot.arming(part.q[:, -1], part.v[:, -1], p)).ravel()
        values += [float(armed[i]) for i in part.closing if robot.contacts[i].conditional]
    return min(values)
