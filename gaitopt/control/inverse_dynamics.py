"""Inverse dynamics: the torques that move the angles as prescribed, whether the foot sticks or slides."""

from collections.abc import Mapping

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.reference import reference
from gaitopt.control.signature import control_function, law_inputs
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Motion

STIFFNESS, DAMPING = 100.0, 20.0
"""Feedback gains that correct deviations due to rounding [1/s^2, 1/s]."""


def prescribed_angles(robot: Robot, motion: Motion, parameters: Mapping[str, float]) -> Law:
    """Return the law that gives the angles of a motion's first step on any ground, by inverse dynamics.

    Parameters
    ----------
    robot : Robot
        With as many actuators as angles.
    motion : Motion
        Motion with the prescribed angles; its torques and ground do not matter.
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
    desired = plan.desired(clock, data)
    error, rate = q[2:] - desired.angles, v[2:] - desired.rates
    requested = desired.accelerations - STIFFNESS * error - DAMPING * rate
    torque = ca.cse(inverse_dynamics(robot, q, v, data[plan.size :], requested, slide))
    return plan.law("prescribed angles", control_function(inputs, torque), numbers)


def inverse_dynamics(robot: Robot, q: ca.SX, v: ca.SX, p: ca.SX, requested: ca.SX, slide: ca.SX) -> ca.SX:
    """Return the torques that give the angles the requested accelerations, shape (n_u, 1).

    A sticking foot rests, and the torques follow from the angles' rows of the equations of motion.  A sliding foot is
    not driven: its acceleration a_x follows from those requested of the angles and from friction, s mu f_n against it,

        (M_xx + s mu M_yx) a_x + (M_xa + s mu M_ya) a_a + h_x + s mu h_y = 0,

    and enters the angles' rows, E u = M_ax a_x + M_aa a_a + h_a.

    Parameters
    ----------
    slide : SX
        s: 1 or -1 while the foot slides, 0 while it sticks, values in between for a smooth transition.
    """
    mass, bias, actuation = robot.dynamics(q, v, p)
    lean = slide * p[_place_of_friction(robot)]
    row, load = mass[0, :] + lean * mass[1, :], bias[0] + lean * bias[1]
    foot = -(slide**2) * (row[2:] @ requested + load) / row[0]
    return ca.solve(actuation[2:, :], mass[2:, 0] * foot + mass[2:, 2:] @ requested + bias[2:])


def nominal_parameters(robot: Robot, parameters: Mapping[str, float]) -> Array:
    """Return the parameters a model-based law uses, as numbers of its table, shape (n_p,).

    Raises
    ------
    InputError
        If the robot has fewer actuators than angles, so that the angular accelerations cannot be chosen freely.
    """
    if robot.n_u != len(robot.angles):
        raise InputError(
            f"The law needs an actuator for each angle; {robot!r} has {robot.n_u} for {len(robot.angles)}."
        )
    numbers = robot.vector(parameters)
    if np.isinf(numbers[_place_of_friction(robot)]):
        numbers[_place_of_friction(robot)] = 0.0  # no foot will slide
    return numbers


def _place_of_friction(robot: Robot) -> int:
    return robot.index("friction")
