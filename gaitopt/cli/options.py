"""Arguments and options that several commands share: their names, values and help texts, each stated once."""

import time
from collections.abc import Sequence
from pathlib import Path
from typing import Annotated

import typer

from gaitopt.cli.output import err, out
from gaitopt.errors import InputError
from gaitopt.motion.versions import versions

LAWS = ("joint_pd", "computed_torque", "lqr", "step_lqr", "push_off")
"""Names of the controller families, without the import of their modules."""


def _set_quiet(context: typer.Context, quiet: bool) -> bool:
    """Silence standard output until the command has ended."""
    if quiet and not context.resilient_parsing:
        former, out.quiet = out.quiet, True
        context.call_on_close(lambda: setattr(out, "quiet", former))
    return quiet


def _set_verbose(context: typer.Context, verbose: bool) -> bool:
    """Print versions before the command, and how long it took after it."""
    if verbose and not context.resilient_parsing:
        err.print(", ".join(f"{name} {version}" for name, version in versions().items()), soft_wrap=True)
        began = time.perf_counter()
        took = f"gaitopt {context.info_name} took"
        context.call_on_close(lambda: err.print(f"{took} {time.perf_counter() - began:.3f} s"))
    return verbose


# Every command has these three.
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[
    bool, typer.Option("--quiet", "-q", help="Print no progress and no table.", callback=_set_quiet, is_eager=True)
]
Verbose = Annotated[
    bool,
    typer.Option(
        "--verbose",
        "-v",
        help="Print versions, iterations and timings to standard error.",
        callback=_set_verbose,
        is_eager=True,
    ),
]

# Inputs.
GaitFile = Annotated[Path, typer.Argument(metavar="FILE", help="Gait file written by 'gaitopt solve'.")]
ResultFiles = Annotated[
    list[Path],
    typer.Argument(metavar="FILE...", help="File of any result of gaitopt, or folder written by 'gaitopt search'."),
]
GaitFiles = Annotated[list[Path], typer.Argument(metavar="FILE...", help="Gait files written by 'solve' or 'search'.")]
ScriptFile = Annotated[Path, typer.Argument(metavar="PROBLEM.py", help="Problem script.")]
SolveSource = Annotated[
    Path, typer.Argument(metavar="PROBLEM.py|FAILED.h5", help="Problem script, or file of a failed solve to repeat.")
]
GuessFile = Annotated[
    Path | None,
    typer.Option(
        "--guess",
        metavar="FILE",
        help="Start from a gait (.h5), or from a recorded motion or a few postures (.csv, .mat, .sto, .mot).",
    ),
]
GuessColumns = Annotated[
    list[str] | None,
    typer.Option(
        "--column",
        metavar="NAME=COLUMN",
        help="Column of a coordinate, or of the time as time=COLUMN, in the file of --guess (repeatable).",
    ),
]
AngleUnit = Annotated[
    str | None,
    typer.Option("--angle-unit", metavar="rad|deg", help="Unit of the columns of --guess that do not state theirs."),
]
StudyFile = Annotated[Path, typer.Argument(metavar="STUDY.py", help="Study script.")]
Source = Annotated[Path, typer.Argument(metavar="PROBLEM.py|FILE", help="Problem script or gait file.")]
RobotScript = Annotated[
    Path | None,
    typer.Option(
        "--problem", metavar="PROBLEM.py", help="Script that defines the robot, if the file does not contain it."
    ),
]
Setting = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Change a parameter of the script (repeatable). A target speed or step length is a number, "
        "bounds LOWER:UPPER, or free.",
    ),
]
WalkSetting = Annotated[
    list[str] | None,
    typer.Option(
        "--set",
        metavar="NAME=VALUE",
        help="Change a parameter of the script, or of robot and ground of a saved gait in SI units (repeatable).",
    ),
]
State = Annotated[
    list[str] | None,
    typer.Option(
        "--state", metavar="NAME=VALUE", help="Coordinate of the initial state, SI units and rad (repeatable)."
    ),
]
Rise = Annotated[
    list[str] | None,
    typer.Option(
        "--rise",
        metavar="POSITION:HEIGHT",
        help="Change of the height of the ground at a position along it [m]; negative downwards (repeatable). "
        "Robots with several contacts only.",
    ),
]
Patch = Annotated[
    list[str] | None,
    typer.Option(
        "--patch",
        metavar="BEGIN:END:FRICTION",
        help="Patch of the ground between two positions [m] with the friction coefficient FRICTION (repeatable). "
        "Robots with several contacts only; 'gaitopt push' varies the loss of friction on a patch, for all robots.",
    ),
]
VerificationSteps = Annotated[
    int,
    typer.Option(
        min=1,
        max=100000,
        help="Maximum number of steps in which a walk of the verification must return to the gait.",
    ),
]
DisturbedSteps = Annotated[
    int,
    typer.Option(
        min=6,
        max=100000,
        help="Number of steps that a walk must complete under a disturbance other than a push; after a push it "
        "must return to the gait in 30 steps, as in the verification of tune.",
    ),
]

# Outputs.
Figure = Annotated[Path | None, typer.Option("--output", "-o", metavar="PNG/PDF/SVG", help="File of the figure.")]
FigureWidth = Annotated[float, typer.Option(min=2.5, max=20, help="Width [inch]: 3.5 for a journal column.")]
FontSize = Annotated[float, typer.Option(min=4, max=20, help="Size of axis labels [point].")]
PushOutput = Annotated[
    Path | None,
    typer.Option(
        "--output",
        "-o",
        metavar="JSON",
        help="File of the results, which 'gaitopt plot' accepts. Run the same command again to complete an interrupted "
        "test.",
    ),
]
StudyOutput = Annotated[
    Path,
    typer.Option("--output", "-o", metavar="FILE", help="File of the results. Run the same command again to resume."),
]

BasinOutput = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="FILE", help="File of the results. Run the same command again to resume."),
]

# Axes.  Their values are converted by gaitopt.cli.axis.
SweepAxes = Annotated[
    list[str],
    typer.Option(
        "--over",
        metavar="NAME=FROM:TO:COUNT",
        help="Axis (repeatable): friction, speed, step_length, slope or a robot parameter, as FROM:TO:COUNT or "
        "VALUE,VALUE,... Parameters of the script have the same units as with --set; all others are in SI units and "
        "rad. The dataset is in SI units and rad.",
    ),
]
BasinAxes = Annotated[
    list[str],
    typer.Option(
        "--over",
        metavar="NAME=FROM:TO:COUNT",
        help="Axis (at most two): a coordinate of the initial state or a parameter, as FROM:TO:COUNT or "
        "VALUE,VALUE,... The description of the command states the values of the other coordinates. Parameters of the "
        "script have the same units as with --set; coordinates and all other parameters are in SI units and rad. The "
        "results are in SI units and rad.",
    ),
]

Evaluations = Annotated[
    int,
    typer.Option(
        min=1,
        help="Maximum number of evaluations of each of two simplex searches that follow the samples. In total, with "
        "the initial gains, there are at most 1 + SAMPLES + 2 * EVALUATIONS evaluations.",
    ),
]
Sequences = Annotated[
    list[str] | None,
    typer.Option(
        "--sequences",
        "--words",
        metavar="SEQUENCE,...",
        help="Contact sequences to compare; any for all sequences of at most two phases, any:3 of at most three. "
        "--words is the former name of this option.",
        show_default="the sequence of the script",
    ),
]
Measures = Annotated[
    list[str] | None,
    typer.Option(
        "--with",
        metavar="MEASURE,...",
        help="Further measures of each gait: stability (Floquet multipliers in open loop), recovery (largest ball of "
        "recovered pushes). They can be added to the file of a finished sweep.",
    ),
]
PointStarts = Annotated[
    int,
    typer.Option(
        "--starts",
        min=1,
        max=100,
        help="Number of initial guesses, the best result of which is kept, at points that are not warm-started from a "
        "neighbour.",
    ),
]

# Laws of saved gaits.
LawName = Annotated[
    str,
    typer.Option(
        "--law",
        metavar="NAME|FILE",
        help=f"Feedback law: {', '.join(LAWS)}; SCRIPT.py:FUNCTION for a custom law; a file of tuned gains "
        "(tune -o); or feedforward.",
    ),
]
TunableLaw = Annotated[
    str,
    typer.Option(
        "--law",
        metavar="NAME|FILE",
        help=f"Feedback law: {', '.join(LAWS)}; SCRIPT.py:FUNCTION for a custom law; or a file of tuned gains "
        "(tune -o), at whose gains the search starts.",
    ),
]
GainsOutput = Annotated[
    Path | None,
    typer.Option("--output", "-o", metavar="JSON", help="File for the tuned gains; --law accepts this file."),
]
GainValues = Annotated[
    list[str] | None,
    typer.Option("--gain", metavar="NAME=VALUE", help="Value of a gain (repeatable); the others keep their defaults."),
]
GainBounds = Annotated[
    list[str] | None,
    typer.Option(
        "--bound",
        metavar="NAME=LOWER:UPPER",
        help="Bounds of the search for a gain (repeatable); the others keep theirs.",
    ),
]
TorqueLimit = Annotated[
    float | None,
    typer.Option(
        "--torque-limit",
        show_default="that in the file of tuned gains, otherwise 1.2 times that of the plan; none for a robot with "
        "several contacts",
        help="Torque limit of every actuator under feedback [N m].",
    ),
]
StanceAngle = Annotated[
    bool,
    typer.Option(
        "--stance-angle",
        help="Use the stance angle, not the time since touchdown, as the phase variable (in "
        "flight, the velocity of the centre of mass).",
    ),
]

Sensitivity = Annotated[
    bool, typer.Option("--sensitivity", help="Minimise the gait sensitivity norm instead of the spectral radius.")
]
Frictions = Annotated[
    list[float] | None,
    typer.Option(
        "--friction",
        metavar="FRICTION",
        help="Additional friction coefficient for which to tune (repeatable); the worst case is minimised.",
    ),
]
PushRadius = Annotated[
    float,
    typer.Option(
        min=0.0,
        max=100.0,
        help="Radius of the ball of pushes for which the fraction of recoveries is reported [rad/s].",
    ),
]
Disturbances = Annotated[
    list[str] | None,
    typer.Option(
        "--kind",
        metavar="KIND",
        help="Kind of disturbance to test (repeatable): push, downhill slope, uphill slope, friction patch, torque "
        "noise, sensor delay; recovery for the fraction of pushes in a ball.",
        show_default="all",
    ),
]

# Where and how walks and solves are computed.
EngineName = Annotated[
    str,
    typer.Option(
        "--engine",
        metavar="NAME",
        help="Simulation engine: heyoka, scipy, or auto for the fastest one that is installed. For a robot with "
        "several contacts, auto is scipy; tune, push and trace of a saved gait use heyoka if the feedback is stiff.",
    ),
]
Workers = Annotated[
    int | None,
    typer.Option(min=1, max=1024, help="Number of worker processes.", show_default="one per processor"),
]
Scheduler = Annotated[
    str | None,
    typer.Option(
        metavar="ADDRESS", help="Address of a Dask scheduler, such as tcp://host:8786, whose workers are used instead."
    ),
]
CycleStarts = Annotated[
    int,
    typer.Option(
        "--starts",
        min=1,
        max=100000,
        help="Number of random initial states in the search for the periodic gaits of a script; a saved gait needs no "
        "search.",
    ),
]
TraceStarts = Annotated[
    int,
    typer.Option(
        "--starts",
        min=1,
        max=100000,
        help="Number of random initial states in the search for the gaits of a script at FROM, and with --deflate; not "
        "used for optimal gaits.",
    ),
]
CyclePeriod = Annotated[
    int, typer.Option("--steps", min=1, max=100, help="Longest period of the gaits to search for [steps].")
]
PushStarts = Annotated[
    int,
    typer.Option(
        "--starts",
        min=1,
        max=100000,
        help="Number of simulated walks, each from a random state after a push. The states of tune and push are the "
        "same for equal numbers (tune: --seed 0), and the ball from which all walks return shrinks as their number "
        "grows.",
    ),
]


def label_files(files: Sequence[Path]) -> dict[str, Path]:
    """Return files by distinct labels: their names without suffix, or the whole paths of files of equal names.

    Raises
    ------
    InputError
        If a file is given twice.
    """
    stems = [file.stem for file in files]
    labels = {file.stem if stems.count(file.stem) == 1 else str(file): file for file in files}
    if len(labels) < len(files):
        repeated = next(file for file in files if files.count(file) > 1)
        raise InputError(f"The files must be different, got {repeated} twice.")
    return labels
