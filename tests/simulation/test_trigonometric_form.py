"""Lean robots accelerate as the robots they are made from, in fewer products."""

from collections import Counter

import casadi as ca
import numpy as np
import pytest

from gaitopt import Coordinates, Drawing, Mode, Parameter, RigidLink, StepEnd, assemble, compass_biped, rimless_wheel
from gaitopt.simulation.taylor.trigonometric_form import to_trigonometric_form

MODES = [Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD]
PARAMETERS = [
    Parameter(name, value, "1", name)
    for name, value in (("gravity", 9.8), ("length", 1.0), ("mass", 2.0), ("bend", 0.3))
]


def robot_of(angles, bodies, tip, c):
    return assemble(
        "own",
        c,
        bodies=bodies,
        step=StepEnd(
            landing=tip,
            touchdown=angles[-1],
            armed=angles[0],
            exchange=[-angle for angle in angles],
            upright=ca.cos(angles[0]),
        ),
        actuators={"first": angles[0]},
        drawing=Drawing({"foot": c.foot, "tip": tip}, [("foot", "tip")]),
        description="a test",
    )


def chain(count):
    """Return a robot of rigid links whose angles count from link to link, each link bent in its middle."""
    names = [f"a{i}" for i in range(count)]
    c = Coordinates(names, PARAMETERS)
    length, mass, bend = (c.parameter(name) for name in ("length", "mass", "bend"))
    tip, total, bodies = c.foot, ca.SX(0), []
    for name in names:
        total = total + c.angle(name)
        bodies.append(
            RigidLink(mass, tip + length * ca.vertcat(ca.sin(total + bend), ca.cos(total + bend)), 0.1, total)
        )
        tip = tip + 2 * length * ca.vertcat(ca.sin(total), ca.cos(total))
    return robot_of([c.angle(name) for name in names], bodies, tip, c)


def pulled():
    """Return a robot whose body slides along its leg as the leg turns: no wave."""
    c = Coordinates(["theta"], PARAMETERS)
    theta = c.angle("theta")
    tip = c.foot + (c.parameter("length") + theta) * ca.vertcat(ca.sin(theta), ca.cos(theta))
    return robot_of([theta], [RigidLink(1.0, tip, 0.5, theta)], tip, c)


ROBOTS = {"compass": compass_biped, "wheel": rimless_wheel, "chain": lambda: chain(3)}


def states(robot, rng, count=10):
    """Yield random states with parameters far from the defaults."""
    for _ in range(count):
        p = rng.uniform(0.3, 1.5, len(robot.parameters))
        q, v = rng.uniform(-2, 2, (2, robot.n_q))
        yield q, v, rng.normal(size=robot.n_u), p


def products(function):
    """Return how many products and quotients a Function takes of two results that depend on q, v or u."""
    moves, count = {}, Counter()
    for k in range(function.n_instructions()):
        operation, sources = function.instruction_id(k), function.instruction_input(k)
        if operation != ca.OP_OUTPUT:
            target = function.instruction_output(k)[0]
            if operation in (ca.OP_INPUT, ca.OP_CONST):
                moves[target] = operation == ca.OP_INPUT and sources[0] < 3
            else:
                count[operation] += all(moves[i] for i in sources)
                moves[target] = any(moves[i] for i in sources)
    return count[ca.OP_MUL] + count[ca.OP_DIV] + count[ca.OP_SQ]


@pytest.mark.parametrize("name", ROBOTS)
def test_lean_robots_accelerate_alike(name, rng):
    robot = ROBOTS[name]()
    slim = to_trigonometric_form(robot)
    assert slim is not robot
    assert slim is to_trigonometric_form(robot)
    for q, v, u, p in states(robot, rng):
        for mode in MODES:
            for one, other in zip(
                slim.acceleration[mode](q, v, u, p), robot.acceleration[mode](q, v, u, p), strict=True
            ):
                one, other = np.asarray(one), np.asarray(other)
                np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9 * np.abs(other).max())
        np.testing.assert_allclose(slim.wellposed(q, p), robot.wellposed(q, p), rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("name", "stick", "slip"), [("compass", 20, 30), ("wheel", 6, 9), ("chain", 60, 76)])
def test_less_is_left_to_do(name, stick, slip):
    robot = ROBOTS[name]()
    for mode, most in ((Mode.STICK, stick), (Mode.SLIP_FORWARD, slip)):
        assert products(to_trigonometric_form(robot).acceleration[mode]) <= most < products(robot.acceleration[mode])


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize(("mode", "which"), [(Mode.SLIP_FORWARD, 0), (Mode.SLIP_BACKWARD, 1)])
def test_the_guard_of_the_paradox_repeats_no_product_of_a_slip(name, mode, which):
    robot = to_trigonometric_form(ROBOTS[name]())
    q, v, u, p = robot.acceleration[mode].sx_in()
    outputs = [*robot.acceleration[mode](q, v, u, p), robot.wellposed(q, p)[which]]
    with_guard = ca.Function("slip", [q, v, u, p], ca.cse(outputs))
    assert products(with_guard) == products(robot.acceleration[mode])


def test_light_legs_lose_no_digits(rng):
    # The simplest walker: the legs' own equations are a millionth of the rest.
    robot = compass_biped()
    p = robot.vector(robot.resolve({"leg_mass": 1e-6, "hip_mass": 1, "leg_com": 0, "leg_length": 1, "gravity": 1}))
    for _ in range(10):
        q, v = (np.array([0, 0, *rng.uniform(-0.3, 0.3, 2)]) for _ in range(2))
        one, other = (
            np.asarray(r.acceleration[Mode.STICK](q, v, [0, 0], p)[0]) for r in (to_trigonometric_form(robot), robot)
        )
        np.testing.assert_allclose(one, other, rtol=1e-11)


def test_a_robot_that_is_no_sum_of_waves_stays_as_it_is():
    robot = pulled()
    assert to_trigonometric_form(robot) is robot
