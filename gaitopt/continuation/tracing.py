"""trace_branch: periodic gaits followed over a parameter by natural-parameter stepping, special points located."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from gaitopt.continuation.branch import Branch, SpecialPoint
from gaitopt.control.law import Law, passive
from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.parameters import Parameter
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.cycle_search import cycle_from
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section


def trace_branch(
    robot: Robot,
    parameters: Mapping[str, float],
    start: Cycle,
    parameter: str,
    values: Sequence[float] | Array,
    *,
    same_sequence: bool = False,
    tolerance: float = 1e-6,
    law: Law | None = None,
    engine: Engine | None = None,
) -> Branch:
    """Follow a periodic gait over increasing or decreasing values of a parameter.

    Each gait starts Newton's method from the line through the two before it.  Where that fails, the step is halved
    until the end of the branch is located; changes of the gait's sequence and of its stability are located by
    bisection.

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
        Whether to end the branch where the contact sequence of the gait changes.
    tolerance : float
        Width to which special points are located, in the unit of the parameter.
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
    >>> given = {"slope": math.radians(13), "friction": 1.0}
    >>> gait = find_cycles(rimless_wheel(), given, starts=20)[0]
    >>> branch = trace_branch(rimless_wheel(), given, gait, "friction", [1.0, 0.9], tolerance=1e-4)
    >>> len(branch.cycles), branch.ended
    (4, 'all values reached')
    >>> [(point.kind, round(point.value, 3), point.after) for point in branch.special]
    [('sequence', 0.914, 'stick slip+ | stick')]
    """
    known = [p.name for p in robot.parameters]
    if parameter not in known:
        raise InputError(f"Robot {robot.name!r} has no parameter {parameter!r}. {suggest(parameter, known)}")
    Parameter("tolerance", 1e-6, "", "", lower=0, lower_open=True).check(tolerance)
    law = law or passive(robot)
    family = _Family(robot, parameters, parameter, law, engine or default_engine(law, robot), tolerance)
    points: list[_Point] = []
    special: list[SpecialPoint] = []
    ended = "all values reached"
    for found in family.follow(_Point(float(start.parameters[parameter]), start), values):
        if isinstance(found, _Point):
            points.append(found)
            continue
        special.append(found)
        if found.kind == "end":
            ended = f"no gait found beyond {parameter} = {found.value:.6g}"
        elif found.kind == "sequence" and same_sequence:
            ended = f"the contact sequence changes to '{found.after}'"
            break
    return Branch(parameter, np.array([p.value for p in points]), tuple(p.cycle for p in points), ended, tuple(special))


class _Point(NamedTuple):
    """A gait at a value of the parameter."""

    value: float
    cycle: Cycle


@dataclass(frozen=True, eq=False)
class _Family:
    """The walkers of a robot that differ in one parameter."""

    robot: Robot
    parameters: Mapping[str, float]
    parameter: str
    law: Law
    engine: Engine
    tolerance: float

    def follow(self, start: _Point, values: Sequence[float] | Array) -> Iterator[_Point | SpecialPoint]:
        """Yield gaits and special points in order, up to the last value or to the end of the branch."""
        before, last = None, start
        for target in map(float, values):
            step, first = target - last.value, True
            while first or last.value != target:
                first = False
                step = min(step, target - last.value, key=abs)
                value = target if step == target - last.value else last.value + step
                point = self.gait(value, last, before)
                if point is not None:
                    if last is not start:  # which may be a gait of other walkers
                        yield from self.between(last, point)
                    yield point
                    before, last = last, point
                elif abs(step) <= self.tolerance:
                    beyond = self.fate(value, last, before)
                    yield SpecialPoint("end", last.value + step / 2, abs(step), last.cycle.sequence, beyond)
                    return
                else:
                    step /= 2

    def gait(self, value: float, last: _Point, before: _Point | None = None) -> _Point | None:
        """Return the gait at a value that continues one, or the line through two; None if there is none."""
        cycle = cycle_from(self.walker(value), _predict(before, last, value), len(last.cycle.sequences))
        return None if cycle is None or not _near(cycle, last.cycle) else _Point(value, cycle)

    def between(self, one: _Point, other: _Point) -> Iterator[_Point | SpecialPoint]:
        """Yield the changes between two gaits, each with the gaits on its two sides unless they are the given ones."""
        for near, far in self._brackets(one, other):
            if near is not one:
                yield near
            yield _change(near, far)
            if far is not other:
                yield far

    def _brackets(self, one: _Point, other: _Point) -> Iterator[tuple[_Point, _Point]]:
        if _kind(one) == _kind(other):
            return
        middle = None
        if abs(other.value - one.value) > self.tolerance:
            value = (one.value + other.value) / 2
            middle = self.gait(value, one) or self.gait(value, other)
        if middle is None:
            yield one, other
            return
        yield from self._brackets(one, middle)
        yield from self._brackets(middle, other)

    def fate(self, value: float, last: _Point, before: _Point | None) -> str:
        """Return what becomes of the steps where the gait would be, beyond the end of a branch."""
        walker = self.walker(value)
        section = Section(self.robot, walker.p, sliding=True)
        passage = ReturnMap(walker, section, len(last.cycle.sequences))(_predict(before, last, value))
        return passage.stop.key if passage.stop is not None else "no gait"

    def walker(self, value: float) -> Walker:
        p = self.robot.vector(self.robot.resolve({**self.parameters, self.parameter: value}))
        return Walker(self.robot, self.law, p, self.engine)


def _kind(point: _Point) -> tuple[str, bool]:
    """Return what must not change along a branch without being told of."""
    return point.cycle.sequence, point.cycle.stable


def _change(one: _Point, other: _Point) -> SpecialPoint:
    value, width = (one.value + other.value) / 2, abs(other.value - one.value)
    if one.cycle.sequence != other.cycle.sequence:
        return SpecialPoint("sequence", value, width, one.cycle.sequence, other.cycle.sequence)
    names = [f"{p.cycle.sequence}, {'stable' if p.cycle.stable else 'unstable'}" for p in (one, other)]
    return SpecialPoint("stability", value, width, *names)


def _predict(before: _Point | None, last: _Point, value: float) -> Array:
    """Return a start on the section with foot speed: on the line through the last two gaits, if they are alike."""
    wide = _wide(last.cycle)
    if before is None or before.cycle.sequence != last.cycle.sequence or before.value == last.value:
        return wide
    slope = (wide - _wide(before.cycle)) / (last.value - before.value)
    return wide + slope * (value - last.value)


def _wide(cycle: Cycle) -> Array:
    return cycle.z if cycle.section.sliding else np.append(cycle.z, cycle.section.foot_speed)


def _near(cycle: Cycle, other: Cycle) -> bool:
    """Return whether two gaits may be neighbours on a branch: no entry of the state jumps."""
    one, two = _wide(cycle)[:-1], _wide(other)[:-1]
    return bool(np.max(np.abs(one - two)) < 0.2 * (np.max(np.abs(two)) + 0.1))
