"""Commands on walks: simulate, stability, basin, run."""

import dataclasses
import functools
import time
from pathlib import Path
from typing import Annotated

import typer
from rich.markup import escape

from gaitopt.cli.axis import grid
from gaitopt.cli.law import OPEN_LOOP, GainValues, LawName, StanceAngle, TorqueLimit, feedback_named
from gaitopt.cli.options import Json, Quiet, RobotScript, Setting
from gaitopt.cli.output import err, leave_unfinished, out, print_json, print_written, working
from gaitopt.cli.script import call_script, load_script
from gaitopt.cli.workers import Scheduler, Workers, worker_options
from gaitopt.errors import InputError

Source = Annotated[Path, typer.Argument(metavar="PROBLEM.py|FILE", help="A walking problem script or a saved gait.")]
EngineName = Annotated[str, typer.Option("--engine", help="heyoka, scipy, or auto for the fastest installed.")]
Starts = Annotated[int, typer.Option(min=1, max=100000, help="Random starts of the search for gaits.")]

MOST_STARTS = 10_000_000
"""Of a basin: they take 600 MB."""


def stability(
    source: Source,
    setting: Setting = None,
    problem: RobotScript = None,
    starts: Starts = 300,
    engine: EngineName = "auto",
    law: LawName = OPEN_LOOP,
    gain: GainValues = None,
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    json: Json = False,
) -> None:
    """Find the periodic gaits of a walker, or take a saved gait, and give their exact multipliers.

    A saved gait is taken in open loop, its torques played back, or under the feedback law named.

    Exit status 0 if a gait was found (stable or not), 1 if none was.

    Example: gaitopt stability problems/compass_passive.py --set friction=0.14
    """
    from gaitopt.cli.inputs import read_input
    from gaitopt.cli.walk_output import print_cycles
    from gaitopt.stability.summary import summarise_cycle

    feedback = feedback_named(law, gain, torque_limit, stance_angle)
    with working("looking for periodic gaits", hidden=json or out.quiet):
        subject = read_input(source, setting or [], engine, starts, feedback=feedback, script=problem)
    if json:
        print_json({"engine": subject.engine.name, "gaits": [summarise_cycle(cycle) for cycle in subject.gaits]})
    else:
        print_cycles(subject.gaits, subject.engine)
    raise typer.Exit(0 if subject.gaits else 1)


def simulate(
    source: Source,
    setting: Setting = None,
    problem: RobotScript = None,
    state: Annotated[
        list[str] | None, typer.Option("--state", metavar="NAME=VALUE", help="Change a coordinate of the start.")
    ] = None,
    steps: Annotated[int, typer.Option(min=1, max=100000, help="Steps to walk.")] = 10,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="CSV", help="Where to write the trajectories. [nowhere]")
    ] = None,
    engine: EngineName = "auto",
    law: LawName = OPEN_LOOP,
    gain: GainValues = None,
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    json: Json = False,
) -> None:
    """Walk step by step from a periodic gait, or from a state nearby, and log every contact event.

    A saved gait is walked in open loop, its torques played back, or under the feedback law named.

    Exit status 0 if all steps were walked, 1 if the walk ended before.

    Example: gaitopt simulate problems/compass_passive.py --state th1_rate=0.8 --steps 20 -o walk.csv
    """
    from gaitopt.cli.inputs import read_input, read_start
    from gaitopt.cli.walk_output import print_walk, walk_facts
    from gaitopt.export.csv_file import write_csv
    from gaitopt.motion.atomic import check_writable
    from gaitopt.simulation.hybrid_automaton import Walker
    from gaitopt.simulation.simulator import record_walk
    from gaitopt.stability.section import Section

    if output is not None:
        check_writable(output)
    feedback = feedback_named(law, gain, torque_limit, stance_angle)
    subject = read_input(source, setting or [], engine, 300, first=True, feedback=feedback, script=problem)
    p = subject.robot.vector(subject.parameters)
    start = read_start(subject, p, state or [])
    walker = Walker(subject.robot, subject.law, p, subject.engine)
    walk = record_walk(walker, Section(subject.robot, p, sliding=True).embed(start), steps)
    written = None if output is None else write_csv(walk.motion, output)
    if json:
        print_json(walk_facts(walk) | {"file": None if written is None else str(written)})
    else:
        print_walk(walk)
        if written is not None:
            print_written(written)
    raise typer.Exit(0 if walk.stop.key == "steps_done" else 1)


def basin(
    source: Source,
    over: Annotated[
        list[str],
        typer.Option(
            "--over",
            metavar="NAME=FROM:TO:COUNT",
            help="An axis, once or twice: a coordinate or a parameter of the robot, in SI units and rad.",
        ),
    ],
    setting: Setting = None,
    state: Annotated[
        list[str] | None, typer.Option("--state", metavar="NAME=VALUE", help="Another coordinate of the start.")
    ] = None,
    steps: Annotated[int, typer.Option(min=2, max=100000, help="Most steps of a walk.")] = 100,
    workers: Workers = None,
    scheduler: Scheduler = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Keeps results; run again to go on.")
    ] = None,
    engine: EngineName = "auto",
    law: LawName = OPEN_LOOP,
    gain: GainValues = None,
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    json: Json = False,
    quiet: Quiet = False,
    problem: RobotScript = None,
) -> None:
    """Walk from every start of a grid and tell in which gait, or how, each walk ends.

    A saved gait is walked in open loop or under the feedback law named, and its own share of the starts is told, too.

    Interrupt it at any time; with an output file the same command goes on.

    Example: gaitopt basin problems/rimless_wheel.py --over theta_rate=0.1:3:200 -o basin.nc
    """
    from gaitopt.cli.inputs import coordinates_missing, read_input, read_start, share_at
    from gaitopt.cli.law import read_pairs
    from gaitopt.cli.study_output import counting
    from gaitopt.cli.walk_output import basin_facts, print_basin
    from gaitopt.simulation.engine_choice import faster_walks
    from gaitopt.stability.section import Section
    from gaitopt.study.basins.attractor import SettlingCriterion
    from gaitopt.study.basins.basin import basin as find_basin

    began = time.perf_counter()
    axes = grid(over, MOST_STARTS)
    feedback = feedback_named(law, gain, torque_limit, stance_angle)
    tried = 300 if coordinates_missing(state, axes) else 0
    subject = read_input(source, setting or [], engine, tried, first=True, feedback=feedback, script=problem)
    advice = faster_walks(subject.engine)
    if advice and not (json or quiet):
        err.print(escape(advice), soft_wrap=True)
    p = subject.robot.vector(subject.parameters)
    names = Section(subject.robot, p, sliding=True).names
    base = (
        dict(zip(names, read_start(subject, p, state or []).tolist(), strict=True))
        if subject.gaits
        else read_pairs(state)
    )
    prepare = functools.partial(load_script, source.resolve()) if source.suffix == ".py" else None
    with worker_options(workers, scheduler) as hands, counting("starts", hidden=json or quiet) as observer:
        found = find_basin(
            subject.robot,
            {name: value for name, value in {**base, **subject.parameters}.items() if name not in axes},
            axes,
            law=subject.law,
            patience=SettlingCriterion(steps=steps),
            engine=subject.engine,
            execution=hands.execution(observer, prepare),
            path=output,
        )
    own = None
    if source.suffix != ".py" and not any(name in subject.parameters for name in axes):
        own = share_at(found, names, subject.gaits[0])
    if json:
        seconds = time.perf_counter() - began
        print_json(basin_facts(found, subject.engine, own) | {"file": output and str(output), "seconds": seconds})
    elif not quiet:
        print_basin(found, subject.engine, own)
        if output is not None:
            print_written(output)
    if not found.attrs["complete"]:
        leave_unfinished(kept=output is not None)


def run(
    script: Annotated[Path, typer.Argument(metavar="STUDY.py", help="A study script.")],
    setting: Setting = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="PNG/PDF/SVG", help="Where to draw. [SCRIPT.png]")
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Run a study script: save its figure and set its numbers beside published ones.

    Exit status 0 if every number agrees to its printed digits, 1 if one does not.

    Example: gaitopt run problems/studies/compass_multipliers.py
    """
    from gaitopt.cli.walk_output import print_numbers
    from gaitopt.motion.atomic import check_writable
    from gaitopt.plot.saving import save_figure
    from gaitopt.study.published_values import Reproduction

    path = output or Path(f"{script.stem}.png")
    check_writable(path)
    study = call_script(script, setting or [], "study")
    if not isinstance(study, Reproduction):
        raise InputError(f"study() of {script} must return a Study, it returned {type(study).__name__}.")
    written = save_figure(study.figure, path)
    numbers = [
        dataclasses.asdict(number) | {"difference": number.difference, "agrees": number.agrees}
        for number in study.numbers
    ]
    if json:
        print_json({"figure": str(written), "numbers": numbers, "remarks": list(study.remarks)})
    elif not quiet:
        print_numbers(numbers, study.remarks)
        print_written(written)
    raise typer.Exit(0 if all(n.agrees for n in study.numbers) else 1)
