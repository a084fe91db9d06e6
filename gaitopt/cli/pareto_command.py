"""The command pareto: the front of optimal gaits between the cost and other quantities."""

import functools
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import numpy as np
import typer

from gaitopt.cli.options import Json, Quiet, Scheduler, ScriptFile, Setting, Verbose, Workers
from gaitopt.cli.output import exit_incomplete, print_json, print_reason, report_file
from gaitopt.cli.progress_display import show_progress
from gaitopt.cli.workers import worker_options
from gaitopt.errors import InputError
from gaitopt.motion.printable import format_count

if TYPE_CHECKING:
    import xarray as xr


Objectives = Annotated[
    str,
    typer.Option(
        metavar="NAME,NAME,...",
        help="Quantities of the front: cost (the objective of the script) and at least one of peak_torque, "
        "peak_friction_demand and speed (bounded), spectral_radius (bounded if --bounds states its range, otherwise "
        "computed for each gait of the front) and recovered_push (computed for each gait). The last two refer to the "
        "gait in open loop.",
    ),
]
Ranges = Annotated[
    list[str] | None,
    typer.Option(
        "--bounds",
        metavar="NAME=LOWER:UPPER",
        help="Range of the bound on a quantity, in SI units (repeatable).",
        show_default="from the gait of lowest cost to the best value",
    ),
]


def pareto(
    script: ScriptFile,
    objectives: Objectives = "cost,peak_torque",
    points: Annotated[int, typer.Option(min=2, max=1000, help="Number of values of the bound on each quantity.")] = 20,
    bounds: Ranges = None,
    starts: Annotated[
        int,
        typer.Option(
            min=1,
            max=100,
            help="Number of initial guesses, the best result of which is kept, at the ends of the front; all other "
            "points are warm-started.",
        ),
    ] = 1,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="NC", help="File of the results. Run the same command again to resume."),
    ] = None,
    figure: Annotated[Path | None, typer.Option(metavar="PNG/PDF/SVG", help="File of the figure.")] = None,
    setting: Setting = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Compute the Pareto front of gaits between the cost and other quantities, and mark its knee.

    The cost is minimised at each of several bounds on a quantity, warm-started from both ends of the front; every gait
    is replayed.  Exit status 0 if a gait was found, 1 otherwise.

    Example: gaitopt pareto problems/compass_slip.py --objectives cost,peak_torque -o front.nc --figure front.png
    """
    from gaitopt.cli.script import load_script, optimal_problem, read_script
    from gaitopt.study.trade_offs.pareto import Pareto

    began, problem = time.perf_counter(), optimal_problem(read_script(script, setting))
    names = tuple(name.strip() for name in objectives.split(","))
    options = Pareto(objectives=names, points=points, bounds=_read_bounds(bounds or []), starts=starts)
    with (
        worker_options(workers, scheduler) as team,
        show_progress("Pareto front", hidden=json, counted="optimisations") as display,
    ):
        execution = team.execution(display.count, functools.partial(load_script, script.resolve()))
        table = options.trace(problem, execution=execution, path=output)
    files = {"file": output, "figure": _draw(table, figure)}
    _report(table, files, json=json, seconds=time.perf_counter() - began)


def _report(table: "xr.Dataset", files: dict[str, Path | None], *, json: bool, seconds: float) -> NoReturn:
    """Print a front as a table or as JSON, and end with the exit status of the command."""
    if json:
        written = {kind: None if file is None else str(file) for kind, file in files.items()}
        print_json(front_facts(table) | written | {"seconds": seconds})
    else:
        print_front(table)
        for kind, file in files.items():
            if file is not None and (kind == "figure" or table.attrs["complete"]):
                report_file(file)
    if not table.attrs["complete"]:
        exit_incomplete("pareto", files["file"], f"{_describe_progress(table)} are written to {files['file']}")
    found = bool((table.status == "solved").any())
    if not found:
        reasons = [str(reason) for reason in table.reason.values.ravel() if reason]
        print_reason(f"No point of the front has a gait: {reasons[0] if reasons else 'no reason is known'}")
    raise typer.Exit(0 if found else 1)


def _describe_progress(table: "xr.Dataset") -> str:
    """Return how many points of a front are computed, in words; those with a gait and without its measures are not."""
    from gaitopt.study.storage.failure_reason import PENDING

    unmeasured = np.isnan([table[name].values for name in table.attrs["objectives"]]).any(axis=0)
    status = table.status.values
    missing = int(((status == PENDING) | ((status == "solved") & unmeasured)).sum())
    return f"{status.size - missing} of {format_count(status.size, 'point')}"


def _read_bounds(texts: list[str]) -> dict[str, tuple[float, float]]:
    """Return ranges written ``NAME=LOWER:UPPER``."""
    ranges = {}
    for text in texts:
        name, _, ends = text.partition("=")
        try:
            lower, upper = (float(end) for end in ends.split(":"))
        except ValueError:
            raise InputError(f"--bounds must have the form NAME=LOWER:UPPER, got {text!r}.") from None
        ranges[name.strip()] = (lower, upper)
    return ranges


def _draw(table: "xr.Dataset", path: Path | None) -> Path | None:
    if path is None:
        return None
    from gaitopt.plot.front_figure import plot_front
    from gaitopt.plot.saving import save_figure

    return save_figure(plot_front(table), path)


def front_facts(table: "xr.Dataset") -> dict[str, Any]:
    """Return a front as plain data, a record for each point."""
    points = []
    for number in range(table.sizes["point"]):
        row = {str(name): table[name].values[number] for name in table.data_vars}
        points.append(row | {name: bool(row[name]) for name in ("front", "knee", "verified")})
    names = [str(name) for name in table.attrs["objectives"]]
    return {"complete": bool(table.attrs["complete"]), "objectives": names, "points": points}


def print_front(table: "xr.Dataset") -> None:
    """Print a front as a table, the knee in green and dominated gaits in yellow, and the reasons of failures."""
    from rich import box
    from rich.table import Table

    from gaitopt.cli.output import out

    names = [str(name) for name in table.attrs["objectives"]]
    shown = Table(box=box.SIMPLE, pad_edge=False)
    for name in names:
        label = (table.attrs["objective"] if name == "cost" else name).replace("_", " ")
        unit = table[name].attrs.get("units", "1")
        shown.add_column(label if unit in ("", "1") else f"{label} [{unit}]", no_wrap=True)
    shown.add_column("", no_wrap=True)
    for number, status in enumerate(table.status.values):
        if status != "solved":
            shown.add_row(*("-" for _ in names), str(status), style="red")
            continue
        knee, member = bool(table.knee.values[number]), bool(table.front.values[number])
        remark = "knee" if knee else "" if member else "dominated"
        style = "green" if knee else "" if member else "yellow"
        shown.add_row(*(f"{table[name].values[number]:.6g}" for name in names), remark, style=style)
    out.print(shown)
    for reason in sorted({str(reason) for reason in table.reason.values if reason})[:5]:
        out.print(reason, soft_wrap=True)
