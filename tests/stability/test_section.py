"""The section after a touchdown: which angle both feet on the ground fix, whatever the order of the angles."""

import casadi as ca
import numpy as np
import pytest

from gaitopt import (
    Collocation,
    Coordinates,
    Drawing,
    GaitProblem,
    Limits,
    Parameter,
    PointMass,
    RigidLink,
    StepEnd,
    assemble,
    assess_stability,
    passive,
    solve,
    step_to_step,
)
from gaitopt.simulation.scipy_engine import ScipyEngine
from gaitopt.stability.section import Section

ORDERS = (("stance", "swing", "torso"), ("torso", "stance", "swing"), ("stance", "torso", "swing"))


def torso_biped(order):
    """Return a compass biped with a torso, on which the touchdown condition does not depend."""
    c = Coordinates(order, [Parameter("gravity", 9.81, "m/s^2", "gravity", lower=0, lower_open=True)])
    stance, swing, torso = (c.angle(name) for name in ("stance", "swing", "torso"))
    leg, other = 0.8 * ca.vertcat(ca.sin(stance), ca.cos(stance)), 0.8 * ca.vertcat(ca.sin(swing), -ca.cos(swing))
    hip = c.foot + leg
    head = hip + 0.5 * ca.vertcat(ca.sin(torso), ca.cos(torso))
    after = {"stance": -swing, "swing": -stance, "torso": torso}
    return assemble(
        "torso_biped",
        c,
        bodies=[
            RigidLink(4.0, c.foot + leg / 2, 0.2, stance),
            PointMass(4.0, hip),
            PointMass(20.0, head),
            RigidLink(4.0, hip + other / 2, 0.2, -swing),
        ],
        step=StepEnd(
            landing=hip + other,
            touchdown=swing - stance,
            armed=stance,
            exchange=[after[name] for name in order],
            upright=ca.cos(stance),
        ),
        actuators={"stance hip": stance - torso, "swing hip": swing + torso},
        drawing=Drawing(
            {"stance foot": c.foot, "hip": hip, "swing foot": hip + other, "head": head},
            [("stance foot", "hip"), ("hip", "swing foot"), ("hip", "head")],
        ),
        description="compass biped with a torso",
    )


@pytest.mark.parametrize("order", ORDERS, ids=" ".join)
def test_both_feet_are_on_the_ground_and_the_torso_is_free(order, rng):
    robot = torso_biped(order)
    section = Section(robot, robot.vector(robot.resolve({})), sliding=True)
    assert "torso" in section.names
    z = -rng.uniform(0.1, 0.4, len(section.names))
    state, tangent = section.embed(z), section.tangent(z)
    assert np.all(section.project(state) == z)
    position = np.asarray(robot.landing(state[: robot.n_q], state[robot.n_q :], section.p)[0]).ravel()
    assert position[1] == pytest.approx(0, abs=1e-14)
    shifted = [(section.embed(z + step) - section.embed(z - step)) / 2e-6 for step in 1e-6 * np.eye(z.size)]
    assert tangent == pytest.approx(np.transpose(shifted), abs=1e-8)


def test_multipliers_do_not_depend_on_the_order_of_the_angles():
    moduli = []
    for order in ORDERS[::2]:
        problem = GaitProblem(
            robot=torso_biped(order),
            sequence="stick | stick",
            friction=0.6,
            speed=0.6,
            step_length=0.35,
            limits=Limits(torque=60),
            objective="torque_squared",
            transcription=Collocation(intervals=10),
        )
        cycle = assess_stability(solve(problem), engine=ScipyEngine())
        moduli.append(np.sort(np.abs(cycle.multipliers)))
    assert moduli[0] == pytest.approx(moduli[1], rel=1e-5, abs=1e-8)


@pytest.mark.parametrize("order", ORDERS, ids=" ".join)
def test_step_to_step_feedback_reads_the_coordinates_of_the_section(order):
    robot = torso_biped(order)
    section, gains = Section(robot, robot.vector(robot.resolve({})), sliding=True), np.eye(2, 6)
    law = step_to_step(robot, passive(robot), np.zeros(6), gains, windows=1, duration=0.5)
    state = np.zeros(2 * robot.n_q)
    state[section.places] = np.arange(1.0, 7.0)
    held = law.memory.latch(state[: robot.n_q], state[robot.n_q :], law.table[:, 0])
    assert np.asarray(held).ravel() == pytest.approx([-1.0, -2.0])
