"""The blocks of a phase: its intervals, its ends, and the objective gathered along it."""

import math

import casadi as ca
import numpy as np

from gaitopt.ocp.nlp.nlp import Block
from gaitopt.ocp.transcription.foot_clearance import clearance_rows
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder
from gaitopt.ocp.transcription.phase_dynamics import PhaseDynamics, Row
from gaitopt.ocp.transcription.scheme import Point, at_inner_point

DYNAMICS = "dynamics of "
"""How the rows that tie one node to the next are called, before the name of the state."""


def interval_block(frame: NlpBuilder, phase: Phase, stance: PhaseDynamics) -> Block:
    """Return the block of a phase's intervals: dynamics, path constraints at start and inside, powers, objective."""
    variables, scheme = frame.variables, frame.scheme
    left = list(phase.nodes)[:-1]
    right = [k + 1 for k in left]
    local = BlockVariables(frame, phase.count)
    p = local.parameters()
    start = _node(frame, phase, stance, local, left, p)
    end = _node(frame, phase, stance, local, right, p)
    step = local.add("duration", variables["duration"][:, [phase.number]]) / phase.count
    between = f"inner acceleration {phase.number}"
    unknowns = local.add("inner", variables[between]) if between in variables else ca.SX(0, 1)
    gap, inner = scheme.advance(stance, start, end, unknowns, step, p)

    table: list[Row] = [(DYNAMICS + name, 0.0, 0.0) for name in stance.state_names]
    values = [gap]
    if frame.rate_limited:
        names = [frame.robot.actuators[i] for i in frame.powered]
        table += [(f"torque rate of {name}", -math.inf, math.inf) for name in names]
        values.append((end.torque - start.torque)[list(frame.powered)] / step)
    powers: list[ca.SX] = []
    if frame.objective.uses_power:
        half = local.add("inner power", variables[f"inner power {phase.number}"])
        powers = [
            local.add("power", variables["power"][:, left]),
            *ca.vertsplit(half, half.numel() // len(inner)),
            local.add("power after", variables["power"][:, right]),
        ]
    for i, point in enumerate((start, *inner)):
        suffix = at_inner_point(i) if i else ""
        held, value = _held(frame, stance, point, p, sliding=bool(i))
        table += [(name + suffix, low, high) for name, low, high in held]
        values.append(value)
        if powers:
            split, value = _power_split(frame, stance, point, powers[i], p)
            table += [(name + suffix, low, high) for name, low, high in split]
            values.append(value)

    places = [f"{phase.label}, node {k}" for k in range(phase.count)]
    share = step * _integrand(frame, [start, *inner, end], powers)
    index = frame.rows.add(f"interval {phase.number}", table, places)
    if frame.cleared:
        states = [point.state for point in (start, *inner)]
        heights, rows = clearance_rows(frame, local, stance, states, p, number=phase.number, places=places)
        values.append(heights)
        index = np.vstack([index, rows])
    cost: ca.SX | None = share
    if frame.objective.per_weight_and_travel:
        cost = None
        values.append(share)
        index = np.vstack([index, np.full(phase.count, frame.integral_row())])
    return Block(
        name=f"interval_{phase.number}",
        variables=local.variables,
        cost=cost,
        constraints=ca.vertcat(*values),
        columns=local.columns,
        rows=index,
    )


def end_block(frame: NlpBuilder, phase: Phase, stance: PhaseDynamics) -> Block:
    """Return the block of a phase's last node: its path constraints, or the onset of the slip that begins there."""
    local = BlockVariables(frame, 1)
    p = local.parameters()
    last = _node(frame, phase, stance, local, [phase.nodes[-1]], p)
    if phase.onset is None:
        table, values = _held(frame, stance, last, p, sliding=False)
    else:
        table, values = stance.onset(last.force, p, phase.onset)
        table = _balance(frame, stance) + table
        values = ca.vertcat(last.residual, values)
    return Block(
        name=f"end_{phase.number}",
        variables=local.variables,
        constraints=values,
        columns=local.columns,
        rows=frame.rows.add(f"end {phase.number}", table, [f"{phase.label}, node {phase.count}"]),
    )


def start_block(frame: NlpBuilder, phase: Phase, stance: PhaseDynamics) -> Block:
    """Return the condition under which a foot at rest slides at once: its slip acceleration has the slip's sign."""
    local = BlockVariables(frame, 1)
    p = local.parameters()
    first = _node(frame, phase, stance, local, [phase.first], p)
    table = [("breakaway acceleration", 0.0, math.inf)]
    return Block(
        name=f"start_{phase.number}",
        variables=local.variables,
        constraints=phase.mode.sign * first.acceleration[-1],
        columns=local.columns,
        rows=frame.rows.add(f"start {phase.number}", table, [f"{phase.label}, node 0"]),
    )


def last_power_block(frame: NlpBuilder, phase: Phase, stance: PhaseDynamics) -> Block:
    """Return the power split at the last node of the step."""
    local, node = BlockVariables(frame, 1), phase.nodes[-1]
    p = local.parameters()
    last = _node(frame, phase, stance, local, [node], p)
    table, value = _power_split(frame, stance, last, local.add("split", frame.variables["power"][:, [node]]), p)
    return Block(
        name="last_power",
        variables=local.variables,
        constraints=value,
        columns=local.columns,
        rows=frame.rows.add("last power", table, [f"{phase.label}, node {phase.count}"]),
    )


def quotient_block(frame: NlpBuilder, stance: PhaseDynamics) -> Block:
    """Return the objective, an integral over weight and travel, and close the row that defines the integral."""
    local = BlockVariables(frame, 1)
    p = local.parameters()
    integral = local.add("integral", frame.variables["integral"])
    travel = local.add("travel", frame.variables["travel"])
    return Block(
        name="quotient",
        variables=local.variables,
        cost=integral / (stance.weight(p) * travel),
        constraints=-integral,
        columns=local.columns,
        rows=np.array([[frame.integral_row()]]),
    )


def _node(
    frame: NlpBuilder, phase: Phase, stance: PhaseDynamics, local: BlockVariables, nodes: list[int], p: ca.SX
) -> Point:
    """Return the point at a node, one of `nodes` in each instance of the block."""
    state = local.add("state", frame.state_columns(phase, nodes))
    torque = local.add("torque", frame.variables["torque"][:, nodes])
    own = frame.node_columns(phase, nodes)
    unknowns = local.add("acceleration", own) if len(own) else ca.SX(0, 1)
    return frame.scheme.node(stance, state, torque, unknowns, p)


def _balance(frame: NlpBuilder, stance: PhaseDynamics) -> list[Row]:
    return [(name, 0.0, 0.0) for name in frame.scheme.residuals(stance)]


def _held(
    frame: NlpBuilder, stance: PhaseDynamics, point: Point, p: ca.SX, *, sliding: bool
) -> tuple[list[Row], ca.SX]:
    """Return rows and values of what holds at a point: the scheme's equations, the cone, and slip's direction."""
    names, values = stance.path(point.force, p, frame.data[len(frame.robot.parameters)])
    table = _balance(frame, stance) + [(name, 0.0, math.inf) for name in names]
    values = ca.vertcat(point.residual, values)
    if sliding and stance.mode.slips:
        table.append(("foot speed", 0.0, math.inf))
        values = ca.vertcat(values, stance.mode.sign * point.state[-1])
    return table, values


def _power_split(
    frame: NlpBuilder, stance: PhaseDynamics, point: Point, split: ca.SX, p: ca.SX
) -> tuple[list[Row], ca.SX]:
    """Return P = positive part - negative part for every actuator that may work."""
    names = [frame.robot.actuators[i] for i in frame.powered]
    power = stance.power(point.state, point.torque, p)[list(frame.powered)]
    return [(f"power split of {name}", 0.0, 0.0) for name in names], split[: len(names)] - split[len(names) :] - power


def _integrand(frame: NlpBuilder, points: list[Point], powers: list[ca.SX]) -> ca.SX:
    """Return the mean of the objective's integrand over an interval."""
    objective, scheme = frame.objective, frame.scheme
    weights = scheme.smooth_weights() if objective.smooth else scheme.kinked_weights()
    mean = ca.SX(0)
    for i, (weight, point) in enumerate(zip(weights, points, strict=True)):
        positive, negative = ca.SX.zeros(frame.robot.n_u), ca.SX.zeros(frame.robot.n_u)
        if powers:
            positive[list(frame.powered)] = powers[i][: len(frame.powered)]
            negative[list(frame.powered)] = powers[i][len(frame.powered) :]
        mean += float(weight) * objective.integrand(point.torque, positive, negative)
    return mean
