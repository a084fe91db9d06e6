"""Check of the leg exchange of a planar robot, and search for the exchange that a faulty one is meant to be."""

import itertools
from collections.abc import Iterator

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from gaitopt.model.planar.mirror import Mirror
from gaitopt.model.planar.planar_robot import PlanarRobot

Vector = NDArray[np.float64]

NEGLIGIBLE = 1e-12
"""Least derivative of a gap or slide coordinate by a coordinate that is not a rounding error."""

EXACT, DIFFERENCED = 1e-9, 1e-6
"""Largest relative errors of a correct robot: of identities, and of derivatives against differences."""

MOST_UNPAIRED = 8
"""Largest number of coordinates without partner for which exchanges of two pairs of them are tried."""


def measure_mirror_errors(
    robot: PlanarRobot, mirror: Mirror | None, q: Vector, v: Vector, p: Vector
) -> dict[str, float]:
    """Return the relative change of each part of the equations by an exchange of the legs; empty without one.

    Examples
    --------
    >>> from gaitopt.model.robots.kneed_walker import kneed_walker
    >>> robot = kneed_walker()
    >>> state = np.full(robot.n_q, 0.3)
    >>> max(measure_mirror_errors(robot, robot.mirror, state, state, robot.vector(robot.resolve({}))).values()) < EXACT
    True
    """
    if mirror is None:
        return {}
    place, coordinates = list(mirror.contacts), mirror.coordinates
    mass, bias, actuation = evaluate(robot.dynamics, q, v, p)
    gaps, slides = evaluate(robot.gaps, q, p)
    expected = {
        "mass matrix": coordinates @ mass @ coordinates.T,
        "bias forces": coordinates @ bias,
        "actuation": coordinates @ actuation @ mirror.actuators.T,
        "gaps": gaps[place],
        "slide coordinates": slides[place],
    }
    mirrored = coordinates @ q, coordinates @ v
    actual = evaluate(robot.dynamics, *mirrored, p) + evaluate(robot.gaps, mirrored[0], p)
    parts = zip(expected.items(), actual, strict=True)
    return {name: relative_difference([one], [other]) for (name, one), other in parts if one.size}


def describe_mirror_fault(robot: PlanarRobot, q: Vector, v: Vector, p: Vector, change: float) -> str:
    """Return a sentence on what a faulty mirror changes and which entries are wrong, and the mirror that is correct.

    Parameters
    ----------
    robot : PlanarRobot
    q, v, p : arrays
        A state in which the mirror is wrong, and the parameters.
    change : float
        Largest relative change in all states.

    Examples
    --------
    >>> from gaitopt.model.robots.kneed_walker import kneed_walker
    >>> robot, rest = kneed_walker(), np.zeros(6)
    >>> describe_mirror_fault(robot, rest, rest, robot.vector(robot.resolve({})), 0.1).partition(" (")[0]
    'the mirror must not change the equations, but changes them in some states'
    """
    mirror = robot.mirror
    errors = measure_mirror_errors(robot, mirror, q, v, p)
    changed = ", ".join(name for name, error in errors.items() if not error < EXACT) or "them in some states"
    sentence = f"the mirror must not change the equations, but changes {changed} (relative change {change:.3g})"
    if mirror is None:
        return f"{sentence}."
    correct = _find_mirror(robot, mirror, [(q, v), (0.9 * q[::-1] + 0.05, v[::-1])], p)
    misfit = _describe_misfit(robot, mirror, q, v, p)
    if correct is not None:
        entries = ", ".join(f"{name!r}: {partner!r}" for name, partner in _list_entries(robot, correct).items())
        return f"{sentence}.{misfit} The check passes with mirror={{{entries}}}."
    return (
        f"{sentence}. It must contain every coordinate, contact and actuator that is exchanged or changes its sign."
        f"{misfit} No other tested exchange of coordinates passes either: compare masses, lengths, directions and "
        "actuators of the two legs."
    )


def _find_mirror(robot: PlanarRobot, mirror: Mirror, states: list[tuple[Vector, Vector]], p: Vector) -> Mirror | None:
    """Return the first correct mirror with the same or another exchange of coordinates; None if there is none."""
    q, v = states[0]
    for coordinates in _list_exchanges(robot, mirror.coordinates):
        if np.array_equal(coordinates, np.eye(robot.n_q)):
            continue  # no exchange of legs
        contacts = _match_contacts(robot, coordinates, mirror.contacts, q, p)
        actuators = _match_actuators(robot, coordinates, mirror.actuators, (q, v), p)
        if contacts is None or actuators is None:
            continue
        candidate = Mirror(coordinates, actuators, contacts)
        errors = (measure_mirror_errors(robot, candidate, *state, p).values() for state in states)
        if all(error < EXACT for error in itertools.chain.from_iterable(errors)):
            return candidate
    return None


def _list_exchanges(robot: PlanarRobot, present: Vector) -> Iterator[Vector]:
    """Yield the present map of the coordinates, those with one other pair or sign, and those with two other pairs."""
    yield present
    names = robot.coordinates
    numbers = [i for i, name in enumerate(names) if name != robot.travel]
    pairs = [(i, j) for i, j in itertools.combinations(numbers, 2) if robot.units[i] == robot.units[j]]
    unpaired = [i for i in numbers if present[i, i] == 1]
    for i, j in sorted(pairs, key=lambda pair: -sum(k in unpaired for k in pair)):
        for sign in (1.0, -1.0):
            yield _exchange(present, i, j, sign)
    for i in numbers:
        if present[i, i]:
            yield _exchange(present, i, i, -present[i, i])
    if len(unpaired) <= MOST_UNPAIRED:
        missing = [pair for pair in pairs if set(pair) <= set(unpaired)]
        for one, other in itertools.combinations(missing, 2):
            if not set(one) & set(other):
                yield _exchange(_exchange(present, *one, 1.0), *other, 1.0)


def _exchange(present: Vector, i: int, j: int, sign: float) -> Vector:
    """Return a map with an exchange of two coordinates; their former partners are unchanged."""
    changed = present.copy()
    for k in {i, j}:
        for former in np.flatnonzero(present[k]):
            changed[former], changed[:, former] = 0.0, 0.0
            changed[former, former] = 1.0
    for k in {i, j}:
        changed[k], changed[:, k] = 0.0, 0.0
    changed[i, j] = changed[j, i] = sign
    return changed


def _match_contacts(
    robot: PlanarRobot, coordinates: Vector, present: tuple[int, ...], q: Vector, p: Vector
) -> tuple[int, ...] | None:
    """Return the contact onto whose place each contact moves, the present one if possible; None if there is none."""
    before, after = (np.hstack(evaluate(robot.gaps, place, p)) for place in (q, coordinates @ q))
    matches = np.max(np.abs(after[:, None] - before[None]), axis=2, initial=0.0) < EXACT * (1 + np.abs(before).max())
    places = [i if matches[k, i] else int(np.argmax(matches[k])) for k, i in enumerate(present)]
    is_matched = all(matches[k, i] for k, i in enumerate(places))
    return tuple(places) if is_matched and len({*places}) == len(places) else None


def _match_actuators(
    robot: PlanarRobot, coordinates: Vector, present: Vector, state: tuple[Vector, Vector], p: Vector
) -> Vector | None:
    """Return the map of the torques that fits a map of the coordinates; None if there is none."""
    q, v = state
    expected = coordinates @ evaluate(robot.dynamics, q, v, p)[2]
    actual = evaluate(robot.dynamics, coordinates @ q, coordinates @ v, p)[2]
    matrix = np.zeros_like(present)
    for k in range(robot.n_u):
        order = sorted(range(robot.n_u), key=lambda j: -abs(present[k, j]))
        fits = (
            (j, sign)
            for j in order
            for sign in (1.0, -1.0)
            if np.max(np.abs(actual[:, k] - sign * expected[:, j])) < EXACT * (1 + np.max(np.abs(actual[:, k])))
        )
        j, sign = next(fits, (k, 0.0))
        matrix[k, j] = sign
    return matrix if np.all(np.abs(matrix).sum(axis=0) == 1) else None


def _list_entries(robot: PlanarRobot, mirror: Mirror) -> dict[str, str]:
    """Return a mirror as the argument of `assemble_planar`."""
    contacts = np.zeros((len(mirror.contacts), len(mirror.contacts)))
    contacts[np.arange(len(mirror.contacts)), list(mirror.contacts)] = 1.0
    tables = (
        (robot.coordinates, mirror.coordinates),
        (robot.contact_names, contacts),
        (robot.actuators, mirror.actuators),
    )
    entries = {}
    for names, matrix in tables:
        for i, j in np.argwhere(matrix):
            if i <= j and not (i == j and matrix[i, j] == 1):
                entries[names[i]] = f"{'-' if matrix[i, j] < 0 else ''}{names[j]}"
    return entries


def _describe_misfit(robot: PlanarRobot, mirror: Mirror, q: Vector, v: Vector, p: Vector) -> str:
    """Return the coordinates, contacts or actuators that the mirror exchanges wrongly, as the end of a sentence.

    A missing coordinate is named first, since it moves correct contacts away from their partners.
    """
    missing = _find_missing_coordinates(robot, mirror, q, v, p)
    if missing:
        return f" Coordinates missing from the mirror: {', '.join(missing)}."
    unexchanged, wrong = _find_unfit_contacts(robot, mirror, q, p)
    if unexchanged:
        return f" Contacts missing from the mirror: {', '.join(unexchanged)}."
    if wrong:
        return f" Contacts with a wrong partner: {', '.join(wrong)}."
    actuators = _find_unfit_actuators(robot, mirror, q, v, p)
    return f" Wrong entries: {', '.join(actuators)}." if actuators else ""


def _find_missing_coordinates(robot: PlanarRobot, mirror: Mirror, q: Vector, v: Vector, p: Vector) -> list[str]:
    """Return the coordinates that the mirror leaves unchanged although one of two exchanged contacts depends on them.

    The mirror must map the coordinates on which a contact depends to those on which its partner depends.
    """
    rows = evaluate(robot.rows, q, v, p)
    depends = (np.abs(rows[0]) + np.abs(rows[1])) > NEGLIGIBLE
    expected = depends @ np.abs(mirror.coordinates).T > 0
    differs = expected != depends[list(mirror.contacts)]
    exchanged = np.array(mirror.contacts) != np.arange(len(mirror.contacts))
    unchanged = np.diag(mirror.coordinates) == 1
    wrong = np.any(differs[exchanged], axis=0) & unchanged
    return [repr(name) for name, is_wrong in zip(robot.coordinates, wrong, strict=True) if is_wrong]


def _find_unfit_contacts(robot: PlanarRobot, mirror: Mirror, q: Vector, p: Vector) -> tuple[list[str], list[str]]:
    """Return the contacts that the mirror wrongly leaves unchanged, and those that have a wrong partner."""
    gaps, mirrored = (evaluate(robot.gaps, place, p)[0].ravel() for place in (q, mirror.coordinates @ q))
    unfit = np.abs(mirrored - gaps[list(mirror.contacts)]) > DIFFERENCED
    names = robot.contact_names
    unexchanged = [repr(names[i]) for i in np.flatnonzero(unfit) if mirror.contacts[i] == i]
    return unexchanged, [repr(names[i]) for i in np.flatnonzero(unfit) if mirror.contacts[i] != i]


def _find_unfit_actuators(robot: PlanarRobot, mirror: Mirror, q: Vector, v: Vector, p: Vector) -> list[str]:
    """Return the actuators whose torque the mirror does not exchange, with a hint on the sign."""
    coordinates = mirror.coordinates
    actual = evaluate(robot.dynamics, coordinates @ q, coordinates @ v, p)[2]
    expected = coordinates @ evaluate(robot.dynamics, q, v, p)[2] @ mirror.actuators.T
    hints = []
    for number, name in enumerate(robot.actuators):
        one, other = actual[:, number], expected[:, number]
        if np.max(np.abs(one - other), initial=0.0) > EXACT * (1 + np.max(np.abs(one), initial=0.0)):
            reversed_sign = np.max(np.abs(one + other), initial=0.0) < EXACT * (1 + np.max(np.abs(one), initial=0.0))
            missing = ", which is missing from the mirror" if mirror.actuators[number, number] == 1 else ""
            hints.append(
                f"actuator {name!r}" + (", whose sign in the mirror must be reversed" if reversed_sign else missing)
            )
    return hints


def relative_difference(expected: list[Vector], actual: list[Vector]) -> float:
    """Return the largest relative difference between arrays.

    Examples
    --------
    >>> round(relative_difference([np.ones(2)], [np.array([1.0, 1.1])]), 3)
    0.1
    """
    pairs = [(one, other) for one, other in zip(expected, actual, strict=True) if one.size]
    return max(float(np.max(np.abs(one - other)) / (np.max(np.abs(one)) + 1e-3)) for one, other in pairs)


def evaluate(function: ca.Function, *inputs: Vector) -> list[Vector]:
    """Return the results of a function as arrays.

    Examples
    --------
    >>> x = ca.SX.sym("x")
    >>> evaluate(ca.Function("f", [x], [2 * x]), np.ones(1))[0].item()
    2.0
    """
    return [np.array(part, dtype=float) for part in function.call(list(inputs))]
