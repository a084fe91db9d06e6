"""Numbers of the NLP of a planar robot: data and bounds of one problem."""

import itertools
import math
from collections.abc import Mapping

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.actuator_impulses import MOMENTS
from gaitopt.motion.motion import Array
from gaitopt.ocp.multicontact.phase_grid import GridPhase, opening_bodies
from gaitopt.ocp.multicontact.planar_builder import STAGES, PlanarStructure, impact_contacts, stage_modes
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.keys import Group, Kind, Unknown
from gaitopt.ocp.transcription.nlp_builder import MARGINS


def planar_structure(problem: PlanarProblem) -> PlanarStructure:
    """Return the structure of a problem's NLP."""
    limits = problem.limits.torques(problem.robot.actuators)
    impulses = tuple(sorted(problem.impulse_entries))
    pushing = {entry.actuator for entry in impulses}
    return PlanarStructure(
        robot=problem.robot,
        sequence=problem.sequence,
        objective=problem.objective,
        scheme=problem.transcription.scheme,
        counts=problem.counts,
        powered=tuple(i for i, limit in enumerate(limits) if limit > 0 or i in pushing),
        infinite=math.isinf(problem.friction),
        points=tuple(problem.limits.height),
        lifted=problem.lifted,
        free=tuple(problem.free),
        impulses=impulses,
    )


def planar_data(problem: PlanarProblem) -> Array:
    """Return the data of a problem: parameters of robot and ground, and margins of the friction cones."""
    values = problem.values
    parameters = [values[parameter.name] for parameter in problem.robot.parameters]
    if math.isinf(problem.friction):  # no row contains the coefficient, and inf times 0 is not a number
        parameters[problem.robot.index("friction")] = 1.0
    return np.array([*parameters, *(getattr(problem.margins, name) for name in MARGINS)])


def planar_bounds(transcription: PlanarTranscription, problem: PlanarProblem) -> Bounds:
    """Return the bounds of a problem."""
    x_lower, x_upper = _bounds_of_unknowns(transcription, problem)
    g_lower, g_upper = transcription.row_bounds.copy()
    rows, margins, robot = transcription.constraints, problem.margins, problem.robot
    g_upper[rows.find(Kind.STEP_DURATION)] = problem.limits.longest_step
    if robot.travel is not None:
        step, speed = problem.step_length_range, problem.speed_range
        place = rows.find(Kind.STEP_LENGTH)
        g_lower[place], g_upper[place] = max(step.lower, 1e-3), step.upper
        if problem.speed is not None:
            place = rows.find(Kind.SPEED)
            g_lower[place], g_upper[place] = speed.lower, speed.upper
    for kind, margin in ((Kind.SEPARATION_OF, margins.separation), (Kind.ARMED, margins.touchdown_armed)):
        g_lower[rows.find(kind)] = margin
    for phase in transcription.phases:
        if phase.outcome is not None:
            for group in (Group.END, Group.EVENT):
                _set_lower(transcription, g_lower, (group, phase.number), Kind.APPROACH, margins.touchdown_rate)
            _set_lower(transcription, g_lower, (Group.EVENT, phase.number), Kind.SLIP_SPEED_OF, margins.slip_speed)
        _bound_slip(transcription, phase, margins.slip_speed, g_lower)
        _bound_gaps(transcription, phase, problem.limits.clearance, g_lower)
    for point, height in problem.limits.heights(robot.points).items():
        finite = rows.find(Kind.HEIGHT, point)
        g_lower[finite] = np.where(np.isfinite(g_lower[finite]), height, -np.inf)
    return Bounds(x_lower, x_upper, g_lower, g_upper)


def _set_lower(
    transcription: PlanarTranscription, lower: Array, table: tuple[Group, int], kind: Kind, value: float
) -> None:
    """Replace the lower bound of the rows of a kind in a table."""
    layout = transcription.constraints
    for i, key in enumerate(layout.rows[table]):
        if key.kind is kind:
            lower[layout[table][i]] = value


def _bound_slip(transcription: PlanarTranscription, phase: GridPhase, margin: float, lower: Array) -> None:
    """Bound the slip speeds at the nodes of a phase; the bound decreases to zero towards a start or an end at rest."""
    layout, names = transcription.constraints, transcription.builder.robot.contact_names
    part = np.arange(phase.count) / phase.count
    table = (Group.INTERVAL, phase.number)
    for i, key in enumerate(layout.rows[table]):
        if key.kind is Kind.SLIP_SPEED_OF and key.inner == 0:
            least, contact = np.full(phase.count, margin), names.index(key.of)
            if contact in phase.from_rest:
                least *= np.minimum(1, 2 * part) ** 2  # a slide that starts on the cone has no acceleration there
            if phase.comes_to_rest(contact):
                least *= np.minimum(1, 2 * (1 - part))
            places = layout[table][i]
            lower[places] = np.where(np.isfinite(lower[places]), least, -np.inf)
    _set_lower(transcription, lower, (Group.END, phase.number), Kind.SLIP_SPEED_OF, margin)


def _bound_gaps(transcription: PlanarTranscription, phase: GridPhase, clearance: float, lower: Array) -> None:
    """Bound the gaps of open contacts; the bound decreases to zero towards lift-off and touchdown.

    A gap increases with the third power of time after a lift-off without impact, and decreases linearly to an impact
    and with the third power to a soft touchdown, at which speed, acceleration and force vanish as at a lift-off.
    A contact that closes only under a condition is bounded in the first interval after its lift-off.
    """
    layout, robot = transcription.constraints, transcription.builder.robot
    fractions, closing, armed = transcription.structure.scheme.fractions, phase.closing(), conditional_contacts(robot)
    for table in ((Group.INTERVAL, phase.number), (Group.END, phase.number)):
        for i, key in enumerate(layout.rows[table]):
            if key.kind is not Kind.GAP:
                continue
            places, contact = layout[table][i], robot.contact_index(key.of)
            at = (
                np.arange(places.size) + fractions[key.inner] if table[0] is Group.INTERVAL else np.array([phase.count])
            )
            part, least = at / phase.count, np.full(places.size, clearance)
            if contact in phase.opened:
                least *= np.minimum(1, 4 * part) ** 3
            if contact in closing:
                least *= np.minimum(1, 4 * (1 - part)) ** (3 if phase.outcome is None else 1)
            if contact in armed:
                least[(at > 1) | (contact not in phase.lifted)] = -np.inf
            lower[places] = np.where(np.isfinite(lower[places]), least, -np.inf)


def conditional_contacts(robot: PlanarRobot) -> frozenset[int]:
    """Return the contacts that close only while their arming condition is positive."""
    slopes = robot.arming.jac_sparsity(0, 0), robot.arming.jac_sparsity(0, 1)
    rows = {row for sparsity in slopes for row in sparsity.get_triplet()[0]}
    return frozenset(rows)


def _bounds_of_unknowns(transcription: PlanarTranscription, problem: PlanarProblem) -> tuple[Array, Array]:
    """Return the lower and upper bounds of the decision vector."""
    layout, limits, robot = transcription.variables, problem.limits, problem.robot
    lower, upper = np.full(layout.size, -math.inf), np.full(layout.size, math.inf)
    coordinates = layout[Unknown.COORDINATES]
    low, high = np.array(limits.coordinates(robot.coordinates)).T[:, :, None]
    lower[coordinates], upper[coordinates] = low, high
    if robot.travel is not None:
        first = coordinates[robot.coordinates.index(robot.travel), 0]
        lower[first] = upper[first] = 0.0
    rates = layout.find(Kind.RATE)
    lower[rates], upper[rates] = -limits.rate, limits.rate
    for actuator, torque in zip(robot.actuators, limits.torques(robot.actuators), strict=True):
        places = layout.find(Kind.TORQUE, actuator)
        lower[places], upper[places] = -torque, torque
    lower[layout[Unknown.DURATION]], upper[layout[Unknown.DURATION]] = limits.shortest_phase, limits.longest_step
    for kind in (Kind.POSITIVE_POWER, Kind.NEGATIVE_POWER):
        lower[layout.find(kind)] = 0.0
    for name, ends in problem.free.items():
        lower[layout.find(Kind.DESIGN, name)], upper[layout.find(Kind.DESIGN, name)] = ends
    weight = min(weight_of(problem.robot, values) for values in problem.corners)
    for phase in transcription.phases:
        _bound_forces(transcription, phase, problem.margins.normal_force * weight, lower, upper)
        _bound_impulses(transcription, phase, problem.limits.impulse, lower)
    _bound_actuator_impulses(transcription, problem, lower, upper)
    return lower, upper


def _bound_forces(
    transcription: PlanarTranscription, phase: GridPhase, least: float, lower: Array, upper: Array
) -> None:
    """Bound the normal forces from below, and fix the forces of contacts that open at the end of the phase to zero.

    The bound increases from zero after a soft touchdown, at which the force vanishes.
    """
    layout, robot, system = transcription.variables, transcription.builder.robot, phase.system
    nodes, inner = layout[Unknown.ACCELERATION, phase.number], layout[Unknown.INNER_ACCELERATION, phase.number]
    count, size, opening = len(robot.coordinates), nodes.shape[0], phase.opening()
    for k, i in enumerate(system.closed):
        if phase.state[i] is Mode.LATCHED:
            continue
        if robot.contacts[i].kind == "stop":
            lower[nodes[count + k]] = lower[inner[count + k :: size]] = 0.0
            continue
        for row, fraction in zip([nodes[count + k], *inner[count + k :: size]], _fractions(transcription), strict=True):
            part = np.minimum((np.arange(row.size) + fraction) / phase.count, 1.0)
            lower[row] = least
            if i in opening:
                lower[row] *= np.minimum(1, 2 * (1 - part))
            if i in phase.loaded:
                lower[row] *= np.minimum(1, 2 * part)
    fixed = [k for k, i in enumerate(system.closed) if i in opening]
    first = opening_bodies(phase)
    fixed += [len(system.closed) + k for k, members in enumerate(system.sticking) if members[0] in first]
    for k in fixed:
        lower[nodes[count + k, -1]] = upper[nodes[count + k, -1]] = 0.0


def _fractions(transcription: PlanarTranscription) -> list[float]:
    """Return the fractions of the interval of the node and of the inner points."""
    return [float(fraction) for fraction in transcription.structure.scheme.fractions[:-1]]


def _bound_impulses(transcription: PlanarTranscription, phase: GridPhase, least: float, lower: Array) -> None:
    """Bound the normal impulses from below, except those of latched stops; `least` holds for the feet [N s]."""
    if phase.outcome is None:
        return
    column = transcription.variables[Unknown.IMPULSE, phase.number][:, 0]
    for k, i in enumerate(impact_contacts(phase)):
        if phase.outcome[i] is not Mode.LATCHED:
            foot = transcription.structure.robot.contacts[i].kind != "stop"
            lower[column[k]] = least if foot else 0.0


def _bound_actuator_impulses(
    transcription: PlanarTranscription, problem: PlanarProblem, lower: Array, upper: Array
) -> None:
    """Bound the impulses of actuators, and their normal reactions, which are not negative except at latched stops."""
    structure = transcription.structure
    for phase, moment in itertools.product(transcription.phases, MOMENTS):
        entries = structure.list_impulses(phase.number, moment)
        if not entries:
            continue
        column = transcription.variables[STAGES[moment], phase.number][:, 0]
        split = len(structure.split_impulses(phase.number, moment))
        for place, entry in zip(column, entries, strict=False):
            lower[place], upper[place] = problem.impulse_entries[entry]
        lower[column[len(entries) : len(entries) + split]] = 0.0
        modes = [mode for mode in stage_modes(phase, moment) if mode is not Mode.FREE]
        for place, mode in zip(column[len(entries) + split :], modes, strict=False):
            if mode is not Mode.LATCHED:
                lower[place] = 0.0


def weight_of(robot: PlanarRobot, values: Mapping[str, float]) -> float:
    """Return the weight of a robot with given values of its parameters [N]."""
    return float(robot.mass(robot.vector(values))) * values["gravity"]
