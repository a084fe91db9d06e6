"""What a plan's swing foot does between the nodes: whether it is high enough, and whether it touches down early.

Place and rate at the nodes give cubic polynomials in between, whose error is of fourth order.
"""

from dataclasses import dataclass

import numpy as np

from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solve.trajectory import solved_parameters
from gaitopt.ocp.transcription.foot_clearance import bump
from gaitopt.ocp.transcription.grid import node_places
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule, schedule_for
from gaitopt.ocp.transcription.transcription import Transcription
from gaitopt.reductions import worst

PARTS = 8
"""Samples of an interval."""

EDGE = 1e-9
"""A guard nearer to zero than this has no sign."""

SCUFF = 1e-4
"""Height [m] by which a foot may be too low between the nodes before that is worth a finer grid."""


@dataclass(frozen=True)
class EarlyTouchdown:
    """A touchdown before the end of a plan.

    Attributes
    ----------
    place : str
        The node after which it happens.
    landing : Landing
        With which the plan nearby has none.
    """

    place: str
    landing: GuardSchedule


@defer_interrupt()
def lack_of_height(transcription: Transcription, problem: GaitProblem, x: Array) -> float:
    """Return by how much a plan's swing foot is too low at worst [m], between the nodes, too."""
    layout, robot, clearance = transcription.variables, problem.robot, problem.limits.clearance
    if clearance is None:
        return 0.0
    q, v, lengths = _nodes(transcription, x)
    p = robot.vector(solved_parameters(transcription, problem, x))
    position, velocity = (np.asarray(found) for found in robot.landing.map(q.shape[1])(q, v, p)[:2])
    ahead, height = (_between(values, rates, lengths) for values, rates in zip(position, velocity, strict=True))
    slid = sum(x[layout[Unknown.SLIDE, phase.number][0, -1]] for phase in transcription.phases if phase.mode.slips)
    distance = x[layout[Unknown.TRAVEL][0, 0]] - slid
    return worst(0.0, clearance * bump(ahead, distance) - height)


@defer_interrupt()
def early_touchdown(transcription: Transcription, problem: GaitProblem, x: Array) -> EarlyTouchdown | None:
    """Return where a plan touches down before its end, as the simulator would find it; None if it does not."""
    robot, (q, v, lengths) = problem.robot, _nodes(transcription, x)
    p = robot.vector(solved_parameters(transcription, problem, x))
    at_nodes, rate, armed_at_nodes = (np.asarray(found)[0] for found in robot.touchdown.map(q.shape[1])(q, v, p))
    unsound = np.flatnonzero(~np.isfinite(at_nodes + rate + armed_at_nodes))
    if unsound.size:  # a guard that cannot be evaluated is no proof that the foot stays above the ground
        place = node_places(transcription.phases)[int(unsound[0])].label
        guards = (np.nan_to_num(values[:-1]) for values in (at_nodes, armed_at_nodes))
        return EarlyTouchdown(place, schedule_for(transcription.phases, *guards))
    guard, nodes = _between(at_nodes, rate, lengths), np.arange(at_nodes.size)
    sided = np.flatnonzero(np.abs(guard) > EDGE)
    fallen = np.flatnonzero((guard[sided[:-1]] > 0) & (guard[sided[1:]] < 0))
    before, after = sided[fallen], sided[fallen + 1]
    falls = (before + (after - before) * guard[before] / (guard[before] - guard[after])) / PARTS
    early = falls[np.interp(falls, nodes, armed_at_nodes) > 0]
    if not early.size:
        return None
    landing = schedule_for(transcription.phases, at_nodes[:-1], armed_at_nodes[:-1])
    return EarlyTouchdown(node_places(transcription.phases)[int(early[0])].label, landing)


def _nodes(transcription: Transcription, x: Array) -> tuple[Array, Array, Array]:
    """Return q and v at all nodes, seen from the stance foot, and the lengths of the intervals [s]."""
    layout = transcription.variables
    q, v = np.zeros((2, transcription.structure.robot.n_q, transcription.n_nodes))
    q[2:], v[2:] = x[layout[Unknown.ANGLES]], x[layout[Unknown.RATES]]
    counts = transcription.structure.counts
    return q, v, np.repeat(x[layout[Unknown.DURATION][0]] / counts, counts)


def _between(values: Array, rates: Array, lengths: Array) -> Array:
    """Return values given with their rates at the nodes at PARTS samples of each interval, the last node left out."""
    s = np.arange(PARTS) / PARTS
    begun, ended = (lengths * rates[:-1])[:, None], (lengths * rates[1:])[:, None]
    risen = s**2 * (3 - 2 * s) * np.diff(values)[:, None]
    return np.ravel(values[:-1, None] + risen + s * (1 - s) ** 2 * begun - s**2 * (1 - s) * ended)
