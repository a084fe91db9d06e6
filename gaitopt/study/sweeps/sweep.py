"""Sweeps: optimal gaits of several contact sequences over ranges of friction, speed, step or anything else."""

import contextlib
import functools
import importlib
import shutil
import threading
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.model.step_check import require_valid_step
from gaitopt.motion.atomic import check_writable
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.transcription.method import check_count
from gaitopt.parallel.execution import Execution
from gaitopt.parallel.runner import collect_tasks, run_tasks
from gaitopt.study.sequence_search.sequence_enumeration import closed_sequences
from gaitopt.study.storage.failure_reason import IMPOSSIBLE, LOST, PENDING, UNFINISHED
from gaitopt.study.storage.gait_store import GaitStore
from gaitopt.study.storage.study_key import study_key
from gaitopt.study.sweeps.sweep_file import SweepResults, read_partial_sweep, to_dataset, write_sweep
from gaitopt.study.sweeps.sweep_grid import SweepGrid, axis_values, tasks
from gaitopt.study.sweeps.sweep_task import solve_task

if TYPE_CHECKING:
    import xarray as xr


def sweep(
    problem: GaitProblem,
    axes: Mapping[str, Sequence[float] | Array],
    *,
    sequences: Sequence[ContactSequence | str] | None = None,
    starts: int = 3,
    execution: Execution | None = None,
    path: str | Path | None = None,
) -> "xr.Dataset":
    """Find the optimal gait of each contact sequence at each point of a grid, and replay it.

    Each point starts from its neighbours, in both directions along every axis, and keeps the cheapest gait; a way back
    that would only lead to the gait already known, to first order, is spared.  Results depend neither on the number of
    workers nor on how often the sweep was interrupted and resumed.

    Parameters
    ----------
    problem : GaitProblem
        What does not change over the grid.
    axes : mapping of str to sequence of float
        Increasing values of ``friction`` [1], ``speed`` [m/s], ``step_length`` [m], ``slope`` [rad] or parameters
        of the robot (SI units), by name.
    sequences : sequence of ContactSequence or str, optional
        The problem's own contact sequence if none are given; each of them closed.
    starts : int
        Starts tried where there is no neighbour to start from.
    execution : Execution, optional
        Workers, and the observer of (gaits computed, gaits in all); this process alone by default.
    path : str or Path, optional
        NetCDF file for the result.  Until it is complete, ``PATH.parts`` beside it keeps every finished gait: the same
        call goes on from there after any end.

    Returns
    -------
    xarray.Dataset
        Over ``sequence`` and the axes, nan where there is no gait; ``status`` and ``reason`` say why.  Its attribute
        ``complete`` is 0 if the sweep was interrupted.  The gaits themselves: :func:`gaitopt.load_sweep_gait`.

    Raises
    ------
    InputError
        If an axis, a number or a sequence is invalid, a sequence is open, no grid point is possible, the robot fails
        the check of :func:`gaitopt.solve`, or the file holds another study.
    ArchiveError
        If the disk is full, for example; what was finished is kept.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, sweep
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", speed=0.6, step_length=0.45, limits=Limits(torque=6),
    ...     objective="torque_squared", transcription=MultipleShooting(intervals=12),
    ... )
    >>> found = sweep(problem, {"friction": [0.19, 0.2]}, starts=1)
    >>> found.status.values.tolist(), found.cost_of_transport.dims
    ([['solved', 'solved']], ('sequence', 'friction'))
    """
    check_count("starts", starts, 1, 1000)
    require_valid_step(problem.robot)
    execution, values = execution or Execution(), axis_values(axes)
    spelled = closed_sequences([problem.sequence] if sequences is None else sequences, "A sweep")
    grid = SweepGrid(problem, spelled, values, starts)
    listed = {name: axis.tolist() for name, axis in values.items()}
    asked = study_key(problem, sequences=[str(sequence) for sequence in spelled], axes=listed, starts=starts)
    if execution.executor is not None or execution.workers != 1:
        threading.Thread(target=_import_ahead, daemon=True).start()
    find = functools.partial(_found, grid, asked, execution)
    return to_dataset(find({})) if path is None else _filed(Path(path), asked, find)


def _import_ahead() -> None:
    """Import what the table needs while others work, which takes as long as two solves."""
    with contextlib.suppress(ImportError):  # told where the table is made
        importlib.import_module("xarray")


def _found(
    grid: SweepGrid,
    asked: dict[str, Any],
    execution: Execution,
    kept: MutableMapping[str, Gait],
) -> SweepResults:
    """Compute what is not kept yet and keep it; an interrupt ends this early."""
    planned = tasks(grid)
    running = run_tasks(solve_task, planned, grid, known=kept, execution=execution)
    lost = collect_tasks(running, kept, planned, execution.observer)
    missing = {point: (IMPOSSIBLE, reason) for point, reason in grid.impossible.items()}
    for point in grid.points():
        key = f"point-{point.name}"
        if point not in missing and key not in kept:
            missing[point] = (LOST, lost[key]) if key in lost else (PENDING, UNFINISHED)
    return SweepResults(grid, kept, missing, asked)


def _filed(path: Path, asked: dict[str, Any], find: Callable[[GaitStore], SweepResults]) -> "xr.Dataset":
    """Return the sweep a file holds; what is not there yet is found, and kept gait by gait on the way."""
    parts = GaitStore.beside(path)
    held = read_partial_sweep(path, asked)
    if held is None:
        check_writable(path)
        folder = GaitStore(parts, asked)
        findings = find(folder)
        room = sum(folder.file(key).stat().st_size for key in folder if key.startswith("point-"))
        held = write_sweep(findings, path, room)
    if held.attrs["complete"]:
        shutil.rmtree(parts, ignore_errors=True)
    return held
