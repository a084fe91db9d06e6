"""Commands that write a gait for people and for other programs: plot, animate, report, export."""

from pathlib import Path
from typing import Annotated

import typer
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from gaitopt.cli.law import OPEN_LOOP, GainValues, LawName, StanceAngle, TorqueLimit, law_for
from gaitopt.cli.options import GaitFile, Json, Quiet, RobotScript, labelled
from gaitopt.cli.output import err, print_written


def plot(
    file: GaitFile,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="PNG/PDF/SVG", help="Where to draw. [FILE.png]")
    ] = None,
    width: Annotated[float, typer.Option(min=2.5, max=20, help="Inches: 3.5 for a column of a journal.")] = 7.2,
    font_size: Annotated[float, typer.Option(min=4, max=20, help="Points, of axis labels.")] = 8.5,
    title: Annotated[bool, typer.Option("--title/--no-title", help="Whether the figure says what it shows.")] = True,
    json: Json = False,
) -> None:
    """Draw a gait: stick figures, angles, torques, force ratio against the friction cone, foot speed.

    Example: gaitopt plot compass_slip.h5 -o slip.pdf --width 3.5 --no-title
    """
    from gaitopt.motion.archive import load
    from gaitopt.plot.gait_figure import plot_gait
    from gaitopt.plot.saving import save_figure
    from gaitopt.plot.style import FigureStyle

    figure = plot_gait(load(file), style=FigureStyle(width=width, font_size=font_size, titled=title))
    print_written(save_figure(figure, output or Path(f"{file.stem}.png")), json=json)


def animate(
    file: GaitFile,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="GIF/MP4", help="Where to write. [FILE.gif]")
    ] = None,
    steps: Annotated[int, typer.Option(min=1, max=100, help="Steps to show.")] = 3,
    slow: Annotated[float, typer.Option(min=0.1, max=100.0, help="Slow motion factor.")] = 2.0,
    json: Json = False,
    quiet: Quiet = False,
) -> None:
    """Animate a gait with its contact force, friction cone, slip marks and current contact mode.

    Example: gaitopt animate compass_slip.h5 -o slip.mp4
    """
    from gaitopt.motion.archive import load
    from gaitopt.plot.animation import animate as animate_gait

    gait = load(file)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True, disable=json or quiet) as progress:
        task = progress.add_task("drawing frames", total=None)

        def observe(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total)

        written = animate_gait(gait, output or Path(f"{file.stem}.gif"), steps=steps, slow=slow, observer=observe)
    print_written(written, json=json)


def report(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Gaits written by 'gaitopt solve'.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="HTML", help="Where to write. [FILE.html, or report.html for several]"),
    ] = None,
    title: Annotated[str, typer.Option(help="Title of the page.")] = "Gait report",
    problem: RobotScript = None,
    json: Json = False,
) -> None:
    """Write gaits as one HTML page: animated walker, charts, energy, multipliers, comparison, problem and versions.

    The page needs no network and can be sent as it is.

    Example: gaitopt report slip.h5 stick.h5 -o report.html
    """
    from gaitopt.cli.script import build_problem
    from gaitopt.motion.archive import load
    from gaitopt.motion.atomic import check_writable
    from gaitopt.report.page import write_report

    named = labelled(files)
    path = output or Path(f"{files[0].stem}.html" if len(files) == 1 else "report.html")
    check_writable(path)
    gaits = {name: load(file) for name, file in named.items()}
    robot = build_problem(problem, []).robot if problem else None
    print_written(write_report(gaits, path, title=title, robot=robot), json=json)


def export(
    file: GaitFile,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="CSV/JSON/C", help="Where to write; the suffix says what.")
    ],
    problem: RobotScript = None,
    law: LawName = OPEN_LOOP,
    gain: GainValues = None,
    torque_limit: TorqueLimit = None,
    stance_angle: StanceAngle = False,
    json: Json = False,
) -> None:
    """Write a gait for other programs: .csv trajectories, .json torques and gains, .c dynamics and controller.

    Without --law the controller plays the torques back and there are no gains.

    The gait file itself is HDF5, which MATLAB, Julia and others read as it is (docs/file_format.md).

    Example: gaitopt export compass_slip.h5 -o controller.c --law lqr
    """
    from gaitopt.cli.script import robot_of
    from gaitopt.export.c_code import write_c
    from gaitopt.export.csv_file import write_csv
    from gaitopt.export.torque_table import write_torques
    from gaitopt.motion.archive import load
    from gaitopt.motion.atomic import check_suffix

    suffix = check_suffix(
        output, {".csv": "trajectories", ".json": "torques and gains", ".c": "dynamics and controller"}
    )
    gait = load(file)
    if suffix == ".csv":
        print_written(write_csv(gait.motion, output), json=json)
        return
    robot = robot_of(gait, problem)
    chosen = law_for(gait, robot, law, gain, torque_limit, stance_angle)
    if suffix == ".json":
        written = write_torques(gait.motion, output, law=None if law == OPEN_LOOP else chosen)
    else:
        written = write_c(robot, chosen, gait.motion.parameters, output)
    print_written(written, json=json)
