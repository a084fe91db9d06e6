"""Models with several contacts, as matrices written by hand: a compass about its hip, a wheel, a box, a sleeve."""

from dataclasses import dataclass

import numpy as np

from gaitopt.model import ClosedContact


@dataclass(frozen=True)
class HipCompass:
    """Compass biped: (x, y) of its hip and the leg angles a and b, counter-clockwise from the vertical.

    The foot of a leg at angle a is at hip + length (sin a, -cos a), its mass com from the foot on the same line.
    """

    length: float = 1.6
    com: float = 0.8
    leg: float = 4.0
    hip: float = 2.0
    gravity: float = 9.8

    def mass_matrix(self, q):
        arm = self.leg * (self.length - self.com)
        matrix = np.diag([self.hip + 2 * self.leg] * 2 + [arm * (self.length - self.com)] * 2)
        for entry in (2, 3):
            matrix[0, entry] = matrix[entry, 0] = arm * np.cos(q[entry])
            matrix[1, entry] = matrix[entry, 1] = arm * np.sin(q[entry])
        return matrix

    def bias(self, q, v):
        """Return h of M a + h = forces."""
        arm = self.leg * (self.length - self.com)
        sines, cosines, rates = np.sin(q[2:]), np.cos(q[2:]), v[2:]
        return np.concatenate(
            (
                [-arm * (sines @ rates**2)],
                [arm * (cosines @ rates**2) + (self.hip + 2 * self.leg) * self.gravity],
                arm * self.gravity * sines,
            )
        )

    def contacts(self, q, v, names="AB"):
        """Return the feet as closed contacts, whatever their height."""
        return [self._foot(q, v, name) for name in names]

    def _foot(self, q, v, name):
        entry = 2 + "AB".index(name)
        normal, tangent = np.array([0.0, 1, 0, 0]), np.array([1.0, 0, 0, 0])
        normal[entry], tangent[entry] = self.length * np.sin(q[entry]), self.length * np.cos(q[entry])
        return ClosedContact(
            name,
            normal,
            normal_bias=self.length * np.cos(q[entry]) * v[entry] ** 2,
            tangent_row=tangent,
            tangent_bias=-self.length * np.sin(q[entry]) * v[entry] ** 2,
            slip_speed=float(tangent @ v),
        )

    def landing(self, th, rate):
        """Return (q, v) with leg A standing still, leaning back, and leg B ahead: a' = -1, b' = rate."""
        q = np.array([0.0, self.length * np.cos(th), -th, th])
        return q, np.array([self.length * np.cos(th), -self.length * np.sin(th), -1.0, rate])


def wheel_contacts(half_angle):
    """Return the rear and front spoke of a rimless wheel of radius 1 with clockwise rotation."""
    c, s = np.cos(half_angle), np.sin(half_angle)
    return [
        ClosedContact(name, np.array([0, 1, -x]), tangent_row=np.array([1, 0, -c]), group="wheel")
        for name, x in (("rear", -s), ("front", s))
    ]


def box_corners(half_width, half_height, slip_speed=0.0):
    """Return the lower corners of a box with counter-clockwise rotation about its centre."""
    return [
        ClosedContact(
            name, np.array([0, 1, x]), tangent_row=np.array([1, 0, half_height]), slip_speed=slip_speed, group="box"
        )
        for name, x in (("rear", -half_width), ("front", half_width))
    ]


def spelling(modes):
    """Return the modes of the contacts A and B in one character each: 0 (free), S (stick), + or -."""
    signs = {"free": "0", "stick": "S", "slip+": "+", "slip-": "-"}
    return "".join(signs[modes[name].value] for name in "AB")
