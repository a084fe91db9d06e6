"""Limits of the gait of a planar robot."""

import math
from collections.abc import Mapping
from typing import Any

from attrs import field, frozen

from gaitopt.arguments import check_record
from gaitopt.errors import InputError, suggest
from gaitopt.ocp.statement.limits import LARGEST_CLEARANCE, Limits
from gaitopt.parameters import as_float, number_within, positive, recall_parameter


def _check_torque(limits: object, attribute: object, torque: Any) -> None:
    named = torque.items() if isinstance(torque, Mapping) else [("every actuator", torque)]
    for name, limit in named:
        recall_parameter(f"PlanarLimits.torque of {name}", "N m", lower=0.0, infinite=True).check(limit)


def _check_coordinates(limits: object, attribute: object, coordinate: Mapping[str, Any]) -> None:
    for name, bounds in coordinate.items():
        if not isinstance(bounds, tuple | list) or len(bounds) != 2 or not bounds[0] < bounds[1]:
            raise InputError(
                f"PlanarLimits.coordinate of {name} must be a pair (lower, upper) with lower < upper, got {bounds!r}."
            )


def _check_heights(limits: object, attribute: object, height: Mapping[str, Any]) -> None:
    for name, value in height.items():
        recall_parameter(f"PlanarLimits.height of {name}", "m").check(value)


@check_record
@frozen(kw_only=True)
class PlanarLimits:
    """Bounds on the gait of a planar robot.

    Attributes
    ----------
    torque : float or mapping of actuator to float [N m or N]
        Largest absolute torque or force; 0 makes an actuator idle.
    coordinate : mapping of coordinate to (lower, upper) [m or rad]
        Those not named are unbounded.
    rate : float [m/s or rad/s]
        Largest absolute rate of all coordinates.
    shortest_phase, longest_step : float [s]
    height : mapping of point to float [m]
        Least height of points of the robot, such as a knee.
    clearance : float [m or rad]
        Least gap of open contacts, decreasing to zero within a quarter of the phase towards lift-off and touchdown.
        A contact with a condition under which it closes (`armed`) may swing through the ground: it has this clearance
        in the first interval after its lift-off only.  With zero, a foot may follow the ground, and the replay then
        has further touchdowns.
    impulse : float [N s]
        Least normal impulse of each contact that an impact leaves closed.  Optimal landings in double support have a
        trailing foot without impulse; a return map is not smooth there.

    Examples
    --------
    >>> PlanarLimits(torque={"hip": 6}, coordinate={"s": (0.35, 0.65)}).torques(("leg", "hip"))
    [inf, 6.0]
    """

    torque: float | Mapping[str, float] = field(default=math.inf, validator=_check_torque)
    coordinate: Mapping[str, tuple[float, float]] = field(factory=dict, validator=_check_coordinates)
    rate: float = field(default=math.inf, converter=as_float, validator=positive(infinite=True))
    shortest_phase: float = field(default=5e-3, converter=as_float, validator=positive("s", infinite=True))
    longest_step: float = field(default=10.0, converter=as_float, validator=positive("s", infinite=True))
    height: Mapping[str, float] = field(factory=dict, validator=_check_heights)
    clearance: float = field(
        default=1e-3, converter=as_float, validator=number_within("m", lower=0.0, upper=LARGEST_CLEARANCE)
    )
    impulse: float = field(default=0.0, converter=as_float, validator=number_within("N s", lower=0.0))

    def torques(self, actuators: tuple[str, ...]) -> list[float]:
        """Return the limit of each actuator, in order; raise InputError for an invalid limit or name."""
        for name in self.torque if isinstance(self.torque, Mapping) else ():
            if name not in actuators:
                raise InputError(f"PlanarLimits.torque: there is no actuator {name!r}. {suggest(name, actuators)}")
        return Limits(torque=self.torque).torques(actuators)

    def coordinates(self, names: tuple[str, ...]) -> list[tuple[float, float]]:
        """Return the bounds of each coordinate, in order; raise InputError for an unknown name."""
        for name in self.coordinate:
            if name not in names:
                raise InputError(f"PlanarLimits.coordinate: there is no coordinate {name!r}. {suggest(name, names)}")
        unbounded = (-math.inf, math.inf)
        return [(float(low), float(high)) for low, high in (self.coordinate.get(name, unbounded) for name in names)]

    def heights(self, points: tuple[str, ...]) -> dict[str, float]:
        """Return the least heights by point; raise InputError for an unknown point."""
        for name in self.height:
            if name not in points:
                raise InputError(f"PlanarLimits.height: there is no point {name!r}. {suggest(name, points)}")
        return {name: float(value) for name, value in self.height.items()}
