"""The command that tunes feedback."""

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn

import typer

from gaitopt.cli.engine_advice import engine_for_walks
from gaitopt.cli.feedback_output import interrupt_text, print_tuning, print_unstable, tuning_facts
from gaitopt.cli.law_option import design_for
from gaitopt.cli.law_trials import LawTrials, count_trial_walks, try_other_laws
from gaitopt.cli.options import (
    EngineName,
    Evaluations,
    Frictions,
    GainBounds,
    GainsOutput,
    Json,
    PushStarts,
    Quiet,
    RobotScript,
    Sensitivity,
    Source,
    StanceAngle,
    TorqueLimit,
    TunableLaw,
    Verbose,
    VerificationSteps,
)
from gaitopt.cli.output import INTERRUPTED, err, print_json, report_file
from gaitopt.cli.progress_display import show_progress
from gaitopt.cli.settings import read_bounds
from gaitopt.cli.verification_warning import warn_about_verification
from gaitopt.interrupts import record_interrupts
from gaitopt.progress import TuningStep, VerificationStep

if TYPE_CHECKING:
    from gaitopt.cli.progress_display import Display
    from gaitopt.cli.tuning_announcement import TuningAnnouncement
    from gaitopt.motion.planar_gait import AnyGait
    from gaitopt.simulation.engine import Engine
    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine
    from gaitopt.tuning.controller_family import ControllerFamily
    from gaitopt.tuning.record import Tuning

NoTrials = Annotated[
    bool, typer.Option("--no-trials", help="Test no other laws if the gait recovers from negligible pushes only.")
]


def tune(
    file: Source,
    problem: RobotScript = None,
    law: TunableLaw = "lqr",
    torque_limit: TorqueLimit = None,
    bound: GainBounds = None,
    stance_angle: StanceAngle = False,
    sensitivity: Sensitivity = False,
    friction: Frictions = None,
    steps: VerificationSteps = 30,
    starts: PushStarts = 200,
    samples: Annotated[int, typer.Option(min=0, help="Number of random sets of gains that are evaluated first.")] = 8,
    evaluations: Evaluations = 60,
    seed: Annotated[int, typer.Option(min=0, help="Random seed of the search and of the random starts.")] = 0,
    no_trials: NoTrials = False,
    engine: EngineName = "auto",
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
    from gaitopt.tuning.tuning_objective import SensitivityNorm, SpectralRadius

    search = GainSearchOptions(samples=samples, evaluations=evaluations, seed=seed)
    test = PushTest(starts=starts, seed=seed, steps=steps)
    hidden, skipped = json or quiet, no_trials or json or quiet
    announcement = TuningAnnouncement(search, test, hidden=hidden)
    with show_progress("tuning", hidden=json) as display:
        gait = load_feedback_gait(file, problem)
        bounds = read_bounds(bound, "--bound")
        family = _replace_bounds(_family_of(gait, law, torque_limit, stance_angle), bounds)
        initial = family.law({gain.name: gain.start for gain in family.gains})
        used = engine_for_walks(gait, initial, engine, hidden=hidden)
        verified = warn_about_verification(gait, file, hidden=json)
        announcement.advice = _recommend_engine(gait, used, hidden=json)
        announcement.trial_walks = 0 if skipped else count_trial_walks(gait, family.name)
        announcement.begin(law)
        display.describe(f"first evaluation of at most {search.evaluations_in_total}")
        options = {"frictions": tuple(friction or ()), "search": search, "test": test, "engine": used}
        options["objective"] = SensitivityNorm() if sensitivity else SpectralRadius()
        tuned = _tune(gait, family, announcement, display, options)
        trials = LawTrials() if skipped else try_other_laws(gait, tuned, torque_limit, stance_angle, display)
    stated = {"--problem": problem, "--torque-limit": torque_limit, "--stance-angle": stance_angle or None}
    _report_tuning(tuned, output, trials.describe(file, stated), verified=verified, json=json)
    _exit(tuned, interrupted=trials.interrupted)


def _tune(
    gait: "AnyGait",
    family: "ControllerFamily",
    announcement: "TuningAnnouncement",
    display: "Display",
    options: dict[str, Any],
) -> "Tuning":
    """Return the tuned law, with progress; an interrupt states what is still computed."""
    from gaitopt.tuning.tune import tune_feedback

    with record_interrupts() as interrupt:
        interrupt.announce = announcement.announce_end
        return tune_feedback(
            gait, family, observer=lambda step: display.describe(_progress(announcement.time_step(step))), **options
        )


def _exit(tuned: "Tuning", *, interrupted: bool) -> NoReturn:
    """Raise the exit of the command, after a message unless the law stabilises the gait and nothing was interrupted.

    Parameters
    ----------
    tuned : Tuning
    interrupted : bool
        Whether the trials of other laws were interrupted.
    """
    if interrupted or tuned.search_interrupted or tuned.verified.interrupted:
        trials = "Interrupted; the gains are verified, but not all other laws were tested."
        err.print(trials if interrupted else interrupt_text(tuned), soft_wrap=True)
        sys.exit(INTERRUPTED)  # not typer.Exit, which would report that nothing was written
    if not tuned.stable:
        print_unstable(tuned)
    raise typer.Exit(0 if tuned.stable else 1)


def _report_tuning(tuned: "Tuning", output: Path | None, remedy: str, *, verified: bool, json: bool) -> None:
    """Write the gains, and print the result of tuning, the remedy if the gait hardly recovers, and the file.

    `verified` is whether the gait has passed its replay.
    """
    from gaitopt.tuning.tuning_file import save_tuning

    if output is not None:
        save_tuning(tuned, output)
    if json:
        print_json(tuning_facts(tuned) | {"gait_verified": verified})
        return
    print_tuning(tuned, remedy)
    if output is not None:
        report_file(output)


def _family_of(gait: "AnyGait", law: str, torque_limit: float | None, stance_angle: bool) -> "ControllerFamily":
    """Return the controller family of a gait, which has gains, from the options of the command."""
    from gaitopt.cli.planar_law_option import PlanarLawOption
    from gaitopt.motion.gait import Gait
    from gaitopt.tuning.tune import require_gains

    if isinstance(gait, Gait):
        family = design_for(gait, gait.robot, law, torque_limit, stance_angle)
    else:
        family = PlanarLawOption(law, [], torque_limit, stance_angle).family(gait)
    require_gains(family)
    return family


def _replace_bounds(family: "ControllerFamily", bounds: "dict[str, tuple[float, float]]") -> "ControllerFamily":
    """Return a family with other bounds of some gains; the other gains keep their bounds and are tuned, too."""
    if not bounds:
        return family
    return family.with_bounds({gain.name: (gain.lower, gain.upper) for gain in family.gains} | bounds)


def _recommend_engine(gait: "AnyGait", engine: "Engine | PlanarEngine | None", *, hidden: bool) -> str | None:
    """Return how slow evaluations of a gait of a robot with several contacts become faster; print it for others.

    Parameters
    ----------
    gait : Gait or PlanarGait
    engine : Engine, PlanarEngine or None
        The stated engine.
    hidden : bool
        Whether nothing is printed.
    """
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.simulation import engine_choice

    if isinstance(gait, PlanarGait):
        return engine_choice.faster_planar_walks(engine_choice.choose_planar_engine(engine))
    if not hidden and (advice := engine_choice.faster_walks(engine_choice.default_engine())):
        err.print(advice, soft_wrap=True)
    return None


def _progress(step: TuningStep | VerificationStep) -> str:
    """Return the progress of tuning in words."""
    if isinstance(step, VerificationStep):
        return f"verifying: pushes up to {step.radius:.3g} rad/s, {step.walks} of {step.starts} walks"
    limit = f" of at most {step.limit}" if step.limit else ""
    return f"evaluation {step.number:3d}{limit}   lowest {step.best:.4f}"
