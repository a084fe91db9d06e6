"""Output of the commands on studies."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from rich import box
from rich.table import Table
from rich.text import Text

from gaitopt.cli.output import out
from gaitopt.motion.gait import Gait
from gaitopt.motion.gait_table import format_objective, name_objective
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.printable import format_count
from gaitopt.motion.quantity_labels import in_shown_unit, show_unit
from gaitopt.motion.view_motion import view_motion
from gaitopt.study.comparison import Comparison
from gaitopt.study.sequence_search.ranking import Ranking, phase_durations, ranking_cost
from gaitopt.study.storage.failure_reason import PENDING
from gaitopt.study.sweeps.sweep_file import find_cost_variable, name_variable

if TYPE_CHECKING:
    import xarray as xr

MOST_COLUMNS = 4
"""Number of contact sequences up to which each has a column in the table of a sweep."""

MOST_POINTS = 3
"""Number of points that are listed for each reason why points have no gait."""


MOST_PENDING = 20
"""Number of contact sequences without result that are listed after an interrupt."""


def print_ranking(ranking: Ranking) -> None:
    """Print ranked contact sequences as a table, and the other ones with the reason."""
    ranked = [finding.gait for finding in ranking.findings if finding.ranked and finding.gait is not None]
    if ranked:
        out.print(_ranked_gaits(ranked))
    unranked = Table(box=box.SIMPLE, pad_edge=False)
    for column in ("not ranked", "status", "reason"):
        unranked.add_column(column, no_wrap=column != "reason")
    pending = 0
    for finding in ranking.findings:
        pending += finding.status == PENDING
        if not finding.ranked and (finding.status != PENDING or pending <= MOST_PENDING):
            unranked.add_row(str(finding.sequence), finding.status, finding.short_reason)
    if unranked.row_count:
        out.print(unranked)
    if pending > MOST_PENDING:
        out.print(f"{pending - MOST_PENDING} further pending")


def _ranked_gaits(gaits: Sequence[Gait | PlanarGait]) -> Table:
    """Return the table of ranked gaits; the second column is the number they are ranked by."""
    header, unit = name_objective(gaits[0].problem["objective"]), gaits[0].problem.get("objective_unit", "")
    shown = Table(box=box.SIMPLE, pad_edge=False)
    for column in (
        "sequence",
        header if unit in ("", "1") else f"{header} [{unit}]",
        "extra cost",
        "phases [ms]",
        "replay",
    ):
        shown.add_column(column, no_wrap=True)
    lowest = ranking_cost(gaits[0])
    for gait in gaits:
        value = ranking_cost(gait)
        phases = ", ".join(f"{mode} {1e3 * duration:.1f}" for mode, duration in phase_durations(gait))
        error = "" if gait.verification is None else f"state within {gait.verification.state_error:.0e}"
        shown.add_row(str(gait.sequence), f"{value:.6f}", f"{100 * (value / lowest - 1):.2f} %", phases, error)
    return shown


def print_comparison(comparison: Comparison) -> None:
    """Print a comparison of gaits as a table with one column per gait."""
    records = comparison.records()
    shown = Table(box=box.SIMPLE, pad_edge=False)
    shown.add_column("")
    several = any(isinstance(gait, PlanarGait) for gait in comparison.gaits.values())  # whose sequences are long
    for record in records:
        shown.add_column(record["label"], no_wrap=not several)
    rows: list[tuple[str, list[str]]] = [
        ("sequence", [record["sequence"] for record in records]),
        ("status", [record["status"] for record in records]),
        ("minimised", [_objective_text(record) for record in records]),
    ]
    for name, form, label in (
        ("friction", "g", "friction"),
        ("cost_of_transport", ".6f", "cost of transport"),
        ("speed", ".6g", "speed [m/s]"),
        ("step_length", ".6g", "step length [m]"),
        ("period", ".6g", "period [s]"),
        ("force_ratio", ".4f", "largest force ratio"),
        ("impulse_ratio", "+.4f", "impulse ratio"),
        ("largest_multiplier", ".4g", "largest multiplier"),
    ):
        if name in records[0]:
            rows.append((label, [_number(record[name], form) for record in records]))
    views = [view_motion(gait.motion) for gait in comparison.gaits.values()]
    for name, unit in dict.fromkeys((each.name, each.unit) for view in views for each in view.actuators):
        label = f"peak {name} {'torque' if unit == 'N m' else 'force'} [{unit}]"
        rows.append((label, [_number(record["peak_torque"].get(name, "-"), ".4g") for record in records]))
    energies = [record["energy_per_distance"] for record in records]
    for name in dict.fromkeys(name for energy in energies for name in energy):
        label = f"{name.replace('_', ' ')} [J/m]"
        rows.append((label, [_number(energy.get(name, 0.0), ".5f") for energy in energies]))
    for label, cells in rows:
        shown.add_row(label, *cells)
    out.print(shown)


def _objective_text(record: dict[str, Any]) -> str:
    """Return the minimised objective of a compared gait with its value."""
    value = math.nan if record["objective_value"] is None else record["objective_value"]
    return f"{name_objective(record['objective'])} {format_objective(value, record['objective_unit'])}"


def _number(value: float | str | None, form: str) -> str:
    """Return a number as a text; one that is rounded to zero has no minus sign."""
    if not isinstance(value, float):
        return "-" if value is None else str(value)
    sign = "+" if form.startswith("+") else ""
    return format(value, f"{sign}z{form.removeprefix('+')}")


def sweep_facts(table: "xr.Dataset") -> dict[str, Any]:
    """Return a sweep as plain data, a record for each point."""
    axes = [str(name) for name in table.status.dims if name != "sequence"]
    numbers = [
        "objective",
        "cost_of_transport",
        "impact_loss",
        "friction_loss",
        "actuator_work",
        "travel",
        *_name_measures(table),
    ]
    points = []
    for at in np.ndindex(*table.status.shape):
        place = dict(zip(table.status.dims, at, strict=True))
        point: dict[str, Any] = {"sequence": str(table.sequence.values[place["sequence"]])}
        point |= {name: float(table[name].values[place[name]]) for name in axes}
        point |= {name: table[name].values[at] for name in ("status", "reason", *numbers)}
        points.append(point | {"verified": bool(table.verified.values[at])})
    attributes = table.objective.attrs
    objective = {"objective": attributes.get("name"), "objective_unit": attributes.get("units", "1")}
    return {"complete": bool(table.attrs["complete"]), "axes": axes, **objective, "points": points}


def _header(table: "xr.Dataset", name: str) -> str:
    """Return the heading of a variable of a sweep: its name in words, or that of the objective, and its unit."""
    if name == "sequence":
        return name
    unit, label = table[name].attrs.get("units", "1"), name_variable(table, name).replace("_", " ")
    return label if unit in ("", "1") else f"{label} [{'deg' if unit == 'rad' else unit}]"


def _name_measures(table: "xr.Dataset") -> list[str]:
    """Return the measures of a sweep that are one number for each gait."""
    return [name for name in ("spectral_radius", "stable", "recovered_push") if name in table]


def _print_lowest(table: "xr.Dataset", axes: list[str]) -> None:
    """Print the contact sequence of lowest cost at each point, with its cost and its measures."""
    measured, single = _name_measures(table), table.sizes["sequence"] == 1
    shown = Table(box=box.SIMPLE, pad_edge=False, title=None if single else "lowest cost", title_justify="left")
    cost = find_cost_variable(table)
    for name in (*axes, "sequence", cost, *measured):
        shown.add_column(_header(table, name), no_wrap=True)
    sequences = [str(sequence) for sequence in table.sequence.values]
    for index in _computed_points(table):
        cells = [_show_value(table[name], i) for name, i in zip(axes, index, strict=True)]
        lowest = str(table.lowest_sequence.values[index])
        if not lowest:
            statuses = table.status.values[(slice(None), *index)]
            pending = bool((statuses == PENDING).any())
            failure = str(statuses[0]) if single else "no gait"
            shown.add_row(*cells, "not all sequences computed" if pending else failure, style="" if pending else "red")
            continue
        at = (sequences.index(lowest), *index)
        shown.add_row(*cells, lowest, *(_describe_value(table, n, at) for n in (cost, *measured)))
    out.print(shown)


def _describe_value(table: "xr.Dataset", name: str, at: tuple[int, ...]) -> str:
    """Return a variable of a sweep at a point as a text."""
    value = table[name].values[at]
    return ("yes" if value else "no") if name == "stable" else f"{value:.6g}"


def describe_progress(table: "xr.Dataset") -> str:
    """Return how many points of a sweep are computed, in words."""
    each = ", each contact sequence separately," if table.sizes["sequence"] > 1 else ""
    computed = int((table.status.values != PENDING).sum())
    return f"{computed} of {format_count(table.status.size, 'point')}{each}"


def print_sweep(table: "xr.Dataset", *, is_last: bool = True) -> None:
    """Print the objective of each sequence over the axes, the lowest in green, and the reasons of failures.

    The measures are those of the sequence of lowest cost; if there is one sequence, their table contains its objective.
    Unless another line states how many points are computed, the last one states how many are not.
    """
    axes = [str(name) for name in table.status.dims if name != "sequence"]
    count, measured = table.sizes["sequence"], bool(_name_measures(table))
    computed = bool(_computed_points(table))
    has_lowest = "lowest_sequence" in table and (measured or count > MOST_COLUMNS)
    if computed and has_lowest:
        _print_lowest(table, axes)
    if computed and count <= MOST_COLUMNS and not (has_lowest and count == 1):
        _print_costs(table, axes)
    _print_reasons(table)
    pending = int((table.status.values == PENDING).sum())
    if pending and is_last:
        each = ", each contact sequence separately" if table.sizes["sequence"] > 1 else ""
        out.print(f"{pending} of {format_count(table.status.size, 'point')} not yet computed{each}")


def _computed_points(table: "xr.Dataset") -> list[tuple[int, ...]]:
    """Return the indices along the axes of the points that are computed for a contact sequence at least."""
    pending = (table.status.values == PENDING).all(axis=0)
    return [index for index in np.ndindex(*pending.shape) if not pending[index]]


def _print_costs(table: "xr.Dataset", axes: list[str]) -> None:
    """Print the objective of each sequence at the computed points, the lowest in green."""
    sequences, name_of_cost = [str(sequence) for sequence in table.sequence.values], find_cost_variable(table)
    shown = Table(box=box.SIMPLE, pad_edge=False, title=_header(table, name_of_cost), title_justify="left")
    for name in axes:
        unit = show_unit(table[name].attrs.get("units", "1"))
        shown.add_column(name if unit == "1" else f"{name} [{unit}]", no_wrap=True)
    for sequence in sequences:
        shown.add_column(sequence, no_wrap=True)
    cost, status = table[name_of_cost].values, table.status.values
    for index in _computed_points(table):
        column = np.moveaxis(cost, 0, -1)[index]
        least = np.nanmin(column) if np.any(np.isfinite(column)) else np.nan
        cells: list[str | Text] = [_show_value(table[name], i) for name, i in zip(axes, index, strict=True)]
        for number, value in enumerate(column):
            if np.isfinite(value):
                cells.append(Text(f"{value:.6f}", style="green" if value == least else ""))
            else:
                cells.append(Text(str(status[(number, *index)]), style="red"))
        shown.add_row(*cells)
    out.print(shown)


def _show_value(axis: "xr.DataArray", place: int) -> str:
    """Return a value of an axis of a sweep in the unit of tables: an angle in degrees."""
    return f"{in_shown_unit(axis.values[place], axis.attrs.get('units', '1')):.6g}"


def first_reason(table: "xr.Dataset") -> str:
    """Return the first reason why a point of a sweep has no gait; empty if all points have one."""
    return next((str(reason) for reason in table.reason.values.ravel() if reason), "")


def _print_reasons(table: "xr.Dataset") -> None:
    """Print the first reasons why points of a sweep have no gait, with these points."""
    places: dict[str, list[str]] = {}
    for at in np.ndindex(*table.reason.shape):
        if table.status.values[at] != PENDING and (reason := str(table.reason.values[at])):
            places.setdefault(reason, []).append(_describe_point(table, at))
    for reason, points in list(places.items())[:5]:
        more = f" and {format_count(len(points) - MOST_POINTS, 'more point')}" if len(points) > MOST_POINTS else ""
        out.print(f"{'; '.join(points[:MOST_POINTS])}{more}: {reason}", soft_wrap=True)
    if len(places) > 5:
        out.print(f"... and {format_count(len(places) - 5, 'more reason')} in the file")


def _describe_point(table: "xr.Dataset", at: tuple[int, ...]) -> str:
    """Return the values of the axes at a point, and its contact sequence if there are several."""
    texts = []
    for name, i in zip(table.status.dims, at, strict=True):
        if name != "sequence":
            unit = show_unit(table[name].attrs.get("units", "1"))
            texts.append(f"{name} {_show_value(table[name], i)}" + ("" if unit == "1" else f" {unit}"))
        elif table.sizes["sequence"] > 1:
            texts.append(f"'{table.sequence.values[i]}'")
    return ", ".join(texts)
