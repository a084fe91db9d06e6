"""Setup commands: new writes a problem script, doctor tests the installation."""

import platform
import re
import sys
from collections.abc import Callable
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

import typer

from gaitopt.cli.installed_scripts import SCRIPT_OF_ROBOT, read_scripts, script_of_robot
from gaitopt.cli.options import Json, Quiet, Verbose
from gaitopt.cli.output import out, print_json, print_reason, report_file, verdict_text
from gaitopt.cli.robot_script import include_robot
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError

PARTS = (
    "gaitopt",
    "casadi",
    "numpy",
    "scipy",
    "h5py",
    "matplotlib",
    "imageio-ffmpeg",
    "heyoka",
    "distributed",
    "typer",
    "rich",
)
"""Packages whose versions are reported."""


PURPOSES = {
    "fast": "for fast simulation; without it, basins, push tests and tuning take many times as long",
    "cluster": "for sweeps, searches and basins on several machines; without it, on the processors of this one",
    "import": "for robots from URDF and MJCF files",
    "docs": "to build the documentation",
    "test": "to run the tests",
}
"""What each extra is needed for."""


def new(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="NAME", help="Name of the script, with or without .py.", show_default="that of --robot or --from"
        ),
    ] = None,
    source: Annotated[
        str | None,
        typer.Option("--from", metavar="SCRIPT", help="Script to copy, one of those listed by gaitopt problems."),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option("--robot", metavar="ROBOT", help=f"Robot of the catalogue: {', '.join(SCRIPT_OF_ROBOT)}."),
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Write a commented problem script as a starting point.

    With --from, a copy of an installed script is written, and beside it the scripts that it imports; with --robot, the
    script of a robot with the definition of its bodies, contacts and actuators.  'gaitopt solve' checks
    the robot of such a script for errors first, as it does with every custom robot.  An existing file is never
    overwritten.

    Example: gaitopt new my_walker --robot compass_biped
    """
    if robot is not None:
        if source is not None:
            raise InputError(f"--robot {robot} and --from {source} exclude each other; give one of them.")
        source = script_of_robot(robot)
    name = name if name is not None else robot or source
    if name is None:
        raise InputError("The name of the script is missing: state it, as in 'gaitopt new my_walker'.")
    path = Path(name if name.endswith(".py") else f"{name}.py")
    if path.name.startswith("."):
        raise InputError(f"The name of a script must not be empty or begin with a dot, got {name!r}.")
    if source is None:
        template = (files("gaitopt.cli") / "templates" / "problem.py").read_text(encoding="utf-8")
        _write_new(path, template.replace("NAME", path.stem))
    else:
        _copy_script(source, path, robot)
    report_file(path, json=json)
    if not json and robot is not None:
        out.print(f"{robot} is defined in {path}: change its bodies, contacts and actuators there", soft_wrap=True)
    if not json and source is None:
        out.print(f"next: gaitopt solve {path}", soft_wrap=True)


def _copy_script(source: str, path: Path, robot: str | None) -> None:
    """Write a copy of an installed script, and beside it the scripts that it imports unless they are there already.

    If a robot is given, the copy contains its definition.
    """
    (script, text), *imported = read_scripts(source).items()
    text = text if robot is None else include_robot(text, robot)
    for beside, content in imported:
        target = path.with_name(beside)
        if target == path or (target.exists() and target.read_text(encoding="utf-8") != content):
            raise InputError(
                f"{script} imports {beside}, but {target} exists with different contents; choose another folder."
            )
    _write_new(path, text.replace(f"problems/studies/{script}", str(path)).replace(f"problems/{script}", str(path)))
    for beside, content in imported:
        if not path.with_name(beside).exists():
            _write_new(path.with_name(beside), content)


def _write_new(path: Path, text: str) -> None:
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise InputError(f"{path} already exists; choose another name.") from None
    except OSError as error:
        raise InputError(f"Cannot write {path}: {error.strerror}.") from None


@dataclass(frozen=True)
class Check:
    """Result of a check of the installation."""

    name: str
    well: bool
    text: str


def doctor(
    file: Annotated[
        Path | None,
        typer.Argument(
            metavar="FILE", help="HDF5 file of a gait, sweep, basin, front or diagram to check.", show_default=False
        ),
    ] = None,
    json: Json = False,
    quiet: Quiet = False,
    verbose: Verbose = False,
) -> None:
    """Show what is installed and test the essential parts, or check whether a file is intact and readable.

    Exit status 0 if all essential parts work or the file is intact, 1 otherwise.  A missing extra is not an error.

    Example: gaitopt doctor compass_slip.h5
    """
    if file is not None:
        raise typer.Exit(0 if _check_file(file, json=json) else 1)
    versions = {name: _version(name) for name in PARTS}
    results = [_run_check(name, check) for name, check in CHECKS.items()]
    facts: dict[str, Any] = {
        "python": sys.version.split()[0],
        "platform": platform.platform(),
        "versions": versions,
        "extras": _extras(),
        "unavailable_extras": _unavailable_extras(),
        "checks": [vars(result) for result in results],
        "well": all(result.well for result in results),
    }
    if json:
        print_json(facts)
    else:
        print_installation(facts)
    for check in facts["checks"]:
        if not check["well"]:
            print_reason(f"{check['name']}: {check['text']}")
    raise typer.Exit(0 if facts["well"] else 1)


def _check_file(file: Path, *, json: bool) -> bool:
    """Print what is known of a file, and return whether it is intact."""
    from gaitopt.cli.file_check import examine_file, tabulate_facts

    facts = examine_file(file)
    well = not facts["error"]
    if not well:
        print_reason(str(facts["error"]))
    if json:
        print_json(facts | {"well": well})
        return well
    for name, text in tabulate_facts(facts):
        out.print(f"{name:9s} {text}", soft_wrap=True)
    out.print(verdict_text("The file is intact." if well else facts["error"], well), soft_wrap=True)
    return well


def print_installation(facts: dict[str, Any]) -> None:
    """Print what is installed, and whether it works, as a table."""
    from rich import box
    from rich.table import Table
    from rich.text import Text

    table = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    table.add_row("python", f"{facts['python']} on {facts['platform']}")
    for name, version in facts["versions"].items():
        table.add_row(name, version or "not installed")
    for name, present in facts["extras"].items():
        reason = facts["unavailable_extras"].get(name)
        missing = reason or f"not installed: pip install 'gaitopt[{name}]'"
        missing += f", {PURPOSES[name]}" if name in PURPOSES else ""
        table.add_row(f"extra {name}", "installed" if present else missing)
    for check in facts["checks"]:
        verdict = verdict_text("works" if check["well"] else "fails", check["well"])
        table.add_row(check["name"], Text.assemble(verdict, f": {check['text']}"))
    out.print(table)


def _version(name: str) -> str | None:
    from importlib import metadata

    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _extras() -> dict[str, bool]:
    """Return for each extra of gaitopt whether all its packages are installed."""
    installed: dict[str, bool] = {}
    for requirement in _requirements():
        package, extra = re.match(r"[\w.-]+", requirement), re.search(r"extra == ['\"]([\w-]+)", requirement)
        if package and extra:
            installed[extra[1]] = installed.get(extra[1], True) and _version(package[0]) is not None
    return installed


def _requirements() -> list[str]:
    """Return the requirements of the installed gaitopt; none for a source tree that is not installed."""
    from importlib import metadata

    return list(metadata.requires("gaitopt") or ()) if _version("gaitopt") else []


def _unavailable_extras() -> dict[str, str]:
    """Return for each extra that installs nothing on this system the reason."""
    reasons: dict[str, str] = {}
    for requirement in _requirements():
        package, extra = re.match(r"[\w.-]+", requirement), re.search(r"extra == ['\"]([\w-]+)", requirement)
        system = re.search(r"platform_system == ['\"](\w+)", requirement)
        if package and extra and system and system[1] != platform.system() and _version(package[0]) is None:
            reasons[extra[1]] = f"not available: {package[0]} is for {system[1]} only, not for {platform.system()}"
    return reasons


def _run_check(name: str, check: Callable[[], str]) -> Check:
    """Return the result of a check; an exception is a failure."""
    try:
        return Check(name, True, check())
    except Exception as error:
        return Check(name, False, f"{type(error).__name__}: {error}")


def _solver() -> str:
    """Solve min x^2 with x >= 1 by Ipopt."""
    import casadi as ca

    x = ca.SX.sym("x")
    quiet = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
    solver = ca.nlpsol("solver", "ipopt", {"x": x, "f": x**2}, quiet)
    optimum = float(solver(x0=3, lbx=1)["x"])
    if not solver.stats()["success"] or abs(optimum - 1) > 1e-6:
        raise RuntimeError(f"expected 1, got {optimum} ({solver.stats()['return_status']})")
    return "Ipopt with the linear solver mumps"


def _engines() -> str:
    """Simulate a step of the published sticking gait with every installed engine."""
    import numpy as np

    from gaitopt.model.robots.compass import compass_biped
    from gaitopt.simulation.engine_choice import default_engine
    from gaitopt.simulation.scipy_engine import ScipyEngine
    from gaitopt.simulation.simulator import simulate

    engines = {engine.name: engine for engine in (ScipyEngine(), default_engine())}
    q, v = np.array([0, 0, -0.147836890, -0.147836890]), np.array([0, 0, 0.732796791, -0.500667882])
    for engine in engines.values():
        walk = simulate(compass_biped(), q, v, {"slope": np.deg2rad(1), "friction": 0.3}, engine=engine)
        if abs(walk.motion.period - 0.744620868) > 1e-7:
            raise RuntimeError(
                f"{engine.name}: the period of the test gait is {walk.motion.period} s instead of 0.744620868 s"
            )
    return f"{', '.join(engines)}; the fastest is {default_engine().name}"


def _animations() -> str:
    """Find the program that writes MP4 animations."""
    from imageio_ffmpeg import get_ffmpeg_version

    return f"ffmpeg {get_ffmpeg_version()}"


def _versions() -> str:
    """Compare the installed packages with the oldest versions that gaitopt supports."""
    bounds = (re.fullmatch(r"([\w.-]+)\s*>=\s*([\d.]+)", requirement) for requirement in _requirements())
    required = {bound[1]: bound[2] for bound in bounds if bound}
    old = [
        f"{name} {version}, accepted: {required[name]} or newer"
        for name in required
        if (version := _version(name)) and _numbers(version) < _numbers(required[name])
    ]
    if old:
        raise RuntimeError("; ".join(old))
    if required:
        return f"{len(required)} packages are as new as required"
    return "versions are not compared: gaitopt is not installed"


def _numbers(version: str) -> tuple[int, ...]:
    """Return the numbers of a version for comparison, without the suffix of a release candidate."""
    return tuple(int(number) for number in re.findall(r"\d+", re.split(r"[a-z+]", version)[0]))


CHECKS = {"versions": _versions, "solver": _solver, "engines": _engines, "animations": _animations}
