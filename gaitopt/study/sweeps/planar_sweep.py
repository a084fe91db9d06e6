"""Sweeps of robots with several contacts: tasks, and the dataset with forces and impulses by contact."""

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.ocp.multicontact.planar_guess import FromPlanarGait
from gaitopt.study.planar_metrics import CONTACT_MEASURES, PLANAR_MEASURES
from gaitopt.study.planar_starts import (
    planar_objective,
    select_best,
    solve_default,
    solve_planar_start,
    verify_best_planar,
)
from gaitopt.study.storage.failure_reason import explain_failure
from gaitopt.study.sweeps.sweep_grid import SweepGrid, SweepTask

if TYPE_CHECKING:
    import xarray as xr

    from gaitopt.study.sweeps.sweep_file import SweepResults


def solve_planar_task(grid: SweepGrid, task: SweepTask, *results: PlanarGait | None) -> PlanarGait:
    """Run a task of a sweep: a gait from default starts or neighbours, or the verified best gait of a point."""
    problem = grid.problem_at(task.point)
    gaits = [(point, gait) for (_, point), gait in zip(task.inputs, results, strict=True) if gait is not None]
    solved = [gait for point, gait in gaits if point == task.point]
    if task.kind == "point":
        return verify_best_planar([gait for gait in solved if gait.status.ok] or [solve_default(problem, grid.starts)])
    near = sorted((gait for point, gait in gaits if point != task.point and gait.status.ok), key=planar_objective)
    continued = [solve_planar_start(problem.replace(guess=FromPlanarGait(gait))) for gait in near[:1]]
    if task.kind == "cold" or not (solved or any(gait.status.ok for gait in continued)):
        continued.append(solve_default(problem, grid.starts))
    return select_best([*solved, *continued])


def planar_dataset(findings: "SweepResults") -> "xr.Dataset":
    """Return the table of a sweep of a robot with several contacts; numbers are nan where there is no gait."""
    import xarray as xr

    from gaitopt.study.sweeps.sweep_file import attributes_of

    grid = findings.grid
    robot, shape = grid.problem.robot, grid.shape
    dims = ("sequence", *grid.axes)
    blank = (np.full(shape, math.nan), np.full((*shape, len(_contacts(grid))), math.nan))
    numbers = {m.name: blank[0].copy() for m in PLANAR_MEASURES} | {m.name: blank[1].copy() for m in CONTACT_MEASURES}
    torque, error = np.full((*shape, len(robot.actuators)), math.nan), blank[0].copy()
    status, reason = (np.full(shape, "", dtype=object) for _ in range(2))
    verified = np.zeros(shape, dtype=np.int8)
    for point in grid.points():
        at, gait = (point.sequence, *point.index), findings.gait(point)
        status[at], reason[at] = findings.missing[point] if gait is None else (gait.status.key, explain_failure(gait))
        if not isinstance(gait, PlanarGait) or not gait.status.ok:
            continue
        for measure in (*PLANAR_MEASURES, *CONTACT_MEASURES):
            numbers[measure.name][at] = measure.read(gait)
        torque[at] = np.max(np.abs(gait.motion.channel("torque")), axis=1)
        if gait.verification is not None:
            verified[at], error[at] = gait.verification.passed, gait.verification.state_error
    table: dict[str, Any] = {
        measure.name: (places, numbers[measure.name], {"units": measure.unit, "long_name": measure.meaning})
        for places, measures in ((dims, PLANAR_MEASURES), ((*dims, "contact"), CONTACT_MEASURES))
        for measure in measures
    }
    units = robot.actuator_units if isinstance(robot, PlanarRobot) else ()
    table["peak_torque"] = (
        (*dims, "actuator"),
        torque,
        {
            "units": " or ".join(dict.fromkeys(units)),
            "actuator_units": ", ".join(units),
            "long_name": "largest absolute torque",
        },
    )
    table["status"] = (dims, status, {"long_name": "how the optimisation ended"})
    table["reason"] = (dims, reason, {"long_name": "why there is no gait"})
    table["verified"] = (dims, verified, {"units": "1", "long_name": "1 where the gait passes its replay"})
    table["replay_error"] = (
        dims,
        error,
        {"units": "SI", "long_name": "largest error of the replayed state, in SI units"},
    )
    return xr.Dataset(table, _coordinates(grid), attributes_of(findings))


def _contacts(grid: SweepGrid) -> list[str]:
    """Return the contacts of the robot of a sweep."""
    robot = grid.problem.robot
    return list(robot.contact_names) if isinstance(robot, PlanarRobot) else []


def _coordinates(grid: SweepGrid) -> dict[str, Any]:
    coordinates: dict[str, Any] = {
        name: (name, values, {"units": grid.unit(name)}) for name, values in grid.axes.items()
    }
    coordinates["sequence"] = [str(sequence) for sequence in grid.sequences]
    coordinates["actuator"], coordinates["contact"] = list(grid.problem.robot.actuators), _contacts(grid)
    return coordinates
