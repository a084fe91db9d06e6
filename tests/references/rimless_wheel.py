"""Passive gaits of the rimless wheel without gaitopt: Types A to D of Gamus & Or (2015), and where they exist.

Ten spokes, kappa = 1/3, slope 13 degrees; lengths in spokes, times in tau_c = sqrt((m l^2 + I_c) / (m g l)).  Equations
of motion of tests/newton_euler (Newton and Euler for one rigid body), integrated to events at a relative tolerance of
1e-12, fixed points by Newton's method, multipliers by central differences.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from tests.newton_euler.wheel import HandWheel
from tests.references.event_driven import fixed_point, force_ratio, take_step
from tests.references.storage import run

SLOPE = math.radians(13)


@dataclass(frozen=True)
class Wheel(HandWheel):
    """The rimless wheel as a walker of `event_driven`: state (theta, foot speed, theta rate), in units of gravity 1."""

    speed = 1
    stick_at_impact: bool = False
    stick_at_start: bool = False
    """Continue a gait to friction coefficients at which its impact, or the foot just after it, would slip."""

    @property
    def impact_mu(self):
        return math.inf if self.stick_at_impact else self.mu

    @property
    def tau(self):
        return math.sqrt(1 + self.kappa)

    def motion(self, mode, y):
        xdd, a, tangential, normal = super().motion(y[0], y[2], mode)
        return np.array([y[2], xdd, a]), tangential, normal

    def guard(self, y):
        return self.half - y[0]

    def armed(self, y):
        return True

    def impact(self, y, mode):
        """Momentum of the body and the law at the spoke that lands: unknowns (foot velocity, rate, impulse)."""
        s, c = np.sin(y[0]), np.cos(y[0])  # the centre is at the old foot + (s, c), at the new foot + (-s, c)
        before = np.array([y[1] + c * y[2], -s * y[2]])
        matrix = np.array(
            [
                [1.0, c, -1.0, 0.0],
                [0.0, s, 0.0, -1.0],
                [0.0, self.kappa, c, s],
                [1.0, 0.0, 0.0, 0.0] if mode == 0 else [0.0, 0.0, 1.0, mode * self.mu],
            ]
        )
        speed, rate, *impulse = np.linalg.solve(matrix, [*before, self.kappa * y[2], 0.0])
        return np.array([-y[0], speed, rate]), np.array(impulse)


def gait(wheel, z, speed=0.0):
    """Return the gait near a start, (rate,) or (rate, foot speed), in units of tau_c.

    Without a foot speed in ``z`` each step starts with the given one, and the gait repeats in all but the foot speed.
    """
    units = np.array([1, wheel.tau, wheel.tau])

    def start(z):
        return np.array([-wheel.half, z[1] if len(z) == 2 else speed, z[0]]) / units

    def image(z):
        return (take_step(wheel, start(z)).after * units)[[2, 1][: len(z)]]

    z, matrix = fixed_point(image, np.array(z, dtype=float))
    step = take_step(wheel, start(z))
    ratio, _, least = force_ratio(wheel, step)
    sticking = wheel.motion(0, start(z))
    return {
        "sequence": step.sequence,
        "z": z,
        "period": step.period / wheel.tau,
        "multipliers": np.linalg.eigvals(matrix).astype(complex),
        "impact_ratio": step.impulse[0] / step.impulse[1],
        "largest_force_ratio": ratio,
        "ratio_to_stick_at_start": abs(sticking[1] / sticking[2]),
        "least_normal_force": least,
        "drift": (step.after[1] - start(z)[1]) * wheel.tau,
    }


def type_a():
    """Sticking gait: its critical friction is the largest force ratio."""
    return gait(Wheel(slope=SLOPE), [0.876])


def type_b():
    """Sticking impact, slip at the end of the step."""
    return gait(Wheel(slope=SLOPE, mu=0.3), [0.88])


def type_b_with_first_slip():
    """Sticking impact, slip at both ends of the step."""
    return gait(Wheel(slope=SLOPE, mu=0.25), [0.8826])


def type_c():
    """Slipping impact, with a phase of stick."""
    return gait(Wheel(slope=SLOPE, mu=0.24), [0.875, 0.01])


def type_d():
    """Complete slip."""
    return gait(Wheel(slope=SLOPE, mu=0.3), [1.07], speed=1.0)


def ranges():
    """Friction coefficients where the types begin and end, and slopes where Type A does [deg]."""

    def first_slip(mu):
        return gait(Wheel(slope=SLOPE, mu=mu, stick_at_start=True), [0.882])["ratio_to_stick_at_start"] - mu

    def impact_slips(mu):
        return -gait(Wheel(slope=SLOPE, mu=mu, stick_at_impact=True), [0.8826])["impact_ratio"] - mu

    def complete_slip_lifts_off(mu):
        return gait(Wheel(slope=SLOPE, mu=mu), [1.08], speed=1.0)["least_normal_force"]

    def lifts_off(slope):
        return gait(Wheel(slope=slope), [0.9])["least_normal_force"]

    def rolls_over(slope):
        """Rate after the impact, by the energy balance of a step, less the rate that ends at rest over the spoke."""
        beta = (math.cos(math.pi / 5) + 1 / 3) / (4 / 3)
        rate = beta * math.sqrt(4 * math.sin(slope) * math.sin(math.pi / 10) / (1 - beta**2))
        return rate - 2 * math.sin((math.pi / 10 - slope) / 2)

    return {
        "type_b_least_without_first_slip": brentq(first_slip, 0.26, 0.275, xtol=1e-9),
        "type_b_to_c": brentq(impact_slips, 0.243, 0.248, xtol=1e-9),
        "type_d_most": brentq(complete_slip_lifts_off, 0.31, 0.33, xtol=1e-9),
        "type_a_least_slope": math.degrees(brentq(rolls_over, 0.01, 0.1, xtol=1e-13)),
        "type_a_most_slope": math.degrees(brentq(lifts_off, 0.25, 0.27, xtol=1e-9)),
    }


def six_spokes():
    """Sticking gait of six spokes, kappa = 1/2, slope 0.2 rad; time in sqrt(l / g)."""
    found = gait(Wheel(spokes=6, kappa=0.5, slope=0.2), [0.46 * math.sqrt(1.5)])
    return {"rate": found["z"][0] / math.sqrt(1.5), "multipliers": found["multipliers"]}


COMPUTATIONS = {
    "type_a": (type_a, 1e-10),
    "type_b": (type_b, 1e-10),
    "type_b_with_first_slip": (type_b_with_first_slip, 1e-10),
    "type_c": (type_c, 1e-10),
    "type_d": (type_d, 1e-10),
    "ranges": (ranges, 1e-7),
    "six_spokes": (six_spokes, 1e-10),
}
QUICK = ("six_spokes", "type_d")

if __name__ == "__main__":
    run("rimless_wheel", COMPUTATIONS)
