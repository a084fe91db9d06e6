"""The physics of a robot as numbers: its Functions at fixed states, to compare robots by.

Names, drawing, process and order of operations do not matter.  The numbers themselves are kept and compared within a
tolerance; a hash of them would depend on the last digit.
"""

import math
import weakref
from collections.abc import Iterator, Mapping

import casadi as ca
import numpy as np

from gaitopt.model.physics_samples import Array, PhysicsSamples
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.parameters import Parameter

SAMPLES = 3
AGREEMENT = 1e-9
"""Largest difference of two robots with the same physics, relative to the largest entry of a quantity."""

FLOOR = 1e-3
"""Quantities below this are compared as if they had this size (SI units)."""

QUANTITIES: Mapping[str, tuple[str, ...]] = {
    "mass": ("total mass",),
    "dynamics": ("mass matrix", "bias forces", "actuation matrix"),
    "energy": ("kinetic energy", "potential energy"),
    "momentum": ("linear momentum", "angular momentum"),
    "force_powers": ("elastic energy", "damping power"),
    "wellposed": ("well-posedness of slip",),
    "landing": ("position of the landing foot", "velocity of the landing foot", "Jacobian of the landing foot"),
    "impact": ("momentum balance of the impact", "velocity of the landing foot after the impact"),
    "collision": ("approach of the landing foot", "mobility of the landing foot", "rates per unit impulse"),
    "touchdown": ("touchdown guard", "rate of the touchdown guard", "condition that arms the touchdown"),
    "swap": ("angles after the leg exchange", "rates after the leg exchange"),
    "unswap": ("rates before the leg exchange",),
    "upright": ("condition for standing upright",),
    "joint_rates": ("joint rates",),
    "gaps": ("gaps of the contacts", "slide coordinates of the contacts"),
    "rows": ("gradients of the gaps", "gradients of the slide coordinates", "normal bias", "tangential bias"),
    "arming": ("conditions that arm the contacts",),
    "switch_guards": ("guards of the switched springs",),
}
"""Functions of a robot that are its physics, and names of their outputs; a robot has some of them."""

ACCELERATION = ("acceleration", "contact force")

SWITCH = 0.5
"""Value of the switches of springs at the sampled states, where both rest lengths count."""

AnyRobot = Robot | PlanarRobot

_SAMPLED: "weakref.WeakKeyDictionary[AnyRobot, PhysicsSamples]" = weakref.WeakKeyDictionary()


def physics_of(robot: AnyRobot) -> PhysicsSamples:
    """Return the physical quantities of a robot at the default states, computed once.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> physics_of(compass_biped()) is physics_of(compass_biped())
    True
    """
    if robot not in _SAMPLED:
        _SAMPLED[robot] = sample_physics(robot)
    return _SAMPLED[robot]


def sample_physics(robot: AnyRobot, points: Mapping[str, Array] | None = None) -> PhysicsSamples:
    """Return the physical quantities of a robot at a few states.

    Parameters
    ----------
    robot : Robot or PlanarRobot
    points : mapping, optional
        States of other samples; by default fixed states and parameters near their defaults.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> sorted(sample_physics(compass_biped()).points)[:4]
    ['friction', 'gravity', 'hip_mass', 'impulse']
    """
    points = dict(_points(robot) if points is None else points)
    columns: dict[str, list[Array]] = {}
    for k in range(next(iter(points.values())).shape[-1]):
        for name, value in _evaluate(robot, {name: values[..., k] for name, values in points.items()}):
            columns.setdefault(name, []).append(np.asarray(value, dtype=float).ravel(order="F"))
    return PhysicsSamples(points, {name: np.column_stack(values) for name, values in columns.items()})


def _evaluate(robot: AnyRobot, point: Mapping[str, Array]) -> Iterator[tuple[str, ca.DM]]:
    """Yield the physical quantities of a robot at one state."""
    switches = [SWITCH] * len(getattr(robot, "switches", ()))
    p = np.array([point[parameter.name] for parameter in robot.parameters] + switches)
    known = {**point, "p": p, "v_minus": point["v"], "v_plus": point["w"], "v_next": point["w"]}
    for field, labels in QUANTITIES.items():
        if hasattr(robot, field):
            yield from _call(getattr(robot, field), labels, known)
    for mode, function in getattr(robot, "acceleration", {}).items():
        yield from _call(function, [f"{label} ({mode.value})" for label in ACCELERATION], known)


def _call(
    function: ca.Function, labels: tuple[str, ...] | list[str], known: Mapping[str, Array]
) -> Iterator[tuple[str, ca.DM]]:
    outputs = function.call([ca.DM(known[name]) for name in function.name_in()])
    for number, output in enumerate(outputs):
        yield labels[number] if number < len(labels) else f"{function.name()} {number}", output


def _points(robot: AnyRobot) -> dict[str, Array]:
    """Return the states: fractional parts of multiples of irrational numbers, the same on every machine."""
    sizes = {"q": robot.n_q, "v": robot.n_q, "u": robot.n_u, "w": robot.n_q, "impulse": 2}
    spread = {"q": 0.6, "v": 2.0, "u": 5.0, "w": 2.0, "impulse": 3.0}
    points, row = {}, 0
    for name, size in sizes.items():
        points[name] = spread[name] * np.array([_irregular(row + i) for i in range(size)]).reshape(size, SAMPLES)
        row += size
    for parameter in robot.parameters:
        points[parameter.name] = np.array([_near_default(parameter, share) for share in _irregular(row)])
        row += 1
    for parameter in robot.parameters:
        if parameter.at_most:
            points[parameter.name] = np.minimum(points[parameter.name], points[parameter.at_most])
    return points


def _irregular(row: int) -> Array:
    """Return numbers between -1 and 1."""
    multiples = math.sqrt(2) * (row + 1) * np.arange(1, SAMPLES + 1) + math.sqrt(3) * (row + 1)
    return np.asarray(2 * (multiples % 1) - 1, dtype=float)


def _near_default(parameter: Parameter, share: float) -> float:
    """Return a value of a parameter within its bounds and up to a tenth from its default."""
    default = parameter.default
    if parameter.whole:
        return default
    if math.isinf(default):
        default = 0.5
    value = default * (1 + 0.1 * share) if default else 0.1 * share
    return min(max(value, parameter.lower), parameter.upper)


def find_differences(expected: PhysicsSamples, robot: AnyRobot) -> tuple[str, ...]:
    """Return what differs between the physics of a robot and samples of another's; nothing if they agree within 1e-9.

    Parameters
    ----------
    expected : PhysicsSamples
    robot : Robot or PlanarRobot

    Returns
    -------
    tuple of str
        Names of quantities, each with its largest relative difference, the elementary ones first.

    Examples
    --------
    >>> from gaitopt import compass_biped, rimless_wheel
    >>> find_differences(sample_physics(compass_biped()), compass_biped())
    ()
    >>> find_differences(sample_physics(compass_biped()), rimless_wheel())
    ('number of angles (1 instead of 2)', 'number of actuators (0 instead of 2)')
    """
    shape = _shape_differences(expected, robot)
    if shape:
        return shape
    sampled = sample_physics(robot, expected.points).values
    differences = []
    for name in dict.fromkeys([*expected.values, *sampled]):
        reference, actual = expected.values.get(name), sampled.get(name)
        if reference is None or actual is None or reference.shape != actual.shape:
            differences.append(f"{name} (of another size)")
        elif not (difference := _difference(reference, actual)) <= AGREEMENT:
            differences.append(f"{name} (by {100 * difference:.2g} %)" if math.isfinite(difference) else name)
    return tuple(differences)


def _shape_differences(expected: PhysicsSamples, robot: AnyRobot) -> tuple[str, ...]:
    """Return differences in the numbers of angles and actuators and in the names of parameters."""
    points = expected.points
    differences = [
        f"number of {kind} ({actual} instead of {reference})"
        for kind, actual, reference in (
            ("angles", robot.n_q - 2, points["q"].shape[0] - 2)
            if isinstance(robot, Robot)
            else ("coordinates", robot.n_q, points["q"].shape[0]),
            ("actuators", robot.n_u, points["u"].shape[0]),
        )
        if actual != reference
    ]
    if differences:
        return tuple(differences)
    named = {parameter.name for parameter in robot.parameters}
    known = set(points) - {"q", "v", "u", "w", "impulse"}
    lacking = [f"no parameter {name!r}" for name in sorted(known - named)]
    return tuple(lacking + [f"a further parameter {name!r}" for name in sorted(named - known)])


def _difference(expected: Array, actual: Array) -> float:
    """Return the largest difference over the size of a quantity, sample by sample."""
    same = (expected == actual) | (np.isnan(expected) & np.isnan(actual))
    if not np.all(np.isfinite(expected[~same])) or not np.all(np.isfinite(actual[~same])):
        return math.inf
    if not expected.size:
        return 0.0
    gap = np.where(same, 0.0, np.abs(np.where(same, 0.0, expected) - np.where(same, 0.0, actual)))
    sizes = np.maximum(np.abs(np.where(np.isfinite(expected), expected, 0.0)), FLOOR).max(axis=0)
    return float(np.max(gap / sizes))
