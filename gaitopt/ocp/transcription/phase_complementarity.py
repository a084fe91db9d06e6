"""Contact sequences with open phases: a programme in which the foot may stick or slip in every interval.

Time stepping on a fixed grid: one acceleration, torque and contact force in each interval, the equations of motion at
its middle, Coulomb's law as complementarity pairs with the foot speed at its end (J. J. Moreau, Unilateral contact and
dry friction in finite freedom dynamics, 1988).  It is of low order where the contact mode changes, and only proposes
phases: the closed sequence is solved by an accurate transcription.  Torque-rate limits and friction margins are left to
it.
"""

import functools
import itertools

import casadi as ca
import numpy as np

from gaitopt.model.contacts.impact_law import PlasticFrictional
from gaitopt.model.contacts.mode import Mode
from gaitopt.ocp.nlp.layout import Layout, Rows
from gaitopt.ocp.nlp.nlp import Block, assemble_nlp
from gaitopt.ocp.transcription.foot_clearance import clearance_rows
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.impact_complementarity import OPEN_IMPACT, UNKNOWNS
from gaitopt.ocp.transcription.impact_constraints import touchdown_block
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder
from gaitopt.ocp.transcription.phase_constraints import DYNAMICS, quotient_block
from gaitopt.ocp.transcription.phase_dynamics import PhaseDynamics, Row
from gaitopt.ocp.transcription.relaxation import Pair
from gaitopt.ocp.transcription.transcription import Structure, Transcription

CONTACT = "contact"
FORCES = ("normal force", "forward friction", "backward friction", "slip speed")
"""f_n, a and b per weight, with f_t = a - b, and c [m/s]."""

_PAIRS = ("slip speed beside forward friction", "slip speed beside backward friction", "cone beside slip speed")


@functools.lru_cache(maxsize=8)
def transcribe_open(structure: Structure) -> Transcription:
    """Transcribe a structure whose sequence has open phases; equal structures return the programme built before.

    The transcription's one phase is the whole step; `structure.counts` are the intervals of the sequence's phases.
    """
    robot, count = structure.robot, sum(structure.counts)
    whole = Phase(
        number=0,
        mode=Mode.ANY,
        first=0,
        count=count,
        starts_at_rest=False,
        ends_at_rest=False,
        breaks_away=False,
        onset=None,
    )
    stance = PhaseDynamics(robot, Mode.SLIP_FORWARD)  # whose state has the foot's slide and speed
    variables, rows = _variables(structure, count), Rows()
    frame = NlpBuilder(
        robot=robot,
        objective=structure.objective,
        scheme=structure.scheme,
        powered=tuple(robot.actuators.index(name) for name in structure.powered),
        rate_limited=False,
        variables=variables,
        rows=rows,
        data=structure.data(),
        cleared=structure.cleared,
        relaxation=structure.relaxation,
    )
    firsts = itertools.accumulate(structure.counts, initial=0)
    blocks = [
        _interval_block(frame, stance, number, first, own)
        for number, (first, own) in enumerate(zip(firsts, structure.counts, strict=False))
    ]
    blocks.append(touchdown_block(frame, structure.sequence, (whole,)))
    if structure.objective.per_weight_and_travel:
        blocks.append(quotient_block(frame, stance))
    return Transcription(
        structure=structure,
        phases=(whole,),
        dynamics_of_phases=(stance,),
        variables=variables,
        constraints=rows.layout,
        row_bounds=rows.bounds(),
        nlp=assemble_nlp(blocks, frame.data, variables.size, rows.layout.size, typical=structure.objective.typical),
    )


def _variables(structure: Structure, count: int) -> Layout:
    layout, robot, sequence = Layout(), structure.robot, structure.sequence
    nodes = [f"node {k}" for k in range(count + 1)]
    between = [f"between nodes {k} and {k + 1}" for k in range(count)]
    layout.add("angles", robot.angles, nodes)
    layout.add("rates", [f"{angle} rate" for angle in robot.angles], nodes)
    layout.add("slide 0", ["foot slide", "foot speed"], nodes)
    layout.add("torque", [f"{actuator} torque" for actuator in robot.actuators], between)
    layout.add(CONTACT, FORCES, between)
    layout.add("duration", ["duration"], [f"phase {i + 1} ({mode.value})" for i, mode in enumerate(sequence.phases)])
    if structure.objective.uses_power:
        signs = ("positive", "negative")
        layout.add("power", [f"{sign} power of {name}" for sign in signs for name in structure.powered], between)
    layout.add("impulse", ["tangential impulse", "normal impulse"], ["touchdown"])
    if sequence.impact is Mode.ANY and sequence.phases[0] is not Mode.STICK:
        layout.add(OPEN_IMPACT, UNKNOWNS, ["touchdown"])
    layout.add("travel", ["step length"], ["step"])
    if structure.free_slope:
        layout.add("slope", ["slope"], ["ground"])
    if structure.objective.per_weight_and_travel:
        layout.add("integral", ["integral of the objective"], ["step"])
    return layout


def _interval_block(frame: NlpBuilder, stance: PhaseDynamics, number: int, first: int, count: int) -> Block:
    """Return the block of the intervals of one of the sequence's phases."""
    variables, robot = frame.variables, frame.robot
    left = list(range(first, first + count))
    right = [k + 1 for k in left]
    local = BlockVariables(frame, count)
    p = local.parameters()
    begun, ended = (
        local.add(name, np.vstack([variables[table][:, nodes] for table in ("angles", "rates", "slide 0")]))
        for name, nodes in (("begun", left), ("ended", right))
    )
    torque, contact = (local.add(name, variables[name][:, left]) for name in ("torque", CONTACT))
    step = local.add("duration", variables["duration"][:, [number]]) / count
    (place, speed), (place_after, speed_after) = stance.parts(begun), stance.parts(ended)
    middle = (begun + ended) / 2

    normal, forward, backward, slip = ca.vertsplit(contact)
    mass_matrix, bias, actuation = robot.dynamics(*stance.full(middle), p)
    acceleration = (speed_after - speed) / step
    full = ca.vertcat(acceleration[-1], ca.SX(1, 1), acceleration[:-1])
    excess = (mass_matrix @ full + bias - actuation @ torque) / stance.weight(p)
    balance = excess - ca.vertcat(forward - backward, normal, ca.SX.zeros(robot.n_q - 2))
    friction = p[frame.names().index("friction")]
    parts = (normal, forward, backward)
    sides = PlasticFrictional().pairs(parts, slip, (ca.SX(1, 1), speed_after[-1]), friction)
    pairs = [Pair(*pair) for pair in zip(_PAIRS, sides[0][1:], sides[1][1:], strict=True)]
    law, laws, cost = frame.relax(pairs)

    table: list[Row] = [(DYNAMICS + name, 0.0, 0.0) for name in stance.moving]
    table += [(f"balance of {name}", 0.0, 0.0) for name in ("foot", "contact", *robot.angles)]
    values = [place_after - place - step * (speed + speed_after) / 2, balance, laws]
    table += law
    positive, negative = ca.SX.zeros(robot.n_u), ca.SX.zeros(robot.n_u)
    if frame.objective.uses_power:
        own = list(frame.powered)
        split = local.add("power", variables["power"][:, left])
        positive[own], negative[own] = split[: len(own)], split[len(own) :]
        table += [(f"power split of {robot.actuators[i]}", 0.0, 0.0) for i in own]
        values.append((positive - negative - stance.power(middle, torque, p))[own])
    share = step * frame.objective.integrand(torque, positive, negative)
    rows = frame.rows.add(f"interval {number}", table, [f"between nodes {k} and {k + 1}" for k in left])
    if frame.cleared:
        places = [f"node {k}" for k in left]
        heights, clear = clearance_rows(frame, local, stance, [begun], p, number=number, places=places)
        values.append(heights)
        rows = np.vstack([rows, clear])
    if frame.objective.per_weight_and_travel:
        values.append(share)
        rows = np.vstack([rows, np.full(count, frame.integral_row())])
    else:
        cost += share
    return Block(
        name=f"open_{number}",
        variables=local.variables,
        cost=cost,
        constraints=ca.vertcat(*values),
        columns=local.columns,
        rows=rows,
    )
