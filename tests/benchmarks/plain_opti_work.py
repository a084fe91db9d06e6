"""The cost of transport in CasADi's Opti: multiple shooting with RK4, torques linear between nodes, powers split.

At the nodes and in the middle of the intervals the joint powers are split into positive and negative parts, whose
integrals are the absolute work.  Friction is a parameter, so that a solve starts from the one before.
"""

import math

import casadi as ca
import numpy as np

from tests.benchmarks.plain_casadi import LENGTH, SPEED, STEP, TORQUE, WEIGHT, flow, rk4, touchdown


def powers(x, u):
    """Return the powers of ankle and hip."""
    return ca.vertcat(u[0] * x[2], u[1] * (x[2] + x[3]))


class Walker:
    """The compiled problem; each solve starts from the one before."""

    def __init__(self, intervals):
        opti = self.opti = ca.Opti()
        x, u = opti.variable(4, intervals + 1), opti.variable(2, intervals + 1)
        at_nodes, between = opti.variable(4, intervals + 1), opti.variable(4, intervals)
        impulse, cone = opti.variable(2), opti.parameter()
        h = STEP / SPEED / intervals
        self.cone = cone

        def split(parts, power):
            opti.subject_to(parts[:2] - parts[2:] == power)
            opti.subject_to(parts >= 0)

        for k in range(intervals):
            half = (u[:, k] + u[:, k + 1]) / 2
            middle = rk4(x[:, k], u[:, k], half, h / 2)
            opti.subject_to(x[:, k + 1] == rk4(middle, half, u[:, k + 1], h / 2))
            opti.subject_to(flow(middle, half, cone)[1] >= 0)
            split(between[:, k], powers(middle, half))
        for k in range(intervals + 1):
            opti.subject_to(flow(x[:, k], u[:, k], cone)[1] >= 0)
            split(at_nodes[:, k], powers(x[:, k], u[:, k]))
        opti.subject_to(opti.bounded(-TORQUE, ca.vec(u), TORQUE))
        equal, above = touchdown()(x[:, -1], x[:, 0], impulse, STEP, STEP / SPEED, cone)
        opti.subject_to(equal[:-1] == 0)
        opti.subject_to(above >= 0)
        work = h / 6 * ca.sum2(at_nodes[:, :-1] + 4 * between + at_nodes[:, 1:])
        opti.minimize(ca.sum1(work) / (WEIGHT * STEP))
        angle = math.asin(STEP / 2 / LENGTH)
        line = np.linspace(-angle, angle, intervals + 1)
        rate = np.full(intervals + 1, 2 * angle * SPEED / STEP)
        opti.set_initial(x, np.vstack([line, line, rate, rate]))
        opti.set_initial(impulse, [0, 0.1 * WEIGHT])
        options = {
            "print_level": 0,
            "sb": "yes",
            "tol": 1e-8,
            "mu_strategy": "adaptive",
            "warm_start_init_point": "yes",
        }
        opti.solver("ipopt", {"expand": True, "print_time": False}, options)

    def solve(self, friction):
        """Return the least cost of transport."""
        opti = self.opti
        opti.set_value(self.cone, 1 / ((1 - 1e-3) * friction))
        answer = opti.solve()
        opti.set_initial(answer.value_variables())
        opti.set_initial(opti.lam_g, answer.value(opti.lam_g))
        return float(answer.value(opti.f))
