"""The compass biped by hand: three point masses, two massless links, a hinge at the hip."""

from dataclasses import dataclass

import numpy as np
from scipy.integrate import solve_ivp


@dataclass(frozen=True)
class HandCompass:
    """State (x, th1, th2, xd, w1, w2): foot position along the ground and leg angles, then their rates."""

    length: float = 1.6
    com: float = 0.8
    mass: float = 4.0
    hip: float = 2.0
    gravity: float = 9.8
    slope: float = 0.0
    mu: float = np.inf

    @property
    def parameters(self):
        """The same robot for gaitopt."""
        return {
            "leg_length": self.length,
            "leg_com": self.com,
            "leg_mass": self.mass,
            "hip_mass": self.hip,
            "gravity": self.gravity,
            "slope": self.slope,
            "friction": self.mu,
        }

    @property
    def total(self):
        return 2 * self.mass + self.hip

    @property
    def _stance(self):
        """First mass moment of everything the stance leg carries: m d + (m + m_h) l."""
        return self.mass * self.com + (self.mass + self.hip) * self.length

    @property
    def _swing(self):
        """First mass moment of the swing leg about the hip: m (l - d)."""
        return self.mass * (self.length - self.com)

    def leg_matrix(self, th1, th2):
        """Mass matrix of the two angles with the foot held, as in Goswami et al. (1996) up to signs of the angles."""
        own = self.mass * self.com**2 + (self.mass + self.hip) * self.length**2
        swing = self.mass * (self.length - self.com) ** 2
        mixed = self._swing * self.length * np.cos(th1 + th2)
        return np.array([[own, mixed], [mixed, swing]])

    def leg_load(self, th, w, torque=(0.0, 0.0)):
        """Torques, gravity and centrifugal terms on the two angles; ankle torque on th1, hip torque on th1 + th2."""
        (th1, th2), (w1, w2), (ankle, hip) = th, w, torque
        turn = self._swing * self.length * np.sin(th1 + th2)
        return np.array(
            [
                ankle + hip + turn * w2**2 + self._stance * self.gravity * np.sin(th1 + self.slope),
                hip + turn * w1**2 - self._swing * self.gravity * np.sin(th2 - self.slope),
            ]
        )

    def foot_force(self, th, w, a, xdd=0.0):
        """Newton's law for the three masses together."""
        (th1, th2), (w1, w2), (a1, a2) = th, w, a
        along = self.total * xdd + self._stance * (np.cos(th1) * a1 - np.sin(th1) * w1**2)
        along += self._swing * (np.cos(th2) * a2 - np.sin(th2) * w2**2)
        upward = -self._stance * (np.sin(th1) * a1 + np.cos(th1) * w1**2)
        upward += self._swing * (np.sin(th2) * a2 + np.cos(th2) * w2**2)
        weight = self.total * self.gravity
        return np.array([along - weight * np.sin(self.slope), upward + weight * np.cos(self.slope)])

    def stick(self, th, w, torque=(0.0, 0.0)):
        """Angular accelerations and contact force of a stuck foot."""
        a = np.linalg.solve(self.leg_matrix(*th), self.leg_load(th, w, torque))
        return a, self.foot_force(th, w, a)

    def slip(self, sign, th, w, torque=(0.0, 0.0)):
        """Foot and angular accelerations and contact force of a foot that slides with this sign."""
        (th1, th2), (w1, w2) = th, w
        c1, s1, c2, s2 = np.cos(th1), np.sin(th1), np.cos(th2), np.sin(th2)
        weight = self.total * self.gravity
        # Unknowns xdd, a1, a2, f_n; f_t = -sign mu f_n.
        matrix = np.zeros((4, 4))
        matrix[0] = [self.total, self._stance * c1, self._swing * c2, sign * self.mu]
        matrix[1] = [0.0, -self._stance * s1, self._swing * s2, -1.0]
        matrix[2:, 0] = self._stance * c1, self._swing * c2
        matrix[2:, 1:3] = self.leg_matrix(th1, th2)
        load = np.array(
            [
                self._stance * s1 * w1**2 + self._swing * s2 * w2**2 + weight * np.sin(self.slope),
                self._stance * c1 * w1**2 - self._swing * c2 * w2**2 - weight * np.cos(self.slope),
                *self.leg_load(th, w, torque),
            ]
        )
        xdd, a1, a2, normal = np.linalg.solve(matrix, load)
        return xdd, np.array([a1, a2]), np.array([-sign * self.mu * normal, normal])

    def bodies(self, th, foot_velocity, w):
        """Return (mass, position, velocity) of stance leg, hip and swing leg, the foot at the origin."""
        (th1, th2), (w1, w2) = th, w
        up, along = np.array([np.sin(th1), np.cos(th1)]), np.array([np.cos(th1), -np.sin(th1)])
        down, across = np.array([np.sin(th2), -np.cos(th2)]), np.array([np.cos(th2), np.sin(th2)])
        hip, hip_velocity = self.length * up, foot_velocity + self.length * along * w1
        rest = self.length - self.com
        return [
            (self.mass, self.com * up, foot_velocity + self.com * along * w1),
            (self.hip, hip, hip_velocity),
            (self.mass, hip + rest * down, hip_velocity + rest * across * w2),
        ]

    def landing(self, th, foot_velocity, w):
        """Position and velocity of the swing foot."""
        (_, hip, hip_velocity), (th2, w2) = self.bodies(th, foot_velocity, w)[1], (th[1], w[1])
        down, across = np.array([np.sin(th2), -np.cos(th2)]), np.array([np.cos(th2), np.sin(th2)])
        return hip + self.length * down, hip_velocity + self.length * across * w2

    def momenta(self, th, v):
        """Linear momentum, angular momentum about the landing foot, and of the stance leg about the hip (clockwise)."""
        bodies = self.bodies(th, v[:2], v[2:])
        foot, hip = self.landing(th, v[:2], v[2:])[0], bodies[1][1]
        linear = sum(mass * velocity for mass, _, velocity in bodies)
        about_foot = sum(mass * _moment(position - foot, velocity) for mass, position, velocity in bodies)
        mass, position, velocity = bodies[0]
        return np.array([*linear, about_foot, mass * _moment(position - hip, velocity)])

    def impact(self, th, v, sign):
        """Rates after an impact that ends in stick (sign 0) or slip, and the impulse on the landing foot.

        The impulse acts at the landing foot, so the angular momentum about it is kept; the trailing leg feels only the
        hip, so its angular momentum about the hip is kept.
        """

        def equations(unknown):
            after, impulse = unknown[:4], unknown[4:]
            velocity = self.landing(th, after[:2], after[2:])[1]
            law = velocity[0] if sign == 0 else impulse[0] + sign * self.mu * impulse[1]
            change = self.momenta(th, after) - self.momenta(th, v)
            return np.array([change[0] - impulse[0], change[1] - impulse[1], change[2], change[3], velocity[1], law])

        # The equations are linear: six evaluations give their matrix.
        rest = equations(np.zeros(6))
        matrix = np.array([equations(unit) - rest for unit in np.eye(6)]).T
        solution = np.linalg.solve(matrix, -rest)
        return solution[:4], solution[4:]

    def walk(self, phases, th, v, impact):
        """Walk one step through the given phases with another integrator; events are located on the given order.

        Parameters
        ----------
        phases : list of int
            0 for stick, +1 or -1 for slip.
        impact : int
            Outcome of the touchdown.

        Returns
        -------
        times of the phase changes and the touchdown, and (th, foot speed, rates) after the leg swap
        """
        y, clock, times = np.array([0.0, *th, v[0], *v[2:]]), 0.0, []
        for phase, following in zip(phases, [*phases[1:], None], strict=True):
            clock, y = self._flow(phase, following, clock, y)
            times.append(clock)
        after, _ = self.impact(y[1:3], np.array([y[3], 0.0, *y[4:]]), impact)
        speed = self.landing(y[1:3], after[:2], after[2:])[1][0]
        return times, -y[2:0:-1], speed, -after[:1:-1]

    def _flow(self, phase, following, clock, y):
        """Integrate a phase until it ends, a tenth of a second at a time."""
        rate, change, started = self._rate(phase), self._change(phase, following), clock
        while clock < started + 3.0:
            run = solve_ivp(rate, (clock, clock + 0.1), y, "DOP853", events=change, rtol=1e-11, atol=1e-13)
            for time, end in zip(run.t_events[0], run.y_events[0], strict=True):
                if time > started and (following is not None or end[1] > 0):
                    return time, end
            clock, y = run.t[-1], run.y[:, -1]
        raise AssertionError(f"phase {phase} did not end within 3 s")

    def _rate(self, phase):
        def rate(t, y):
            if phase == 0:
                xdd, a = 0.0, self.stick(y[1:3], y[4:])[0]
            else:
                xdd, a, _ = self.slip(phase, y[1:3], y[4:])
            return np.array([y[3], y[4], y[5], xdd, *a])

        return rate

    def _change(self, phase, following):
        def guard(t, y):
            if following is None:
                return y[2] - y[1]
            if phase != 0:
                return phase * y[3]
            tangential, normal = self.stick(y[1:3], y[4:])[1]
            return self.mu * normal + following * tangential

        guard.direction = -1
        return guard


def _moment(arm, velocity):
    """Clockwise moment of a velocity."""
    return arm[1] * velocity[0] - arm[0] * velocity[1]
