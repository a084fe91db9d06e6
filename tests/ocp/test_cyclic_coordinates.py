"""Coordinates whose values nothing depends on: without bounds, they do not drift."""

import numpy as np
import pytest

from gaitopt import Collocation, Status, solve
from gaitopt.model import monopod
from gaitopt.ocp import PlanarLimits, PlanarProblem
from gaitopt.ocp.multicontact.cyclic_coordinates import FAR, minimise_without_drift
from gaitopt.ocp.multicontact.planar_bounds import planar_bounds, planar_data, planar_structure
from gaitopt.ocp.multicontact.planar_start import planar_start
from gaitopt.ocp.multicontact.planar_transcription import transcribe_planar
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpResult


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
@pytest.mark.parametrize("first", [Status.SOLVED, Status.DIVERGING])
@pytest.mark.parametrize("second", [Status.SOLVED, Status.INTERRUPTED, Status.FAILED])
def test_only_a_cyclic_coordinate_without_bounds_is_fixed(name, limits, fixed, first, second):
    problem = hop(4, **limits)
    transcription = transcribe_planar(planar_structure(problem))
    bounds, x = planar_bounds(transcription, problem), planar_start(transcription, problem, None)
    row = transcription.variables[Unknown.COORDINATES][problem.robot.coordinates.index(name)]
    results = [first, second, Status.SOLVED]
    calls = []

    def minimise(start, within, multipliers):
        end = start.copy()
        end[row] += 0 if calls else 10 * FAR
        calls.append((start, within, multipliers))
        status = results[len(calls) - 1]
        return NlpResult(status=status, message=status.key, x=end, multipliers=(x, x), objective=1.0, g=x, iterations=2)

    outcome = minimise_without_drift(minimise, transcription, planar_data(problem), bounds, x, None)
    retried = first is Status.SOLVED and second is Status.FAILED
    assert len(calls) == (2 + retried if fixed else 1)
    assert outcome.iterations == 2 * len(calls)
    assert outcome.status is (first if not fixed else Status.SOLVED if retried else second)
    for start, within, multipliers in calls[1:]:
        assert within.x_lower[row[0]] == within.x_upper[row[0]] == x[row[0]]
        assert np.count_nonzero(within.x_lower != bounds.x_lower) == 1
        assert np.max(np.abs(start - x)) == 0
        assert (multipliers is None) is (first is Status.DIVERGING or start is x)
