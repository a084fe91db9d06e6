"""Five-link gaits whose touchdown slips or sticks, in CasADi's Opti: Lobatto points and projected end points.

The NLP has the unknowns and the rows of gaitopt's; the equations of motion are derived by CasADi from the energies.
"""

import casadi as ca
import numpy as np
from numpy.polynomial import Polynomial
from numpy.polynomial.legendre import Legendre

GRAVITY, LEG, LEFT, RIGHT = 9.81, 0.4, (3, 4), (5, 6)
MIRROR = [0, 1, 2, 5, 6, 3, 4]
SWAPPED_TORQUES = [2, 3, 0, 1]


def lobatto(count):
    """Return points on [0, 1], first and second integrals of their Lagrange polynomials."""
    inner = np.sort(np.real(Legendre.basis(count - 1).deriv().roots()))
    points = (1 + np.concatenate([[-1.0], inner, [1.0]])) / 2
    once, twice = np.empty((count, count)), np.empty((count, count))
    for j in range(count):
        others = np.delete(points, j)
        basis = Polynomial.fromroots(others) / np.prod(points[j] - others)
        once[:, j], twice[:, j] = basis.integ(1)(points), basis.integ(2)(points)
    return points, once, twice


def model():
    """Return Functions of the equations of motion, of the momentum and of the feet."""
    q, v, a, u = (ca.SX.sym(name, size) for name, size in (("q", 7), ("v", 7), ("a", 7), ("u", 4)))
    forces, hip, torso = ca.SX.sym("f", 2), q[:2], q[2]
    bodies = [(12.0, hip + 0.24 * ca.vertcat(ca.sin(torso), ca.cos(torso)), 1.33, torso)]
    feet, angles = [], []
    for thigh, knee in (LEFT, RIGHT):
        along = ca.vertcat(ca.sin(q[thigh]), -ca.cos(q[thigh]))
        below = ca.vertcat(ca.sin(q[thigh] - q[knee]), -ca.cos(q[thigh] - q[knee]))
        bodies += [(6.8, hip + 0.11 * along, 0.47, -q[thigh])]
        bodies += [(3.2, hip + LEG * along + 0.24 * below, 0.20, q[knee] - q[thigh])]
        feet.append(hip + LEG * along + LEG * below)
        angles += [q[thigh] + torso, q[knee]]
    kinetic = 0
    for mass, position, inertia, angle in bodies:
        kinetic += mass / 2 * ca.sumsqr(ca.jtimes(position, q, v)) + inertia / 2 * ca.jtimes(angle, q, v) ** 2
    potential = sum(mass * GRAVITY * position[1] for mass, position, _, _ in bodies)
    momentum = ca.gradient(kinetic, v)
    mass_matrix = ca.jacobian(momentum, v)
    bias = ca.jtimes(momentum, q, v) - ca.gradient(kinetic - potential, q)
    actuation = ca.jacobian(ca.vertcat(*angles), q).T
    rows = [ca.jacobian(foot, q) for foot in feet]
    residual = mass_matrix @ a + bias - actuation @ u - rows[0].T @ forces
    drift = ca.jtimes(rows[0] @ v, q, v)
    return {
        "motion": ca.Function("motion", [q, v, a, u, forces], [residual, rows[0] @ a + drift]),
        "mass": ca.Function("mass", [q], [mass_matrix]),
        "feet": ca.Function("feet", [q], [*feet, *rows]),
    }


class Gait:
    """The NLP of two phases, slip and stick of foot A, and the impact of foot B, which slips; or of stick alone."""

    def __init__(self, intervals, points, friction, speed, step, *, slips=True):
        self.opti, self.model, self.friction, self.slips = ca.Opti(), model(), friction, slips
        self.fractions, self.once, self.twice = lobatto(points)
        self.intervals, self.period = intervals, step / speed
        opti, nodes = self.opti, (1 + slips) * intervals + 1
        self.q, self.v, self.u = (opti.variable(size, nodes) for size in (7, 7, 4))
        self.durations, self.impulse = opti.variable(1 + slips), opti.variable(1 if slips else 2)
        self.cost, self.forces = 0, []
        for number, sticks in enumerate((False, True) if slips else (True,)):
            self.add_phase(number, sticks)
        self.add_touchdown()
        self.add_bounds(step)
        opti.minimize(self.cost)
        options = {"tol": 1e-8, "mu_strategy": "adaptive", "print_level": 0, "sb": "yes", "max_iter": 500}
        # Expansion to SX would take longer: 2.6 s instead of 1.9 s of build and solve with four points.
        opti.solver("ipopt", {"detect_simple_bounds": True, "print_time": False}, options)

    def add_phase(self, phase, sticks):
        """Add the intervals and the last node of a phase."""
        opti, count = self.opti, self.intervals
        rows, inner = 7 + 1 + sticks, len(self.fractions) - 2
        nodes, between = opti.variable(rows, count + 1), opti.variable(rows, count * inner)
        projections = opti.variable(2 * (1 + sticks), count)
        self.forces += [nodes[7:, :], between[7:, :]]
        opti.subject_to(ca.vec(nodes[7, :]) >= 0)
        opti.subject_to(ca.vec(between[7, :]) >= 0)
        h = self.durations[phase] / count
        for k in range(count):
            node = phase * count + k
            z = [nodes[:, k], *[between[:, k * inner + i] for i in range(inner)], nodes[:, k + 1]]
            accelerations = ca.horzcat(*[part[:7] for part in z])
            q, v, u, end = self.q[:, node], self.v[:, node], self.u[:, node], self.u[:, node + 1]
            states = []
            for i, fraction in enumerate(self.fractions):
                rate = v + h * (accelerations @ self.once[i])
                place = q + h * (fraction * v + h * (accelerations @ self.twice[i]))
                torque = u + fraction * (end - u)
                self.cost += h * self.once[-1][i] * ca.sumsqr(torque)
                states.append((place, rate, torque))
            for i in range(inner + 1):
                self.add_point(sticks, (*states[i], z[i]), is_first=k == 0 and i == 0)
            self.add_end(sticks, node, states[-1], projections[:, k])
        last = (phase + 1) * count
        self.add_point(sticks, (self.q[:, last], self.v[:, last], self.u[:, last], nodes[:, -1]), is_last=True)

    def add_point(self, sticks, point, *, is_first=False, is_last=False):
        """Add the equations of motion and the path constraints of an instant."""
        opti, (q, v, u, z) = self.opti, point
        tangential = z[8] if sticks else -self.friction * z[7]
        residual, acceleration = self.model["motion"](q, v, z[:7], u, ca.vertcat(tangential, z[7]))
        opti.subject_to(residual == 0)
        opti.subject_to((acceleration if sticks else acceleration[1]) == 0)
        _, other, rows, _ = self.model["feet"](q)
        if sticks:
            opti.subject_to(self.friction * z[7] + z[8] >= 0)
            opti.subject_to(self.friction * z[7] - z[8] >= 0)
        if not sticks and is_last:
            opti.subject_to(rows[0, :] @ v == 0)
        if not sticks and not is_first and not is_last:
            opti.subject_to(rows[0, :] @ v >= 0)
        if not (sticks and is_last) and not is_first:
            opti.subject_to(other[1] >= 0)

    def add_end(self, sticks, node, integral, projection):
        """Add the projected end point of an interval."""
        opti, q, v = self.opti, self.q[:, node + 1], self.v[:, node + 1]
        foot, _, rows, _ = self.model["feet"](q)
        before = self.model["feet"](self.q[:, node])[0]
        active = [1, 0] if sticks else [1]
        rows, m = rows[active, :], len(active)
        opti.subject_to(q == integral[0] + rows.T @ projection[:m])
        opti.subject_to(v == integral[1] + rows.T @ projection[m:])
        opti.subject_to(foot[1] == 0)
        if sticks:
            opti.subject_to(foot[0] == before[0])
        opti.subject_to(rows @ v == 0)

    def add_touchdown(self):
        """Add the impact of foot B, which slips forward or sticks, the lift-off of foot A, and the leg exchange."""
        opti, q, v, after = self.opti, self.q[:, -1], self.v[:, -1], self.v[:, 0][MIRROR]
        _, foot, trailing, rows = self.model["feet"](q)
        balance = self.model["mass"](q) @ (after - v)
        tangential, normal = (-self.friction * self.impulse, self.impulse) if self.slips else ca.vertsplit(self.impulse)
        opti.subject_to(balance == rows.T @ ca.vertcat(tangential, normal))
        opti.subject_to(rows[1, :] @ after == 0)
        opti.subject_to(rows[0, :] @ after >= 0 if self.slips else rows[0, :] @ after == 0)
        opti.subject_to(trailing[1, :] @ after >= 0)
        opti.subject_to(foot[1] == 0)
        opti.subject_to(rows[1, :] @ v <= -0.05)
        opti.subject_to(self.q[1:, 0] == q[MIRROR][1:])
        opti.subject_to(normal >= 0)
        if not self.slips:
            opti.subject_to(opti.bounded(-self.friction * normal, tangential, self.friction * normal))

    def add_bounds(self, step):
        """Add bounds of angles and durations, the speed and the step length."""
        opti = self.opti
        opti.subject_to(self.q[0, 0] == 0)
        opti.subject_to(self.q[0, -1] - self.q[0, 0] == step)
        opti.subject_to(ca.sum1(self.durations) == self.period)
        opti.subject_to(self.durations >= 5e-3)
        for row, lower, upper in ((2, -1, 1), (3, -1, 1.2), (4, 0.02, 2), (5, -1, 1.2), (6, 0.02, 2)):
            opti.subject_to(opti.bounded(lower, ca.vec(self.q[row, :]), upper))

    def solve(self, first, last, durations):
        """Return the least integral of squared torques and the iterations, from a line between two poses."""
        opti, count = self.opti, self.intervals
        steps = np.repeat(durations, count) / count
        time = np.concatenate([[0], np.cumsum(steps)])
        rates = (last - first) / durations.sum()
        opti.set_initial(self.q, first[:, None] + rates[:, None] * time)
        opti.set_initial(self.v, np.repeat(rates[:, None], time.size, axis=1))
        opti.set_initial(self.durations, durations)
        weight = GRAVITY * (12.0 + 2 * (6.8 + 3.2))
        for table in self.forces:
            opti.set_initial(table[0, :], weight)
        answer = opti.solve()
        return float(answer.value(opti.f)), int(answer.stats()["iter_count"])
