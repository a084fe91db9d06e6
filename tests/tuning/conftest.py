"""A gait with slipping impact and the laws that hold it."""

import pytest

from gaitopt import by_stance_angle, compass_biped, computed_torque, joint_pd, load, lqr, step_lqr

LAWS = {
    "joint_pd": lambda robot, motion: joint_pd(robot, motion, stiffness=20, damping=2, torque_limit=8),
    "computed_torque": lambda robot, motion: computed_torque(robot, motion, stiffness=25, damping=10, torque_limit=8),
    "lqr": lambda robot, motion: lqr(robot, motion, torque_limit=8),
    "step_lqr": lambda robot, motion: step_lqr(robot, motion, torque_limit=8),
}
BY_ANGLE = ("joint_pd", "step_lqr")
"""Of which there is another by the stance angle."""


@pytest.fixture(scope="session")
def slipping():
    return load("docs/examples/compass_slip.h5")


@pytest.fixture(scope="session", params=[*LAWS, *(f"{name} by th1" for name in BY_ANGLE)])
def law(request, slipping):
    name, _, angle = request.param.partition(" by ")
    robot = compass_biped()
    law = LAWS[name](robot, slipping.motion)
    return by_stance_angle(robot, slipping.motion, law) if angle else law
