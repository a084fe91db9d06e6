"""The blocks of a phase: its intervals and its ends."""

import math
from collections.abc import Sequence

import casadi as ca
import numpy as np

from gaitopt.lazy import Deferred
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.model.contacts.transition import Condition
from gaitopt.ocp.nlp.keys import Group, Key, Kind, Row, Unknown, equation
from gaitopt.ocp.nlp.nlp import Block
from gaitopt.ocp.statement.instant import Instant
from gaitopt.ocp.transcription.foot_clearance import clearance_rows
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder
from gaitopt.ocp.transcription.objective_blocks import InstantMaker, mean_integrand, peak_rows
from gaitopt.ocp.transcription.scheme import Point

KINDS = {
    Condition.NORMAL_FORCE: Kind.NORMAL_FORCE,
    Condition.FORWARD_CONE: Kind.FORWARD_CONE,
    Condition.BACKWARD_CONE: Kind.BACKWARD_CONE,
    Condition.SLIP_ONSET: Kind.SLIP_ONSET,
    Condition.REST: Kind.SLIP_DIRECTION,
    Condition.CUSTOM: Kind.CUSTOM,
}
"""Rows of the conditions on a contact."""


class Equations:
    """Rows and values of a block under construction."""

    def __init__(self) -> None:
        self.table: list[Row] = []
        self._values: list[ca.SX] = []

    def add(self, rows: Sequence[Row], values: ca.SX, inner: int = 0) -> None:
        """Append rows with their values, at an inner point of the interval or at its node."""
        self.table += [row._replace(key=row.key.at(inner)) for row in rows]
        self._values.append(values)

    @property
    def values(self) -> ca.SX:
        """All values, one below the other."""
        return ca.vertcat(*self._values)


def interval_block(frame: NlpBuilder, phase: Phase, stance: PhaseDynamics) -> Block:
    """Return the block of a phase's intervals: dynamics, path constraints at start and inside, powers, objective."""
    return _Intervals(frame, phase, stance).block()


class _Intervals:
    """The block of a phase's intervals under construction.

    Attributes
    ----------
    points : list of Point
        Start, inner points and end of an interval.
    held : list of (int, Point)
        The points at which constraints are held, with their numbers: 0 is the node.
    powers : list of SX
        Parts of the joint powers at the points, or nothing.
    instants : list of Instant or None
        The points as objectives see them; None at a node at which no force is known.
    """

    def __init__(self, frame: NlpBuilder, phase: Phase, stance: PhaseDynamics) -> None:
        self.frame, self.phase, self.stance = frame, phase, stance
        self.local, self.equations, self.penalty = BlockVariables(frame, phase.count), Equations(), ca.SX(0)
        self.left = list(phase.nodes)[:-1]
        self.right = [k + 1 for k in self.left]
        self.p = self.local.parameters()
        start = point_at(frame, phase, stance, self.local, self.left, self.p)
        end = point_at(frame, phase, stance, self.local, self.right, self.p)
        self.step = self.local.add("duration", frame.variables[Unknown.DURATION][:, [phase.number]]) / phase.count
        table = (frame.scheme.inner_table, phase.number)
        unknowns = self.local.add("inner", frame.variables[table]) if table in frame.variables else ca.SX(0, 1)
        self.gap, inner = frame.scheme.advance(stance, start, end, unknowns, self.step, self.p)
        self.points = [start, *inner, end]
        self.held = list(enumerate(self.points))[0 if frame.scheme.nodal else 1 : -1]
        self.powers = self._split_powers() if frame.objective.uses_power else []
        self.instants = self._instants()

    def block(self) -> Block:
        """Return the block."""
        frame, phase, local = self.frame, self.phase, self.local
        self._add_dynamics()
        for inner, point in self.held:
            self._add_point(inner, point)
        places = [phase.place(k) for k in range(phase.count)]
        rows = frame.rows.add((Group.INTERVAL, phase.number), self.equations.table, places)
        values = [self.equations.values]
        plain, relative = (self.step * mean for mean in mean_integrand(frame, self.instants))
        if frame.cleared:
            states = [point.state for point in self.points[:-1]]
            heights, clear = clearance_rows(
                frame, local, self.stance, states, self.p, number=phase.number, places=places
            )
            values.append(heights)
            rows = np.vstack([rows, clear])
        if frame.objective.per_weight_and_travel:
            values.append(relative)
            rows = np.vstack([rows, np.full(phase.count, frame.integral_row())])
        return local.block(f"interval_{phase.number}", ca.vertcat(*values), rows, plain, self.penalty)

    def _split_powers(self) -> list[ca.SX]:
        """Return the unknown parts of the powers at all points, empty at the nodes if they are not known there."""
        frame, count = self.frame, len(self.points) - 2
        inside = self.local.add("inner power", frame.variables[Unknown.INNER_POWER, self.phase.number])
        inner = ca.vertsplit(inside, inside.numel() // count)
        if not frame.scheme.nodal:
            return [ca.SX(0, 1), *inner, ca.SX(0, 1)]
        table = frame.variables[Unknown.POWER]
        return [
            self.local.add("power", table[:, self.left]),
            *inner,
            self.local.add("power after", table[:, self.right]),
        ]

    def _instants(self) -> list[Instant | None]:
        frame, nodes = self.frame, np.arange(self.phase.count)
        maker = InstantMaker(frame, self.local, self.phase, self.stance, self.p, nodes)
        fractions = (0.0, *frame.scheme.inner, 1.0)
        rate = (self.points[-1].torque - self.points[0].torque) / self.step
        found: list[Instant | None] = []
        for i, point in enumerate(self.points):
            at_node = i in (0, len(self.points) - 1)
            power = self.powers[i] if self.powers else None
            known = frame.scheme.nodal or not at_node
            found.append(maker.make(point, power, rate, fractions[i]) if known else None)
        return found

    def _add_dynamics(self) -> None:
        frame = self.frame
        self.equations.add([Row(key, 0.0, 0.0) for key in frame.scheme.defects(self.stance)], self.gap)
        if frame.rate_limited:
            names = [frame.robot.actuators[i] for i in frame.powered]
            rates = (self.points[-1].torque - self.points[0].torque)[list(frame.powered)] / self.step
            self.equations.add([Row(Key(Kind.TORQUE_RATE, name), -math.inf, math.inf) for name in names], rates)

    def _add_point(self, inner: int, point: Point) -> None:
        """Add what holds at a point of the interval."""
        frame, equations = self.frame, self.equations
        equations.add(*_path(frame, self.stance, point, self.p, sliding=bool(inner)), inner)
        if point.pairs:
            rows, values, penalty = frame.relax(self.local, (Unknown.RELAXATION, self.phase.number), point.pairs)
            equations.add(rows, values)
            self.penalty += penalty
        if self.powers:
            equations.add(*_power_split(frame, self.stance, point, self.powers[inner], self.p), inner)
        instant = self.instants[inner]
        if frame.peaks and instant is not None:
            equations.add(*peak_rows(frame, self.local, instant), inner)


def end_block(frame: NlpBuilder, phase: Phase, stance: PhaseDynamics) -> Block:
    """Return the block of a phase's last node: its path constraints, or the onset of the slip that begins there."""
    local, equations, node = BlockVariables(frame, 1), Equations(), phase.nodes[-1]
    p = local.parameters()
    last = point_at(frame, phase, stance, local, [node], p)
    if phase.onset is None:
        equations.add(*_path(frame, stance, last, p, sliding=False))
    else:
        equations.add(_balance(frame, stance), last.residual)
        equations.add(*_onset(stance, last.force, p, phase.onset))
    if frame.peaks:
        power = local.add("power", frame.variables[Unknown.POWER][:, [node]]) if frame.objective.uses_power else None
        maker = InstantMaker(frame, local, phase, stance, p, np.array([phase.count]))
        rate = Deferred(lambda: _rate_before(frame, phase, local, last))
        equations.add(*peak_rows(frame, local, maker.make(last, power, rate)))
    rows = frame.rows.add((Group.END, phase.number), equations.table, [phase.place(phase.count)])
    return local.block(f"end_{phase.number}", equations.values, rows)


def start_block(frame: NlpBuilder, phase: Phase, stance: PhaseDynamics) -> Block:
    """Return the condition under which a foot at rest slides immediately: its slip acceleration has the slip's sign."""
    local = BlockVariables(frame, 1)
    p = local.parameters()
    first = point_at(frame, phase, stance, local, [phase.first], p)
    table = [Row(Key(Kind.BREAKAWAY), 0.0, math.inf)]
    rows = frame.rows.add((Group.START, phase.number), table, [phase.place(0)])
    return local.block(f"start_{phase.number}", phase.mode.sign * first.acceleration[-1], rows)


def last_power_block(frame: NlpBuilder, phase: Phase, stance: PhaseDynamics) -> Block:
    """Return the power split at the last node of the step."""
    local, node = BlockVariables(frame, 1), phase.nodes[-1]
    p = local.parameters()
    last = point_at(frame, phase, stance, local, [node], p)
    table, value = _power_split(frame, stance, last, local.add("split", frame.variables[Unknown.POWER][:, [node]]), p)
    rows = frame.rows.add(Group.LAST_POWER, table, [phase.place(phase.count)])
    return local.block("last_power", value, rows)


def point_at(
    frame: NlpBuilder, phase: Phase, stance: PhaseDynamics, local: BlockVariables, nodes: list[int], p: ca.SX
) -> Point:
    """Return the point at a node, one of `nodes` in each instance of the block."""
    state = local.add("state", frame.state_columns(phase, nodes))
    torque = local.add("torque", frame.torque_columns(phase, nodes))
    columns = frame.node_columns(phase, nodes)
    unknowns = local.add("acceleration", columns) if len(columns) else ca.SX(0, 1)
    return frame.scheme.node(stance, state, torque, unknowns, p)


def _rate_before(frame: NlpBuilder, phase: Phase, local: BlockVariables, last: Point) -> ca.SX:
    """Return the torque rate in the interval before the last node of a phase."""
    before = local.add("torque before", frame.torque_columns(phase, [phase.nodes[-2]]))
    return (last.torque - before) * phase.count / local.shared(Unknown.DURATION)[phase.number]


def _balance(frame: NlpBuilder, stance: PhaseDynamics) -> list[Row]:
    return [Row(key, 0.0, 0.0) for key in frame.scheme.residuals(stance)]


def _path(
    frame: NlpBuilder, stance: PhaseDynamics, point: Point, p: ca.SX, *, sliding: bool
) -> tuple[list[Row], ca.SX]:
    """Return rows and values of what holds at a point: the scheme's equations, the cone, and slip's direction."""
    conditions, values = stance.path(point.force, p, frame.data[len(frame.robot.parameters)])
    table = _balance(frame, stance) + [Row(Key(KINDS[condition]), 0.0, math.inf) for condition in conditions]
    values = ca.vertcat(point.residual, values)
    if sliding and stance.mode.slips:
        table.append(Row(Key(Kind.SLIP_DIRECTION), 0.0, math.inf))
        values = ca.vertcat(values, stance.mode.sign * point.state[-1])
    return table, values


def _onset(stance: PhaseDynamics, force: ca.SX, p: ca.SX, slip: Mode) -> tuple[list[Row], ca.SX]:
    """Return rows and values of the transition from stick to a slip mode."""
    conditions = stance.onset(force, p, slip)
    table = [Row(Key(KINDS[kind]), 0.0, 0.0 if equality else math.inf) for kind, _, equality in conditions]
    return table, ca.vertcat(*(condition.value for condition in conditions))


def _power_split(
    frame: NlpBuilder, stance: PhaseDynamics, point: Point, split: ca.SX, p: ca.SX
) -> tuple[list[Row], ca.SX]:
    """Return P = positive part - negative part for every actuator that may work."""
    names = [frame.robot.actuators[i] for i in frame.powered]
    power = stance.power(point.state, point.torque, p)[list(frame.powered)]
    return [equation(Kind.POWER_SPLIT, name) for name in names], split[: len(names)] - split[len(names) :] - power
