"""Subjects of a report: saved gaits, and the periodic gaits of scripts without optimisation."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from gaitopt.errors import NoGaitError
from gaitopt.motion.hdf5 import identify_file

if TYPE_CHECKING:
    from gaitopt.report.page import Reported
    from gaitopt.report.sections import AnyCycle

STARTS = 8
"""Starts of the search for the periodic gaits of a robot with several contacts."""


def read_subjects(files: Mapping[str, Path], script: Path | None) -> "dict[str, Reported]":
    """Return gaits by label: those in files, of one or several steps, and the first periodic gait of each script.

    Raises
    ------
    InputError
        If a script has no periodic gait or states an optimisation, or a gait has another robot than the script.
    """
    from gaitopt.cli.script import load_gaits
    from gaitopt.ocp.multistep.multistep_file import load_steps

    subjects: dict[str, Reported] = {}
    for label, file in files.items():
        if file.suffix == ".py":
            subjects[label] = find_cycle(file)
        elif _has_several_steps(file):
            subjects[label] = load_steps(file)
        else:
            subjects |= load_gaits({label: file}, script)
    return subjects


def _has_several_steps(file: Path) -> bool:
    return file.is_file() and identify_file(file)["kind"] == "gait of several steps"


def find_cycle(script: Path) -> "AnyCycle":
    """Return the first periodic gait of a walking script, a stable one if there is any."""
    from gaitopt.cli.inputs import Request, read_input
    from gaitopt.cli.planar_walks import search_planar
    from gaitopt.stability.cycle_search import STARTS as RANDOM_STARTS
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem

    request = Request(source=script, settings=[])
    cycle: AnyCycle | None
    if isinstance(request.problem, PlanarWalkProblem):
        cycle = next(iter(search_planar(request.problem, STARTS, steps=1, engine="auto")), None)
    else:
        cycle = read_input(request, RANDOM_STARTS).cycle
    if cycle is None:
        raise NoGaitError(f"No periodic gait of {script} was found; try another slope, friction or state.")
    return cycle
