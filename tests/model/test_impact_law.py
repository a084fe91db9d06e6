"""The exact impact solution against the impact law itself, in random states and for every kind of friction."""

import math

import numpy as np
import pytest
from hypothesis import HealthCheck, assume, example, given, settings
from hypothesis import strategies as st

from gaitopt import Mode, compass_biped, rimless_wheel
from gaitopt.model import PlasticFrictional, solve_impact

COMPASS, WHEEL = compass_biped(), rimless_wheel()
RATE = st.floats(-5, 5, allow_subnormal=False)
OUTCOMES = [
    ((0.15, 0.15, 0.0, 0.7, -0.4, 0.5), Mode.STICK),
    ((0.15, 0.15, 0.0, 0.7, -0.4, 0.05), Mode.SLIP_FORWARD),
    ((0.15, 0.15, 0.0, 0.1, -2.0, 0.05), Mode.SLIP_BACKWARD),
]
FRICTION = st.one_of(st.just(0.0), st.floats(0.001, 2), st.just(math.inf))


def residuals(robot, q, v, p, impact, friction):
    """Residuals of the momentum balance and of the four pairs, relative to the impulse."""
    momentum, foot = (np.asarray(part).ravel() for part in robot.impact(q, v, impact.v_plus, impact.impulse, p))
    tangential, normal = impact.impulse
    if math.isinf(friction):  # the fourth pair then only requires that the foot does not slip
        left, right = [normal, abs(foot[0])], [foot[1], 1.0]
    else:
        a, b = max(tangential, 0.0), max(-tangential, 0.0)
        left, right = PlasticFrictional().pairs((normal, a, b), abs(foot[0]), (foot[1], foot[0]), friction)
    scale = 1.0 + np.max(np.abs(impact.impulse)) + np.max(np.abs(v))
    worst = max(*(abs(x * y) for x, y in zip(left, right, strict=True)), *(-x for x in left), *(-y for y in right))
    return np.max(np.abs(momentum)) / scale, worst / scale**2


@settings(max_examples=300, suppress_health_check=[HealthCheck.filter_too_much])
@given(st.floats(-0.8, 0.8), st.floats(-0.8, 0.8), RATE, RATE, RATE, FRICTION)
@example(*OUTCOMES[0][0])
@example(*OUTCOMES[1][0])
@example(*OUTCOMES[2][0])
def test_compass_impact_satisfies_every_complementarity_pair(th1, th2, slide, w1, w2, friction):
    p = COMPASS.vector(COMPASS.resolve({"friction": friction}))
    q, v = np.array([0, 0, th1, th2]), np.array([slide, 0.0, w1, w2])
    falling = float(COMPASS.landing(q, v, p)[1][1])
    assume(abs(falling) > 1e-3)
    v = -v if falling > 0 else v
    impact = solve_impact(COMPASS, q, v, p)
    if impact.mode is None:
        # Only a foot that never slips can be jammed: sticking would then need the ground to pull.
        assert math.isinf(friction)
        return
    momentum, pairs = residuals(COMPASS, q, v, p, impact, friction)
    assert momentum < 1e-11
    assert pairs < 1e-11
    before, after = (float(COMPASS.energy(q, rates, p)[0]) for rates in (v, impact.v_plus))
    assert impact.energy_lost >= -1e-12 * before
    assert abs(before - after - impact.energy_lost) < 1e-10 * (1 + before)
    assert impact.separation == impact.v_plus[1]


@pytest.mark.parametrize(("state", "mode"), OUTCOMES)
def test_every_outcome_is_reached(state, mode):
    th1, th2, slide, w1, w2, friction = state
    p = COMPASS.vector(COMPASS.resolve({"friction": friction}))
    assert solve_impact(COMPASS, np.array([0, 0, th1, th2]), np.array([slide, 0, w1, w2]), p).mode is mode


@settings(max_examples=100)
@given(st.floats(0.1, 10), RATE, FRICTION, st.integers(4, 30), st.floats(0.01, 2))
def test_wheel_impact_satisfies_every_complementarity_pair(rate, slide, friction, spokes, kappa):
    p = WHEEL.vector(WHEEL.resolve({"friction": friction, "spokes": spokes, "inertia_ratio": kappa}))
    q, v = np.array([0, 0, math.pi / spokes]), np.array([slide, 0.0, rate])
    impact = solve_impact(WHEEL, q, v, p)
    if impact.mode is None:
        assert math.isinf(friction)
        return
    momentum, pairs = residuals(WHEEL, q, v, p, impact, friction)
    assert momentum < 1e-11
    assert pairs < 1e-11
    assert impact.energy_lost >= -1e-12


@settings(max_examples=200)
@given(st.floats(0.02, 0.8), RATE, RATE)
def test_there_is_an_outcome_exactly_at_the_friction_where_stick_turns_into_slip(th, w1, w2):
    q, v = np.array([0, 0, th, th]), np.array([0.0, 0.0, w1, w2])
    p = COMPASS.vector(COMPASS.resolve({}))
    falling = float(COMPASS.landing(q, v, p)[1][1])
    assume(abs(falling) > 1e-3)
    v = -v if falling > 0 else v
    free = solve_impact(COMPASS, q, v, p)
    assume(free.mode is Mode.STICK and free.impulse[1] > 1e-3 and abs(free.impulse[0]) > 1e-6)
    edge = abs(free.impulse[0] / free.impulse[1])
    index = [parameter.name for parameter in COMPASS.parameters].index("friction")
    for friction in (np.nextafter(edge, 0), edge, np.nextafter(edge, 1)):
        p[index] = friction
        impact = solve_impact(COMPASS, q, v, p)
        assert impact.mode is not None
        np.testing.assert_allclose(impact.impulse, free.impulse, rtol=1e-9)


def test_a_foot_that_moves_up_has_no_impact(compass):
    p = compass.vector(compass.resolve({"friction": 0.5}))
    impact = solve_impact(compass, np.array([0, 0, 0.15, 0.15]), np.array([0, 0, -0.6, 0.1]), p)
    assert impact.mode is None
    assert math.isnan(impact.energy_lost)
