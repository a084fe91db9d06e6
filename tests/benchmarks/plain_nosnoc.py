"""The benchmark in nosnoc: Gauss-Legendre collocation with constant torques; nothing switches.

nosnoc starts from a fixed state, so the unknown first one is a global variable and states count from it.
"""

import casadi as ca
import nosnoc
import numpy as np

from tests.benchmarks.compass_equations import IMPULSE, STEP, accelerations, straight_line, touchdown


class Walker:
    """The compiled problem; each solve starts from the one before."""

    def __init__(self, intervals):
        moved, u, speed = ca.SX.sym("moved", 4), ca.SX.sym("u", 2), ca.SX.sym("speed")
        first, impulse = ca.SX.sym("first", 4), ca.SX.sym("impulse", 2)
        x, period = first + moved, STEP / speed
        rates = ca.vertcat(x[2], x[3], *accelerations(*ca.vertsplit(x), u[0], u[1], ca.sin, ca.cos))
        model = nosnoc.NosnocModel(
            x=moved,
            x0=np.zeros(4),
            f_x=[period * rates],
            alpha=[ca.SX.sym("alpha")],  # it must have a switch: one that is never used
            c=[ca.SX(1)],
            u=u,
            p_global=speed,
            p_global_val=np.array([0.633]),
            v_global=ca.vertcat(first, impulse),
        )
        landing = touchdown(ca.vertsplit(x), ca.vertsplit(first), ca.vertsplit(impulse), ca.sin, ca.cos)
        start = np.concatenate([straight_line(2, 0.633)[:, 0], IMPULSE])
        ocp = nosnoc.NosnocOcp(f_q=period * ca.sumsqr(u), g_terminal=ca.vertcat(*landing), v_global_guess=start)
        options = nosnoc.NosnocOpts(
            n_s=2,
            irk_scheme=nosnoc.IrkSchemes.GAUSS_LEGENDRE,
            N_stages=intervals,
            N_finite_elements=1,
            terminal_time=1.0,
            use_fesd=False,
            pss_mode=nosnoc.PssMode.STEP,
            initialization_strategy=nosnoc.InitializationStrategy.EXTERNAL,
        )
        self.solver = nosnoc.NosnocSolver(options, model, ocp)
        self.intervals, self.start = intervals, None

    def solve(self, speed):
        """Return the least integral of the squared torques."""
        self.solver.set("p_global", np.array([speed]))
        if self.start is None:
            line = straight_line(self.intervals + 1, speed)
            self.solver.set("x", (line - line[:, :1]).T[1:])
        else:
            self.solver.set("w", self.start)
        answer = self.solver.solve()
        assert self.solver.solver.stats()["success"]
        self.start = answer["w_sol"]
        return float(answer["cost_val"])
