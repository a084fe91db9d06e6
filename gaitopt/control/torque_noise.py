"""Torque noise: random torques added to those of a law."""

import dataclasses

import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.signature import control_function, inputs_of, rewrite_memory
from gaitopt.control.torque_saturation import limit_torque, remove_limits
from gaitopt.motion.motion import Array


def add_torque_noise(law: Law, noise: Array, period: float) -> Law:
    """Return a law with torques added that are constant over equal parts of a step, before its limits.

    Parameters
    ----------
    law : Law
    noise : (n_u, n_parts) array [N m]
        Torques in equal parts of the step; the last part is unlimited.
    period : float [s]
        Duration of the step; a law with a phase variable has equal parts of its planned range instead.
    """
    parts = noise.shape[1]
    begin, end = (0.0, period) if not law.by_state else law.breakpoints[[1, -1]]
    starts = begin + np.arange(parts) * (end - begin) / parts
    demanded, limits = remove_limits(law)
    finer, rows = demanded.split(starts), demanded.table.shape[0]
    inputs = inputs_of(demanded.control, data=noise.shape[0])
    seen = inputs._replace(data=inputs.data[:rows])
    torque, bounds, guards = demanded.control(*seen)
    now = np.maximum(np.searchsorted(starts, finer.breakpoints, side="right") - 1, 0)
    changed = dataclasses.replace(
        finer,
        control=control_function(inputs, torque + inputs.data[rows:], bounds=bounds, guards=guards),
        table=np.vstack([finer.table, noise[:, now]]),
        memory=rewrite_memory(demanded.memory, inputs, seen),
    )
    return limit_torque(changed, limits)
