"""A gait with slipping impact and the laws that hold it."""

import functools

import pytest

from gaitopt import by_stance_angle, compass_biped, computed_torque, joint_pd, load, lqr, step_lqr

LAWS = {
    "joint_pd": lambda robot, motion: joint_pd(robot, motion, stiffness=20, damping=2, torque_limit=8),
    "computed_torque": lambda robot, motion: computed_torque(robot, motion, stiffness=25, damping=10, torque_limit=8),
    "lqr": lambda robot, motion: lqr(robot, motion, torque_limit=8),
    "step_lqr": lambda robot, motion: step_lqr(robot, motion, torque_limit=8),
}
BY_ANGLE = ("joint_pd", "step_lqr")
"""Those that also exist with the stance angle as their phase variable."""

DESIGNED = ("lqr", "step_lqr", "step_lqr by th1")
"""Laws whose design or simulation takes seconds; they count as slow tests."""

PARAMS = [
    pytest.param(name, marks=pytest.mark.slow if name in DESIGNED else ())
    for name in (*LAWS, *(f"{name} by th1" for name in BY_ANGLE))
]


@pytest.fixture(scope="session")
def slipping():
    return load("docs/examples/compass_slip.h5")


@pytest.fixture(scope="session")
def make_law(slipping):
    """Return a function that designs each law once: the design of step_lqr takes seconds."""
    return functools.cache(lambda name: LAWS[name](compass_biped(), slipping.motion))


@pytest.fixture(scope="session", params=PARAMS)
def law(request, slipping, make_law):
    name, _, angle = request.param.partition(" by ")
    law = make_law(name)
    return by_stance_angle(compass_biped(), slipping.motion, law) if angle else law
