"""The sticking torque-squared gait as a plain CasADi script, the way one writes it by hand for this one robot.

Compass biped on level ground, sequence "stick | stick": multiple shooting with two RK4 steps per interval, torques
linear between nodes, friction cone at nodes and mid-interval, rigid impact with leg swap, fixed speed and step.
Nothing of gaitopt is used, so it is also an independent check of the optimum.
"""

import math
import time

import casadi as ca
import numpy as np

LENGTH, COM, LEG, HIP, GRAVITY = 1.6, 0.8, 4.0, 2.0, 9.8  # [m], [m], [kg], [kg], [m/s^2]
FRICTION, SPEED, STEP, TORQUE = 0.14, 0.633, 0.4713, 6.0  # [1], [m/s], [m], [N m]
CONE = 1 / ((1 - 1e-3) * FRICTION)  # both cones are kept with a margin of 1e-3

SHORT = LENGTH - COM
FIRST = LEG * COM + (HIP + LEG) * LENGTH  # first moment of what swings with the stance leg
MASS = 2 * LEG + HIP
WEIGHT = MASS * GRAVITY


def flow(x, u, cone=CONE):
    """Return the rate of (th1, th2, rates) and the cone's two sides, forces per weight."""
    th1, th2, w1, w2 = ca.vertsplit(x)
    s1, c1, s2, c2 = ca.sin(th1), ca.cos(th1), ca.sin(th2), ca.cos(th2)
    coupling = LEG * LENGTH * SHORT
    m11, m22 = LEG * COM**2 + (HIP + LEG) * LENGTH**2, LEG * SHORT**2
    m12, turn = coupling * ca.cos(th1 + th2), coupling * ca.sin(th1 + th2)
    r1 = u[0] + u[1] + turn * w2**2 + GRAVITY * FIRST * s1
    r2 = u[1] + turn * w1**2 - GRAVITY * LEG * SHORT * s2
    determinant = m11 * m22 - m12**2
    a1, a2 = (m22 * r1 - m12 * r2) / determinant, (m11 * r2 - m12 * r1) / determinant
    tangential = FIRST * (c1 * a1 - s1 * w1**2) + LEG * SHORT * (c2 * a2 - s2 * w2**2)
    normal = WEIGHT - FIRST * (s1 * a1 + c1 * w1**2) + LEG * SHORT * (s2 * a2 + c2 * w2**2)
    return ca.vertcat(w1, w2, a1, a2), ca.vertcat(normal - cone * tangential, normal + cone * tangential) / WEIGHT


def rk4(x, u0, u1, step):
    half = (u0 + u1) / 2
    k1 = flow(x, u0)[0]
    k2 = flow(x + step / 2 * k1, half)[0]
    k3 = flow(x + step / 2 * k2, half)[0]
    k4 = flow(x + step * k3, u1)[0]
    return x + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)


def interval():
    """Return (x, u, u after, step) -> end state, cones at start and middle, integral of the squared torques."""
    x, u0, u1, step = ca.SX.sym("x", 4), ca.SX.sym("u0", 2), ca.SX.sym("u1", 2), ca.SX.sym("step")
    half = (u0 + u1) / 2
    middle = rk4(x, u0, half, step / 2)
    cones = ca.vertcat(flow(x, u0)[1], flow(middle, half)[1])
    cost = step / 6 * (ca.sumsqr(u0) + 4 * ca.sumsqr(half) + ca.sumsqr(u1))
    return ca.Function("interval", [x, u0, u1, step], [rk4(middle, half, u1, step / 2), cones, cost])


def touchdown():
    """Return (last state, first state, impulse, travel, period, cone) -> equalities, inequalities (>= 0)."""
    last, first, impulse = ca.SX.sym("last", 4), ca.SX.sym("first", 4), ca.SX.sym("impulse", 2)
    travel, period, cone = ca.SX.sym("travel"), ca.SX.sym("period"), ca.SX.sym("cone")
    th1, th2, w1, w2 = ca.vertsplit(last)
    s1, c1, s2, c2 = ca.sin(th1), ca.cos(th1), ca.sin(th2), ca.cos(th2)
    coupling = LEG * LENGTH * SHORT * ca.cos(th1 + th2)
    mass = ca.vertcat(
        ca.horzcat(MASS, 0, FIRST * c1, LEG * SHORT * c2),
        ca.horzcat(0, MASS, -FIRST * s1, LEG * SHORT * s2),
        ca.horzcat(FIRST * c1, -FIRST * s1, LEG * COM**2 + (HIP + LEG) * LENGTH**2, coupling),
        ca.horzcat(LEG * SHORT * c2, LEG * SHORT * s2, coupling, LEG * SHORT**2),
    )
    landing = ca.vertcat(ca.horzcat(1, 0, LENGTH * c1, LENGTH * c2), ca.horzcat(0, 1, -LENGTH * s1, LENGTH * s2))
    # The landing foot rests after the impact, so the next step's rates give the old foot's velocity too.
    after = -ca.vertcat(first[3], first[2])
    foot = -landing[:, 2:] @ after
    momentum = mass @ (ca.vertcat(foot, after) - ca.vertcat(0, 0, w1, w2)) - landing.T @ impulse
    equal = ca.vertcat(
        first[:2] + ca.vertcat(th2, th1), momentum, th2 - th1, LENGTH * (s1 + s2) - travel, travel / period - SPEED
    )
    above = ca.vertcat(
        impulse[1] - cone * impulse[0], impulse[1] + cone * impulse[0], -1e-3 - (w2 - w1), th1 - 1e-3, foot[1] - 1e-3
    )
    return ca.Function("touchdown", [last, first, impulse, travel, period, cone], [equal, above])


def build(intervals):
    """Return solver, start and bounds."""
    nodes = ca.MX.sym("nodes", 6, intervals + 1)
    states, torques = nodes[:4, :], nodes[4:, :]
    period, impulse, travel = ca.MX.sym("period"), ca.MX.sym("impulse", 2), ca.MX.sym("travel")
    ends, cones, costs = interval().map(intervals)(
        states[:, :-1], torques[:, :-1], torques[:, 1:], ca.repmat(period / intervals, 1, intervals)
    )
    x, u = ca.SX.sym("x", 4), ca.SX.sym("u", 2)
    last_cone = ca.Function("cone", [x, u], [flow(x, u)[1]])(states[:, -1], torques[:, -1])
    equal, above = touchdown()(states[:, -1], states[:, 0], impulse, travel, period, CONE)
    zero = ca.vertcat(ca.vec(states[:, 1:] - ends), equal)
    positive = ca.vertcat(ca.vec(cones), last_cone, above)
    variables = ca.veccat(nodes, period, impulse, travel)
    options = {
        "print_time": False,
        "ipopt.print_level": 0,
        "ipopt.sb": "yes",
        "ipopt.tol": 1e-8,
        "ipopt.mu_strategy": "adaptive",
    }
    problem = {"x": variables, "f": ca.sum2(costs), "g": ca.vertcat(zero, positive)}
    solver = ca.nlpsol("plain", "ipopt", problem, options)

    angle, duration = math.asin(STEP / 2 / LENGTH), STEP / SPEED
    line = np.linspace(-angle, angle, intervals + 1)
    rate = np.full(intervals + 1, 2 * angle / duration)
    start = np.vstack([line, line, rate, rate, np.zeros((2, intervals + 1))]).flatten(order="F")
    limit = np.tile([math.pi / 2, math.pi / 2, math.inf, math.inf, TORQUE, TORQUE], intervals + 1)
    bounds = {
        "x0": np.concatenate([start, [duration, 0, 0.1 * WEIGHT, STEP]]),
        "lbx": np.concatenate([-limit, [5e-3, -math.inf, 0, STEP]]),
        "ubx": np.concatenate([limit, [10, math.inf, math.inf, STEP]]),
        "lbg": 0,
        "ubg": np.concatenate([np.zeros(zero.numel()), np.full(positive.numel(), math.inf)]),
    }
    return solver, bounds


def solve(intervals=20):
    """Return the optimal integral of the squared torques, iterations, and seconds to build and to solve."""
    began = time.perf_counter()
    solver, bounds = build(intervals)
    built = time.perf_counter()
    answer = solver(**bounds)
    done = time.perf_counter()
    assert solver.stats()["success"], solver.stats()["return_status"]
    return float(answer["f"]), solver.stats()["iter_count"], built - began, done - built


if __name__ == "__main__":
    print("integral of u'u dt {:.8f}, {} iterations, build {:.3f} s, solve {:.3f} s".format(*solve()))
