"""The integration of a phase against scipy, and its path constraints against the contact force."""

import casadi as ca
import numpy as np
import pytest
from scipy.integrate import solve_ivp

from gaitopt import Mode, compass_biped
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics, rk4
from gaitopt.model.contacts.transition import Condition

ROBOT = compass_biped()
P = ROBOT.vector(ROBOT.resolve({"friction": 0.14}))
WEIGHT = 10 * 9.8  # two legs of 4 kg, a hip of 2 kg

STATES = {
    Mode.STICK: [-0.12, -0.14, 0.75, -0.5],
    Mode.SLIP_FORWARD: [-0.12, -0.14, 0.75, -0.5, 0.01, 0.3],
    Mode.SLIP_BACKWARD: [0.1, 0.12, 0.7, 0.2, -0.02, -0.4],
}
TORQUE, AFTER = np.array([1.0, -2.0]), np.array([-3.0, 4.0])
every_mode = pytest.mark.parametrize("mode", STATES)


def interval(mode, *, substeps=1, energy=False):
    stance = PhaseDynamics(ROBOT, mode)
    state = ca.SX.sym("state", stance.n_x + (3 if energy else 0))
    torque, after, step, p = (ca.SX.sym(s, n) for s, n in (("u", 2), ("after", 2), ("step", 1), ("p", len(P))))
    ends = stance.interval(state, torque, after, step, p, substeps=substeps, energy=energy)
    return ca.Function("interval", [state, torque, after, step, p], list(ends))


def reference(mode, until, step):
    """Return (state, works, friction loss) at a time of an interval of length `step`, integrated by scipy."""
    acceleration, rates = ROBOT.acceleration[mode], ROBOT.joint_rates

    def flow(t, y):
        q, v = np.array([0, 0, *y[:2]]), np.array([0, 0, *y[2:4]])
        if mode.slips:
            q[0], v[0] = y[4], y[5]
        torque = TORQUE + (AFTER - TORQUE) * t / step
        a, f = (np.asarray(part).ravel() for part in acceleration(q, v, torque, P))
        slide = [v[0], a[0]] if mode.slips else []
        power = torque * np.asarray(rates(q, v, P)).ravel()
        return [*v[2:], *a[2:], *slide, *power, -f[0] * v[0]]

    began = [*STATES[mode], 0, 0, 0]
    return solve_ivp(flow, (0, until), began, method="DOP853", rtol=1e-13, atol=1e-14).y[:, -1]


@every_mode
def test_states_works_and_losses_converge_to_scipy(mode):
    step = 0.05
    middle, end = interval(mode, substeps=48, energy=True)([*STATES[mode], 0, 0, 0], TORQUE, AFTER, step, P)
    assert np.asarray(middle).ravel() == pytest.approx(reference(mode, step / 2, step), abs=1e-10)
    assert np.asarray(end).ravel() == pytest.approx(reference(mode, step, step), abs=1e-10)


@every_mode
def test_substeps_converge_with_order_four(mode):
    step = 0.2
    exact = reference(mode, step, step)[: len(STATES[mode])]
    errors = []
    for substeps in (1, 2, 4):
        end = interval(mode, substeps=substeps)(STATES[mode], TORQUE, AFTER, step, P)[1]
        errors.append(np.max(np.abs(np.asarray(end).ravel() - exact)))
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    assert np.all(orders > 3.5), orders
    assert orders[-1] < 5


@every_mode
def test_energies_do_not_change_the_states(mode):
    plain = interval(mode)(STATES[mode], TORQUE, AFTER, 0.05, P)[1]
    carried = interval(mode, energy=True)([*STATES[mode], 1, 2, 3], TORQUE, AFTER, 0.05, P)[1]
    assert np.asarray(carried).ravel()[:-3] == pytest.approx(np.asarray(plain).ravel(), abs=1e-15)


def test_one_rk4_step_of_an_exponential_is_its_taylor_polynomial():
    x = ca.SX.sym("x")
    end = rk4(lambda state, _: state, x, (None, None, None), ca.SX(0.5))
    expected = 1 + 0.5 + 0.5**2 / 2 + 0.5**3 / 6 + 0.5**4 / 24
    assert float(ca.Function("e", [x], [end])(1.0)) == pytest.approx(expected, abs=1e-15)


def evaluated(expression, state, torque, p, margin=None):
    inputs = [state, torque, p] + ([margin] if margin is not None else [])
    return ca.Function("path", inputs, [expression])


def symbols(stance):
    return ca.SX.sym("state", stance.n_x), ca.SX.sym("u", 2), ca.SX.sym("p", len(P)), ca.SX.sym("margin")


def sticking_force(state):
    q, v = [0, 0, *state[:2]], [0, 0, *state[2:4]]
    return np.asarray(ROBOT.acceleration[Mode.STICK](q, v, TORQUE, P)[1]).ravel()


def test_the_cone_is_held_with_its_margin_on_both_sides():
    stance = PhaseDynamics(ROBOT, Mode.STICK)
    x, u, p, margin = symbols(stance)
    keys, values = stance.path(stance.flow(x, u, p)[1], p, margin)
    found = evaluated(values, x, u, p, margin)(STATES[Mode.STICK], TORQUE, P, 0.05)
    tangential, normal = sticking_force(STATES[Mode.STICK])
    scaled = tangential / (0.95 * 0.14)
    assert keys == [Condition.FORWARD_CONE, Condition.BACKWARD_CONE]
    assert np.asarray(found).ravel() == pytest.approx([(normal - scaled) / WEIGHT, (normal + scaled) / WEIGHT])


def test_without_a_friction_limit_the_cone_is_the_normal_force():
    stance = PhaseDynamics(ROBOT, Mode.STICK)
    x, u, p, margin = symbols(stance)
    unlimited = ROBOT.vector(ROBOT.resolve({}))
    found = evaluated(stance.path(stance.flow(x, u, p)[1], p, margin)[1], x, u, p, margin)(
        STATES[Mode.STICK], TORQUE, unlimited, 0.0
    )
    assert np.asarray(found).ravel() == pytest.approx([sticking_force(STATES[Mode.STICK])[1] / WEIGHT] * 2)


@pytest.mark.parametrize(("slip", "sign"), [(Mode.SLIP_FORWARD, 1), (Mode.SLIP_BACKWARD, -1)])
def test_a_slip_begins_with_the_sticking_force_on_its_side_of_the_cone(slip, sign):
    stance = PhaseDynamics(ROBOT, Mode.STICK)
    x, u, p, _ = symbols(stance)
    contact = stance.contact(x, ca.SX(0, 1), stance.flow(x, u, p)[1], p)
    conditions = ROBOT.contact_model.between(Mode.STICK, slip).conditions(Mode.STICK, contact)
    values = ca.vertcat(*(condition.value for condition in conditions))
    found = np.asarray(evaluated(values, x, u, p)(STATES[Mode.STICK], TORQUE, P)).ravel()
    tangential, normal = sticking_force(STATES[Mode.STICK])
    # slip+ needs f_t = -mu f_n, slip- needs f_t = +mu f_n (docs/physics.md)
    assert found == pytest.approx([(normal + sign * tangential / 0.14) / WEIGHT, normal / WEIGHT])
    assert (conditions[0].condition, conditions[0].equality) == (Condition.SLIP_ONSET, True)


@pytest.mark.parametrize("mode", [Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD])
def test_a_sliding_foot_only_presses(mode):
    stance = PhaseDynamics(ROBOT, mode)
    x, u, p, margin = symbols(stance)
    keys, values = stance.path(stance.flow(x, u, p)[1], p, margin)
    state = STATES[mode]
    found = evaluated(values, x, u, p, margin)(state, TORQUE, P, 0.0)
    q, v = [state[4], 0, *state[:2]], [state[5], 0, *state[2:4]]
    force = np.asarray(ROBOT.acceleration[mode](q, v, TORQUE, P)[1]).ravel()
    assert keys == [Condition.NORMAL_FORCE]
    assert float(found) == pytest.approx(force[1] / WEIGHT)


@every_mode
def test_joint_powers(mode):
    stance = PhaseDynamics(ROBOT, mode)
    x, u, p, _ = symbols(stance)
    found = evaluated(stance.power(x, u, p), x, u, p)(STATES[mode], TORQUE, P)
    th1_rate, th2_rate = STATES[mode][2:4]
    # The ankle works on th1, the hip on th1 + th2.
    assert np.asarray(found).ravel() == pytest.approx([1.0 * th1_rate, -2.0 * (th1_rate + th2_rate)])


@pytest.mark.parametrize("mode", [Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD])
def test_sampled_accelerations_are_those_of_the_forward_dynamics(mode, rng):
    robot, count = compass_biped(), 20
    dynamics, p = PhaseDynamics(robot, mode), robot.vector(robot.resolve({"friction": 0.2}))
    states, torques = rng.normal(size=(dynamics.n_x, count)), rng.normal(size=(robot.n_u, count))
    q, v = dynamics.full_samples(states)
    forward = robot.acceleration[mode].map(count)(q, v, torques, np.tile(p[:, None], count))[0].full()
    sampled = dynamics.sample_accelerations(states, torques, p)
    np.testing.assert_allclose(sampled, forward[dynamics.moving_entries], rtol=1e-11, atol=1e-11)


def test_sampled_accelerations_of_a_singular_mass_matrix_are_nan():
    robot = compass_biped()
    p = robot.vector({**robot.resolve({}), "leg_mass": 0.0, "hip_mass": 0.0})
    assert np.all(np.isnan(PhaseDynamics(robot, Mode.STICK).sample_accelerations(np.ones((4, 2)), np.zeros((2, 2)), p)))
