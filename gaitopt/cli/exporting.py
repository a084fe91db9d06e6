"""Commands that write a gait for people and for other programs: plot, animate, report, export."""

import re
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from gaitopt.cli.law_option import OPEN_LOOP, find_feedback, law_of_gait
from gaitopt.cli.options import (
    FigureWidth,
    FontSize,
    GainValues,
    GaitFile,
    Json,
    LawName,
    Quiet,
    ResultFiles,
    RobotScript,
    StanceAngle,
    TorqueLimit,
    Verbose,
    label_files,
)
from gaitopt.cli.output import err, out, print_json, report_file
from gaitopt.cli.output_files import EXPORTS, SWEEP_EXPORTS
from gaitopt.cli.progress_display import show_progress
from gaitopt.cli.walk_script import refuse_walk_script
from gaitopt.errors import GaitoptError, InputError

if TYPE_CHECKING:
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.motion.planar_gait import AnyGait
    from gaitopt.study.robustness.robustness_record import RobustnessRecord

PAGE = ".html"
"""Suffix of the page of a diagram."""

LONGEST_LABEL, SEPARATORS = 20, "_./ -"
"""Number of letters up to which labels of files are not shortened, and characters between their words."""


def plot(
    files: ResultFiles,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="PNG/PDF/SVG/HTML", help="File of the figure, or of the page."),
    ] = None,
    quantity: Annotated[
        str | None,
        typer.Option(
            metavar="NAME",
            help="Variable of a sweep, or coordinate of a diagram of periodic gaits.",
            show_default="the minimised objective, or the first coordinate",
        ),
    ] = None,
    width: FigureWidth = 7.2,
    font_size: FontSize = 8.5,
    title: Annotated[bool, typer.Option("--title/--no-title", help="Print a title above the figure.")] = True,
    problem: Annotated[
        Path | None,
        typer.Option(
            "--problem",
            metavar="PROBLEM.py|FILE",
            help="Script or gait from which the diagram was traced, for its page (.html). "
            "It may be omitted for passive gaits of a robot of the catalogue.",
        ),
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Draw a result of any kind: gait, search, sweep, front, basin, branches, tuned gains or push test.

    The figure is written to FILE.png unless --output names another file.  For a diagram of periodic gaits, a file that
    ends in .html is a page on which a click on a point plays its gait.  Several files must all contain push tests; they
    are compared in one figure, comparison.png.  'gaitopt compare' compares gaits.

    Example: gaitopt plot compass_slip.h5 -o slip.pdf --width 3.5 --no-title
    """
    from gaitopt.motion.atomic import check_writable
    from gaitopt.plot.result_figure import plot_result
    from gaitopt.plot.saving import save_figure
    from gaitopt.plot.style import FigureStyle
    from gaitopt.study.result_file import load_result

    file, *others = files
    refuse_walk_script(file)
    path = output or Path("comparison.png" if others else f"{file.resolve().stem}.png")
    check_writable(path)
    if path.suffix.lower() == PAGE:
        report_file(_write_page(files, path, problem, quantity, hidden=json), json=json)
        return
    if problem is not None:
        raise InputError(f"--problem is accepted for the page of a diagram (.html) only, got -o {path}.")
    result = _load_push_tests(files) if others else load_result(file)
    style = FigureStyle(width=width, font_size=font_size, titled=title)
    report_file(save_figure(plot_result(result, quantity=quantity, style=style), path), json=json)


def _write_page(files: list[Path], path: Path, problem: Path | None, coordinate: str | None, *, hidden: bool) -> Path:
    """Write the page of the diagram in a file, and return its path; InputError for several files."""
    from gaitopt.cli.diagram_page import write_page_of_file

    if len(files) > 1:
        raise InputError(f"A page (.html) shows a single diagram, got {len(files)} files.")
    with show_progress("writing the page", hidden=hidden):
        return write_page_of_file(files[0], path, problem, coordinate=coordinate)


def _load_push_tests(files: list[Path]) -> "dict[str, RobustnessRecord]":
    """Return the push tests of several files by the names of the files; other results are rejected."""
    from gaitopt.study.result_file import load_result
    from gaitopt.study.robustness.robustness_record import RobustnessRecord

    records, named = {}, label_files(files)
    for label, file in zip(_shorten_labels(list(named)), named.values(), strict=True):
        record = load_result(file)
        if not isinstance(record, RobustnessRecord):
            raise InputError(
                f"Several files must all contain push tests, and {file} contains another result: plot each of the "
                f"{len(files)} files separately, or overlay gaits with 'gaitopt compare'."
            )
        records[label] = record
    return records


def _shorten_labels(labels: list[str]) -> list[str]:
    """Return labels without the words at their beginning and end that all share, if one is too long for a legend.

    Examples
    --------
    >>> _shorten_labels(["compass_slip_push_lqr_limit_8", "compass_slip_push_step_lqr_limit_8"])
    ['lqr', 'step_lqr']
    >>> _shorten_labels(["push_lqr", "push_pd"])
    ['push_lqr', 'push_pd']
    """
    words = [re.findall(f"[^{SEPARATORS}]*[{SEPARATORS}]*", label)[:-1] for label in labels]  # the last match is empty
    fewest = min(map(len, words))
    if len(labels) < 2 or max(map(len, labels)) <= LONGEST_LABEL:
        return labels
    first, last = 0, 0
    while first < fewest - 1 and len({part[first] for part in words}) == 1:
        first += 1
    while last < fewest - first - 1 and len({part[-1 - last] for part in words}) == 1:
        last += 1
    return ["".join(part[first : len(part) - last]).rstrip(SEPARATORS) for part in words]


def animate(
    file: GaitFile,
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="GIF/MP4", help="File of the animation.", show_default="FILE.gif"),
    ] = None,
    steps: Annotated[int, typer.Option(min=1, max=100, help="Number of steps.")] = 3,
    slow: Annotated[float, typer.Option(min=0.1, max=100.0, help="Slow-motion factor.")] = 2.0,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Animate a gait with its contact force, friction cone, slip marks and current contact mode.

    A gait of several steps is shown once, regardless of --steps.

    Example: gaitopt animate compass_slip.h5 -o slip.mp4
    """
    from gaitopt.cli.multistep_output import is_multistep_file
    from gaitopt.motion.archive import load
    from gaitopt.ocp.multistep.multistep_file import load_steps
    from gaitopt.plot.animation import animate as animate_gait

    refuse_walk_script(file)
    several, path = is_multistep_file(file), output or Path(f"{file.stem}.gif")
    gait = load_steps(file) if several else load(file)
    with show_progress("drawing", hidden=json, counted="frames") as display:
        written = animate_gait(gait, path, steps=1 if several else steps, slow=slow, observer=display.count)
    report_file(written, json=json)


def report(
    files: Annotated[
        list[Path],
        typer.Argument(metavar="FILE...", help="Gait files written by 'solve' or 'search', or scripts of walks."),
    ],
    output: Annotated[
        Path | None,
        typer.Option(
            "--output",
            "-o",
            metavar="HTML",
            help="File of the page.",
            show_default="FILE.html, or report.html for several gaits",
        ),
    ] = None,
    title: Annotated[str, typer.Option(help="Title of the page.")] = "Gait report",
    problem: RobotScript = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write gaits as one HTML page: animation, charts, energy, Floquet multipliers, comparison, problem and versions.

    A script whose gaits are found by simulation without optimisation (WalkProblem, PlanarWalkProblem) is accepted in
    place of a file: the page shows its first periodic gait.

    The page is self-contained and needs no network connection.

    Example: gaitopt report slip.h5 stick.h5 -o report.html
    """
    from gaitopt.cli.report_input import read_subjects
    from gaitopt.cli.verification_warning import warn_about_verification
    from gaitopt.motion.atomic import check_writable
    from gaitopt.report.page import write_report
    from gaitopt.report.sections import AnyCycle

    named = label_files(files)
    path = output or Path(f"{files[0].stem}.html" if len(files) == 1 else "report.html")
    check_writable(path)
    with show_progress("writing the report", hidden=json):
        subjects = read_subjects(named, problem)
        written = write_report(subjects, path, title=title)
    verified = {
        label: warn_about_verification(gait, named[label], hidden=json, name=label)
        for label, gait in subjects.items()
        if not isinstance(gait, AnyCycle)  # found by simulation
    }
    if json:
        print_json({"file": str(written), "gait_verified": verified})
    else:
        report_file(written)


def export_sweep(file: Path, output: Path, sequence: str | None, *, quiet: bool) -> Path:
    """Write a sweep as a table, or its gaits as a library, whose errors at the midpoints of its cells are printed."""
    from gaitopt.export.library_module import write_library
    from gaitopt.export.sweep_table import write_sweep_table
    from gaitopt.motion.atomic import check_suffix
    from gaitopt.study.libraries.gait_library import load_library
    from gaitopt.study.libraries.library_errors import measure_library
    from gaitopt.study.sweeps.sweep_file import load_sweep

    if check_suffix(output, SWEEP_EXPORTS) == ".csv":
        return write_sweep_table(load_sweep(file), output, sequence=sequence)
    library = load_library(file, sequence)
    written = write_library(library, output)
    if not quiet:
        out.print(str(measure_library(library)), soft_wrap=True)
    return written


def _check_options(file: Path, sequence: str | None, states_law: bool) -> None:
    """Raise InputError if an option of the command export does not apply to its file."""
    if file.suffix == ".nc" and states_law:
        raise InputError(f"{file} is a sweep, whose gaits have no law: --law, its options and --problem do not apply.")
    if file.suffix != ".nc" and sequence is not None:
        raise InputError(f"--sequence applies to a sweep (.nc), got {sequence!r} for {file}.")


def _find_planar_robot(gait: "AnyGait") -> "PlanarRobot | None":
    """Return the robot of a gait with several contacts, whose joint powers the motion does not contain.

    Without a robot that can be restored, a note names the option that states it.
    """
    from gaitopt.motion.planar_gait import PlanarGait

    if not isinstance(gait, PlanarGait):
        return None
    try:
        return gait.robot
    except GaitoptError:
        err.print("The table has no joint powers, because the file does not contain the robot; name it with --problem.")
        return None


def export(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="Gait file written by 'gaitopt solve', or sweep (.nc).")],
    output: Annotated[
        Path,
        typer.Option(
            "--output", "-o", metavar="CSV/JSON/C/PY", help="File to write; its suffix determines the contents."
        ),
    ],
    problem: RobotScript = None,
    law: LawName = OPEN_LOOP,
    gain: GainValues = None,
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    sequence: Annotated[
        str | None, typer.Option("--sequence", metavar="SEQUENCE", help="Contact sequence, for a sweep with several.")
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write a gait for other programs: trajectories (.csv), torques (.json), dynamics (.c) or a controller (.c, .py).

    A .py controller needs NumPy only.  Without --law, the controller replays the planned torques and has no gains.

    The gait file itself is HDF5, which MATLAB, Julia and others read directly; the page 'The gait file' of the
    documentation describes it.

    A sweep (.nc) is written as a table (.csv), with a line for each point and units in the names of the columns, or as
    a gait library (.py), which interpolates the gaits over the axes; the largest errors at the midpoints of the grid
    cells are reported.

    Example: gaitopt export compass_slip.h5 -o controller.c --law lqr

    Example: gaitopt export speeds.nc -o speeds.csv
    """
    _check_options(file, sequence, law != OPEN_LOOP or bool(gain or torque_limit or stance_angle or problem))
    if file.suffix == ".nc":
        report_file(export_sweep(file, output, sequence, quiet=json or quiet), json=json)
        return
    from gaitopt.cli.script import load_any_gait
    from gaitopt.export.c_code import write_c
    from gaitopt.export.csv_file import write_csv
    from gaitopt.export.python_controller import write_python
    from gaitopt.export.torque_table import write_torques
    from gaitopt.motion.atomic import check_suffix

    refuse_walk_script(file)
    suffix, gait = check_suffix(output, EXPORTS), load_any_gait(file, problem)
    if suffix == ".csv":
        report_file(write_csv(gait.motion, output, robot=_find_planar_robot(gait)), json=json)
        return
    if suffix == ".json" and find_feedback(law, gain, torque_limit, stance_angle) is None:
        report_file(write_torques(gait.motion, output), json=json)
        return
    robot, chosen = gait.robot, law_of_gait(gait, law, gain, torque_limit, stance_angle)
    if suffix == ".json":
        written = write_torques(gait.motion, output, law=None if law == OPEN_LOOP else chosen)
    elif suffix == ".py":
        written = write_python(robot, chosen, output)
    else:
        written = write_c(robot, chosen, gait.motion.parameters, output)
    report_file(written, json=json)
