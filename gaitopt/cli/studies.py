"""Commands on many gaits: search, sweep, compare."""

import functools
import time
from pathlib import Path
from typing import Annotated

import typer

from gaitopt.cli.axis import grid
from gaitopt.cli.options import Json, Quiet, RobotScript, Script, Setting, labelled
from gaitopt.cli.output import leave_unfinished, print_json, print_written
from gaitopt.cli.workers import Scheduler, Workers, worker_options

Starts = Annotated[int, typer.Option(min=1, max=100, help="Starts tried where there is no neighbour to start from.")]

MOST_POINTS = 100_000
"""Of a sweep: half a day of work, and more, for each contact sequence."""


def search(
    script: Script,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="DIR", help="Keeps a gait for each sequence; run again to go on.")
    ],
    max_phases: Annotated[int, typer.Option(min=1, max=6, help="Phases of the longest contact sequences.")] = 3,
    starts: Annotated[int, typer.Option(min=1, max=100, help="Starts of its own each contact sequence has.")] = 4,
    setting: Setting = None,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find out which sequence of stick and slip walks cheapest: try every sequence, replay each gait, and rank them.

    Interrupt it at any time; the same command goes on.  Exit status 0 if a sequence has a gait, 1 if none has.

    Example: gaitopt search problems/compass_slip.py --max-phases 2 -o sequences
    """
    from gaitopt.cli.script import build_problem, load_script
    from gaitopt.cli.study_output import counting, print_ranking
    from gaitopt.study.sequence_search.search import search as search_sequences

    began, problem = time.perf_counter(), build_problem(script, setting or [])
    with worker_options(workers, scheduler) as hands, counting("sequences", hidden=json or quiet) as observer:
        ranking = search_sequences(
            problem,
            max_phases=max_phases,
            starts=starts,
            execution=hands.execution(observer, functools.partial(load_script, script.resolve())),
            directory=output,
        )
    if json:
        seconds = time.perf_counter() - began
        print_json({"ranked": ranking.records(), "complete": ranking.complete, "seconds": seconds})
    elif not quiet:
        print_ranking(ranking)
        print_written(output)
    _leave(ranking.complete, ranking.findings[0].ranked)


def sweep(
    script: Script,
    over: Annotated[
        list[str],
        typer.Option(
            metavar="NAME=FROM:TO:COUNT",
            help="An axis, or several: friction, speed, step_length, slope or a robot parameter, in SI units and rad.",
        ),
    ],
    output: Annotated[Path, typer.Option("--output", "-o", metavar="FILE", help="Keeps results; run again to go on.")],
    sequences: Annotated[
        list[str] | None,
        typer.Option(
            "--sequences",
            "--words",
            metavar="SEQUENCE,...",
            help="Sequences to compare. [the script's own]",
            show_default=False,
        ),
    ] = None,
    setting: Setting = None,
    starts: Starts = 3,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find the optimal gait of each contact sequence at every point of a grid: the frontier of cheap gaits.

    Kill it at any time; the same command goes on.  Exit status 0 if there is a gait, 1 if there is none.

    Example: gaitopt sweep problems/compass_slip.py --over friction=0.1:0.25:26 -o frontier.nc
    """
    from gaitopt.cli.script import build_problem, load_script
    from gaitopt.cli.study_output import counting, print_sweep, sweep_facts
    from gaitopt.study.sweeps.sweep import sweep as sweep_problem

    began, problem = time.perf_counter(), build_problem(script, setting or [])
    spelled = [sequence.strip() for text in sequences or [] for sequence in text.split(",")]
    with worker_options(workers, scheduler) as hands, counting("gaits", hidden=json or quiet) as observer:
        found = sweep_problem(
            problem,
            grid(over, MOST_POINTS),
            sequences=spelled or None,
            starts=starts,
            execution=hands.execution(observer, functools.partial(load_script, script.resolve())),
            path=output,
        )
    complete, any_gait = bool(found.attrs["complete"]), bool((found.status == "solved").any())
    if json:
        print_json(sweep_facts(found) | {"file": str(output), "seconds": time.perf_counter() - began})
    elif not quiet:
        print_sweep(found)
        print_written(output)
    _leave(complete, any_gait)


def compare(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Gaits that solve or search wrote.")],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="PNG/PDF/SVG", help="Where to draw. [comparison.png]")
    ] = None,
    multipliers: Annotated[
        bool, typer.Option("--multipliers", help="Also those of the torques played back in open loop.")
    ] = False,
    problem: RobotScript = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Set gaits side by side, in a table and drawn over each other.

    Example: gaitopt compare slip.h5 stick.h5 -o comparison.pdf
    """
    from gaitopt.cli.script import build_problem
    from gaitopt.cli.study_output import print_comparison
    from gaitopt.motion.archive import load
    from gaitopt.motion.atomic import check_writable
    from gaitopt.plot.comparison_figure import plot_comparison
    from gaitopt.plot.saving import save_figure
    from gaitopt.study.comparison import Comparison, label_by_sequence
    from gaitopt.study.comparison import compare as compare_gaits

    named, path = labelled(files), output or Path("comparison.png")
    check_writable(path)
    robot = build_problem(problem, []).robot if problem else None
    found = compare_gaits({label: load(file) for label, file in named.items()}, multipliers=multipliers, robot=robot)
    written = save_figure(plot_comparison(Comparison(label_by_sequence(found.gaits), {})), path)
    if json:
        print_json({"gaits": found.records(), "figure": str(written)})
    elif not quiet:
        print_comparison(found)
        print_written(written)


def _leave(complete: bool, any_gait: bool) -> None:
    """End with the exit status of a study."""
    if not complete:
        leave_unfinished()
    raise typer.Exit(0 if any_gait else 1)
