"""Time-varying feedback of the full state: angles, foot speed and rates."""

from collections.abc import Mapping

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.gain_matrix import GainMatrix
from gaitopt.control.law import Law
from gaitopt.control.reference import reference
from gaitopt.control.signature import torque_function
from gaitopt.control.torque_saturation import limit_torque, torque_limits
from gaitopt.errors import InputError
from gaitopt.model.coordinate_entries import ANGLES, SLIDE
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Motion


@check_arguments
def state_feedback(
    robot: Robot,
    motion: Motion,
    gains: Array,
    *,
    torque_limit: float | Mapping[str, float] = np.inf,
    name: str = "state feedback",
) -> Law:
    """Return the law u = u_ref(t) - K(t) (x - x_ref(t)) with x = (angles, foot speed, rates), within torque limits.

    Parameters
    ----------
    robot : Robot
    motion : Motion
        Motion whose first step is the reference, with a clock reset at touchdown.
    gains : (n_pieces, 2, n_u, 2 n_angles + 1) array
        K at the start and the end of each interval between two samples of the motion; it is linear in between and
        constant after the last sample.
    torque_limit : float or mapping of actuator to float [N m]
    name : str

    Raises
    ------
    InputError
        If the gains have another shape, or the motion belongs to another robot.

    Examples
    --------
    >>> from gaitopt import compass_biped, load, state_feedback
    >>> robot, motion = compass_biped(), load("docs/examples/compass_slip.h5").motion
    >>> pieces = sum(segment.time.size - 1 for segment in motion.segments)
    >>> state_feedback(robot, motion, np.zeros((pieces, 2, 2, 5))).name
    'state feedback'
    """
    plan, n_u = reference(robot, motion), robot.n_u
    n_x, pieces = 2 * len(robot.angles) + 1, plan.breakpoints.size - 1
    gains = np.asarray(gains, dtype=float)
    if gains.shape != (pieces, 2, n_u, n_x) or not np.all(np.isfinite(gains)):
        raise InputError(f"gains must be finite, of shape {(pieces, 2, n_u, n_x)}; got shape {gains.shape}.")
    count = n_u * n_x
    data = ca.SX.sym("data", plan.size + 2 * count)
    value, slope = (ca.reshape(part, n_u, n_x) for part in ca.vertsplit(data[plan.size :], count))

    def torque(clock: ca.SX, q: ca.SX, v: ca.SX) -> ca.SX:
        desired = plan.evaluate(clock, data)
        error = ca.vertcat(q[ANGLES] - desired.angles, v[SLIDE] - desired.foot_speed, v[ANGLES] - desired.rates)
        return desired.torque - (value + slope * (clock - data[0])) @ error

    steps = np.diff(plan.breakpoints)[:, None]
    begin, end = (gains[:, k].transpose(0, 2, 1).reshape(pieces, count) for k in (0, 1))  # column-major, as in CasADi
    rows = np.hstack([np.vstack([begin, end[-1:]]), np.vstack([(end - begin) / steps, np.zeros((1, count))])]).T
    states = (*robot.angles, "foot_speed", *(f"{angle}_rate" for angle in robot.angles))
    matrix = GainMatrix("K", tuple(robot.actuators), states, plan.size, plan.size + count)
    control, table = torque_function(robot, data, torque), np.vstack([plan.table, rows])
    law = Law(name, control, plan.breakpoints, table, gain_matrices=(matrix,))
    return limit_torque(law, torque_limits(robot, torque_limit))
