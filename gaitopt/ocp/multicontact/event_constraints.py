"""Constraints of the events: what changes at the end of each phase, the impacts, and the periodicity of the gait.

Rows that follow from others are left out, so that the gradients of the active constraints are independent: at the first
node of a phase nothing is imposed on positions and velocities, and a contact that leaves the ground while it sticks has
both force components fixed to zero instead of cones.
"""

import math

import casadi as ca
import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.phase_system import contact_forces, group_sticking
from gaitopt.ocp.multicontact.impulse_stages import list_instants, stage_conditions
from gaitopt.ocp.multicontact.phase_grid import GridPhase, opening_bodies
from gaitopt.ocp.multicontact.planar_builder import (
    PlanarBuilder,
    event_place,
    joint_keys,
    solution_keys,
)
from gaitopt.ocp.multicontact.planar_objective import planar_power_split
from gaitopt.ocp.multicontact.planar_point import (
    Condition,
    PlanarPoint,
    cone_conditions,
    dynamics_rows,
    first_of_bodies,
    gap_conditions,
    height_conditions,
    motion_residual,
    point_outputs,
    slip_conditions,
)
from gaitopt.ocp.multicontact.planar_step_cost import peak_conditions
from gaitopt.ocp.nlp.keys import STEP, Group, Key, Kind, Place, Row, Unknown, equation
from gaitopt.ocp.nlp.nlp import Block
from gaitopt.ocp.transcription.nlp_builder import BlockVariables


def planar_end_block(builder: PlanarBuilder, phase: GridPhase) -> Block:
    """Return the block of the last node of a phase: its path constraints, or the conditions of its event."""
    local = BlockVariables(builder, 1)
    p, last = builder.parameters(local), [phase.count]
    point = PlanarPoint(
        local.add("q", builder.coordinates(phase)[:, last]),
        local.add("v", builder.velocities(phase)[:, last]),
        local.add("u", builder.torques(phase)[:, last]),
        local.add("z", builder.variables[Unknown.ACCELERATION, phase.number][:, last]),
        p,
    )
    rows = dynamics_rows(builder, phase, solution_keys(builder.structure, phase))
    conditions: list[Condition] = list(zip(rows, ca.vertsplit(motion_residual(builder, phase, point)), strict=True))
    changes = [] if phase.outcome is not None else _changes(builder, phase, point)
    ended = frozenset(i for i, _ in changes)
    conditions += [condition for _, several in changes for condition in several]
    conditions += cone_conditions(builder, phase, point, ended | opening_bodies(phase))
    conditions += slip_conditions(builder, phase, point, ended)
    conditions += gap_conditions(builder, phase, point, frozenset(phase.closing()))
    conditions += height_conditions(builder, point)
    conditions += _closing_conditions(builder, phase, point)
    if builder.structure.peaks:
        rate = _last_rate(builder, local, phase, point)
        conditions += peak_conditions(builder, local, phase, point, rate, opening=opening_bodies(phase))
    if (Unknown.POWER, phase.number) in builder.variables:
        parts = local.add("power", builder.variables[Unknown.POWER, phase.number][:, last])
        power = point_outputs(phase, point)[0][list(builder.structure.powered)]
        conditions += planar_power_split(builder, power, parts)
    return _finish(builder, local, (Group.END, phase.number), phase.place(phase.count), conditions)


def _last_rate(builder: PlanarBuilder, local: BlockVariables, phase: GridPhase, point: PlanarPoint) -> ca.SX:
    """Return the torque rates at the end of a phase."""
    before = local.add("u before", builder.torques(phase)[:, [phase.count - 1]])
    duration = local.add("duration", builder.variables[Unknown.DURATION][:, [phase.number]])
    return (point.u - before) * phase.count / duration


def _changes(builder: PlanarBuilder, phase: GridPhase, point: PlanarPoint) -> list[tuple[int, list[Condition]]]:
    """Return the conditions of slip onset, rest and reversal, by the first contact of each body."""
    robot, changes = builder.robot, []
    forces = point_outputs(phase, point)[1]
    speeds = robot.rows(point.q, point.v, point.p)[1] @ point.v
    static = point.p[robot.index("friction")] * point.p[robot.index("static_friction_ratio")]
    for i in first_of_bodies(builder, phase.state):
        old, new, name = phase.state[i], phase.after[i], robot.contact_names[i]
        if old is Mode.STICK and new.slips:
            members = next(members for members in phase.system.sticking if members[0] == i)
            edge = static * ca.sum2(forces[1, list(members)]) + new.sign * forces[0, i]
            changes.append((i, [(equation(Kind.ONSET, name), edge)]))
        elif old.slips and new is not Mode.FREE and new is not old:
            changes.append((i, [(equation(Kind.REST, name), speeds[i])]))
    return changes


def _closing_conditions(builder: PlanarBuilder, phase: GridPhase, point: PlanarPoint) -> list[Condition]:
    """Return the conditions of the contacts that close: on the ground, and approaching unless the touchdown is soft."""
    robot, conditions = builder.robot, []
    gap, armed = robot.gaps(point.q, point.p)[0], robot.arming(point.q, point.v, point.p)
    normal, tangent = robot.rows(point.q, point.v, point.p)[:2]
    sticking: set[str] = set()
    for i in phase.closing():
        contact, rate = robot.contacts[i], (normal @ point.v)[i]
        conditions.append((equation(Kind.CLOSING, contact.name), gap[i]))
        if not armed[i].is_constant():
            conditions.append((Row(Key(Kind.ARMED, contact.name), 0.0, math.inf), armed[i]))
        if phase.outcome is not None:
            conditions.append((Row(Key(Kind.APPROACH, contact.name), 0.0, math.inf), -rate))
            continue
        conditions.append((equation(Kind.APPROACH, contact.name), rate))
        if phase.after[i] is Mode.STICK and contact.body not in sticking:
            conditions.append((equation(Kind.REST, contact.name), (tangent @ point.v)[i]))
            sticking.add(contact.body)
    return conditions


def planar_event_block(builder: PlanarBuilder, phase: GridPhase) -> Block | None:
    """Return the block of the impact at the end of a phase, and of the periodicity at the end of the last one."""
    if phase.outcome is None and not phase.is_last:
        return None
    local, robot, n = BlockVariables(builder, 1), builder.robot, builder.robot.n_q
    p = builder.parameters(local)
    q = local.add("q", builder.coordinates(phase)[:, [phase.count]])
    v = local.add("v", builder.velocities(phase)[:, [phase.count]])
    after = builder.rates_after(local, phase)
    mirror = np.eye(n) if robot.mirror is None else robot.mirror.coordinates
    conditions: list[Condition] = []
    if phase.is_last:
        first = local.add("q first", builder.variables[Unknown.COORDINATES][:, [0]])
        difference = first - ca.DM(mirror) @ q
        conditions += [
            (equation(Kind.PERIODICITY, name), difference[i])
            for i, name in enumerate(robot.coordinates)
            if name != robot.travel
        ]
    if phase.outcome is None:
        rates = [f"{name} rate" for name in robot.coordinates]
        conditions += [(equation(Kind.PERIODICITY, name), (after - v)[i]) for i, name in enumerate(rates)]
        conditions += _torque_periodicity(builder, local, phase)
    else:
        impulse = local.add("impulse", builder.variables[Unknown.IMPULSE, phase.number])
        instants = list_instants(builder, local, phase, (q, v, after, p))
        conditions += _impact_conditions(builder, phase, (q, instants.impact_before, instants.impact_after, impulse, p))
        conditions += stage_conditions(builder, phase, instants)
    return _finish(builder, local, (Group.EVENT, phase.number), event_place(phase), conditions)


def _torque_periodicity(builder: PlanarBuilder, local: BlockVariables, phase: GridPhase) -> list[Condition]:
    """Return the continuity of the torques across the end of a gait without impact there."""
    robot = builder.robot
    mirror = np.eye(robot.n_u) if robot.mirror is None else robot.mirror.actuators
    first = local.add("u first", builder.torques(builder.phases[0])[:, [0]])
    last = local.add("u last", builder.torques(phase)[:, [phase.count]])
    difference = first - ca.DM(mirror) @ last
    names = [f"{name} torque" for name in robot.actuators]
    return [(equation(Kind.PERIODICITY, name), difference[i]) for i, name in enumerate(names)]


def _impact_conditions(builder: PlanarBuilder, phase: GridPhase, parts: tuple[ca.SX, ...]) -> list[Condition]:
    """Return momentum balance and outcome of the impact at the end of a phase."""
    q, v, after, impulse, p = parts
    robot, outcome, names = builder.robot, list(phase.outcome or ()), builder.robot.contact_names
    closed = tuple(i for i, mode in enumerate(outcome) if mode is not Mode.FREE)
    sticking = group_sticking(robot, outcome)
    normal, tangent = robot.rows(q, v, p)[:2]
    impulses = contact_forces(robot, outcome, closed, sticking, ca.vertcat(after, impulse), p)
    joints = impulse[len(closed) + len(sticking) :]
    balance = builder.structure.equations.impact(q, after - v, impulses, joints, p)
    approach, slip = normal @ after, tangent @ after
    momentum = [equation(Kind.MOMENTUM, name) for name in robot.coordinates]
    keys = joint_keys(builder.structure, Kind.JOINT_JUMP, Kind.JOINT_IMPULSE)
    momentum += [equation(key.kind, key.of) for key in keys]
    conditions: list[Condition] = list(zip(momentum, ca.vertsplit(balance), strict=True))
    conditions += [(equation(Kind.CONTACT_RATE, names[i]), approach[i]) for i in closed]
    for members in sticking:
        name, tangential = names[members[0]], impulses[0, members[0]]
        conditions.append((equation(Kind.CONTACT_RATE, f"{name}, tangential"), slip[members[0]]))
        if not builder.structure.infinite:
            share = (1 - builder.margin("impact_cone")) * p[robot.index("friction")]
            limit = share * ca.sum2(impulses[1, list(members)])
            conditions.append((Row(Key(Kind.IMPACT_CONE_FORWARD, name), 0.0, math.inf), limit + tangential))
            conditions.append((Row(Key(Kind.IMPACT_CONE_BACKWARD, name), 0.0, math.inf), limit - tangential))
    for i in first_of_bodies(builder, tuple(outcome)):
        if outcome[i].slips:
            key = Key(Kind.SLIP_SPEED_OF, names[i])
            conditions.append((Row(key, 0.0, math.inf), outcome[i].sign * slip[i]))
    for i, mode in enumerate(outcome):
        if mode is Mode.FREE and phase.state[i] is not Mode.FREE:
            conditions.append((Row(Key(Kind.SEPARATION_OF, names[i]), 0.0, math.inf), approach[i]))
    return conditions


def planar_step_block(builder: PlanarBuilder) -> Block:
    """Return the block of step length, speed and duration."""
    local, robot = BlockVariables(builder, 1), builder.robot
    period = ca.sum1(local.add_shared(Unknown.DURATION))
    conditions: list[Condition] = [(Row(Key(Kind.STEP_DURATION), -math.inf, math.inf), period)]
    if robot.travel is not None:
        columns = builder.variables[Unknown.COORDINATES][[robot.coordinates.index(robot.travel)]]
        travel = local.add("last", columns[:, [-1]]) - local.add("first", columns[:, [0]])
        conditions.append((Row(Key(Kind.STEP_LENGTH), -math.inf, math.inf), travel))
        conditions.append((Row(Key(Kind.SPEED), -math.inf, math.inf), travel / period))
    return _finish(builder, local, Group.STEP, STEP, conditions)


def _finish(
    builder: PlanarBuilder,
    local: BlockVariables,
    table: Group | tuple[Group, int],
    place: Place,
    conditions: list[Condition],
) -> Block:
    """Return the block of some conditions at one place."""
    rows = builder.rows.add(table, [row for row, _ in conditions], [place])
    name = table.value if isinstance(table, Group) else f"{table[0].value}_{table[1]}"
    return local.block(name, ca.vertcat(*[value for _, value in conditions]), rows)
