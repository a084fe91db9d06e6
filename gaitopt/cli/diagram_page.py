"""Page of a saved diagram of periodic gaits, whose file contains neither robot nor law."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from gaitopt.errors import InputError

if TYPE_CHECKING:
    from gaitopt.continuation.branch_diagram import BranchDiagram
    from gaitopt.continuation.gait_source import AnyWalkProblem

SAME = 1e-4
"""Largest difference of the moduli of the multipliers of a gait from those in the file."""


def write_page_of_file(file: Path, path: Path, source: Path | None, *, coordinate: str | None) -> Path:
    """Write the page of a saved diagram of periodic gaits.

    Parameters
    ----------
    file : Path
        Diagram.
    path : Path
        Page.
    source : Path or None
        Script or saved gait from which the diagram was traced; optional for a robot of the catalogue without a law.
    coordinate : str or None
        Vertical axis; by default the first coordinate.

    Raises
    ------
    InputError
        If the file is of another kind, or the gaits of the diagram are not those of the source.
    """
    from gaitopt.continuation.branch_diagram import BranchDiagram
    from gaitopt.report.branch_page import write_branch_page
    from gaitopt.study.result_file import load_result

    diagram = load_result(file)
    if not isinstance(diagram, BranchDiagram):
        raise InputError(
            f"A page (.html) is written for a diagram of periodic gaits only, and {file} contains another result; "
            "'gaitopt report' writes the page of a gait, and a figure has the suffix .png, .pdf or .svg."
        )
    problem = find_problem(diagram, file, source)
    return write_branch_page(diagram, problem, path, coordinate=coordinate)


def find_problem(diagram: "BranchDiagram", file: Path, source: Path | None) -> "AnyWalkProblem":
    """Return the walking problem of a saved diagram, with the parameters and gains in the diagram.

    Parameters
    ----------
    diagram : BranchDiagram
    file : Path
        Its file.
    source : Path or None
        Script or saved gait from which the diagram was traced; optional for a robot of the catalogue without a law.

    Raises
    ------
    InputError
        If the gaits of the diagram are not those of the source.
    """
    problem = _problem_of(diagram, file, source)
    _require_gaits(diagram, problem, file, source)
    return problem


def _problem_of(diagram: "BranchDiagram", file: Path, source: Path | None) -> "AnyWalkProblem":
    """Return the walking problem of a diagram, with the parameters and gains in the diagram."""
    from gaitopt.cli.inputs import Request, read_walk
    from gaitopt.model.robots.catalogue import CATALOGUE
    from gaitopt.stability.walk_problem import WalkProblem

    problem: AnyWalkProblem
    if source is None:
        if diagram.robot not in CATALOGUE:
            raise InputError(
                f"{file} does not contain the robot {diagram.robot!r}; --problem must name the script or the gait "
                "from which it was traced."
            )
        problem = WalkProblem(robot=CATALOGUE[diagram.robot]())
    elif source.suffix == ".py":
        problem = Request(source=source, settings=[]).problem
    else:
        problem, _ = read_walk(Request(source=source, settings=[]))
    return _set_values(problem, diagram.parameters)


def _set_values(problem: "AnyWalkProblem", values: Mapping[str, float]) -> "AnyWalkProblem":
    """Return a problem with other parameters and gains."""
    from gaitopt.continuation.parameter_values import set_gains
    from gaitopt.control.planar_laws.planar_law import PlanarLaw
    from gaitopt.stability.walk_problem import WalkProblem

    known = {parameter.name for parameter in problem.robot.parameters}
    parameters = {name: value for name, value in values.items() if name in known}
    if isinstance(problem, WalkProblem):
        law = problem.law and set_gains(problem.robot, problem.law, values)
        return replace(problem, parameters=parameters, law=law)
    torque = problem.torque
    torque = set_gains(problem.robot, torque, values) if isinstance(torque, PlanarLaw) else torque
    return replace(problem, parameters=parameters, torque=torque)


def _require_gaits(diagram: "BranchDiagram", problem: "AnyWalkProblem", file: Path, source: Path | None) -> None:
    """Raise InputError unless the first gait of a diagram is a gait of the problem with the same multipliers."""
    from gaitopt.continuation.gait_lookup import gaits_at

    branch = next((branch for branch in diagram.branches if branch.values.size), None)
    if branch is None:
        return  # reported when the page is written
    multipliers = branch.multipliers[0][np.isfinite(branch.multipliers[0])]
    for gait in gaits_at(problem, diagram, float(branch.values[0]), branch=diagram.branches.index(branch)):
        size = min(multipliers.size, gait.multipliers.size)
        if np.allclose(np.abs(gait.multipliers[:size]), np.abs(multipliers[:size]), rtol=SAME, atol=SAME):
            return
    named = f"the gaits of {source}" if source else f"passive gaits of the robot {diagram.robot!r} of the catalogue"
    raise InputError(
        f"The gaits in {file} are not {named}; --problem must name the script or the gait from which they were traced."
    )
