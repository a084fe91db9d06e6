"""Branches of periodic gaits over a parameter, by natural-parameter stepping."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gaitopt.control.law import Law, passive
from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.arc import Engine
from gaitopt.simulation.engines import default_engine
from gaitopt.simulation.walker import Walker
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.search import cycle_from


@dataclass(frozen=True, eq=False)
class Branch:
    """Gaits followed over a parameter.

    Attributes
    ----------
    parameter : str
    values : (K,) array
        Parameter of each gait, in the order they were found.
    cycles : tuple of K Cycle
    ended : str
        Why the branch was not followed further.

    Examples
    --------
    >>> Branch("friction", np.array([]), (), "no gait found").ended
    'no gait found'
    """

    parameter: str
    values: Array
    cycles: tuple[Cycle, ...]
    ended: str


def trace_branch(
    robot: Robot,
    parameters: Mapping[str, float],
    start: Cycle,
    parameter: str,
    values: Sequence[float] | Array,
    *,
    same_word: bool = False,
    smallest_step: float = 1e-3,
    law: Law | None = None,
    engine: Engine | None = None,
) -> Branch:
    """Follow a periodic gait over increasing or decreasing values of a parameter.

    Each gait starts Newton's method from the line through the two before it.  Where that fails, the step is halved
    until it is `smallest_step` of the spacing; the last gait found then lies that close to the end of the branch.

    Parameters
    ----------
    robot : Robot
    parameters : mapping of str to float
    start : Cycle
        A gait at, or near, the first value.
    parameter : str
        Name of a parameter of robot or ground.
    values : sequence of float
        Where gaits are wanted, in order.
    same_word : bool
        Whether to end the branch where the word of the gait changes.
    smallest_step : float
    law : Law, optional
    engine : Engine, optional

    Returns
    -------
    Branch

    Raises
    ------
    InputError
        If the parameter is unknown.

    Examples
    --------
    >>> import math
    >>> from gaitopt import find_cycles, rimless_wheel, trace_branch
    >>> slope = math.radians(13)
    >>> gait = find_cycles(rimless_wheel(), {"slope": slope, "friction": 1.0}, starts=20)[0]
    >>> branch = trace_branch(rimless_wheel(), {"friction": 1.0}, gait, "slope", [slope, slope * 1.05])
    >>> len(branch.cycles), branch.ended
    (2, 'all values reached')
    """
    known = [p.name for p in robot.parameters]
    if parameter not in known:
        raise InputError(f"Robot {robot.name!r} has no parameter {parameter!r}. {suggest(parameter, known)}")
    law = law or passive(robot)
    engine = engine or default_engine(law)
    found: list[tuple[float, Cycle]] = []
    ended = "all values reached"
    previous = (float(start.parameters[parameter]), start)
    for target in map(float, values):
        reached = None
        for value, cycle in _approach(
            robot, parameters, parameter, law, engine, previous, found, target, smallest_step
        ):
            if same_word and cycle.word != start.word:
                return _branch(parameter, found, f"the word changes to '{cycle.word}'")
            previous = (value, cycle)
            found.append(previous)
            reached = value
        if reached != target:
            ended = f"no gait found beyond {parameter} = {previous[0]:.6g}"
            break
    return _branch(parameter, found, ended)


def _branch(parameter: str, found: list[tuple[float, Cycle]], ended: str) -> Branch:
    return Branch(parameter, np.array([value for value, _ in found]), tuple(cycle for _, cycle in found), ended)


def _approach(
    robot: Robot,
    parameters: Mapping[str, float],
    parameter: str,
    law: Law,
    engine: Engine,
    previous: tuple[float, Cycle],
    found: list[tuple[float, Cycle]],
    target: float,
    smallest_step: float,
) -> Iterator[tuple[float, Cycle]]:
    """Yield gaits on the way to a target value, the last one at the target if it can be reached."""
    before = found[-2] if len(found) > 1 else None
    step = target - previous[0]
    least = abs(step) * smallest_step
    while True:
        value = target if abs(target - previous[0]) <= abs(step) * (1 + 1e-12) else previous[0] + step
        p = robot.vector(robot.resolve({**parameters, parameter: value}))
        cycle = cycle_from(Walker(robot, law, p, engine), _predict(before, previous, value), len(previous[1].words))
        if cycle is not None and _near(cycle, previous[1]):
            before, previous = previous, (value, cycle)
            yield previous
            if value == target:
                return
            continue
        step /= 2
        if abs(step) <= least or step == 0:
            return


def _predict(before: tuple[float, Cycle] | None, last: tuple[float, Cycle], value: float) -> Array:
    """Return a start on the section with foot speed: on the line through the last two gaits, if they are alike."""
    wide = _wide(last[1])
    if before is None or before[1].word != last[1].word or before[0] == last[0]:
        return wide
    slope = (wide - _wide(before[1])) / (last[0] - before[0])
    return wide + slope * (value - last[0])


def _wide(cycle: Cycle) -> Array:
    return cycle.z if cycle.section.sliding else np.append(cycle.z, cycle.section.foot_speed)


def _near(cycle: Cycle, other: Cycle) -> bool:
    """Return whether two gaits may be neighbours on a branch: no entry of the state jumps."""
    one, two = _wide(cycle)[:-1], _wide(other)[:-1]
    return bool(np.max(np.abs(one - two)) < 0.2 * (np.max(np.abs(two)) + 0.1))
