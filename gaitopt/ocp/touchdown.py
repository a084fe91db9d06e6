"""The boundary of a step: touchdown, frictional impact, leg swap, periodicity, step length and speed."""

import math

import casadi as ca
import numpy as np

from gaitopt.model.impact import impulse_excess
from gaitopt.model.robot import Robot
from gaitopt.motion.word import Word
from gaitopt.ocp.grid import Phase
from gaitopt.ocp.layout import Layout, Rows
from gaitopt.ocp.nlp import Block
from gaitopt.ocp.stance import Row


def touchdown_block(
    robot: Robot, word: Word, phases: tuple[Phase, ...], variables: Layout, rows: Rows, data: ca.SX
) -> Block:
    """Return the block that ties the last node through the impact to the first.

    The momentum balance is written with the first state of the next step, mapped back through the leg swap, so no copy
    of the post-impact state is needed.

    Parameters
    ----------
    robot : Robot
    word : Word
    phases : tuple of Phase
    variables : Layout
        The decision vector.
    rows : Rows
        The constraint rows so far; this block's rows are appended.
    data : SX
        Robot parameters, then the cone and impact-cone margins.
    """
    n, p, margin = len(robot.angles), data[: len(robot.parameters)], data[len(robot.parameters) + 1]
    names = [parameter.name for parameter in robot.parameters]
    friction = p[names.index("friction")]
    slips = [phase for phase in phases if phase.mode.slips]
    final, first = phases[-1], phases[0]

    before, rates_before = ca.SX.sym("before", n), ca.SX.sym("rates_before", n)
    after, rates_after = ca.SX.sym("after", n), ca.SX.sym("rates_after", n)
    speed_before = ca.SX.sym("speed_before") if final.mode.slips else ca.SX(0)
    speed_after = ca.SX.sym("speed_after") if first.mode.slips else ca.SX(0)
    impulse, travel = ca.SX.sym("impulse", 2), ca.SX.sym("travel")
    slides, durations = ca.SX.sym("slides", len(slips)), ca.SX.sym("durations", len(phases))

    local = [before, rates_before, after, rates_after, impulse, travel, durations]
    columns = [
        variables["angles"][:, -1],
        variables["rates"][:, -1],
        variables["angles"][:, 0],
        variables["rates"][:, 0],
        variables["impulse"][:, 0],
        variables["travel"][:, 0],
        variables["duration"][0],
    ]
    if slips:
        local.append(slides)
        columns.append(np.array([variables[f"slide {phase.number}"][0, -1] for phase in slips]))
    if final.mode.slips:
        local.append(speed_before)
        columns.append(variables[f"slide {final.number}"][1, [-1]])
    if first.mode.slips:
        local.append(speed_after)
        columns.append(variables[f"slide {first.number}"][1, [0]])

    zero = ca.SX(1, 1)
    q = ca.vertcat(zero, zero, before)
    v_minus = ca.vertcat(speed_before, zero, rates_before)
    v_next = ca.vertcat(speed_after, zero, rates_after)
    v_plus = robot.unswap(q, v_next, p)
    momentum, _ = robot.impact(q, v_minus, v_plus, impulse, p)
    guard, guard_rate, armed = robot.touchdown(q, v_minus, p)
    relabelled = robot.swap(q, v_minus, p)[0][2:]
    distance = robot.landing(q, v_minus, p)[0][0]
    length = distance + ca.sum1(slides)
    excess = impulse_excess(impulse, friction, word.impact, margin)
    period = ca.sum1(durations)
    constraints = ca.vertcat(
        after - relabelled,
        momentum,
        excess,
        guard,
        guard_rate,
        armed,
        v_plus[1],
        length - travel,
        travel / period,
        period,
    )
    return Block(
        name="touchdown",
        variables=ca.vertcat(*local),
        constraints=constraints,
        columns=np.concatenate(columns)[:, None],
        rows=rows.add("touchdown", _table(robot, word), ["touchdown"]),
    )


def _table(robot: Robot, word: Word) -> list[Row]:
    """Return name, lower and upper bound of each row of the touchdown, in order."""
    cone = ["impact friction cone"] if word.impact.slips else ["forward impact cone", "backward impact cone"]

    table = [(f"leg swap of {angle}", 0.0, 0.0) for angle in robot.angles]
    table += [(f"momentum balance {i + 1}", 0.0, 0.0) for i in range(robot.n_q)]
    table += [(name, 0.0, 0.0 if word.impact.slips else math.inf) for name in cone]
    table += [
        ("touchdown", 0.0, 0.0),
        ("touchdown direction", -math.inf, -1e-3),
        ("touchdown ahead of the stance foot", 1e-3, math.inf),
        ("separation of the trailing foot", 0.0, math.inf),
        ("step length", 0.0, 0.0),
        ("speed", 0.0, math.inf),
        ("step duration", 0.0, math.inf),
    ]
    return table
