"""Coordinates whose values nothing depends on: without bounds, they do not drift."""

from types import SimpleNamespace

import numpy as np
import pytest

from gaitopt import Collocation, Status, solve
from gaitopt.model import monopod
from gaitopt.ocp import PlanarLimits, PlanarProblem
from gaitopt.ocp.multicontact.cyclic_coordinates import FAR, fix_drifting_coordinates
from gaitopt.ocp.multicontact.planar_bounds import planar_bounds, planar_data, planar_structure
from gaitopt.ocp.multicontact.planar_start import planar_start
from gaitopt.ocp.multicontact.planar_transcription import transcribe_planar
from gaitopt.ocp.nlp.keys import Unknown


def hop(intervals, **coordinate):
    return PlanarProblem(
        robot=monopod(),
        sequence="foot stick > flight |",
        friction=1.0,
        speed=1.5,
        step_length=0.6,
        objective="torque_squared",
        limits=PlanarLimits(coordinate=coordinate),
        transcription=Collocation(intervals=intervals),
    )


@pytest.mark.parametrize("intervals", [10, (8, 24)])
def test_the_angle_of_a_balanced_body_does_not_drift(intervals):
    """Before, it reached 1e14 to 1e19 deg; rounding errors hid violated equations, and the cost was lower by 4 %."""
    gait = solve(hop(intervals))
    bounded = solve(hop(intervals, phi=(-0.5, 0.5)))
    assert gait.status is bounded.status is Status.SOLVED
    assert max(np.max(np.abs(segment.q[2])) for segment in gait.motion.segments) < FAR
    assert gait.solver.objective == pytest.approx(bounded.solver.objective, rel=1e-8)


@pytest.mark.parametrize(
    ("name", "limits", "fixed"), [("phi", {}, True), ("phi", {"phi": (-1, 1)}, False), ("a", {}, False)]
)
def test_only_a_cyclic_coordinate_without_bounds_is_fixed(name, limits, fixed):
    problem = hop(4, **limits)
    transcription = transcribe_planar(planar_structure(problem))
    bounds, x = planar_bounds(transcription, problem), planar_start(transcription, problem, None)
    row = transcription.variables[Unknown.COORDINATES][problem.robot.coordinates.index(name)]
    end = x.copy()
    end[row] += 10 * FAR
    outcome = SimpleNamespace(status=Status.SOLVED, x=end)
    changed = fix_drifting_coordinates(transcription, planar_data(problem), bounds, x, outcome)
    assert (changed is not None) is fixed
    if changed is not None:
        assert changed.x_lower[row[0]] == changed.x_upper[row[0]] == x[row[0]]
        assert np.count_nonzero(changed.x_lower != bounds.x_lower) == 1
    outcome.status = Status.INTERRUPTED
    assert fix_drifting_coordinates(transcription, planar_data(problem), bounds, x, outcome) is None
