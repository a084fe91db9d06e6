"""Constraints of a phase: the blocks of its intervals and of its ends."""

import math
from collections.abc import Sequence

import casadi as ca
import numpy as np

from gaitopt.lazy import Deferred
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.model.contacts.touchdown import Touchdown
from gaitopt.model.contacts.transition import ContactQuantities, NodeCondition
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.block import Block, stack
from gaitopt.ocp.nlp.keys import Group, Key, Kind, Row, Unknown, equation
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.statement.instant import Instant
from gaitopt.ocp.transcription.bernstein import bernstein_basis, bernstein_transformation, hermite_transformation
from gaitopt.ocp.transcription.condition_rows import KINDS, check_reset, condition_rows
from gaitopt.ocp.transcription.foot_clearance import clearance_rows
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder
from gaitopt.ocp.transcription.objective_blocks import InstantFactory, IntervalInstants, mean_integrand, peak_rows
from gaitopt.ocp.transcription.scheme import Point
from gaitopt.ocp.transcription.sign_changes import mean_parts

NO_CONTACT = ContactQuantities(ca.SX.zeros(2), ca.SX(0), ca.SX(1), ca.SX.ones(2), ca.SX(0))
"""Placeholders, from which it is known whether a transition states conditions."""


class Equations:
    """Rows and values of a block under construction."""

    def __init__(self) -> None:
        self.table: list[Row] = []
        self._values: list[ca.SX] = []
        self._reserved: list[int] = []

    def add(self, rows: Sequence[Row], values: ca.SX, inner: int = 0) -> None:
        """Append rows with their values, at an inner point of the interval or at its node."""
        self.table += [row._replace(key=row.key.at(inner)) for row in rows] if inner else rows
        self._values.append(values)

    def reserve(self, rows: Sequence[Row]) -> None:
        """Append rows whose values belong to another block."""
        self._reserved += range(len(self.table), len(self.table) + len(rows))
        self.table += rows

    def separate_rows(self, rows: Index, others: list[Index]) -> Index:
        """Return the indices of the rows with values; those of reserved rows are appended to a list."""
        if self._reserved:
            others.append(rows[self._reserved])
        return np.delete(rows, self._reserved, axis=0)

    @property
    def values(self) -> ca.SX:
        """All values, one below the other."""
        return stack(self._values)


def phase_blocks(builder: NlpBuilder, phase: Phase, dynamics: PhaseDynamics) -> list[Block]:
    """Return the blocks of a phase.

    The path constraints at the nodes are a block, since they depend on few unknowns.  The block of the intervals
    contains the dynamics, the path constraints at inner points, powers and objective; others are those of both ends.
    """
    if not builder.scheme.nodal:
        return [_Intervals(builder, phase, dynamics, None).block()]
    nodes = _Nodes(builder, phase, dynamics)
    blocks = [_Intervals(builder, phase, dynamics, nodes).block(), *_end_blocks(builder, phase, dynamics, nodes)]
    return [*blocks, nodes.block(), *_start_blocks(builder, phase, dynamics)]


class _Nodes:
    """The block of the path constraints at the nodes of a phase, without the last node if another phase follows.

    Attributes
    ----------
    table : list of Row
        Rows of a node.
    rows : list of (len(table), count) int array
        Indices of the rows, to which the tables of intervals and of the end are appended.
    """

    def __init__(self, builder: NlpBuilder, phase: Phase, dynamics: PhaseDynamics) -> None:
        self._phase, nodes = phase, list(phase.nodes)[: None if phase.following is None else -1]
        self._local, self.rows = BlockVariables(builder, len(nodes)), list[Index]()
        p = self._local.parameters()
        point = point_at(builder, phase, dynamics, self._local, nodes, p)
        self.table, self._values = _path(builder, dynamics, point, p, sliding=False)

    def block(self) -> Block:
        """Return the block."""
        return self._local.block(f"nodes_{self._phase.number}", self._values, np.hstack(self.rows), merged=True)


class _Intervals:
    """The block of the intervals of a phase under construction.

    Attributes
    ----------
    points : list of Point
        Start, inner points and end of an interval.
    constrained : list of (int, Point)
        Numbers and points of the path constraints; 0 is the node.
    powers : list of SX
        Parts of the Bernstein coefficients of the joint powers; empty if the objective does not use them.  The first
        and the last are the parts at the nodes.
    coefficients : list of SX
        Bernstein coefficients of the joint powers as functions of the motion.
    instants : IntervalInstants
        Arguments of objectives.
    """

    def __init__(self, builder: NlpBuilder, phase: Phase, dynamics: PhaseDynamics, nodes: _Nodes | None) -> None:
        self.builder, self.phase, self.dynamics, self.nodes = builder, phase, dynamics, nodes
        self.local, self.equations, self.penalty = BlockVariables(builder, phase.count), Equations(), ca.SX(0)
        self.left = list(phase.nodes)[:-1]
        self.right = [k + 1 for k in self.left]
        self.p = self.local.parameters()
        start = point_at(builder, phase, dynamics, self.local, self.left, self.p)
        end = point_at(builder, phase, dynamics, self.local, self.right, self.p)
        duration = self.local.add("duration", builder.variables[Unknown.DURATION][:, [phase.number]])
        self.length = self.local.add_length(phase, duration, range(phase.count))
        table = (builder.scheme.inner_table, phase.number)
        unknowns = self.local.add("inner", builder.variables[table]) if table in builder.variables else ca.SX(0, 1)
        self.gap, inner = builder.scheme.advance(dynamics, start, end, unknowns, self.length, self.p)
        for point in inner:
            if point.definition is not None:
                self.local.define(point.state, point.definition)
        self.points = [start, *inner, end]
        self.constrained = list(enumerate(self.points))[0 if builder.scheme.nodal else 1 : -1]
        self.powers = self._split_powers() if builder.objective.uses_power else []
        self.coefficients = self._power_coefficients() if self.powers else []
        self.instants = self._instants()

    def block(self) -> Block:
        """Return the block."""
        builder, phase, local = self.builder, self.phase, self.local
        self._add_dynamics()
        for inner, point in self.constrained:
            self._add_point(inner, point)
        for inner in range(0 if builder.scheme.nodal else 1, len(self.powers) - 1):
            self.equations.add(*_power_split(builder, self.coefficients[inner], self.powers[inner]), inner)
        places = [phase.place(k) for k in range(phase.count)]
        rows = builder.rows.add((Group.INTERVAL, phase.number), self.equations.table, places)
        if self.nodes is not None:
            rows = self.equations.separate_rows(rows, self.nodes.rows)
        values = [self.equations.values]
        plain, relative = mean_integrand(builder, self.instants)
        if builder.cleared or builder.terrain is not None:
            states = [point.state for point in self.points[:-1]]
            heights, clear = clearance_rows(
                builder, local, self.dynamics, states, self.p, number=phase.number, places=places
            )
            values.append(heights)
            rows = np.vstack([rows, clear])
        if builder.objective.per_weight_and_travel:
            values.append(self.length * relative)
            rows = np.vstack([rows, np.full(phase.count, builder.integral_row())])
        name, cost, merged = f"interval_{phase.number}", self.length * plain, builder.scheme.merged
        return local.block(name, stack(values), rows, cost, self.penalty, merged=merged)

    def _split_powers(self) -> list[ca.SX]:
        """Return the unknown parts of the powers, empty at the nodes if the scheme is not nodal."""
        builder, count = self.builder, self.builder.scheme.power_fractions.size - 2
        inside = self.local.add("inner power", builder.variables[Unknown.INNER_POWER, self.phase.number])
        inner = ca.vertsplit(inside, inside.numel() // count)
        if not builder.scheme.nodal:
            return [ca.SX(0, 1), *inner, ca.SX(0, 1)]
        table = builder.variables[Unknown.POWER]
        return [
            self.local.add("power", table[:, self.left]),
            *inner,
            self.local.add("power after", table[:, self.right]),
        ]

    def _power_coefficients(self) -> list[ca.SX]:
        dynamics, scheme, powered = self.dynamics, self.builder.scheme, list(self.builder.powered)
        powers = [dynamics.power(point.state, point.torque, self.p) for point in self.points]
        if len(powered) < self.builder.robot.n_u:
            powers = [power[powered] for power in powers]
        if not scheme.nodal:
            return powers
        if scheme.power_fractions.size != len(powers):
            powers = self._interpolate_powers(scheme.power_fractions)
        return ca.horzsplit(ca.horzcat(*powers) @ ca.DM(bernstein_transformation(tuple(scheme.power_fractions))).T)

    def _interpolate_powers(self, at: Array) -> list[ca.SX]:
        """Return the joint powers at fractions of the interval, from a Hermite interpolant of the joint rates."""
        start, *_, end = self.points
        rates = [self.dynamics.joint_rates(point.state, self.p) for point in self.points]
        slopes = [
            self.length * self.dynamics.joint_accelerations(point.state, point.acceleration, self.p)
            for point in (start, end)
        ]
        matrix = ca.DM(hermite_transformation(tuple(self.builder.scheme.fractions), tuple(at)))
        columns = ca.horzsplit(ca.horzcat(*rates, *slopes) @ matrix.T)
        powers = [
            (start.torque + float(c) * (end.torque - start.torque)) * rate for c, rate in zip(at, columns, strict=True)
        ]
        return [power[list(self.builder.powered)] for power in powers]

    def _instants(self) -> IntervalInstants:
        builder, nodes, fractions = self.builder, np.arange(self.phase.count), self.builder.scheme.fractions
        factory = InstantFactory(builder, self.local, self.phase, self.dynamics, self.p, nodes)
        rate = Deferred(lambda: (self.points[-1].torque - self.points[0].torque) / self.length)

        def make(parts: Sequence[ca.SX | None]) -> list[Instant | None]:
            """Return the instants of the points with these parts of the powers, None where the force is unknown."""
            inner = range(len(self.points)) if builder.scheme.nodal else range(1, len(self.points) - 1)
            return [
                factory.make(point, parts[i], rate, float(fractions[i])) if i in inner else None
                for i, point in enumerate(self.points)
            ]

        idle = make([None] * len(self.points))
        if not self.powers:
            return IntervalInstants(points=idle, idle=idle, mean=None)
        mean = None
        if builder.sign_changes is not None:
            data = self.local.add_data("sign changes", builder.sign_changes.tables[self.phase.number])
            mean = factory.make(self.points[0], mean_parts(self.powers, self.coefficients, data), rate)
        return IntervalInstants(points=Deferred(lambda: make(self._parts_at_points())), idle=idle, mean=mean)

    def _parts_at_points(self) -> list[ca.SX]:
        """Return the parts of the joint powers at the points, polynomials that are nowhere negative."""
        if not self.builder.scheme.nodal:
            return self.powers
        basis = [bernstein_basis(at, len(self.powers) - 1) for at in self.builder.scheme.fractions]
        return ca.horzsplit(ca.horzcat(*self.powers) @ ca.DM(basis).T)

    def _add_dynamics(self) -> None:
        builder = self.builder
        self.equations.add([Row(key, 0.0, 0.0) for key in builder.scheme.defects(self.dynamics)], self.gap)
        if builder.rate_limited:
            names = [builder.robot.actuators[i] for i in builder.powered]
            rates = (self.points[-1].torque - self.points[0].torque)[list(builder.powered)] / self.length
            self.equations.add([Row(Key(Kind.TORQUE_RATE, name), -math.inf, math.inf) for name in names], rates)

    def _add_point(self, inner: int, point: Point) -> None:
        """Add the constraints at a point of the interval."""
        builder, equations = self.builder, self.equations
        if self.nodes is not None and not inner:
            equations.reserve(self.nodes.table)
        else:
            equations.add(*_path(builder, self.dynamics, point, self.p, sliding=True), inner)
        if point.pairs:
            rows, values, penalty = builder.relax(self.local, (Unknown.RELAXATION, self.phase.number), point.pairs)
            equations.add(rows, values)
            self.penalty += penalty
        if builder.peaks and (instant := self.instants.points[inner]) is not None:
            equations.add(*peak_rows(builder, self.local, instant), inner)


def _end_blocks(builder: NlpBuilder, phase: Phase, dynamics: PhaseDynamics, nodes: _Nodes) -> list[Block]:
    """Return the block of the last node of a phase: the transition to the next phase, or peaks if there are any."""
    local, equations = BlockVariables(builder, 1), Equations()
    if phase.following is None:
        equations.reserve(nodes.table)
    if phase.following is not None or builder.peaks:
        _add_end(builder, phase, dynamics, local, equations)
    rows = builder.rows.add((Group.END, phase.number), equations.table, [phase.place(phase.count)])
    rows = equations.separate_rows(rows, nodes.rows)
    return [local.block(f"end_{phase.number}", equations.values, rows, merged=True)] if rows.size else []


def _add_end(
    builder: NlpBuilder, phase: Phase, dynamics: PhaseDynamics, local: BlockVariables, equations: Equations
) -> None:
    """Add the conditions of the transition to the next phase, if there is one, and of peaks."""
    p, node = local.parameters(), phase.nodes[-1]
    last = point_at(builder, phase, dynamics, local, [node], p)
    if phase.following is not None:
        equations.add(_balance(builder, dynamics), last.residual)
        equations.add(*_end_rows(builder, phase, dynamics, last, p))
        equations.add(*_sliding_inertia(builder, dynamics, last, p))
    if builder.peaks:
        power = (
            local.add("power", builder.variables[Unknown.POWER][:, [node]]) if builder.objective.uses_power else None
        )
        factory = InstantFactory(builder, local, phase, dynamics, p, np.array([phase.count]))
        rate = Deferred(lambda: torque_rate_before(builder, phase, local, last))
        equations.add(*peak_rows(builder, local, factory.make(last, power, rate)))


def _start_blocks(builder: NlpBuilder, phase: Phase, dynamics: PhaseDynamics) -> list[Block]:
    """Return the block of the first node of a slip if the transition or impact before it states conditions there."""
    if not (phase.mode.slips and _departure(builder, phase, NO_CONTACT)):
        return []
    local = BlockVariables(builder, 1)
    p = local.parameters()
    first = point_at(builder, phase, dynamics, local, [phase.first], p)
    contact = dynamics.contact(first.state, first.acceleration, first.force, p)
    contact = contact._replace(excess=dynamics.excess_at_rest(first.state, first.torque, p, _cone_margin(builder)))
    table, values = condition_rows(_departure(builder, phase, contact))
    rows = builder.rows.add((Group.START, phase.number), table, [phase.place(0)])
    return [local.block(f"start_{phase.number}", values, rows, merged=True)]


def _departure(builder: NlpBuilder, phase: Phase, contact: ContactQuantities) -> list[NodeCondition]:
    """Return the conditions at the first node of a slip."""
    if phase.number == 0:
        return Touchdown(builder.robot).departure(phase.previous, phase.mode, contact)
    return builder.robot.contact_model.between(phase.previous, phase.mode).departure(phase.mode, contact)


def last_power_block(builder: NlpBuilder, phase: Phase, dynamics: PhaseDynamics) -> Block:
    """Return the power split at the last node of the step."""
    local, node = BlockVariables(builder, 1), phase.nodes[-1]
    p = local.parameters()
    last = point_at(builder, phase, dynamics, local, [node], p)
    power = dynamics.power(last.state, last.torque, p)[list(builder.powered)]
    table, value = _power_split(builder, power, local.add("split", builder.variables[Unknown.POWER][:, [node]]))
    rows = builder.rows.add(Group.LAST_POWER, table, [phase.place(phase.count)])
    return local.block("last_power", value, rows, merged=True)


def point_at(
    builder: NlpBuilder, phase: Phase, dynamics: PhaseDynamics, local: BlockVariables, nodes: list[int], p: ca.SX
) -> Point:
    """Return the point at a node, one of `nodes` in each instance of the block."""
    state = local.add("state", builder.state_columns(phase, nodes))
    torque = local.add("torque", builder.torque_columns(phase, nodes))
    columns = builder.node_columns(phase, nodes)
    unknowns = local.add("acceleration", columns) if len(columns) else ca.SX(0, 1)
    return builder.scheme.node(dynamics, state, torque, unknowns, p)


def torque_rate_before(builder: NlpBuilder, phase: Phase, local: BlockVariables, last: Point) -> ca.SX:
    """Return the torque rate in the interval before the last node of a phase."""
    before = local.add("torque before", builder.torque_columns(phase, [phase.nodes[-2]]))
    duration = local.add_shared(Unknown.DURATION)[phase.number]
    return (last.torque - before) / local.add_length(phase, duration, [phase.count - 1])


def _balance(builder: NlpBuilder, dynamics: PhaseDynamics) -> list[Row]:
    return [Row(key, 0.0, 0.0) for key in builder.scheme.residuals(dynamics)]


def _path(
    builder: NlpBuilder, dynamics: PhaseDynamics, point: Point, p: ca.SX, *, sliding: bool
) -> tuple[list[Row], ca.SX]:
    """Return rows and values of the constraints at a point: equations of the scheme, cone, slip."""
    conditions, values = dynamics.path(point.force, p, _cone_margin(builder))
    table = _balance(builder, dynamics) + [Row(Key(KINDS[condition]), 0.0, math.inf) for condition in conditions]
    well_posed, inertia = _sliding_inertia(builder, dynamics, point, p)
    parts = [point.residual, values, inertia]
    table += well_posed
    if sliding and dynamics.mode.slips:
        table.append(Row(Key(Kind.SLIP_DIRECTION), 0.0, math.inf))
        parts.append(dynamics.slip_speed(point.state))
    return table, stack(parts)


def _end_rows(
    builder: NlpBuilder, phase: Phase, dynamics: PhaseDynamics, last: Point, p: ca.SX
) -> tuple[list[Row], ca.SX]:
    """Return rows and values of the transition at the end of a phase; a foot speed of zero is a bound, not a row."""
    following = phase.following
    if following is None:
        raise ValueError("the last phase ends in a touchdown")
    transition = builder.robot.contact_model.between(phase.mode, following)
    check_reset(transition, phase.mode, following, builder.robot.state_entries)
    contact = dynamics.contact(last.state, last.acceleration, last.force, p)
    conditions = transition.conditions(phase.mode, contact)
    rest = [one for one in conditions if dynamics.slides and one.equality and ca.is_equal(one.value, contact.speed)]
    if rest:
        builder.resting.add(int(builder.slide_columns(phase, [phase.nodes[-1]])[1, 0]))
    return condition_rows([one for one in conditions if one not in rest], transition.event.label)


def _sliding_inertia(builder: NlpBuilder, dynamics: PhaseDynamics, point: Point, p: ca.SX) -> tuple[list[Row], ca.SX]:
    """Return row and value of the condition that slip is well posed; none if it is not constrained."""
    if not (dynamics.mode.slips and builder.inertia_limited):
        return [], ca.SX(0, 1)
    return [Row(Key(Kind.SLIDING_INERTIA), 0.0, math.inf)], dynamics.sliding_inertia(point.state, p)


def _cone_margin(builder: NlpBuilder) -> ca.SX:
    return builder.data[len(builder.robot.parameters)]


def _power_split(builder: NlpBuilder, power: ca.SX, split: ca.SX) -> tuple[list[Row], ca.SX]:
    """Return rows and values of power = positive part - negative part for every actuator that is not idle."""
    names = [builder.robot.actuators[i] for i in builder.powered]
    return [equation(Kind.POWER_SPLIT, name) for name in names], split[: len(names)] - split[len(names) :] - power
