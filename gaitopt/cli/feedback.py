"""Commands on feedback: tune, push."""

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitopt.cli.feedback_output import (
    endurance_facts,
    interrupt_text,
    print_endurance,
    print_tuning,
    print_unstable,
    tuning_facts,
)
from gaitopt.cli.law_option import OPEN_LOOP, design_for, law_of_gait, law_title
from gaitopt.cli.options import (
    DisturbedSteps,
    Evaluations,
    Frictions,
    GainsOutput,
    GainValues,
    Json,
    LawName,
    PushOutput,
    PushRadius,
    PushStarts,
    Quiet,
    RobotScript,
    Scheduler,
    Sensitivity,
    Source,
    StanceAngle,
    TorqueLimit,
    TunableLaw,
    Verbose,
    VerificationSteps,
    Workers,
)
from gaitopt.cli.output import INTERRUPTED, err, print_json, report_file
from gaitopt.cli.progress_display import show_progress
from gaitopt.cli.workers import WorkerOptions, worker_options
from gaitopt.progress import TuningStep, VerificationStep

if TYPE_CHECKING:
    from gaitopt.control.law import Law
    from gaitopt.control.planar_laws.planar_law import PlanarLaw
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.model.robot import Robot
    from gaitopt.motion.planar_gait import AnyGait
    from gaitopt.stability.cycle import Cycle
    from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
    from gaitopt.stability.recovery import PushTest, Recovery
    from gaitopt.study.robustness.robustness_margins import RobustnessMargins
    from gaitopt.tuning.controller_family import ControllerFamily
    from gaitopt.tuning.record import Tuning


def tune(
    file: Source,
    problem: RobotScript = None,
    law: TunableLaw = "lqr",
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    sensitivity: Sensitivity = False,
    friction: Frictions = None,
    steps: VerificationSteps = 30,
    starts: PushStarts = 200,
    samples: Annotated[int, typer.Option(min=0, help="Number of random sets of gains that are evaluated first.")] = 8,
    evaluations: Evaluations = 60,
    seed: Annotated[int, typer.Option(min=0, help="Random seed of the search and of the random starts.")] = 0,
    output: GainsOutput = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Tune the gains of a feedback law for a gait and verify the law by walks from perturbed states.

    For a robot with several contacts, the problem script is accepted in place of the gait file, and is solved first;
    the built-in laws of such a robot are joint_pd, lqr and step_lqr; custom laws (SCRIPT.py:FUNCTION) are accepted too.

    Exit status 0 if the law stabilises the gait; otherwise 1, and the smallest spectral radius is printed.  Ctrl-C
    during the search ends it, and the best gains so far are printed and written without verification;
    Ctrl-C during the verification ends only that.  The exit status is then 130.

    Example: gaitopt tune compass_slip.h5 --law lqr --json
    """
    from gaitopt.cli.script import load_feedback_gait
    from gaitopt.cli.tuning_announcement import TuningAnnouncement
    from gaitopt.stability.recovery import PushTest
    from gaitopt.tuning.gain_search import GainSearchOptions
    from gaitopt.tuning.tune import tune_feedback
    from gaitopt.tuning.tuning_objective import SensitivityNorm, SpectralRadius

    search = GainSearchOptions(samples=samples, evaluations=evaluations, seed=seed)
    test = PushTest(starts=starts, seed=seed, steps=steps)
    announcement = TuningAnnouncement(search, test, hidden=json or quiet)
    with show_progress("tuning", hidden=json) as display:
        gait = load_feedback_gait(file, problem)
        _recommend_engine(gait, hidden=json)
        announcement.begin()
        tuned = tune_feedback(
            gait,
            _family_of(gait, law, torque_limit, stance_angle),
            objective=SensitivityNorm() if sensitivity else SpectralRadius(),
            frictions=tuple(friction or ()),
            search=search,
            test=test,
            observer=lambda step: display.describe(_progress(announcement.time_walk(step))),
        )
    _report_tuning(tuned, output, json=json)
    if tuned.search_interrupted or tuned.verified.interrupted:
        err.print(interrupt_text(tuned), soft_wrap=True)
        sys.exit(INTERRUPTED)  # not typer.Exit, which would report that nothing was written
    if not tuned.stable:
        print_unstable(tuned)
    raise typer.Exit(0 if tuned.stable else 1)


def _report_tuning(tuned: "Tuning", output: Path | None, *, json: bool) -> None:
    """Write the gains, and print the result of tuning and the file."""
    from gaitopt.tuning.tuning_file import save_tuning

    if output is not None:
        save_tuning(tuned, output)
    if json:
        print_json(tuning_facts(tuned))
        return
    print_tuning(tuned)
    if output is not None:
        report_file(output)


def _family_of(gait: "AnyGait", law: str, torque_limit: float | None, stance_angle: bool) -> "ControllerFamily":
    """Return the controller family of a gait from the options of the command."""
    from gaitopt.cli.planar_law_option import PlanarLawOption
    from gaitopt.motion.gait import Gait

    if isinstance(gait, Gait):
        return design_for(gait, gait.robot, law, torque_limit, stance_angle)
    return PlanarLawOption(law, [], torque_limit, stance_angle).family(gait)


def _recommend_engine(gait: "AnyGait", *, hidden: bool) -> None:
    """Print how the evaluations and the walks of a gait become faster, if they do, unless output is hidden."""
    from gaitopt.motion.gait import Gait
    from gaitopt.simulation.engine_choice import default_engine, faster_walks

    if not hidden and isinstance(gait, Gait) and (advice := faster_walks(default_engine())):
        err.print(advice, soft_wrap=True)


def _progress(step: TuningStep | VerificationStep) -> str:
    """Return the progress of tuning in words."""
    if isinstance(step, VerificationStep):
        return f"verifying: pushes up to {step.radius:.3g} rad/s, {step.walks} of {step.starts} walks"
    limit = f" of at most {step.limit}" if step.limit else ""
    return f"evaluation {step.number:3d}{limit}   lowest {step.best:.4f}"


def push(
    file: Source,
    problem: RobotScript = None,
    law: LawName = OPEN_LOOP,
    gain: GainValues = None,
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    steps: DisturbedSteps = 50,
    starts: PushStarts = 50,
    ball: PushRadius = 0.1,
    workers: Workers = None,
    scheduler: Scheduler = None,
    output: PushOutput = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Find the largest push, slope, loss of friction, torque noise and sensor delay that a gait survives under a law.

    After a touchdown, a push changes the state in a random direction; a size is survived if the walker returns to the
    gait after all random pushes of at most this size.  The slope is a change relative to that of the gait, for all
    steps.  The loss of friction, called friction patch in the results, lasts for the first five steps of the walk;
    --patch of 'gaitopt simulate' states the friction itself instead.  The noise is the standard deviation of a
    random torque on each actuator, and the delay is the age of the state that the law receives.

    For a robot with several contacts, a push changes coordinates and rates right after a landing and moves no foot off
    the ground; the noise acts on the actuators with a planned torque.  The problem script is accepted in place of the
    gait file, and is solved first.

    The fraction of pushes in a ball after which the walker returns to the gait, and the number of steps that this
    takes, are reported in open loop (torques replayed) and under the law.

    Example: gaitopt push compass_slip.h5 --law lqr
    """
    from gaitopt.cli.script import load_feedback_gait
    from gaitopt.stability.assessment import assess_stability
    from gaitopt.stability.recovery import PushTest
    from gaitopt.study.robustness.robustness_record import RobustnessRecord, save_robustness

    began = time.perf_counter()
    gait = load_feedback_gait(file, problem)
    chosen, title = law_of_gait(gait, law, gain, torque_limit, stance_angle), law_title(law, stance_angle)
    cycle, test = assess_stability(gait, chosen), PushTest(starts=starts)
    with worker_options(workers, scheduler) as team:
        margins = _margins_of(gait.robot, chosen, cycle, steps, test, team, hidden=json)
    basins = _basins(gait, {title: chosen, "open loop": law_of_gait(gait, OPEN_LOOP)}, ball, test, hidden=json)
    record = RobustnessRecord(law=title, radius=cycle.radius, steps=steps, margins=margins, recoveries=basins)
    written = None if output is None else save_robustness(record, output)
    facts = {
        "law": title,
        "engine": _engine_of(chosen, gait),
        "radius": cycle.radius,
        "steps": steps,
        **endurance_facts(margins, ball, basins["open loop"], basins[title]),
        "seconds": time.perf_counter() - began,
    }
    if json:
        print_json(facts)
        return
    print_endurance(facts, basins)
    if written is not None:
        report_file(written)


def _engine_of(law: "Law | PlanarLaw", gait: "AnyGait") -> str:
    """Return the name of the engine that simulates the walks of a gait."""
    from gaitopt.control.law import Law
    from gaitopt.motion.gait import Gait
    from gaitopt.simulation.engine_choice import default_engine, planar_engine_named

    if isinstance(gait, Gait) and isinstance(law, Law):
        return default_engine(law, gait.robot).name
    return planar_engine_named().name


def _basins(
    gait: "AnyGait", laws: "dict[str, Law | PlanarLaw]", ball: float, test: "PushTest", *, hidden: bool
) -> "dict[str, Recovery | None]":
    """Return the recovery of a gait from a ball of pushes under each law; None if it has no periodic gait."""
    from gaitopt.stability.gait_recovery import measure_gait_recovery

    basins = {}
    with show_progress("pushes", hidden=hidden) as display:
        for name, law in laws.items():
            display.describe(f"pushes up to {ball:g} rad/s, {name}")
            basins[name] = measure_gait_recovery(gait, law, ball, test)
    return basins


def _margins_of(
    robot: "Robot | PlanarRobot",
    law: "Law | PlanarLaw",
    cycle: "Cycle | PlanarCycle",
    steps: int,
    test: "PushTest",
    team: WorkerOptions,
    *,
    hidden: bool,
) -> "tuple[RobustnessMargins, ...]":
    """Return the largest disturbances of each kind that a gait survives under a law."""
    from gaitopt.study.robustness.robustness_margins import WalkTest, assess_robustness

    with show_progress("disturbances", hidden=hidden, counted=True) as display:
        return assess_robustness(
            robot,
            law,
            cycle,
            walking=WalkTest(steps=steps),
            test=test,
            execution=team.execution(display.count),
        )
