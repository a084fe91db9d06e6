"""The grid of a sweep: contact sequences by values of some parameters, and the tasks that fill it.

Every point is reached along every axis from both sides: a *forward* gait starts from the neighbours before it, a
*backward* gait from those behind it, the cheapest first.  Both begin at points, spread over the grid, that are solved
from starts of their own.  The way back is known where the forward gait is at hand: what would only lead to it again is
not solved.  Who starts from whom is fixed by the grid, so that nothing depends on the order of execution.
"""

import functools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from gaitopt.errors import InputError, suggest
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.ocp.problem import GaitProblem
from gaitopt.parallel.task_graph import Task

FIELDS = {"friction": "1", "speed": "m/s", "step_length": "m", "slope": "rad"}
"""Fields of a problem that can be axes, with their units; the robot's own parameters can be too."""

Index = tuple[int, ...]


@dataclass(frozen=True, order=True)
class SweepPoint:
    """A place in the grid: the number of its contact sequence and its place along each axis."""

    sequence: int
    index: Index

    @property
    def name(self) -> str:
        """Spelling for keys and files, such as ``"1-03"``."""
        return "-".join([str(self.sequence), *(f"{i:03d}" for i in self.index)])


@dataclass(frozen=True)
class SweepTask:
    """What a task of a sweep is to do.

    Attributes
    ----------
    kind : str
        ``"cold"``, ``"forward"``, ``"backward"``, or ``"point"`` for the proven best of a point.
    point : Point
    given : tuple of (str, Point)
        Kinds and points of the gaits it is given, in this order.
    """

    kind: str
    point: SweepPoint
    given: tuple[tuple[str, SweepPoint], ...] = ()


@dataclass(frozen=True, eq=False)
class SweepGrid:
    """Contact sequences by parameter values.

    Attributes
    ----------
    problem : GaitProblem
    sequences : tuple of ContactSequence
    axes : dict of str to (K,) array
        In SI units and rad.
    starts : int
        Starts tried where there is no neighbour to start from.

    Raises
    ------
    InputError
        If an axis is unknown or empty, or no point of the grid can be posed.
    """

    problem: GaitProblem
    sequences: tuple[ContactSequence, ...]
    axes: dict[str, Array]
    starts: int

    def __post_init__(self) -> None:
        known = [*FIELDS, *self.problem.parameters]
        if not self.axes:
            raise InputError(f"A sweep needs an axis, such as friction. {suggest('friction', known)}")
        if not self.sequences or len(set(self.sequences)) < len(self.sequences):
            raise InputError("A sweep needs contact sequences, each of them once.")
        for name, values in self.axes.items():
            if name not in known:
                raise InputError(f"A sweep cannot go over {name!r}. {suggest(name, known)}")
            if values.ndim != 1 or not values.size or not np.all(np.isfinite(values)) or np.any(np.diff(values) <= 0):
                raise InputError(f"The axis {name!r} needs increasing finite values, at least one.")
        if len(self.impossible) == math.prod(self.shape):
            raise InputError(f"No point of this sweep can be posed: {next(iter(self.impossible.values()))}")

    @property
    def shape(self) -> tuple[int, ...]:
        """Number of contact sequences, then of values along each axis."""
        return (len(self.sequences), *(values.size for values in self.axes.values()))

    def points(self) -> Iterator[SweepPoint]:
        """Yield every point, in the order of the dataset."""
        for sequence, *index in np.ndindex(*self.shape):
            yield SweepPoint(sequence, tuple(index))

    def unit(self, axis: str) -> str:
        """Return the unit of an axis."""
        units = {parameter.name: parameter.unit for parameter in self.problem.robot.parameters}
        return FIELDS.get(axis) or units[axis]

    def problem_at(self, point: SweepPoint) -> GaitProblem:
        """Return the problem of a point.

        Raises
        ------
        InputError
            If it cannot be posed, such as a step longer than the robot can reach.
        """
        values = {name: float(axis[i]) for (name, axis), i in zip(self.axes.items(), point.index, strict=True)}
        fields = {name: value for name, value in values.items() if name in FIELDS}
        own = {name: value for name, value in values.items() if name not in FIELDS}
        parameters = {**self.problem.parameters, **own}
        return self.problem.replace(sequence=self.sequences[point.sequence], parameters=parameters, **fields)

    @functools.cached_property
    def impossible(self) -> dict[SweepPoint, str]:
        """The points that cannot be posed, with the reason."""
        found = {}
        for point in self.points():
            try:
                self.problem_at(point)
            except InputError as error:
                found[point] = str(error)
        return found


def tasks(grid: SweepGrid) -> list[Task]:
    """Return the tasks of a sweep in an order that keeps every worker busy; those of a sequence form a chain."""
    points = [point for point in grid.points() if point not in grid.impossible]
    possible = set(points)
    before = {point: [p for p in _neighbours(point, -1) if p in possible] for point in points}
    behind = {point: [p for p in _neighbours(point, +1) if p in possible] for point in points}
    spread = {point for point in points if _is_spread(point.index, grid.shape[1:])}
    own = {point for point in points if point in spread or not before[point] or not behind[point]}
    made = [_task("cold", point) for point in sorted(own, key=lambda point: point.index)]
    for kind, neighbours, ordered in (("forward", before, points), ("backward", behind, points[::-1])):
        for point in sorted(ordered, key=lambda p: sum(p.index), reverse=kind == "backward"):
            given = [(kind, other) for other in neighbours[point]]
            given += [("forward", point)] * (kind == "backward") + [("cold", point)] * (point in own)
            made.append(_task(kind, point, *given))
    return made + [_task("point", point, ("forward", point), ("backward", point)) for point in points]


def _task(kind: str, point: SweepPoint, *given: tuple[str, SweepPoint]) -> Task:
    return Task(
        f"{kind}-{point.name}", SweepTask(kind, point, given), tuple(f"{kind}-{other.name}" for kind, other in given)
    )


def _neighbours(point: SweepPoint, step: int) -> Iterator[SweepPoint]:
    """Yield the next points along each axis."""
    for axis in range(len(point.index)):
        index = tuple(i + step * (k == axis) for k, i in enumerate(point.index))
        yield SweepPoint(point.sequence, index)


def _is_spread(index: Index, shape: tuple[int, ...]) -> bool:
    """Return whether a point is a corner of the grid, or halfway between corners."""
    return all(i in (0, count // 2, count - 1) for i, count in zip(index, shape, strict=True))


def axis_values(given: Mapping[str, Sequence[float] | Array]) -> dict[str, Array]:
    """Return the values of axes as arrays of numbers: fields of a problem first, then parameters as they are given.

    Raises
    ------
    InputError
        If they are no numbers.
    """
    ordered = {name: given[name] for name in (*FIELDS, *given) if name in given}
    try:
        return {name: np.array(values, dtype=float) for name, values in ordered.items()}
    except (TypeError, ValueError):
        raise InputError(f"The axes {', '.join(given)} need numbers.") from None
