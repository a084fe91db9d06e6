"""The limits of a problem that can be relaxed: their names and values, and their rows and unknowns in the NLP."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.elastic import RelaxedSide
from gaitopt.ocp.nlp.keys import Kind
from gaitopt.ocp.nlp.layout import Index, Layout
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.statement.touchdown_pose import find_longest_reach
from gaitopt.ocp.transcription.transcription import Transcription
from gaitopt.parameters import Parameter

OPEN_CONES = ("complementarity of friction cone and slip speed", "complementarity of impact cone and slip speed")
"""Names of the pairs of open phases and impacts with the friction cone."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RelaxableLimit:
    """A limit of a problem, or a condition of its contact sequence, that an elastic NLP relaxes.

    Attributes
    ----------
    name : str
        Its description, such as ``"torque limit of hip"``.
    setting : str
        The argument of the problem that specifies it, such as ``"Limits.torque"``.
    value : float or (float, float)
        Its value; a pair for bounds.
    unit : str
    size : float
        Typical size of the quantity in its unit, by which excesses of different limits are compared.
    quantities : tuple of (bool, Index, float)
        Indices of its constraint rows (True) or unknowns (False), and the size of their unit in that of the limit.
    sides : str
        Sides of the bounds that belong to it: ``"lower"``, ``"upper"`` or ``"both"``.
    is_least : bool
        Whether the value is the least admissible value of a quantity.
    keeps_fixed : bool
        Whether quantities with equal bounds are fixed by the contact sequence and are not relaxed.
    item : str
        The actuator, coordinate or point that it limits, if `setting` has a value for each; otherwise empty.
    """

    name: str
    setting: str
    value: float | tuple[float, float]
    unit: str
    size: float
    quantities: tuple[tuple[bool, Index, float], ...]
    sides: str = "both"
    is_least: bool = False
    keeps_fixed: bool = False
    item: str = ""


def list_limits(transcription: Transcription, problem: GaitProblem) -> list[RelaxableLimit]:
    """Return the limits of a problem and the conditions of its contact sequence that can be relaxed."""
    groups = (_actuation, _geometry, _durations, _targets, _contact, _conditions)
    return [limit for group in groups for limit in group(transcription, problem)]


def list_duration_limits(
    layouts: tuple[Layout, Layout], shortest: float, longest: float, size: float, options: str = "Limits"
) -> Iterator[RelaxableLimit]:
    """Return the limits of the durations of phases and step.

    Parameters
    ----------
    layouts : (Layout, Layout)
        Layouts of the unknowns and of the constraint rows.
    shortest, longest : float [s]
        Shortest phase and longest step.
    size : float [s]
        Typical duration.
    options : str
        Class of the limits in the problem.
    """
    phases = (False, layouts[0].find(Kind.DURATION), 1.0)
    step = (True, layouts[1].find(Kind.STEP_DURATION), 1.0)
    yield RelaxableLimit(
        name="shortest duration of a phase",
        setting=f"{options}.shortest_phase",
        value=shortest,
        unit="s",
        size=size,
        quantities=(phases,),
        sides="lower",
        is_least=True,
    )
    yield RelaxableLimit(
        name="longest duration of the step",
        setting=f"{options}.longest_step",
        value=longest,
        unit="s",
        size=size,
        quantities=(phases, step),
        sides="upper",
    )


def list_design_limits(
    variables: Layout, free: Mapping[str, tuple[float, float]], parameters: Sequence[Parameter]
) -> Iterator[RelaxableLimit]:
    """Return the bounds of the free parameters.

    Parameters
    ----------
    variables : Layout
        Layout of the unknowns.
    free : mapping of str to (float, float)
    parameters : sequence of Parameter
        All parameters of the robot.
    """
    units = {parameter.name: parameter.unit for parameter in parameters}
    for name, (lower, upper) in free.items():
        yield RelaxableLimit(
            name=name,
            setting="free",
            value=(lower, upper),
            unit=units[name],
            size=max(abs(lower), abs(upper)),
            quantities=((False, variables.find(Kind.DESIGN, name), 1.0),),
        )


def relaxed_sides(limits: list[RelaxableLimit], bounds: Bounds) -> tuple[RelaxedSide, ...]:
    """Return the finite sides of all limits; unknowns that are fixed by the contact sequence are omitted."""
    sides = []
    for number, limit in enumerate(limits):
        for is_row, places, scale in limit.quantities:
            lower, upper = (bounds.g_lower, bounds.g_upper) if is_row else (bounds.x_lower, bounds.x_upper)
            for index in map(int, places):
                if limit.keeps_fixed and lower[index] == upper[index]:
                    continue
                if limit.sides != "upper" and math.isfinite(lower[index]):
                    sides.append(RelaxedSide(number, is_row, index, is_lower=True, scale=scale))
                if limit.sides != "lower" and math.isfinite(upper[index]):
                    sides.append(RelaxedSide(number, is_row, index, is_lower=False, scale=scale))
    return tuple(sides)


@dataclass(frozen=True)
class _Units:
    """Typical sizes of mechanical quantities of a robot (SI units)."""

    length: float
    time: float
    weight: float

    @classmethod
    def of(cls, problem: GaitProblem) -> "_Units":
        robot = problem.robot
        reach = find_longest_reach(robot, problem.values, problem.limits.angles(robot.angles))
        weight = float(robot.weight(robot.vector(problem.values)))
        return cls(reach, math.sqrt(reach / problem.values["gravity"]), weight)


def typical_sizes(transcription: Transcription, problem: GaitProblem) -> Array:
    """Return typical sizes of the unknowns, shape (n_variables,)."""
    units, layout = _Units.of(problem), transcription.variables
    torque, sizes = 0.1 * units.weight * units.length, np.ones(transcription.variables.size)
    for kind, size in (
        (Kind.RATE, 1 / units.time),
        (Kind.TORQUE, torque),
        (Kind.DURATION, units.time),
        (Kind.FOOT_SLIDE, units.length),
        (Kind.SPEED_OF_FOOT, units.length / units.time),
        (Kind.ACCELERATION, 10 / units.time**2),
        (Kind.POSITIVE_POWER, torque / units.time),
        (Kind.NEGATIVE_POWER, torque / units.time),
        (Kind.IMPULSE, 0.1 * units.weight * units.time),
        (Kind.TRAVEL, units.length),
    ):
        sizes[layout.find(kind)] = size
    for name, (lower, upper) in problem.free.items():
        sizes[layout.find(Kind.DESIGN, name)] = max(abs(lower), abs(upper))
    return sizes


def _actuation(transcription: Transcription, problem: GaitProblem) -> Iterator[RelaxableLimit]:
    """Return the limits of torques and their rates."""
    units, robot, limits = _Units.of(problem), problem.robot, problem.limits
    variables, rows = transcription.variables, transcription.constraints
    size = 0.1 * units.weight * units.length
    for actuator, torque, rate in zip(
        robot.actuators, limits.torques(robot.actuators), limits.torque_rates(robot.actuators), strict=True
    ):
        yield RelaxableLimit(
            name=f"torque limit of {actuator}",
            setting="Limits.torque",
            value=torque,
            unit="N m",
            size=size,
            quantities=((False, variables.find(Kind.TORQUE, actuator), 1.0),),
            item=actuator,
        )
        yield RelaxableLimit(
            name=f"torque-rate limit of {actuator}",
            setting="Limits.torque_rate",
            value=rate,
            unit="N m/s",
            size=10 * size / units.time,
            quantities=((True, rows.find(Kind.TORQUE_RATE, actuator), 1.0),),
            item=actuator,
        )


def _geometry(transcription: Transcription, problem: GaitProblem) -> Iterator[RelaxableLimit]:
    """Return the limits of angles, rates and clearance."""
    units, robot, limits = _Units.of(problem), problem.robot, problem.limits
    variables, rows = transcription.variables, transcription.constraints
    for angle, pair in zip(robot.angles, limits.angles(robot.angles), strict=True):
        for side, value in zip(("lower", "upper"), pair, strict=True):
            if abs(value) == math.pi / 2:
                continue  # the default, which is not a limit set by the user
            yield RelaxableLimit(
                name=f"{side} limit of angle {angle}",
                setting="Limits.angle",
                value=value,
                unit="rad",
                size=1.0,
                quantities=((False, variables.find(Kind.ANGLE, angle), 1.0),),
                sides=side,
                is_least=side == "lower",
                item=angle,
            )
    yield RelaxableLimit(
        name="limit of the angular rates",
        setting="Limits.rate",
        value=limits.rate,
        unit="rad/s",
        size=1 / units.time,
        quantities=((False, variables.find(Kind.RATE), 1.0),),
    )
    yield RelaxableLimit(
        name="clearance of the swing foot",
        setting="Limits.clearance",
        value=limits.clearance or 0.0,
        unit="m",
        size=units.length,
        is_least=True,
        quantities=((True, rows.find(Kind.CLEARANCE), 1.0),),
    )


def _durations(transcription: Transcription, problem: GaitProblem) -> Iterator[RelaxableLimit]:
    """Return the limits of durations."""
    limits, layouts = problem.limits, (transcription.variables, transcription.constraints)
    return list_duration_limits(layouts, limits.shortest_phase, limits.longest_step, _Units.of(problem).time)


def _targets(transcription: Transcription, problem: GaitProblem) -> Iterator[RelaxableLimit]:
    """Return the requested speed, step length and slope."""
    units, variables, rows = _Units.of(problem), transcription.variables, transcription.constraints
    speed, step = problem.speed_range, problem.step_length_range
    yield RelaxableLimit(
        name="speed",
        setting="speed",
        value=(speed.lower, speed.upper),
        unit="m/s",
        size=units.length / units.time,
        quantities=((True, rows.find(Kind.SPEED), 1.0),),
    )
    yield RelaxableLimit(
        name="step length",
        setting="step_length",
        value=(step.lower, step.upper),
        unit="m",
        size=units.length,
        quantities=((False, variables.find(Kind.TRAVEL), 1.0),),
        sides="both" if step.lower > 0 else "upper",
    )
    yield RelaxableLimit(
        name="slope",
        setting="slope",
        value=problem.slope_range,
        unit="rad",
        size=0.1,
        quantities=((False, variables.find(Kind.SLOPE), 1.0),),
    )
    if problem.stability is not None:
        yield RelaxableLimit(
            name="spectral radius",
            setting="StabilityBound.radius",
            value=problem.stability.radius,
            unit="1",
            size=1.0,
            quantities=((False, variables.find(Kind.RADIUS), 1.0),),
            sides="upper",
        )
    yield from list_design_limits(variables, problem.free, problem.robot.parameters)


def _contact(transcription: Transcription, problem: GaitProblem) -> Iterator[RelaxableLimit]:
    """Return friction, and the least speed of a sliding foot."""
    units, rows, sequence = _Units.of(problem), transcription.constraints, problem.sequence
    slips = any(mode.slips for mode in (*sequence.phases, sequence.impact))
    cones = rows.find(Kind.FORWARD_CONE), rows.find(Kind.BACKWARD_CONE)
    impact = rows.find(Kind.FORWARD_IMPACT_CONE), rows.find(Kind.BACKWARD_IMPACT_CONE)
    # The bounds of a free coefficient are among those of `free`.
    if slips or sequence.is_open or "friction" not in problem.free:
        yield RelaxableLimit(
            name="friction cone of the sticking foot" if slips else "friction",
            setting="friction",
            value=problem.friction,
            unit="1",
            size=1.0,
            quantities=(
                (True, np.concatenate(cones), 1.0),
                (True, np.concatenate(impact), 0.1 * units.weight * units.time),
                (True, np.concatenate([rows.find(Kind.PAIR, name) for name in OPEN_CONES]), 1.0),
            ),
        )
    yield RelaxableLimit(
        name="least speed of the sliding foot",
        setting="Margins.slip_speed",
        value=problem.margins.slip_speed,
        unit="m/s",
        size=units.length / units.time,
        is_least=True,
        keeps_fixed=True,
        quantities=(
            (True, rows.find(Kind.SLIP_DIRECTION), 1.0),
            (False, transcription.variables.find(Kind.SPEED_OF_FOOT), 1.0),
        ),
    )


def _conditions(transcription: Transcription, problem: GaitProblem) -> Iterator[RelaxableLimit]:
    """Return the other conditions of the contact sequence with their margins.

    The well-posedness of slip is not among them: where it is violated, accelerations are unbounded.
    """
    units, margins = _Units.of(problem), problem.margins
    speed, rate = units.length / units.time, 1 / units.time
    for kind, name, margin, unit, size in (
        (Kind.NORMAL_FORCE, "normal force", "normal_force", "1", 1.0),
        (Kind.SLIP_FROM_REST, "start of a slip from rest", "", "1", 1.0),
        (Kind.SEPARATION, "separation of the trailing foot", "separation", "m/s", speed),
        (Kind.TOUCHDOWN_DIRECTION, "touchdown direction", "touchdown_rate", "", rate),
        (Kind.TOUCHDOWN_AHEAD, "touchdown ahead of the stance foot", "touchdown_armed", "", 1.0),
    ):
        yield RelaxableLimit(
            name=name,
            setting=f"Margins.{margin}" if margin else "sequence",
            value=getattr(margins, margin) if margin else 0.0,
            unit=unit,
            size=size,
            is_least=True,
            quantities=((True, transcription.constraints.find(kind), 1.0),),
        )
