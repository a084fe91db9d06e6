"""Derivatives of the optimal cost with respect to the data of a problem, from the multipliers of its solution."""

import functools
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import attrs
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.interrupts import defer_interrupt
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.certificate import Sensitivity
from gaitopt.motion.motion import Array
from gaitopt.ocp.bounds import bounds, data_vector
from gaitopt.ocp.initial.cost_prediction import evaluate_lagrangian
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.transcription.transcription import Transcription

STEP = 1e-6
"""Relative step of the finite differences of the Lagrangian, which is evaluated with rounding errors only."""

NEGLIGIBLE = 1e-7
"""Change of the objective over its typical size, per relative change of a number, that counts as zero."""


@dataclass(frozen=True)
class Number:
    """A parameter, target, limit or margin of a problem, and how it is changed.

    Attributes
    ----------
    name : str
    value : float
        SI units.
    change : callable
        Maps a value to the problem with that value.
    """

    name: str
    value: float
    change: Callable[[float], Any]


def cost_sensitivities(
    problem: GaitProblem, transcription: Transcription, x: Array, multipliers: tuple[Array, Array], data: Array
) -> tuple[Sensitivity, ...]:
    """Return the derivative of the optimal objective with respect to each number of a problem that affects it.

    It is the derivative of the Lagrangian at the solution (envelope theorem: Nocedal & Wright, Numerical Optimization,
    section 12.8), as long as the active constraints stay the same.

    Parameters
    ----------
    problem : GaitProblem
    transcription : Transcription
    x : (n_variables,) array
    multipliers : (n_variables,), (n_constraints,) arrays
    data : (n_z,) array
        Data of the NLP; those on sign changes of the joint powers are kept.

    Returns
    -------
    tuple of Sensitivity
        In order of decreasing relative effect.  Numbers without effect are omitted.
    """
    evaluate_nlp = FastCall(transcription.nlp.values)

    @functools.cache
    def evaluate_at(numbers: tuple[float, ...]) -> tuple[float, Array]:
        """Return the values of the NLP, which are the same for all changes of its bounds alone."""
        cost, rows = evaluate_nlp(x, np.concatenate([numbers, data[len(numbers) :]]))
        return cost.item(), rows.copy()

    @defer_interrupt()
    def evaluate(changed: GaitProblem) -> float:
        values = evaluate_at(tuple(data_vector(changed).tolist()))
        return evaluate_lagrangian(values, x, multipliers, bounds(transcription, changed))

    return rank_sensitivities(list_numbers(problem), evaluate, transcription.nlp.typical)


def rank_sensitivities(
    numbers: Iterable[Number], evaluate: Callable[[Any], float], typical: float
) -> tuple[Sensitivity, ...]:
    """Return the derivatives of a Lagrangian with respect to numbers, in order of decreasing relative effect.

    Parameters
    ----------
    numbers : iterable of Number
    evaluate : callable
        Maps a changed problem to the Lagrangian at the solution of the original one.
    typical : float
        Typical size of the objective; numbers with a negligible effect on it are omitted.
    """
    slopes = [Sensitivity(one.name, one.value, _differentiate(one, evaluate)) for one in numbers]
    slopes = [one for one in slopes if abs(one.derivative) * max(abs(one.value), STEP) > NEGLIGIBLE * typical]
    return tuple(sorted(slopes, key=lambda one: -abs(one.change(1.0))))


def _differentiate(number: Number, evaluate: Callable[[Any], float]) -> float:
    """Return a central difference, or a one-sided difference at the end of the range of valid values."""
    step, ends, values = STEP * max(1e-3, abs(number.value)), [], []
    for end in (number.value + step, number.value - step, number.value):
        try:
            values.append(evaluate(number.change(end)))
        except InputError:
            continue
        ends.append(end)
        if len(ends) == 2:
            return (values[0] - values[1]) / (ends[0] - ends[1])
    return 0.0


def list_numbers(problem: GaitProblem) -> Iterator[Number]:
    """Yield the finite numbers of a problem: parameters of robot and ground, targets, limits and margins.

    Parameters
    ----------
    problem : GaitProblem

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, compass_biped
    >>> numbers = list_numbers(GaitProblem(robot=compass_biped(), sequence="stick | stick", limits=Limits(torque=6)))
    >>> [number.name for number in numbers if number.name.startswith("torque")]
    ['torque_limit of ankle', 'torque_limit of hip']
    """
    yield from list_parameters_and_targets(problem)
    yield from _list_limits(problem)
    if problem.stability is not None and math.isfinite(problem.stability.radius):
        change = functools.partial(change_option, problem, "stability", "radius")
        yield Number("spectral radius", problem.stability.radius, change)
    yield from list_margins(problem)


def list_parameters_and_targets(problem: Any) -> Iterator[Number]:
    """Yield the parameters of robot and ground, the targets, and the bounds of free parameters and targets.

    Parameters
    ----------
    problem : GaitProblem or PlanarProblem
    """
    for name, value in problem.parameters.items():
        if name in problem.free:
            continue
        yield Number(name, value, functools.partial(_change_parameter, problem, name))
    for name in ("friction", "slope", "speed", "step_length"):
        value = getattr(problem, name)
        if isinstance(value, float) and math.isfinite(value) and name not in problem.free:
            yield Number(name, value, functools.partial(_change_field, problem, name))
    for name, ends in problem.free_ranges.items():
        for side, value in zip(("lower", "upper"), ends, strict=True):
            yield Number(f"{side} bound of {name}", value, functools.partial(_change_bound, problem, name, side))
    for name in ("speed", "step_length"):
        target = getattr(problem, name)
        for side, value in zip(("lower", "upper"), target if isinstance(target, tuple | list) else (), strict=False):
            if math.isfinite(value):
                yield Number(f"{side} bound of {name}", value, functools.partial(_change_target, problem, name, side))


def list_margins(problem: Any) -> Iterator[Number]:
    """Yield the margins of a problem.

    Parameters
    ----------
    problem : GaitProblem or PlanarProblem
    """
    for entry in attrs.fields(type(problem.margins)):
        change = functools.partial(change_option, problem, "margins", entry.name)
        yield Number(f"{entry.name}_margin", getattr(problem.margins, entry.name), change)


def _list_limits(problem: GaitProblem) -> Iterator[Number]:
    limits, actuators, angles = problem.limits, problem.robot.actuators, problem.robot.angles
    yield from list_sizes(problem, "torque", dict(zip(actuators, limits.torques(actuators), strict=True)))
    yield from list_sizes(problem, "torque_rate", dict(zip(actuators, limits.torque_rates(actuators), strict=True)))
    yield from list_pairs(problem, "angle", dict(zip(angles, limits.angles(angles), strict=True)))
    yield from list_limit_values(problem, ("rate", "shortest_phase", "longest_step", "clearance"))


def list_sizes(problem: Any, name: str, by_name: dict[str, float]) -> Iterator[Number]:
    """Yield the values of a limit that has one for each actuator; those that are zero or infinite are omitted.

    Parameters
    ----------
    problem : GaitProblem or PlanarProblem
    name : str
        Field of the limits.
    by_name : dict of str to float
    """
    for actuator, value in by_name.items():
        if 0 < value < math.inf:
            change = functools.partial(change_entry, problem, name, by_name, actuator)
            yield Number(f"{name}_limit of {actuator}", value, change)


def list_pairs(problem: Any, name: str, pairs: dict[str, tuple[float, float]]) -> Iterator[Number]:
    """Yield the finite ends of a limit that is a pair for each coordinate.

    Parameters
    ----------
    problem : GaitProblem or PlanarProblem
    name : str
        Field of the limits.
    pairs : dict of str to (float, float)
    """
    for coordinate, ends in pairs.items():
        for side, value in zip(("lower", "upper"), ends, strict=True):
            if math.isfinite(value):
                change = functools.partial(_change_pair, problem, name, pairs, (coordinate, side))
                yield Number(f"{side} {name}_limit of {coordinate}", value, change)


def list_limit_values(problem: Any, names: tuple[str, ...]) -> Iterator[Number]:
    """Yield the finite values of limits that are one number.

    Parameters
    ----------
    problem : GaitProblem or PlanarProblem
    names : tuple of str
        Fields of the limits.
    """
    for name in names:
        value = getattr(problem.limits, name)
        if value is not None and math.isfinite(value):
            label = "rate_limit" if name == "rate" else name
            yield Number(label, value, functools.partial(change_option, problem, "limits", name))


def _change_field(problem: Any, name: str, value: float) -> Any:
    return problem.replace(**{name: value})


def _change_bound(problem: Any, name: str, side: str, value: float) -> Any:
    lower, upper = problem.free_ranges[name]
    return problem.replace(free={**problem.free, name: (value, upper) if side == "lower" else (lower, value)})


def _change_target(problem: Any, name: str, side: str, value: float) -> Any:
    lower, upper = getattr(problem, name)
    return problem.replace(**{name: (value, upper) if side == "lower" else (lower, value)})


def _change_parameter(problem: Any, name: str, value: float) -> Any:
    return problem.replace(parameters={**problem.parameters, name: value})


def change_option(problem: Any, part: str, name: str, value: object) -> Any:
    """Return the problem with one field of its limits or margins changed."""
    return problem.replace(**{part: attrs.evolve(getattr(problem, part), **{name: value})})


def change_entry(problem: Any, name: str, by_name: Mapping[str, object], key: str, value: object) -> Any:
    """Return the problem with one entry of a mapping among its limits changed."""
    return change_option(problem, "limits", name, {**by_name, key: value})


def _change_pair(
    problem: Any, name: str, pairs: dict[str, tuple[float, float]], end: tuple[str, str], value: float
) -> Any:
    """Return the problem with one end of a pair among its limits changed; `end` is a coordinate and a side."""
    lower, upper = pairs[end[0]]
    changed = (value, upper) if end[1] == "lower" else (lower, value)
    return change_entry(problem, name, pairs, end[0], changed)
