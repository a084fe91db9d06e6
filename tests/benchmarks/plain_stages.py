"""The compass biped in stages, as structured solvers want it: states, controls, x_next - F(x, u), rows of one stage.

What is not of one stage only, the first state and the impulse, is carried along as states that do not change.  RK4 with
constant torques; with `limited` the absolute work of motors of 60 N m on friction 0.14, else squared torques.
"""

import itertools
import time

import casadi as ca
import numpy as np

from tests.benchmarks.compass_equations import (
    FIRST,
    GRAVITY,
    IMPULSE,
    MASS,
    SECOND,
    STEP,
    accelerations,
    straight_line,
    touchdown,
)

FRICTION, TORQUE, MARGIN, LEAST = 0.14, 60.0, 1e-4, 1e-2
N_X = 10
"""th1, th2 and their rates, the same of the first state, the impulse."""


def interval(step, *, limited):
    """Return the function (state, controls) -> next state, rows and cost, and the bounds of the rows."""
    x, u = ca.SX.sym("x", N_X), ca.SX.sym("u", 6 if limited else 2)  # torques, and the split power per weight

    def flow(q):
        return ca.vertcat(q[2], q[3], *accelerations(*ca.vertsplit(q), u[0], u[1], ca.sin, ca.cos))

    q = x[:4]
    k1 = flow(q)
    k2 = flow(q + step / 2 * k1)
    k3 = flow(q + step / 2 * k2)
    k4 = flow(q + step * k3)
    end = ca.vertcat(q + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4), x[4:])
    if not limited:
        return ca.Function("interval", [x, u], [end, ca.SX(0, 1), step * ca.sumsqr(u) / MASS]), [], []
    along = FIRST * ca.cos(q[0]) * q[2] + SECOND * ca.cos(q[1]) * q[3]
    up = SECOND * ca.sin(q[1]) * q[3] - FIRST * ca.sin(q[0]) * q[2]
    weight, push = MASS * GRAVITY, ca.jtimes(ca.vertcat(along, up), q, k1)
    normal, power = push[1] + weight, ca.vertcat(u[0] * q[2], u[1] * (q[2] + q[3]))
    inside = ca.vertcat(FRICTION * normal - push[0], FRICTION * normal + push[0], normal)
    rows = ca.vertcat(u[2:4] - u[4:] - power / weight, inside / weight)
    least, most = [0.0, 0.0, MARGIN, MARGIN, LEAST], [0.0, 0.0, np.inf, np.inf, np.inf]
    return ca.Function("interval", [x, u], [end, rows, ca.sum1(u[2:]) * step / STEP]), least, most


def landing(last, *, limited):
    """Return rows that make the last state, through the impact, end in the first one, and their bounds."""
    end, first, impulse = (ca.vertsplit(part) for part in ca.vertsplit(last, [0, 4, 8, N_X]))
    rows = ca.vertcat(*touchdown(end, first, impulse, ca.sin, ca.cos)) / ca.DM([1] * 4 + [MASS] * 4)
    if not limited:
        return rows, [0.0] * 8, [0.0] * 8
    edges = ca.vertcat(FRICTION * impulse[1] - impulse[0], FRICTION * impulse[1] + impulse[0])
    return ca.vertcat(rows, edges / MASS), [0.0] * 8 + [MARGIN] * 2, [0.0] * 8 + [np.inf] * 2


class Walker:
    """The compiled problem of a solver that CasADi knows by the name `plugin`."""

    def __init__(self, plugin, intervals, *, limited, speed=0.633):
        ends, least, most = interval(STEP / speed / intervals, limited=limited)
        n_u = ends.size1_in(1)
        stages = [ca.MX.sym(f"stage_{k}", N_X + n_u * (k < intervals)) for k in range(intervals + 1)]
        g, lower, upper, n_g = [], [], [], []

        def add(rows, low, high):
            g.append(rows)
            lower.extend(low)
            upper.extend(high)
            return len(low)

        cost = 0
        for stage, following in itertools.pairwise(stages):
            end, rows, share = ends(stage[:N_X], stage[N_X:])
            cost += share
            add(following[:N_X] - end, [0.0] * N_X, [0.0] * N_X)
            n_g.append(add(rows, least, most))
            if stage is stages[0]:
                n_g[0] += add(stage[:4] - stage[4:8], [0.0] * 4, [0.0] * 4)
        n_g.append(add(*landing(stages[-1], limited=limited)))
        sizes = {"N": intervals, "nx": [N_X] * (intervals + 1), "nu": [n_u] * intervals + [0], "ng": n_g}
        equal = [a == b for a, b in zip(lower, upper, strict=True)]
        own = {
            "ipopt": {"ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.tol": 1e-8, "ipopt.mu_strategy": "adaptive"},
            "fatrop": {"structure_detection": "manual", **sizes, "equality": equal, "fatrop.print_level": 0},
        }
        options = {"expand": True, "print_time": False, "record_time": True, **own[plugin]}
        problem = {"x": ca.vertcat(*stages), "f": cost, "g": ca.vertcat(*g)}
        self.solver = ca.nlpsol("walker", plugin, problem, options)
        self.arguments = {"lbg": lower, "ubg": upper, **start_and_bounds(intervals, n_u, speed, limited=limited)}

    def solve(self):
        """Return the optimum, the iterations, and the processor's seconds in all and outside the model's functions."""
        began = time.process_time()
        answer = self.solver(**self.arguments)
        seconds, stats = time.process_time() - began, self.solver.stats()
        assert stats["success"], stats
        functions = sum(value for name, value in stats.items() if name.startswith("t_proc_nlp_"))
        return float(answer["f"]), int(stats["iter_count"]), seconds, seconds - functions


def start_and_bounds(intervals, n_u, speed, *, limited):
    """Return the start and the bounds of all stages, in order."""
    line, limit, split = straight_line(intervals + 1, speed), TORQUE if limited else np.inf, n_u - 2
    x, low, high = [], [], []
    for k in range(intervals + 1):
        x += [*line[:, k], *line[:, 0], *IMPULSE]
        low += [-np.inf] * N_X
        high += [np.inf] * N_X
        if k < intervals:
            x += [0.0, 0.0, *[0.005] * split]
            low += [-limit, -limit, *[0.0] * split]
            high += [limit, limit, *[np.inf] * split]
    return {"x0": x, "lbx": low, "ubx": high}
