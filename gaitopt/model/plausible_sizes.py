"""Implausible sizes of a robot: lengths, masses, gravity and inertia that suggest another unit."""

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from gaitopt.parameters import Parameter

LONGEST, SHORTEST, HEAVIEST, LIGHTEST, STRONGEST = 20.0, 1e-3, 1000.0, 1e-3, 100.0
"""Largest plausible length [m], least plausible size of a robot [m], largest plausible mass of a part [kg], least
plausible mass of a robot [kg], and largest plausible gravity [m/s^2]."""

FARTHEST = 10.0
"""Largest plausible step length over the largest length of its robot; a robot may fly during a step."""

WIDEST = 3.0
"""Largest plausible radius of gyration of a body over the largest length of its robot."""

OTHER_UNITS = {
    "m": (("cm", 1e-2), ("mm", 1e-3), ("km", 1e3)),
    "kg": (("g", 1e-3), ("t", 1e3)),
    "m/s^2": (("cm/s^2", 1e-2), ("mm/s^2", 1e-3)),
}
"""Other units of a quantity and their sizes in its SI unit."""

USUAL = {"m": (0.02, 2.0), "kg": (0.1, 200.0), "m/s^2": (1.0, 30.0)}
"""Usual values of a quantity: the likely unit is the first one in which a value is usual."""


def report_implausible_sizes(robot: Any, values: Mapping[str, float], step_length: float = 0.0) -> tuple[str, ...]:
    """Return a sentence for each size of a robot, and for its step, that is implausible, with the likely unit.

    Lengths, masses, gravity and moments of inertia that are parameters are named; lengths that are numbers of the
    script are found by the distances between the points of the drawing, and moments of inertia by the mass matrix.

    Parameters
    ----------
    robot : Robot or PlanarRobot
    values : mapping of str to float
        Values of all parameters.
    step_length : float, optional
        Least step length [m].

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> print(*report_implausible_sizes(compass_biped(), compass_biped().resolve({"leg_length": 900})))
    leg_length = 900 m is implausible: lengths of a robot are at most 20 m. If the value is in mm, state 0.9 m.
    """
    stated = (*_report_limits(robot.parameters, values), *_report_totals(robot, values))
    if any(" m is implausible" in sentence for sentence in stated):
        return stated  # the geometry repeats the parameter
    length = max((abs(value) for _, value in _select(robot.parameters, values, "m")), default=0.0)
    q, extent = _measure_extent(robot, values)
    if extent > LONGEST:
        return (
            *stated,
            f"Robot {robot.name!r}: the points of its drawing are up to {extent:.3g} m apart; lengths must be in m.",
        )
    size = max(length, extent)
    wide = _report_inertias(robot.parameters, values, size) or _report_mass_matrix(robot, values, q, size)
    return (*stated, *wide, *_report_step(step_length, size))


def _report_limits(parameters: Sequence[Parameter], values: Mapping[str, float]) -> list[str]:
    """Return a sentence for each parameter beyond the largest plausible value of its unit."""
    limits = (
        ("m", LONGEST, "lengths of a robot are"),
        ("kg", HEAVIEST, "masses of the parts of a robot are"),
        ("m/s^2", STRONGEST, "gravitational accelerations are"),
    )
    return [
        f"{name} = {value:.6g} {unit} is implausible: {quantity} at most {limit:g} {unit}.{name_unit(value, unit)}"
        for unit, limit, quantity in limits
        for name, value in _select(parameters, values, unit)
        if abs(value) > limit and math.isfinite(value)
    ] + [
        f"{name} = {value:.6g} m/s^2 is implausible: gravity points down if the value is positive. State {-value:.6g} "
        "m/s^2."
        for name, value in _select(parameters, values, "m/s^2")
        if name == "gravity" and value < 0
    ]


def _report_totals(robot: Any, values: Mapping[str, float]) -> list[str]:
    """Return a sentence if the largest length is too small, or the total mass too small or too large."""
    sentences = []
    lengths = [(abs(value), name) for name, value in _select(robot.parameters, values, "m")]
    if lengths and 0 < max(lengths)[0] < SHORTEST:
        value, name = max(lengths)
        sentences.append(
            f"{name} = {value:.6g} m is implausible: the largest length of a robot is at least {SHORTEST:g} m."
            + name_unit(value, "m")
        )
    mass = float(robot.mass(_vector(robot, values)))
    stated = [value for _, value in _select(robot.parameters, values, "kg")]
    if mass > HEAVIEST * (1 + len(stated)) and max(stated, default=0.0) <= HEAVIEST:  # numbers of the script
        sentences.append(
            f"Robot {robot.name!r}: the total mass of {mass:.4g} kg is implausible: masses of the parts of a robot are "
            f"at most {HEAVIEST:g} kg. Masses must be in kg."
        )
    if 0 < mass < LIGHTEST:
        sentences.append(
            f"The total mass of {mass:.3g} kg is implausible: it is at least {LIGHTEST:g} kg.{name_unit(mass, 'kg')}"
        )
    return sentences


def _report_inertias(parameters: Sequence[Parameter], values: Mapping[str, float], size: float) -> list[str]:
    """Return a sentence for each moment of inertia that is too large for the mass of the same name."""
    masses = dict(_select(parameters, values, "kg"))
    sentences = []
    for name, inertia in _select(parameters, values, "kg m^2"):
        mass = masses.get(name.replace("inertia", "mass"), 0.0)
        radius = math.sqrt(abs(inertia) / mass) if mass > 0 else 0.0
        if size > 0 and radius > WIDEST * size:
            sentences.append(
                f"{name} = {inertia:.6g} kg m^2 is implausible: with a mass of {mass:.6g} kg the radius of gyration is "
                f"{radius:.3g} m, but the largest length of the robot is {size:.3g} m."
                + _name_inertia_unit(inertia, radius / size)
            )
    return sentences


def _report_mass_matrix(robot: Any, values: Mapping[str, float], q: np.ndarray, size: float) -> list[str]:
    """Return a sentence for the angle whose inertia is too large for the mass and the size of the robot."""
    p = _vector(robot, values)
    mass = float(robot.mass(p))
    inertias = np.diag(np.asarray(robot.dynamics(q, np.zeros(q.size), p)[0]))
    names, units = _list_coordinates(robot)
    for name, unit, inertia in zip(names, units, inertias, strict=True):
        radius = math.sqrt(max(inertia, 0.0) / mass) if mass > 0 else 0.0
        if unit == "rad" and size > 0 and radius > WIDEST * size:
            return [
                f"Robot {robot.name!r}: the inertia {inertia:.3g} kg m^2 of coordinate {name!r} is implausible: with "
                f"the total mass of {mass:.3g} kg the radius of gyration is {radius:.3g} m, but the largest length of "
                f"the robot is {size:.3g} m. Inertias must be in kg m^2 and masses in kg."
            ]
    return []


def _report_step(step_length: float, size: float) -> list[str]:
    """Return a sentence if a step is too long for the size of the robot."""
    if not 0 < FARTHEST * size < step_length:
        return []
    return [
        f"step_length = {step_length:.6g} m is implausible: the largest length of the robot is {size:.3g} m."
        + name_unit(step_length, "m")
    ]


def _measure_extent(robot: Any, values: Mapping[str, float]) -> tuple[np.ndarray, float]:
    """Return a pose and the largest distance of drawn points in it [m]; telescopic legs have lengths of about 1 m."""
    units = _list_coordinates(robot)[1]
    shares = 0.2 + 0.6 * (np.arange(len(units)) * 0.618 % 1)  # different angles and lengths
    q = np.where([unit == "m" for unit in units], 0.5 + shares, shares)
    points = np.asarray(robot.figure(q, _vector(robot, values)))
    extent = float(np.max(np.linalg.norm(points[:, :, None] - points[:, None, :], axis=0), initial=0.0))
    return q, extent


def _list_coordinates(robot: Any) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return names and units of the coordinates."""
    if hasattr(robot, "units"):
        return robot.coordinates, robot.units
    return ("x", "y", *robot.angles), ("m", "m", *("rad" for _ in robot.angles))


def _select(parameters: Sequence[Parameter], values: Mapping[str, float], unit: str) -> list[tuple[str, float]]:
    return [(each.name, values[each.name]) for each in parameters if each.unit == unit]


def name_unit(value: float, unit: str) -> str:
    """Return a sentence with the unit in which a value is usual; empty if there is none.

    Examples
    --------
    >>> name_unit(5.0, "m"), name_unit(0.0, "m")
    (' If the value is in cm, state 0.05 m.', '')
    """
    low, high = USUAL[unit]
    for name, size in OTHER_UNITS[unit]:
        if low <= abs(value) * size <= high:
            return f" If the value is in {name}, state {value * size:.6g} {unit}."
    return ""


def _name_inertia_unit(inertia: float, ratio: float) -> str:
    """Return a sentence with the unit in which the radius of gyration is at most the size; `ratio` is that in SI."""
    for unit, factor in (("kg cm^2", 1e-2), ("kg mm^2", 1e-3)):
        if ratio * factor <= 1:
            return f" If the value is in {unit}, state {inertia * factor**2:.6g} kg m^2."
    return ""


def _vector(robot: Any, values: Mapping[str, float]) -> np.ndarray:
    """Return the vector of parameters."""
    return np.asarray(robot.vector(dict(values)), dtype=float)
