"""Derivatives of the optimal cost with respect to the numbers of a problem, from the multipliers of its solution."""

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import attrs
import numpy as np

from gaitopt.errors import InputError
from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.certificate import Sensitivity
from gaitopt.motion.motion import Array
from gaitopt.ocp.bounds import bounds, data_vector
from gaitopt.ocp.initial.cost_prediction import evaluate_lagrangian, evaluate_nlp
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.transcription.transcription import Transcription

STEP = 1e-6
"""Relative step of the finite differences of the Lagrangian, which is evaluated with rounding errors only."""

NEGLIGIBLE = 1e-7
"""Change of the objective over its typical size, per relative change of a number, that counts as zero."""


@dataclass(frozen=True)
class Number:
    """A number of a problem that can be changed.

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
    change: Callable[[float], GaitProblem]


def cost_sensitivities(
    problem: GaitProblem, transcription: Transcription, x: Array, multipliers: tuple[Array, Array], data: Array
) -> tuple[Sensitivity, ...]:
    """Return the derivative of the optimal objective with respect to every number that affects it.

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

    @functools.cache
    def evaluate_at(numbers: tuple[float, ...]) -> tuple[float, Array]:
        """Return the values of the NLP, which are the same for all changes of its bounds alone."""
        return evaluate_nlp(transcription.nlp, x, np.concatenate([numbers, data[len(numbers) :]]))

    @defer_interrupt()
    def evaluate(changed: GaitProblem) -> float:
        values = evaluate_at(tuple(data_vector(changed).tolist()))
        return evaluate_lagrangian(values, x, multipliers, bounds(transcription, changed))

    numbers = [Sensitivity(one.name, one.value, _differentiate(one, evaluate)) for one in list_numbers(problem)]
    least = NEGLIGIBLE * transcription.nlp.typical
    numbers = [one for one in numbers if abs(one.derivative) * max(abs(one.value), STEP) > least]
    return tuple(sorted(numbers, key=lambda one: -abs(one.change(1.0))))


def _differentiate(number: Number, evaluate: Callable[[GaitProblem], float]) -> float:
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
    yield from _list_limits(problem)
    if problem.stability is not None and math.isfinite(problem.stability.radius):
        change = functools.partial(_change_option, problem, "stability", "radius")
        yield Number("spectral radius", problem.stability.radius, change)
    for entry in attrs.fields(type(problem.margins)):
        change = functools.partial(_change_option, problem, "margins", entry.name)
        yield Number(f"{entry.name}_margin", getattr(problem.margins, entry.name), change)


def _list_limits(problem: GaitProblem) -> Iterator[Number]:
    limits, actuators, angles = problem.limits, problem.robot.actuators, problem.robot.angles
    for name, values in (("torque", limits.torques(actuators)), ("torque_rate", limits.torque_rates(actuators))):
        by_name = dict(zip(actuators, values, strict=True))
        for actuator, value in by_name.items():
            if 0 < value < math.inf:
                yield Number(
                    f"{name}_limit of {actuator}",
                    value,
                    functools.partial(_change_entry, problem, name, by_name, actuator),
                )
    bounds_of_angles = dict(zip(angles, limits.angles(angles), strict=True))
    for angle, ends in bounds_of_angles.items():
        for side, value in zip(("lower", "upper"), ends, strict=True):
            change = functools.partial(_change_angle, problem, bounds_of_angles, angle, side)
            yield Number(f"{side} angle_limit of {angle}", value, change)
    for name in ("rate", "shortest_phase", "longest_step", "clearance"):
        value = getattr(limits, name)
        if value is not None and math.isfinite(value):
            label = "rate_limit" if name == "rate" else name
            yield Number(label, value, functools.partial(_change_option, problem, "limits", name))


def _change_field(problem: GaitProblem, name: str, value: float) -> GaitProblem:
    return problem.replace(**{name: value})


def _change_bound(problem: GaitProblem, name: str, side: str, value: float) -> GaitProblem:
    lower, upper = problem.free_ranges[name]
    return problem.replace(free={**problem.free, name: (value, upper) if side == "lower" else (lower, value)})


def _change_parameter(problem: GaitProblem, name: str, value: float) -> GaitProblem:
    return problem.replace(parameters={**problem.parameters, name: value})


def _change_option(problem: GaitProblem, part: str, name: str, value: object) -> GaitProblem:
    """Return the problem with one field of its limits or margins changed."""
    return problem.replace(**{part: attrs.evolve(getattr(problem, part), **{name: value})})


def _change_entry(
    problem: GaitProblem, name: str, by_name: dict[str, float], actuator: str, value: float
) -> GaitProblem:
    return _change_option(problem, "limits", name, {**by_name, actuator: value})


def _change_angle(
    problem: GaitProblem, ends: dict[str, tuple[float, float]], angle: str, side: str, value: float
) -> GaitProblem:
    lower, upper = ends[angle]
    changed = (value, upper) if side == "lower" else (lower, value)
    return _change_option(problem, "limits", "angle", {**ends, angle: changed})
