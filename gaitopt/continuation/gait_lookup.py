"""Gaits of a branch at a given value of its parameter."""

from gaitopt.arguments import check_arguments
from gaitopt.continuation.branch_diagram import BranchDiagram
from gaitopt.continuation.gait_source import AnyCycle, AnyWalkProblem, make_gait_source
from gaitopt.continuation.tracing import points_at
from gaitopt.errors import InputError
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.cycle_iteration import same_gait

SAME = 1e-6
"""Largest difference of the states of one gait."""


@check_arguments
def gaits_at(
    problem: AnyWalkProblem,
    diagram: BranchDiagram,
    value: float,
    *,
    branch: int = 0,
    engine: Engine | PlanarEngine | None = None,
) -> tuple[AnyCycle, ...]:
    """Return the periodic gaits of a branch at a value of the parameter.

    Newton's method starts from the linear interpolation between the neighbouring points of the branch.

    Parameters
    ----------
    problem : WalkProblem or PlanarWalkProblem
        The problem for which the diagram was computed.
    diagram : BranchDiagram
    value : float
        Parameter in SI units.
    branch : int
        Number of the branch.
    engine : Engine or PlanarEngine, optional

    Returns
    -------
    tuple of Cycle or PlanarCycle
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
    source = make_gait_source(problem, {diagram.parameter: diagram.ends}, engine)
    gaits = list[AnyCycle]()
    for z in points_at(followed, value):
        cycle = source.gait_near(value, dict(zip(followed.names, z, strict=True)), followed.steps)
        if cycle is not None and not any(_are_same(cycle, other) for other in gaits):
            gaits.append(cycle)
    return tuple(gaits)


def _are_same(one: AnyCycle, other: AnyCycle) -> bool:
    """Return whether two gaits of a problem are the same."""
    if isinstance(one, Cycle) and isinstance(other, Cycle):
        return same_gait(one, other)
    if isinstance(one, Cycle) or isinstance(other, Cycle):
        return False
    states = one.periodic_state, other.periodic_state
    return states[0].keys() == states[1].keys() and all(
        abs(value - states[1][name]) <= SAME for name, value in states[0].items()
    )
