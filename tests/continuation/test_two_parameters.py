"""Curves of special points in two parameters, against closed forms and traces across them."""

import math

import numpy as np
import pytest

from gaitopt import InputError, WalkProblem, load_diagram, rimless_wheel, trace
from gaitopt.continuation import save_diagram, trace_curve, two_parameters
from gaitopt.continuation.gait_source import make_gait_source

SLOPE = math.radians(13)


@pytest.fixture(scope="module")
def wheel():
    return WalkProblem(robot=rimless_wheel(), parameters={"slope": SLOPE})


@pytest.fixture(scope="module")
def diagram(wheel):
    return trace(wheel, {"friction": (0.4, 0.2)})


@pytest.fixture(autouse=True)
def long_steps(monkeypatch):
    """Follow the curves in few steps: the properties of their points do not depend on their number."""
    monkeypatch.setattr(two_parameters, "FIRST_STEP", 0.1)
    monkeypatch.setattr(two_parameters, "LONGEST_STEP", 0.2)


def special_number(diagram, kind):
    return [point.kind.key for point in diagram.branches[0].special].index(kind)


@pytest.mark.slow
def test_the_curve_of_lost_stick_is_the_slope_of_friction(wheel, diagram):
    # Type C ends where the foot speed of complete slip is constant: mu = tan(alpha), Gamus & Or (2015).
    curve = trace_curve(
        wheel,
        diagram,
        {"slope": (math.radians(12.7), math.radians(13.3))},
        special=special_number(diagram, "loss_of_stick"),
    )
    friction, slope = curve.values.T
    assert len(friction) > 5
    assert friction == pytest.approx(np.tan(slope), abs=1e-9)
    for state, value in zip(curve.states, curve.values, strict=True):
        at = WalkProblem(robot=rimless_wheel(), parameters={"slope": value[1]})
        source = make_gait_source(at, {"friction": (0.4, 0.2)})
        gait = source.gait_near(value[0] + 1e-6, dict(zip(diagram.branches[0].names, state, strict=True)), 1)
        residual = source.start(gait, value[0] + 1e-6).family.evaluate(state, value[0]).residual
        assert np.max(np.abs(residual)) < 1e-9
    assert (curve.begin, curve.end) == ("range_end", "range_end")


@pytest.mark.slow
def test_a_curve_agrees_with_traces_across_it(wheel, diagram):
    ends = (math.radians(12.8), math.radians(13.2))
    curve = trace_curve(wheel, diagram, {"slope": ends}, special=special_number(diagram, "impact_cone"))
    for k in (1, len(curve.values) - 2):
        friction, slope = curve.values[k]
        across = WalkProblem(robot=rimless_wheel(), parameters={"slope": slope})
        (point,) = (
            trace(across, {"friction": (friction + 0.004, friction - 0.004)}).branches[0].special_of("impact_cone")
        )
        assert point.value == pytest.approx(friction, abs=1e-9)
        assert (point.before, point.after) == (curve.before, curve.after)


@pytest.mark.slow
def test_curves_are_kept_in_the_file(wheel, diagram, tmp_path):
    from dataclasses import replace

    number = special_number(diagram, "loss_of_stick")
    curve = trace_curve(wheel, diagram, {"slope": (SLOPE - 0.004, SLOPE + 0.004)}, special=number)
    path = save_diagram(replace(diagram, curves=(curve,)), tmp_path / "curves.nc")
    (restored,) = load_diagram(path).curves
    assert restored.record() == curve.record()


@pytest.mark.parametrize(
    ("second", "special", "message"),
    [
        ({"slope": (0.1, 0.2)}, 0, "must contain the value of the problem"),
        ({"friction": (0.1, 0.2)}, 0, "must differ from the first"),
        ({"slop": (0.1, 0.3)}, 0, "Did you mean 'slope'"),
        ({"slope": (0.1, 0.3)}, 9, "no special point 9"),
        ({}, 0, "one parameter with its range"),
    ],
)
def test_invalid_requests_are_named(wheel, diagram, second, special, message):
    with pytest.raises(InputError, match=message):
        trace_curve(wheel, diagram, second, special=special)
