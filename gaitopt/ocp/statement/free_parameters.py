"""Free parameters of a problem: robot and ground parameters that are optimised within bounds."""

import itertools
import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

from gaitopt.errors import InputError, suggest
from gaitopt.parameters import Parameter

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.model.robot import Robot

Ends = tuple[float, float]
"""Lower and upper bound of a free parameter, in its unit."""

MOST_CORNERS = 64
"""Largest number of corners of the box of free parameters that are checked."""


def separate_targets(free: object, targets: tuple[str, ...]) -> tuple[dict[str, object], dict[str, object]]:
    """Return the bounds of the design variables, and those of quantities that are fields of a problem.

    Parameters
    ----------
    free : mapping of str to (float, float)
    targets : tuple of str
        Names of the fields.

    Raises
    ------
    InputError
        If `free` is not a mapping.

    Examples
    --------
    >>> separate_targets({"mass": (1, 5), "speed": [0.5, 0.7]}, ("speed",))
    ({'mass': (1, 5)}, {'speed': (0.5, 0.7)})
    """
    if not isinstance(free, Mapping):
        raise InputError(f'free must be a mapping such as {{"leg_com": (0.4, 1.2)}}, got {free!r}.')
    pairs = {name: tuple(ends) if isinstance(ends, list) else ends for name, ends in free.items()}
    fields = {name: pairs.pop(name) for name in targets if name in pairs}
    return pairs, fields


def read_bounds(
    free: Mapping[str, object], parameters: tuple[Parameter, ...], values: Mapping[str, object], owner: str
) -> dict[str, Ends]:
    """Check the bounds of free parameters.

    Parameters
    ----------
    free : mapping of str to (float, float)
        Lower and upper bounds, in the unit of the parameter.
    parameters : tuple of Parameter
        All parameters.
    values : mapping of str to float
        Values of the parameters that are fixed.
    owner : str
        Object with these parameters, for the error message.

    Returns
    -------
    dict of str to (float, float)
        In the order of `parameters`.

    Raises
    ------
    InputError
        If a name is unknown, the bounds are not two different finite valid values in increasing order, or a parameter
        could exceed another one that it may not exceed.

    Examples
    --------
    >>> mass = Parameter("mass", 4.0, "kg", "mass", lower=0, lower_open=True)
    >>> read_bounds({"mass": (1, 5)}, (mass,), {}, "robot")
    {'mass': (1.0, 5.0)}
    """
    known = {parameter.name: parameter for parameter in parameters}
    bounds = {name: _check_bounds(name, ends, known, owner) for name, ends in free.items()}
    for name, other in ((parameter.name, parameter.at_most) for parameter in parameters):
        if other and {name, other} & set(bounds):
            largest, least = (
                bounds.get(name, (0, _value(known[name], values)))[1],
                bounds.get(other, (_value(known[other], values),))[0],
            )
            if largest > least:
                raise InputError(
                    f"free: {name} must be at most {other} for all values within the bounds, but {largest:g} exceeds "
                    f"{least:g}."
                )
    return {name: bounds[name] for name in known if name in bounds}


def _value(parameter: Parameter, values: Mapping[str, object]) -> float:
    return parameter.check(values.get(parameter.name, parameter.default))


def _check_bounds(name: str, ends: object, known: Mapping[str, Parameter], owner: str) -> Ends:
    if name not in known:
        raise InputError(f"{owner} has no parameter {name!r}. {suggest(name, known)}")
    parameter = known[name]
    if parameter.whole:
        raise InputError(f"free: {name} must stay fixed, because it is a whole number.")
    if not isinstance(ends, tuple | list) or len(ends) != 2:
        raise InputError(f"free: {name} must have two bounds (lower, upper) [{parameter.unit}], got {ends!r}.")
    lower, upper = (parameter.check(end) for end in ends)
    if not lower < upper or not math.isfinite(upper):
        raise InputError(f"free: {name} must have finite bounds, the lower below the upper, got {ends!r}.")
    return lower, upper


def check_corners(robot: "Robot | PlanarRobot", values: Mapping[str, float], free: Mapping[str, Ends]) -> None:
    """Raise InputError if a mass or an inertia of a robot is negative with its free parameters at their bounds.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> robot = compass_biped()
    >>> check_corners(robot, robot.resolve({}), {"leg_mass": (1.0, 5.0)})
    """
    for corner in list_corners(values, free) if free and robot.inertias is not None else ():
        try:
            robot.resolve(corner)
        except InputError as error:
            raise InputError(f"free: the bounds of {', '.join(free)} must be narrower. {error}") from None


def clip_values(values: Mapping[str, float], free: Mapping[str, Ends]) -> dict[str, float]:
    """Return values of which those of free parameters are moved to the nearest bound if they are outside.

    Examples
    --------
    >>> clip_values({"mass": 7.0, "length": 1.0}, {"mass": (1.0, 5.0)})
    {'mass': 5.0, 'length': 1.0}
    """
    return {
        name: min(max(value, free[name][0]), free[name][1]) if name in free else value for name, value in values.items()
    }


def fix_free_parameters(
    values: Mapping[str, float], parameters: Mapping[str, float], free: Mapping[str, Ends]
) -> dict[str, Any]:
    """Return the fields of a problem in which some parameters of robot and ground, free or not, are fixed.

    Parameters
    ----------
    values : mapping of str to float
        Values of the parameters that become fixed.
    parameters : mapping of str to float
        Present parameters of the robot.
    free : mapping of str to (float, float)
        Present bounds of the free parameters.

    Examples
    --------
    >>> fix_free_parameters({"mass": 2.0, "slope": 0.1}, {"mass": 1.0}, {"mass": (1.0, 5.0)})
    {'parameters': {'mass': 2.0}, 'free': {}, 'slope': 0.1}
    """
    ground = {name: values[name] for name in ("slope", "friction") if name in values}
    others = {name: value for name, value in values.items() if name not in ground}
    remaining = {name: ends for name, ends in free.items() if name not in values}
    return {"parameters": {**parameters, **others}, "free": remaining, **ground}


def list_corners(values: Mapping[str, float], free: Mapping[str, Ends]) -> Iterator[dict[str, float]]:
    """Yield values of all parameters: those given first, then corners of the box of the free ones.

    Examples
    --------
    >>> list(list_corners({"mass": 2.0}, {"mass": (1.0, 5.0)}))
    [{'mass': 2.0}, {'mass': 1.0}, {'mass': 5.0}]
    """
    yield dict(values)
    corners = itertools.product(*free.values()) if free else []
    for corner in itertools.islice(corners, MOST_CORNERS):
        yield {**values, **dict(zip(free, corner, strict=True))}
