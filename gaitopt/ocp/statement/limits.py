"""Limits and margins of a gait problem."""

import math
from collections.abc import Mapping
from typing import Any

from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.parameters import as_float, number_within, optional, positive, recall_parameter

LARGEST_CLEARANCE = 10.0
"""Largest clearance of the swing foot [m]."""


def _positive(name: str, unit: str, value: object, *, zero: bool = False) -> float:
    return recall_parameter(name, unit, lower=0.0, lower_open=not zero, infinite=True).check(value)


def _check_torques(limits: object, attribute: Any, torque: Any) -> None:
    """Raise InputError if a limit of a torque or its rate is negative; the names are checked with the robot."""
    named = torque.items() if isinstance(torque, Mapping) else [("every actuator", torque)]
    unit, zero = ("N m", True) if attribute.name == "torque" else ("N m/s", False)
    for name, limit in named:
        _positive(f"Limits.{attribute.name} of {name}", unit, limit, zero=zero)


def _check_angles(limits: object, attribute: object, angle: Any) -> None:
    """Raise InputError if a bound of an angle is invalid; the names are checked with the robot."""
    named = {f" of {name}": bounds for name, bounds in angle.items()} if isinstance(angle, Mapping) else {"": angle}
    for name, bounds in named.items():
        _angle_bounds(f"Limits.angle{name}", bounds)


@check_arguments
@frozen(kw_only=True)
class Limits:
    """Bounds on a gait.

    Attributes
    ----------
    torque : float or mapping of actuator to float [N m]
        Largest absolute torque; ``inf`` removes the limit (optima then tend to stop a slide within the shortest
        phase by a very large torque), 0 makes the actuator idle.
    torque_rate : float or mapping of actuator to float [N m/s]
        Largest rate of change of the torque within the step; it may jump at touchdown.
    angle : float, or mapping of angle to float or pair [rad]
        Largest absolute angle, or for each named angle its largest absolute value or (lower, upper), as for a knee; the
        limit of the others is 90 degrees.
    rate : float [rad/s]
        Largest absolute angular rate.
    shortest_phase : float [s]
        Shortest duration of a phase.
    longest_step : float [s]
        Longest duration of the step.
    clearance : float or None [m]
        Least height of the swing foot over the ground at the stance foot.  At the distance x from the stance foot the
        least height is clearance (1 - (x / d)^2)^2, which is zero at the footprints, d being the distance between the
        feet at touchdown.  0 excludes penetration of the ground; None removes the constraint, as walkers without knees
        need: their swing foot scuffs.  At most 10 m.

    Examples
    --------
    >>> Limits(torque={"ankle": 2, "hip": 6}).torques(("ankle", "hip"))
    [2.0, 6.0]
    >>> Limits(angle={"knee": (0, 1.2), "thigh": 1}).angles(("thigh", "knee"))
    [(-1.0, 1.0), (0.0, 1.2)]
    """

    torque: float | Mapping[str, float] = field(default=math.inf, validator=_check_torques)
    torque_rate: float | Mapping[str, float] = field(default=math.inf, validator=_check_torques)
    angle: float | Mapping[str, float | tuple[float, float]] = field(default=math.pi / 2, validator=_check_angles)
    rate: float = field(default=math.inf, converter=as_float, validator=positive("rad/s", infinite=True))
    shortest_phase: float = field(default=5e-3, converter=as_float, validator=positive("s", infinite=True))
    longest_step: float = field(default=10.0, converter=as_float, validator=positive("s", infinite=True))
    clearance: float | None = field(
        default=None, converter=as_float, validator=optional(number_within("m", lower=0.0, upper=LARGEST_CLEARANCE))
    )

    def torques(self, actuators: tuple[str, ...]) -> list[float]:
        """Return the limit of each actuator [N m], in order.

        Raises
        ------
        InputError
            If a limit is negative or its name is not that of an actuator.
        """
        by_name = _by_actuator("torque", self.torque, actuators)
        return [_positive(name, "N m", limit, zero=True) for name, limit in by_name.items()]

    def torque_rates(self, actuators: tuple[str, ...]) -> list[float]:
        """Return the limit of each actuator's torque rate [N m/s], in order.

        Raises
        ------
        InputError
            If a limit is not positive or its name is not that of an actuator.
        """
        by_name = _by_actuator("torque_rate", self.torque_rate, actuators)
        return [_positive(name, "N m/s", limit) for name, limit in by_name.items()]

    def angles(self, names: tuple[str, ...]) -> list[tuple[float, float]]:
        """Return the bounds of each angle [rad], in order.

        Raises
        ------
        InputError
            If a bound is not a number, a lower bound is not below the upper one, or an angle does not exist.
        """
        if not isinstance(self.angle, Mapping):
            return [_angle_bounds("Limits.angle", self.angle)] * len(names)
        for name in self.angle:
            if name not in names:
                raise InputError(f"Limits.angle: there is no angle {name!r}. {suggest(name, names)}")
        return [_angle_bounds(f"Limits.angle of {name}", self.angle.get(name, math.pi / 2)) for name in names]


def _angle_bounds(name: str, limit: object) -> tuple[float, float]:
    if not isinstance(limit, tuple | list):
        size = _positive(name, "rad", limit)
        return -size, size
    if len(limit) != 2:
        raise InputError(f"{name} must be a number or a pair (lower, upper), got {limit!r}.")
    lower, upper = (recall_parameter(name, "rad").check(bound) for bound in limit)
    if lower >= upper:
        raise InputError(f"{name}: the lower bound {lower:g} must be below the upper bound {upper:g} [rad].")
    return lower, upper


def report_implausible_angles(setting: str, limits: object) -> tuple[str, ...]:
    """Return a sentence for each bound of an angle that exceeds a revolution: it was probably stated in degrees.

    Parameters
    ----------
    setting : str
        Name of the limits, such as ``"Limits.angle"``.
    limits : float, or mapping of angle to float or pair [rad]

    Examples
    --------
    >>> print(*report_implausible_angles("Limits.angle", {"th1": (-30, 30), "th2": 1.0}))
    Limits.angle of th1 = (-30, 30) rad is implausible: it is (-1719, 1719) deg, and a bound of an angle is at most \
6.28 rad in size. If the value is in degrees, state (math.radians(-30), math.radians(30)).
    """
    named = {f" of {name}": bounds for name, bounds in limits.items()} if isinstance(limits, Mapping) else {"": limits}
    sentences = []
    for name, bounds in named.items():
        values = [float(bound) for bound in (bounds if isinstance(bounds, tuple | list) else [bounds])]  # type: ignore[arg-type]
        if any(2 * math.pi < abs(value) < math.inf for value in values):
            stated, degrees, meant = (
                texts[0] if len(texts) == 1 else f"({', '.join(texts)})"
                for texts in (
                    [f"{value:.6g}" for value in values],
                    [f"{math.degrees(value):.4g}" for value in values],
                    [_state_in_degrees(value) for value in values],
                )
            )
            sentences.append(
                f"{setting}{name} = {stated} rad is implausible: it is {degrees} deg, and a bound of an angle is at "
                f"most 6.28 rad in size. If the value is in degrees, state {meant}."
            )
    return tuple(sentences)


def _state_in_degrees(value: float) -> str:
    """Return the expression of an angle in degrees, which may be infinite.

    Examples
    --------
    >>> _state_in_degrees(30.0), _state_in_degrees(-math.inf)
    ('math.radians(30)', '-math.inf')
    """
    return f"math.radians({value:.6g})" if math.isfinite(value) else f"{'-' if value < 0 else ''}math.inf"


def _by_actuator(field_name: str, limit: float | Mapping[str, float], actuators: tuple[str, ...]) -> dict[str, float]:
    """Return a limit for each actuator by its name in messages, in order; infinity for those missing in a mapping."""
    if not isinstance(limit, Mapping):
        return {f"Limits.{field_name} of {name}": limit for name in actuators}
    for name in limit:
        if name not in actuators:
            raise InputError(f"Limits.{field_name}: there is no actuator {name!r}. {suggest(name, actuators)}")
    return {f"Limits.{field_name} of {name}": limit.get(name, math.inf) for name in actuators}


@check_arguments
@frozen(kw_only=True)
class Margins:
    """Margins to the limits at which a gait changes its contact sequence.

    Attributes
    ----------
    cone : float
        For a sticking foot abs(f_t) <= (1 - cone) mu f_n.  If a slip starts from rest without a preceding sticking
        phase, that is, after a sticking impact or at a direct reversal, the sticking force lies outside the cone:
        abs(f_t) >= (1 + cone) mu f_n.
    impact_cone : float
        For a sticking impact abs(Lambda_t) <= (1 - impact_cone) mu Lambda_n.
    slip_speed : float [m/s]
        Least speed of a sliding foot in mid-slide; towards a start or an end at rest the bound decreases to zero.
    sliding_inertia : float
        Least effective mass of a sliding foot relative to that without friction.  Slip is well posed while it is
        positive; at zero, contact forces are unbounded, and below zero Painleve's paradox occurs.
    separation : float [m/s]
        Least upward speed of the trailing foot after the impact.
    normal_force : float
        Least normal force, as a fraction of the weight.
    touchdown_rate : float
        Least rate at which the touchdown guard of the robot falls at touchdown, in the unit of the guard per second:
        rad/s for the difference of two angles (the compass biped), m/s for the height of a foot (the five-link walker).
    touchdown_armed : float
        Least value of the robot's `armed` at touchdown, in the unit of `armed` (rad for an angle, m for a distance).

    Examples
    --------
    >>> Margins(cone=0.05).cone
    0.05
    """

    cone: float = field(default=1e-3, converter=as_float, validator=number_within(lower=0.0, upper=0.99))
    impact_cone: float = field(default=1e-3, converter=as_float, validator=number_within(lower=0.0, upper=0.99))
    slip_speed: float = field(default=1e-2, converter=as_float, validator=number_within("m/s", lower=0.0))
    sliding_inertia: float = field(default=1e-2, converter=as_float, validator=number_within(lower=0.0, upper=0.99))
    separation: float = field(default=1e-3, converter=as_float, validator=number_within("m/s", lower=0.0))
    normal_force: float = field(default=1e-2, converter=as_float, validator=number_within(lower=0.0, upper=0.99))
    touchdown_rate: float = field(default=1e-3, converter=as_float, validator=number_within(lower=0.0))
    touchdown_armed: float = field(default=1e-3, converter=as_float, validator=number_within(lower=0.0))


Target = float | tuple[float, float] | None
"""A requested value: a number (fixed), a pair (bounded), or None (free)."""


@dataclass(frozen=True)
class Range:
    """An interval [lower, upper] of a Target; the value is fixed if both are equal."""

    lower: float = 0.0
    upper: float = math.inf

    @classmethod
    def of(cls, target: Target, name: str, unit: str) -> "Range":
        """Return the interval of a target.

        Raises
        ------
        InputError
            If a bound is not a positive number, or the lower one exceeds the upper.

        Examples
        --------
        >>> Range.of((0.5, 0.7), "speed", "m/s")
        Range(lower=0.5, upper=0.7)
        """
        if target is None:
            return cls()
        pair = target if isinstance(target, tuple | list) else (target, target)
        if len(pair) != 2:
            raise InputError(f"{name} must be a number, a pair (lower, upper) or None, got {target!r}.")
        lower, upper = (recall_parameter(name, unit, lower=0.0, lower_open=True).check(bound) for bound in pair)
        if lower > upper:
            raise InputError(f"{name}: the lower bound {lower:g} must not exceed the upper bound {upper:g} [{unit}].")
        return cls(lower, upper)
