"""The compass biped of 100 kg typed in by hand, for the scripts of other tools: no limits on torque or friction.

The arithmetic serves any kind of number: CasADi symbols, numpy arrays (complex ones too), Drake's AutoDiffXd.
Angles are from the vertical, th1 of the stance leg and th2 of the swing leg, positive as both open forward.
"""

import math

import numpy as np

LENGTH, COM, LEG, HIP, GRAVITY = 1.6, 0.8, 40.0, 20.0, 9.8  # [m], [m], [kg], [kg], [m/s^2]
STEP = 0.4713  # [m]
SHORT = LENGTH - COM
FIRST, SECOND = LEG * COM + (HIP + LEG) * LENGTH, LEG * SHORT  # first moments of what swings with each leg
M11, M22, COUPLING = LEG * COM**2 + (HIP + LEG) * LENGTH**2, LEG * SHORT**2, LEG * LENGTH * SHORT
MASS = 2 * LEG + HIP


def accelerations(th1, th2, w1, w2, ankle, hip, sin, cos):
    """Return the angular accelerations of a stance foot that sticks."""
    m12, turn = COUPLING * cos(th1 + th2), COUPLING * sin(th1 + th2)
    r1 = ankle + hip + turn * w2**2 + GRAVITY * FIRST * sin(th1)
    r2 = hip + turn * w1**2 - GRAVITY * SECOND * sin(th2)
    determinant = M11 * M22 - m12**2
    return (M22 * r1 - m12 * r2) / determinant, (M11 * r2 - m12 * r1) / determinant


def touchdown(last, first, impulse, sin, cos):
    """Return what must vanish for the first state of the next step to follow from the last one through the impact."""
    (th1, th2, w1, w2), (next1, next2, rate1, rate2) = last, first
    s1, c1, s2, c2 = sin(th1), cos(th1), sin(th2), cos(th2)
    along, up = impulse
    after1, after2 = -rate2, -rate1
    jump1, jump2, m12 = after1 - w1, after2 - w2, COUPLING * cos(th1 + th2)
    v_x = -LENGTH * (c1 * after1 + c2 * after2)  # the landing foot rests: so moves the other one
    v_y = LENGTH * (s1 * after1 - s2 * after2)
    return [
        next1 + th2,
        next2 + th1,
        th2 - th1,
        LENGTH * (s1 + s2) - STEP,
        MASS * v_x + FIRST * c1 * jump1 + SECOND * c2 * jump2 - along,
        MASS * v_y - FIRST * s1 * jump1 + SECOND * s2 * jump2 - up,
        FIRST * (c1 * v_x - s1 * v_y) + M11 * jump1 + m12 * jump2 - LENGTH * (c1 * along - s1 * up),
        SECOND * (c2 * v_x + s2 * v_y) + m12 * jump1 + M22 * jump2 - LENGTH * (c2 * along + s2 * up),
    ]


def straight_line(count, speed):
    """Return a start: legs that swing at constant rates, shape (4, count)."""
    angle = math.asin(STEP / 2 / LENGTH)
    line, rate = np.linspace(-angle, angle, count), np.full(count, 2 * angle * speed / STEP)
    return np.vstack([line, line, rate, rate])


IMPULSE = (0.0, 0.1 * MASS * GRAVITY)
"""A start for the impulse."""
