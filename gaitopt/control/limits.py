"""Torque limits of a law.

Where a torque meets its limit it has a kink, which an integrator should not step over.  So a law with limits can also
be written with the *side* of each actuator as a number: 0 where it gives what is demanded, 1 or -1 where it is held at
a limit.
"""

import functools
from collections.abc import Mapping
from dataclasses import replace

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.parameters import Parameter

UNLIMITED = 1e9
"""Limit [N m] of an actuator without one, beside others that have one."""


def torque_limits(robot: Robot, given: float | Mapping[str, float]) -> Array:
    """Return the limit of each actuator [N m], shape (n_u,); empty where none is limited.

    Raises
    ------
    InputError
        If a limit is not positive or names no actuator.
    """
    by_name = dict(given) if isinstance(given, Mapping) else dict.fromkeys(robot.actuators, given)
    for name in by_name:
        if name not in robot.actuators:
            raise InputError(f"torque_limit: there is no actuator {name!r}. {suggest(name, robot.actuators)}")
    values = [
        Parameter(f"torque_limit of {name}", np.inf, "N m", "", lower=0.0, lower_open=True, infinite=True).check(
            by_name.get(name, np.inf)
        )
        for name in robot.actuators
    ]
    return np.minimum(values, UNLIMITED) if np.any(np.isfinite(values)) else np.zeros(0)


def limit_torque(law: Law, limits: Array) -> Law:
    """Return a law whose torque keeps within limits [N m], shape (n_u,); the law itself where `limits` is empty."""
    if not limits.size:
        return law
    inputs = law.torque.sx_in()
    rows = ca.SX.sym("limits", limits.size)
    wider = [*inputs[:3], ca.vertcat(inputs[3], rows), *inputs[4:]]
    demand, *switches = law.torque.call(inputs)
    return replace(
        law,
        torque=ca.Function("torque", wider, [ca.fmin(ca.fmax(demand, -rows), rows), *switches]),
        table=np.vstack([law.table, np.tile(limits[:, None], law.breakpoints.size)]),
        demand=ca.Function("demand", wider, [demand, *switches]),
        hold=law.hold and _wider_latch(law.hold, rows),
    )


def _wider_latch(hold: ca.Function, rows: ca.SX) -> ca.Function:
    q, v, data = hold.sx_in()
    return ca.Function("hold", [q, v, ca.vertcat(data, rows)], [hold(q, v, data)])


@functools.lru_cache(maxsize=128)
def split_at_limits(demand: ca.Function) -> ca.Function:
    """Return the torque of a law with limits, and what stays positive while no actuator changes its side.

    What the demand's own second output keeps positive comes last.  Its data are those of `demand` followed by the side
    of each actuator.

    Parameters
    ----------
    demand : Function
        As in :class:`gaitopt.control.law.Law`.
    """
    inputs, n_u = demand.sx_in(), demand.size1_out(0)
    side, limits = ca.SX.sym("side", n_u), inputs[3][-n_u:]
    value, *switches = demand.call(inputs)
    free, held = 1 - side**2, side**2
    torque = free * value + side * limits
    beyond = free * (limits - value) + held * (side * value - limits)
    below = free * (limits + value) + held
    wider = [*inputs[:3], ca.vertcat(inputs[3], side), *inputs[4:]]
    return ca.Function("split_at_limits", wider, [torque, ca.vertcat(beyond, below, *switches)])
