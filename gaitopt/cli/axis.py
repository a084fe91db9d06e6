"""Axes of grids as they are written on the command line, and their values in SI units."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from gaitopt.cli.script import Script
from gaitopt.continuation.parameter_values import state_degrees, unit_of
from gaitopt.errors import InputError
from gaitopt.motion.motion import Array
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.problem import GaitProblem
from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
from gaitopt.stability.walk_problem import WalkProblem

Problem = GaitProblem | PlanarProblem | WalkProblem | PlanarWalkProblem


def grid(over: Sequence[str], most: int) -> dict[str, Array]:
    """Return the values of axes by their names, each written ``NAME=FROM:TO:COUNT`` or ``NAME=VALUE,VALUE,...``.

    Raises
    ------
    InputError
        If one is not of this form or not finite, an axis is named twice, or the grid has more than `most` points.

    Examples
    --------
    >>> grid(["friction=0.1:0.3:3", "speed=0.5"], 10)
    {'friction': array([0.1, 0.2, 0.3]), 'speed': array([0.5])}
    """
    axes_read = [_read(text) for text in over]
    size = math.prod(count for _, _, count in axes_read)
    if size > most:
        raise InputError(f"--over must define at most {most} points, got {size}.")
    axes = {
        name: np.array(ends) if count == len(ends) else np.linspace(ends[0], ends[-1], count)
        for name, ends, count in axes_read
    }
    if len(axes) < len(over):
        names = [name for name, _, _ in axes_read]
        repeated = next(name for name in names if names.count(name) > 1)
        raise InputError(f"The axes of --over must be different, got {repeated!r} twice.")
    return axes


def convert_axes(script: Script, problem: Problem, axes: dict[str, Array]) -> dict[str, Array]:
    """Return axes in the units of a problem (SI, angles in rad).

    A parameter of the script has the same meaning with ``--over`` as with ``--set``: the script is called with each
    value.  Any other name, and a parameter of the script that is not a quantity of the problem, is left unchanged.

    Parameters
    ----------
    script : Script
    problem : GaitProblem, WalkProblem or one of a robot with several contacts
        What the script returns without these axes.
    axes : dict of str to (n,) array

    Raises
    ------
    InputError
        If the script returns something other than a number for a value, or changes more than this one quantity.
    ScriptError
        If the script raises an exception.
    """
    return {
        name: _convert(script, problem, name, values) if name in script.defaults and _has(problem, name) else values
        for name, values in axes.items()
    }


def unconverted_axes(script: Script, problem: Problem, axes: dict[str, Array]) -> str:
    """Return a sentence about the axes that are quantities of a problem but not parameters of its script, or ""."""
    names = [name for name in axes if name not in script.defaults and _has(problem, name)]
    if not names:
        return ""
    examples = [
        state_degrees(name, (float(axes[name][0]), float(axes[name][-1])))
        for name in names
        if unit_of(problem.robot, name) == "rad" and axes[name].size > 1
    ]
    note = (
        f"--over takes {', '.join(names)} in SI units and rad: problem() of {script.path.name} has no such parameter."
    )
    return " ".join([note, *examples])


def refuse_script_parameter(script: Script, name: str, known: Sequence[str]) -> None:
    """Raise InputError if a name is a parameter of a script but not of its robot or law, over which a branch is traced.

    Parameters
    ----------
    script : Script
    name : str
    known : sequence of str
        Parameters of the robot and gains of the law.
    """
    if name in script.defaults and name not in known:
        raise InputError(
            f"{name!r} is a parameter of {script.path.name} only, not of the robot; a branch is followed over a "
            f"parameter of the robot or a gain of the law: {', '.join(known)}."
        )


def _convert(script: Script, problem: Problem, name: str, values: Array) -> Array:
    """Return the values of one axis as converted by the script; those that it rejects follow from the others."""
    converted, refusals = np.full(values.size, math.nan), list[InputError]()
    whole = isinstance(script.defaults[name], int)
    changed = None
    for index, value in enumerate(values.tolist()):
        try:
            changed = script(**{name: int(value) if whole and value.is_integer() else value})
        except InputError as error:  # a step longer than the legs reach, for example: that point has no gait
            refusals.append(error)
            continue
        converted[index] = _number(script, changed, name)
    if changed is not None and (others := _differences(problem, changed) - {name}):
        raise InputError(
            f"--over {name}: an axis must change one quantity, but problem() of {script.path.name} also changes "
            f"{', '.join(sorted(others))}."
        )
    return _complete(values, converted, refusals[0]) if refusals else converted


def _complete(values: Array, converted: Array, refusal: InputError) -> Array:
    """Return converted values with gaps filled in by the straight line through the others, if they lie on one."""
    known = np.isfinite(converted)
    if np.array_equal(values[known], converted[known]) and known.any():
        return values
    if np.count_nonzero(known) < 2:
        raise refusal
    (left, right), (lower, upper) = values[known][[0, -1]], converted[known][[0, -1]]
    line = lower + (upper - lower) / (right - left) * (values - left)
    if not np.allclose(line[known], converted[known], rtol=1e-12, atol=0):
        raise refusal
    return np.where(known, converted, line)


def _has(problem: Problem, name: str) -> bool:
    """Return whether a problem has a quantity that can be an axis."""
    from gaitopt.study.sweeps.sweep_grid import FIELDS

    return name in problem.parameters or (isinstance(problem, GaitProblem | PlanarProblem) and name in FIELDS)


def _number(script: Script, problem: Problem, name: str) -> float:
    """Return a quantity of a problem that the script made."""
    value: Any = problem.parameters[name] if name in problem.parameters else getattr(problem, name)
    if not isinstance(value, int | float):
        raise InputError(f"--over {name}: problem() of {script.path.name} must return a number for it, got {value!r}.")
    return float(value)


def _differences(one: Problem, other: Problem) -> set[str]:
    """Return the names of what differs between two problems."""
    optimal = GaitProblem | PlanarProblem
    first, second = (
        problem.describe() if isinstance(problem, optimal) else dict(problem.parameters) for problem in (one, other)
    )
    return {key for key in first if first[key] != second[key]} - {"name", "script", "events"}


def _read(text: str) -> tuple[str, list[float], int]:
    """Return name, values and their number of an axis; of a range the ends."""
    name, equals, values = text.partition("=")
    ends, colon, count = values.rpartition(":") if ":" in values else (values, "", "")
    try:
        numbers = [float(value) for value in ends.split(":" if colon else ",")]
        number = int(count) if colon else len(numbers)
        if not equals or not name.strip() or (colon and len(numbers) != 2):
            raise ValueError
    except ValueError:
        raise InputError(
            f"An axis must have the form NAME=FROM:TO:COUNT or NAME=VALUE,VALUE,..., got {text!r}."
        ) from None
    if number < 1:
        raise InputError(f"COUNT of an axis NAME=FROM:TO:COUNT must be at least 1, got {number} in {text!r}.")
    if colon and number == 1 and numbers[0] != numbers[1]:
        raise InputError(
            f"COUNT of a range must be at least 2, got 1 in {text!r}; a single value is written {name.strip()}="
            f"{numbers[0]:g}."
        )
    if not all(map(math.isfinite, numbers)):
        raise InputError(f"An axis must have finite values, got {text!r}.")
    return name.strip(), numbers[:number], number
