"""Where contact changes: Coulomb's law holds at every event, between events and after impacts."""

import itertools

import casadi as ca
import numpy as np
import pytest

from gaitopt import Law, Mode, ScipyEngine, Stop, compass_biped
from gaitopt.control.signature import torque_function
from gaitopt.simulation import StepLimits


def at(segment, k):
    """Return v_t, f_t, f_n at a sample."""
    return segment.v[0, k], segment.force[0, k], segment.force[1, k]


WALKS = [
    ((-0.140807105, 0.710208797, -0.516847656), 0.0, 0.14),  # Gait B
    ((-0.079038, 0.043777, -0.431761), 0.634174, 0.14),  # Gait C
    ((-0.12, 0.86, -0.40), -0.27, 0.11),  # slip- slip+ stick slip- | slip+
    ((-0.06, 0.57, 0.15), 0.0, 0.02),  # slip+ slip- | slip+
]


@pytest.mark.parametrize(("z", "xd", "mu"), WALKS)
def test_coulombs_law_holds_all_along(compass_walk, z, xd, mu):
    for segment in compass_walk(z, xd=xd, mu=mu).motion.segments:
        v, tangential, normal = segment.v[0], segment.force[0], segment.force[1]
        assert np.all(normal > 0)
        np.testing.assert_array_equal(segment.v[1], 0.0)
        if segment.mode is Mode.STICK:
            np.testing.assert_array_equal(v, 0.0)
            assert np.all(np.abs(tangential) <= mu * normal * (1 + 1e-9))
        else:
            sign = segment.mode.sign
            np.testing.assert_allclose(tangential, -sign * mu * normal, rtol=1e-12)
            assert np.all(sign * v[1:-1] > 0)


@pytest.mark.parametrize(("z", "xd", "mu"), WALKS)
def test_each_change_happens_where_its_condition_is_met(compass_walk, z, xd, mu):
    segments = compass_walk(z, xd=xd, mu=mu).motion.segments
    for before, after in itertools.pairwise(segments):
        assert before.time[-1] == after.time[0]
        if before.mode is Mode.STICK:
            _, tangential, normal = at(before, -1)
            assert -after.mode.sign * tangential == pytest.approx(mu * normal, rel=1e-9)
        else:
            assert before.v[0, -1] == pytest.approx(0.0, abs=1e-13)
            assert after.v[0, 0] == 0.0


def test_slip_reverses_where_the_sticking_force_lies_beyond_the_other_edge(compass_walk, hand_compass):
    walk = compass_walk((-0.06, 0.57, 0.15), mu=0.02)
    forward, backward = walk.motion.segments
    assert (forward.mode, backward.mode) == (Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)
    _, (tangential, normal) = hand_compass.stick(backward.q[2:, 0], backward.v[2:, 0])
    assert tangential > 0.02 * normal  # the ground would have to hold the foot back from sliding backward
    assert [event.name for event in walk.events] == ["at rest", "touchdown"]


def ankle_from(start, torque):
    """Return the law that gives a constant ankle torque from a clock time on."""
    data = ca.SX.sym("data", 2)
    function = torque_function(compass_biped(), data, lambda clock, q, v: data)
    return Law("ankle", function, np.array([0.0, start]), np.array([[0.0, torque], [0.0, 0.0]]))


def test_the_torque_at_the_event_decides_where_the_foot_goes(compass_walk, gait_b, hand_compass):
    """The foot comes to rest after the ankle has been switched on: with its torque it cannot stay at rest."""
    walk = compass_walk(gait_b["z"], mu=0.14, law=ankle_from(0.05, 40.0), step_limits=StepLimits(duration=0.1))
    forward, backward = walk.motion.segments
    assert (forward.mode, backward.mode) == (Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)
    assert forward.time[-1] > 0.05
    for torque, slips in (((40.0, 0.0), True), ((0.0, 0.0), False)):
        _, (tangential, normal) = hand_compass.stick(backward.q[2:, 0], backward.v[2:, 0], torque)
        assert (tangential > 0.14 * normal) == slips


def test_a_torque_switched_on_may_tear_the_foot_off_at_once(compass_walk, gait_b):
    walk = compass_walk(gait_b["z"], mu=0.14, law=ankle_from(0.05, -60.0))
    assert walk.stop is Stop.LIFT_OFF
    assert walk.motion.period == pytest.approx(0.05, abs=1e-12)


def test_a_sticking_impact_may_be_followed_at_once_by_slip(compass_walk, gait_b, hand_compass):
    """The impulse lies in the cone, the force after it does not."""
    walk = compass_walk(gait_b["z"], mu=0.14, steps=2)
    jump = walk.motion.jumps[0]
    following = next(segment for segment in walk.motion.segments if segment.step == 1)
    assert jump.mode is Mode.STICK
    assert abs(jump.ratio) < 0.14
    assert jump.v_next[0] == 0.0
    assert following.mode is Mode.SLIP_FORWARD
    _, (tangential, normal) = hand_compass.stick(jump.q_next[2:], jump.v_next[2:])
    assert -tangential > 0.14 * normal


def test_a_slip_that_starts_from_rest_lasts(wheel_walk, compass_walk, gait_b):
    """Its speed is zero where it starts: an undirected event there would end it immediately."""
    walk = wheel_walk(0.88, mu=0.3)
    stuck, sliding = walk.motion.segments
    assert (stuck.mode, sliding.mode) == (Mode.STICK, Mode.SLIP_FORWARD)
    assert sliding.duration > 0.1 * stuck.duration
    assert sliding.v[0, 0] == 0.0
    assert np.all(np.diff(sliding.v[0]) > 0)
    first = compass_walk(gait_b["z"], mu=0.14).motion.segments[0]
    assert first.v[0, 0] == 0.0
    assert first.duration > 0.08


def ankle_pulse():
    """Return the law of an ankle torque that swells to 40 N m and dies away around t = 0.3 s."""
    data = ca.SX.sym("data", 0)

    def torque(clock, q, v):
        return ca.vertcat(40 * ca.exp(-(((clock - 0.3) / 0.1) ** 2)), 0)

    return Law("pulse", torque_function(compass_biped(), data, torque), np.zeros(1), np.zeros((0, 1)))


def test_a_force_that_barely_leaves_the_cone_in_mid_step_is_seen(compass_walk, gait_a):
    """The pulse takes |f_t|/f_n to a peak inside the step; friction a few 1e-4 below it is enough for a slip."""

    def walk(mu, samples=4):
        engine = ScipyEngine(samples=samples)
        return compass_walk(
            gait_a["z"], mu=mu, law=ankle_pulse(), engine=engine, step_limits=StepLimits(duration=0.5)
        ).motion.segments

    (free,) = walk(np.inf, samples=200)
    ratio = free.force[0] / free.force[1]
    peak = ratio.max()
    assert free.time[ratio.argmax()] == pytest.approx(0.318, abs=2e-3)
    assert [segment.mode.value for segment in walk(peak * (1 + 1e-5))] == ["stick"]
    barely = walk(peak * (1 - 3e-4))
    assert [segment.mode.value for segment in barely] == ["stick", "slip-", "stick"]
    assert barely[1].duration == pytest.approx(0.0055, abs=5e-4)


def test_slip_grows_from_the_edge_of_the_cone_with_the_square_of_time(wheel_walk):
    """At the edge the foot's acceleration is nil and grows steadily, so its speed goes with t^2."""
    sliding = wheel_walk(0.88, mu=0.3).motion.segments[1]
    time = sliding.time - sliding.time[0]
    early = (time > 1e-3) & (time < 2e-2)
    if early.sum() < 2:
        pytest.fail("too few samples for a fit")
    slope = np.polyfit(np.log(time[early]), np.log(sliding.v[0, early]), 1)[0]
    assert slope == pytest.approx(2.0, abs=0.05)


def test_mid_swing_scuffing_is_no_touchdown(compass_walk, gait_c):
    """Gait C brings its legs level (th2 = th1, rising) at th1 = +0.025 in mid-swing."""
    walk = compass_walk(gait_c["z"], xd=gait_c["xd"], mu=0.14)
    q = walk.motion.channel("q")
    gap, armed = q[3] - q[2], q[2] > 0
    rising = np.flatnonzero((gap[:-1] < 0) & (gap[1:] >= 0) & armed[1:])
    assert rising.size == 1
    assert q[2, rising[0]] == pytest.approx(0.025, abs=0.01)
    assert walk.stop is Stop.STEPS_DONE
    assert len(walk.motion.jumps) == 1


def test_the_event_log_tells_the_walk(compass_walk, gait_b):
    walk = compass_walk(gait_b["z"], mu=0.14, steps=2)
    assert [(event.name, event.before, event.after) for event in walk.events[:3]] == [
        ("at rest", "slip+", "stick"),
        ("slip-", "stick", "slip-"),
        ("touchdown", "slip-", "stick"),
    ]
    assert [event.step for event in walk.events] == [0, 0, 0, 1, 1, 1]
    assert [event.time for event in walk.events] == [segment.time[-1] for segment in walk.motion.segments]
    for event, jump in zip(walk.events[2::3], walk.motion.jumps, strict=True):
        assert event.impulse == tuple(jump.impulse)
        assert event.energy_lost == jump.energy_lost
