"""Pareto: the front of optimal gaits between the cost and other quantities."""

import contextlib
import functools
import json
import shutil
from collections.abc import Iterable, Mapping, MutableMapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.errors import GaitoptError, InputError, NoGaitError
from gaitopt.motion.atomic import check_writable
from gaitopt.motion.planar_gait import AnyGait
from gaitopt.parallel.execution import Execution
from gaitopt.parallel.runner import collect_tasks, run_tasks
from gaitopt.parallel.task_graph import Task
from gaitopt.parameters import check_type, whole_number
from gaitopt.study.storage.gait_store import GaitStore, check_same_study
from gaitopt.study.storage.netcdf_file import import_packages
from gaitopt.study.storage.study_key import study_key
from gaitopt.study.storage.study_lock import lock_study
from gaitopt.study.trade_offs.front_grid import FrontEnds, FrontGrid, solve_front_task, space_bounds
from gaitopt.study.trade_offs.front_solves import solves_of
from gaitopt.study.trade_offs.front_table import Front, load_front, measure_point, tabulate_front, write_front
from gaitopt.study.trade_offs.quantity import COST, QUANTITIES, AnyProblem, Quantity, quantity_named, restrict_speed

if TYPE_CHECKING:
    import xarray as xr


def _as_names(names: Iterable[str]) -> tuple[str, ...]:
    return (names,) if isinstance(names, str) else tuple(names)


def _check_objectives(options: "Pareto", attribute: Any, names: tuple[str, ...]) -> None:
    if len(names) < 2 or names[0] != COST or len(set(names)) < len(names):
        raise InputError(
            f"objectives must be '{COST}' and at least one other quantity, without repetitions, got {list(names)}."
        )
    if not any(quantity.name in options.bounds or quantity.extreme for quantity in options.quantities):
        bounded = ", ".join(name for name, quantity in QUANTITIES.items() if quantity.extreme)
        raise InputError(
            f"{' and '.join(names[1:])} cannot span a front: add a quantity that can be bounded, one "
            f"of {bounded}, or set bounds for spectral_radius."
        )


def _check_bounds(options: "Pareto", attribute: Any, bounds: Mapping[str, tuple[float, float]]) -> None:
    for name, pair in bounds.items():
        if name not in options.objectives or QUANTITIES[name].restrict is None:
            raise InputError(
                f"bounds: {name!r} is not a bounded quantity of the objectives {list(options.objectives)}."
            )
        if len(pair) != 2 or not pair[0] < pair[1]:
            raise InputError(f"bounds of {name} must be a pair (lower, upper), got {pair!r}.")


@check_arguments
@frozen(kw_only=True)
class Pareto:
    """A trade-off between the cost of a problem and other quantities of its gaits.

    The front is computed by the epsilon-constraint method: the cost is minimised at each of several bounds on every
    quantity.  Chains of warm starts lead from the gait of lowest cost to the tightest bounds and back.  All points have
    the same grid: that of the problem, or 40 intervals of a sticking phase if it states none.

    Attributes
    ----------
    objectives : tuple of str
        ``"cost"``, the objective of the problem, and one or more of ``peak_torque``, ``peak_friction_demand`` and
        ``speed``, which are bounded, of ``spectral_radius``, which is bounded if its bounds are stated and measured
        otherwise, and of ``recovered_push``, which is measured.  The last two refer to the gait in open loop.
    points : int
        Number of values of the bound on each quantity.
    bounds : mapping of str to (float, float)
        Range of the bounds of a quantity; by default from its value in the gait of lowest cost to its best value.
    starts : int
        Number of starts of the gaits at the ends of the front.

    Raises
    ------
    InputError
        If a name is unknown, no quantity is bounded, or a number is invalid.

    Examples
    --------
    >>> Pareto(objectives=("cost", "peak_torque"), points=5).points
    5
    """

    objectives: tuple[str, ...] = field(default=(COST, "peak_torque"), converter=_as_names, validator=_check_objectives)
    points: int = field(default=20, validator=whole_number(2))
    bounds: Mapping[str, tuple[float, float]] = field(factory=dict, validator=_check_bounds)
    starts: int = field(default=1, validator=whole_number())

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """The quantities, the cost first."""
        return tuple(map(quantity_named, self.objectives))

    @property
    def bounded(self) -> tuple[Quantity, ...]:
        """The quantities that are bounded; the others are measured."""
        return tuple(each for each in self.quantities if each.extreme is not None or each.name in self.bounds)

    def trace(
        self, problem: AnyProblem, *, execution: Execution | None = None, path: str | Path | None = None
    ) -> "xr.Dataset":
        """Compute the front; results depend neither on the number of workers nor on interrupts.

        Parameters
        ----------
        problem : GaitProblem or PlanarProblem
        execution : Execution, optional
            Workers, and the observer of (gaits computed, gaits in all); this process alone by default.
        path : str or Path, optional
            NetCDF file for the result.  Until it is complete, the folder ``PATH.parts`` stores every finished gait,
            from which the same call resumes.

        Returns
        -------
        xarray.Dataset
            Over ``point``: the quantities by name, the bounds, the cost from either end of the front, ``front``, which
            is 1 for gaits that no other gait dominates, ``knee``, which is 1 at the point farthest from the straight
            line (or plane) between the ends of the front, and ``status``.  Its attribute ``complete`` is 0 if the
            computation was interrupted.

        Raises
        ------
        InputError
            If the problem is not suitable: it has an open sequence, there is no gait at an end, there is no trade-off,
            or the file contains a different study.
        GaitoptError
            If worker processes repeatedly terminate.
        ArchiveError
            If the file is not writable.

        Examples
        --------
        >>> from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped
        >>> problem = GaitProblem(
        ...     robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=0.6, step_length=0.45,
        ...     limits=Limits(torque=6), objective="torque_squared", transcription=MultipleShooting(intervals=12),
        ... )
        >>> front = Pareto(points=3).trace(problem)
        >>> front.status.values.tolist(), bool((front.front == 1).all())
        (['solved', 'solved', 'solved'], True)
        """
        check_type("problem", problem, AnyProblem, "a GaitProblem(...) or a PlanarProblem(...)")
        problem.sequence.require_closed("A trade-off")
        solves_of(problem).check(problem)
        for quantity in self.bounded:
            if quantity.require is not None:
                quantity.require(problem)
        base = self._front_problem(problem)
        key = study_key(
            base,
            objectives=list(self.objectives),
            points=self.points,
            bounds={name: list(pair) for name, pair in self.bounds.items()},
            starts=self.starts,
        )
        find = functools.partial(self._find, base, key, execution or Execution())
        return tabulate_front(find({})) if path is None else _resume_file(Path(path), key, find)

    def _front_problem(self, problem: AnyProblem) -> AnyProblem:
        """Return the problem of all points on one grid, with the stated speed as the lowest one of the front.

        Nodes that follow the torques would change the cost from point to point by more than it differs between ends.
        """
        base: AnyProblem = solves_of(problem).fix_grid(problem)
        if "speed" in self.objectives:
            base = restrict_speed(base, problem.speed_range.lower or 1e-3)
        return base

    def _find(
        self, problem: AnyProblem, key: dict[str, Any], execution: Execution, kept: MutableMapping[str, AnyGait]
    ) -> Front:
        """Solve the ends, then the front between them, then measure what is not bounded."""
        tightest = {name: pair[quantity_named(name).sign < 0] for name, pair in self.bounds.items()}
        ends = FrontEnds(problem, self.bounded, self.starts, tightest)
        planned = ends.tasks()
        quiet = Execution(workers=execution.workers, executor=execution.executor, prepare=execution.prepare)
        packages = functools.partial(import_packages, kept.path if isinstance(kept, GaitStore) else None)
        running = run_tasks(solve_front_task, planned, ends, known=kept, execution=quiet, meanwhile=packages)
        report = collect_tasks(running, kept, planned, None)
        if report.failures:
            raise GaitoptError(f"An end of the front was not computed: {next(iter(report.failures.values()))}.")
        if report.interrupted:
            raise KeyboardInterrupt
        grid = FrontGrid(ends, tuple(self._bounds_of(quantity, kept) for quantity in self.bounded))
        planned = grid.tasks()
        running = run_tasks(solve_front_task, planned, grid, known=kept, execution=execution)
        front = Front(grid, self.quantities, kept, key, {})
        try:
            report = collect_tasks(running, kept, planned, execution.observer)
        except KeyboardInterrupt:
            return front  # with its ends
        return front if report.interrupted else replace(front, measured=self._measure(grid, kept, quiet))

    def _bounds_of(self, quantity: Quantity, kept: Mapping[str, AnyGait]) -> Any:
        """Return the bounds of a quantity from the loosest to the tightest."""
        if quantity.name in self.bounds:
            loose, tight = self.bounds[quantity.name][:: -quantity.sign]
            return space_bounds(quantity, loose, tight, self.points, inner=0.0)
        values = []
        for name in (COST, quantity.name):
            gait = kept[f"end-{name}"]
            if not gait.status.ok:
                raise NoGaitError(f"No gait was found at the end of the front with the best {name}: {gait.status.hint}")
            values.append(quantity.read(gait))
        return space_bounds(quantity, values[0], values[1], self.points)

    def _measure(
        self, grid: FrontGrid, kept: Mapping[str, AnyGait], execution: Execution
    ) -> dict[str, dict[str, float]]:
        """Return the measured quantities of each solved point by the key of the point."""
        bounded = {quantity.name for quantity in self.bounded}
        measured = tuple(quantity.name for quantity in self.quantities[1:] if quantity.name not in bounded)
        keys = [task.key for task in grid.tasks() if task.argument.kind == "point"]
        tasks = [Task(key, kept[key]) for key in keys if measured and key in kept and kept[key].status.ok]
        values: dict[str, dict[str, float]] = {}
        failures: dict[str, str] = {}
        with contextlib.suppress(KeyboardInterrupt):  # the gaits are computed
            running = run_tasks(measure_point, tasks, measured, execution=execution)
            failures = collect_tasks(running, values, tasks, None).failures
        if failures:
            raise GaitoptError(f"A quantity of the front was not measured: {next(iter(failures.values()))}.")
        return values


def _resume_file(path: Path, key: dict[str, Any], find: Any) -> "xr.Dataset":
    """Return the front of a file; gaits that are missing are solved, and each is stored when it is finished.

    Only one process at a time computes a file.
    """
    parts, table = GaitStore.beside(path), _read_complete(path, key)
    if table is not None and not parts.exists():  # an interrupt may have come before the parts were removed
        return table
    check_writable(path)
    with lock_study(path):
        table = _read_complete(path, key)  # another process may have finished it
        if table is None:
            folder = GaitStore(parts, key)
            front = find(folder)
            gaits = [folder.file(name) for name in folder if name.startswith("point-")]
            table = write_front(front, path, sum(file.stat().st_size for file in gaits))
        if table.attrs["complete"]:
            shutil.rmtree(parts, ignore_errors=True)
    return table


def _read_complete(path: Path, key: dict[str, Any]) -> "xr.Dataset | None":
    """Return the front in a file; None if none exists or it is not complete."""
    if not path.exists():
        return None
    table = load_front(path)
    check_same_study(json.loads(table.attrs["question"]), key, path)
    return table if table.attrs["complete"] else None
