"""The leg swap: a change of names, and its inverse."""

import numpy as np
import pytest

from gaitopt.model import solve_impact


def flat(output):
    return np.asarray(output).ravel()


def touchdown_state(robot, rng):
    if robot.name == "compass_biped":
        th = rng.uniform(0.05, 0.5)
        q = np.array([rng.normal(), 0.0, th, th])
    else:
        q = np.array([rng.normal(), 0.0, np.pi / 10])
    return q, rng.normal(size=robot.n_q)


@pytest.mark.parametrize("name", ["compass", "wheel"])
def test_unswap_undoes_swap(request, rng, name):
    robot = request.getfixturevalue(name)
    p = robot.vector(robot.resolve({}))
    for _ in range(20):
        q, v = touchdown_state(robot, rng)
        _, following = robot.swap(q, v, p)
        np.testing.assert_allclose(flat(robot.unswap(q, following, p)), v, rtol=1e-12, atol=1e-13)


@pytest.mark.parametrize("name", ["compass", "wheel"])
def test_swap_keeps_energy_and_momentum(request, rng, name):
    """The bodies do not move when the legs change names."""
    robot = request.getfixturevalue(name)
    p = robot.vector(robot.resolve({"slope": 0.1}))
    for _ in range(10):
        q, v = touchdown_state(robot, rng)
        following = [flat(part) for part in robot.swap(q, v, p)]
        for quantity in (robot.energy, robot.momentum):
            before, after = ([flat(part) for part in quantity(*state, p)] for state in ((q, v), following))
            for old, new in zip(before, after, strict=True):
                np.testing.assert_allclose(new, old, rtol=1e-12, atol=1e-12)


def test_compass_swap_exchanges_the_feet(compass, rng):
    p = compass.vector(compass.resolve({}))
    for _ in range(10):
        q, v = touchdown_state(compass, rng)
        q_next, v_next = (flat(part) for part in compass.swap(q, v, p))
        before, after = (np.asarray(compass.figure(state, p)) for state in (q, q_next))
        np.testing.assert_allclose(after, before[:, ::-1], atol=1e-14)
        np.testing.assert_allclose(q_next[2:], [-q[3], -q[2]], rtol=1e-15)
        np.testing.assert_allclose(v_next[2:], [-v[3], -v[2]], rtol=1e-15)


def test_wheel_swap_turns_back_by_the_angle_between_spokes(wheel):
    p = wheel.vector(wheel.resolve({"spokes": 8}))
    q_next, v_next = (flat(part) for part in wheel.swap([0, 0, np.pi / 8], [0, 0, 1.3], p))
    np.testing.assert_allclose(q_next[2:], [-np.pi / 8], rtol=1e-14)
    np.testing.assert_allclose(v_next[2:], [1.3], rtol=1e-15)


@pytest.mark.parametrize("name", ["compass", "wheel"])
def test_the_foot_rests_after_a_sticking_impact(request, rng, name):
    robot = request.getfixturevalue(name)
    p = robot.vector(robot.resolve({}))
    stuck = 0
    for _ in range(30):
        q, v = touchdown_state(robot, rng)
        v[:2] = 0.0
        if flat(robot.landing(q, v, p)[1])[1] >= 0:
            v = -v
        impact = solve_impact(robot, q, v, p)
        if impact.mode is not None:
            stuck += 1
            _, following = robot.swap(q, impact.v_plus, p)
            np.testing.assert_allclose(flat(following)[:2], 0.0, atol=1e-13)
    assert stuck > 10
