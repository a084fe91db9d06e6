"""The benchmark in CasADi's Opti: multiple shooting with RK4 and constant torques, expanded to SX."""

import casadi as ca

from tests.benchmarks.compass_equations import IMPULSE, STEP, accelerations, straight_line, touchdown


class Walker:
    """The compiled problem; each solve starts from the one before."""

    def __init__(self, intervals):
        opti = self.opti = ca.Opti()
        x = self.x = opti.variable(4, intervals + 1)
        u, impulse, speed = opti.variable(2, intervals), opti.variable(2), opti.parameter()
        self.impulse, self.speed, self.intervals, self.solved = impulse, speed, intervals, False
        h = STEP / speed / intervals

        def flow(x, u):
            return ca.vertcat(x[2], x[3], *accelerations(*ca.vertsplit(x), u[0], u[1], ca.sin, ca.cos))

        for k in range(intervals):
            k1 = flow(x[:, k], u[:, k])
            k2 = flow(x[:, k] + h / 2 * k1, u[:, k])
            k3 = flow(x[:, k] + h / 2 * k2, u[:, k])
            k4 = flow(x[:, k] + h * k3, u[:, k])
            opti.subject_to(x[:, k + 1] == x[:, k] + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4))
        last, first = ca.vertsplit(x[:, -1]), ca.vertsplit(x[:, 0])
        opti.subject_to(ca.vertcat(*touchdown(last, first, ca.vertsplit(impulse), ca.sin, ca.cos)) == 0)
        opti.minimize(h * ca.sumsqr(u))
        opti.solver("ipopt", {"expand": True, "print_time": False}, {"print_level": 0, "sb": "yes", "tol": 1e-8})

    def solve(self, speed):
        """Return the least integral of the squared torques."""
        opti = self.opti
        opti.set_value(self.speed, speed)
        if not self.solved:
            opti.set_initial(self.x, straight_line(self.intervals + 1, speed))
            opti.set_initial(self.impulse, IMPULSE)
        answer = opti.solve()
        opti.set_initial(answer.value_variables())
        opti.set_initial(opti.lam_g, answer.value(opti.lam_g))
        self.solved = True
        return float(answer.value(opti.f))
