"""The grid of a sweep: contact sequences by values of some parameters, and the tasks that fill it.

Every point is solved along every axis from both sides: a *forward* gait is warm-started from the preceding neighbours,
a *backward* gait from the following ones, that of lowest cost first.  Both begin at points, spread over the grid, that
are solved from default starts.  A backward solve that leads to the known forward gait is omitted.  The grid determines
the warm starts, so that results do not depend on the order of execution.
"""

import functools
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.ocp.multicontact.planar_impossibility import explain_planar_impossibility
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.impossible_sequences import explain_impossibility
from gaitopt.parallel.task_graph import Task

FIELDS = {"friction": "1", "speed": "m/s", "step_length": "m", "slope": "rad"}
"""Fields of a problem that can be axes, with their units; parameters of the robot can be axes, too."""

MOST_SHOWN = 10
"""Largest number of values of an invalid axis that are stated."""

Index = tuple[int, ...]


@dataclass(frozen=True, order=True)
class SweepPoint:
    """A point of the grid: the index of its contact sequence and its index along each axis."""

    sequence: int
    index: Index

    @property
    def place(self) -> Index:
        """Index in arrays over the contact sequences and the axes."""
        return (self.sequence, *self.index)

    @property
    def name(self) -> str:
        """Name in keys and files, such as ``"1-03"``."""
        return "-".join([str(self.sequence), *(f"{i:03d}" for i in self.index)])


@dataclass(frozen=True)
class SweepTask:
    """A task of a sweep.

    Attributes
    ----------
    kind : str
        ``"cold"``, ``"forward"``, ``"backward"``, or ``"point"`` for the verified best gait of a point.
    point : SweepPoint
    inputs : tuple of (str, SweepPoint)
        Kinds and points of the gaits that it receives, in this order.
    """

    kind: str
    point: SweepPoint
    inputs: tuple[tuple[str, SweepPoint], ...] = ()


@dataclass(frozen=True, eq=False)
class SweepGrid:
    """Contact sequences by parameter values.

    Attributes
    ----------
    problem : GaitProblem or PlanarProblem
    sequences : tuple of ContactSequence or PhaseSequence
    axes : dict of str to (K,) array
        In SI units and rad.
    starts : int
        Number of starts at points without a neighbour to start from.

    Raises
    ------
    InputError
        If an axis is unknown or empty, or no point of the grid has a valid problem.
    """

    problem: GaitProblem | PlanarProblem
    sequences: tuple[ContactSequence | PhaseSequence, ...]
    axes: dict[str, Array]
    starts: int

    def __post_init__(self) -> None:
        known = [*FIELDS, *self.problem.parameters]
        if not self.axes:
            raise InputError(f"A sweep needs an axis, such as friction. {suggest('friction', known)}")
        if not self.sequences or len(set(self.sequences)) < len(self.sequences):
            raise InputError("A sweep needs at least one contact sequence, without repetitions.")
        for name, values in self.axes.items():
            if name not in known:
                raise InputError(f"A sweep has no axis {name!r}. {suggest(name, known)}")
            if name in getattr(self.problem, "free", {}):
                raise InputError(f"A sweep over {name!r} needs a problem in which it is not free.")
            if values.ndim != 1 or not values.size or not np.all(np.isfinite(values)) or np.any(np.diff(values) <= 0):
                remedy = f"; write [{values:g}]" if not values.ndim and np.isfinite(values) else ""
                got = f"got {values.tolist()}{remedy}" if values.size <= MOST_SHOWN else f"got {values.size} values"
                raise InputError(f"The axis {name!r} needs increasing finite values, at least one, {got}.")
        if len(self.impossible) == math.prod(self.shape):
            raise InputError(f"No point of this sweep has a valid problem: {next(iter(self.impossible.values()))}")

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

    def describe(self, point: SweepPoint) -> str:
        """Return the values of the axes at a point, and its contact sequence if there are several."""
        units = {name: "" if self.unit(name) == "1" else f" {self.unit(name)}" for name in self.axes}
        axes = zip(self.axes.items(), point.index, strict=True)
        texts = [f"{name} {values[i]:.6g}{units[name]}" for (name, values), i in axes]
        return ", ".join([*texts, f"'{self.sequences[point.sequence]}'"] if len(self.sequences) > 1 else texts)

    def problem_at(self, point: SweepPoint) -> Any:
        """Return the problem of a point, of the kind of the problem of the grid.

        Raises
        ------
        InputError
            If the problem is invalid, such as for a step longer than the robot can reach.
        """
        values = {name: float(axis[i]) for (name, axis), i in zip(self.axes.items(), point.index, strict=True)}
        fields = {name: value for name, value in values.items() if name in FIELDS}
        others = {name: value for name, value in values.items() if name not in FIELDS}
        parameters = {**self.problem.parameters, **others}
        return self.problem.replace(sequence=self.sequences[point.sequence], parameters=parameters, **fields)

    @functools.cached_property
    def impossible(self) -> dict[SweepPoint, str]:
        """The points without a valid problem, with the reason."""
        reasons = {}
        for point in self.points():
            try:
                problem = self.problem_at(point)
            except InputError as error:
                reasons[point] = str(error)
                continue
            if isinstance(problem, GaitProblem):
                reason = explain_impossibility(problem.sequence, problem)
            else:
                reason = explain_planar_impossibility(problem) or ""
            if reason:
                reasons[point] = f"{reason[0].upper()}{reason[1:]}."
        return reasons


def plan_sweep(grid: SweepGrid) -> list[Task]:
    """Return the tasks of a sweep in an order that keeps every worker busy; those of a sequence form a chain."""
    points = [point for point in grid.points() if point not in grid.impossible]
    possible = set(points)
    before = {point: [p for p in _neighbours(point, -1) if p in possible] for point in points}
    behind = {point: [p for p in _neighbours(point, +1) if p in possible] for point in points}
    spread = {point for point in points if _is_spread(point.index, grid.shape[1:])}
    cold = {point for point in points if point in spread or not before[point] or not behind[point]}
    made = [_task(grid, "cold", point) for point in sorted(cold, key=lambda point: point.index)]
    for kind, neighbours, ordered in (("forward", before, points), ("backward", behind, points[::-1])):
        for point in sorted(ordered, key=lambda p: sum(p.index), reverse=kind == "backward"):
            inputs = [(kind, other) for other in neighbours[point]]
            inputs += [("forward", point)] * (kind == "backward") + [("cold", point)] * (point in cold)
            made.append(_task(grid, kind, point, *inputs))
    return made + [_task(grid, "point", point, ("forward", point), ("backward", point)) for point in points]


def _task(grid: SweepGrid, kind: str, point: SweepPoint, *inputs: tuple[str, SweepPoint]) -> Task:
    return Task(
        f"{kind}-{point.name}",
        SweepTask(kind, point, inputs),
        tuple(f"{kind}-{other.name}" for kind, other in inputs),
        f"{grid.describe(point)}{' (replay)' if kind == 'point' else ''}",
    )


def _neighbours(point: SweepPoint, step: int) -> Iterator[SweepPoint]:
    """Yield the next points along each axis."""
    for axis in range(len(point.index)):
        index = tuple(i + step * (k == axis) for k, i in enumerate(point.index))
        yield SweepPoint(point.sequence, index)


def _is_spread(index: Index, shape: tuple[int, ...]) -> bool:
    """Return whether a point is a corner of the grid, or halfway between corners."""
    return all(i in (0, count // 2, count - 1) for i, count in zip(index, shape, strict=True))


def axis_values(axes: Mapping[str, Sequence[float] | Array]) -> dict[str, Array]:
    """Return the values of axes as arrays of numbers: fields of a problem first, then parameters in their order.

    Raises
    ------
    InputError
        If they are not numbers.
    """
    ordered = {name: axes[name] for name in (*FIELDS, *axes) if name in axes}
    try:
        return {name: np.array(values, dtype=float) for name, values in ordered.items()}
    except (TypeError, ValueError):
        raise InputError(f"The axes {', '.join(axes)} need numbers.") from None
