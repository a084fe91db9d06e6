"""Basins along a branch of a saved diagram."""

import time
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.errors import InputError

if TYPE_CHECKING:
    import xarray as xr

DIAGRAM = ".nc"
"""Suffix of a diagram of branches, and of basins along one of them."""
MOST_VALUES = 100_000
"""Largest number of values of the parameter."""


def compute_diagram_basin(
    traced: tuple[Path, Path | None, int],
    over: list[str],
    engine: str,
    path: Path | None,
    stated: Mapping[str, Any],
    *,
    json: bool,
) -> None:
    """Compute and report the basins along a branch of a saved diagram.

    Parameters
    ----------
    traced : (Path, Path or None, int)
        Diagram, script or saved gait from which it was traced, and number of the branch.
    over : list of str
        Value of ``--over``.
    engine : str
        Name of the engine.
    path : Path or None
        File of the basins.
    stated : mapping of str to object
        Values of the options that are not accepted for a diagram; false if not stated.
    json : bool

    Raises
    ------
    InputError
        If the source is not a diagram, or an option is not accepted.
    """
    from gaitopt.cli.progress_display import show_progress

    began, (file, source, branch) = time.perf_counter(), traced
    if file.suffix != DIAGRAM:
        raise InputError(f"--branch is accepted for a diagram ({DIAGRAM}) only.")
    for option, value in stated.items():
        if value:
            raise InputError(
                f"{option} is not accepted for a diagram ({DIAGRAM}); use --over, --branch, --problem, --engine and "
                "--output."
            )
    with show_progress("basins along a branch", hidden=json):
        table = find_branch_basin(file, over, source, branch, engine)
    report_branch_basin(table, path, json=json, seconds=time.perf_counter() - began)


def find_branch_basin(file: Path, over: list[str], source: Path | None, branch: int, engine: str) -> "xr.Dataset":
    """Return the basins along a branch of a saved diagram of periodic gaits.

    Parameters
    ----------
    file : Path
        Diagram.
    over : list of str
        Value of ``--over``: the parameter of the diagram with its values.
    source : Path or None
        Script or saved gait from which the diagram was traced; optional for a robot of the catalogue without a law.
    branch : int
        Number of the branch.
    engine : str
        Name of the engine.

    Raises
    ------
    InputError
        If the file is of another kind, the axis is not its parameter, or the branch has no gait at any of the values.
    """
    from gaitopt.cli.axis import grid
    from gaitopt.cli.diagram_page import find_problem
    from gaitopt.continuation.branch_diagram import BranchDiagram
    from gaitopt.control.law import passive
    from gaitopt.simulation.engine_choice import engine_named
    from gaitopt.stability.walk_problem import WalkProblem
    from gaitopt.study.basins.branch_basin import trace_basin
    from gaitopt.study.result_file import load_result

    diagram = load_result(file)
    if not isinstance(diagram, BranchDiagram):
        raise InputError(
            f"{file} must be a diagram of periodic gaits, as 'gaitopt trace -o FILE.nc' writes it; basins of gaits at "
            "one set of parameters are computed for a script or a saved gait."
        )
    axes = grid(over, MOST_VALUES)
    if list(axes) != [diagram.parameter]:
        raise InputError(
            f"--over must be the parameter of the diagram, {diagram.parameter}=FROM:TO:COUNT; got {', '.join(axes)}."
        )
    problem = find_problem(diagram, file, source)
    if not isinstance(problem, WalkProblem):
        raise InputError(
            "Basins along a branch are not computed for robots with several contacts; name the script or the gait file "
            "instead."
        )
    chosen = engine_named(engine, problem.law or passive(problem.robot), problem.robot)
    values = axes[diagram.parameter]
    return trace_basin(problem, diagram, values, branch=branch, engine=chosen)


def report_branch_basin(table: "xr.Dataset", path: Path | None, *, json: bool, seconds: float) -> None:
    """Write basins along a branch to their file, and print them as a table or as JSON."""
    from gaitopt.cli.branch_basin_output import branch_basin_facts, print_branch_basin
    from gaitopt.cli.output import print_json, report_file
    from gaitopt.study.basins.branch_basin_file import save_branch_basin

    if path is not None:
        save_branch_basin(table, path)
    if json:
        print_json(branch_basin_facts(table) | {"file": path and str(path), "seconds": seconds})
        return
    print_branch_basin(table)
    if path is not None:
        report_file(path)
