"""trace_branch: natural-parameter continuation of periodic gaits with location of special points."""

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
from gaitopt.stability.cycle_search import find_cycle
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section


def trace_branch(
    robot: Robot,
    parameters: Mapping[str, float],
    start: Cycle,
    axis: Mapping[str, Sequence[float] | Array],
    *,
    same_sequence: bool = False,
    tolerance: float = 1e-6,
    law: Law | None = None,
    engine: Engine | None = None,
) -> Branch:
    """Follow a periodic gait over increasing or decreasing values of a parameter.

    Newton's method starts from the secant through the last two gaits.  If it fails, the step is halved until the end of
    the branch is located; changes of contact sequence and of stability are located by bisection.

    Parameters
    ----------
    robot : Robot
    parameters : mapping of str to float
    start : Cycle
        A gait at, or near, the first value.
    axis : mapping of str to sequence of float
        One parameter of robot or ground with its values in order.
    same_sequence : bool
        Whether to end the branch at a change of the contact sequence.
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
        If `axis` is not one parameter with its values, or the parameter is unknown.

    Examples
    --------
    >>> import math
    >>> from gaitopt import find_cycles, rimless_wheel, trace_branch
    >>> ground = {"slope": math.radians(13), "friction": 1.0}
    >>> gait = find_cycles(rimless_wheel(), ground, starts=20)[0]
    >>> branch = trace_branch(rimless_wheel(), ground, gait, {"friction": [1.0, 0.9]}, tolerance=1e-4)
    >>> len(branch.cycles), branch.ended
    (4, 'all values reached')
    >>> [(point.kind, round(point.value, 3), point.after) for point in branch.special]
    [('sequence', 0.914, 'stick slip+ | stick')]
    """
    if not isinstance(axis, Mapping) or len(axis) != 1:
        raise InputError(f"axis must be one parameter with values, such as {{'friction': [0.3, 0.2]}}, got {axis!r}.")
    ((parameter, values),) = axis.items()
    known = [p.name for p in robot.parameters]
    if parameter not in known:
        raise InputError(f"Robot {robot.name!r} has no parameter {parameter!r}. {suggest(parameter, known)}")
    Parameter("tolerance", 1e-6, "", "", lower=0, lower_open=True).check(tolerance)
    law = law or passive(robot)
    family = _Family(robot, parameters, parameter, law, engine or default_engine(law, robot), tolerance)
    points: list[_TracedGait] = []
    special: list[SpecialPoint] = []
    ended = "all values reached"
    for result in family.follow(_TracedGait(float(start.parameters[parameter]), start), values):
        if isinstance(result, _TracedGait):
            points.append(result)
            continue
        special.append(result)
        if result.kind == "end":
            ended = f"no gait found beyond {parameter} = {result.value:.6g}"
        elif result.kind == "sequence" and same_sequence:
            ended = f"the contact sequence changes to '{result.after}'"
            break
    return Branch(parameter, np.array([p.value for p in points]), tuple(p.cycle for p in points), ended, tuple(special))


class _TracedGait(NamedTuple):
    """A gait at a value of the parameter."""

    value: float
    cycle: Cycle


@dataclass(frozen=True, eq=False)
class _Family:
    """A family of walkers that differ in one parameter."""

    robot: Robot
    parameters: Mapping[str, float]
    parameter: str
    law: Law
    engine: Engine
    tolerance: float

    def follow(self, start: _TracedGait, values: Sequence[float] | Array) -> Iterator[_TracedGait | SpecialPoint]:
        """Yield gaits and special points in order, up to the last value or to the end of the branch."""
        before, last = None, start
        for target in map(float, values):
            step, first = target - last.value, True
            while first or last.value != target:
                first = False
                step = min(step, target - last.value, key=abs)
                value = target if step == target - last.value else last.value + step
                point = self.find_gait(value, last, before)
                if point is not None:
                    if last is not start:  # the start may be a gait of another walker
                        yield from self.locate_changes(last, point)
                    yield point
                    before, last = last, point
                elif abs(step) <= self.tolerance:
                    beyond = self.describe_end(value, last, before)
                    yield SpecialPoint("end", last.value + step / 2, abs(step), last.cycle.sequence, beyond)
                    return
                else:
                    step /= 2

    def find_gait(self, value: float, last: _TracedGait, before: _TracedGait | None = None) -> _TracedGait | None:
        """Return the gait at a value, predicted from one or two previous gaits, or None if the iteration fails."""
        cycle = find_cycle(self.make_walker(value), _predict(before, last, value), len(last.cycle.sequences))
        return None if cycle is None or not _are_close(cycle, last.cycle) else _TracedGait(value, cycle)

    def locate_changes(self, one: _TracedGait, other: _TracedGait) -> Iterator[_TracedGait | SpecialPoint]:
        """Yield the changes between two gaits, and the gaits next to each change other than the two."""
        for near, far in self._brackets(one, other):
            if near is not one:
                yield near
            yield _change(near, far)
            if far is not other:
                yield far

    def _brackets(self, one: _TracedGait, other: _TracedGait) -> Iterator[tuple[_TracedGait, _TracedGait]]:
        if _kind(one) == _kind(other):
            return
        middle = None
        if abs(other.value - one.value) > self.tolerance:
            value = (one.value + other.value) / 2
            middle = self.find_gait(value, one) or self.find_gait(value, other)
        if middle is None:
            yield one, other
            return
        yield from self._brackets(one, middle)
        yield from self._brackets(middle, other)

    def describe_end(self, value: float, last: _TracedGait, before: _TracedGait | None) -> str:
        """Return the outcome of the steps from the predicted gait beyond the end of a branch."""
        walker = self.make_walker(value)
        section = Section(self.robot, walker.p, sliding=True)
        passage = ReturnMap(walker, section, len(last.cycle.sequences))(_predict(before, last, value))
        return passage.stop.key if passage.stop is not None else "no gait"

    def make_walker(self, value: float) -> Walker:
        p = self.robot.vector(self.robot.resolve({**self.parameters, self.parameter: value}))
        return Walker(self.robot, self.law, p, self.engine)


def _kind(point: _TracedGait) -> tuple[str, bool]:
    """Return contact sequence and stability, the changes of which are special points."""
    return point.cycle.sequence, point.cycle.stable


def _change(one: _TracedGait, other: _TracedGait) -> SpecialPoint:
    value, width = (one.value + other.value) / 2, abs(other.value - one.value)
    if one.cycle.sequence != other.cycle.sequence:
        return SpecialPoint("sequence", value, width, one.cycle.sequence, other.cycle.sequence)
    names = [f"{p.cycle.sequence}, {'stable' if p.cycle.stable else 'unstable'}" for p in (one, other)]
    return SpecialPoint("stability", value, width, *names)


def _predict(before: _TracedGait | None, last: _TracedGait, value: float) -> Array:
    """Return a start on the section with foot speed, on the secant through the last two gaits of the same sequence."""
    last_state = _state(last.cycle)
    if before is None or before.cycle.sequence != last.cycle.sequence or before.value == last.value:
        return last_state
    slope = (last_state - _state(before.cycle)) / (last.value - before.value)
    return last_state + slope * (value - last.value)


def _state(cycle: Cycle) -> Array:
    return cycle.z if cycle.section.sliding else np.append(cycle.z, cycle.section.foot_speed)


def _are_close(cycle: Cycle, other: Cycle) -> bool:
    """Return whether two gaits are close enough to be neighbours on a branch."""
    one, two = _state(cycle)[:-1], _state(other)[:-1]
    return bool(np.max(np.abs(one - two)) < 0.2 * (np.max(np.abs(two)) + 0.1))
