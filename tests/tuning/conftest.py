"""A gait with slipping impact and the laws that hold it."""

import pytest

from gaitopt import compass_biped, computed_torque, joint_pd, load, lqr, step_lqr

LAWS = {
    "pd": lambda robot, motion: joint_pd(robot, motion, stiffness=20, damping=2, torque_limit=8),
    "computed torque": lambda robot, motion: computed_torque(robot, motion, stiffness=25, damping=10, torque_limit=8),
    "lqr": lambda robot, motion: lqr(robot, motion, torque_limit=8),
    "step-to-step": lambda robot, motion: step_lqr(robot, motion, torque_limit=8),
}


@pytest.fixture(scope="session")
def slipping():
    return load("docs/examples/compass_slip.h5")


@pytest.fixture(scope="session", params=LAWS)
def law(request, slipping):
    return LAWS[request.param](compass_biped(), slipping.motion)
