"""The rimless wheel by hand: one rigid body pushed at its lowest point."""

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class HandWheel:
    """Spoke length and mass 1, gravity 1; angle theta clockwise from the normal, centre at foot + (sin, cos)."""

    spokes: int = 10
    kappa: float = 1 / 3
    slope: float = np.deg2rad(13)
    mu: float = np.inf

    @property
    def parameters(self):
        """The same robot for gaitopt."""
        return {
            "spokes": self.spokes,
            "leg_length": 1.0,
            "mass": 1.0,
            "inertia_ratio": self.kappa,
            "gravity": 1.0,
            "slope": self.slope,
            "friction": self.mu,
        }

    @property
    def half(self):
        return np.pi / self.spokes

    def motion(self, theta, rate, sign=0):
        """Return (xdd, angular acceleration, f_t, f_n) of a foot that sticks (sign 0) or slides.

        Newton along and across the slope, Euler about the centre (contact force at -(sin, cos) from it), and the
        contact law: four linear equations.
        """
        s, c = np.sin(theta), np.cos(theta)
        matrix = np.array(
            [
                [1.0, c, -1.0, 0.0],
                [0.0, -s, 0.0, -1.0],
                [0.0, self.kappa, c, -s],
                [1.0, 0.0, 0.0, 0.0] if sign == 0 else [0.0, 0.0, 1.0, sign * self.mu],
            ]
        )
        load = [s * rate**2 + np.sin(self.slope), c * rate**2 - np.cos(self.slope), 0.0, 0.0]
        return np.linalg.solve(matrix, load)

    def push(self, theta, sign):
        """Return the force along the ground per acceleration of a foot that slides with this sign."""
        s, c = np.sin(theta), np.cos(theta)
        # As in `motion`, at rest and weightless, with a unit force at the foot besides that of the contact.
        matrix = np.array(
            [
                [1.0, c, -1.0, 0.0],
                [0.0, -s, 0.0, -1.0],
                [0.0, self.kappa, c, -s],
                [0.0, 0.0, 1.0, sign * self.mu],
            ]
        )
        return 1 / np.linalg.solve(matrix, [1.0, 0.0, -c, 0.0])[0]
