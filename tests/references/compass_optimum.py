"""Optimal gaits of the actuated compass biped without gaitopt, by an independent transcription.

Robot of tests/newton_euler on level ground, 0.633 m/s, 0.4713 m, torques within 6 N m, friction 0.14: least cost of
transport, the integral of the absolute actuator power per weight and travel, of the sequences "stick | stick" and
"slip+ stick | slip+".  Sticking force and sticking impulse keep a margin of 1e-3 to their cones.  Also the least
integral of squared torques of ten times the masses, where torques and friction are not limited.

Hermite-Simpson collocation with accelerations and contact forces as unknowns of Newton's equations, torques linear in
an interval and free to jump between intervals.  The torques are then replayed by event-driven integration, whose cost
needs no quadrature rule.
"""

import itertools
import math
from dataclasses import dataclass

import casadi as ca
import numpy as np

from tests.references.compass_passive import Compass
from tests.references.event_driven import take_step
from tests.references.storage import run

ROBOT = Compass(mu=0.14)
SPEED, STEP, TORQUE, MARGIN = 0.633, 0.4713, 6.0, 1e-3
PERIOD, WEIGHT, LENGTH = STEP / SPEED, ROBOT.total * ROBOT.gravity, ROBOT.length
STANCE, SWING = ROBOT._stance, ROBOT._swing  # first moments of what swings with each leg
CONE = (1 - MARGIN) * ROBOT.mu


def balance(q, v, a, force, torque):
    """Newton's law for all masses, and the moments on the two angles, which must vanish."""
    (_, th1, th2), (_, w1, w2), (xdd, a1, a2) = (ca.vertsplit(part) for part in (q, v, a))
    s1, c1, s2, c2 = ca.sin(th1), ca.cos(th1), ca.sin(th2), ca.cos(th2)
    m11 = ROBOT.mass * ROBOT.com**2 + (ROBOT.mass + ROBOT.hip) * LENGTH**2
    m22, coupling = ROBOT.mass * (LENGTH - ROBOT.com) ** 2, SWING * LENGTH
    m12, turn = coupling * ca.cos(th1 + th2), coupling * ca.sin(th1 + th2)
    along = ROBOT.total * xdd + STANCE * (c1 * a1 - s1 * w1**2) + SWING * (c2 * a2 - s2 * w2**2)
    upward = WEIGHT - STANCE * (s1 * a1 + c1 * w1**2) + SWING * (s2 * a2 + c2 * w2**2)
    moment1 = turn * w2**2 + STANCE * ROBOT.gravity * s1 + torque[0] + torque[1]
    moment2 = turn * w1**2 - SWING * ROBOT.gravity * s2 + torque[1]
    return ca.vertcat(
        along / WEIGHT - force[0],
        upward / WEIGHT - force[1],
        STANCE * c1 * xdd + m11 * a1 + m12 * a2 - moment1,
        SWING * c2 * xdd + m12 * a1 + m22 * a2 - moment2,
    )


def interval(mode, squared):
    """Return (node, next node, unknowns, duration) -> equalities, inequalities (>= 0), integral of the objective.

    Nodes are (q, v).  Unknowns: accelerations (3, 3) and forces per weight (2, 3) at start, middle and end, torques at
    start and end, and the positive and negative parts of both powers at the three points (4, 3).
    """
    node, following, z, h = ca.SX.sym("node", 6), ca.SX.sym("next", 6), ca.SX.sym("z", 31), ca.SX.sym("h")
    a, force = ca.reshape(z[:9], 3, 3), ca.reshape(z[9:15], 2, 3)
    torque = ca.horzcat(z[15:17], (z[15:17] + z[17:19]) / 2, z[17:19])
    power = ca.reshape(z[19:31], 4, 3)
    rates = [ca.vertcat(node[3:], a[:, 0]), None, ca.vertcat(following[3:], a[:, 2])]
    middle = (node + following) / 2 + h / 8 * (rates[0] - rates[2])
    rates[1] = ca.vertcat(middle[3:], a[:, 1])
    equal = [following - node - h / 6 * (rates[0] + 4 * rates[1] + rates[2])]
    above = []
    for k, point in enumerate((node, middle, following)):
        u, v = torque[:, k], point[3:]
        equal += [balance(point[:3], v, a[:, k], force[:, k], u)]
        equal += [u[0] * v[1] - power[0, k] + power[1, k], u[1] * (v[1] + v[2]) - power[2, k] + power[3, k]]
        if mode == 0:
            equal += [a[0, k]]
            above += [CONE * force[1, k] - force[0, k], CONE * force[1, k] + force[0, k]]
        else:
            equal += [force[0, k] + mode * ROBOT.mu * force[1, k]]
            above += [mode * v[0]]
    if squared:
        above, power = [], torque**2
    integral = h / 6 * ca.sum1(power[:, 0] + 4 * power[:, 1] + power[:, 2])
    return ca.Function("interval", [node, following, z, h], [ca.vertcat(*equal), ca.vertcat(*above), integral])


def touchdown(last, first, impulse, outcome):
    """Return equalities and inequalities of the impact that leads from the last node to the first of the next step.

    Momentum along and across the ground, angular momentum of the robot about the landing foot and of the trailing leg
    about the hip; the impulse is per weight.  The outcome is "stick", "slip" or, without friction limit, "free"
    (stick).
    """
    (x, th1, th2), (first1, first2) = ca.vertsplit(last[:3]), ca.vertsplit(first[1:3])
    s1, c1, s2, c2 = ca.sin(th1), ca.cos(th1), ca.sin(th2), ca.cos(th2)
    rates = ca.vertcat(-first[5], -first[4])
    # The old foot moves so that the landing foot has the velocity (first speed, 0).
    foot = ca.vertcat(first[3] - LENGTH * (c1 * rates[0] + c2 * rates[1]), LENGTH * (s1 * rates[0] - s2 * rates[1]))
    change = momenta(th1, th2, foot, rates) - momenta(th1, th2, ca.vertcat(last[3], 0), last[4:])
    equal = [first1 + th2, first2 + th1, first[0], th2 - th1, x + LENGTH * (s1 + s2) - STEP]
    equal += [change - ca.vertcat(WEIGHT * impulse, 0, 0)]
    above = [-1e-3 - (last[5] - last[4]), th1 - 1e-3, foot[1] - 1e-3]
    if outcome == "slip":
        equal += [impulse[0] + ROBOT.mu * impulse[1]]
    else:
        equal += [first[3]]
    if outcome == "stick":
        above += [CONE * impulse[1] - impulse[0], CONE * impulse[1] + impulse[0]]
    return ca.vertcat(*equal), ca.vertcat(*above)


def momenta(th1, th2, foot, rates):
    """Return momentum, and angular momentum of the robot about the swing foot and of the stance leg about the hip."""
    up, down = ca.vertcat(ca.sin(th1), ca.cos(th1)), ca.vertcat(ca.sin(th2), -ca.cos(th2))
    along, across = ca.vertcat(up[1], -up[0]), ca.vertcat(-down[1], down[0])
    hip, hip_velocity = LENGTH * up, foot + LENGTH * along * rates[0]
    rest = LENGTH - ROBOT.com
    bodies = [
        (ROBOT.mass, ROBOT.com * up, foot + ROBOT.com * along * rates[0]),
        (ROBOT.hip, hip, hip_velocity),
        (ROBOT.mass, hip + rest * down, hip_velocity + rest * across * rates[1]),
    ]
    landing = hip + LENGTH * down
    linear = sum(mass * velocity for mass, _, velocity in bodies)
    about_foot = sum(mass * moment(place - landing, velocity) for mass, place, velocity in bodies)
    mass, place, velocity = bodies[0]
    return ca.vertcat(linear, about_foot, mass * moment(place - hip, velocity))


def moment(arm, velocity):
    return arm[1] * velocity[0] - arm[0] * velocity[1]


@dataclass(frozen=True)
class Plan:
    """Optimal gait: objective, first node, times of the intervals' ends and torques at both ends of each."""

    objective: float
    first: np.ndarray
    times: np.ndarray
    torques: np.ndarray


class Programme:
    """The variables of the NLP with their start and bounds, by blocks."""

    def __init__(self):
        self.variables, self.start, self.lower, self.upper = [], [], [], []

    def add(self, size, columns, start, lower, upper):
        """Return a new block; start and bounds are those of a column, or of all, shape (columns, size)."""
        block = ca.MX.sym("block", size, columns)
        self.variables.append(ca.vec(block))
        for parts, values in ((self.start, start), (self.lower, lower), (self.upper, upper)):
            parts.append(np.broadcast_to(values, (columns, size)).ravel())
        return block

    def solve(self, objective, equal, above):
        """Return the variables and the solution."""
        x = ca.vertcat(*self.variables)
        quiet = {"print_time": False, "ipopt.print_level": 0, "ipopt.sb": "yes", "ipopt.max_iter": 3000}
        options = quiet | {"ipopt.tol": 1e-9, "ipopt.mu_strategy": "adaptive"}
        solver = ca.nlpsol("optimum", "ipopt", {"x": x, "f": objective, "g": ca.vertcat(equal, above)}, options)
        bounds = {"x0": self.start, "lbx": self.lower, "ubx": self.upper}
        bounds = {name: np.concatenate(parts) for name, parts in bounds.items()}
        ubg = np.concatenate([np.zeros(equal.numel()), np.full(above.numel(), math.inf)])
        answer = solver(**bounds, lbg=0, ubg=ubg)
        assert solver.stats()["success"], solver.stats()["return_status"]
        return x, answer


def optimise(modes, intervals, squared=False):
    """Return the optimal gait of a sequence of modes, 0 or +1, with so many intervals in each phase.

    The objective is the cost of transport, or the integral of the squared torques without limits of friction and
    torque.
    """
    programme, phases, begin = Programme(), [], 0.0
    for mode, count in zip(modes, intervals, strict=True):
        end = 0.03 if mode else 1.0
        phases.append(_add_phase(programme, mode, begin + (end - begin) * np.linspace(0, 1, count + 1), squared))
        begin = end
    impulse = programme.add(2, 1, [0.0, 0.1], [-math.inf, 0.0], math.inf)
    ends = phases[-1][0][:, -1], phases[0][0][:, 0]
    equal, above = touchdown(*ends, impulse, "free" if squared else "slip" if modes[0] else "stick")
    equal = [equal, sum(phase[2] for phase in phases) - PERIOD, *(phase[3][0] for phase in phases)]
    equal += [later[0][:, 0] - former[0][:, -1] for former, later in itertools.pairwise(phases)]
    above = ca.vertcat(above, *(phase[3][1] for phase in phases))
    objective = sum(phase[3][2] for phase in phases) / (1 if squared else WEIGHT * STEP)
    x, answer = programme.solve(objective, ca.vertcat(*equal), above)
    return _plan(x, phases, answer)


def _add_phase(programme, mode, shares, squared):
    """Return nodes, unknowns of the intervals, duration, and (equalities, inequalities, integral) of a phase."""
    q, v, period = passive_motion()
    guess = [[0.0, *q(s * period), 0.1 * (1 - s) if mode else 0.0, *v(s * period)] for s in shares]
    count, inf, angle = len(shares) - 1, math.inf, math.pi / 2
    most = inf if squared else TORQUE
    nodes = programme.add(6, count + 1, guess, [-1, -angle, -angle] + 3 * [-inf], [1, angle, angle] + 3 * [inf])
    lower, upper = [-inf] * 9 + [-inf, 0.01] * 3 + [-most] * 4 + [0] * 12, [inf] * 15 + [most] * 4 + [inf] * 12
    z = programme.add(31, count, [0.0] * 9 + [0.0, 1.0] * 3 + [0.0] * 4 + [0.1] * 12, lower, upper)
    duration = programme.add(1, 1, (shares[-1] - shares[0]) * PERIOD, 5e-3, PERIOD)
    steps = ca.repmat(duration / count, 1, count)
    equal, above, integral = interval(mode, squared).map(count)(nodes[:, :-1], nodes[:, 1:], z, steps)
    rest = nodes[3, -1] if mode else ca.MX(0, 1)
    return nodes, z, duration, (ca.vertcat(ca.vec(equal), rest), ca.vec(above), ca.sum2(integral))


def _plan(x, phases, answer):
    """Return the plan of a solution."""
    values = ca.Function("values", [x], [part for phase in phases for part in phase[:3]])(answer["x"])
    times, torques = [0.0], []
    for k in range(0, len(values), 3):
        count = values[k + 1].shape[1]
        times += list(times[-1] + float(values[k + 2]) / count * np.arange(1, count + 1))
        torques.append(np.array(values[k + 1])[15:19].T.reshape(count, 2, 2))
    return Plan(float(answer["f"]), np.array(values[0])[:, 0], np.array(times), np.concatenate(torques))


def passive_motion():
    """Return angles and rates of passive Gait A as functions of time, and its period: a start for the optimiser."""
    from scipy.interpolate import interp1d

    robot = Compass(slope=math.radians(1), mu=0.3)
    step = take_step(robot, robot.embed([-0.1478369, 0.7327968, -0.5006679]))
    times, index = np.unique(step.phases[0][1], return_index=True)
    states = step.phases[0][2][:, index]
    return interp1d(times, states[1:3]), interp1d(times, states[4:]), times[-1]


@dataclass(frozen=True)
class Driven(Compass):
    """The compass biped under planned torques; its state is extended by the time and the work of the actuators."""

    plan: Plan = None

    def motion(self, mode, y):
        plan, clock = self.plan, y[6]
        k = int(np.clip(np.searchsorted(plan.times, clock, side="right") - 1, 0, len(plan.torques) - 1))
        share = (clock - plan.times[k]) / (plan.times[k + 1] - plan.times[k])
        torque = (1 - share) * plan.torques[k][0] + share * plan.torques[k][1]
        if mode:
            xdd, a, (tangential, normal) = self.slip(mode, y[1:3], y[4:6], torque)
        else:
            xdd, (a, (tangential, normal)) = 0.0, self.stick(y[1:3], y[4:6], torque)
        power = abs(torque[0] * y[4]) + abs(torque[1] * (y[4] + y[5]))
        return np.array([*y[3:6], xdd, *a, 1.0, power]), tangential, normal

    def impact(self, y, mode):
        after, impulse = super().impact(y[:6], mode)
        return np.array([*after, *y[6:]]), impulse


def replay(plan):
    """Return sequence, error of the state after the step, and cost of transport of a plan's torques, event-driven."""
    robot = Driven(mu=ROBOT.mu, plan=plan)
    step = take_step(robot, np.array([*plan.first, 0.0, 0.0]))
    error = np.max(np.abs(step.after[1:6] - plan.first[1:]))
    return step.sequence, error, step.after[7] / (WEIGHT * STEP)


def sticking(intervals=80):
    """Least cost of transport of "stick | stick", planned and replayed."""
    return _costs(optimise((0,), (intervals,)))


def slipping(intervals=80):
    """Least cost of transport of "slip+ stick | slip+", planned and replayed."""
    return _costs(optimise((1, 0), (intervals // 4, intervals)))


def _costs(plan):
    sequence, error, cost = replay(plan)
    assert error < 3e-7, error
    return {"sequence": sequence, "cost_of_transport": plan.objective, "replayed_cost_of_transport": cost}


def torque_squared(intervals=80):
    """Least integral of squared torques [N^2 m^2 s] of legs of 40 kg and a hip of 20 kg."""
    return {"objective": 10**2 * optimise((0,), (intervals,), squared=True).objective}


COMPUTATIONS = {"sticking": (sticking, 2e-6), "slipping": (slipping, 2e-6), "torque_squared": (torque_squared, 5e-5)}
QUICK = ("sticking", "torque_squared")

if __name__ == "__main__":
    run("compass_optimum", COMPUTATIONS)
