"""Step-to-step feedback: additional torques, latched once per step as a function of the state after touchdown."""

from collections.abc import Mapping
from dataclasses import replace

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.gain_matrix import GainMatrix
from gaitopt.control.law import Law
from gaitopt.control.signature import control_function, inputs_of, make_memory
from gaitopt.control.torque_saturation import limit_torque, torque_limits
from gaitopt.errors import InputError
from gaitopt.model.coordinate_entries import angle_entry
from gaitopt.model.robot import Robot
from gaitopt.model.section_coordinate import dependent_coordinate
from gaitopt.motion.motion import Array


@check_arguments
def step_to_step(
    robot: Robot,
    law: Law,
    state: Array,
    gains: Array,
    *,
    windows: int,
    duration: float,
    torque_limit: float | Mapping[str, float] = np.inf,
) -> Law:
    """Return a law with added torques w = -K (z - z*), constant over windows of a step, within torque limits.

    z is the state after the touchdown: all angles except the one determined by the touchdown condition, the rates, and
    the speed of the stance foot.

    Parameters
    ----------
    robot : Robot
    law : Law
        Law of the time since touchdown without torque limits and latched values, to which the torques are added.
    state : (n_z,) array
        z*.
    gains : (windows n_u, n_z) array
        K; in each window the rows follow the order of the actuators.
    windows : int
        Number of equal parts of the step; the last part has no end.
    duration : float [s]
        Duration of the step.
    torque_limit : float or mapping of actuator to float [N m]

    Raises
    ------
    InputError
        If the law has limits, latched values or a phase variable, or the gains have another shape.

    Examples
    --------
    >>> from gaitopt import compass_biped, passive, step_to_step
    >>> robot = compass_biped()
    >>> law = step_to_step(robot, passive(robot), np.zeros(4), np.zeros((4, 4)), windows=2, duration=0.7)
    >>> law.breakpoints
    array([0.  , 0.35])
    """
    n_u = robot.n_u
    _require_plain_law(law)
    entries, dependent = robot.state_entries, angle_entry(dependent_coordinate(robot))
    indices = [*(entry for entry in entries.angles if entry != dependent), *entries.rates, entries.slip_velocity]
    state, gains = np.asarray(state, dtype=float), np.asarray(gains, dtype=float)
    if state.shape != (len(indices),) or gains.shape != (windows * n_u, len(indices)):
        raise InputError(
            f"Step-to-step feedback needs a state of {len(indices)} entries and gains of shape "
            f"{(windows * n_u, len(indices))}, got {state.shape} and {gains.shape}."
        )
    inputs = inputs_of(law.control, data=windows + state.size + gains.size, latched=windows * n_u)
    ends = np.cumsum([0, law.table.shape[0], windows, state.size + gains.size]).tolist()
    inner, window, numbers = ca.vertsplit(inputs.data, ends)
    base, _, _ = law.control(*inputs._replace(latched=ca.SX(0, 1), data=inner))
    torque = base + ca.reshape(inputs.latched, n_u, windows) @ window
    error = ca.vertcat(inputs.q, inputs.v)[indices] - numbers[: state.size]
    latch = -ca.reshape(numbers[state.size :], windows * n_u, len(indices)) @ error
    base_law = law.split(np.arange(windows) * duration / windows)
    table = _table(base_law, windows, duration, np.concatenate([state, gains.T.ravel()]))
    names = [f"{actuator}_{window}" for window in range(windows) for actuator in robot.actuators]
    matrix = GainMatrix("K", tuple(names), _names(robot, indices), law.table.shape[0] + windows + state.size)
    added = replace(
        base_law,
        name="step_to_step",
        control=control_function(inputs, torque),
        table=table,
        memory=make_memory(inputs, latch, values=names),
        gain_matrices=(*law.gain_matrices, matrix),
    )
    return limit_torque(added, torque_limits(robot, torque_limit))


def _require_plain_law(law: Law) -> None:
    """Raise InputError if a law is limited, has latched values, or does not depend on the time since touchdown."""
    if law.index is not None:
        fault = "a phase variable; add them to the law of the time, and apply by_stance_angle to the result"
    elif law.limited:
        fault = "torque limits; omit them, and limit the sum by the argument torque_limit"
    elif law.memory.values:
        fault = "latched values; use a law without them"
    else:
        return
    raise InputError(
        f"Step-to-step feedback adds torques in intervals of time (windows), but the law {law.name!r} has {fault}."
    )


def _table(law: Law, windows: int, duration: float, numbers: Array) -> Array:
    """Return the table of a law with appended rows: 1 in the active window and 0 in the others, then the numbers."""
    active = np.searchsorted(np.arange(windows) * duration / windows, law.breakpoints, side="right") - 1
    rows = (active == np.arange(windows)[:, None]).astype(float)
    return np.vstack([law.table, rows, np.tile(numbers[:, None], law.breakpoints.size)])


def _names(robot: Robot, indices: list[int]) -> tuple[str, ...]:
    """Return the names of entries of the state (q, v)."""
    names = ["x", "y", *robot.angles, "foot_speed", "foot_height_rate", *(f"{angle}_rate" for angle in robot.angles)]
    return tuple(names[index] for index in indices)
