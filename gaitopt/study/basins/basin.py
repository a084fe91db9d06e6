"""Basins of attraction: the endings of walks from a grid of initial states."""

import functools
import itertools
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.parallel.execution import Execution
from gaitopt.parallel.runner import collect_tasks, run_tasks
from gaitopt.parallel.task_graph import Task
from gaitopt.parameters import Parameter
from gaitopt.simulation.engine import Engine
from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
from gaitopt.study.basins.attractor import SettlingCriterion
from gaitopt.study.basins.basin_file import PENDING, basin_key, endings_of, load_basin
from gaitopt.study.basins.basin_record import BasinRecord
from gaitopt.study.basins.basin_source import make_source
from gaitopt.study.basins.basin_walk import BasinWalk, axis_values_of, walk_over, walk_starts
from gaitopt.study.storage.gait_store import check_same_study
from gaitopt.study.storage.netcdf_file import import_packages
from gaitopt.study.storage.study_lock import lock_study

if TYPE_CHECKING:
    import xarray as xr

    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine  # imports scipy

CHUNK = 200
"""Number of starts in a task."""


@check_arguments
def basin(
    robot: Robot | PlanarWalkProblem | PlanarGait,
    fixed: Mapping[str, float],
    axes: Mapping[str, Sequence[float] | Array],
    *,
    law: Law | PlanarLaw | None = None,
    criterion: SettlingCriterion | None = None,
    engine: "Engine | PlanarEngine | None" = None,
    execution: Execution | None = None,
    path: str | Path | None = None,
) -> "xr.Dataset":
    """Return the endings of walks that start on a grid of one or two axes.

    Parameters
    ----------
    robot : Robot, PlanarWalkProblem or PlanarGait
        For a robot with several contacts, the walking problem or the optimised gait whose periodic gait completes the
        starts.
    fixed : mapping of str to float
        Parameters of robot and ground, and coordinates of the start, that do not vary.  Parameters not named keep their
        defaults, coordinates not named are 0.  For a robot with several contacts, coordinates not named have the values
        of its gait, changed as little as possible such that the feet stand on the ground.
    axes : mapping of str to sequence of float
        One or two names with their values: coordinates of the section after touchdown (``th1``, ``theta_rate``,
        ``foot_speed``, ...) or parameters (``slope``, ``friction``, ...).
    law : Law or PlanarLaw, optional
        Passive by default; a PlanarGait replays its torques.
    criterion : SettlingCriterion, optional
    engine : Engine or PlanarEngine, optional
        By default the fastest installed engine that supports the law; for robots with several contacts, scipy.
    execution : Execution, optional
        Workers, and the observer of (starts done, starts in all); this process alone by default.
    path : str or Path, optional
        NetCDF file that stores finished starts; the same call with the same file resumes.

    Returns
    -------
    xarray.Dataset
        Over the axes: ``ending``, a number whose meaning :func:`ending_labels` returns, or -1 if the start is pending
        after an interrupt or the death of workers; ``steps`` until the ending; ``final``, the last point on the
        section.  Its attribute ``complete`` is 0 if starts are pending.

    Raises
    ------
    InputError
        If an axis, a parameter or a coordinate is unknown or its value invalid, or the file belongs to another basin.
    ArchiveError
        If the file is not writable, such as on a full disk, or another process computes it; its earlier content is
        kept.

    Examples
    --------
    >>> import math
    >>> from gaitopt import basin, rimless_wheel
    >>> from gaitopt.study import ending_labels
    >>> table = basin(rimless_wheel(), {"slope": math.radians(13)}, {"theta_rate": [0.1, 2.0, 4.0]})
    >>> ending_labels(table).tolist()
    ['fell', 'stick | stick', 'lift_off']
    """
    values = {name: axis_values_of(name, points) for name, points in axes.items()}
    execution, path = execution or Execution(), None if path is None else Path(path)
    walk = walk_over(make_source(robot, law, engine), fixed, values, criterion or SettlingCriterion())
    if path is None:
        return _compute_basin(walk, execution, None)
    with lock_study(path):
        return _compute_basin(walk, execution, path)


def _compute_basin(walk: BasinWalk, execution: Execution, path: Path | None) -> "xr.Dataset":
    """Walk from the starts that the file does not have yet."""
    known = walk.pending()
    if path is not None and path.exists():
        stored = load_basin(path)
        check_same_study(basin_key(stored), walk.key(), path)
        known = endings_of(stored)
    pending = np.flatnonzero(known.outcome == PENDING)
    planned = [Task(str(i), pending[i : i + CHUNK]) for i in range(0, pending.size, CHUNK)]
    record, observer = BasinRecord(known, walk.basin, path), execution.observer
    packages = functools.partial(import_packages, path)
    running = run_tasks(walk_starts, planned, walk, execution=execution, meanwhile=packages)
    with record:
        collect_tasks(running, record, planned, observer and (lambda *_: observer(record.finished, known.outcome.size)))
    return record.basin()


@check_arguments
def locate_basin_edges(
    robot: Robot | PlanarWalkProblem | PlanarGait,
    fixed: Mapping[str, float],
    axes: Mapping[str, Sequence[float] | Array],
    *,
    law: Law | PlanarLaw | None = None,
    tolerance: float = 1e-9,
    criterion: SettlingCriterion | None = None,
    engine: "Engine | PlanarEngine | None" = None,
) -> tuple[tuple[float, str, str], ...]:
    """Return the values at which the ending changes along one axis: (value, ending below, ending above).

    Parameters
    ----------
    fixed : mapping of str to float
        As in :func:`basin`.
    axes : mapping of str to sequence of float
        One coordinate of the section or parameter with increasing values, at least two: each change of the ending
        between neighbours is located by bisection.
    tolerance : float
        Width to which a change is located.

    Raises
    ------
    InputError
        If the axis is unknown, its values do not increase, or the tolerance is not positive.

    Examples
    --------
    >>> import math
    >>> import numpy as np
    >>> from gaitopt import rimless_wheel
    >>> from gaitopt.study import locate_basin_edges
    >>> rates = {"theta_rate": np.linspace(0.1, 3.0, 6)}
    >>> edges = locate_basin_edges(rimless_wheel(), {"slope": math.radians(13)}, rates, tolerance=1e-3)
    >>> [(below, above) for _, below, above in edges]
    [('fell', 'stick | stick'), ('stick | stick', 'lift_off')]
    """
    Parameter("tolerance", 1e-9, "1", "", lower=0, lower_open=True).check(tolerance)
    if len(axes) != 1:
        raise InputError(f"The edges of a basin require one axis, got {len(axes)}: {', '.join(axes) or 'none'}.")
    ((name, values),) = axes.items()
    points = axis_values_of(name, values)
    if points.size < 2 or np.any(np.diff(points) <= 0):
        raise InputError(f"The axis {name!r} needs increasing values, at least two, got {points.tolist()}.")
    walk = walk_over(make_source(robot, law, engine), fixed, {name: points}, criterion or SettlingCriterion())

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
