"""Commands to begin with: new writes a problem script, doctor looks at what is installed."""

import platform
import re
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import metadata
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any

import typer

from gaitopt.cli.options import Json
from gaitopt.cli.output import out, print_json, print_written
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
"""Packages whose versions are told."""


def new(
    name: Annotated[str, typer.Argument(metavar="NAME", help="Of the script, with or without .py.")],
    json: Json = False,
) -> None:
    """Write a problem script to start from, with a comment on every line that you may want to change.

    An existing file is never overwritten.

    Example: gaitopt new my_walker
    """
    path = Path(name if name.endswith(".py") else f"{name}.py")
    if path.name.startswith("."):
        raise InputError(f"A script needs a name, got {name!r}.")
    template = (files("gaitopt.cli") / "templates" / "problem.py").read_text(encoding="utf-8")
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(template.replace("NAME", path.stem))
    except FileExistsError:
        raise InputError(f"{path} exists already; choose another name.") from None
    except OSError as error:
        raise InputError(f"Cannot write {path}: {error.strerror}.") from None
    print_written(path, json=json)
    if not json:
        out.print(f"next: gaitopt solve {path}", soft_wrap=True, markup=False)


@dataclass(frozen=True)
class CheckResult:
    """What a check found: whether it is well, and in words."""

    name: str
    well: bool
    text: str


def doctor(json: Json = False) -> None:
    """Tell what is installed, and try out what gaitopt cannot do without.

    Exit status 0 if all that is needed works, 1 if not.  An extra that is missing is no fault.

    Example: gaitopt doctor --json
    """
    versions = {name: _version(name) for name in PARTS}
    findings = [_run_check(name, check) for name, check in CHECKS.items()]
    facts: dict[str, Any] = {
        "python": sys.version.split()[0],
        "platform": platform.platform(),
        "versions": versions,
        "extras": _extras(),
        "checks": [vars(finding) for finding in findings],
        "well": all(finding.well for finding in findings),
    }
    if json:
        print_json(facts)
    else:
        _print(facts)
    raise typer.Exit(0 if facts["well"] else 1)


def _print(facts: dict[str, Any]) -> None:
    from rich import box
    from rich.markup import escape
    from rich.table import Table

    table = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    table.add_row("python", f"{facts['python']} on {escape(facts['platform'])}")
    for name, version in facts["versions"].items():
        table.add_row(name, version or "not installed")
    for name, there in facts["extras"].items():
        missing = escape(f"not installed: pip install 'gaitopt[{name}]'")
        table.add_row(f"extra {name}", "installed" if there else missing)
    for check in facts["checks"]:
        verdict = "[green]works[/]" if check["well"] else "[red]fails[/]"
        table.add_row(check["name"], f"{verdict}: {escape(check['text'])}")
    out.print(table)


def _version(name: str) -> str | None:
    try:
        return metadata.version(name)
    except metadata.PackageNotFoundError:
        return None


def _extras() -> dict[str, bool]:
    """Return for each extra of gaitopt whether all it asks for is installed."""
    found: dict[str, bool] = {}
    requirements = metadata.requires("gaitopt") if _version("gaitopt") else None
    for requirement in requirements or ():
        package, extra = re.match(r"[\w.-]+", requirement), re.search(r"extra == ['\"]([\w-]+)", requirement)
        if package and extra:
            found[extra[1]] = found.get(extra[1], True) and _version(package[0]) is not None
    return found


def _run_check(name: str, check: Callable[[], str]) -> CheckResult:
    """Return what a check says, or what it raised: a doctor must not fall ill."""
    try:
        return CheckResult(name, True, check())
    except Exception as error:
        return CheckResult(name, False, f"{type(error).__name__}: {error}")


def _solver() -> str:
    """Solve min x^2 with x >= 1 by Ipopt."""
    import casadi as ca

    x = ca.SX.sym("x")
    quiet = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes"}
    solver = ca.nlpsol("solver", "ipopt", {"x": x, "f": x**2}, quiet)
    found = float(solver(x0=3, lbx=1)["x"])
    if not solver.stats()["success"] or abs(found - 1) > 1e-6:
        raise RuntimeError(f"expected 1, got {found} ({solver.stats()['return_status']})")
    return "Ipopt with the linear solver mumps"


def _engines() -> str:
    """Walk a step of the published sticking gait with every engine that is there."""
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
            raise RuntimeError(f"{engine.name}: a step of 0.744620868 s took {walk.motion.period} s")
    return f"{', '.join(engines)}; the fastest is {default_engine().name}"


def _movies() -> str:
    """Find the program that writes films."""
    from imageio_ffmpeg import get_ffmpeg_version

    return f"ffmpeg {get_ffmpeg_version()}"


CHECKS = {"solver": _solver, "engines": _engines, "films": _movies}
