"""The boundary of a step: touchdown, frictional impact, leg exchange, periodicity, step length and speed."""

import math

import casadi as ca

from gaitopt.dataclass import dataclass
from gaitopt.lazy import Deferred
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics, full_vector
from gaitopt.model.contacts.touchdown import Touchdown
from gaitopt.model.coordinate_entries import ANGLES
from gaitopt.model.robot import Robot
from gaitopt.model.uneven_ground import travel_of_slides
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.keys import TOUCHDOWN, Group, Key, Kind, Row, Unknown, equation
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.statement.instant import StepBoundary
from gaitopt.ocp.transcription.condition_rows import condition_rows
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.impact_complementarity import open_impact
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder
from gaitopt.ocp.transcription.objective_blocks import boundary_cost, name_parameters, peak_cost


@dataclass(frozen=True, eq=False, kw_only=True)
class FollowingStep:
    """The step after a touchdown if it differs from the step that ends.

    Attributes
    ----------
    angles, rates : (n_angles, 1) int arrays
        Indices of its first state in the decision vector.
    speed : (1, 1) or (0, 1) int array
        Index of the first speed of its stance foot; empty if the foot sticks.
    impact : Mode
        Outcome of the touchdown.
    friction, margin : SX
        Friction of its ground, and margin to the cone of the impact.
    """

    angles: Index
    rates: Index
    speed: Index
    impact: Mode
    friction: ca.SX
    margin: ca.SX


def touchdown_block(
    builder: NlpBuilder,
    sequence: ContactSequence,
    phases: tuple[Phase, ...],
    dynamics: PhaseDynamics,
    following: FollowingStep | None = None,
) -> Block:
    """Return the block that relates the last node to the first, or to the following step, through the impact.

    The momentum balance contains the first state of the next step, mapped back by the leg exchange, so no copy of the
    post-impact state is needed.  The block includes the boundary terms and the peaks of the objective.
    """
    robot, local = builder.robot, BlockVariables(builder, 1)
    p = local.parameters()
    step, v_plus, foot_speed = _boundary(builder, phases, local, p, following)
    q, v_minus = step.q_last, step.v_last
    momentum, _ = robot.impact(q, v_minus, v_plus, step.impulse, p)
    relabelled = robot.swap(q, v_minus, p)[0][ANGLES]
    length = robot.landing(q, v_minus, p)[0][0]
    if slides := builder.slides(local):
        length += travel_of_slides(robot, p, sum(slides[1:], slides[0]))
    law, excess, penalty = _impact_law(builder, sequence, local, step.impulse, foot_speed, p, following)
    transition_rows, transition = condition_rows(Touchdown(robot).conditions(q, v_minus, v_plus, p))
    constraints = ca.vertcat(
        step.q_first[ANGLES] - relabelled,
        momentum,
        excess,
        transition,
        length - step.travel,
        step.travel / step.duration,
        step.duration,
    )
    rows = builder.rows.add(Group.TOUCHDOWN, _table(robot, law + transition_rows), [TOUCHDOWN])
    cost = boundary_cost(builder, dynamics, step, p) + peak_cost(builder, local)
    return local.block("touchdown", constraints, rows, cost, penalty, merged=True)


def _boundary(
    builder: NlpBuilder,
    phases: tuple[Phase, ...],
    local: BlockVariables,
    p: ca.SX,
    following: FollowingStep | None,
) -> tuple[StepBoundary, ca.SX, ca.SX]:
    """Return the boundary of the step, the rates after the impact, and the speed of the landing foot after it."""
    robot, variables, final, first = builder.robot, builder.variables, phases[-1], phases[0]
    parts = (Unknown.ANGLES, Unknown.RATES)
    before, rates_before = (local.add(f"{part} before", variables[part][:, [-1]]) for part in parts)
    columns = [variables[part][:, [0]] for part in parts]
    columns += [builder.slide_columns(first, [first.first])[1:]]
    if following is not None:
        columns = [following.angles, following.rates, following.speed]
    after, rates_after = (local.add(f"{part} after", table) for part, table in zip(parts, columns, strict=False))
    impulse, travel = local.add("impulse", variables[Unknown.IMPULSE]), local.add("travel", variables[Unknown.TRAVEL])
    duration = ca.sum1(local.add_shared(Unknown.DURATION))

    def speed(table: Index) -> ca.SX:
        return local.add("speed", table) if table.size else ca.SX(1, 1)

    zero = ca.SX(1, 1)
    speed_before = speed(builder.slide_columns(final, [final.nodes[-1]])[1:])
    speed_after = speed(columns[2])
    q, v_minus = full_vector(zero, before), full_vector(speed_before, rates_before)
    v_next = full_vector(speed_after, rates_after)
    v_plus = robot.unswap(q, v_next, p)
    step = StepBoundary(
        q_first=full_vector(zero, after),
        v_first=v_next,
        q_last=q,
        v_last=v_minus,
        velocity_jump=v_plus - v_minus,
        impulse=impulse,
        duration=duration,
        travel=travel,
        parameters=Deferred(lambda: name_parameters(builder, p)),
        energy_lost=Deferred(lambda: robot.energy(q, v_minus, p)[0] - robot.energy(q, v_plus, p)[0]),
    )
    return step, v_plus, speed_after


def _impact_law(
    builder: NlpBuilder,
    sequence: ContactSequence,
    local: BlockVariables,
    impulse: ca.SX,
    foot_speed: ca.SX,
    p: ca.SX,
    following: FollowingStep | None,
) -> tuple[list[Row], ca.SX, ca.SX | None]:
    """Return rows, values and penalty of the friction law of the impact."""
    if following is not None:
        law, mode = builder.robot.contact_model.impact, following.impact
        return _cone(mode), law.excess(impulse, following.friction, mode, following.margin), None
    friction, margin = p[builder.names().index("friction")], builder.data[len(builder.robot.parameters) + 1]
    if Unknown.OPEN_IMPACT in builder.variables:
        return open_impact(builder, local, impulse, foot_speed, friction, builder.robot.mass(p))
    # An open impact before a sticking phase sticks.
    mode = Mode.STICK if sequence.impact is Mode.ANY else sequence.impact
    return _cone(mode), builder.robot.contact_model.impact.excess(impulse, friction, mode, margin), None


def _cone(impact: Mode) -> list[Row]:
    """Return the rows of an impact whose outcome is known."""
    if impact.slips:
        return [equation(Kind.IMPACT_CONE)]
    return [Row(Key(kind), 0.0, math.inf) for kind in (Kind.FORWARD_IMPACT_CONE, Kind.BACKWARD_IMPACT_CONE)]


def _table(robot: Robot, transition: list[Row]) -> list[Row]:
    """Return name, lower and upper bound of each row of the touchdown, in order."""
    table = [equation(Kind.LEG_SWAP, angle) for angle in robot.angles]
    table += [equation(Kind.MOMENTUM, str(i + 1)) for i in range(robot.n_q)]
    table += transition
    table += [
        equation(Kind.STEP_LENGTH),
        Row(Key(Kind.SPEED), 0.0, math.inf),
        Row(Key(Kind.STEP_DURATION), 0.0, math.inf),
    ]
    return table
