"""Transfer of solutions between grids: the motion is the same, and multipliers are costates and densities in time."""

import numpy as np
import pytest

from gaitopt import Collocation, Limits, MultipleShooting, solve
from gaitopt.ocp.bounds import bounds, nlp_data, transcribe_problem
from gaitopt.ocp.initial import solution_transfer
from gaitopt.ocp.initial.solution_transfer import transfer_solution
from gaitopt.ocp.nlp.keys import Group, Kind, Unknown

SLIP = "slip+ stick | slip+"


@pytest.fixture(scope="module", params=["stick | stick", SLIP])
def coarse(request, reference_problem):
    """Return a problem and its gait on a coarse grid."""
    intervals = (10,) if request.param != SLIP else (5, 10)
    problem = reference_problem(
        sequence=request.param,
        objective="torque_squared",
        limits=Limits(),
        transcription=Collocation(intervals=intervals, tolerance=np.inf),
    )
    return problem, solve(problem)


def transfer(coarse, **changes):
    """Return the NLP on a grid whose nodes contain those of the coarse grid, and what is transferred to it."""
    problem, gait = coarse
    counts = tuple(2 * count for count in gait.solution.intervals)
    transcription = transcribe_problem(problem, Collocation(**{"intervals": counts, **changes}))
    x, multipliers = transfer_solution(gait.solution, transcription, np.zeros(transcription.variables.size))
    return transcription, x, multipliers, nlp_data(transcription, problem, x)


def dynamics_violation(coarse, transcription, x, data):
    """Return the largest violation of the dynamics and of the equations of motion."""
    limits, layout = bounds(transcription, coarse[0]), transcription.constraints
    g = np.asarray(transcription.nlp.values(x, data)[1]).ravel()
    excess = np.maximum(limits.g_lower - g, g - limits.g_upper)
    places = [
        layout.tables[key][[row.kind in (Kind.DYNAMICS, Kind.EQUATION_OF_MOTION) for row in layout.rows[key]]]
        for key in layout.tables
        if isinstance(key, tuple) and key[0] is Group.INTERVAL
    ]
    return max(float(excess[entries].max()) for entries in places)


@pytest.mark.parametrize("changes", [{}, {"points": 5}])
def test_the_motion_satisfies_the_dynamics_of_a_finer_grid(coarse, changes, monkeypatch):
    """Its nodes contain those of the coarse grid, so the torques are equal; the rest is the error of 10 intervals."""
    transcription, x, _, data = transfer(coarse, **changes)
    exact = dynamics_violation(coarse, transcription, x, data)
    monkeypatch.setattr(solution_transfer, "transfer_motion", lambda *arguments: None)
    transcription, x, _, data = transfer(coarse, **changes)
    assert exact < 2e-3
    assert exact < 0.02 * dynamics_violation(coarse, transcription, x, data)


def test_more_points_on_the_same_nodes(coarse):
    """States and accelerations at the nodes are kept; those inside are on the polynomials of fewer points."""
    gait = coarse[1]
    transcription, x, _, data = transfer(coarse, points=6, intervals=gait.solution.intervals)
    states = x[transcription.variables[Unknown.ANGLES]]
    np.testing.assert_allclose(states, gait.solution.unknowns["angles"].values, rtol=1e-12)
    assert dynamics_violation(coarse, transcription, x, data) < 2e-3


def test_the_multipliers_nearly_balance_the_gradient_on_a_finer_grid(coarse):
    """With costates at the middles of intervals, or if all multipliers are densities, 10 % to 20 % of them are left."""
    transcription, x, (on_bounds, on_rows), data = transfer(coarse)
    derivatives = transcription.nlp.derivatives
    gradient = np.asarray(derivatives["grad_f"](x, data)[1]).ravel()
    jacobian = derivatives["jac_g"](x, data)[1]
    rest = gradient + np.asarray(jacobian.T @ on_rows).ravel() + on_bounds
    layout = transcription.variables
    assert np.abs(rest).max() < 0.03 * np.abs(on_rows).max()
    for phase in transcription.phases:
        if phase.mode.slips:
            slide = layout[Unknown.SLIDE, phase.number]
            assert np.abs(rest[slide[0]]).max() < 0.01 * np.abs(on_bounds[slide]).max()


def test_a_gait_of_shooting_starts_a_collocation(reference_problem):
    """Its accelerations are not known, so that the motion is interpolated between the nodes."""
    shooting = MultipleShooting(intervals=20, tolerance=np.inf)
    problem = reference_problem(objective="torque_squared", limits=Limits(), transcription=shooting)
    gait = solve(problem)
    transcription = transcribe_problem(problem, Collocation(intervals=40))
    x, _ = transfer_solution(gait.solution, transcription, np.zeros(transcription.variables.size))
    angles = x[transcription.variables[Unknown.ANGLES]]
    np.testing.assert_allclose(angles[:, ::2], gait.solution.unknowns["angles"].values, rtol=1e-12)
    assert not np.any(x[transcription.variables[Unknown.ACCELERATION, 0]])
