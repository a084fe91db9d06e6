"""The benchmark as a CasADi script tuned by hand: one mapped SX function, RK4 with constant torques, no copies."""

import casadi as ca
import numpy as np

from tests.benchmarks.compass_equations import IMPULSE, STEP, accelerations, straight_line, touchdown


def interval():
    """Return the function (state, torque, step) -> end of an interval."""
    x, u, h = ca.SX.sym("x", 4), ca.SX.sym("u", 2), ca.SX.sym("h")

    def flow(x):
        return ca.vertcat(x[2], x[3], *accelerations(*ca.vertsplit(x), u[0], u[1], ca.sin, ca.cos))

    k1 = flow(x)
    k2 = flow(x + h / 2 * k1)
    k3 = flow(x + h / 2 * k2)
    k4 = flow(x + h * k3)
    return ca.Function("interval", [x, u, h], [x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])


class Walker:
    """The compiled problem; each solve starts from the one before."""

    def __init__(self, intervals):
        speed, nodes = ca.MX.sym("speed"), ca.MX.sym("nodes", 6, intervals)
        last, impulse = ca.MX.sym("last", 4), ca.MX.sym("impulse", 2)
        states, torques = ca.horzcat(nodes[:4, :], last), nodes[4:, :]
        step = STEP / speed / intervals
        ends = interval().map(intervals, "serial")(states[:, :-1], torques, ca.repmat(step, 1, intervals))
        first = states[:, 0]
        landing = touchdown(ca.vertsplit(last), ca.vertsplit(first), ca.vertsplit(impulse), ca.sin, ca.cos)
        problem = {
            "x": ca.veccat(nodes, last, impulse),
            "p": speed,
            "f": step * ca.sumsqr(torques),
            "g": ca.vertcat(ca.vec(states[:, 1:] - ends), *landing),
        }
        options = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-8}
        self.solver = ca.nlpsol("walker", "ipopt", problem, {**options, "calc_lam_p": False})
        self.intervals, self.start = intervals, None

    def solve(self, speed):
        """Return the least integral of the squared torques."""
        if self.start is None:
            line = straight_line(self.intervals + 1, speed)
            nodes = np.vstack([line[:, :-1], np.zeros((2, self.intervals))])
            self.start = {"x0": np.concatenate([nodes.ravel(order="F"), line[:, -1], IMPULSE])}
        answer = self.solver(**self.start, p=speed, lbg=0, ubg=0)
        assert self.solver.stats()["success"], self.solver.stats()["return_status"]
        self.start = {"x0": answer["x"], "lam_g0": answer["lam_g"], "lam_x0": answer["lam_x"]}
        return float(answer["f"])
