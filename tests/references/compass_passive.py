"""Passive gaits of the compass biped without gaitopt: Gaits A, B and C of Gamus & Or (2015), and Goswami's compass.

Equations of motion of tests/newton_euler (momentum and angular momentum of three point masses), integrated to events at
a relative tolerance of 1e-12, fixed points by Newton's method, multipliers by central differences.
"""

import math
from dataclasses import dataclass

import numpy as np

from tests.newton_euler.compass import HandCompass
from tests.references.event_driven import fixed_point, force_ratio, take_step
from tests.references.storage import run

SLOPE = math.radians(1)
GOSWAMI = {"length": 1.0, "com": 0.5, "mass": 5.0, "hip": 10.0, "gravity": 9.81, "slope": math.radians(3)}


@dataclass(frozen=True)
class Compass(HandCompass):
    """The compass biped as a walker of `event_driven`: state (x, th1, th2 and their rates)."""

    speed, stick_at_start = 3, False

    def motion(self, mode, y):
        if mode:
            xdd, a, (tangential, normal) = self.slip(mode, y[1:3], y[4:])
        else:
            xdd, (a, (tangential, normal)) = 0.0, self.stick(y[1:3], y[4:])
        return np.array([*y[3:], xdd, *a]), tangential, normal

    @property
    def impact_mu(self):
        return self.mu

    def guard(self, y):
        return y[2] - y[1]

    def armed(self, y):
        return y[1] > 0

    def impact(self, y, mode):
        after, impulse = super().impact(y[1:3], np.array([y[3], 0.0, *y[4:]]), mode)
        foot = self.landing(y[1:3], after[:2], after[2:])[1]
        return np.array([0.0, -y[2], -y[1], foot[0], -after[3], -after[2]]), impulse

    def embed(self, z):
        """Return the state of section coordinates: angle of both legs, their rates, and the foot speed of a slip."""
        return np.array([0.0, z[0], z[0], z[3] if len(z) == 4 else 0.0, z[1], z[2]])

    def project(self, y, size):
        return y[[1, 4, 5, 3][:size]]


def gait(compass, z, method="DOP853"):
    """Return fixed point, period, travel, multipliers and contact sequence of the gait near a start."""

    def image(z):
        return compass.project(take_step(compass, compass.embed(z), method).after, len(z))

    z, matrix = fixed_point(image, np.array(z, dtype=float))
    step = take_step(compass, compass.embed(z), method)
    return {
        "sequence": step.sequence,
        "z": z,
        "period": step.period,
        "travel": 2 * compass.length * math.sin(-z[0]) + step.phases[-1][2][0, -1],
        "multipliers": np.linalg.eigvals(matrix).astype(complex),
        "impact_ratio": step.impulse[0] / step.impulse[1],
    }


def gait_a(method="DOP853"):
    """Sticking gait at friction 0.3, and the friction coefficient below which its foot slips."""
    compass = Compass(slope=SLOPE, mu=0.3)
    found = gait(compass, [-0.1478, 0.7328, -0.5007], method)
    ratio, time, _ = force_ratio(compass, take_step(compass, compass.embed(found["z"]), method))
    return found | {"critical_friction": ratio, "critical_time": time}


def gait_b(method="DOP853"):
    """Gait with sticking impact at friction 0.14."""
    return gait(Compass(slope=SLOPE, mu=0.14), [-0.1408, 0.7102, -0.5168], method)


def gait_c(method="DOP853"):
    """Gait with slipping impact at friction 0.14."""
    return gait(Compass(slope=SLOPE, mu=0.14), [-0.0790, 0.0438, -0.4318, 0.6342], method)


def goswami(method="DOP853"):
    """Gait of the compass of Goswami et al. (1996) at 3 degrees, friction unlimited."""
    return gait(Compass(**GOSWAMI), [-0.271, 1.092, -0.377], method)


COMPUTATIONS = {
    "gait_a": (gait_a, 1e-10),
    "gait_b": (gait_b, 1e-10),
    "gait_c": (gait_c, 1e-10),
    "goswami": (goswami, 1e-10),
}
QUICK = ("goswami",)

if __name__ == "__main__":
    run("compass_passive", COMPUTATIONS)
