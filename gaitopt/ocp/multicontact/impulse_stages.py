"""Impulses of actuators just before and just after an impact: velocities, constraints and works.

An event is a sequence of up to three instants, each with a velocity jump: impulses of actuators with the contacts that
are closed until then, the plastic impact, impulses of actuators with the contacts that stay closed.
"""

import math
from typing import NamedTuple

import casadi as ca

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.phase_system import contact_forces, group_sticking, select_rows
from gaitopt.motion.actuator_impulses import MOMENTS, Moment
from gaitopt.ocp.multicontact.actuator_impulse import ImpulseEntry
from gaitopt.ocp.multicontact.phase_grid import GridPhase
from gaitopt.ocp.multicontact.planar_builder import STAGES, PlanarBuilder, stage_modes
from gaitopt.ocp.multicontact.planar_point import Condition, first_of_bodies
from gaitopt.ocp.nlp.keys import Key, Kind, Row, equation
from gaitopt.ocp.transcription.nlp_builder import BlockVariables


class ImpulseStage(NamedTuple):
    """Simultaneous impulses of actuators.  Quantities are CasADi expressions.

    Attributes
    ----------
    moment : {"before", "after"}
    entries : list of ImpulseEntry
    modes : list of Mode
        Modes of all contacts in this instant.
    values, negative : SX
        Impulses, and negative parts of those of either sign if work is counted.
    reactions : SX
        Normal impulses of the closed contacts, then tangential ones of the sticking bodies.
    before, after : SX, shape (n_q, 1)
        Rates.
    """

    moment: Moment
    entries: list[ImpulseEntry]
    modes: list[Mode]
    values: ca.SX
    negative: ca.SX
    reactions: ca.SX
    before: ca.SX
    after: ca.SX


class ImpactInstants(NamedTuple):
    """The velocities at an event with an impact, in the names of the phase that it ends.

    Attributes
    ----------
    q, p : SX
    before, after : SX
        Rates before and after the event.
    impact_before, impact_after : SX
        Rates before and after the impact alone.
    stages : list of ImpulseStage
    """

    q: ca.SX
    p: ca.SX
    before: ca.SX
    after: ca.SX
    impact_before: ca.SX
    impact_after: ca.SX
    stages: list[ImpulseStage]


def list_instants(
    builder: PlanarBuilder, local: BlockVariables, phase: GridPhase, states: tuple[ca.SX, ca.SX, ca.SX, ca.SX]
) -> ImpactInstants:
    """Return the velocities at the event that ends a phase.

    Parameters
    ----------
    builder : PlanarBuilder
    local : BlockVariables
        Variables of the block, to which those of the impulses are added.
    phase : GridPhase
    states : (q, v before, v after, p)
    """
    q, before, after, p = states
    stages, rates = list[ImpulseStage](), {"before": before, "after": after}
    for moment in MOMENTS:
        entries = builder.structure.list_impulses(phase.number, moment)
        if not entries:
            continue
        table = STAGES[moment]
        column = local.add(f"{table.value} {phase.number}", builder.variables[table, phase.number])
        count, split = len(entries), len(builder.structure.split_impulses(phase.number, moment))
        between = column[-builder.robot.n_q :]
        ends = (before, between) if moment == "before" else (between, after)
        modes = stage_modes(phase, moment)
        rates[moment] = between
        parts = column[:count], column[count : count + split], column[count + split : -builder.robot.n_q]
        stages.append(ImpulseStage(moment, entries, modes, *parts, *ends))
    return ImpactInstants(q, p, before, after, rates["before"], rates["after"], stages)


def stage_conditions(builder: PlanarBuilder, phase: GridPhase, instants: ImpactInstants) -> list[Condition]:
    """Return the momentum balances and contact laws of the impulses of actuators at the event that ends a phase."""
    conditions: list[Condition] = []
    for stage in instants.stages:
        conditions += _momentum(builder, stage, instants)
        conditions += _contact_laws(builder, stage, instants)
        normal = builder.robot.rows(instants.q, stage.after, instants.p)[0]
        names, rates = builder.robot.contact_names, normal @ stage.after
        if stage.moment == "before":
            conditions += [(Row(Key(Kind.APPROACH, names[i]), 0.0, math.inf), -rates[i]) for i in phase.closing()]
        else:
            opened = [i for i, mode in enumerate(stage.modes) if mode is Mode.FREE and _touches(phase, i)]
            conditions += [(Row(Key(Kind.SEPARATION_OF, names[i]), 0.0, math.inf), rates[i]) for i in opened]
        conditions += _signs(builder, stage)
    return conditions


def _touches(phase: GridPhase, contact: int) -> bool:
    return phase.state[contact] is not Mode.FREE or (phase.outcome or ())[contact] is not Mode.FREE


def _momentum(builder: PlanarBuilder, stage: ImpulseStage, instants: ImpactInstants) -> list[Condition]:
    """Return the momentum balance of impulses of actuators."""
    robot, p = builder.robot, instants.p
    actuation = robot.dynamics(instants.q, stage.before, p)[2]
    forces = _reactions(builder, stage, p)
    balance = robot.recursive.impact(instants.q, stage.after - stage.before, forces, ca.SX(0, 1), p)
    balance -= actuation[:, [entry.actuator for entry in stage.entries]] @ stage.values
    keys = [Key(Kind.MOMENTUM, f"{name}, impulses {stage.moment}") for name in robot.coordinates]
    return [(Row(key, 0.0, 0.0), value) for key, value in zip(keys, ca.vertsplit(balance), strict=True)]


def _reactions(builder: PlanarBuilder, stage: ImpulseStage, p: ca.SX) -> ca.SX:
    """Return the impulse (Lambda_t, Lambda_n) of each contact, shape (2, n_c)."""
    closed = tuple(i for i, mode in enumerate(stage.modes) if mode is not Mode.FREE)
    sticking = group_sticking(builder.robot, stage.modes)
    return contact_forces(builder.robot, stage.modes, closed, sticking, ca.vertcat(stage.after, stage.reactions), p)


def _contact_laws(builder: PlanarBuilder, stage: ImpulseStage, instants: ImpactInstants) -> list[Condition]:
    """Return speeds of the closed contacts, friction cones of those that stick and directions of those that slip."""
    robot, p, conditions = builder.robot, instants.p, list[Condition]()
    names, forces = robot.contact_names, _reactions(builder, stage, p)
    normal, tangent = robot.rows(instants.q, stage.after, p)[:2]
    closed = [i for i, mode in enumerate(stage.modes) if mode is not Mode.FREE]
    rates, slip = select_rows(normal, closed) @ stage.after, tangent @ stage.after
    label = f"impulses {stage.moment}"
    conditions += [(equation(Kind.CONTACT_RATE, f"{names[i]}, {label}"), rates[k]) for k, i in enumerate(closed)]
    for members in group_sticking(robot, stage.modes):
        name, tangential = names[members[0]], forces[0, members[0]]
        conditions.append((equation(Kind.CONTACT_RATE, f"{name}, tangential, {label}"), slip[members[0]]))
        if not builder.structure.infinite:
            share = (1 - builder.margin("impact_cone")) * p[robot.index("friction")]
            limit = share * ca.sum2(forces[1, list(members)])
            for kind, value in (
                (Kind.IMPACT_CONE_FORWARD, limit + tangential),
                (Kind.IMPACT_CONE_BACKWARD, limit - tangential),
            ):
                conditions.append((Row(Key(kind, f"{name}, {label}"), 0.0, math.inf), value))
    for i in first_of_bodies(builder, tuple(stage.modes)):
        if stage.modes[i].slips:
            key = Key(Kind.SLIP_SPEED_OF, f"{names[i]}, {label}")
            conditions.append((Row(key, 0.0, math.inf), stage.modes[i].sign * slip[i]))
    return conditions


def _signs(builder: PlanarBuilder, stage: ImpulseStage) -> list[Condition]:
    """Return the positive parts of the impulses that may have either sign."""
    conditions = []
    for part, place in enumerate(list_split_places(stage)):
        name = builder.robot.actuators[stage.entries[place].actuator]
        key = Key(Kind.POSITIVE_IMPULSE, f"{name}, {stage.moment}")
        conditions.append((Row(key, 0.0, math.inf), stage.values[place] + stage.negative[part]))
    return conditions


def list_split_places(stage: ImpulseStage) -> list[int]:
    """Return the places of the impulses with a negative part; empty if work is not counted."""
    return [k for k, entry in enumerate(stage.entries) if entry.sign == 0] if stage.negative.numel() else []


def net_work(builder: PlanarBuilder, stage: ImpulseStage, at: tuple[ca.SX, ca.SX]) -> ca.SX:
    """Return the work of simultaneous impulses [J] at (q, p)."""
    q, p = at
    rates = (builder.robot.joint_rates(q, stage.before, p) + builder.robot.joint_rates(q, stage.after, p)) / 2
    return ca.dot(stage.values, rates[[entry.actuator for entry in stage.entries]])


def stage_works(builder: PlanarBuilder, stage: ImpulseStage, instants: ImpactInstants) -> tuple[ca.SX, ca.SX]:
    """Return the generated and the absorbed work of each actuator with an impulse, both >= 0 [J].

    See :func:`gaitopt.motion.actuator_impulses.split_work`; work must be counted for impulses of either sign.
    """
    places = [entry.actuator for entry in stage.entries]
    before, after = (builder.robot.joint_rates(instants.q, v, instants.p)[places] for v in (stage.before, stage.after))
    generated, absorbed, split = list[ca.SX](), list[ca.SX](), list_split_places(stage)
    for k, entry in enumerate(stage.entries):
        parts = [(entry.sign * stage.values[k], entry.sign)]
        if entry.sign == 0:
            negative = stage.negative[split.index(k)]
            parts = [(stage.values[k] + negative, 1), (negative, -1)]
        for works, direction in ((generated, 1), (absorbed, -1)):
            signs = [direction * sign for _, sign in parts]
            means = [mean_of_positive(sign * before[k], sign * after[k]) for sign in signs]
            works.append(sum((size * mean for (size, _), mean in zip(parts, means, strict=True)), ca.SX(0)))
    return ca.vertcat(*generated), ca.vertcat(*absorbed)


def mean_of_positive(before: ca.SX, after: ca.SX) -> ca.SX:
    """Return the mean of the positive part of a rate that changes linearly; its derivative is continuous."""
    mixed = before * after < 0
    width = ca.if_else(mixed, ca.fabs(after - before), 1)
    largest = ca.fmax(ca.fmax(before, after), 0)
    return ca.if_else(mixed, largest**2 / (2 * width), ca.fmax((before + after) / 2, 0))
