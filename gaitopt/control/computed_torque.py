"""Computed torque: feedback that imposes linear error dynamics on the angles, in stick and in slip."""

from collections.abc import Mapping

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.inverse_dynamics import inverse_dynamics, nominal_parameters
from gaitopt.control.law import Law
from gaitopt.control.reference import reference
from gaitopt.control.signature import torque_function
from gaitopt.control.torque_saturation import limit_torque, torque_limits
from gaitopt.model.coordinate_entries import ANGLES, CONTACT, SLIDE
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Motion

NEAR_REST = 0.01
"""Foot speed [m/s] above which the law assumes that the foot slides."""


@check_arguments
def computed_torque(
    robot: Robot,
    motion: Motion,
    *,
    stiffness: float = 0.0,
    damping: float = 0.0,
    torque_limit: float | Mapping[str, float] = np.inf,
) -> Law:
    """Return the law that makes the angles' errors obey e'' + damping e' + stiffness e = 0, within torque limits.

    T(q, v, a) denotes the torques that produce the angular accelerations a in a state, by inverse dynamics with a
    resting foot in stick and a foot subject to friction in slip
    (:func:`gaitopt.control.inverse_dynamics.inverse_dynamics`):

        u = u_ref + T(q, v, a_ref - damping e' - stiffness e) - T(q_ref, v_ref, a_ref).

    All references are functions of the time since touchdown.  T changes smoothly from stick to slip while the foot
    accelerates; a torque that jumps at the onset of slip would cause chattering between stick and slip.  With zero
    gains the law equals the open loop only on the plan: away from it, the law still cancels the robot's dynamics.

    Parameters
    ----------
    robot : Robot
        Robot with as many actuators as angles.
    motion : Motion
        Motion whose first step is the reference; its parameters, friction included, are those of the law's model.
    stiffness : float [1/s^2]
    damping : float [1/s]
        Gains of all angles; ``Law.with_gains`` sets the gains of one angle, for example ``"th2_stiffness"``.
    torque_limit : float or mapping of actuator to float [N m]

    Raises
    ------
    InputError
        If the robot has fewer actuators than angles, or the motion belongs to another robot.

    Examples
    --------
    >>> from gaitopt import compass_biped, computed_torque, load
    >>> law = computed_torque(compass_biped(), load("docs/examples/compass_slip.h5").motion, stiffness=16, damping=8)
    >>> list(law.gain_values)
    ['th1_stiffness', 'th2_stiffness', 'th1_damping', 'th2_damping']
    """
    n_a, plan = len(robot.angles), reference(robot, motion)
    numbers = nominal_parameters(robot, motion.parameters)
    data = ca.SX.sym("data", plan.size + 2 * n_a + numbers.size)
    gains, p = data[plan.size : plan.size + 2 * n_a], data[plan.size + 2 * n_a :]

    def torque(clock: ca.SX, q: ca.SX, v: ca.SX) -> ca.SX:
        desired = plan.evaluate(clock, data)
        slide = v[SLIDE] / ca.sqrt(v[SLIDE] ** 2 + NEAR_REST**2)
        correction = -gains[:n_a] * (q[ANGLES] - desired.angles) - gains[n_a:] * (v[ANGLES] - desired.rates)
        current = inverse_dynamics(robot, q, v, p, desired.accelerations + correction, slide)
        planned_q = ca.vertcat(q[CONTACT], desired.angles)
        planned_v = ca.vertcat(v[CONTACT], desired.rates)
        planned = inverse_dynamics(robot, planned_q, planned_v, p, desired.accelerations, slide)
        return ca.cse(desired.torque + current - planned)

    values = np.concatenate([np.full(n_a, float(stiffness)), np.full(n_a, float(damping)), numbers])
    names = [f"{angle}_{kind}" for kind in ("stiffness", "damping") for angle in robot.angles]
    law = plan.law("computed_torque", torque_function(robot, data, torque), values, names)
    return limit_torque(law, torque_limits(robot, torque_limit))
