"""Walks of a basin, simulated by workers from starts that are defined by their values on the axes."""

import itertools
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import attrs
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.motion import Array
from gaitopt.motion.summary import plain
from gaitopt.study.basins.attractor import SettlingCriterion, WalkEnding
from gaitopt.study.basins.basin_file import PENDING, Endings, make_basin
from gaitopt.study.basins.basin_record import Index
from gaitopt.study.basins.basin_source import BasinSource

if TYPE_CHECKING:
    import xarray as xr


@dataclass(frozen=True, eq=False)
class BasinWalk:
    """A walker and the common data of its starts; sent to each worker once.

    Attributes
    ----------
    source : BasinSource
    parameters : dict of str to float
        All parameters; the values of axes replace theirs.
    base : dict of str to float
        Coordinates of the start that are not axes.
    axes : dict of str to (n,) array
        Coordinates of the start, or parameters.
    criterion : SettlingCriterion
    """

    source: BasinSource
    parameters: dict[str, float]
    base: dict[str, float]
    axes: dict[str, Array]
    criterion: SettlingCriterion

    def method(self) -> dict[str, Any]:
        """Return the other data on which the result depends: the law and the criterion, as plain data."""
        return {**self.source.method(), **attrs.asdict(self.criterion)}

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates of a start."""
        return self.source.coordinates

    def key(self) -> dict[str, Any]:
        """Return the key of the basin, as plain data: two basins with equal keys have equal results."""
        fixed = {name: value for name, value in self.parameters.items() if name not in self.axes}
        key = {"robot": self.source.robot.name, "parameters": fixed, "base": self.base}
        axes = {name: values.tolist() for name, values in self.axes.items()}
        return plain(key | {"axes": axes, "method": self.method()})

    def basin(self, ends: Endings) -> "xr.Dataset":
        """Return the basin with these endings of its starts."""
        units = {parameter.name: parameter.unit for parameter in self.source.robot.parameters}
        return make_basin(self.key(), self.source.units | units, self.coordinates, ends)

    def pending(self) -> Endings:
        """Return the endings of a basin of which nothing is computed."""
        size = math.prod(values.size for values in self.axes.values())
        outcome, steps = np.full(size, PENDING, dtype=np.int16), np.zeros(size, dtype=np.int32)
        return Endings((), outcome, steps, np.full((size, len(self.coordinates)), np.nan))

    def endings(self, points: Iterable[tuple[float, ...]]) -> Iterator[WalkEnding]:
        """Walk from starts that are defined by their values on the axes, one after another."""
        robot = self.source.robot
        known = {parameter.name for parameter in robot.parameters}
        classify, last = None, None
        for point in points:
            values = dict(zip(self.axes, point, strict=True))
            parameters = {name: value for name, value in values.items() if name in known}
            if classify is None or parameters != last:
                resolved = robot.resolve({**self.parameters, **parameters})
                classify, last = self.source.classifier(resolved, self.criterion), parameters
            start = {name: value for name, value in values.items() if name not in known}
            with defer_interrupt():
                ending = classify({**self.base, **start})
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
    source: BasinSource, fixed: Mapping[str, float], axes: Mapping[str, Array], criterion: SettlingCriterion
) -> BasinWalk:
    """Return the walks of a basin; raises InputError if a parameter or a coordinate is unknown or its value invalid."""
    robot, coordinates = source.robot, source.coordinates
    known = {parameter.name: parameter for parameter in robot.parameters}
    if len(axes) not in (1, 2):
        raise InputError(f"A basin has one or two axes, got {len(axes)}: {', '.join(axes) or 'none'}.")
    varied = {name: values for name, values in axes.items() if name in known}
    for name, values in varied.items():
        for value in values:
            known[name].check(value)
    constant = {**source.parameters, **{name: value for name, value in fixed.items() if name in known}}
    constant = {name: value for name, value in constant.items() if name not in axes}
    # Bounds between parameters are satisfied on the whole grid if they are in its corners.
    corners = itertools.product(*((values.min(), values.max()) for values in varied.values()))
    resolved = [robot.resolve({**constant, **dict(zip(varied, corner, strict=True))}) for corner in corners]
    for name in (*axes, *fixed):
        if name not in (*coordinates, *known):
            raise InputError(
                f"Robot {robot.name!r} has no coordinate or parameter {name!r}. {suggest(name, (*coordinates, *known))}"
            )
    start = {name: value for name, value in source.complete(fixed).items() if name not in axes}
    return BasinWalk(source, resolved[0], start, dict(axes), criterion)


def walk_starts(walk: BasinWalk, index: Index) -> tuple[Index, Endings]:
    """Run a task: walk from the starts with these numbers, in C order of the axes."""
    places = np.unravel_index(index, tuple(values.size for values in walk.axes.values()))
    columns = [values[place].tolist() for values, place in zip(walk.axes.values(), places, strict=True)]
    endings = list(walk.endings(zip(*columns, strict=True)))
    labels = tuple(dict.fromkeys(ending.label for ending in endings))
    outcome = np.array([labels.index(ending.label) for ending in endings], dtype=np.int16)
    steps = np.array([ending.steps for ending in endings], dtype=np.int32)
    return index, Endings(labels, outcome, steps, np.array([ending.z for ending in endings]))
