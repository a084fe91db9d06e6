"""Checks of the swing foot between the nodes: its height, and touchdowns before the end of the step.

Position and velocity at the nodes are interpolated by cubic polynomials, whose error is of fourth order.
"""

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.interrupts import defer_interrupt
from gaitopt.model.coordinate_entries import full_coordinates
from gaitopt.model.uneven_ground import height_of_footprints, is_on_uneven_ground, travel_of_slides
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.trajectory import read_parameters
from gaitopt.ocp.transcription.foot_clearance import bump
from gaitopt.ocp.transcription.grid import node_places
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule, propose_schedule
from gaitopt.ocp.transcription.transcription import Transcription
from gaitopt.reductions import worst

PARTS = 8
"""Number of samples per interval."""

EDGE = 1e-9
"""Absolute value of a guard below which its sign is undefined."""

SCUFF = 1e-4
"""Lack of height between the nodes [m] above which the grid is refined."""


@dataclass(frozen=True)
class EarlyTouchdown:
    """A touchdown before the end of a plan, or one at its end that the simulator does not locate.

    Attributes
    ----------
    place : str
        Node after which the touchdown happens.
    schedule : GuardSchedule
        Constraints under which a nearby plan has none.
    grazes : bool
        Whether the touchdown is at the end of the plan, but the guard is not above zero before it.
    """

    place: str
    schedule: GuardSchedule
    grazes: bool = False


@defer_interrupt()
def lack_of_height(transcription: Transcription, problem: GaitProblem, x: Array) -> float:
    """Return the largest lack of height of the swing foot [m], at the nodes and between them."""
    layout, robot, clearance = transcription.variables, problem.robot, problem.limits.clearance
    if clearance is None:
        return 0.0
    q, v, lengths = _nodes(transcription, x)
    p = robot.vector(read_parameters(transcription, problem, x))
    position, velocity = (np.asarray(output) for output in robot.landing.map(q.shape[1])(q, v, p)[:2])
    ahead, height = (_between(values, rates, lengths) for values, rates in zip(position, velocity, strict=True))
    slid = sum(x[layout[Unknown.SLIDE, phase.number][0, -1]] for phase in transcription.phases if phase.mode.slips)
    distance = x[layout[Unknown.TRAVEL][0, 0]] - travel_of_slides(robot, p, slid)
    lowest = clearance * bump(ahead, distance)
    if is_on_uneven_ground(robot):
        lowest += height_of_footprints(robot, p, ahead, distance)
    return worst(0.0, lowest - height)


@defer_interrupt()
def early_touchdown(transcription: Transcription, problem: GaitProblem, x: Array) -> EarlyTouchdown | None:
    """Return the first touchdown before the end of a plan, located as in the simulator; None if none exists.

    At the end of the plan the guard falls to zero, so it must be above zero somewhere in the last interval.
    """
    robot, (q, v, lengths) = problem.robot, _nodes(transcription, x)
    p = robot.vector(read_parameters(transcription, problem, x))
    at_nodes, rate, armed_at_nodes = (np.asarray(output)[0] for output in robot.touchdown.map(q.shape[1])(q, v, p))
    undefined = np.flatnonzero(~np.isfinite(at_nodes + rate + armed_at_nodes))
    if undefined.size:  # a guard that is not finite does not exclude a touchdown
        place = node_places(transcription.phases)[int(undefined[0])].label
        guards = (np.nan_to_num(values[:-1]) for values in (at_nodes, armed_at_nodes))
        return EarlyTouchdown(place, propose_schedule(transcription.phases, *guards))
    guard, nodes = _between(at_nodes, rate, lengths), np.arange(at_nodes.size)
    nonzero = np.flatnonzero(np.abs(guard) > EDGE)
    crossings = np.flatnonzero((guard[nonzero[:-1]] > 0) & (guard[nonzero[1:]] < 0))
    before, after = nonzero[crossings], nonzero[crossings + 1]
    falls = (before + (after - before) * guard[before] / (guard[before] - guard[after])) / PARTS
    early = falls[np.interp(falls, nodes, armed_at_nodes) > 0]
    grazes = not early.size and not np.any(guard[-PARTS:] > EDGE)
    if not early.size and not grazes:
        return None
    schedule = propose_schedule(transcription.phases, at_nodes[:-1], armed_at_nodes[:-1])
    node = nodes[-2] if grazes else int(early[0])
    return EarlyTouchdown(node_places(transcription.phases)[node].label, schedule, grazes)


def _nodes(transcription: Transcription, x: Array) -> tuple[Array, Array, Array]:
    """Return q and v at all nodes, relative to the stance foot, and the lengths of the intervals [s]."""
    layout = transcription.variables
    q, v = (full_coordinates(x[layout[part]]) for part in (Unknown.ANGLES, Unknown.RATES))
    durations = x[layout[Unknown.DURATION][0]]
    return q, v, np.concatenate([durations[phase.number] * phase.shares for phase in transcription.phases])


def _between(values: Array, rates: Array, lengths: Array) -> Array:
    """Return the cubic interpolation of values and rates at PARTS samples per interval, without the last node."""
    s = np.arange(PARTS) / PARTS
    left, right = (lengths * rates[:-1])[:, None], (lengths * rates[1:])[:, None]
    rise = s**2 * (3 - 2 * s) * np.diff(values)[:, None]
    return np.ravel(values[:-1, None] + rise + s * (1 - s) ** 2 * left - s**2 * (1 - s) * right)
