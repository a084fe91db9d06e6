"""Checks of the expressions of a robot before its assembly: their shapes, constants and symbols."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields
from typing import Any

import casadi as ca

from gaitopt.errors import NAN_CAUSES, InputError
from gaitopt.model.contacts.contact import ArcContact, Contact, PointContact

PLACES = ("position", "centre")
"""Fields of bodies and contacts that are points of the plane."""

LONGEST_EXPRESSION = 80
"""Number of characters up to which a message quotes an expression."""

Expressions = Mapping[str, ca.SX | float]
"""Expressions by the labels of error messages."""

Labelled = tuple[dict[str, ca.SX | float], dict[str, ca.SX | float]]
"""Points and scalar expressions of a robot by the labels of error messages."""


def label_parts(bodies: Sequence[Any], forces: Sequence[Any], contacts: Mapping[str, Any]) -> Labelled:
    """Return the points and the scalar expressions of bodies, forces and contacts, the latter by their labels.

    Examples
    --------
    >>> from gaitopt.model import PointMass
    >>> label_parts([PointMass(2.0, ca.SX(2, 1))], [], {})
    ({'position of body 1': SX([00, 00])}, {'mass of body 1': 2.0})
    """
    owners = {f"body {number}": part for number, part in enumerate(bodies, start=1)}
    owners |= {f"force {number}": part for number, part in enumerate(forces, start=1)}
    points: dict[str, ca.SX | float] = {}
    scalars: dict[str, ca.SX | float] = {}
    for owner, part in (owners | dict(contacts)).items():
        for name, value in _list_expressions(part).items():
            (points if name in PLACES else scalars)[f"{name} of {owner}"] = value
    return points, scalars


def _list_expressions(part: Any) -> dict[str, ca.SX | float]:
    """Return the expressions among the fields of a part; of a contact of a custom class, its coordinates."""
    if isinstance(part, Contact) and type(part) not in (PointContact, ArcContact):
        values = {"gap": part.gap, "slide coordinate": part.slide, "armed": part.armed}
    else:
        values = {entry.name: getattr(part, entry.name) for entry in fields(part)}
    return {name: value for name, value in values.items() if value is not None and not isinstance(value, str | bool)}


def check_shapes(robot: str, points: Expressions, scalars: Expressions) -> None:
    """Raise InputError if a point of a robot does not have two entries, or another expression is not a scalar.

    Examples
    --------
    >>> hip = ca.SX.sym("hip", 2)
    >>> check_shapes("hopper", {"position of contact 'foot'": ca.vertcat(hip, 0)}, {})
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: Robot 'hopper': position of contact 'foot' must be a point of the plane, ca.vertcat(x, \
y) of shape (2, 1), got shape (3, 1): [hip_0, hip_1, 0].
    """
    for expressions, shape, kind in (
        (points, (2, 1), "a point of the plane, ca.vertcat(x, y) of shape (2, 1)"),
        (scalars, (1, 1), "a single expression or number of shape (1, 1)"),
    ):
        for what, value in expressions.items():
            expression = value if isinstance(value, ca.SX) else ca.SX(value)
            if expression.shape != shape:
                text = str(expression)
                quoted = f": {text}" if len(text) <= LONGEST_EXPRESSION else ""
                raise InputError(f"Robot {robot!r}: {what} must be {kind}, got shape {expression.shape}{quoted}.")


def check_constants(robot: str, expressions: Expressions) -> None:
    """Raise InputError if an expression of a robot contains nan.

    Examples
    --------
    >>> angle = ca.SX.sym("angle")
    >>> check_constants("pendulum", {"position of body 1": ca.vertcat(math.sin(angle), 0)})  # doctest: +ELLIPSIS
    Traceback (most recent call last):
    ...
    gaitopt.errors.InputError: Robot 'pendulum': position of body 1 contains nan: either a number in it is nan, or ...
    """
    if not contains_nan(ca.veccat(*expressions.values())):
        return
    wrong = next(what for what, expression in expressions.items() if contains_nan(ca.SX(expression)))
    raise InputError(f"Robot {robot!r}: {wrong} contains nan: {NAN_CAUSES}.")


def contains_nan(expression: ca.SX) -> bool:
    """Return whether a constant of an expression is nan.

    Examples
    --------
    >>> contains_nan(2 * ca.SX.sym("x")), contains_nan(math.nan * ca.SX.sym("x"))
    (False, True)
    """
    return any(math.isnan(constant) for constant in list_constants(expression))


def list_constants(expression: ca.SX) -> list[float]:
    """Return the constants of an expression in the order of its evaluation.

    Examples
    --------
    >>> list_constants(ca.SX.sym("x") + 3)
    [3.0]
    """
    function = ca.Function("expression", [], [expression], {"allow_free": True})
    steps = range(function.n_instructions())
    return [function.instruction_constant(step) for step in steps if function.instruction_id(step) == ca.OP_CONST]


def check_symbols(robot: str, expressions: Expressions, coordinates: Any, advice: str) -> None:
    """Raise InputError if an expression contains symbols other than those of the coordinates.

    Parameters
    ----------
    robot : str
    expressions : mapping of str to SX
        Expressions by label; only `armed` may depend on rates.
    coordinates : Coordinates or PlanarCoordinates
    advice : str
        The expressions of the coordinates that are accepted, for the message.
    """
    q, p = coordinates.q, coordinates.p
    if len(ca.symvar(ca.veccat(q, p, *expressions.values()))) == q.numel() + p.numel():
        return
    placed, moving = (
        {symbol.element_hash() for symbol in ca.symvar(ca.vertcat(q, p, *rates))} for rates in ([], [coordinates.v])
    )
    for what, expression in expressions.items():
        known = moving if what.startswith("armed") else placed
        for symbol in ca.symvar(ca.vec(ca.SX(expression))):
            if symbol.element_hash() not in known:
                raise InputError(
                    f"Robot {robot!r}: {what} depends on a symbol {symbol.name()!r} that does not belong to its "
                    f"{type(coordinates).__name__}: use {advice}."
                )
