"""Sweeps: optimal gaits of several words over ranges of friction, speed, step or anything else."""

import shutil
from collections.abc import Mapping, MutableMapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.motion.atomic import check_writable
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.motion.word import Word
from gaitopt.ocp.method import check_count
from gaitopt.ocp.problem import GaitProblem
from gaitopt.study.attempt import best, finished, found_cold, leading, objective, own_starts, proven, scouted
from gaitopt.study.gait_folder import GaitFolder
from gaitopt.study.grid import Duty, Grid, axis_values, tasks
from gaitopt.study.parcel import Prepare
from gaitopt.study.question import question
from gaitopt.study.runner import Observer, collect_tasks, run_tasks
from gaitopt.study.sweep_file import Findings, held_sweep, to_dataset, write_sweep
from gaitopt.study.verdict import IMPOSSIBLE, LOST, PENDING, UNFINISHED
from gaitopt.study.vocabulary import closed_words

if TYPE_CHECKING:
    import xarray as xr


def sweep(
    problem: GaitProblem,
    *,
    friction: Sequence[float] | Array | None = None,
    speed: Sequence[float] | Array | None = None,
    step_length: Sequence[float] | Array | None = None,
    slope: Sequence[float] | Array | None = None,
    parameters: Mapping[str, Sequence[float] | Array] | None = None,
    words: Sequence[Word | str] | None = None,
    starts: int = 3,
    workers: int = 1,
    executor: Executor | None = None,
    prepare: Prepare | None = None,
    path: str | Path | None = None,
    observer: Observer | None = None,
) -> "xr.Dataset":
    """Find the optimal gait of each word at each point of a grid, and replay it.

    Each point starts from its neighbours, in both directions along every axis, and keeps the cheapest gait.  The answer
    does not depend on the number of workers, nor on how often the sweep was stopped and gone on with.

    Parameters
    ----------
    problem : GaitProblem
        What does not change over the grid.
    friction, speed, step_length, slope : sequence of float, optional
        Axes, increasing [1, m/s, m, rad].
    parameters : mapping of str to sequence of float, optional
        Further axes, by the robot's parameters (SI units).
    words : sequence of Word or str, optional
        The problem's own word if none are given; each of them closed.
    starts : int
        Starts tried where there is no neighbour to start from.
    workers : int
        Processes.
    executor : concurrent.futures.Executor, optional
        Solves the points instead of own processes: a :class:`DaskCluster`, or any other, `workers` tasks at a time.
    prepare : callable, optional
        Called once in each process, to import what the problem needs.
    path : str or Path, optional
        NetCDF file for the result.  Until it is complete, ``PATH.parts`` beside it keeps every finished gait: the same
        call goes on from there after any end.
    observer : callable, optional
        Called with (gaits computed, gaits in all).

    Returns
    -------
    xarray.Dataset
        Over ``word`` and the axes, nan where there is no gait; ``status`` and ``reason`` say why.  Its attribute
        ``complete`` is 0 if the sweep was interrupted.  The gaits themselves: :func:`gaitopt.load_sweep_gait`.

    Raises
    ------
    InputError
        If an axis, a number or a word cannot be, a word leaves something open, no point can be posed, or the file holds
        another study.
    ArchiveError
        If the disk is full, for example; what was finished is kept.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, sweep
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), word="stick | stick", speed=0.6, step_length=0.45, limits=Limits(torque=6),
    ...     objective="torque_squared", transcription=MultipleShooting(intervals=12),
    ... )
    >>> found = sweep(problem, friction=[0.19, 0.2], starts=1)
    >>> found.status.values.tolist(), found.cost_of_transport.dims
    ([['solved', 'solved']], ('word', 'friction'))
    """
    check_count("starts", starts, 1, 1000)
    named = {"friction": friction, "speed": speed, "step_length": step_length, "slope": slope}
    axes = axis_values({name: axis for name, axis in named.items() if axis is not None} | dict(parameters or {}))
    spelled = closed_words([problem.word] if words is None else words, "A sweep")
    grid = Grid(problem, spelled, axes, starts)
    listed = {name: values.tolist() for name, values in axes.items()}
    asked = question(problem, words=[str(word) for word in spelled], axes=listed, starts=starts)
    if path is None:
        return to_dataset(_found(grid, asked, {}, observer, workers, executor, prepare))
    path = Path(path)
    parts = GaitFolder.beside(path)
    held = held_sweep(path, asked)
    if held is None:
        check_writable(path)
        folder = GaitFolder(parts, asked)
        findings = _found(grid, asked, folder, observer, workers, executor, prepare)
        write_sweep(findings, path, sum(folder.file(key).stat().st_size for key in folder if key.startswith("point-")))
        held = to_dataset(findings)
    if held.attrs["complete"]:
        shutil.rmtree(parts, ignore_errors=True)
    return held


def _found(
    grid: Grid,
    asked: dict[str, Any],
    kept: MutableMapping[str, Gait],
    observer: Observer | None,
    workers: int,
    executor: Executor | None,
    prepare: Prepare | None,
) -> Findings:
    """Compute what is not kept yet and keep it; an interrupt ends this early."""
    planned = tasks(grid)
    running = run_tasks(solve_task, planned, grid, known=kept, workers=workers, executor=executor, prepare=prepare)
    lost = collect_tasks(running, kept, planned, observer)
    missing = {point: (IMPOSSIBLE, reason) for point, reason in grid.impossible.items()}
    for point in grid.points():
        key = f"point-{point.name}"
        if point not in missing and key not in kept:
            missing[point] = (LOST, lost[key]) if key in lost else (PENDING, UNFINISHED)
    return Findings(grid, kept, missing, asked)


def solve_task(grid: Grid, duty: Duty, *found: Gait | None) -> Gait:
    """Do one task of a sweep: a coarse gait from starts of its own or from neighbours, or the proven best of a point.

    Neighbours are tried on the coarse grid, which tells good gaits from bad ones at a fraction of the cost; only what
    has proved best there is solved on the problem's own grid.
    """
    problem = grid.problem_at(duty.point)
    gaits = [gait for gait in found if gait is not None]
    if duty.kind == "point":
        coarse = sorted((gait for gait in gaits if gait.status.ok), key=objective)
        ready = finished(problem, coarse) if coarse else gaits
        if not any(gait.status.ok for gait in ready):
            ready = [*ready, *found_cold(problem, grid.starts)]
        return proven(problem, ready)
    if duty.kind == "cold" or not gaits:
        return leading(problem, scouted(problem, own_starts(problem, grid.starts)))
    own = [gait for gait in found[-1:] if duty.own and gait is not None]
    return _continued(problem, own, [gait for gait in gaits if gait not in own])


def _continued(problem: GaitProblem, own: list[Gait], neighbours: list[Gait]) -> Gait:
    """Return the best of a point's own gait and one from its best neighbour; a failure is handed on."""
    reached = list(own)
    for start in sorted(neighbours, key=objective):
        if start.status.ok:
            reached.append(scouted(problem, [start])[0])
            if reached[-1].status.ok:
                break
    return best(reached or neighbours)
