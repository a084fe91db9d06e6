"""The commands.  Each reads its input, calls one public verb and prints what came of it."""

from pathlib import Path
from typing import Annotated, Any

import typer
from rich.progress import BarColumn, Progress, SpinnerColumn, TextColumn, TimeElapsedColumn

from gaitopt.cli.output import err, homotopy_lines, out, print_gait, print_json, print_written
from gaitopt.errors import InputError
from gaitopt.progress import HomotopyStep, Iteration

GaitFile = Annotated[Path, typer.Argument(metavar="FILE", help="A gait written by 'gaitopt solve'.")]
RobotScript = Annotated[
    Path | None,
    typer.Option("--problem", metavar="PROBLEM.py", help="Script with the robot, for one not in the catalogue."),
]
Json = Annotated[bool, typer.Option("--json", help="Print one JSON object and nothing else.")]
Quiet = Annotated[bool, typer.Option("--quiet", "-q", help="No progress and no table.")]


def solve(
    script: Annotated[Path, typer.Argument(metavar="PROBLEM.py", help="A problem script.")],
    setting: Annotated[
        list[str] | None, typer.Option("--set", metavar="NAME=VALUE", help="Change a parameter of the script.")
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="FILE", help="Where to write the gait. [SCRIPT.h5]")
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Annotated[
        bool, typer.Option("--verbose", "-v", help="A line for each iteration, on standard error.")
    ] = False,
) -> None:
    """Find an energy-optimal gait, replay it in the event-driven simulator, and save it.

    Exit status 0 for a solved and verified gait, 1 when there is none, 2 for a mistake in the input.

    Example: gaitopt solve problems/compass_slip.py --set friction=0.2 -o slip.h5
    """
    from rich.markup import escape

    from gaitopt.cli.script import build_problem
    from gaitopt.motion.archive import save
    from gaitopt.motion.atomic import check_writable
    from gaitopt.motion.summary import summarise
    from gaitopt.ocp.solver import solve as solve_problem
    from gaitopt.simulation.verification import verify as verify_gait

    problem = build_problem(script, setting or [])
    path = output or Path(f"{script.stem}.h5")
    check_writable(path)  # before the work, not after it
    columns = (SpinnerColumn(), TextColumn("{task.description}"), TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True, disable=json or quiet) as progress:
        task = progress.add_task(f"{escape(problem.name)}: building")

        def observe(step: Iteration | HomotopyStep) -> None:
            if isinstance(step, HomotopyStep):
                lines = homotopy_lines(step, problem.objective.name) if verbose or not (json or quiet) else []
                err.print(*lines, sep="\n", markup=False, end="\n" if lines else "")
                return
            text = (
                f"iteration {step.number:3d}   {problem.objective.name} {step.objective:.6f}   "
                f"infeasibility {step.infeasibility:.1e}"
            )
            progress.update(task, description=text)
            if verbose:
                err.print(text, markup=False)

        gait = solve_problem(problem, observer=observe)
        if gait.status.ok:
            progress.update(task, description="replaying in the event-driven simulator")
            gait = verify_gait(gait, problem.robot)
    written = save(gait, path) if gait.status.ok else None
    if json:
        print_json(summarise(gait) | {"file": None if written is None else str(written)})
    elif not quiet:
        print_gait(gait)
        if written:
            print_written(written)
        else:
            out.print("no verified gait; nothing was written")
    raise typer.Exit(0 if gait.status.ok else 1)


def show(file: GaitFile, json: Json = False) -> None:
    """Show what a gait file holds.

    Example: gaitopt show compass_slip.h5 --json
    """
    from gaitopt.motion.archive import load
    from gaitopt.motion.summary import summarise

    gait = load(file)
    if json:
        print_json(summarise(gait) | {"file": str(file)})
    else:
        print_gait(gait)


def verify(
    file: GaitFile,
    problem: RobotScript = None,
    json: Json = False,
) -> None:
    """Replay a saved gait's torques in the event-driven simulator and compare with the plan.

    Exit status 0 if it passes, 1 if not.  The file is not changed.

    Example: gaitopt verify compass_slip.h5
    """
    from gaitopt.cli.script import build_problem
    from gaitopt.motion.archive import load
    from gaitopt.motion.summary import summarise
    from gaitopt.simulation.verification import verify as verify_gait

    robot = build_problem(problem, []).robot if problem else None
    gait = verify_gait(load(file), robot)
    if json:
        print_json(summarise(gait) | {"file": str(file)})
    else:
        print_gait(gait)
        out.print("replayed just now in the event-driven simulator; the file is as it was")
    passed = gait.verification is not None and gait.verification.passed
    raise typer.Exit(0 if passed and gait.status.ok else 1)


def plot(
    file: GaitFile,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="PNG/PDF/SVG", help="Where to draw. [FILE.png]")
    ] = None,
    width: Annotated[float, typer.Option(min=2.5, max=20, help="Inches: 3.5 for a column of a journal.")] = 7.2,
    font_size: Annotated[float, typer.Option(min=4, max=20, help="Points, of axis labels.")] = 8.5,
    title: Annotated[bool, typer.Option("--title/--no-title", help="Whether the figure says what it shows.")] = True,
) -> None:
    """Draw a gait: stick figures, angles, torques, force ratio against the friction cone, foot speed.

    Example: gaitopt plot compass_slip.h5 -o slip.pdf --width 3.5 --no-title
    """
    from gaitopt.motion.archive import load
    from gaitopt.plot.gait_figure import plot_gait
    from gaitopt.plot.saving import save_figure
    from gaitopt.plot.style import FigureStyle

    figure = plot_gait(load(file), style=FigureStyle(width=width, font_size=font_size, titled=title))
    print_written(save_figure(figure, output or Path(f"{file.stem}.png")))


def animate(
    file: GaitFile,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", metavar="GIF/MP4", help="Where to write. [FILE.gif]")
    ] = None,
    steps: Annotated[int, typer.Option(min=1, max=100, help="Steps to show.")] = 3,
    slow: Annotated[float, typer.Option(min=0.1, max=100.0, help="Slow motion factor.")] = 2.0,
    quiet: Quiet = False,
) -> None:
    """Animate a gait with its contact force, friction cone, slip marks and current contact mode.

    Example: gaitopt animate compass_slip.h5 -o slip.mp4
    """
    from gaitopt.motion.archive import load
    from gaitopt.plot.animation import animate as animate_gait

    gait = load(file)
    columns = (TextColumn("{task.description}"), BarColumn(), TimeElapsedColumn())
    with Progress(*columns, console=err, transient=True, disable=quiet) as progress:
        task = progress.add_task("drawing frames", total=None)

        def observe(done: int, total: int) -> None:
            progress.update(task, completed=done, total=total)

        written = animate_gait(gait, output or Path(f"{file.stem}.gif"), steps=steps, slow=slow, observer=observe)
    print_written(written)


def report(
    files: Annotated[list[Path], typer.Argument(metavar="FILE...", help="Gaits written by 'gaitopt solve'.")],
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", metavar="HTML", help="Where to write. [FILE.html, or report.html for several]"),
    ] = None,
    title: Annotated[str, typer.Option(help="Title of the page.")] = "Gait report",
    problem: RobotScript = None,
) -> None:
    """Write gaits as one HTML page: animated walker, charts, energy, multipliers, comparison, problem and versions.

    The page needs no network and can be sent as it is.

    Example: gaitopt report slip.h5 stick.h5 -o report.html
    """
    from gaitopt.cli.script import build_problem
    from gaitopt.motion.archive import load
    from gaitopt.motion.atomic import check_writable
    from gaitopt.report.page import write_report

    stems = [file.stem for file in files]
    names = [file.stem if stems.count(file.stem) == 1 else str(file) for file in files]
    if len(set(names)) < len(names):
        raise InputError("The same gait file is named twice.")
    path = output or Path(f"{stems[0]}.html" if len(files) == 1 else "report.html")
    check_writable(path)
    gaits = {name: load(file) for name, file in zip(names, files, strict=True)}
    robot = build_problem(problem, []).robot if problem else None
    print_written(write_report(gaits, path, title=title, robot=robot))


def export(
    file: GaitFile,
    output: Annotated[
        Path, typer.Option("--output", "-o", metavar="CSV/JSON/C", help="Where to write; the suffix says what.")
    ],
    problem: RobotScript = None,
) -> None:
    """Write a gait for other programs: .csv trajectories, .json torque table, .c dynamics and controller.

    The gait file itself is HDF5, which MATLAB, Julia and others read as it is (docs/file_format.md).

    Example: gaitopt export compass_slip.h5 -o walk.csv
    """
    from gaitopt.cli.script import build_problem
    from gaitopt.control.law import feedforward
    from gaitopt.export.c_code import write_c
    from gaitopt.export.csv_file import write_csv
    from gaitopt.export.torque_table import write_torques
    from gaitopt.model.catalogue import robot_named
    from gaitopt.motion.archive import load
    from gaitopt.motion.atomic import checked_suffix

    suffix = checked_suffix(output, {".csv": "trajectories", ".json": "torque table", ".c": "dynamics and controller"})
    gait = load(file)
    if suffix == ".csv":
        written = write_csv(gait.motion, output)
    elif suffix == ".json":
        written = write_torques(gait.motion, output)
    else:
        robot = build_problem(problem, []).robot if problem else robot_named(gait.robot)
        written = write_c(robot, feedforward(robot, gait.motion), gait.motion.parameters, output)
    print_written(written)


def problems(
    folder: Annotated[Path | None, typer.Argument(help="Folder of problem scripts. [problems]")] = None,
    json: Json = False,
) -> None:
    """List the problem scripts of a folder, and the studies in its subfolder, with their parameters.

    Example: gaitopt problems
    """
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    folder = folder or Path("problems")
    if not folder.is_dir():
        raise InputError(f"There is no folder {folder}; name the folder that holds your problem scripts.")
    scripts = [*sorted(folder.glob("*.py")), *sorted(folder.glob("studies/*.py"))]
    entries = [entry for path in scripts if (entry := _entry(path)) is not None]
    if json:
        print_json({"problems": entries})
        return
    table = Table(box=box.SIMPLE, pad_edge=False)
    for column in ("script", "what it is", "parameters"):
        table.add_column(column, overflow="fold")
    for entry in entries:
        values = ", ".join(f"{name}={value!r}" for name, value in entry["parameters"].items())
        table.add_row(*map(escape, (entry["script"], entry["description"], entry.get("error", values))))
    out.print(table)


def _entry(path: Path) -> dict[str, Any] | None:
    """Return what a script is, or None for a module that only serves scripts."""
    import ast

    from gaitopt.cli.script import load_script, script_parameters
    from gaitopt.errors import GaitoptError
    from gaitopt.motion.summary import plain

    kind = "study" if path.parent.name == "studies" else "problem"
    if kind == "study" and b"def study(" not in path.read_bytes():
        return None
    try:
        parameters = plain(script_parameters(load_script(path, kind)))
        description = (ast.get_docstring(ast.parse(path.read_bytes())) or "").split("\n")[0]
    except GaitoptError as error:
        return {"script": str(path), "kind": kind, "description": "", "parameters": {}, "error": str(error)}
    return {"script": str(path), "kind": kind, "description": description, "parameters": parameters}
