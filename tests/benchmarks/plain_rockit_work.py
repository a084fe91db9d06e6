"""The cost of transport in rockit: its multiple shooting with RK4, constant torques, powers split at nodes.

Friction is a parameter, so that a solve starts from the one before.
"""

import math

import casadi as ca
import numpy as np
from rockit import MultipleShooting, Ocp

from tests.benchmarks.plain_casadi import LENGTH, SPEED, STEP, TORQUE, WEIGHT, flow, touchdown
from tests.benchmarks.plain_opti_work import powers


class Walker:
    """The compiled problem; each solve starts from the one before."""

    def __init__(self, intervals):
        ocp = Ocp(T=STEP / SPEED)
        cone = ocp.parameter()
        ocp.set_value(cone, 1 / 0.14)
        x, u, parts, impulse = ocp.state(4), ocp.control(2), ocp.control(4), ocp.variable(2)
        rate, cones = flow(x, u, cone)
        ocp.set_der(x, rate)
        ocp.subject_to(cones >= 0)
        ocp.subject_to(parts[:2] - parts[2:] == powers(x, u), include_last=False)
        ocp.subject_to(parts >= 0, include_last=False)
        ocp.subject_to(ca.vertcat(TORQUE - u, TORQUE + u) >= 0)
        equal, above = touchdown()(ocp.at_tf(x), ocp.at_t0(x), impulse, STEP, STEP / SPEED, cone)
        ocp.subject_to(equal[:-1] == 0)
        ocp.subject_to(above >= 0)
        ocp.add_objective(ocp.integral(ca.sum1(parts)) / (WEIGHT * STEP))
        ipopt = {"print_level": 0, "sb": "yes", "tol": 1e-8, "mu_strategy": "adaptive"}
        ocp.solver("ipopt", {"expand": True, "print_time": False, "ipopt": ipopt})
        ocp.method(MultipleShooting(N=intervals, M=1, intg="rk"))
        samples = [ocp.sample(x, grid="control")[1], *(ocp.sample(y, grid="control-")[1] for y in (u, parts))]
        found = [*samples, ocp.value(impulse)]
        self.function = ocp.to_function("walk", [cone, *found], [ocp.value(ocp.objective), *found])
        angle = math.asin(STEP / 2 / LENGTH)
        line, rates = np.linspace(-angle, angle, intervals + 1), np.full(intervals + 1, 2 * angle * SPEED / STEP)
        self.before = [np.vstack([line, line, rates, rates]), 0, 0, [0, 0.1 * WEIGHT]]

    def solve(self, friction):
        """Return the least cost of transport."""
        objective, *self.before = self.function(1 / ((1 - 1e-3) * friction), *self.before)
        assert self.function.stats()["success"]
        return float(objective)
