"""Inverse dynamics: torques that produce prescribed angles, whether the foot sticks or slides."""

from collections.abc import Mapping

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.reference import reference
from gaitopt.control.signature import control_function, law_inputs
from gaitopt.errors import InputError
from gaitopt.model.coordinate_entries import ANGLES, GAP, SLIDE
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Motion
from gaitopt.motion.printable import format_count

STIFFNESS, DAMPING = 100.0, 20.0
"""Feedback gains that correct deviations due to rounding [1/s^2, 1/s]."""


def prescribed_angles(robot: Robot, motion: Motion, parameters: Mapping[str, float]) -> Law:
    """Return the law that reproduces the angles of a motion's first step on any ground by inverse dynamics.

    Parameters
    ----------
    robot : Robot
        Robot with as many actuators as angles.
    motion : Motion
        Motion with the prescribed angles; its torques and its ground are not used.
    parameters : mapping of str to float
        All parameters of the robot and of the ground.

    Raises
    ------
    InputError
        If the robot has fewer actuators than angles, or the motion belongs to another robot.
    """
    plan, numbers = reference(robot, motion), nominal_parameters(robot, parameters)
    inputs = law_inputs(robot, data=plan.size + numbers.size)
    clock, q, v, _, slide, data = inputs
    desired = plan.evaluate(clock, data)
    error, rate = q[ANGLES] - desired.angles, v[ANGLES] - desired.rates
    requested = desired.accelerations - STIFFNESS * error - DAMPING * rate
    torque = ca.cse(inverse_dynamics(robot, q, v, data[plan.size :], requested, slide))
    return plan.law("prescribed angles", control_function(inputs, torque), numbers)


def inverse_dynamics(robot: Robot, q: ca.SX, v: ca.SX, p: ca.SX, requested: ca.SX, slide: ca.SX) -> ca.SX:
    """Return the torques that produce the requested angular accelerations, shape (n_u, 1).

    If the foot sticks, the torques follow from the angles' rows of the equations of motion.  If the foot slides, its
    acceleration a_x follows from the requested angular accelerations a_a and from the friction force -s mu f_n,

        (M_xx + s mu M_yx) a_x + (M_xa + s mu M_ya) a_a + h_x + s mu h_y = 0,

    and enters the angles' rows E u = M_ax a_x + M_aa a_a + h_a.

    Parameters
    ----------
    slide : SX
        s: 1 or -1 while the foot slides, 0 while it sticks, values in between for a smooth transition.
    """
    mass, bias, actuation = robot.dynamics(q, v, p)
    signed_friction = slide * p[_index_of_friction(robot)]
    row = mass[SLIDE, :] + signed_friction * mass[GAP, :]
    load = bias[SLIDE] + signed_friction * bias[GAP]
    foot = -(slide**2) * (row[ANGLES] @ requested + load) / row[SLIDE]
    return ca.solve(actuation[ANGLES, :], mass[ANGLES, SLIDE] * foot + mass[ANGLES, ANGLES] @ requested + bias[ANGLES])


def nominal_parameters(robot: Robot, parameters: Mapping[str, float]) -> Array:
    """Return the parameters a model-based law uses, as numbers of its table, shape (n_p,).

    Raises
    ------
    InputError
        If the robot has fewer actuators than angles, so that the angular accelerations are not independent.
    """
    if robot.n_u != len(robot.angles):
        raise InputError(
            f"The law needs an actuator for each angle; {robot!r} has {format_count(robot.n_u, 'actuator')} and "
            f"{format_count(len(robot.angles), 'angle')}."
        )
    numbers = robot.vector(parameters)
    if np.isinf(numbers[_index_of_friction(robot)]):
        numbers[_index_of_friction(robot)] = 0.0  # with infinite friction no foot slides
    return numbers


def _index_of_friction(robot: Robot) -> int:
    return robot.index("friction")
