"""Linear feedback of the whole state along a planar gait, with gains that change over the period."""

from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_feedback import find_section
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.control.planar_laws.planar_reference import PlanarReference, plan_impulses, planar_references
from gaitopt.control.signature import torque_function
from gaitopt.control.torque_saturation import limit_torque, torque_limits
from gaitopt.errors import InputError
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait


def planar_state_feedback(
    gait: PlanarGait,
    gains: Sequence[Array],
    *,
    torque_limit: float | Mapping[str, float] = np.inf,
    name: str = "state_feedback",
) -> PlanarLaw:
    """Return the law u = u_ref(t) - K(t) (y - y_ref(t)) with y = (q, v), within limits.

    Parameters
    ----------
    gait : PlanarGait
    gains : sequence of (K, 2, n_u, 2 n_q) arrays
        For each part of the period between two impacts, the gains at the start and the end of each of its K pieces, as
        :func:`planar_references` divides it; linear in between.
    torque_limit : float or mapping of actuator to float [N m or N]
    name : str
        Name of the law.

    Raises
    ------
    InputError
        If the gait is not a solution, or the gains have another shape.

    Examples
    --------
    >>> planar_state_feedback.__name__
    'planar_state_feedback'
    """
    section, robot, references = find_section(gait), gait.robot, planar_references(gait)
    shapes = [(plan.breakpoints.size, 2, robot.n_u, 2 * robot.n_q) for plan in references]
    if [np.shape(part) for part in gains] != shapes:
        raise InputError(f"The gains must have the shapes {shapes}, got {[np.shape(part) for part in gains]}.")
    parts = []
    for plan, part in zip(references, gains, strict=True):
        law = Law(name, _control(robot, plan), plan.breakpoints, np.vstack([plan.table, _rows(plan, part)]))
        parts.append(limit_torque(law, torque_limits(robot, torque_limit)))
    return PlanarLaw(name, section, tuple(parts), plan_impulses(gait))


def _rows(plan: PlanarReference, gains: Array) -> Array:
    """Return gains at the start of each piece and their rates of change, one column for each piece."""
    durations = np.append(np.diff(plan.breakpoints), np.inf)
    values = np.moveaxis(np.asarray(gains, dtype=float), 0, -1)
    flat = values.reshape(2, -1, durations.size, order="C")
    return np.vstack([flat[0], (flat[1] - flat[0]) / durations])


def _control(robot: PlanarRobot, plan: PlanarReference) -> ca.Function:
    """Return the control Function of the planned torques with feedback of the state."""
    n_u, n_y = robot.n_u, 2 * robot.n_q
    data = ca.SX.sym("data", plan.size + 2 * n_u * n_y)

    def torque(clock: ca.SX, q: ca.SX, v: ca.SX) -> ca.SX:
        start, rate = (ca.reshape(part, n_y, n_u).T for part in ca.vertsplit(data[plan.size :], n_u * n_y))
        error = ca.vertcat(q, v) - ca.vertcat(*plan.state(clock, data))
        return ca.cse(plan.torque(clock, data) - (start + (clock - data[0]) * rate) @ error)

    return torque_function(robot, data, torque)
