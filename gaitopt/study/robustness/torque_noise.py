"""Torque noise: a law with torques added that it knows nothing of."""

import dataclasses

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.limits import limit_torque
from gaitopt.motion.motion import Array


def add_torque_noise(law: Law, noise: Array, period: float) -> Law:
    """Return a law with torques added that are constant over equal parts of a step, before its limits.

    Parameters
    ----------
    law : Law
    noise : (n_u, n_parts) array [N m]
        The last part never ends.
    period : float [s]
        Of the step; a law that goes by an angle has equal parts of the planned angle instead.
    """
    n_u, parts = noise.shape
    begin, end = (0.0, period) if law.index is None else law.breakpoints[[1, -1]]
    starts = begin + np.arange(parts) * (end - begin) / parts
    demand, limits = law.demand or law.torque, law.table[law.table.shape[0] - n_u :, 0]
    rows = law.table.shape[0] - (n_u if law.demand is not None else 0)
    inputs, added = demand.sx_in(), ca.SX.sym("noise", n_u)
    inner = inputs[3] if law.demand is None else inputs[3][:rows]
    whole = inner if law.demand is None else ca.vertcat(inner, limits)
    torque, *switches = demand.call([*inputs[:3], whole, *inputs[4:]])
    finer = law.split(starts)
    now = np.maximum(np.searchsorted(starts, finer.breakpoints, side="right") - 1, 0)
    changed = dataclasses.replace(
        finer,
        torque=ca.Function("torque", [*inputs[:3], ca.vertcat(inner, added), *inputs[4:]], [torque + added, *switches]),
        table=np.vstack([finer.table[:rows], noise[:, now]]),
        demand=None,
        hold=law.hold and _shorter(law.hold, rows, n_u, limits),
    )
    return limit_torque(changed, limits) if law.demand is not None else changed


def _shorter(hold: ca.Function, rows: int, n_u: int, limits: Array) -> ca.Function:
    """Return what a law holds as a Function of its own rows and the noise's, which do not matter."""
    q, v, _ = hold.sx_in()
    data, added = ca.SX.sym("data", rows), ca.SX.sym("noise", n_u)
    whole = ca.vertcat(data, limits)[: hold.size1_in(2)]
    return ca.Function("hold", [q, v, ca.vertcat(data, added)], [hold(q, v, whole)])
