"""What a study asks, as plain data: two runs with equal questions have equal answers."""

import hashlib
from typing import Any

from gaitopt.model.robot import Robot
from gaitopt.ocp.problem import GaitProblem

STRATEGY = 3
"""Raised when studies find their gaits in another way, so that results of both are not mixed."""


def study_key(problem: GaitProblem, **study: Any) -> dict[str, Any]:
    """Return the question of a study: its problem, physics included, and its own settings."""
    described = problem.describe() | {"objective": repr(problem.objective)}
    for provenance in ("objective_parameters", "objective_unit", "script"):  # a comment in the script changes no study
        del described[provenance]
    return {
        "problem": described,
        "physics": _digest(problem.robot),
        **study,
        "strategy": STRATEGY,
    }


def _digest(robot: Robot) -> str:
    """Return what tells robots of one name with different equations apart."""
    functions = (robot.dynamics, robot.energy, robot.impact, robot.landing, robot.touchdown, robot.swap)
    return hashlib.sha256("".join(function.serialize() for function in functions).encode()).hexdigest()[:16]
