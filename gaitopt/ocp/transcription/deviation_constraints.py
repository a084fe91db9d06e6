"""Equations of the derivative of the return map: linearised dynamics, saltation at events, and the impact.

The deviations are propagated by the derivative of the collocation equations at a constant time.  At an event whose
instant changes by dt,

    dy+ = R (dy- + f- dt) - f+ dt,    dg + g' dt = 0,

with the flows f- and f+, the reset R and the guard g with its rate g' along the motion.
"""

import functools
from collections.abc import Sequence

import casadi as ca

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics, full_vector
from gaitopt.model.coordinate_entries import ANGLES
from gaitopt.model.robot import Robot
from gaitopt.model.section_coordinate import guard_after_swap
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.keys import TOUCHDOWN, Group, Kind, Place, TableKey, Unknown, equation
from gaitopt.ocp.transcription.collocation import integrals, lobatto_points
from gaitopt.ocp.transcription.deviations import (
    SectionNames,
    balance_slope,
    check_scheme,
    guard_slope,
    narrow_deviation,
    state_rate,
    widen_deviation,
)
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder
from gaitopt.ocp.transcription.phase_constraints import point_at, torque_rate_before
from gaitopt.ocp.transcription.scheme import Point

DEVIATION_GROUPS = (
    Group.DEVIATION_START,
    Group.DEVIATION,
    Group.DEVIATION_END,
    Group.DEVIATION_EVENT,
    Group.DEVIATION_STEP,
)
"""Tables of the rows that determine the deviations."""


def deviation_blocks(
    builder: NlpBuilder,
    section: SectionNames,
    sequence: ContactSequence,
    phases: Sequence[Phase],
    dynamics_of_phases: Sequence[PhaseDynamics],
) -> list[Block]:
    """Return the blocks that determine the deviations, from the section to the state after the next touchdown."""
    blocks = [_section_block(builder, section, phases[0], dynamics_of_phases[0])]
    for phase, dynamics in zip(phases, dynamics_of_phases, strict=True):
        blocks.append(_interval_block(builder, section, phase, dynamics))
        blocks.append(_end_block(builder, section, phase, dynamics))
    for i in range(1, len(phases)):
        blocks.append(_event_block(builder, section, phases[i - 1 : i + 1], dynamics_of_phases[i - 1 : i + 1]))
    blocks.append(_touchdown_block(builder, section, sequence, phases, dynamics_of_phases[-1]))
    return blocks


@dataclass(frozen=True, eq=False)
class _Feedback:
    """Deviations of the torques in a block."""

    builder: NlpBuilder
    local: BlockVariables

    def torque(self, dynamics: PhaseDynamics, change: ca.SX) -> ca.SX:
        """Return the deviation of the torques for a change of the reduced state, shape (n_u, 1)."""
        if Unknown.GAIN not in self.builder.variables:
            return ca.SX(self.builder.robot.n_u, 1)
        n, n_u = dynamics.n_angles, self.builder.robot.n_u
        gains = ca.reshape(self.local.add_shared(Unknown.GAIN), 2 * n + 1, n_u).T
        speed = change[dynamics.speed_entry] if dynamics.slides else ca.SX(1, 1)
        return -gains @ ca.vertcat(change[:n], speed, change[n : 2 * n])


def _add_directions(
    local: BlockVariables, builder: NlpBuilder, table: TableKey, columns: Sequence[int], n: int
) -> ca.SX:
    """Return the rows of a table as a matrix with a column for each direction, shape (rows / n, n)."""
    symbol = local.add("deviation", builder.variables[table][:, list(columns)])
    return ca.reshape(symbol, symbol.numel() // n, n)


def _finish(
    builder: NlpBuilder, local: BlockVariables, group: Group, number: int, values: list[ca.SX], places: list[Place]
) -> Block:
    """Return the block of some equations."""
    value = ca.vertcat(*values)
    table = [equation(Kind.DEVIATION_EQUATION, str(i + 1)) for i in range(value.numel())]
    rows = builder.rows.add((group, number), table, places)
    return local.block(f"{group.value} {number}".replace(" ", "_"), value, rows)


def _section_block(builder: NlpBuilder, section: SectionNames, phase: Phase, dynamics: PhaseDynamics) -> Block:
    """Return the block of the first deviations: unit changes of the coordinates of the section."""
    local, count = BlockVariables(builder, 1), len(section.names)
    p = local.parameters()
    angles = local.add("angles", builder.variables[Unknown.ANGLES][:, [0]])
    start = _add_directions(local, builder, (Unknown.DEVIATION, 0), [0], count)
    n, values = len(section.angles), []
    condition = ca.jacobian(guard_after_swap(builder.robot, angles, p), angles)
    for j, place in enumerate(section.kept):
        change, unit = start[:, j], ca.SX(start.size1(), 1)
        unit[place] = 1
        kept = [i for i in range(start.size1()) if i != section.dependent]
        values += [change[kept] - unit[kept], condition @ change[:n]]
    return _finish(builder, local, Group.DEVIATION_START, 0, values, [phase.place(0)])


def _interval_block(builder: NlpBuilder, section: SectionNames, phase: Phase, dynamics: PhaseDynamics) -> Block:
    """Return the block of the deviations in the intervals of a phase."""
    local, count, number = BlockVariables(builder, phase.count), len(section.names), phase.number
    p, left = local.parameters(), list(phase.nodes)[:-1]
    start = point_at(builder, phase, dynamics, local, left, p)
    end = point_at(builder, phase, dynamics, local, [k + 1 for k in left], p)
    duration = local.add("duration", builder.variables[Unknown.DURATION][:, [number]])
    length = local.add_length(phase, duration, range(phase.count))
    unknowns = local.add("inner", builder.variables[Unknown.INNER_ACCELERATION, number])
    _, inner = builder.scheme.advance(dynamics, start, end, unknowns, length, p)
    for point in inner:
        if point.definition is not None:
            local.define(point.state, point.definition)
    nodes = range(phase.count)
    before, after = ((Unknown.DEVIATION, range(k, k + phase.count)) for k in (0, 1))
    states = [_add_directions(local, builder, (name, number), at, count) for name, at in (before, after)]
    rates = [
        _add_directions(local, builder, (Unknown.DEVIATION_RATE, number), at, count)
        for at in (nodes, range(1, phase.count + 1))
    ]
    between = local.add("inner rates", builder.variables[Unknown.INNER_DEVIATION_RATE, number])
    parts = ca.vertsplit(between, dynamics.n_a * count)
    middle = [ca.reshape(part, dynamics.n_a, count) for part in parts]
    feedback, values = _Feedback(builder, local), []
    for j in range(count):
        accelerations = [rates[0][:, j], *(part[:, j] for part in middle), rates[1][:, j]]
        ends = states[0][:, j], states[1][:, j]
        values += _propagate(builder, dynamics, feedback, [start, *inner], ends, accelerations, length, p)
    places = [phase.place(k) for k in nodes]
    return _finish(builder, local, Group.DEVIATION, number, values, places)


def _propagate(
    builder: NlpBuilder,
    dynamics: PhaseDynamics,
    feedback: _Feedback,
    points: list[Point],
    ends: tuple[ca.SX, ca.SX],
    accelerations: list[ca.SX],
    length: ca.SX,
    p: ca.SX,
) -> list[ca.SX]:
    """Return the linearised equations of an interval for one direction."""
    scheme, slope = check_scheme(builder.scheme), balance_slope(dynamics)
    once, twice = integrals(scheme.points)
    fractions, stacked = lobatto_points(scheme.points), ca.horzcat(*accelerations)
    positions, speeds = dynamics.parts(widen_deviation(dynamics, ends[0]))

    def at(i: int) -> ca.SX:
        moved = positions + length * (float(fractions[i]) * speeds + length * (stacked @ ca.DM(twice[i])))
        return dynamics.join(moved, speeds + length * (stacked @ ca.DM(once[i])))

    values = []
    for i, point in enumerate(points):
        change = at(i)
        torque = feedback.torque(dynamics, change)
        values.append(slope(point.state, point.acceleration, point.torque, p, change, accelerations[i], torque))
    values.append(ends[1] - narrow_deviation(dynamics, at(scheme.points - 1)))
    return values


def _end_block(builder: NlpBuilder, section: SectionNames, phase: Phase, dynamics: PhaseDynamics) -> Block:
    """Return the block of the deviations of the accelerations at the last node of a phase."""
    local, count = BlockVariables(builder, 1), len(section.names)
    p = local.parameters()
    last = point_at(builder, phase, dynamics, local, [phase.nodes[-1]], p)
    state = _add_directions(local, builder, (Unknown.DEVIATION, phase.number), [phase.count], count)
    rate = _add_directions(local, builder, (Unknown.DEVIATION_RATE, phase.number), [phase.count], count)
    feedback, slope, values = _Feedback(builder, local), balance_slope(dynamics), []
    for j in range(count):
        change = widen_deviation(dynamics, state[:, j])
        torque = feedback.torque(dynamics, change)
        values.append(slope(last.state, last.acceleration, last.torque, p, change, rate[:, j], torque))
    return _finish(builder, local, Group.DEVIATION_END, phase.number, values, [phase.place(phase.count)])


def _event_block(
    builder: NlpBuilder,
    section: SectionNames,
    phases: Sequence[Phase],
    dynamics_of_phases: Sequence[PhaseDynamics],
) -> Block:
    """Return the block of the transition between two phases."""
    (phase, following), (dynamics, after) = phases, dynamics_of_phases
    local, count, number = BlockVariables(builder, 1), len(section.names), phase.number
    p = local.parameters()
    last = point_at(builder, phase, dynamics, local, [phase.nodes[-1]], p)
    first = local.add("acceleration after", builder.node_columns(following, [following.first]))
    jerk = local.add("jerk", builder.variables[Unknown.JERK, number])
    point = last.state, last.acceleration, last.torque, p
    flow = state_rate(dynamics, last.state, last.acceleration)
    along = flow, jerk, torque_rate_before(builder, phase, local, last)
    guard, values = guard_slope(dynamics, following.mode), [balance_slope(dynamics)(*point, *along)]
    rate_of_guard = guard(*point, *along)
    before = _add_directions(local, builder, (Unknown.DEVIATION, number), [phase.count], count)
    rates = _add_directions(local, builder, (Unknown.DEVIATION_RATE, number), [phase.count], count)
    start = _add_directions(local, builder, (Unknown.DEVIATION, following.number), [0], count)
    shifts, n = local.add("shift", builder.variables[Unknown.EVENT_SHIFT, number]), dynamics.n_angles
    feedback, jump = _Feedback(builder, local), last.acceleration[:n] - first[:n]
    for j in range(count):
        shift, change = shifts[j], widen_deviation(dynamics, before[:, j])
        change_of_guard = guard(*point, change, rates[:, j], feedback.torque(dynamics, change))
        values += [
            change_of_guard + rate_of_guard * shift,
            start[:n, j] - before[:n, j],
            start[n : 2 * n, j] - before[n : 2 * n, j] - jump * shift,
        ]
        if after.slides:
            values.append(start[2 * n, j] + first[n] * shift)
    return _finish(builder, local, Group.DEVIATION_EVENT, number, values, [phase.place(phase.count)])


def _touchdown_block(
    builder: NlpBuilder,
    section: SectionNames,
    sequence: ContactSequence,
    phases: Sequence[Phase],
    dynamics: PhaseDynamics,
) -> Block:
    """Return the block of the deviations after the touchdown: guard, exchange of the legs, momentum, friction."""
    local, count, phase, robot = BlockVariables(builder, 1), len(section.names), phases[-1], builder.robot
    variables, p = builder.variables, local.parameters()
    last = point_at(builder, phase, dynamics, local, [phase.nodes[-1]], p)
    rates_after = local.add("rates after", variables[Unknown.RATES][:, [0]])
    speed = builder.slide_columns(phases[0], [phases[0].first])[1:] if section.sliding else None
    speed_after = ca.SX(1, 1) if speed is None else local.add("speed after", speed)
    impulse = local.add("impulse", variables[Unknown.IMPULSE])
    before = _add_directions(local, builder, (Unknown.DEVIATION, phase.number), [phase.count], count)
    shifts = local.add("shift", variables[Unknown.EVENT_SHIFT, phase.number])
    after = _add_directions(local, builder, Unknown.RETURN, [0], count)
    impulses = _add_directions(local, builder, Unknown.DEVIATION_OF_IMPULSE, [0], count)
    flow = state_rate(dynamics, last.state, last.acceleration)
    q, v = dynamics.full(last.state)
    place, n, values = full_vector(ca.SX(1, 1), q[ANGLES]), dynamics.n_angles, []
    point = place, v, full_vector(speed_after, rates_after), impulse
    slope = _impact_slope(robot, sequence)
    for j in range(count):
        q_change, v_change = dynamics.full(widen_deviation(dynamics, before[:, j]) + flow * shifts[j])
        q_change = full_vector(ca.SX(1, 1), q_change[ANGLES])
        foot = after[2 * n, j] if section.sliding else ca.SX(1, 1)
        changes = q_change, v_change, full_vector(foot, after[n : 2 * n, j]), impulses[:, j]
        values.append(
            slope(*map(ca.densify, point), p, *map(ca.densify, changes))
            - ca.vertcat(after[:n, j], ca.SX(slope.size1_out(0) - n, 1))
        )
    return _finish(builder, local, Group.DEVIATION_STEP, 0, values, [TOUCHDOWN])


@functools.lru_cache(maxsize=32)
def _impact_slope(robot: Robot, sequence: ContactSequence) -> ca.Function:
    """Return the directional derivative of the touchdown: exchanged angles, guard, momentum, edge of the cone.

    The inputs are q and v before the touchdown, v of the next step, the impulse and p, then the changes of the first
    four.
    """
    sizes = {"q": robot.n_q, "v": robot.n_q, "v_next": robot.n_q, "impulse": 2}
    point, changes = ([ca.SX.sym(name, size) for name, size in sizes.items()] for _ in range(2))
    p = ca.SX.sym("p", len(robot.parameters))
    q, v, v_next, impulse = point
    momentum, _ = robot.impact(q, v, robot.unswap(q, v_next, p), impulse, p)
    values = [robot.swap(q, v, p)[0][ANGLES], robot.touchdown(q, v, p)[0], momentum]
    if sequence.impact.slips:
        friction = p[robot.index("friction")]
        values.append(robot.contact_model.impact.excess(impulse, friction, sequence.impact, ca.SX(0)))
    slope = ca.jtimes(ca.vertcat(*values), ca.vertcat(*point), ca.vertcat(*changes))
    return ca.Function("impact_slope", [*point, p, *changes], [ca.densify(slope)])
