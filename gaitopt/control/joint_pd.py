"""Joint PD feedback: reference torque plus corrections proportional to the errors of joint angles and rates."""

from collections.abc import Mapping

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.reference import reference
from gaitopt.control.signature import torque_function
from gaitopt.control.torque_saturation import limit_torque, torque_limits
from gaitopt.model.coordinate_entries import ANGLES
from gaitopt.model.robot import Robot
from gaitopt.model.robot_type import check_robot_type
from gaitopt.motion.motion import Motion


@check_arguments
def joint_pd(
    robot: Robot,
    motion: Motion,
    *,
    stiffness: float = 0.0,
    damping: float = 0.0,
    torque_limit: float | Mapping[str, float] = np.inf,
) -> Law:
    """Return the law u = u_ref(t) - K (joint angle - its reference) - D (joint rate - its reference), within limits.

    A joint angle is the angle on which an actuator does work; if it is not a linear function of the robot's angles, its
    error is linearised about the current state.  With zero gains the law is :func:`feedforward`.

    Parameters
    ----------
    robot : Robot
    motion : Motion
        Motion whose first step is the reference, with a clock reset at touchdown; its parameters are those of the
        law's model.
    stiffness : float [N m/rad]
    damping : float [N m s/rad]
        Gains of all joints; ``Law.with_gains`` sets the gains of one joint, for example ``"hip_stiffness"`` and
        ``"hip_damping"``.
    torque_limit : float or mapping of actuator to float [N m]

    Raises
    ------
    InputError
        If the motion belongs to another robot, or a limit is not positive.

    Examples
    --------
    >>> from gaitopt import compass_biped, joint_pd, load
    >>> law = joint_pd(compass_biped(), load("docs/examples/compass_slip.h5").motion, stiffness=20, damping=5)
    >>> list(law.gain_values)
    ['ankle_stiffness', 'hip_stiffness', 'ankle_damping', 'hip_damping']
    """
    check_robot_type(robot, Robot, "a Robot such as compass_biped()", "planar_joint_pd")
    plan, n_u = reference(robot, motion), robot.n_u
    p = robot.vector(motion.parameters)
    data = ca.SX.sym("data", plan.size + 2 * n_u)
    gains = data[plan.size :]

    def torque(clock: ca.SX, q: ca.SX, v: ca.SX) -> ca.SX:
        desired = plan.evaluate(clock, data)
        joints = actuation(robot, q, p).T
        error, rate = joints @ (q[ANGLES] - desired.angles), joints @ (v[ANGLES] - desired.rates)
        return desired.torque - gains[:n_u] * error - gains[n_u:] * rate

    names = [f"{actuator}_{kind}" for kind in ("stiffness", "damping") for actuator in robot.actuators]
    values = np.concatenate([np.full(n_u, float(stiffness)), np.full(n_u, float(damping))])
    law = plan.law("joint_pd", torque_function(robot, data, torque), values, names)
    return limit_torque(law, torque_limits(robot, torque_limit))


def actuation(robot: Robot, q: ca.SX, p: np.ndarray) -> ca.SX:
    """Return the map from torques to generalised forces of the angles in a configuration, shape (n_angles, n_u)."""
    return robot.dynamics(q, ca.SX.zeros(robot.n_q), p)[2][ANGLES, :]
