"""Commands on many gaits: search, sweep, compare."""

import functools
import math
import re
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitopt.cli.options import (
    Figure,
    FigureWidth,
    FontSize,
    GaitFiles,
    Json,
    Measures,
    PointStarts,
    Quiet,
    RobotScript,
    Scheduler,
    ScriptFile,
    Sequences,
    Setting,
    StudyOutput,
    SweepAxes,
    Verbose,
    Workers,
    label_files,
)
from gaitopt.cli.output import describe_incomplete, err, exit_incomplete, print_json, print_reason, report_file
from gaitopt.cli.progress_display import show_progress
from gaitopt.cli.stored_results import count_finished_sequences
from gaitopt.cli.workers import worker_options
from gaitopt.motion.printable import format_count

if TYPE_CHECKING:
    from collections.abc import Callable

    from gaitopt.cli.progress_display import Display
    from gaitopt.motion.contact_sequence import ContactSequence
    from gaitopt.motion.motion import Array
    from gaitopt.motion.phase_sequence import PhaseSequence
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
    from gaitopt.ocp.problem import GaitProblem

MOST_POINTS = 100_000
"""Largest grid of a sweep: half a day of computation or more for each contact sequence."""


def search(
    script: ScriptFile,
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="FOLDER", help="Folder of the gaits. Run the same command again to resume."
        ),
    ],
    max_phases: Annotated[int, typer.Option(min=1, max=6, help="Maximum number of phases of a contact sequence.")] = 3,
    starts: Annotated[
        int,
        typer.Option(min=1, max=100, help="Number of initial guesses of each sequence, besides gaits of shorter ones."),
    ] = 4,
    setting: Setting = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Find the contact sequence of lowest cost: solve every sequence, replay each gait, and rank them.

    The search may be interrupted: the same command resumes it.  Exit status 0 if a contact sequence has a gait, 1 if
    none has.

    Example: gaitopt search problems/compass_slip.py --max-phases 2 -o sequences
    """
    from gaitopt.cli.script import load_script, optimal_problem, read_script
    from gaitopt.cli.study_output import print_ranking
    from gaitopt.study.sequence_search.search import search as search_sequences

    began, problem = time.perf_counter(), optimal_problem(read_script(script, setting))
    sequences = _list_sequences(problem, max_phases, hidden=json)
    with (
        worker_options(workers, scheduler) as team,
        show_progress("search", hidden=json, counted="optimisations") as display,
    ):
        ranking = search_sequences(
            problem,
            sequences=sequences,
            starts=starts,
            execution=team.execution(
                _sequence_counter(display, problem, output),
                functools.partial(load_script, script.resolve()),
                active_observer=display.show_active,
            ),
            directory=output,
        )
    if json:
        facts = {"complete": ranking.complete, "seconds": time.perf_counter() - began}
        error = {} if ranking.complete else {"error": describe_incomplete("search", output)}
        print_json({"ranked": ranking.records()} | facts | error)
    else:
        print_ranking(ranking)
        report_file(output)
    _exit("search", output, ranking.complete, ranking.findings[0].ranked, ranking.findings[0].reason)


def _list_sequences(
    problem: "GaitProblem | PlanarProblem", max_phases: int, *, hidden: bool
) -> "tuple[ContactSequence, ...] | tuple[PhaseSequence, ...]":
    """Return the contact sequences of a search, and print their number."""
    from gaitopt.study.sequence_search.search import list_sequences

    sequences = list_sequences(problem, max_phases)
    if not hidden:
        count = format_count(len(sequences), "contact sequence")
        err.print(f"search of {count} of at most {format_count(max_phases, 'phase')}", soft_wrap=True)
    return sequences


def _sequence_counter(
    display: "Display", problem: "GaitProblem | PlanarProblem", output: Path
) -> "Callable[[int, int], None]":
    """Return the observer of a search, which shows the finished sequences beside the optimisations."""
    from gaitopt.ocp.problem import GaitProblem
    from gaitopt.study.sequence_search.search import SOLVES

    solves = SOLVES if isinstance(problem, GaitProblem) else 1

    def count(done: int, total: int) -> None:
        finished = count_finished_sequences(output)
        display.count(done, total, f"({finished} of {total // solves} sequences finished)")

    return count


def sweep(
    script: ScriptFile,
    over: SweepAxes,
    output: StudyOutput,
    sequences: Sequences = None,
    measures: Measures = None,
    setting: Setting = None,
    starts: PointStarts = 3,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Find the optimal gait of each contact sequence at every point of a grid.

    The sweep may be interrupted: the same command resumes it.  Exit status 0 if a gait was found, 1 otherwise.

    Example: gaitopt sweep problems/compass_slip.py --over friction=0.1:0.25:26 -o frontier.nc

    Example: gaitopt sweep problems/compass_slip.py --over speed=0.5:0.7:5 --sequences any --with stability -o any.nc
    """
    from gaitopt.cli.script import load_script
    from gaitopt.cli.study_output import describe_progress, first_reason, print_sweep, sweep_facts
    from gaitopt.study.sweeps.sweep import sweep as sweep_problem

    began = time.perf_counter()
    problem, axes = _sweep_inputs(script, setting, over, hidden=json or quiet)
    points = math.prod(len(values) for values in axes.values())
    with (
        worker_options(workers, scheduler) as team,
        show_progress(f"sweep of {format_count(points, 'point')}", hidden=json, counted="optimisations") as display,
    ):
        table = sweep_problem(
            problem,
            axes,
            sequences=_read_sequences(sequences or []),
            measures=[name.strip() for text in measures or [] for name in text.split(",")],
            starts=starts,
            execution=team.execution(
                display.count, functools.partial(load_script, script.resolve()), active_observer=display.show_active
            ),
            path=output,
        )
    complete = bool(table.attrs["complete"])
    if json:
        print_json(sweep_facts(table) | {"file": str(output), "seconds": time.perf_counter() - began})
    else:
        print_sweep(table, is_last=complete)
    if not complete:
        exit_incomplete("sweep", output, f"{describe_progress(table)} are written to {output}")
    if not json:
        report_file(output)
    _exit("sweep", output, True, bool((table.status == "solved").any()), first_reason(table))


def _read_sequences(texts: list[str]) -> list[str] | str | None:
    """Return the contact sequences of the options of a command; ``any`` as it is, None without an option."""
    if len(texts) == 1 and re.fullmatch(r"\s*any\s*(:.*)?", texts[0]):
        return texts[0]
    return [sequence for text in texts for sequence in split_sequences(text)] or None


def split_sequences(text: str) -> list[str]:
    """Return the contact sequences of a list with commas; a comma between contacts of one phase does not separate.

    Examples
    --------
    >>> split_sequences("stick | stick, slip+ | slip+")
    ['stick | stick', 'slip+ | slip+']
    >>> split_sequences("foot A slip+, foot B stick > foot B stick |, foot A stick |")
    ['foot A slip+, foot B stick > foot B stick |', 'foot A stick |']
    """
    names_contacts = re.search(r"[>|\]]\s*(,|$)", text)
    separator = r"(?<=[>|\]])\s*," if names_contacts else ","
    return [part.strip() for part in re.split(separator, text)]


def _sweep_inputs(
    path: Path, setting: list[str] | None, over: list[str], *, hidden: bool
) -> tuple["GaitProblem | PlanarProblem", dict[str, "Array"]]:
    """Return the problem of a sweep and its axes in SI units."""
    from gaitopt.cli.axis import convert_axes, grid, unconverted_axes
    from gaitopt.cli.script import optimal_problem, read_script

    script = read_script(path, setting)
    problem = optimal_problem(script)
    axes = convert_axes(script, problem, grid(over, MOST_POINTS))
    note = unconverted_axes(script, problem, axes)
    if note and not hidden:
        err.print(note, soft_wrap=True)
    return problem, axes


def compare(
    files: GaitFiles,
    output: Figure = None,
    width: FigureWidth = 7.2,
    font_size: FontSize = 8.5,
    multipliers: Annotated[
        bool, typer.Option("--multipliers", help="Also compute the Floquet multipliers of the gaits in open loop.")
    ] = False,
    problem: RobotScript = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Compare gaits in a table and in a figure that overlays them.

    The figure, which has no title, is written to comparison.png unless --output names another file.

    Example: gaitopt compare slip.h5 stick.h5 -o comparison.pdf
    """
    from gaitopt.cli.script import load_gaits
    from gaitopt.cli.study_output import print_comparison
    from gaitopt.motion.atomic import check_writable
    from gaitopt.plot.comparison_figure import plot_comparison
    from gaitopt.plot.saving import save_figure
    from gaitopt.plot.style import FigureStyle
    from gaitopt.study.comparison import Comparison, label_by_sequence
    from gaitopt.study.comparison import compare as compare_gaits

    named, path = label_files(files), output or Path("comparison.png")
    check_writable(path)
    comparison = compare_gaits(load_gaits(named, problem), multipliers=multipliers)
    labelled = label_by_sequence(comparison.gaits, keep=True)  # the names of the files are those of the table
    figure = plot_comparison(Comparison(labelled, {}), style=FigureStyle(width=width, font_size=font_size))
    written = save_figure(figure, path)
    if json:
        print_json({"gaits": comparison.records(), "figure": str(written)})
    else:
        print_comparison(comparison)
        report_file(written)


def _exit(command: str, output: Path, complete: bool, any_gait: bool, reason: str) -> None:
    """End with the exit status of a study, and the first reason why it has no gait."""
    if not complete:
        exit_incomplete(command, output)
    if not any_gait:
        print_reason(f"No gait was found: {reason}")
    raise typer.Exit(0 if any_gait else 1)
