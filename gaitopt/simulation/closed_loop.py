"""A robot under a law in one contact mode, as numbers in and numbers out.

The state is y = (q, v), followed by what the law holds over a step; the same Functions the optimiser uses are composed
with the law's Function once per robot, mode and law form.
"""

import functools
from dataclasses import dataclass

import casadi as ca
import numpy as np

from gaitopt.control.law import Law, demand_torque, latched_size
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array

SLIP_GUARDS = ("painleve", "at rest", "lift-off", "touchdown", "fall")
STICK_GUARDS = ("lift-off", "slip+", "slip-", "touchdown", "fall")
"""Guards in order; where several fall through zero at once, the first counts.  In the paradox forces mean nothing."""


SWITCH = "switch "
"""How the names of guards begin at which not the contact but the law changes its form."""


@dataclass(frozen=True, eq=False)
class ClosedLoop:
    """The flow and the guards of one contact mode under one form of law.

    Attributes
    ----------
    mode : Mode
    guard_names : tuple of str
        The mode lasts while every guard is positive.
    active : tuple of int
        Entries of y that move in this mode; the others (a stuck foot, the height of a foot on the ground) rest.
    size : int
        Entries of y.
    flow : (t, y, p, data) -> dy/dt (size)
    energy : (t, y, p, data) -> power of each actuator, then friction loss rate (n_u + 1) [W]
    guards : (t, y, p, data) -> values, armed
        A touchdown counts only where `armed` is positive.
    """

    mode: Mode
    guard_names: tuple[str, ...]
    active: tuple[int, ...]
    size: int
    flow: ca.Function
    energy: ca.Function
    guards: ca.Function


def paradox_guard(wellposed: ca.SX, mode: Mode) -> ca.SX:
    """Return what stays positive while a slip mode is well posed.

    Near Painleve's paradox the contact force grows without bound and an integrator would creep for ever, so the guard
    falls through zero a little before: where the share of the mass that resists the slide is down to 1e-6.

    Parameters
    ----------
    wellposed : SX, shape (2, 1)
        Output of ``robot.wellposed``: for slip+ and slip-.
    mode : Mode
    """
    return wellposed[0 if mode.sign > 0 else 1] - 1e-6


@functools.lru_cache(maxsize=128)
def closed_loop(robot: Robot, mode: Mode, torque: ca.Function) -> ClosedLoop:
    """Return the closed loop of a robot, a mode and the Function of a law; composed once."""
    n = robot.n_q
    held = latched_size(torque)
    t, y = ca.SX.sym("t"), ca.SX.sym("y", 2 * n + held)
    p, data = ca.SX.sym("p", len(robot.parameters)), ca.SX.sym("data", torque.size1_in(3))
    q, v = y[:n], y[n : 2 * n]
    u, switches = demand_torque(torque, t, y, data, mode.sign)
    acceleration, force = robot.acceleration[mode](q, v, u, p)
    loss = -force[0] * v[0] if mode.slips else 0
    guard, _, armed = robot.touchdown(q, v, p)
    friction = p[robot.index("friction")]
    if mode.slips:
        own = [paradox_guard(robot.wellposed(q, p), mode), mode.sign * v[0], force[1]]
    else:
        # f_t falls to -mu f_n: slip forward; f_t rises to +mu f_n: slip backward (over 1 + mu, so mu may be 0 or inf).
        share = 1 / (1 + friction)
        tangential, normal = share * force[0], (1 - share) * force[1]
        own = [force[1], normal + tangential, normal - tangential]
    guards = ca.vertcat(*own, guard, robot.upright(q, p), switches)
    names = SLIP_GUARDS if mode.slips else STICK_GUARDS
    moving = [*([0] if mode.slips else []), *range(2, n)]

    def function(name: str, *outputs: ca.SX) -> ca.Function:
        return ca.Function(name, [t, y, p, data], ca.cse([ca.densify(ca.SX(e)) for e in outputs]))

    return ClosedLoop(
        mode=mode,
        guard_names=(*names, *(f"{SWITCH}{i}" for i in range(switches.numel()))),
        active=tuple(moving + [n + i for i in moving]),
        size=2 * n + held,
        flow=function("flow", ca.vertcat(v, acceleration, ca.SX.zeros(held))),
        energy=function("energy", ca.vertcat(u * robot.joint_rates(q, v, p), loss)),
        guards=function("guards", guards, armed),
    )


@functools.lru_cache(maxsize=128)
def demand_of(torque: ca.Function, mode: Mode) -> ca.Function:
    """Return (clock, y, data) -> torque of a law in a contact mode."""
    clock, y = ca.SX.sym("clock"), ca.SX.sym("y", 2 * torque.size1_in(1) + latched_size(torque))
    data = ca.SX.sym("data", torque.size1_in(3))
    return ca.Function("demand", [clock, y, data], [ca.densify(demand_torque(torque, clock, y, data, mode.sign)[0])])


def piece_shift(law: Law, before: Array) -> Array:
    """Return d (instant at which a law goes over into another piece) / d y, shape (n_y,).

    Zero where the clock tells the piece; else the entry of the state that does meets the bound that much earlier.

    Parameters
    ----------
    before : (n_y,) array
        dy/dt until then.
    """
    shift = np.zeros(before.size)
    if law.index is not None:
        shift[law.index] = -1 / before[law.index]
    return shift
