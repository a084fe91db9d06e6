"""Absolute and positive joint work against dense numerical integrals of powers that change sign."""

import numpy as np
import pytest
from scipy.integrate import quad

from gaitopt import absolute_work, cost_of_transport, positive_work

PHASE, RATE, LIFT = 0.3, 5.0, 1.0


def power(t):
    return 3 * np.sin(RATE * t + PHASE) + LIFT


def work(t):
    return -3 / RATE * (np.cos(RATE * t + PHASE) - np.cos(PHASE)) + LIFT * t


def integral(function, end):
    kinks = [(np.pi * k - (-1) ** k * np.arcsin(LIFT / 3) - PHASE) / RATE for k in range(9)]
    return quad(function, 0, end, points=[t for t in kinks if 0 < t < end], epsabs=1e-13, epsrel=1e-13, limit=400)[0]


@pytest.fixture
def working(segment, motion):
    """Return a motion whose first actuator has this power and whose second has its opposite half as strong."""

    def build(count, end=2.0, **changes):
        time = np.linspace(0, end, count)
        one = segment(
            time, power=np.array([power(time), -power(time) / 2]), work=np.array([work(time), -work(time) / 2])
        )
        return motion([one], **changes)

    return build


def test_absolute_work_is_the_integral_of_absolute_power(working):
    exact = 1.5 * integral(lambda t: abs(power(t)), 2.0)
    assert absolute_work(working(401)) == pytest.approx(exact, rel=1e-8)


def test_its_error_falls_with_the_fourth_power_of_the_sampling(working):
    exact = 1.5 * integral(lambda t: abs(power(t)), 2.0)
    errors = [abs(absolute_work(working(count)) - exact) for count in (33, 129)]
    assert errors[1] < errors[0] / 4**3
    assert errors[0] < 1e-4


def test_samples_that_almost_coincide_do_not_disturb_it(segment, motion):
    """Events add samples close to others; a polynomial through three samples would be useless there."""
    time = np.sort(np.concatenate([np.linspace(0, 2.0, 41), np.array([0.3, 0.9, 1.35, 1.8]) + 1e-13]))
    one = segment(time, power=np.array([power(time), 0 * time]), work=np.array([work(time), 0 * time]))
    assert absolute_work(motion([one])) == pytest.approx(integral(lambda t: abs(power(t)), 2.0), rel=1e-6)


def test_a_power_that_dips_below_zero_between_samples_counts_twice(segment, motion):
    """W' = (t - 1/4)(t - 3/4) is positive at both samples and negative between its zeros."""
    time = np.array([0.0, 1.0])

    def antiderivative(t):
        return t**3 / 3 - t**2 / 2 + 3 * t / 16

    dip = antiderivative(0.25) - antiderivative(0.75)
    power = np.array([[3 / 16, 3 / 16], [0, 0]])
    one = segment(time, power=power, work=np.array([antiderivative(time), 0 * time]))
    assert absolute_work(motion([one])) == pytest.approx(antiderivative(1.0) + 2 * dip, rel=1e-12)


def test_power_of_one_sign_is_counted_exactly(segment, motion):
    time = np.linspace(0, 1, 4)
    one = segment(time, power=np.array([2 * time, -(3 * time**2)]), work=np.array([time**2, -(time**3)]))
    assert absolute_work(motion([one])) == pytest.approx(1 + 1, rel=1e-14)


def test_a_cubic_work_is_counted_exactly_across_its_turning_point(segment, motion):
    """W = t - t^2 turns at 1/2; the interpolant is exact for it, however coarse the samples."""
    time = np.array([0.0, 0.9])
    none = np.zeros(2)
    one = segment(time, power=np.array([1 - 2 * time, none]), work=np.array([time - time**2, none]))
    assert absolute_work(motion([one])) == pytest.approx(0.25 + (0.25 - 0.09), rel=1e-12)


def test_positive_work_is_the_integral_of_positive_power(working):
    exact = integral(lambda t: max(power(t), 0.0), 2.0) + integral(lambda t: max(-power(t), 0.0), 2.0) / 2
    assert positive_work(working(401)) == pytest.approx(exact, rel=1e-8)


def test_cost_of_transport_is_work_over_weight_and_travel(segment, jump, motion):
    time = np.linspace(0, 1, 3)
    none = np.zeros(3)
    one = segment(time, power=np.array([1 + none, none]), work=np.array([time, none]))
    walk = motion([one], [jump(1.0, q_next=np.array([0.25, 0, 0, 0]))])
    assert cost_of_transport(walk) == pytest.approx(1.0 / (2.0 * 10.0 * 0.25), rel=1e-14)


def test_segments_and_actuators_add_up(working, motion):
    one = working(101)
    both = motion([*one.segments, *one.segments])
    assert absolute_work(both) == pytest.approx(2 * absolute_work(one), rel=1e-14)
