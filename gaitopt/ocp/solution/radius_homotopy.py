"""Approach to a bound on the spectral radius, from a gait that violates it, by bounds that decrease in steps."""

import math

from attrs import evolve

from gaitopt.motion.gait import Gait
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.mesh_refinement import find_coarsest_grid
from gaitopt.ocp.solution.radius_conflict import measure_planned_radius
from gaitopt.ocp.solution.single_start import solve_from_start
from gaitopt.ocp.statement.criteria import TorqueSquared
from gaitopt.ocp.statement.warm_start import WarmStart
from gaitopt.progress import Observer
from gaitopt.status import Status

FIRST_STEP = 0.21
"""First decrease of the bound, relative to the distance of the radius of the first gait from the requested bound."""

SHRINKAGE = 0.5
"""Factor of the decrease after a solve that does not converge."""

MOST_FAILURES = 2
"""Number of solves that do not converge after which the approach ends."""


def approach_radius(problem: GaitProblem, gait: Gait, solver: NlpSolver, observer: Observer) -> Gait | None:
    """Return a gait on the coarsest grid that meets the bound on the spectral radius, or None if none is reached.

    An interrupted solve ends the approach, and its gait is returned.

    A non-smooth objective is replaced by the squared torques: with the absolute work, many of these solves do not
    converge.

    Parameters
    ----------
    problem : GaitProblem
        With a bound on the spectral radius.
    gait : Gait
        A gait that meets all limits of the problem except the bound, such as the optimum without it.
    solver : NlpSolver
        Solver of each problem of the sequence.
    observer : Observer
    """
    bound = problem.stability
    if bound is None or math.isinf(bound.radius):
        return None
    radius = measure_planned_radius(problem, gait)
    if not bound.radius < radius < math.inf:
        return None
    objective = problem.objective if problem.objective.smooth else TorqueSquared()
    grid = evolve(find_coarsest_grid(problem), tolerance=math.inf)
    problem = problem.replace(transcription=grid, objective=objective)
    step, failures = FIRST_STEP * (radius - bound.radius), 0
    while radius > bound.radius and failures < MOST_FAILURES:
        following = max(bound.radius, radius - step)
        stated = problem.replace(stability=evolve(bound, radius=following))
        nearer = solve_from_start(stated, WarmStart(gait), solver, observer)
        if nearer.status is Status.INTERRUPTED:
            return nearer
        if nearer.status.ok:
            gait, radius = nearer, following
        else:
            failures, step = failures + 1, SHRINKAGE * (radius - following)
    return gait if radius <= bound.radius else None
