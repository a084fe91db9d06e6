"""Basins: in which gait, or how, walks end that start on a grid."""

import dataclasses
import hashlib
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaitopt.control.law import Law, passive
from gaitopt.errors import GaitoptError, InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.arc import Engine
from gaitopt.simulation.engines import default_engine
from gaitopt.simulation.walker import Walker
from gaitopt.stability.section import Section
from gaitopt.study.basin_file import Basin, load_basin, save_basin
from gaitopt.study.runner import Observer, run_tasks
from gaitopt.study.settling import Patience, settle
from gaitopt.study.task import Task

CHUNK = 200
"""Starts handed to a worker at once."""


@dataclass(frozen=True, eq=False)
class _Task:
    """What a worker needs to know, sent once."""

    robot: Robot
    parameters: dict[str, float]
    base: dict[str, float]
    axes: tuple[str, ...]
    law: Law
    patience: Patience
    engine: Engine


def basin(
    robot: Robot,
    parameters: Mapping[str, float],
    axes: Mapping[str, Sequence[float] | Array],
    *,
    base: Mapping[str, float] | None = None,
    law: Law | None = None,
    patience: Patience | None = None,
    engine: Engine | None = None,
    workers: int = 1,
    path: str | Path | None = None,
    observer: Observer | None = None,
) -> Basin:
    """Return where walks end that start on a grid of one or two axes.

    Parameters
    ----------
    robot : Robot
    parameters : mapping of str to float
        Robot and ground parameters; those not named keep their defaults.
    axes : mapping of str to sequence of float
        One or two names with their values: coordinates of the section after touchdown (``th1``, ``theta_rate``,
        ``foot_speed``, ...) or parameters (``slope``, ``friction``, ...).
    base : mapping of str to float, optional
        The other coordinates of the start; 0 where not named.
    law : Law, optional
        Passive by default.
    patience : Patience, optional
    engine : Engine, optional
    workers : int
        Processes; the answer does not depend on their number.
    path : str or Path, optional
        File that keeps what is done; the same call with the same file goes on where it was stopped.
    observer : callable, optional
        Called with (starts done, starts in all).

    Returns
    -------
    Basin

    Raises
    ------
    InputError
        If an axis or a coordinate is unknown, or the file belongs to another basin.

    Examples
    --------
    >>> import math
    >>> from gaitopt import basin, rimless_wheel
    >>> found = basin(rimless_wheel(), {"slope": math.radians(13)}, {"theta_rate": [0.1, 2.0, 4.0]})
    >>> found.labels_on_grid().tolist()
    ['fell', 'stick | stick', 'lift_off']
    """
    values = {name: np.array(points, dtype=float) for name, points in axes.items()}
    law = law or passive(robot)
    task = _task(robot, parameters, values, base or {}, law, patience or Patience(), engine or default_engine(law))
    done = Basin.empty(robot.name, robot.resolve(task.parameters), task.base, values, _method(task))
    if path is not None and Path(path).exists():
        done = load_basin(path).check_same(done, path)
    open_starts = np.flatnonzero(done.pending())
    total, finished = done.size, done.size - open_starts.size
    chunks = {str(i): open_starts[i : i + CHUNK] for i in range(0, open_starts.size, CHUNK)}
    planned = [Task(key, _points(values, index)) for key, index in chunks.items()]
    try:
        for ended in run_tasks(_walk, planned, task, workers=workers):
            if ended.failure:
                raise GaitoptError(f"Some starts could not be walked: {ended.failure}. What was finished is kept.")
            index = chunks[ended.task.key]
            done = done.with_endings(index, ended.result)
            finished += index.size
            if observer is not None:
                observer(finished, total)
            if path is not None:
                save_basin(done, path)
    finally:
        if path is not None:
            save_basin(done, path)
    return done


def basin_edges(
    robot: Robot,
    parameters: Mapping[str, float],
    coordinate: str,
    lower: float,
    upper: float,
    *,
    base: Mapping[str, float] | None = None,
    law: Law | None = None,
    samples: int = 40,
    tolerance: float = 1e-9,
    patience: Patience | None = None,
    engine: Engine | None = None,
) -> tuple[tuple[float, str, str], ...]:
    """Return where the ending of walks changes along one coordinate: (value, ending below, ending above).

    Parameters
    ----------
    coordinate : str
        A coordinate of the section or a parameter.
    lower, upper : float
        Interval looked at, first at `samples` points; each change between neighbours is located by bisection.
    tolerance : float
        Width to which a change is located.

    Examples
    --------
    >>> import math
    >>> from gaitopt import basin_edges, rimless_wheel
    >>> downhill = {"slope": math.radians(13)}
    >>> edges = basin_edges(rimless_wheel(), downhill, "theta_rate", 0.1, 3.0, samples=6, tolerance=1e-3)
    >>> [(below, above) for _, below, above in edges]
    [('fell', 'stick | stick'), ('stick | stick', 'lift_off')]
    """
    points, law = np.linspace(lower, upper, samples), law or passive(robot)
    axes, engine = {coordinate: points}, engine or default_engine(law)
    task = _task(robot, parameters, axes, base or {}, law, patience or Patience(), engine)

    def ending(value: float) -> str:
        return _walk(task, [(value,)])[0][0]

    def between(a: float, below: str, b: float, above: str) -> list[tuple[float, str, str]]:
        if below == above:
            return []
        if b - a <= tolerance:
            return [(float((a + b) / 2), below, above)]
        middle = (a + b) / 2
        label = ending(middle)
        return [*between(a, below, middle, label), *between(middle, label, b, above)]

    labels = [ending(value) for value in points]
    spans = zip(points, labels, points[1:], labels[1:], strict=False)
    return tuple(itertools.chain.from_iterable(itertools.starmap(between, spans)))


def _task(
    robot: Robot,
    parameters: Mapping[str, float],
    axes: Mapping[str, Array],
    base: Mapping[str, float],
    law: Law,
    patience: Patience,
    engine: Engine,
) -> _Task:
    fixed = {name: float(value) for name, value in parameters.items() if name not in axes}
    known = [parameter.name for parameter in robot.parameters]
    p = robot.vector(robot.resolve(fixed))
    coordinates = Section(robot, p, sliding=True).names
    if len(axes) not in (1, 2):
        raise InputError(f"A basin has one or two axes, got {len(axes)}: {', '.join(axes) or 'none'}.")
    for name, values in axes.items():
        if name not in (*coordinates, *known):
            raise InputError(
                f"Robot {robot.name!r} has no coordinate or parameter {name!r}. {suggest(name, (*coordinates, *known))}"
            )
        if values.ndim != 1 or values.size == 0 or not np.all(np.isfinite(values)):
            raise InputError(f"The axis {name!r} needs finite values, at least one.")
        if name in known:
            for value in values:
                robot.resolve({**fixed, name: value})
    for name in base:
        if name not in coordinates:
            raise InputError(f"The section of {robot.name!r} has no coordinate {name!r}. {suggest(name, coordinates)}")
    start = {name: float(base.get(name, 0.0)) for name in coordinates if name not in axes}
    return _Task(robot, fixed, start, tuple(axes), law, patience, engine)


def _method(task: _Task) -> dict[str, Any]:
    """Return what the answer depends on besides robot, parameters and starts, as plain data."""
    law = hashlib.sha256(task.law.torque.serialize().encode())
    law.update(task.law.breakpoints.tobytes() + task.law.table.tobytes())
    return {"law": task.law.name, "law_digest": law.hexdigest(), **dataclasses.asdict(task.patience)}


Answer = tuple[str, Array, int]
Index = NDArray[np.intp]


def _points(axes: Mapping[str, Array], index: Index) -> list[tuple[float, ...]]:
    """Return the values on the axes of some starts."""
    places = np.unravel_index(index, tuple(values.size for values in axes.values()))
    columns = [values[place].tolist() for values, place in zip(axes.values(), places, strict=True)]
    return list(zip(*columns, strict=True))


def _walk(task: _Task, points: list[tuple[float, ...]]) -> list[Answer]:
    """Return the endings of some starts, given by their values on the axes."""
    robot, answers = task.robot, []
    known = {parameter.name for parameter in robot.parameters}
    walker, last = None, None
    for point in points:
        given = dict(zip(task.axes, point, strict=True))
        parameters = {name: value for name, value in given.items() if name in known}
        if walker is None or parameters != last:
            p = robot.vector(robot.resolve({**task.parameters, **parameters}))
            walker, last = Walker(robot, task.law, p, task.engine), parameters
            section = Section(robot, p, sliding=True)
        start = {**task.base, **given}
        ending = settle(walker, np.array([start[name] for name in section.names]), task.patience)
        answers.append((ending.label, ending.z, ending.steps))
    return answers


def grid(text: str) -> tuple[str, Array]:
    """Return name and values of an axis written ``NAME=FROM:TO:COUNT`` or ``NAME=VALUE,VALUE,...``.

    Raises
    ------
    InputError
        If it is not written so.

    Examples
    --------
    >>> grid("friction=0.1:0.3:3")
    ('friction', array([0.1, 0.2, 0.3]))
    """
    name, equals, values = text.partition("=")
    try:
        if not equals or not name.strip():
            raise ValueError
        if ":" in values:
            lower, upper, count = values.split(":")
            points = np.linspace(float(lower), float(upper), int(count))
        else:
            points = np.array([float(value) for value in values.split(",")])
        if points.size == 0 or not all(map(math.isfinite, points)):
            raise ValueError
    except ValueError:
        raise InputError(f"An axis is written NAME=FROM:TO:COUNT or NAME=VALUE,VALUE,..., got {text!r}.") from None
    return name.strip(), points
