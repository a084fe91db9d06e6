"""The compass biped by hand with a spring, a damper and a geared rotor between its legs."""

from dataclasses import dataclass

import numpy as np

from tests.newton_euler.compass import HandCompass


@dataclass(frozen=True)
class HandSprungCompass(HandCompass):
    """All three act on the hip angle s = th1 + th2: the moment -k s - d s' - J s'' on both angles."""

    stiffness: float = 3.0
    damping: float = 0.1
    rotor: float = 1e-4
    ratio: float = 50.0

    @property
    def parameters(self):
        forces = {"hip_stiffness": self.stiffness, "hip_damping": self.damping}
        return super().parameters | forces | {"rotor_inertia": self.rotor, "gear_ratio": self.ratio}

    @property
    def reflected(self):
        """Inertia of the rotor at the hip: it turns `ratio` times as fast as the hip."""
        return self.ratio**2 * self.rotor

    def leg_matrix(self, th1, th2):
        return super().leg_matrix(th1, th2) + self.reflected * np.ones((2, 2))

    def leg_load(self, th, w, torque=(0.0, 0.0)):
        moment = -self.stiffness * sum(th) - self.damping * sum(w)
        return super().leg_load(th, w, (torque[0], torque[1] + moment))

    def momenta(self, th, v):
        """As of the compass; the trailing leg passes a moment on to the rotor, which takes up angular momentum."""
        rotor = self.reflected * (v[2] + v[3])
        return super().momenta(th, v) + np.array([0.0, 0.0, 0.0, rotor])

    def elastic(self, th):
        """Energy of the spring."""
        return self.stiffness * (th[0] + th[1]) ** 2 / 2
