"""The boundary of a step: touchdown, frictional impact, leg swap, periodicity, step length and speed."""

import math

import casadi as ca

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.ocp.nlp.nlp import Block
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.impact_complementarity import OPEN_IMPACT, open_impact
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder
from gaitopt.ocp.transcription.phase_dynamics import Row

DIRECTION, ARMED = "touchdown direction", "touchdown ahead of the stance foot"
"""Rows of the guard's rate and of what arms it, in their own units; Margins has their bounds."""


def touchdown_block(frame: NlpBuilder, sequence: ContactSequence, phases: tuple[Phase, ...]) -> Block:
    """Return the block that ties the last node through the impact to the first.

    The momentum balance is written with the first state of the next step, mapped back through the leg swap, so no copy
    of the post-impact state is needed.
    """
    robot, variables, local = frame.robot, frame.variables, BlockVariables(frame, 1)
    p, margin = local.parameters(), frame.data[len(robot.parameters) + 1]
    friction = p[frame.names().index("friction")]
    slides = [phase for phase in phases if phase.slides]
    final, first = phases[-1], phases[0]

    before, rates_before = (local.add(f"{part} before", variables[part][:, [-1]]) for part in ("angles", "rates"))
    after, rates_after = (local.add(f"{part} after", variables[part][:, [0]]) for part in ("angles", "rates"))
    impulse, travel = local.add("impulse", variables["impulse"]), local.add("travel", variables["travel"])
    durations = local.add("durations", variables["duration"].T)
    speed_before = speed_after = ca.SX(0)
    slid = [local.add("slide", variables[f"slide {phase.number}"][:1, [-1]]) for phase in slides]
    if final.slides:
        speed_before = local.add("speed before", variables[f"slide {final.number}"][1:, [-1]])
    if first.slides:
        speed_after = local.add("speed after", variables[f"slide {first.number}"][1:, [0]])

    zero = ca.SX(1, 1)
    q = ca.vertcat(zero, zero, before)
    v_minus = ca.vertcat(speed_before, zero, rates_before)
    v_next = ca.vertcat(speed_after, zero, rates_after)
    v_plus = robot.unswap(q, v_next, p)
    momentum, _ = robot.impact(q, v_minus, v_plus, impulse, p)
    guard, guard_rate, armed = robot.touchdown(q, v_minus, p)
    relabelled = robot.swap(q, v_minus, p)[0][2:]
    distance = robot.landing(q, v_minus, p)[0][0]
    length = distance + sum(slid)
    if OPEN_IMPACT in variables:
        mass = robot.mass(p)
        law, excess, cost = open_impact(frame, local, impulse, speed_after, friction, mass)
    else:
        # An open impact before a sticking phase can only stick.
        mode = Mode.STICK if sequence.impact is Mode.ANY else sequence.impact
        law, excess, cost = _cone(mode), robot.contact_model.impact.excess(impulse, friction, mode, margin), None
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
        variables=local.variables,
        cost=cost,
        constraints=constraints,
        columns=local.columns,
        rows=frame.rows.add("touchdown", _table(robot, law), ["touchdown"]),
    )


def _cone(impact: Mode) -> list[Row]:
    """Return the rows of an impact whose outcome is known."""
    if impact.slips:
        return [("impact friction cone", 0.0, 0.0)]
    return [("forward impact cone", 0.0, math.inf), ("backward impact cone", 0.0, math.inf)]


def _table(robot: Robot, law: list[Row]) -> list[Row]:
    """Return name, lower and upper bound of each row of the touchdown, in order."""
    table = [(f"leg swap of {angle}", 0.0, 0.0) for angle in robot.angles]
    table += [(f"momentum balance {i + 1}", 0.0, 0.0) for i in range(robot.n_q)]
    table += law
    table += [
        ("touchdown", 0.0, 0.0),
        (DIRECTION, -math.inf, 0.0),
        (ARMED, 0.0, math.inf),
        ("separation of the trailing foot", 0.0, math.inf),
        ("step length", 0.0, 0.0),
        ("speed", 0.0, math.inf),
        ("step duration", 0.0, math.inf),
    ]
    return table
