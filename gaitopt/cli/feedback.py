"""Commands on feedback: tune, push."""

import dataclasses
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.progress import Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from gaitopt.cli.feedback_output import basin_facts, print_endurance, print_tuning, print_unstabilised, tuning_facts
from gaitopt.cli.law import OPEN_LOOP, GainValues, LawName, StanceAngle, TorqueLimit, design_for, law_for
from gaitopt.cli.options import GaitFile, Json, Quiet, RobotScript
from gaitopt.cli.output import err, print_json, print_written
from gaitopt.cli.script import robot_of
from gaitopt.cli.workers import Scheduler, Workers, worker_options
from gaitopt.control.law import Law, feedforward
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.atomic import check_suffix, check_writable
from gaitopt.motion.gait import Gait
from gaitopt.motion.summary import plain
from gaitopt.progress import TuningStep

if TYPE_CHECKING:
    from gaitopt.stability.recovery import PushTest, Recovery

Starts = Annotated[int, typer.Option(min=1, max=100000, help="Seeded starts of the walks that verify.")]


def tune(
    file: GaitFile,
    problem: RobotScript = None,
    law: LawName = "lqr",
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    sensitivity: Annotated[
        bool, typer.Option("--sensitivity", help="Make the gait sensitivity norm small, not the spectral radius.")
    ] = False,
    friction: Annotated[
        list[float] | None, typer.Option("--friction", help="Another friction that counts too: the worst decides.")
    ] = None,
    starts: Starts = 200,
    seed: Annotated[int, typer.Option(min=0, help="Random seed for the search and the initial states.")] = 0,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="JSON", help="File for the tuned gains, which --law takes. [none]"),
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Tune the gains of a feedback law for a gait and verify the law by walks from perturbed initial states.

    Exit status 0 if the law stabilises the gait, 1 if not: then the best radius found is printed.

    Example: gaitopt tune compass_slip.h5 --law lqr --json
    """
    from gaitopt.motion.archive import load
    from gaitopt.stability.recovery import PushTest
    from gaitopt.tuning.gain_search import GainSearchOptions
    from gaitopt.tuning.objective import SensitivityNorm, SpectralRadius
    from gaitopt.tuning.tune import tune_feedback
    from gaitopt.tuning.tuning_file import save_tuning

    if output is not None:
        check_suffix(output, {".json": "tuned gains"})
        check_writable(output)
    gait = load(file).require()
    robot = robot_of(gait, problem)
    design = design_for(gait, robot, law, torque_limit, stance_angle)
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True, disable=json or quiet) as progress:
        task = progress.add_task("tuning")

        def observe(step: TuningStep) -> None:
            progress.update(task, description=f"evaluation {step.number:3d}   best {step.best:.4f}")

        tuned = tune_feedback(
            gait,
            design,
            robot=robot,
            objective=SensitivityNorm() if sensitivity else SpectralRadius(),
            frictions=tuple(friction or ()),
            search=GainSearchOptions(seed=seed),
            test=PushTest(starts=starts, seed=seed),
            observer=observe,
        )
    if output is not None:
        save_tuning(tuned, output)
    if json:
        print_json(tuning_facts(tuned))
    elif not quiet:
        print_tuning(tuned)
        if output is not None:
            print_written(output)
    if not tuned.stable:
        print_unstabilised(tuned)
    raise typer.Exit(0 if tuned.stable else 1)


def push(
    file: GaitFile,
    problem: RobotScript = None,
    law: LawName = OPEN_LOOP,
    gain: GainValues = None,
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    steps: Annotated[int, typer.Option(min=6, max=100000, help="Steps to walk.")] = 50,
    starts: Starts = 50,
    ball: Annotated[
        float, typer.Option(min=0.0, max=100.0, help="Pushes of which the share that returns is told [rad/s].")
    ] = 0.1,
    workers: Workers = None,
    scheduler: Scheduler = None,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Find the largest push, slope, friction patch, torque noise and sensor delay a gait survives under a law.

    Tells, too, from what share of a ball of pushes the walker returns to the gait, before (its torques played back) and
    after, and in how many steps.

    Example: gaitopt push compass_slip.h5 --law lqr
    """
    from gaitopt.cli.study_output import counting
    from gaitopt.motion.archive import load
    from gaitopt.simulation.engine_choice import default_engine
    from gaitopt.stability.assessment import assess_stability
    from gaitopt.stability.recovery import PushTest
    from gaitopt.study.robustness.robustness_margins import WalkTest, assess_robustness

    began, gait = time.perf_counter(), load(file).require()
    robot = robot_of(gait, problem)
    chosen = law_for(gait, robot, law, gain, torque_limit, stance_angle)
    cycle, test = assess_stability(gait, chosen, robot=robot), PushTest(starts=starts)
    walking = WalkTest(steps=steps)
    with worker_options(workers, scheduler) as hands, counting("disturbances", hidden=json or quiet) as observer:
        found = assess_robustness(
            robot,
            chosen,
            cycle,
            walking=walking,
            test=test,
            workers=hands.workers,
            executor=hands.executor,
            observer=observer,
        )
    laws = {chosen.name: chosen, "open loop": feedforward(robot, gait.motion)}
    basins = {name: _basin(gait, robot, each, ball, test) for name, each in laws.items()}
    facts = plain(
        {
            "law": chosen.name,
            "engine": default_engine(chosen, robot).name,
            "radius": cycle.radius,
            "steps": steps,
            "survived": [dataclasses.asdict(each) for each in found],
            "push_radius": ball,
            "basin_before": basin_facts(basins["open loop"]),
            "basin_after": basin_facts(basins[chosen.name]),
            "seconds": time.perf_counter() - began,
        }
    )
    if json:
        print_json(facts)
    elif not quiet:
        print_endurance(facts, basins)


def _basin(gait: Gait, robot: Robot, law: Law, ball: float, test: "PushTest") -> "Recovery | None":
    """Return how many starts in a ball of pushes return to the gait under a law; None where it leaves no gait."""
    from gaitopt.simulation.hybrid_automaton import make_walker
    from gaitopt.stability.assessment import assess_stability
    from gaitopt.stability.recovery import recovery

    try:
        cycle = assess_stability(gait, law, robot=robot)
    except InputError:
        return None
    return recovery(make_walker(robot, law, cycle.parameters, period=gait.period), cycle, ball, test)
