"""Every reason for which a walk ends, and that what was walked until then is kept."""

import casadi as ca
import numpy as np
import pytest

from gaitopt import InputError, Law, Mode, Stop, compass_biped, ledger, simulate
from gaitopt.control.signature import torque_function
from gaitopt.simulation import StepLimits
from tests.newton_euler.compass import HandCompass
from tests.newton_euler.wheel import HandWheel


def last_event(walk):
    return walk.events[-1]


def test_steps_done(compass_walk, gait_a):
    walk = compass_walk(gait_a["z"], mu=0.3, steps=2)
    assert walk.stop is Stop.STEPS_DONE
    assert last_event(walk).name == "touchdown"
    assert len(walk.motion.jumps) == 2


def test_lift_off_is_where_the_normal_force_vanishes(wheel_walk, hand_wheel):
    walk = wheel_walk(0.97)
    assert walk.stop is Stop.LIFT_OFF
    assert walk.motion.jumps == ()
    segment = walk.motion.segments[-1]
    # Energy and forces of the pendulum: f_n = 0 at this angle and rate, and not before.
    normal = [hand_wheel.motion(*state)[3] for state in zip(segment.q[2], segment.v[2], strict=True)]
    assert normal[-1] == pytest.approx(0.0, abs=1e-9)
    assert min(normal[:-1]) > 0
    assert last_event(walk).name == "lift off"
    assert last_event(walk).after == "-"
    assert last_event(walk).time == segment.time[-1]


def test_lift_off_at_the_very_start(wheel_walk):
    walk = wheel_walk(1.5)
    assert walk.stop is Stop.LIFT_OFF
    assert walk.motion.period == 0.0
    assert ledger(walk.motion).relative_residual == 0.0


def test_lift_off_right_after_a_touchdown_keeps_the_ledger(wheel, engine):
    """A foot that slid stops dead at its impact; the wheel then turns too fast for its new foot to stay down."""
    parameters = {"spokes": 6, "friction": 0.7381758, "inertia_ratio": 0.1447556, "slope": 0.1944665}
    walk = simulate(wheel, [0, 0, -0.2222044], [5.5077048, 0, 0.1561074], parameters, steps=2, engine=engine)
    assert walk.stop is Stop.LIFT_OFF
    assert len(walk.motion.jumps) == 1
    assert walk.motion.segments[-1].duration == 0.0
    assert ledger(walk.motion).relative_residual < 1e-9


def test_fall_backward(wheel_walk):
    walk = wheel_walk(0.08)
    assert walk.stop is Stop.FELL
    assert walk.motion.segments[-1].q[2, -1] == pytest.approx(-np.pi / 10, abs=1e-8)
    # It comes back as fast as it went: no energy is lost in between.
    assert walk.motion.segments[-1].v[2, -1] == pytest.approx(-walk.motion.segments[0].v[2, 0], rel=1e-6)


def test_fall_of_the_compass_ends_with_its_leg_level(compass_walk):
    walk = compass_walk((-0.1, 0.1, -0.5), mu=0.9)
    assert walk.stop is Stop.FELL
    assert abs(walk.motion.segments[-1].q[2, -1]) == pytest.approx(np.pi / 2, abs=1e-9)


def test_time_limit(compass_walk, gait_a):
    walk = compass_walk(gait_a["z"], mu=0.3, step_limits=StepLimits(duration=0.5))
    assert walk.stop is Stop.NO_TOUCHDOWN
    assert walk.motion.period == 0.5
    assert walk.motion.sequence() is None
    assert last_event(walk).name == "no touchdown"


def test_a_wheel_that_stands_still_stands_until_the_time_limit(wheel, engine):
    """Upright on level ground, exactly balanced: whatever the friction, nil included, nothing happens."""
    for friction in (0.0, 0.3, np.inf):
        walk = simulate(
            wheel, [0, 0, 0], [0, 0, 0], {"friction": friction}, step_limits=StepLimits(duration=1.0), engine=engine
        )
        assert walk.stop is Stop.NO_TOUCHDOWN
        np.testing.assert_array_equal(walk.motion.segments[-1].q[:, -1], 0.0)


def test_too_many_events(compass_walk, gait_b):
    walk = compass_walk(gait_b["z"], mu=0.14, step_limits=StepLimits(duration=3.0, events=2))
    assert walk.stop is Stop.TOO_MANY_EVENTS
    assert [segment.mode.value for segment in walk.motion.segments] == ["slip+", "stick"]
    assert last_event(walk).name == "too many events"
    assert compass_walk(gait_b["z"], mu=0.14, step_limits=StepLimits(duration=3.0, events=3)).stop is Stop.STEPS_DONE


def test_double_support(compass, engine):
    """Just before touchdown the walker rocks backward: the trailing foot would be pushed into the ground."""
    walk = simulate(compass, [0, 0, 0.2, 0.201], [0, 0, -0.5, -3.0], {"friction": 0.6}, engine=engine)
    assert walk.stop is Stop.DOUBLE_SUPPORT
    assert walk.motion.jumps == ()
    assert last_event(walk).name == "double support"
    end = walk.motion.segments[-1]
    assert end.q[2, -1] == pytest.approx(end.q[3, -1], abs=1e-12)


def test_chattering_ends_at_the_cap(compass_walk, gait_a):
    """An ankle that shakes the foot loose forty times a second: the walk ends with its last event allowed."""
    shaking = law_of(lambda t: ca.vertcat(40 * ca.sin(250 * t), 0))
    walk = compass_walk(gait_a["z"], mu=0.2, law=shaking)
    assert walk.stop is Stop.TOO_MANY_EVENTS
    assert len(walk.motion.segments) == 50
    assert walk.motion.period < gait_a["T"]
    assert {segment.mode for segment in walk.motion.segments} >= {Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD}
    assert ledger(walk.motion).relative_residual < 1e-8


def test_a_landing_foot_that_would_have_to_be_pulled(compass, engine):
    """Rocking backward from a wide stance: without slip only a pull would hold the landing foot where it is."""
    hand = HandCompass(com=1.0, mass=5.8, hip=4.2, mu=np.inf)
    walk = simulate(compass, [0, 0, 0.6, 0.601], [0, 0, -0.1, -1.2], hand.parameters, engine=engine)
    assert walk.stop is Stop.DOUBLE_SUPPORT
    assert walk.motion.jumps == ()
    end = walk.motion.segments[-1]
    _, impulse = hand.impact(end.q[2:, -1], end.v[:, -1], 0)
    assert impulse[1] < 0


def test_painleve_at_the_start(wheel, engine):
    """A spoke that leans back from its slip at a friction above Painleve's: nothing is walked, nothing raised."""
    hand = HandWheel(kappa=0.1, mu=3.0)
    assert hand.push(-0.3, 1) < 0 < hand.push(-0.3, -1)
    walk = simulate(wheel, [0, 0, -0.3], [0.5, 0, 1.0], hand.parameters, engine=engine)
    assert walk.stop is Stop.PAINLEVE
    assert walk.motion.segments == ()
    assert (walk.motion.period, walk.motion.travel, ledger(walk.motion).residual) == (0.0, 0.0, 0.0)
    assert simulate(wheel, [0, 0, -0.3], [-0.5, 0, 1.0], hand.parameters, engine=engine).stop is not Stop.PAINLEVE


@pytest.mark.parametrize(
    ("theta", "v", "parameters"),
    [
        (-0.5773718, (1.5458987, 0, 2.9813085), {"spokes": 5, "friction": 0.5672717, "inertia_ratio": 0.00997302}),
        (0.3251532, (-3.4774697, 0, -2.7664132), {"spokes": 5, "friction": 0.3140680, "inertia_ratio": 0.00101699}),
    ],
)
def test_painleve_while_sliding(wheel, engine, theta, v, parameters):
    """The contact force grows without bound on the way into the paradox: the walk ends at its edge, and soon."""
    walk = simulate(
        wheel, [0, 0, theta], v, {**parameters, "slope": 0.4}, step_limits=StepLimits(duration=5.0), engine=engine
    )
    assert walk.stop is Stop.PAINLEVE
    end = walk.motion.segments[-1]
    hand = HandWheel(parameters["spokes"], parameters["inertia_ratio"], 0.4, parameters["friction"])
    assert 0 < hand.push(end.q[2, -1], end.mode.sign) < 2e-6
    assert end.force[1, -1] > 100 * end.force[1, 0]
    assert ledger(walk.motion).relative_residual < 1e-8


def law_of(torque):
    function = torque_function(compass_biped(), ca.SX.sym("data", 0), lambda clock, q, v: torque(clock))
    return Law("test", function, np.zeros(1), np.zeros((0, 1)))


def test_a_torque_that_is_not_a_number_ends_the_walk_at_once(compass_walk, gait_a):
    walk = compass_walk(gait_a["z"], mu=np.inf, law=law_of(lambda t: ca.vertcat(ca.SX(np.nan), 0)))
    assert walk.stop is Stop.SINGULAR
    assert walk.motion.period == 0.0


def test_a_torque_that_ceases_to_be_a_number_ends_the_walk_there(compass_walk, gait_a):
    walk = compass_walk(gait_a["z"], mu=np.inf, law=law_of(lambda t: ca.vertcat(ca.sqrt(0.2 - t), 0)))
    assert walk.stop is Stop.SINGULAR
    assert walk.motion.period == pytest.approx(0.2, abs=1e-3)
    assert np.all(np.isfinite(walk.motion.channel("q")))


def test_infinite_friction_never_slips(compass_walk, gait_c):
    walk = compass_walk(gait_c["z"], mu=np.inf, steps=3)
    assert {segment.mode for segment in walk.motion.segments} == {Mode.STICK}
    assert {jump.mode for jump in walk.motion.jumps} <= {Mode.STICK}


def test_infinite_friction_and_a_sliding_foot_contradict_each_other(compass):
    with pytest.raises(InputError, match="infinite friction cannot slide"):
        simulate(compass, [0, 0, -0.1, -0.1], [0.1, 0, 0.5, -0.5], {})


def test_frictionless_foot_is_pushed_along_by_nothing(compass_walk):
    """Without friction the tangential force vanishes: on level ground the centre of mass keeps its forward speed."""
    walk = compass_walk((-0.12, 0.7, -0.5), mu=0.0, robot=HandCompass(), steps=1)
    for segment in walk.motion.segments:
        np.testing.assert_array_equal(segment.force[0], 0.0)
        assert segment.friction_work[-1] == 0.0
    momentum = []
    for k in (0, -1):
        state = walk.motion.segments[0 if k == 0 else -1]
        bodies = HandCompass().bodies(state.q[2:, k], state.v[:2, k], state.v[2:, k])
        momentum.append(sum(mass * velocity[0] for mass, _, velocity in bodies))
    assert momentum[0] == pytest.approx(momentum[1], rel=1e-9)


@pytest.mark.parametrize(
    ("q", "v", "message"),
    [
        ([0, 0, 0.1], [0, 0, 0, 0], r"q needs 4 entries \(x, y, th1, th2\), got shape \(3,\)"),
        ("here", [0, 0, 0, 0], r"q needs numbers \(x, y, th1, th2\), got 'here'"),
        ([0, 0, 0.1, 0.1], [[0, 0, 0, 0]], r"v needs 4 entries .* got shape \(1, 4\)"),
        ([0, 0, np.nan, 0.1], [0, 0, 0, 0], "q must be finite"),
        ([0, 0, 0.1, 0.1], [0, 0, np.inf, 0], "v must be finite"),
        ([0, 0, 0.1, 0.1], [0, 0.1, 0, 0], r"normal velocity v\[1\] must be 0, got 0.1"),
    ],
)
def test_a_state_that_cannot_be_is_refused(compass, q, v, message):
    with pytest.raises(InputError, match=message):
        simulate(compass, q, v, {"friction": 0.3})


def test_a_parameter_that_cannot_be_is_refused(compass):
    with pytest.raises(InputError, match="friction must be at least 0"):
        simulate(compass, [0, 0, 0.1, 0.1], [0, 0, 0, 0], {"friction": -0.1})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"events": 0}, "events must be at least 1"),
        ({"events": 1.5}, "events must be a whole number"),
        ({"duration": 0.0}, r"duration must be greater than 0 \[s\], got 0"),
        ({"duration": np.inf}, "duration must be a finite number"),
    ],
)
def test_limits_that_cannot_be_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        StepLimits(**options)
