"""Guard constraints: no touchdown before the end of the step.

A step ends when the guard of the robot falls through zero while the touchdown is armed.  Within the step the guard may
therefore fall through zero only while the touchdown is not armed.  This condition is not smooth and rarely active; a
plan that touches down early determines a schedule of smooth constraints instead: until when the touchdown is unarmed,
where the guard is below zero, and where above.
"""

import math
from dataclasses import replace
from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.phase_dynamics import full_vector
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.keys import Group, Key, Kind, Row, Unknown
from gaitopt.ocp.transcription.grid import Phase, node_places
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder


@dataclass(frozen=True)
class GuardSchedule:
    """Schedule of the touchdown guard; instants are counted in phases, 1.5 being the middle node of the second.

    Attributes
    ----------
    unarmed : float
        Instant until which the touchdown is not armed.
    below : float
        Instant until which, from `unarmed`, the guard is below zero; no such span if both are equal.
    above : float
        Instant from which until the end of the step the guard is above zero.
    least : float
        Least absolute value of guard or `armed` in the middle of a span, in their units, so that they keep their sign
        between the nodes.
    """

    unarmed: float
    below: float
    above: float
    least: float = 1e-3


def guard_blocks(builder: NlpBuilder, phases: tuple[Phase, ...], schedule: GuardSchedule) -> list[Block]:
    """Return the blocks that exclude a touchdown before the last node."""
    unarmed, below, above = (_node(phases, at) for at in (schedule.unarmed, schedule.below, schedule.above))
    end, least = phases[-1].nodes[-1], schedule.least
    spans = [
        _Span(Group.NOT_ARMED, Kind.NOT_ARMED, "armed", -1, range(1, unarmed + 1), least * np.ones(unarmed)),
        _Span(Group.GUARD_ABOVE, Kind.GUARD_ABOVE, "guard", 1, range(above, end), least * _fade(end - above)),
    ]
    if below > unarmed:
        nodes = range(unarmed, below + 1)
        spans.append(_Span(Group.GUARD_BELOW, Kind.GUARD_BELOW, "guard", -1, nodes, least * _fade(len(nodes))))
    return [_block(builder, phases, span) for span in spans if span.nodes]


class _Span(NamedTuple):
    """Nodes at which an output of the robot's touchdown, times a sign, has a lower bound."""

    table: Group
    kind: Kind
    output: str
    sign: int
    nodes: range
    least: Array


def _block(builder: NlpBuilder, phases: tuple[Phase, ...], span: _Span) -> Block:
    robot, nodes, local = builder.robot, list(span.nodes), BlockVariables(builder, len(span.nodes))
    p = local.parameters()
    q, v = (
        full_vector(ca.SX(0), local.add(part, builder.variables[part][:, nodes]))
        for part in (Unknown.ANGLES, Unknown.RATES)
    )
    values = robot.touchdown.call({"q": q, "v": v, "p": p})
    places = node_places(phases)
    rows = builder.rows.add(span.table, [Row(Key(span.kind), 0.0, math.inf)], [places[k] for k in nodes])
    for index, least in zip(rows[0], span.least, strict=True):
        builder.rows.bound(index, least, math.inf)
    return local.block(span.kind.name.lower(), span.sign * values[span.output], rows)


def _fade(count: int) -> Array:
    """Return factors of the lower bound at the nodes of a span, 0 at its ends and 1 in the middle."""
    part = np.arange(count) / count
    return 2 * np.minimum(part, 1 - part)


def propose_schedule(phases: tuple[Phase, ...], guard: Array, armed: Array) -> GuardSchedule:
    """Return the schedule nearest to a plan that touches down early.

    Parameters
    ----------
    phases : tuple of Phase
    guard, armed : (n_nodes - 1,) arrays
        Values at all nodes of the plan except the last.
    """
    first = int(np.flatnonzero(armed <= 0).max(initial=0))
    above, below = np.maximum(guard[first:], 0), np.maximum(-guard[first:], 0)
    # While armed, the guard must be below zero before some node and above zero from there on; the node chosen is the
    # one that the plan violates least.
    highest_before = np.maximum.accumulate(np.append(0, above[:-1]))
    lowest_after = np.maximum.accumulate(below[::-1])[::-1]
    change = first + int(np.argmin(highest_before + lowest_after))
    if change == first:
        return GuardSchedule(*[_instant(phases, first)] * 3)
    lowest = first + int(np.argmin(guard[first:change]))
    highest = change + int(np.argmax(guard[change:]))
    return GuardSchedule(*(_instant(phases, k) for k in (first, lowest, highest)))


def shift_arming(phases: tuple[Phase, ...], schedule: GuardSchedule | None, side: int) -> GuardSchedule | None:
    """Return the schedule armed a node earlier or later, but before the lowest guard; None if none exists."""
    if schedule is None:
        return None
    unarmed = _node(phases, schedule.unarmed) + side
    return replace(schedule, unarmed=_instant(phases, unarmed)) if 0 < unarmed < _node(phases, schedule.below) else None


def transfer_schedule(
    schedule: GuardSchedule | None, before: tuple[Phase, ...], after: tuple[Phase, ...]
) -> GuardSchedule | None:
    """Return a schedule with its instants at the nearest nodes of another grid."""
    if schedule is None:
        return None

    def transfer(instant: float) -> float:
        node = _node(before, instant)
        phase = next(phase for phase in before if node in phase.nodes)
        new = after[phase.number]
        return _instant(after, new.first + int(np.argmin(np.abs(new.fractions - phase.fractions[node - phase.first]))))

    instants = {name: transfer(getattr(schedule, name)) for name in ("unarmed", "below", "above")}
    return replace(schedule, **instants)


def _node(phases: tuple[Phase, ...], instant: float) -> int:
    """Return the node nearest to an instant."""
    phase = phases[min(int(instant), len(phases) - 1)]
    return phase.first + round((instant - phase.number) * phase.count)


def _instant(phases: tuple[Phase, ...], node: int) -> float:
    """Return the instant of a node."""
    phase = next(phase for phase in phases if node in phase.nodes)
    return phase.number + (node - phase.first) / phase.count
