"""Recursive and lifted Newton-Euler equations against those with a mass matrix, which other tests verify."""

import casadi as ca
import numpy as np
import pytest

from gaitopt.model.planar.joint_sums import find_joints
from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
from gaitopt.model.robots.kneed_walker import kneed_walker
from gaitopt.model.robots.monopod import monopod
from gaitopt.model.robots.round_foot_walker import round_foot_walker
from gaitopt.model.robots.vertical_hopper import vertical_hopper
from tests.ocp.multicontact_examples import five_link, flat_foot_hopper, walker_of

ROBOTS = {
    "compass": compass_with_two_feet,
    "kneed walker": kneed_walker,
    "monopod": monopod,
    "round feet": round_foot_walker,
    "hopper with a switched spring": vertical_hopper,
    "flat foot": flat_foot_hopper,
    "five links": five_link,
    "nine links": lambda: walker_of(9),
}


@pytest.fixture(params=ROBOTS)
def case(request):
    """A robot and a random state with accelerations, torques, contact forces and parameters."""
    robot, random = ROBOTS[request.param](), np.random.default_rng(0)
    q, v, a = random.normal(size=(3, robot.n_q))
    forces, p = random.normal(size=(2, len(robot.contacts))), robot.vector(robot.resolve({"slope": 0.1}))
    return robot, (q, v, a), random.normal(size=robot.n_u), forces, p


def motion(equations, state, u, forces, p, joints):
    q, v, a = state
    return [np.array(part) for part in equations.motion(q, v, u, a, forces, joints, p)]


def impact(equations, state, forces, p, joints):
    q, _, jump = state
    return np.array(equations.impact(q, jump, forces, joints, p)).ravel()


def solve_joints(residual, n, n_j):
    """Return the values of the joints for which the residual, which is linear in them, vanishes in its last rows."""
    start = residual(np.zeros(2 * n_j))[n:]
    matrix = np.column_stack([residual(unit)[n:] - start for unit in np.eye(2 * n_j)])
    return np.linalg.solve(matrix, -start)


@pytest.mark.parametrize("form", ["recursive", "lifted"])
def test_motion_is_that_of_the_mass_matrix(case, form):
    robot, (q, v, a), u, forces, p = case
    mass, bias, actuation = (np.array(part) for part in robot.dynamics(q, v, p))
    normal, tangent, normal_bias, tangent_bias = (np.array(part) for part in robot.rows(q, v, p))
    balance = mass @ a + bias.ravel() - actuation @ u - tangent.T @ forces[0] - normal.T @ forces[1]
    accelerations = [tangent @ a + tangent_bias.ravel(), normal @ a + normal_bias.ravel()]

    equations, n = getattr(robot, form), robot.n_q
    joints = np.zeros(0)
    if equations.n_j:
        joints = solve_joints(
            lambda values: motion(equations, (q, v, a), u, forces, p, values)[0].ravel(), n, equations.n_j
        )
    residual, contacts = motion(equations, (q, v, a), u, forces, p, joints)
    np.testing.assert_allclose(residual.ravel()[:n], balance, atol=1e-9)
    np.testing.assert_allclose(residual.ravel()[n:], 0, atol=1e-9)
    np.testing.assert_allclose(contacts, accelerations, atol=1e-10)


@pytest.mark.parametrize("form", ["recursive", "lifted"])
def test_impact_is_that_of_the_mass_matrix(case, form):
    robot, (q, v, jump), _, impulses, p = case
    normal, tangent = (np.array(part) for part in robot.rows(q, v, p)[:2])
    balance = np.array(robot.dynamics(q, v, p)[0]) @ jump - tangent.T @ impulses[0] - normal.T @ impulses[1]
    equations, n = getattr(robot, form), robot.n_q
    joints = np.zeros(0)
    if equations.n_j:
        joints = solve_joints(lambda values: impact(equations, (q, v, jump), impulses, p, values), n, equations.n_j)
    residual = impact(equations, (q, v, jump), impulses, p, joints)
    np.testing.assert_allclose(residual[:n], balance, atol=1e-9)
    np.testing.assert_allclose(residual[n:], 0, atol=1e-9)


def test_every_joint_of_a_leg_is_found():
    """Both coordinates of all joints but hip and foot, and of a foot with a contact only nothing."""
    assert five_link().lifted.n_j == 4
    assert [walker_of(links).lifted.n_j for links in (5, 9, 21)] == [4, 12, 36]
    assert five_link().recursive.n_j == 0


def test_lifted_rows_are_local_for_absolute_angles():
    """Nonzeros of the derivatives and operations grow linearly with the number of links, those of M quadratically."""
    counts = {}
    for links in (11, 21):
        robot = walker_of(links)
        jacobian = robot.lifted.motion.jacobian()
        counts[links] = [
            sum(jacobian.nnz_out(i) for i in range(jacobian.n_out())),
            robot.lifted.motion.n_instructions(),
            robot.dynamics.n_instructions(),
        ]
    growth = np.array(counts[21]) / np.array(counts[11])
    assert growth[0] < 2.05
    assert growth[1] < 2.05
    assert growth[2] > 2.5


def test_a_sum_that_occurs_once_and_the_argument_of_a_function_are_no_joints():
    a, b = ca.SX.sym("a"), ca.SX.sym("b")
    assert find_joints(ca.vertcat(a + b, ca.sin(a - b), ca.cos(a - b))).symbols.numel() == 0
    nested = a + ca.sin(b)
    sums = find_joints(ca.vertcat(nested, 2 - nested))
    assert sums.symbols.numel() == 1
    values = ca.Function("values", [a, b, sums.symbols], [sums.outputs, sums.definitions])(1, 2, 5)
    np.testing.assert_allclose(np.array(values[0]).ravel(), [5, -3])
    assert float(values[1]) == pytest.approx(1 + np.sin(2))
