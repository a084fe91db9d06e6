"""Curves of special points in two parameters, against closed forms and traces across them."""

import math

import numpy as np
import pytest

from gaitopt import InputError, WalkProblem, find_cycles, load_diagram, rimless_wheel, trace
from gaitopt.continuation import ArclengthOptions, TraceOptions, gaits_at, save_diagram, trace_curve, two_parameters
from gaitopt.continuation.gait_source import make_gait_source
from tests.continuation.rolling_wheel import least_friction, least_slope

SLOPE = math.radians(13)
LONG_STEPS = TraceOptions(arclength=ArclengthOptions(first_step=0.1, longest_step=0.3))


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
def test_the_curve_of_rolling_over_is_the_closed_form():
    # Type A does not slip, so that its least slope (1.40 deg in Gamus & Or 2015) does not depend on the friction.
    at = WalkProblem(robot=rimless_wheel(), parameters={"slope": math.radians(3), "friction": 0.95})
    across = trace(at, {"slope": (math.radians(3), math.radians(1))}, options=LONG_STEPS)
    curve = trace_curve(at, across, {"friction": (0.9, 1.0)}, options=LONG_STEPS)
    assert curve.kind.key == "roll_over"
    assert curve.values[:, 0] == pytest.approx(np.full(len(curve.values), least_slope()), abs=1e-12)
    assert np.ptp(curve.values[:, 1]) == pytest.approx(0.1, abs=1e-9)


@pytest.mark.slow
def test_rolling_over_is_located_as_accurately_in_short_steps(monkeypatch):
    for name, value in (("FIRST_STEP", 0.004), ("LONGEST_STEP", 0.004), ("MOST_POINTS", 2)):
        monkeypatch.setattr(two_parameters, name, value)
    at = WalkProblem(robot=rimless_wheel(), parameters={"slope": math.radians(3), "friction": 0.95})
    across = trace(at, {"slope": (math.radians(3), math.radians(1))}, options=LONG_STEPS)
    curve = trace_curve(at, across, {"friction": (0.9, 1.0)}, options=LONG_STEPS)
    assert curve.values[:, 0] == pytest.approx(np.full(5, least_slope()), abs=1e-12)


def test_a_gait_beside_rolling_over_may_take_a_long_step():
    # Near its least slope a step of Type A takes longer than 10 s, the limit of other simulations, if sqrt(l / g) is
    # not much shorter than 1 s.
    slow = {"slope": math.radians(3), "friction": 1.0, "gravity": 4 / 3}
    at = WalkProblem(robot=rimless_wheel(), parameters=slow)
    across = trace(at, {"slope": (math.radians(1.6), math.radians(1.2))}, options=LONG_STEPS)
    (special,) = across.branches[0].special
    (gait,) = gaits_at(at, across, special.value + 1e-6)
    assert gait.period > 10
    assert gait.state["theta_rate"] > special.z[0]


@pytest.mark.slow
def test_the_curve_of_rolling_over_in_complete_slip_is_the_closed_form(wheel, monkeypatch):
    monkeypatch.setattr(two_parameters, "LONGEST_STEP", 0.3)  # a point takes two seconds
    gaits = find_cycles(rimless_wheel(), {"slope": SLOPE, "friction": 0.09})
    start = next(gait for gait in gaits if gait.sequence == "slip+ | slip+")
    across = trace(wheel, {"friction": (0.12, 0.06)}, start=start, options=LONG_STEPS)
    number = special_number(across, "roll_over")
    curve = trace_curve(wheel, across, {"slope": (SLOPE - 0.03, SLOPE + 0.03)}, special=number, options=LONG_STEPS)
    assert len(curve.values) > 5
    assert curve.values[:, 0] == pytest.approx(np.full(len(curve.values), least_friction()), abs=1e-12)


@pytest.mark.slow
def test_curves_are_kept_in_the_file(wheel, diagram, tmp_path):
    from dataclasses import replace

    number = special_number(diagram, "loss_of_stick")
    curve = trace_curve(wheel, diagram, {"slope": (SLOPE - 0.004, SLOPE + 0.004)}, special=number)
    path = save_diagram(replace(diagram, curves=(curve,)), tmp_path / "curves.nc")
    (restored,) = load_diagram(path).curves
    assert restored.record() == curve.record()
    assert restored.units == ("1", "rad")


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


@pytest.mark.slow
def test_curves_end_where_they_meet():
    # A slip begins exactly at a touchdown that begins to slip: the border of Types B and C is one curve on each side of
    # this point, from different branches.
    low, high, ends = math.radians(11.13), math.radians(11.15), []
    for slope in (low, high):
        at = WalkProblem(robot=rimless_wheel(), parameters={"slope": slope})
        across = trace(at, {"friction": (0.238, 0.236)}, options=LONG_STEPS)
        number = special_number(across, "impact_cone")
        curve = trace_curve(at, across, {"slope": (low, high)}, special=number, options=LONG_STEPS)
        assert [curve.begin, curve.end].count("meets slip onset") == 1
        assert curve.codimension_two == (curve.begin == "meets slip onset", curve.end == "meets slip onset")
        ends.append(curve.values[0 if curve.codimension_two[0] else -1])
    assert ends[0] == pytest.approx(ends[1], abs=1e-9)
    # If the foot does not slip before the touchdown, the ratio of the impulses is a closed form of angle and inertia.
    sine, cosine, inertia = math.sin(math.pi / 10), math.cos(math.pi / 10), 1 / 3
    assert ends[0][0] == pytest.approx(sine * cosine / (1 + inertia - sine**2), abs=1e-9)


@pytest.mark.slow
def test_a_curve_turns_where_both_ends_of_the_step_begin_to_slip():
    # Type A slips first at the end of its step or, beyond the corner, at its start; the ratio of the forces of the
    # wheel, which rotates about its foot, is a closed form, and equals the friction at both.
    low, high = math.radians(11.26), math.radians(11.28)
    at = WalkProblem(robot=rimless_wheel(), parameters={"slope": high})
    across = trace(at, {"friction": (0.33, 0.258)}, options=LONG_STEPS)
    curve = trace_curve(at, across, {"slope": (low, high)}, options=LONG_STEPS)
    assert curve.before == "stick | stick"
    assert min(worst_ratio_error(*values) for values in curve.values) < 1e-9


def worst_ratio_error(friction, slope, half=math.pi / 10, inertia=1 / 3):
    """Return the larger difference between friction and the ratio of the forces at both ends of a step of Type A."""
    kept = (math.cos(2 * half) + inertia) / (1 + inertia)  # of the rate in an impact
    end = 4 * math.sin(slope) * math.sin(half) / (1 + inertia) / (1 - kept**2)  # squared rate, in units of gravity
    errors = []
    for angle, squared in ((-half, kept**2 * end), (half, end)):
        turn = math.sin(angle + slope) / (1 + inertia)
        tangential = math.cos(angle) * turn - math.sin(angle) * squared - math.sin(slope)
        normal = math.cos(slope) - math.sin(angle) * turn - math.cos(angle) * squared
        errors.append(abs(-tangential / normal - friction))
    return max(errors)
