"""Sweeps: optimal gaits of several contact sequences over ranges of friction, speed, step length and others."""

import contextlib
import functools
import importlib
import shutil
import threading
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.arguments import check_arguments
from gaitopt.model.step_check import require_valid_step
from gaitopt.motion.atomic import check_writable
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.transcription.method import check_count
from gaitopt.parallel.execution import Execution
from gaitopt.parallel.runner import collect_tasks, run_tasks
from gaitopt.study.sequence_search.sequence_enumeration import closed_sequences
from gaitopt.study.storage.failure_reason import IMPOSSIBLE, LOST, PENDING, UNFINISHED
from gaitopt.study.storage.gait_store import GaitStore
from gaitopt.study.storage.study_key import study_key
from gaitopt.study.storage.study_lock import lock_study
from gaitopt.study.sweeps.planar_sweep import solve_planar_task
from gaitopt.study.sweeps.sweep_file import SweepResults, count_pending, read_stored_sweep, to_dataset, write_sweep
from gaitopt.study.sweeps.sweep_grid import SweepGrid, axis_values, plan_sweep
from gaitopt.study.sweeps.sweep_task import solve_task

if TYPE_CHECKING:
    import xarray as xr


@check_arguments
def sweep(
    problem: GaitProblem | PlanarProblem,
    axes: Mapping[str, Sequence[float] | Array],
    *,
    sequences: Sequence[ContactSequence | PhaseSequence | str] | None = None,
    starts: int = 3,
    execution: Execution | None = None,
    path: str | Path | None = None,
) -> "xr.Dataset":
    """Find the optimal gait of each contact sequence at each point of a grid, and replay it.

    Each point is warm-started from its neighbours, in both directions along every axis, and keeps the gait of lowest
    cost; a backward solve that to first order leads to the gait already known is omitted.  Results depend neither on
    the number of workers nor on interrupts.

    Parameters
    ----------
    problem : GaitProblem or PlanarProblem
        Problem whose other fields are constant over the grid.
    axes : mapping of str to sequence of float
        Increasing values of ``friction`` [1], ``speed`` [m/s], ``step_length`` [m], ``slope`` [rad] or parameters
        of the robot (SI units), by name.
    sequences : sequence of ContactSequence, PhaseSequence or str, optional
        The contact sequence of the problem by default; each without open phases.
    starts : int
        Number of starts at points without a neighbour to start from.
    execution : Execution, optional
        Workers, and the observer of (gaits computed, gaits in all); this process alone by default.
    path : str or Path, optional
        NetCDF file for the result.  Until it is complete, the folder ``PATH.parts`` stores every finished gait, from
        which the same call resumes.

    Returns
    -------
    xarray.Dataset
        Over ``sequence`` and the axes, nan where there is no gait; ``status`` and ``reason`` state why.  Its attribute
        ``complete`` is 0 if the sweep was interrupted.  The gaits themselves: :func:`gaitopt.load_sweep_gait`.
        Robots with several contacts have slides, forces and impulses over ``contact``.

    Raises
    ------
    InputError
        If an axis, a number or a sequence is invalid, a sequence is open, no grid point is possible, the robot fails
        the check of :func:`gaitopt.solve`, or the file contains a different study.
    ArchiveError
        If the file is not writable, such as on a full disk, or another process computes it; finished gaits are kept.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, sweep
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", speed=0.6, step_length=0.45, limits=Limits(torque=6),
    ...     objective="torque_squared", transcription=MultipleShooting(intervals=12),
    ... )
    >>> table = sweep(problem, {"friction": [0.19, 0.2]}, starts=1)
    >>> table.status.values.tolist(), table.cost_of_transport.dims
    ([['solved', 'solved']], ('sequence', 'friction'))
    """
    check_count("starts", starts, 1, 1000)
    execution, values = execution or Execution(), axis_values(axes)
    closed = _sequences_of(problem, sequences)
    grid = SweepGrid(problem, closed, values, starts)
    listed = {name: axis.tolist() for name, axis in values.items()}
    key = study_key(problem, sequences=[str(sequence) for sequence in closed], axes=listed, starts=starts)
    if execution.executor is not None or execution.workers != 1:
        threading.Thread(target=_import_ahead, daemon=True).start()
    find = functools.partial(_solve_grid, grid, key, execution)
    if path is None:
        return to_dataset(find({}))
    return _resume_file(Path(path), key, find)


def _sequences_of(
    problem: GaitProblem | PlanarProblem, sequences: Sequence[ContactSequence | PhaseSequence | str] | None
) -> tuple[ContactSequence, ...] | tuple[PhaseSequence, ...]:
    """Return the contact sequences of a sweep; raise InputError if one is invalid or the robot fails its check."""
    if isinstance(problem, PlanarProblem):
        chosen = [problem.sequence] if sequences is None else sequences
        parsed = [PhaseSequence.parse(str(sequence), problem.robot) for sequence in chosen]
        return tuple(sequence.require_closed("A sweep") for sequence in parsed)
    require_valid_step(problem.robot)
    stated = [problem.sequence] if sequences is None else [ContactSequence.parse(str(each)) for each in sequences]
    return closed_sequences(stated, "A sweep")


def _import_ahead() -> None:
    """Import xarray while the workers run; the import takes as long as two solves."""
    with contextlib.suppress(ImportError):  # reported when the table is made
        importlib.import_module("xarray")


def _solve_grid(
    grid: SweepGrid,
    key: dict[str, Any],
    execution: Execution,
    kept: MutableMapping[str, Gait],
) -> SweepResults:
    """Solve the points that are not stored yet and store them; an interrupt ends this early."""
    planned = plan_sweep(grid)
    solve = solve_planar_task if isinstance(grid.problem, PlanarProblem) else solve_task
    running = run_tasks(solve, planned, grid, known=kept, execution=execution)
    lost = collect_tasks(running, kept, planned, execution.observer)
    missing = {point: (IMPOSSIBLE, reason) for point, reason in grid.impossible.items()}
    for point in grid.points():
        name = f"point-{point.name}"
        if point not in missing and name not in kept:
            missing[point] = (LOST, lost[name]) if name in lost else (PENDING, UNFINISHED)
    return SweepResults(grid, kept, missing, key)


def _resume_file(
    path: Path, key: dict[str, Any], find: Callable[[MutableMapping[str, Any]], SweepResults]
) -> "xr.Dataset":
    """Return the sweep of a file; missing points are solved, and each gait is stored when it is finished.

    One process computes a file at a time.  A file with more points than the new result stays.
    """
    parts = GaitStore.beside(path)
    table = read_stored_sweep(path, key)
    if table is not None and table.attrs["complete"] and not parts.exists():
        return table
    check_writable(path)
    with lock_study(path):
        table = read_stored_sweep(path, key)  # another process may have finished it
        if table is None or not table.attrs["complete"]:
            table = _compute_file(path, table, key, find, parts)
        if table.attrs["complete"]:
            shutil.rmtree(parts, ignore_errors=True)
        return table


def _compute_file(
    path: Path,
    stored: "xr.Dataset | None",
    key: dict[str, Any],
    find: Callable[[MutableMapping[str, Any]], SweepResults],
    parts: Path,
) -> "xr.Dataset":
    """Return the table of the file that is written, or the stored one if that has more computed points."""
    folder = GaitStore(parts, key)
    findings = find(folder)
    if stored is not None and count_pending(stored) < findings.pending:
        return stored
    files = [folder.file(name) for name in folder if name.startswith("point-")]
    return write_sweep(findings, path, sum(file.stat().st_size for file in files))
