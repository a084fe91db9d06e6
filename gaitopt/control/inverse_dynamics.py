"""Prescribed angles: the torques that move the angles as given, whether the foot sticks or slides."""

from collections.abc import Mapping

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.reference import reference
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Motion

STIFFNESS, DAMPING = 100.0, 20.0
"""With which deviations, that come from rounding only, are corrected [1/s^2, 1/s]."""


def prescribed_angles(robot: Robot, motion: Motion, parameters: Mapping[str, float]) -> Law:
    """Return the law that gives the angles of a motion's first step on any ground, by inverse dynamics.

    Parameters
    ----------
    robot : Robot
        With as many actuators as angles.
    motion : Motion
        Whose angles are prescribed; its own torques and ground do not matter.
    parameters : mapping of str to float
        Robot and ground walked on, all of them.

    Raises
    ------
    InputError
        If the robot has fewer actuators than angles, or the motion belongs to another robot.
    """
    plan, numbers = reference(robot, motion), nominal_parameters(robot, parameters)
    clock, q, v = ca.SX.sym("clock"), ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q)
    data, held, slide = ca.SX.sym("data", plan.size + numbers.size), ca.SX.sym("held", 0), ca.SX.sym("slide")
    desired = plan.desired(clock, data)
    error, rate = q[2:] - desired.angles, v[2:] - desired.rates
    asked = desired.accelerations - STIFFNESS * error - DAMPING * rate
    torque = ca.cse(inverse_dynamics(robot, q, v, data[plan.size :], asked, slide))
    inputs = [clock, q, v, data, held, slide]
    return plan.law("prescribed angles", ca.Function("torque", inputs, [torque]), numbers)


def inverse_dynamics(robot: Robot, q: ca.SX, v: ca.SX, p: ca.SX, asked: ca.SX, slide: ca.SX) -> ca.SX:
    """Return the torques that give the angles the accelerations asked for, shape (n_u, 1).

    A sticking foot rests, and the torques follow from the angles' own rows of the equations of motion.  A sliding foot
    is not driven: its acceleration a_x follows from those asked of the angles and from friction, s mu f_n against it,

        (M_xx + s mu M_yx) a_x + (M_xa + s mu M_ya) a_a + h_x + s mu h_y = 0,

    and enters the angles' rows, E u = M_ax a_x + M_aa a_a + h_a.

    Parameters
    ----------
    slide : SX
        s: 1 or -1 while the foot slides, 0 while it sticks, anything between to go over smoothly.
    """
    mass, bias, actuation = robot.dynamics(q, v, p)
    lean = slide * p[_place_of_friction(robot)]
    row, load = mass[0, :] + lean * mass[1, :], bias[0] + lean * bias[1]
    foot = -(slide**2) * (row[2:] @ asked + load) / row[0]
    return ca.solve(actuation[2:, :], mass[2:, 0] * foot + mass[2:, 2:] @ asked + bias[2:])


def nominal_parameters(robot: Robot, parameters: Mapping[str, float]) -> Array:
    """Return the parameters a law reckons with as numbers of its table, shape (n_p,).

    Raises
    ------
    InputError
        If the robot has fewer actuators than angles, so that its angles cannot be given accelerations at will.
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
