"""Checks that a law belongs to a robot."""

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.stated_changes import find_closing


def require_law(robot: Robot, law: object) -> Law:
    """Return the law of a robot with one foot on the ground at a time, or raise InputError."""
    if not isinstance(law, Law):
        raise InputError(f"law must be a Law such as feedforward(robot, gait.motion), got {law!r}.")
    if law.torque.size1_out(0) != robot.n_u or law.torque.size1_in(1) != robot.n_q:
        raise InputError(f"The law {law.name!r} does not belong to the robot {robot.name!r}.")
    return law


def require_planar_law(robot: PlanarRobot, law: object) -> PlanarLaw:
    """Return the law of a robot with several contacts, or raise InputError."""
    if not isinstance(law, PlanarLaw):
        raise InputError(
            f"law must be a PlanarLaw such as planar_feedforward(gait) for the robot {robot.name!r} with several "
            f"contacts, got {law!r}."
        )
    sizes = {(part.torque.size1_in(1), part.torque.size1_out(0)) for part in law.parts}
    if sizes != {(robot.n_q, robot.n_u)} or not set(find_closing([law.section])) & set(robot.contact_names):
        raise InputError(f"The law {law.name!r} does not belong to the robot {robot.name!r}.")
    return law
