"""Gaits of a branch at a given value of its parameter."""

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.continuation.branch_diagram import BranchDiagram, GaitBranch
from gaitopt.continuation.tracing import points_at
from gaitopt.control.law import passive
from gaitopt.errors import InputError
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.cycle_iteration import find_cycle, same_gait
from gaitopt.stability.walk_problem import WalkProblem


@check_arguments
def gaits_at(
    problem: WalkProblem, diagram: BranchDiagram, value: float, *, branch: int = 0, engine: Engine | None = None
) -> tuple[Cycle, ...]:
    """Return the periodic gaits of a branch at a value of the parameter.

    Newton's method starts from the linear interpolation between the neighbouring points of the branch.

    Parameters
    ----------
    problem : WalkProblem
        The problem whose diagram it is.
    diagram : BranchDiagram
    value : float
        Parameter in SI units.
    branch : int
        Number of the branch.
    engine : Engine, optional

    Returns
    -------
    tuple of Cycle
        In order along the branch: several where it is folded, none outside its range.

    Raises
    ------
    InputError
        If the diagram has no such branch.

    Examples
    --------
    >>> import math
    >>> from gaitopt import WalkProblem, rimless_wheel, trace
    >>> from gaitopt.continuation import gaits_at
    >>> wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": math.radians(13)})
    >>> diagram = trace(wheel, {"friction": (1.0, 0.9)})
    >>> [gait.sequence for gait in gaits_at(wheel, diagram, 0.95)]
    ['stick | stick']
    """
    if not 0 <= branch < len(diagram.branches):
        raise InputError(f"The diagram has branches 0 to {len(diagram.branches) - 1}, got branch {branch}.")
    followed = diagram.branches[branch]
    law, robot = problem.law or passive(problem.robot), problem.robot
    p = robot.vector(robot.resolve({**problem.parameters, diagram.parameter: value}))
    walker = Walker(robot, law, p, engine or default_engine(law, robot))
    gaits = list[Cycle]()
    for z in points_at(followed, value):
        cycle = find_cycle(walker, _with_foot_speed(followed, z), followed.steps)
        if cycle is not None and not any(same_gait(cycle, other) for other in gaits):
            gaits.append(cycle)
    return tuple(gaits)


def _with_foot_speed(branch: GaitBranch, z: np.ndarray) -> np.ndarray:
    """Return a point of a section without foot speed, of a foot that cannot slip, with foot speed 0."""
    return z if "foot_speed" in branch.names else np.append(z, 0.0)
