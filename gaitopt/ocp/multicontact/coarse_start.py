"""Second start of a solve that failed: the solution of the same problem on a coarser grid."""

import math
from collections.abc import Callable

from attrs import evolve

from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.ocp.multicontact.planar_guess import FromPlanarGait
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.status import Status

MOST_COARSE_ITERATIONS = 200
"""Largest number of iterations of the solve on the coarser grid: those that converged took 32 to 125."""


def solve_from_coarse_grid(
    problem: PlanarProblem, solver: Ipopt, solve_once: Callable[[PlanarProblem, Ipopt], PlanarGait]
) -> PlanarGait | None:
    """Return the gait solved from the solution on half as many intervals; None if there is none.

    The path of Ipopt to a solution far from the guess is sensitive to rounding: from nearly the same first iterates, a
    step that its watchdog accepts may lead to forces of 1e5 N, from which its restoration phase does not return.  On
    another grid the path is another one.  An interrupted solve is returned as well.

    Parameters
    ----------
    problem : PlanarProblem
        A problem with a closed contact sequence.
    solver : Ipopt
    solve_once : callable
        Solves a problem from its guess with a solver.
    """
    counts = tuple((count + 1) // 2 for count in problem.counts)
    if counts == problem.counts:
        return None
    coarse = evolve(problem.transcription, intervals=counts, tolerance=math.inf)
    limited = evolve(solver, max_iterations=min(solver.max_iterations, MOST_COARSE_ITERATIONS))
    near = solve_once(problem.replace(transcription=coarse), limited)
    if near.status is Status.INTERRUPTED:
        return near
    if not near.status.ok:
        return None
    gait = solve_once(problem.replace(guess=FromPlanarGait(near)), solver)
    return gait if gait.status.ok or gait.status is Status.INTERRUPTED else None
