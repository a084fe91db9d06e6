"""Step-to-step feedback: torques added for a whole step, chosen from the state after the touchdown."""

from collections.abc import Mapping

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.limits import limit_torque, torque_limits
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.model.section_coordinate import dependent_coordinate
from gaitopt.motion.motion import Array


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
    """Return a law with torques added that are held over windows of a step, w = -K (z - z*), within torque limits.

    z is the state after the touchdown: all angles but the one the touchdown fixes, rates, speed of the stance foot.

    Parameters
    ----------
    robot : Robot
    law : Law
        What the torques are added to: a law without limits that holds nothing itself.
    state : (n_z,) array
        z*.
    gains : (windows n_u, n_z) array
        K, actuator by actuator in each window.
    windows : int
        Equal parts of the step, the last of which never ends.
    duration : float [s]
        Of the step.
    torque_limit : float or mapping of actuator to float [N m]

    Raises
    ------
    InputError
        If the law has limits or holds values, or the gains have another shape.

    Examples
    --------
    >>> from gaitopt import compass_biped, passive, step_to_step
    >>> robot = compass_biped()
    >>> law = step_to_step(robot, passive(robot), np.zeros(4), np.zeros((4, 4)), windows=2, duration=0.7)
    >>> law.breakpoints
    array([0.  , 0.35])
    """
    n_q, n_u = robot.n_q, robot.n_u
    if law.hold is not None or law.demand is not None or law.index is not None:
        raise InputError(
            f"Step-to-step feedback is added to a law by the clock without limits that holds nothing, not {law.name!r}."
        )
    free = (entry for entry in range(2, n_q) if entry != 2 + dependent_coordinate(robot))
    places = [*free, *range(n_q + 2, 2 * n_q), n_q]
    state, gains = np.asarray(state, dtype=float), np.asarray(gains, dtype=float)
    if state.shape != (len(places),) or gains.shape != (windows * n_u, len(places)):
        raise InputError(
            f"Step-to-step feedback needs a state of {len(places)} entries and gains of shape "
            f"{(windows * n_u, len(places))}, got {state.shape} and {gains.shape}."
        )
    clock, q, v, inner, *rest = law.torque.sx_in()
    held, slide = ca.SX.sym("held", windows * n_u), rest[1] if rest else ca.SX.sym("slide")
    open_rows, numbers = ca.SX.sym("window", windows), ca.SX.sym("feedback", state.size + gains.size)
    data = ca.vertcat(inner, open_rows, numbers)
    base = law.torque.call([clock, q, v, inner, *([rest[0], slide] if rest else [])])[0]
    torque = base + ca.reshape(held, n_u, windows) @ open_rows
    error = ca.vertcat(q, v)[places] - numbers[: state.size]
    hold = -ca.reshape(numbers[state.size :], windows * n_u, len(places)) @ error
    begins = np.arange(windows) * duration / windows
    base_law = law.split(begins)
    times = base_law.breakpoints
    now = np.searchsorted(begins, times, side="right") - 1
    table = np.vstack(
        [
            base_law.table,
            (now == np.arange(windows)[:, None]).astype(float),
            np.tile(np.concatenate([state, gains.T.ravel()])[:, None], times.size),
        ]
    )
    added = Law(
        "step-to-step",
        ca.Function("torque", [clock, q, v, data, held, slide], [torque]),
        times,
        table,
        law.gains,
        ca.Function("hold", [q, v, data], [hold]),
    )
    return limit_torque(added, torque_limits(robot, torque_limit))
