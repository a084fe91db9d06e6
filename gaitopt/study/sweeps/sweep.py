"""Sweeps: optimal gaits of several contact sequences over ranges of friction, speed, step length and others."""

import functools
import shutil
from collections.abc import Callable, Mapping, MutableMapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
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
from gaitopt.parallel.shared_payload import Work
from gaitopt.study.gait_metrics import GaitMetric
from gaitopt.study.sequence_search.planar_search import list_planar_sequences
from gaitopt.study.sequence_search.sequence_enumeration import closed_sequences, enumerate_sequences
from gaitopt.study.storage.failure_reason import IMPOSSIBLE, LOST, PENDING, UNFINISHED
from gaitopt.study.storage.gait_store import GaitStore
from gaitopt.study.storage.netcdf_file import import_packages
from gaitopt.study.storage.study_key import study_key
from gaitopt.study.storage.study_lock import lock_study
from gaitopt.study.sweeps.planar_sweep import solve_planar_task
from gaitopt.study.sweeps.sweep_file import (
    SweepResults,
    count_pending,
    read_named_gaits,
    read_stored_sweep,
    to_dataset,
    write_sweep,
)
from gaitopt.study.sweeps.sweep_grid import SweepGrid, axis_values, plan_sweep
from gaitopt.study.sweeps.sweep_measures import check_measures, measure_gaits, name_measures, read_measures
from gaitopt.study.sweeps.sweep_task import solve_task, solve_unstored_task

if TYPE_CHECKING:
    import xarray as xr

FindResults = Callable[[MutableMapping[str, Any], "xr.Dataset | None"], SweepResults]
"""Solves and measures the points that are not among known gaits and not in the table of a file."""


@check_arguments
def sweep(
    problem: GaitProblem | PlanarProblem,
    axes: Mapping[str, Sequence[float] | Array],
    *,
    sequences: Sequence[ContactSequence | PhaseSequence | str] | str | None = None,
    measures: Sequence[str | GaitMetric] = (),
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
        The contact sequence of the problem by default; each without open phases.  ``"any"`` for all sequences of at
        most two phases, ``"any:3"`` of at most three.
    measures : sequence of str or GaitMetric, optional
        Further columns: ``"stability"`` (spectral radius, multipliers and stability in open loop), ``"recovery"`` (the
        largest ball of pushes from which the walker returns, in open loop), and any metric.  They can be added to a
        file later: its gaits are not solved again.  A measure that the file contains is not evaluated again either, so
        a metric that has changed needs another name.
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
        Over ``sequence`` and the axes, nan where there is no gait; ``status`` and ``reason`` state why.
        ``lowest_sequence`` names the contact sequence of lowest cost at each point.  Its attribute
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
    measures = check_measures(measures, problem)
    execution, values = execution or Execution(), axis_values(axes)
    closed = _sequences_of(problem, sequences)
    grid = SweepGrid(problem, closed, values, starts)
    listed = {name: axis.tolist() for name, axis in values.items()}
    key = study_key(problem, sequences=[str(sequence) for sequence in closed], axes=listed, starts=starts)
    find = functools.partial(_solve_grid, grid, key, execution, measures)
    if path is None:
        return to_dataset(find({}, None))
    return _resume_file(Path(path), key, find, set(name_measures(measures)))


def _sequences_of(
    problem: GaitProblem | PlanarProblem, sequences: Sequence[ContactSequence | PhaseSequence | str] | str | None
) -> tuple[ContactSequence, ...] | tuple[PhaseSequence, ...]:
    """Return the contact sequences of a sweep; raise InputError if one is invalid or the robot fails its check."""
    if isinstance(sequences, str):
        sequences = _expand_any(problem, sequences)
    if isinstance(problem, PlanarProblem):
        chosen = [problem.sequence] if sequences is None else sequences
        parsed = [PhaseSequence.parse(str(sequence), problem.robot) for sequence in chosen]
        return tuple(sequence.require_closed("A sweep") for sequence in parsed)
    require_valid_step(problem.robot)
    stated = [problem.sequence] if sequences is None else [ContactSequence.parse(str(each)) for each in sequences]
    return closed_sequences(stated, "A sweep")


def _expand_any(problem: GaitProblem | PlanarProblem, text: str) -> Sequence[ContactSequence | PhaseSequence | str]:
    """Return all sequences of at most two phases for ``any``, of N for ``any:N``; other text is one sequence."""
    name, _, count = text.strip().partition(":")
    if name != "any":
        return [text]
    if count and not count.isdecimal():
        raise InputError(f"sequences must be 'any' or 'any:N' with a whole number N of phases, got {text!r}.")
    phases = int(count or 2)
    if isinstance(problem, PlanarProblem):
        return list_planar_sequences(problem, phases, None)
    return enumerate_sequences(phases)


def _solve_grid(
    grid: SweepGrid,
    key: dict[str, Any],
    execution: Execution,
    measures: Sequence[str | GaitMetric],
    kept: MutableMapping[str, Gait],
    stored: "xr.Dataset | None",
) -> SweepResults:
    """Solve the points that are not stored yet and store them, and measure all; an interrupt ends this early."""
    unsolved = [p for p in grid.points() if p not in grid.impossible and f"point-{p.name}" not in kept]
    planned = plan_sweep(grid) if unsolved else []
    in_memory = not isinstance(kept, GaitStore) and (execution.workers > 1 or execution.executor is not None)
    solve: Work = solve_unstored_task if in_memory else solve_task
    if isinstance(grid.problem, PlanarProblem):
        solve = solve_planar_task
    packages = functools.partial(import_packages, kept.path if isinstance(kept, GaitStore) else None)
    running = run_tasks(solve, planned, grid, known=kept, execution=execution, meanwhile=packages)
    report = collect_tasks(running, kept, planned, execution.observer)
    missing = {point: (IMPOSSIBLE, reason) for point, reason in grid.impossible.items()}
    for point in grid.points():
        name = f"point-{point.name}"
        if point not in missing and name not in kept:
            missing[point] = (LOST, report.failures[name]) if name in report.failures else (PENDING, UNFINISHED)
    findings, known = SweepResults(grid, kept, missing, key), read_measures(stored)
    wanted = [measure for measure in measures if not known.issuperset(name_measures([measure]))]
    if not wanted or findings.pending:
        return findings
    columns = None if report.interrupted else measure_gaits(grid, findings.found, wanted, execution)
    if columns is None:
        return replace(findings, interrupted=True)
    return replace(findings, columns=columns, measures=tuple(name_measures(wanted)))


def _resume_file(path: Path, key: dict[str, Any], find: FindResults, measures: set[str]) -> "xr.Dataset":
    """Return the sweep of a file; missing points are solved, and each gait is stored when it is finished.

    Measures that a complete file does not have are added to it.

    Only one process at a time computes a file.  A file with more points than the new result stays.
    """
    parts = GaitStore.beside(path)
    table = read_stored_sweep(path, key)
    if table is not None and table.attrs["complete"] and not parts.exists() and measures <= read_measures(table):
        return table
    check_writable(path)
    with lock_study(path):
        table = read_stored_sweep(path, key)  # another process may have finished it
        if table is None or not table.attrs["complete"]:
            table = _compute_file(path, table, key, find, parts)
        elif not measures <= read_measures(table):
            table = _add_measures(path, table, find)
        if table.attrs["complete"]:
            shutil.rmtree(parts, ignore_errors=True)
        return table


def _compute_file(
    path: Path,
    stored: "xr.Dataset | None",
    key: dict[str, Any],
    find: FindResults,
    parts: Path,
) -> "xr.Dataset":
    """Return the table of the file that is written, or the stored one if that has more computed points."""
    folder = GaitStore(parts, key)
    findings = find(folder, None)
    if stored is not None and count_pending(stored) < findings.pending:
        return stored
    files = [folder.file(name) for name in folder if name.startswith("point-")]
    return write_sweep(findings, path, sum(file.stat().st_size for file in files))


def _add_measures(path: Path, table: "xr.Dataset", find: FindResults) -> "xr.Dataset":
    """Return the sweep of a complete file with further measures, which are added to it unless interrupted."""
    gaits = {f"point-{name}": gait for name, gait in read_named_gaits(path)}
    findings = find(gaits, table)
    if findings.interrupted:
        return table.assign_attrs(complete=0)
    known = to_dataset(findings)
    names = [str(name) for name in table.data_vars if name not in known]
    former = {name: (table[name].dims, table[name].values, table[name].attrs) for name in names}
    measures = (*sorted(read_measures(table)), *findings.measures)
    findings = replace(findings, columns={**former, **findings.columns}, measures=measures)
    return write_sweep(findings, path, path.stat().st_size)
