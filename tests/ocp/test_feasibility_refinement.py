"""A solution's equations are met to rounding, by the least change."""

import numpy as np

from gaitopt import Ipopt, WarmStart, solve
from gaitopt.ocp.bounds import bounds
from gaitopt.ocp.solution.grid_solve import SingleStart
from gaitopt.progress import silent


def rough(problem):
    """Return a solution that meets its equations to a few digits only."""
    gait = solve(problem)
    start = SingleStart(problem.replace(guess=WarmStart(gait)), WarmStart(gait), Ipopt(tolerance=1e-4), silent)
    return start.solve_on_grid(problem.transcription, gait.solution, 1e-3)


def test_equations_are_met_to_rounding_and_little_else_changes(reference_problem):
    step = rough(reference_problem())
    before, after = step.outcome, step.refine_feasibility().outcome
    rows = np.flatnonzero(np.ptp(step.transcription.row_bounds, axis=0) == 0)
    wanted = step.transcription.row_bounds[0, rows]
    assert np.abs(before.g[rows] - wanted).max() > 1e-9
    assert np.abs(after.g[rows] - wanted).max() < 1e-12
    assert np.abs(after.x - before.x).max() < 1e-3
    assert abs(after.objective - before.objective) < 1e-3 * before.objective


def test_what_rests_on_a_bound_stays_there(reference_problem):
    step = rough(reference_problem())
    travel = step.transcription.variables["travel"]
    limits = bounds(step.transcription, step.problem)
    assert limits.x_lower[travel] == limits.x_upper[travel]
    assert step.refine_feasibility().outcome.x[travel] == step.outcome.x[travel]
