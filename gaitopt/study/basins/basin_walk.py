"""Walks of a basin, simulated by workers from starts that are defined by their values on the axes."""

import functools
import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from gaitopt.control.law import Law
from gaitopt.errors import InputError, suggest
from gaitopt.interrupts import defer_interrupt
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.motion.summary import plain
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.section import Section
from gaitopt.study.basins.attractor import SettlingCriterion, WalkEnding, classify_walk
from gaitopt.study.basins.basin_file import PENDING, Endings, make_basin
from gaitopt.study.basins.basin_record import Index

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class BasinWalk:
    """A walker and the common data of its starts; sent to each worker once.

    Attributes
    ----------
    robot : Robot
    parameters : dict of str to float
        All parameters; the values of axes replace theirs.
    base : dict of str to float
        Coordinates of the start that are not axes.
    axes : dict of str to (n,) array
        Coordinates of the start, or parameters.
    law : Law
    patience : SettlingCriterion
    engine : Engine
    """

    robot: Robot
    parameters: dict[str, float]
    base: dict[str, float]
    axes: dict[str, Array]
    law: Law
    patience: SettlingCriterion
    engine: Engine

    def method(self) -> dict[str, Any]:
        """Return the other data on which the result depends: the law and the criterion, as plain data."""
        return {"law": self.law.name, "law_digest": self.law.digest(), **attrs.asdict(self.patience)}

    @functools.cached_property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates of the section with foot speed."""
        return Section(self.robot, self.robot.vector(self.parameters), sliding=True).names

    def key(self) -> dict[str, Any]:
        """Return the key of the basin, as plain data: two basins with equal keys have equal results."""
        fixed = {name: value for name, value in self.parameters.items() if name not in self.axes}
        key = {"robot": self.robot.name, "parameters": fixed, "base": self.base}
        axes = {name: values.tolist() for name, values in self.axes.items()}
        return plain(key | {"axes": axes, "method": self.method()})

    def basin(self, ends: Endings) -> "xr.Dataset":
        """Return the basin with these endings of its starts."""
        units = {parameter.name: parameter.unit for parameter in self.robot.parameters}
        return make_basin(self.key(), units, self.coordinates, ends)

    def pending(self) -> Endings:
        """Return the endings of a basin of which nothing is computed."""
        size = math.prod(values.size for values in self.axes.values())
        outcome, steps = np.full(size, PENDING, dtype=np.int16), np.zeros(size, dtype=np.int32)
        return Endings((), outcome, steps, np.full((size, len(self.coordinates)), np.nan))

    def endings(self, points: Iterable[tuple[float, ...]]) -> Iterator[WalkEnding]:
        """Walk from starts that are defined by their values on the axes, one after another."""
        robot = self.robot
        known = {parameter.name for parameter in robot.parameters}
        walker, last = None, None
        for point in points:
            values = dict(zip(self.axes, point, strict=True))
            parameters = {name: value for name, value in values.items() if name in known}
            if walker is None or parameters != last:
                p = robot.vector(robot.resolve({**self.parameters, **parameters}))
                walker, last = Walker(robot, self.law, p, self.engine), parameters
                section = Section(robot, p, sliding=True)
            start = {**self.base, **values}
            with defer_interrupt():
                ending = classify_walk(walker, np.array([start[name] for name in section.names]), self.patience)
            yield ending


def axis_values_of(name: str, points: Sequence[float] | Array) -> Array:
    """Return the values of an axis, shape (n,)."""
    try:
        values = np.array(points, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"The axis {name!r} needs numbers, got {points!r}.") from None
    if values.ndim != 1 or values.size == 0 or not np.all(np.isfinite(values)):
        raise InputError(f"The axis {name!r} needs finite values, at least one.")
    return values


def walk_over(
    robot: Robot,
    fixed: Mapping[str, float],
    axes: Mapping[str, Array],
    law: Law,
    patience: SettlingCriterion,
    engine: Engine,
) -> BasinWalk:
    """Return the walks of a basin; raises InputError if a parameter or a coordinate is unknown or its value invalid."""
    known = {parameter.name: parameter for parameter in robot.parameters}
    if len(axes) not in (1, 2):
        raise InputError(f"A basin has one or two axes, got {len(axes)}: {', '.join(axes) or 'none'}.")
    varied = {name: values for name, values in axes.items() if name in known}
    for name, values in varied.items():
        for value in values:
            known[name].check(value)
    constant = {name: value for name, value in fixed.items() if name in known and name not in axes}
    # Bounds between parameters are satisfied on the whole grid if they are in its corners.
    corners = itertools.product(*((values.min(), values.max()) for values in varied.values()))
    resolved = [robot.resolve({**constant, **dict(zip(varied, corner, strict=True))}) for corner in corners]
    coordinates = Section(robot, robot.vector(resolved[0]), sliding=True).names
    for name in (*axes, *fixed):
        if name not in (*coordinates, *known):
            raise InputError(
                f"Robot {robot.name!r} has no coordinate or parameter {name!r}. {suggest(name, (*coordinates, *known))}"
            )
    start = {name: float(fixed.get(name, 0.0)) for name in coordinates if name not in axes}
    return BasinWalk(robot, resolved[0], start, dict(axes), law, patience, engine)


def walk_starts(walk: BasinWalk, index: Index) -> tuple[Index, Endings]:
    """Run a task: walk from the starts with these numbers, in C order of the axes."""
    places = np.unravel_index(index, tuple(values.size for values in walk.axes.values()))
    columns = [values[place].tolist() for values, place in zip(walk.axes.values(), places, strict=True)]
    endings = list(walk.endings(zip(*columns, strict=True)))
    labels = tuple(dict.fromkeys(ending.label for ending in endings))
    outcome = np.array([labels.index(ending.label) for ending in endings], dtype=np.int16)
    steps = np.array([ending.steps for ending in endings], dtype=np.int32)
    return index, Endings(labels, outcome, steps, np.array([ending.z for ending in endings]))
