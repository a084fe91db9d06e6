"""The compass biped on terrain, written by hand in the coordinates of its hip and integrated by scipy's solve_ivp.

One foot is on the ground at a time.  Nothing of gaitopt is used.
"""

from dataclasses import dataclass, field

import numpy as np
from scipy.integrate import solve_ivp

LENGTH, OFFSET, LEG, HIP, GRAVITY = 1.6, 0.8, 4.0, 2.0, 9.8
TOLERANCES = {"rtol": 1e-12, "atol": 1e-13}


@dataclass
class CompassOnTerrain:
    """A compass with stance leg s (0: A, 1: B) on ground of piecewise constant height and friction."""

    slope: float
    friction: float
    steps: tuple = ()
    patches: tuple = ()
    log: list = field(default_factory=list)

    def height(self, x):
        return sum(rise for place, rise in self.steps if place <= x)

    def coefficient(self, x):
        return next((mu for begin, end, mu in self.patches if begin <= x < end), self.friction)

    def mass_and_force(self, y):
        """Return the mass matrix and the forces of gravity and inertia, M a = force + contact."""
        angles, rates = y[2:4], y[6:8]
        mass = np.diag([HIP + 2 * LEG] * 2 + [LEG * OFFSET**2] * 2)
        pull = np.array([np.sin(self.slope), -np.cos(self.slope)]) * GRAVITY
        force = np.concatenate([(HIP + 2 * LEG) * pull, np.zeros(2)])
        for leg in range(2):
            s, c = np.sin(angles[leg]), np.cos(angles[leg])
            arm = OFFSET * np.array([c, s])  # derivative of OFFSET (sin, -cos)
            mass[:2, 2 + leg] = mass[2 + leg, :2] = LEG * arm
            force[:2] -= LEG * OFFSET * np.array([-s, c]) * rates[leg] ** 2
            force[2 + leg] = LEG * arm @ pull
        return mass, force

    def foot(self, y, leg):
        """Return position, Jacobian (tangential and normal row) and its rate times the velocity."""
        s, c, rate = np.sin(y[2 + leg]), np.cos(y[2 + leg]), y[6 + leg]
        rows = np.zeros((2, 4))
        rows[0, 0] = rows[1, 1] = 1.0
        rows[:, 2 + leg] = LENGTH * c, LENGTH * s
        return y[:2] + LENGTH * np.array([s, -c]), rows, LENGTH * rate**2 * np.array([-s, c])

    def accelerate(self, y, stance, sign, mu):
        """Return accelerations and force (f_t, f_n) of a foot that sticks (sign 0) or slips."""
        mass, force = self.mass_and_force(y)
        _, rows, bias = self.foot(y, stance)
        push = rows.T if not sign else (rows[1] - sign * mu * rows[0])[:, None]
        held = rows if not sign else rows[1:]
        n, m = 4, len(held)
        matrix = np.block([[mass, -push], [held, np.zeros((m, m))]])
        solution = np.linalg.solve(matrix, np.concatenate([force, -bias[2 - m :]]))
        contact = solution[n:] if not sign else solution[n] * np.array([-sign * mu, 1.0])
        return solution[:n], contact

    def land(self, y, foot, mu):
        """Return the velocity after the landing of a foot alone, and the direction in which it slips."""
        mass, _ = self.mass_and_force(y)
        rows, v = self.foot(y, foot)[1], y[4:]
        inverse = np.linalg.inv(mass)
        impulse = np.linalg.solve(rows @ inverse @ rows.T, -rows @ v)
        sign = 0
        if abs(impulse[0]) > mu * impulse[1]:
            sign = -int(np.sign(impulse[0]))
            direction = rows[1] - sign * mu * rows[0]
            size = -(rows[1] @ v) / (rows[1] @ inverse @ direction)
            return v + inverse @ direction * size, sign
        return v + inverse @ rows.T @ impulse, sign

    def walk(self, y, stance, landings):
        """Walk until a number of landings; log (time, event, y after it)."""
        t, sign = 0.0, 0
        piece = self.coefficient(self.foot(y, stance)[0][0])
        while landings:
            swing = 1 - stance
            guards = self.guards(y, stance, sign, piece)
            path = solve_ivp(
                self.flow, (t, t + 5), y, "DOP853", events=guards, args=(stance, sign, piece), **TOLERANCES
            )
            (number,) = [k for k, times in enumerate(path.t_events) if times.size]
            t, y = path.t[-1], path.y[:, -1].copy()
            if number == 0:
                place = self.foot(y, swing)[0][0]
                piece, stance, landings = self.coefficient(place), swing, landings - 1
                velocity, sign = self.land(y, swing, piece)
                y[4:] = velocity
                self.log.append((t, "lands", y.copy()))
            elif number == 1:
                slips = sign == 0
                sign = -int(np.sign(self.accelerate(y, stance, 0, piece)[1][0])) if slips else 0
                self.log.append((t, "slips" if slips else "rests", y.copy()))
            else:
                piece = self.coefficient(self.foot(y, stance)[0][0] + 1e-9 * sign)
                self.log.append((t, "crosses", y.copy()))
        return self.log

    def flow(self, _, y, stance, sign, mu):
        return np.concatenate([y[4:], self.accelerate(y, stance, sign, mu)[0]])

    def guards(self, start, stance, sign, piece):
        """Return the events: landing, begin or end of the slip, and the ends of patches for a foot that slips."""
        swing = 1 - stance

        def lands(_, y, *arguments):
            ahead = y[2 + swing] - y[2 + stance] > 1e-3
            place = self.foot(y, swing)[0]
            return place[1] - self.height(place[0]) if ahead else 1.0

        def changes(_, y, *arguments):
            if sign:
                return sign * self.foot(y, stance)[1][0] @ y[4:]
            tangential, normal = self.accelerate(y, stance, 0, piece)[1]
            return piece * normal - abs(tangential)

        events = [lands, changes]
        if sign:
            place = self.foot(start, stance)[0][0] + 1e-9 * sign
            for edge in {edge for patch in self.patches for edge in patch[:2] if sign * (edge - place) > 0}:
                events.append(lambda _, y, *arguments, edge=edge: sign * (edge - self.foot(y, stance)[0][0]))
        for event in events:
            event.terminal, event.direction = True, -1
        return events
