"""The limits of a planar robot's gait that can be relaxed: names, values, and their rows and unknowns in the NLP."""

import math
from collections.abc import Iterator

import numpy as np
from attrs import evolve

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.motion import Array
from gaitopt.ocp.multicontact.planar_bounds import weight_of
from gaitopt.ocp.multicontact.planar_builder import STAGES, impact_contacts
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_start import setting_of
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.nlp.keys import Kind, Unknown
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.solution.relaxable_limits import RelaxableLimit, list_design_limits, list_duration_limits

CONES = (Kind.CONE_FORWARD, Kind.CONE_BACKWARD, Kind.LIFT_OFF_FORWARD, Kind.LIFT_OFF_BACKWARD)
IMPACT_CONES = (Kind.IMPACT_CONE_FORWARD, Kind.IMPACT_CONE_BACKWARD)

ARMED = "condition 'armed' of the robot at touchdown"
"""Name of the limit that a closing contact is armed."""

Quantities = tuple[tuple[bool, Index, float], ...]


@dataclass(frozen=True)
class PlanarUnits:
    """Typical sizes of mechanical quantities of a gait (SI units).

    Attributes
    ----------
    length, time, weight : float
        Step length [m], the time in which a body falls by it [s], and weight [N].
    """

    length: float
    time: float
    weight: float

    @classmethod
    def of(cls, problem: PlanarProblem) -> "PlanarUnits":
        """Return the sizes of a problem."""
        length = abs(setting_of(problem).step_length)
        return cls(length, math.sqrt(length / problem.values["gravity"]), weight_of(problem.robot, problem.values))

    @property
    def speed(self) -> float:
        """Length over time [m/s]."""
        return self.length / self.time

    def torque(self, unit: str) -> float:
        """Return the size of a torque [N m] or of a force [N]."""
        return 0.1 * self.weight * (self.length if unit == "N m" else 1.0)

    def coordinate(self, unit: str) -> float:
        """Return the size of a coordinate [m or rad]."""
        return self.length if unit == "m" else 1.0


def list_planar_limits(transcription: PlanarTranscription, problem: PlanarProblem) -> list[RelaxableLimit]:
    """Return the limits of a problem and the conditions of its contact sequence that can be relaxed."""
    groups = (_actuation, _impulse_limits, _design, _geometry, _durations, _targets, _friction, _forces, _conditions)
    limits = [limit for group in groups for limit in group(transcription, problem)]
    return [limit for limit in limits if any(len(places) for _, places, _ in limit.quantities)]


def typical_planar_sizes(transcription: PlanarTranscription, problem: PlanarProblem) -> Array:
    """Return typical sizes of the unknowns, shape (n_variables,)."""
    units, robot, layout = PlanarUnits.of(problem), problem.robot, transcription.variables
    sizes = np.ones(layout.size)
    for name, unit in zip(robot.coordinates, robot.units, strict=True):
        size = units.coordinate(unit)
        for kind, power in ((Kind.ANGLE, 0), (Kind.RATE, 1), (Kind.ACCELERATION, 2)):
            sizes[layout.find(kind, name)] = 10.0 ** (power == 2) * size / units.time**power
    for name, unit in zip(robot.actuators, robot.actuator_units, strict=True):
        torque = units.torque(unit)
        sizes[layout.find(Kind.TORQUE, name)] = torque
        for kind in (Kind.ACTUATOR_IMPULSE, Kind.NEGATIVE_IMPULSE):
            sizes[layout.find(kind, name)] = 0.1 * torque * units.time
        for kind in (Kind.POSITIVE_POWER, Kind.NEGATIVE_POWER):
            sizes[layout.find(kind, name)] = torque * units.coordinate("m" if unit == "N" else "rad") / units.time
    for kind, size in (
        (Kind.DURATION, units.time),
        (Kind.CONTACT_FORCE, units.weight),
        (Kind.JOINT_FORCE, units.weight),
        (Kind.IMPULSE, 0.1 * units.weight * units.time),
        (Kind.JOINT_IMPULSE, 0.1 * units.weight * units.time),
    ):
        sizes[layout.find(kind)] = size
    for name, (lower, upper) in problem.free.items():
        sizes[layout.find(Kind.DESIGN, name)] = max(abs(lower), abs(upper))
    return sizes


def replace_limit(problem: PlanarProblem, conflict: Conflict, value: float) -> PlanarProblem | None:
    """Return a problem with another value of a limit that conflicts; None for a limit that is no single number.

    Parameters
    ----------
    problem : PlanarProblem
    conflict : Conflict
    value : float
        Value of the limit; for a range, that of the bound that is exceeded.

    Raises
    ------
    InputError
        If the value is invalid.
    """
    setting, item = conflict.setting, conflict.item
    owner, _, attribute = setting.rpartition(".")
    limits, actuators = problem.limits, problem.robot.actuators
    if setting == "PlanarLimits.torque":
        torques = dict(zip(actuators, limits.torques(actuators), strict=True))
        return problem.replace(limits=evolve(limits, torque=torques | {item: value}))
    if setting == "PlanarLimits.coordinate":
        lower, upper = limits.coordinate[item]
        pair = (value, upper) if value < conflict.limit else (lower, value)  # a relaxed range is wider
        return problem.replace(limits=evolve(limits, coordinate={**limits.coordinate, item: pair}))
    if setting == "PlanarLimits.height":
        return problem.replace(limits=evolve(limits, height={**limits.height, item: value}))
    if owner in ("PlanarLimits", "Margins"):
        field = "limits" if owner == "PlanarLimits" else "margins"
        return problem.replace(**{field: evolve(getattr(problem, field), **{attribute: value})})
    if setting not in ("speed", "step_length", "friction"):
        return None
    ends = getattr(problem, setting)
    if isinstance(ends, tuple):
        return problem.replace(**{setting: (value, ends[1]) if ends[0] == conflict.limit else (ends[0], value)})
    return problem.replace(**{setting: value})


def _actuation(transcription: PlanarTranscription, problem: PlanarProblem) -> Iterator[RelaxableLimit]:
    """Return the torque limits of the actuators that are not idle."""
    units, robot = PlanarUnits.of(problem), problem.robot
    limits = problem.limits.torques(robot.actuators)
    for actuator, unit, torque in zip(robot.actuators, robot.actuator_units, limits, strict=True):
        if torque > 0:
            yield RelaxableLimit(
                name=f"torque limit of {actuator}",
                setting="PlanarLimits.torque",
                value=torque,
                unit=unit,
                size=units.torque(unit),
                quantities=((False, transcription.variables.find(Kind.TORQUE, actuator), 1.0),),
                item=actuator,
            )


def _impulse_limits(transcription: PlanarTranscription, problem: PlanarProblem) -> Iterator[RelaxableLimit]:
    """Return the limits of the impulses of actuators; those of zero determine a sign and are kept."""
    units, robot = PlanarUnits.of(problem), problem.robot
    for impulse in problem.impulses:
        unit = robot.actuator_units[robot.actuators.index(impulse.actuator)]
        table = STAGES[impulse.moment]
        places = [
            transcription.variables[table, entry.phase][k, 0]
            for phase in transcription.phases
            for k, entry in enumerate(transcription.structure.list_impulses(phase.number, impulse.moment))
            if robot.actuators[entry.actuator] == impulse.actuator
        ]
        low, high = impulse.limits
        yield RelaxableLimit(
            name=f"limit of the impulse of {impulse.actuator}",
            setting="ActuatorImpulse.limits",
            value=impulse.limits,
            unit=f"{unit} s",
            size=0.1 * units.torque(unit) * units.time,
            quantities=((False, np.array(places, dtype=int), 1.0),),
            sides="upper" if low == 0 else "lower" if high == 0 else "both",
        )


def _design(transcription: PlanarTranscription, problem: PlanarProblem) -> Iterator[RelaxableLimit]:
    """Return the bounds of the free parameters."""
    return list_design_limits(transcription.variables, problem.free, problem.robot.parameters)


def _geometry(transcription: PlanarTranscription, problem: PlanarProblem) -> Iterator[RelaxableLimit]:
    """Return the limits of coordinates, rates, gaps and heights."""
    units, robot, limits = PlanarUnits.of(problem), problem.robot, problem.limits
    variables, rows = transcription.variables, transcription.constraints
    bounds = limits.coordinates(robot.coordinates)
    for name, unit, pair in zip(robot.coordinates, robot.units, bounds, strict=True):
        places = variables.find(Kind.ANGLE, name)
        for side, value in zip(("lower", "upper"), pair, strict=True):
            if name != robot.travel and math.isfinite(value):
                yield RelaxableLimit(
                    name=f"{side} limit of coordinate {name}",
                    setting="PlanarLimits.coordinate",
                    value=value,
                    unit=unit,
                    size=units.coordinate(unit),
                    quantities=((False, places, 1.0),),
                    sides=side,
                    is_least=side == "lower",
                    item=name,
                )
    yield RelaxableLimit(
        name="limit of the rates",
        setting="PlanarLimits.rate",
        value=limits.rate,
        unit="m/s or rad/s",
        size=1 / units.time,
        quantities=((False, variables.find(Kind.RATE), 1.0),),
    )
    yield RelaxableLimit(
        name="clearance of the free contacts",
        setting="PlanarLimits.clearance",
        value=limits.clearance,
        unit="m",
        size=units.length,
        quantities=((True, rows.find(Kind.GAP), 1.0),),
        is_least=True,
    )
    for point, height in limits.heights(robot.points).items():
        yield RelaxableLimit(
            name=f"height of {point}",
            setting="PlanarLimits.height",
            value=height,
            unit="m",
            size=units.length,
            quantities=((True, rows.find(Kind.HEIGHT, point), 1.0),),
            is_least=True,
            item=point,
        )


def _durations(transcription: PlanarTranscription, problem: PlanarProblem) -> Iterator[RelaxableLimit]:
    """Return the limits of durations."""
    limits, size = problem.limits, PlanarUnits.of(problem).time
    layouts = transcription.variables, transcription.constraints
    return list_duration_limits(layouts, limits.shortest_phase, limits.longest_step, size, "PlanarLimits")


def _targets(transcription: PlanarTranscription, problem: PlanarProblem) -> Iterator[RelaxableLimit]:
    """Return the requested speed and step length."""
    if problem.robot.travel is None:
        return
    units, rows = PlanarUnits.of(problem), transcription.constraints
    speed, step = problem.speed_range, problem.step_length_range
    for name, setting, pair, unit, size, kind in (
        ("speed", "speed", (speed.lower, speed.upper), "m/s", units.speed, Kind.SPEED),
        ("step length", "step_length", (step.lower, step.upper), "m", units.length, Kind.STEP_LENGTH),
    ):
        if setting != "speed" or problem.speed is not None:
            yield RelaxableLimit(
                name=name, setting=setting, value=pair, unit=unit, size=size, quantities=((True, rows.find(kind), 1.0),)
            )


def _friction(transcription: PlanarTranscription, problem: PlanarProblem) -> Iterator[RelaxableLimit]:
    """Return the friction cones of the contacts that stick, and the least speed of those that slide."""
    units, rows, phases = PlanarUnits.of(problem), transcription.constraints, transcription.phases
    slips = any(mode.slips for phase in phases for mode in (*phase.state, *(phase.outcome or ())))
    if slips or "friction" not in problem.free:  # the bounds of a free coefficient are among those of `free`
        yield RelaxableLimit(
            name="friction cone of the sticking contacts" if slips else "friction",
            setting="friction",
            value=problem.friction,
            unit="1",
            size=1.0,
            quantities=(
                (True, np.concatenate([rows.find(kind) for kind in CONES]), units.weight),
                (True, np.concatenate([rows.find(kind) for kind in IMPACT_CONES]), 0.1 * units.weight * units.time),
            ),
        )
    yield RelaxableLimit(
        name="least speed of the sliding contacts",
        setting="Margins.slip_speed",
        value=problem.margins.slip_speed,
        unit="m/s",
        size=units.speed,
        quantities=((True, rows.find(Kind.SLIP_SPEED_OF), 1.0),),
        is_least=True,
    )


def _forces(transcription: PlanarTranscription, problem: PlanarProblem) -> Iterator[RelaxableLimit]:
    """Return the least normal force and the least normal impulse of each contact."""
    units = PlanarUnits.of(problem)
    forces, impulses = _places_of_forces(transcription), _places_of_impulses(transcription)
    for name in problem.robot.contact_names:
        for quantity, setting, value, unit, size, places in (
            ("force", "Margins.normal_force", problem.margins.normal_force, "1", units.weight, forces),
            ("impulse", "PlanarLimits.impulse", problem.limits.impulse, "N s", 1.0, impulses),
        ):
            yield RelaxableLimit(
                name=f"normal {quantity} of {name}",
                setting=setting,
                value=value,
                unit=unit,
                size=1.0 if unit == "1" else 0.1 * units.weight * units.time,
                quantities=((False, np.array(places.get(name, []), dtype=int), size),),
                sides="lower",
                is_least=True,
                keeps_fixed=True,
            )


def _places_of_forces(transcription: PlanarTranscription) -> dict[str, list[int]]:
    """Return the unknowns that are normal forces, by contact; those of latched stops may pull."""
    layout, names, n = (
        transcription.variables,
        transcription.builder.robot.contact_names,
        transcription.builder.robot.n_q,
    )
    places: dict[str, list[int]] = {}
    for phase in transcription.phases:
        nodes, inner = (layout[table, phase.number] for table in (Unknown.ACCELERATION, Unknown.INNER_ACCELERATION))
        for k, i in enumerate(phase.system.closed):
            if phase.state[i] is not Mode.LATCHED:
                rows = np.concatenate([nodes[n + k], inner[n + k :: nodes.shape[0]].ravel()])
                places.setdefault(names[i], []).extend(map(int, rows))
    return places


def _places_of_impulses(transcription: PlanarTranscription) -> dict[str, list[int]]:
    """Return the unknowns that are normal impulses, by contact."""
    names, places = transcription.builder.robot.contact_names, dict[str, list[int]]()
    for phase in transcription.phases:
        for k, i in enumerate(impact_contacts(phase)):
            if phase.outcome is not None and phase.outcome[i] is not Mode.LATCHED:
                column = transcription.variables[Unknown.IMPULSE, phase.number][:, 0]
                places.setdefault(names[i], []).append(int(column[k]))
    return places


def _conditions(transcription: PlanarTranscription, problem: PlanarProblem) -> Iterator[RelaxableLimit]:
    """Return the conditions of the touchdowns with their margins; equations are not relaxed."""
    margins, speed = problem.margins, PlanarUnits.of(problem).speed
    for kind, name, margin, unit, size in (
        (Kind.SEPARATION_OF, "separation of the contacts that an impact opens", "separation", "m/s", speed),
        (Kind.APPROACH, "approach speed of touchdown", "touchdown_rate", "m/s", speed),
        (Kind.ARMED, ARMED, "touchdown_armed", "", 1.0),
    ):
        yield RelaxableLimit(
            name=name,
            setting=f"Margins.{margin}",
            value=getattr(margins, margin),
            unit=unit,
            size=size,
            quantities=((True, transcription.constraints.find(kind), 1.0),),
            is_least=True,
            keeps_fixed=True,
        )
