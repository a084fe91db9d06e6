"""Gaits of several steps as files: one group for each step, in the layout of a gait, and the record of the solve."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import h5py

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.interrupts import hold_interrupt
from gaitopt.model.robot import Robot
from gaitopt.model.terrain import Terrain
from gaitopt.motion.archive import read_gait, read_verification, write_flat_record, write_gait
from gaitopt.motion.atomic import check_gait_suffix
from gaitopt.motion.gait import Gait, SolverReport, Verification
from gaitopt.motion.hdf5 import read_hdf5, write_hdf5
from gaitopt.motion.robot_archive import SharedGroups
from gaitopt.motion.summary import plain
from gaitopt.motion.versions import versions
from gaitopt.ocp.multistep.multistep_gait import MultiStepGait
from gaitopt.ocp.multistep.multistep_problem import MultiStepProblem
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.statement.limits import Limits, Margins
from gaitopt.ocp.statement.objective_names import OBJECTIVES, objective_named
from gaitopt.status import Status

KIND, VERSION = "gait of several steps", 1

STEPS = "steps"
"""Group of the steps, in their order."""

_RECORD = ("objective", "iterations", "constraint_violation", "error_between_nodes", "message")
_MARGINS = {
    "cone": "cone_margin",
    "impact_cone": "impact_cone_margin",
    "slip_speed": "slip_speed_margin",
    "sliding_inertia": "sliding_inertia_margin",
    "separation": "separation_margin",
    "normal_force": "normal_force_margin",
    "touchdown_rate": "touchdown_rate_margin",
    "touchdown_armed": "touchdown_armed_margin",
}
"""Entries of the description of a problem by margin."""


@check_arguments
def save_steps(gait: MultiStepGait, path: str | Path) -> Path:
    """Write a gait of several steps to a file atomically.

    Parameters
    ----------
    gait : MultiStepGait
    path : str or Path
        Ends in ``.h5`` or ``.hdf5``.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the suffix is another one, or a step has a custom objective or one with parameters.
    ArchiveError
        If the file is not writable.

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import GaitProblem, Limits, compass_biped
    >>> from gaitopt.ocp import MultiStepProblem, load_steps, solve_steps
    >>> step = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.3, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared")
    >>> gait = solve_steps(MultiStepProblem(steps=(step, step)))
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     load_steps(save_steps(gait, f"{folder}/two.h5")).sequences
    ('stick | stick', 'stick | stick')
    """
    path, problem = Path(path), gait.problem
    check_gait_suffix(path)
    for number, step in enumerate(problem.steps):
        if step.objective.name not in OBJECTIVES or objective_named(step.objective.name) != step.objective:
            raise InputError(f"steps[{number}] has the objective {step.objective!r}; files accept objectives by name.")
    with hold_interrupt() as interrupt, write_hdf5(path) as file:
        file.attrs.update(format=f"gaitopt {KIND}", format_version=VERSION, status=gait.status.key)
        file.attrs.update({name: getattr(gait, name) for name in _RECORD})
        ends = {name: getattr(problem, name) for name in ("name", "start", "end")}
        ends["footholds"] = [[number, *pair] for number, pair in problem.footholds.items()]
        if problem.terrain is not None:  # the pieces are known without the guesses, which are not in the file
            ends["terrain"] = problem.terrain.describe()
            places = [foothold.expected for foothold in problem.ground]
            ends["expected_places"] = list(enumerate(places))[1:]
        file.attrs["problem"] = json.dumps(plain(ends))
        robots: SharedGroups = {}
        for number in range(len(problem.steps)):
            write_gait(file.create_group(f"{STEPS}/{number:04d}"), gait_of_step(gait, number), robots)
        if gait.verification is not None:
            write_flat_record(file.create_group("verification"), gait.verification)
    interrupt.check()
    return path


@check_arguments
def load_steps(path: str | Path) -> MultiStepGait:
    """Read a gait of several steps from a file.

    The problems of the steps are restored without their guesses and transcriptions.

    Raises
    ------
    ArchiveError
        If the file is missing, damaged or of another kind.

    Examples
    --------
    >>> load_steps("nowhere.h5")
    Traceback (most recent call last):
    ...
    gaitopt.errors.ArchiveError: There is no file nowhere.h5.
    """
    with read_hdf5(path, KIND, VERSION) as file:
        gaits = [_read_step(file[STEPS][name]) for name in sorted(file[STEPS])]
        stated = json.loads(str(file.attrs["problem"]))
        robot = gaits[0].robot
        problem = MultiStepProblem(
            steps=tuple(restore_step(robot, gait.problem) for gait in gaits),
            start=stated["start"],
            end=stated["end"],
            footholds={int(number): (float(lower), float(upper)) for number, lower, upper in stated["footholds"]},
            terrain=Terrain(**stated["terrain"]) if "terrain" in stated else None,
            expected_places={int(number): float(place) for number, place in stated.get("expected_places", [])},
            name=str(stated["name"]),
        )
        return MultiStepGait(
            problem=problem,
            status=Status[str(file.attrs["status"]).upper()],
            plans=tuple(gait.motion for gait in gaits),
            objective=float(file.attrs["objective"]),
            iterations=int(file.attrs["iterations"]),
            constraint_violation=float(file.attrs["constraint_violation"]),
            error_between_nodes=float(file.attrs["error_between_nodes"]),
            message=str(file.attrs["message"]),
            verification=read_verification(file, Verification),
        )


def _read_step(group: h5py.Group) -> Gait:
    gait = read_gait(group)
    if not isinstance(gait, Gait):
        raise ValueError("a step must be a gait with one foot on the ground")
    return gait


def gait_of_step(gait: MultiStepGait, number: int) -> Gait:
    """Return one step of a gait of several steps as a gait, for its file; steps are counted from 0.

    The description of its problem has the stated friction, not that of a patch of the terrain.
    """
    problem, plan = gait.problem.resolved_steps[number], gait.plans[number]
    return Gait(
        robot=problem.robot,
        sequence=problem.sequence,
        status=gait.status,
        motion=plan,
        problem={**problem.without_guess().describe(), "friction": gait.problem.steps[number].friction},
        solver=SolverReport(
            iterations=gait.iterations,
            objective=problem.objective.evaluate(plan),
            constraint_violation=gait.constraint_violation,
            error_between_nodes=gait.error_between_nodes,
            build_seconds=0.0,
            solve_seconds=0.0,
            message=gait.message,
        ),
        versions=versions(),
    )


def restore_step(robot: Robot, facts: Mapping[str, Any]) -> GaitProblem:
    """Return the problem of a step from its description."""
    names = [parameter.name for parameter in robot.parameters if parameter.name not in ("slope", "friction")]
    limits = Limits(
        torque=facts["torque_limit"],
        torque_rate=facts["torque_rate_limit"],
        angle={name: tuple(pair) for name, pair in facts["angle_limit"].items()},
        rate=facts["rate_limit"],
        shortest_phase=facts["shortest_phase"],
        longest_step=facts["longest_step"],
        clearance=facts["clearance"],
    )
    targets = {name: _target(facts[name]) for name in ("slope", "speed", "step_length")}
    return GaitProblem(
        robot=robot,
        sequence=facts["sequence"],
        parameters={name: facts[name] for name in names},
        friction=facts["friction"],
        objective=facts["objective"],
        limits=limits,
        margins=Margins(**{name: facts[entry] for name, entry in _MARGINS.items()}),
        name=facts["name"],
        **targets,
    )


def _target(value: Any) -> Any:
    if isinstance(value, list):
        return tuple(math.inf if end is None else end for end in value)
    return value
