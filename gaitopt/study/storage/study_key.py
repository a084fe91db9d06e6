"""Key of a study, as plain data: two runs with equal keys have equal results."""

import hashlib
import json
from typing import Any

import casadi as ca

from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.summary import plain
from gaitopt.ocp.multicontact.planar_limits import PlanarLimits
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.problem import GaitProblem

STRATEGY = 3
"""Version of the solution strategy, increased when it changes so that results of both are not mixed."""


def study_key(problem: GaitProblem | PlanarProblem, **study: Any) -> dict[str, Any]:
    """Return the key of a study: its problem, physics included, and its settings."""
    described = problem.describe() | {"objective": repr(problem.objective)}
    for provenance in ("objective_parameters", "objective_unit", "script"):  # a comment in the script changes no study
        described.pop(provenance, None)
    if described["transcription"].endswith(", 1 substep"):  # studies of earlier versions are resumed
        described["transcription"] += "s"
    if isinstance(problem, PlanarProblem) and problem.limits.clearance == PlanarLimits().clearance:
        described.pop("clearance")  # which the keys of earlier versions did not contain
    return {
        "problem": described,
        "physics": _digest(problem.robot),
        **study,
        "strategy": STRATEGY,
    }


def record_script(problem: GaitProblem | PlanarProblem) -> dict[str, str]:
    """Return the attribute of a dataset with the record of the script of a problem as JSON; none without a script.

    It is not a part of the key: other names of a script or its parameters change no result.
    """
    script = problem.describe().get("script")
    return {"script": json.dumps(plain(script))} if script else {}


def _digest(robot: Robot | PlanarRobot) -> str:
    """Return a digest of the equations, which distinguishes robots of the same name."""
    functions: tuple[ca.Function, ...]
    if isinstance(robot, PlanarRobot):
        functions = (robot.dynamics, robot.energy, robot.gaps, robot.rows, robot.arming)
    else:
        functions = (robot.dynamics, robot.energy, robot.impact, robot.landing, robot.touchdown, robot.swap)
    return hashlib.sha256("".join(function.serialize() for function in functions).encode()).hexdigest()[:16]
