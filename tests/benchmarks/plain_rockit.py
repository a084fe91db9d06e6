"""The benchmark in rockit: its multiple shooting with RK4 and constant torques, expanded to SX."""

import casadi as ca
from rockit import MultipleShooting, Ocp

from tests.benchmarks.compass_equations import IMPULSE, STEP, accelerations, straight_line, touchdown


class Walker:
    """The compiled problem; each solve starts from the one before."""

    def __init__(self, intervals):
        ocp = Ocp()
        speed = ocp.parameter()
        ocp.set_value(speed, 0.633)
        ocp.set_T(STEP / speed)
        x, u, impulse = ocp.state(4), ocp.control(2), ocp.variable(2)
        ocp.set_der(x, ca.vertcat(x[2], x[3], *accelerations(*ca.vertsplit(x), u[0], u[1], ca.sin, ca.cos)))
        last, first = ca.vertsplit(ocp.at_tf(x)), ca.vertsplit(ocp.at_t0(x))
        ocp.subject_to(ca.vertcat(*touchdown(last, first, ca.vertsplit(impulse), ca.sin, ca.cos)) == 0)
        ocp.add_objective(ocp.integral(ca.sumsqr(u)))
        options = {"expand": True, "print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": 1e-8}}
        ocp.solver("ipopt", options)
        ocp.method(MultipleShooting(N=intervals, M=1, intg="rk"))
        states = ocp.sample(x, grid="control")[1]
        torques, landing = ocp.sample(u, grid="control-")[1], ocp.value(impulse)
        found = [states, torques, landing]
        self.function = ocp.to_function("walk", [speed, *found], [ocp.value(ocp.objective), *found])
        self.intervals, self.before = intervals, None

    def solve(self, speed):
        """Return the least integral of the squared torques."""
        if self.before is None:
            self.before = [straight_line(self.intervals + 1, speed), 0, IMPULSE]
        objective, *self.before = self.function(speed, *self.before)
        assert self.function.stats()["success"]
        return float(objective)
