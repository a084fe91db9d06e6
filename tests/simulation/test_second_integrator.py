"""Whole steps against equations written by hand and integrated by scipy's solve_ivp, phase by phase."""

import dataclasses

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gaitopt import Law, Stop, compass_biped
from gaitopt.control.signature import torque_function
from tests.newton_euler.compass import HandCompass

SIGNS = {"stick": 0, "slip+": 1, "slip-": -1}


def compare(walk, hand, z, xd, tolerance=1e-9):
    """Walk the phases the simulator chose by hand; times and the next state must agree."""
    assert walk.stop is Stop.STEPS_DONE
    sequence = walk.motion.sequence()
    phases = [SIGNS[mode.value] for mode in sequence.phases]
    th = [z[0], z[0]]
    times, th_next, speed, rates = hand.walk(phases, th, [xd, 0, *z[1:]], SIGNS[sequence.impact.value])
    np.testing.assert_allclose([segment.time[-1] for segment in walk.motion.segments], times, atol=tolerance)
    jump = walk.motion.jumps[0]
    np.testing.assert_allclose(jump.q_next[2:], th_next, atol=tolerance)
    np.testing.assert_allclose(jump.v_next, [speed, 0, *rates], atol=tolerance)


def test_passive_gaits(compass_walk, hand_compass, passive_gait):
    z, xd, mu = passive_gait["z"], passive_gait["xd"], passive_gait["mu"]
    compare(compass_walk(z, xd=xd, mu=mu), dataclasses.replace(hand_compass, mu=mu), z, xd)


# One step for every sequence that was found among 900 random states: z, foot speed, friction, sequence.
STEPS = [
    ((-0.12, 0.73, -0.16), 0.12, 0.10, "slip+ stick | slip+"),
    ((-0.13, 0.85, -0.33), -0.32, 0.19, "slip- stick | stick"),
    ((-0.09, 0.51, -0.54), -0.07, 0.09, "slip- slip+ stick | slip-"),
    ((-0.05, 0.34, -0.64), 0.00, 0.12, "stick | slip+"),
    ((-0.06, 0.65, -0.56), -0.37, 0.24, "slip- stick | slip+"),
    ((-0.14, 0.76, -0.54), -0.11, 0.16, "slip- slip+ stick | stick"),
    ((-0.14, 0.66, -0.62), 0.00, 0.25, "stick | stick"),
    ((-0.06, 0.27, -0.42), 0.00, 0.21, "stick | slip-"),
    ((-0.14, 0.40, -0.03), 0.30, 0.17, "slip+ stick | stick"),
    ((-0.12, 0.86, -0.40), -0.27, 0.11, "slip- slip+ stick slip- | slip+"),
    ((-0.07, 0.22, 0.16), 0.00, 0.07, "slip+ stick | slip-"),
    ((-0.07, 0.32, 0.19), 0.36, 0.06, "slip+ stick slip- | slip+"),
    ((-0.06, 0.57, 0.15), 0.00, 0.02, "slip+ slip- | slip+"),
    ((-0.13, 0.63, 0.15), 0.00, 0.16, "stick slip- | slip+"),
    ((-0.06, 0.65, -0.34), -0.51, 0.13, "slip- stick | slip-"),
    ((-0.10, 0.72, -0.15), -0.22, 0.12, "slip- stick slip- | slip+"),
    ((-0.13, 0.77, -0.72), 0.00, 0.10, "slip+ stick slip- | stick"),
    ((-0.09, 0.75, -0.47), -0.42, 0.08, "slip- slip+ stick slip- | slip-"),
    ((-0.09, 0.41, 0.09), 0.00, 0.12, "stick slip- | stick"),
]


@pytest.mark.parametrize(("z", "xd", "mu", "sequence"), STEPS, ids=[step[3] for step in STEPS])
def test_every_kind_of_step(compass_walk, hand_compass, z, xd, mu, sequence):
    walk = compass_walk(z, xd=xd, mu=mu)
    assert str(walk.motion.sequence()) == sequence
    compare(walk, dataclasses.replace(hand_compass, mu=mu), z, xd)


def feedback():
    """Return a law that turns the hip with the clock and damps the ankle, written as a CasADi Function."""
    data = ca.SX.sym("data", 0)

    def torque(clock, q, v):
        return ca.vertcat(-0.3 * v[2], 2.0 * ca.sin(4 * clock))

    return Law("feedback", torque_function(compass_biped(), data, torque), np.zeros(1), np.zeros((0, 1)))


@dataclasses.dataclass(frozen=True)
class DrivenCompass(HandCompass):
    """The compass by hand under the same torques."""

    def _rate(self, phase):
        def rate(t, y):
            th, w = y[1:3], y[4:]
            torque = (-0.3 * w[0], 2.0 * np.sin(4 * t))
            if phase == 0:
                xdd, a = 0.0, self.stick(th, w, torque)[0]
            else:
                xdd, a, _ = self.slip(phase, th, w, torque)
            return np.array([y[3], *w, xdd, *a])

        return rate

    def _change(self, phase, following):
        if phase != 0 or following is None:
            return super()._change(phase, following)

        def guard(t, y):
            tangential, normal = self.stick(y[1:3], y[4:], (-0.3 * y[4], 2.0 * np.sin(4 * t)))[1]
            return self.mu * normal + following * tangential

        guard.direction = -1
        return guard


@pytest.mark.parametrize("mu", [0.5, 0.14, 0.12])
def test_steps_under_feedback(compass_walk, hand_compass, mu):
    """Torques move the touchdown, the slips and the forces that decide them."""
    z = (-0.147836890, 0.732796791, -0.500667882)
    walk = compass_walk(z, mu=mu, law=feedback())
    hand = DrivenCompass(slope=hand_compass.slope, mu=mu)
    compare(walk, hand, z, 0.0)
    segment = walk.motion.segments[-1]
    np.testing.assert_allclose(segment.torque[0], -0.3 * segment.v[2], rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(segment.torque[1], 2 * np.sin(4 * segment.time), rtol=1e-12, atol=1e-14)
    passive = compass_walk(z, mu=mu)
    assert abs(passive.motion.period - walk.motion.period) > 1e-3


def test_wheel_that_slides_all_along(wheel_walk, hand_wheel):
    """A step of Type D by solve_ivp on the equations of a rigid body pushed at its foot."""
    hand = dataclasses.replace(hand_wheel, mu=0.3)
    unit = np.sqrt(4 / 3)
    walk = wheel_walk(1.07, xd=0.5, mu=0.3)

    def rate(t, y):
        slide, turn, _, _ = hand.motion(y[1], y[3], 1)
        return [y[2], y[3], slide, turn]

    def landing(t, y):
        return hand.half - y[1]

    landing.terminal = True
    start = [0, -hand.half, 0.5 / unit, 1.07 / unit]
    run = solve_ivp(rate, (0, 5), start, "DOP853", events=landing, rtol=1e-12, atol=1e-14)
    segment = walk.motion.segments[0]
    assert segment.time[-1] == pytest.approx(run.t[-1], abs=1e-11)
    np.testing.assert_allclose(segment.q[[0, 2], -1], run.y[:2, -1], atol=1e-10)
    np.testing.assert_allclose(segment.v[[0, 2], -1], run.y[2:, -1], atol=1e-10)
