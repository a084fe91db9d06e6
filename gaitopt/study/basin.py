"""Basins: in which gait, or how, walks end that start on a grid."""

import dataclasses
import hashlib
import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.control.law import Law, passive
from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.parameters import Parameter
from gaitopt.simulation.arc import Engine
from gaitopt.simulation.engines import default_engine
from gaitopt.simulation.walker import Walker
from gaitopt.stability.section import Section
from gaitopt.study.basin_file import Basin, load_basin
from gaitopt.study.basin_record import BasinRecord, Endings, Index
from gaitopt.study.crew import Prepare
from gaitopt.study.gait_folder import check_same_question
from gaitopt.study.runner import Observer, collect_tasks, run_tasks
from gaitopt.study.settling import Ending, Patience, settle
from gaitopt.study.task import Task

CHUNK = 200
"""Starts handed to a worker at once."""


@dataclass(frozen=True, eq=False)
class _Duty:
    """What a worker needs to know, sent once."""

    robot: Robot
    parameters: dict[str, float]
    base: dict[str, float]
    axes: dict[str, Array]
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
    executor: Executor | None = None,
    prepare: Prepare | None = None,
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
    executor : concurrent.futures.Executor, optional
        Walks instead of own processes: a :class:`DaskCluster`, or any other, `workers` tasks at a time.
    prepare : callable, optional
        Called once in each process, to import what the walker needs.
    path : str or Path, optional
        File that keeps what is done; the same call with the same file goes on where it was stopped.
    observer : callable, optional
        Called with (starts done, starts in all).

    Returns
    -------
    Basin
        With starts pending if it was interrupted, or if processes died over them.

    Raises
    ------
    InputError
        If an axis or a coordinate is unknown, or the file belongs to another basin.
    ArchiveError
        If the disk is full, for example; what the file held is kept.

    Examples
    --------
    >>> import math
    >>> from gaitopt import basin, rimless_wheel
    >>> found = basin(rimless_wheel(), {"slope": math.radians(13)}, {"theta_rate": [0.1, 2.0, 4.0]})
    >>> found.labels_on_grid().tolist()
    ['fell', 'stick | stick', 'lift_off']
    """
    values = {name: _values(name, points) for name, points in axes.items()}
    law = law or passive(robot)
    duty = _duty(robot, parameters, values, base or {}, law, patience or Patience(), engine or default_engine(law))
    known = Basin.empty(robot.name, robot.resolve(duty.parameters), duty.base, values, _method(duty))
    if path is not None and Path(path).exists():
        held = load_basin(path)
        check_same_question(held.question(), known.question(), Path(path))
        known = held
    pending = np.flatnonzero(known.pending())
    planned = [Task(str(i), pending[i : i + CHUNK]) for i in range(0, pending.size, CHUNK)]
    kept = BasinRecord(known, None if path is None else Path(path))
    running = run_tasks(_walk, planned, duty, workers=workers, executor=executor, prepare=prepare)
    with kept:
        collect_tasks(running, kept, planned, observer and (lambda *_: observer(kept.finished, known.size)))
    return kept.basin()


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

    Raises
    ------
    InputError
        If the coordinate is unknown, or the interval, the number of samples or the tolerance cannot be.

    Examples
    --------
    >>> import math
    >>> from gaitopt import basin_edges, rimless_wheel
    >>> downhill = {"slope": math.radians(13)}
    >>> edges = basin_edges(rimless_wheel(), downhill, "theta_rate", 0.1, 3.0, samples=6, tolerance=1e-3)
    >>> [(below, above) for _, below, above in edges]
    [('fell', 'stick | stick'), ('stick | stick', 'lift_off')]
    """
    Parameter("samples", 40, "1", "", lower=2, whole=True).check(samples)
    Parameter("tolerance", 1e-9, "1", "", lower=0, lower_open=True).check(tolerance)
    if not -np.inf < lower < upper < np.inf:
        raise InputError(f"The interval of {coordinate} needs finite ends, the lower first: got {lower} and {upper}.")
    points, law = np.linspace(lower, upper, samples), law or passive(robot)
    axes, engine = {coordinate: points}, engine or default_engine(law)
    duty = _duty(robot, parameters, axes, base or {}, law, patience or Patience(), engine)

    def ending(value: float) -> str:
        return next(_endings(duty, [(value,)])).label

    def between(a: float, below: str, b: float, above: str) -> list[tuple[float, str, str]]:
        if below == above:
            return []
        middle = float((a + b) / 2)
        if b - a <= tolerance or not a < middle < b:
            return [(middle, below, above)]
        label = ending(middle)
        return [*between(a, below, middle, label), *between(middle, label, b, above)]

    labels = [ending(value) for value in points]
    spans = zip(points, labels, points[1:], labels[1:], strict=False)
    return tuple(itertools.chain.from_iterable(itertools.starmap(between, spans)))


def _values(name: str, points: Sequence[float] | Array) -> Array:
    """Return the values of an axis, shape (n,)."""
    try:
        values = np.array(points, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"The axis {name!r} needs numbers, got {points!r}.") from None
    if values.ndim != 1 or values.size == 0 or not np.all(np.isfinite(values)):
        raise InputError(f"The axis {name!r} needs finite values, at least one.")
    return values


def _duty(
    robot: Robot,
    parameters: Mapping[str, float],
    axes: Mapping[str, Array],
    base: Mapping[str, float],
    law: Law,
    patience: Patience,
    engine: Engine,
) -> _Duty:
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
        if name in known:
            for value in values:
                robot.resolve({**fixed, name: value})
    for name in base:
        if name not in coordinates:
            raise InputError(f"The section of {robot.name!r} has no coordinate {name!r}. {suggest(name, coordinates)}")
    start = {name: float(base.get(name, 0.0)) for name in coordinates if name not in axes}
    return _Duty(robot, fixed, start, dict(axes), law, patience, engine)


def _method(duty: _Duty) -> dict[str, Any]:
    """Return what the answer depends on besides robot, parameters and starts, as plain data."""
    law = hashlib.sha256(duty.law.torque.serialize().encode())
    law.update(duty.law.breakpoints.tobytes() + duty.law.table.tobytes())
    return {"law": duty.law.name, "law_digest": law.hexdigest(), **dataclasses.asdict(duty.patience)}


def _walk(duty: _Duty, index: Index) -> tuple[Index, Endings]:
    """Do a task: walk from some starts, given by their numbers in C order of the axes."""
    places = np.unravel_index(index, tuple(values.size for values in duty.axes.values()))
    columns = [values[place].tolist() for values, place in zip(duty.axes.values(), places, strict=True)]
    found = list(_endings(duty, zip(*columns, strict=True)))
    labels = tuple(dict.fromkeys(ending.label for ending in found))
    outcome = np.array([labels.index(ending.label) for ending in found], dtype=np.int16)
    steps = np.array([ending.steps for ending in found], dtype=np.int32)
    return index, Endings(labels, outcome, steps, np.array([ending.z for ending in found]))


def _endings(duty: _Duty, points: Iterable[tuple[float, ...]]) -> Iterator[Ending]:
    robot = duty.robot
    known = {parameter.name for parameter in robot.parameters}
    walker, last = None, None
    for point in points:
        given = dict(zip(duty.axes, point, strict=True))
        parameters = {name: value for name, value in given.items() if name in known}
        if walker is None or parameters != last:
            p = robot.vector(robot.resolve({**duty.parameters, **parameters}))
            walker, last = Walker(robot, duty.law, p, duty.engine), parameters
            section = Section(robot, p, sliding=True)
        start = {**duty.base, **given}
        yield settle(walker, np.array([start[name] for name in section.names]), duty.patience)
