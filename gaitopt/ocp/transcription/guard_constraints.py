"""A touchdown kept from happening before the end of the step.

A step ends when the robot's guard falls through zero while the touchdown is armed, so inside the step the guard may
fall through zero only while it is not.  This is no smooth constraint, and plans that need it are rare; but the course
of a plan that touches down early tells until when the touchdown is to stay unarmed, where the guard, which has fallen
by then, is to stay below zero, and where above.
"""

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.keys import Group, Key, Kind, Row, Unknown
from gaitopt.ocp.nlp.nlp import Block
from gaitopt.ocp.transcription.grid import Phase, node_places
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder


@dataclass(frozen=True)
class GuardSchedule:
    """What touchdown's guard keeps to; instants are counted in phases, 1.5 being the middle of the second.

    Attributes
    ----------
    unarmed : float
        Until then the touchdown is not armed.
    below : float
        From there until then the guard is below zero; nowhere if both are the same.
    above : float
        From then until the end of the step the guard is above zero.
    least : float
        Distance from zero, of what is above or below it, in the middle of its span, in the unit of the robot's guard or
        `armed`; so it has its sign between the nodes, too.
    """

    unarmed: float
    below: float
    above: float
    least: float = 1e-3


def guard_blocks(frame: NlpBuilder, phases: tuple[Phase, ...], landing: GuardSchedule) -> list[Block]:
    """Return the blocks that keep a step from ending before its last node."""
    unarmed, below, above = (_node(phases, at) for at in (landing.unarmed, landing.below, landing.above))
    end, least = phases[-1].nodes[-1], landing.least
    spans = [
        _Span(Group.NOT_ARMED, Kind.NOT_ARMED, "armed", -1, range(1, unarmed + 1), least * np.ones(unarmed)),
        _Span(Group.GUARD_ABOVE, Kind.GUARD_ABOVE, "guard", 1, range(above, end), least * _fading(end - above)),
    ]
    if below > unarmed:
        nodes = range(unarmed, below + 1)
        spans.append(_Span(Group.GUARD_BELOW, Kind.GUARD_BELOW, "guard", -1, nodes, least * _fading(len(nodes))))
    return [_block(frame, phases, span) for span in spans if span.nodes]


class _Span(NamedTuple):
    """Nodes at which an output of the robot's touchdown, times a sign, has a least value."""

    table: Group
    kind: Kind
    output: str
    sign: int
    nodes: range
    least: Array


def _block(frame: NlpBuilder, phases: tuple[Phase, ...], span: _Span) -> Block:
    robot, nodes, local = frame.robot, list(span.nodes), BlockVariables(frame, len(span.nodes))
    p = local.parameters()
    q, v = (
        ca.vertcat(0, 0, local.add(part, frame.variables[part][:, nodes])) for part in (Unknown.ANGLES, Unknown.RATES)
    )
    values = robot.touchdown.call({"q": q, "v": v, "p": p})
    places = node_places(phases)
    rows = frame.rows.add(span.table, [Row(Key(span.kind), 0.0, math.inf)], [places[k] for k in nodes])
    for index, least in zip(rows[0], span.least, strict=True):
        frame.rows.bound(index, least, math.inf)
    return local.block(span.kind.name.lower(), span.sign * values[span.output], rows)


def _fading(count: int) -> Array:
    """Return shares for the nodes of a span, at whose ends the guard may be at zero."""
    part = np.arange(count) / count
    return 2 * np.minimum(part, 1 - part)


def schedule_for(phases: tuple[Phase, ...], guard: Array, armed: Array) -> GuardSchedule:
    """Return the landing nearest to the course of a plan that touches down early.

    Parameters
    ----------
    phases : tuple of Phase
    guard, armed : (n_nodes - 1,) arrays
        At the nodes of the plan but the last.
    """
    first = int(np.flatnonzero(armed <= 0).max(initial=0))
    above, below = np.maximum(guard[first:], 0), np.maximum(-guard[first:], 0)
    # Where it is armed, the guard shall be below zero before some node and above from there on; the best node is the
    # one for which the plan is nearest to that.
    highest_before = np.maximum.accumulate(np.append(0, above[:-1]))
    lowest_after = np.maximum.accumulate(below[::-1])[::-1]
    change = first + int(np.argmin(highest_before + lowest_after))
    if change == first:
        return GuardSchedule(*[_instant(phases, first)] * 3)
    lowest = first + int(np.argmin(guard[first:change]))
    highest = change + int(np.argmax(guard[change:]))
    return GuardSchedule(*(_instant(phases, k) for k in (first, lowest, highest)))


def shift_arming(phases: tuple[Phase, ...], landing: GuardSchedule | None, side: int) -> GuardSchedule | None:
    """Return a landing armed a node earlier or later, but before its guard is lowest; None where there is none."""
    if landing is None:
        return None
    unarmed = _node(phases, landing.unarmed) + side
    return replace(landing, unarmed=_instant(phases, unarmed)) if 0 < unarmed < _node(phases, landing.below) else None


def _node(phases: tuple[Phase, ...], instant: float) -> int:
    """Return the node nearest to an instant."""
    phase = phases[min(int(instant), len(phases) - 1)]
    return phase.first + round((instant - phase.number) * phase.count)


def _instant(phases: tuple[Phase, ...], node: int) -> float:
    """Return the instant of a node."""
    phase = next(phase for phase in phases if node in phase.nodes)
    return phase.number + (node - phase.first) / phase.count
