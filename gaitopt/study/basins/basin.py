"""Basins: in which gait, or how, walks end that start on a grid."""

import itertools
from collections.abc import Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path

import numpy as np

from gaitopt.control.law import Law, passive
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.parallel.runner import Observer, collect_tasks, run_tasks
from gaitopt.parallel.shared_payload import Prepare
from gaitopt.parallel.task_graph import Task
from gaitopt.parameters import Parameter
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.study.basins.attractor import SettlingCriterion
from gaitopt.study.basins.basin_file import Basin, load_basin
from gaitopt.study.basins.basin_record import BasinRecord
from gaitopt.study.basins.basin_walk import axis_values_of, walk_over, walk_starts
from gaitopt.study.storage.gait_store import check_same_study

CHUNK = 200
"""Starts handed to a worker at once."""


def basin(
    robot: Robot,
    parameters: Mapping[str, float],
    axes: Mapping[str, Sequence[float] | Array],
    *,
    base: Mapping[str, float] | None = None,
    law: Law | None = None,
    patience: SettlingCriterion | None = None,
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
    patience : SettlingCriterion, optional
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
    values = {name: axis_values_of(name, points) for name, points in axes.items()}
    law = law or passive(robot)
    engine = engine or default_engine(law, robot)
    walk = walk_over(robot, parameters, values, base or {}, law, patience or SettlingCriterion(), engine)
    known = Basin.empty(robot.name, walk.parameters, walk.base, values, walk.method())
    if path is not None and Path(path).exists():
        held = load_basin(path)
        check_same_study(held.question(), known.question(), Path(path))
        known = held
    pending = np.flatnonzero(known.pending())
    planned = [Task(str(i), pending[i : i + CHUNK]) for i in range(0, pending.size, CHUNK)]
    kept = BasinRecord(known, None if path is None else Path(path))
    running = run_tasks(walk_starts, planned, walk, workers=workers, executor=executor, prepare=prepare)
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
    patience: SettlingCriterion | None = None,
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
    >>> from gaitopt import rimless_wheel
    >>> from gaitopt.study import basin_edges
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
    axes, engine = {coordinate: points}, engine or default_engine(law, robot)
    walk = walk_over(robot, parameters, axes, base or {}, law, patience or SettlingCriterion(), engine)

    def ending(value: float) -> str:
        return next(walk.endings([(value,)])).label

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
