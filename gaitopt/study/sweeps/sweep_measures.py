"""Further columns of a sweep: stability, recovery and other metrics of its gaits, and the sequence of lowest cost."""

import contextlib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.errors import InputError, suggest
from gaitopt.motion.planar_gait import AnyGait, PlanarGait
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.problem import GaitProblem
from gaitopt.parallel.execution import Execution
from gaitopt.parallel.runner import collect_tasks, run_tasks
from gaitopt.parallel.task_graph import Task
from gaitopt.study.gait_metrics import MEASURES, GaitMetric
from gaitopt.study.planar_metrics import CONTACT_MEASURES, PLANAR_MEASURES
from gaitopt.study.sequence_search.planar_search import judge_planar_gait
from gaitopt.study.sequence_search.ranking import RankedGait, judge_gait, rank_gaits
from gaitopt.study.stability_metrics import measure_multipliers, measure_recovered_push
from gaitopt.study.sweeps.sweep_grid import SweepGrid, SweepPoint

if TYPE_CHECKING:
    import xarray as xr

STABILITY, RECOVERY = "stability", "recovery"

RESERVED = {metric.name for metric in (*MEASURES, *PLANAR_MEASURES, *CONTACT_MEASURES)} | {
    *("peak_torque", "status", "reason", "verified", "replay_error", "lowest_sequence", "spectral_radius", "stable"),
    *("multiplier_real", "multiplier_imag", "recovered_push", STABILITY, RECOVERY),
}
"""Names of variables that a metric of a user cannot have."""

Measure = str | GaitMetric
Columns = dict[str, Any]


def check_measures(measures: Sequence[Measure], problem: GaitProblem | PlanarProblem) -> tuple[Measure, ...]:
    """Return measures without repetitions.

    Raises
    ------
    InputError
        If a name is unknown, a metric has the name of a variable of every sweep, or recovery is requested of a robot
        with several contacts.
    """
    stated = [measures] if isinstance(measures, str | GaitMetric) else list(measures)
    for measure in stated:
        if isinstance(measure, GaitMetric) and measure.name in RESERVED:
            raise InputError(f"A sweep has a variable {measure.name!r} already; choose another name for the metric.")
        if not isinstance(measure, GaitMetric) and measure not in (STABILITY, RECOVERY):
            raise InputError(f"A sweep has no measure {measure!r}. {suggest(str(measure), (STABILITY, RECOVERY))}")
        if measure == RECOVERY and isinstance(problem, PlanarProblem):
            raise InputError("The measure 'recovery' is not available for robots with several contacts.")
    return tuple(dict.fromkeys(stated))


def name_measures(measures: Sequence[Measure]) -> list[str]:
    """Return the names of measures."""
    return [measure.name if isinstance(measure, GaitMetric) else measure for measure in measures]


def measure_gaits(
    grid: SweepGrid,
    gaits: Mapping[SweepPoint, AnyGait],
    measures: Sequence[Measure],
    execution: Execution,
) -> Columns | None:
    """Return the columns of measures over the points of a sweep, nan without a solved gait; None after an interrupt.

    Parameters
    ----------
    grid : SweepGrid
    gaits : mapping of SweepPoint to Gait or PlanarGait
    measures : sequence of str or GaitMetric
    execution : Execution
    """
    solved = {point.name: (point, gait) for point, gait in gaits.items() if gait.status.ok}
    tasks = [Task(name, gait, label=f"{grid.describe(point)} (measures)") for name, (point, gait) in solved.items()]
    results: dict[str, dict[str, Any]] = {}
    running = run_tasks(_measure_gait, tasks, tuple(measures), execution=execution)
    lost: dict[str, str] = {}
    with contextlib.suppress(KeyboardInterrupt):
        lost = collect_tasks(running, results, tasks, execution.observer).failures
    if len(results) + len(lost) < len(tasks):
        return None
    values = {solved[name][0]: result for name, result in results.items()}
    columns: Columns = {}
    for measure in measures:
        if isinstance(measure, GaitMetric):
            attributes = {"units": measure.unit, "long_name": measure.meaning}
            columns[measure.name] = _scalars(grid, values, measure.name, attributes)
    if RECOVERY in measures:
        attributes = {"units": "rad/s", "long_name": "largest ball of recovered pushes in open loop"}
        columns["recovered_push"] = _scalars(grid, values, RECOVERY, attributes)
    return columns | (_stability_columns(grid, values) if STABILITY in measures else {})


def _measure_gait(measures: tuple[Measure, ...], gait: Any) -> dict[str, Any]:
    """Run a task: the values of all measures of a gait."""
    values: dict[str, Any] = {}
    for measure in measures:
        if isinstance(measure, GaitMetric):
            values[measure.name] = float(measure.read(gait))
        else:
            values[measure] = measure_multipliers(gait) if measure == STABILITY else measure_recovered_push(gait)
    return values


def _scalars(grid: SweepGrid, values: Mapping[SweepPoint, Any], name: str, attributes: dict[str, str]) -> Any:
    column = np.full(grid.shape, np.nan)
    for point, result in values.items():
        column[point.place] = result[name]
    return ("sequence", *grid.axes), column, attributes


def _stability_columns(grid: SweepGrid, values: Mapping[SweepPoint, Any]) -> Columns:
    """Return spectral radius, stability and multipliers in open loop."""
    count = max((result[STABILITY].size for result in values.values()), default=0)
    multipliers = np.full((*grid.shape, count), np.nan, dtype=complex)
    for point, result in values.items():
        multipliers[point.place][: result[STABILITY].size] = result[STABILITY]
    radius = np.abs(multipliers[..., 0]) if count else np.full(grid.shape, np.nan)
    dims = ("sequence", *grid.axes)
    text = "multiplier of the return map in open loop, the largest magnitude first"
    return {
        "spectral_radius": (dims, radius, {"units": "1", "long_name": "spectral radius in open loop"}),
        "stable": (dims, (radius < 1).astype(np.int8), {"units": "1", "long_name": "1 where the gait is stable"}),
        "multiplier_real": ((*dims, "multiplier"), multipliers.real, {"units": "1", "long_name": f"real part, {text}"}),
        "multiplier_imag": (
            (*dims, "multiplier"),
            multipliers.imag,
            {"units": "1", "long_name": f"imaginary part, {text}"},
        ),
    }


def find_lowest_sequences(grid: SweepGrid, gaits: Mapping[SweepPoint, AnyGait]) -> Any:
    """Return the variable with the contact sequence of lowest cost at each point of the axes; empty without a gait.

    As in a search, a gait with a phase of minimum duration counts only if no gait with fewer phases has its cost.
    """
    lowest = np.full(grid.shape[1:], "", dtype=object)
    shortest = grid.problem.limits.shortest_phase
    for index in np.ndindex(*grid.shape[1:]):
        candidates = [gaits.get(SweepPoint(number, index)) for number in range(grid.shape[0])]
        findings = [_judge(gait, shortest) for gait in candidates if gait is not None]
        if findings and (first := rank_gaits(findings, complete=True).findings[0]).ranked:
            lowest[index] = str(first.sequence)
    return tuple(grid.axes), lowest, {"long_name": "contact sequence of lowest cost"}


def _judge(gait: Any, shortest: float) -> RankedGait:
    return (judge_planar_gait if isinstance(gait, PlanarGait) else judge_gait)(gait, shortest, None)


def read_measures(table: "xr.Dataset | None") -> set[str]:
    """Return the names of the measures that the table of a sweep contains."""
    text = "" if table is None else str(table.attrs.get("measures", ""))
    return set(text.split(", ")) - {""}
