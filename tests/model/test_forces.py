"""Springs, dampers, potentials and rotors against closed forms."""

import casadi as ca
import numpy as np
import pytest

from gaitopt import Coordinates, InputError, Mode, Parameter, RigidLink, StepEnd, assemble, compass_biped
from gaitopt.model import Damper, Potential, RotorInertia, Spring, solve_impact
from tests.newton_euler.sprung_compass import HandSprungCompass
from tests.walkers.sprung_compass import sprung_compass

LENGTH, MASS, INERTIA, ROTOR, RATIO = 0.7, 3.0, 0.2, 2e-4, 30.0
PARAMETERS = [Parameter("gravity", 9.8, "m/s^2", "gravity")]


def link(*make):
    """Return a single link that turns about its foot, with forces along its angle."""
    c = Coordinates(["theta"], PARAMETERS)
    theta = c.angle("theta")
    centre = c.foot + LENGTH * ca.vertcat(ca.sin(theta), ca.cos(theta))
    return assemble(
        "link",
        c,
        bodies=[RigidLink(MASS, centre, INERTIA, theta)],
        step=StepEnd(landing=centre, touchdown=1 - theta, armed=theta, exchange=[-theta], upright=ca.cos(theta)),
        actuators={"ankle": theta},
        forces=[one(theta) for one in make],
    )


def acceleration(robot, angle, rate, torque=0.0):
    p = robot.vector(robot.resolve({"friction": np.inf}))
    return float(robot.acceleration[Mode.STICK]([0, 0, angle], [0, 0, rate], [torque], p)[0][2])


def test_the_kinetic_energy_of_a_link_with_a_rotor():
    robot = link(lambda s: RotorInertia(s, ROTOR, RATIO))
    p = robot.vector(robot.resolve({}))
    for angle, rate in [(0.0, 1.0), (0.4, -2.5), (-0.3, 0.7)]:
        kinetic = (INERTIA + MASS * LENGTH**2 + RATIO**2 * ROTOR) * rate**2 / 2
        assert float(robot.energy([0, 0, angle], [0, 0, rate], p)[0]) == pytest.approx(kinetic, rel=1e-14)


def test_a_rotor_behind_a_changing_gear():
    """Of a rotor along s(theta), s'' has a part that is quadratic in the rate: Lagrange's equation by hand."""
    robot = link(lambda s: RotorInertia(ca.sin(s), ROTOR, RATIO))
    for angle, rate in [(0.3, 1.0), (-0.5, 2.0)]:
        reflected = RATIO**2 * ROTOR
        inertia = INERTIA + MASS * LENGTH**2 + reflected * np.cos(angle) ** 2
        load = MASS * 9.8 * LENGTH * np.sin(angle) + reflected * np.cos(angle) * np.sin(angle) * rate**2
        assert acceleration(robot, angle, rate) == pytest.approx(load / inertia, rel=1e-13)


def test_accelerations_of_a_link_with_all_forces():
    robot = link(lambda s: Spring(s, 40.0, 0.1), lambda s: Damper(s, 1.5), lambda s: RotorInertia(s, ROTOR, RATIO))
    inertia = INERTIA + MASS * LENGTH**2 + RATIO**2 * ROTOR
    for angle, rate, torque in [(0.0, 1.0, 0.0), (0.4, -2.5, 3.0)]:
        load = torque + MASS * 9.8 * LENGTH * np.sin(angle) - 40 * (angle - 0.1) - 1.5 * rate
        assert acceleration(robot, angle, rate, torque) == pytest.approx(load / inertia, rel=1e-13)


def test_elastic_energy_and_dissipation():
    robot = link(lambda s: Spring(s, 40.0, 0.1), lambda s: Potential(2 * s**4), lambda s: Damper(2 * s, 1.5))
    p = robot.vector(robot.resolve({}))
    elastic, dissipation = robot.force_powers([0, 0, 0.3], [0, 0, -2.0], p)
    assert float(elastic) == pytest.approx(20 * 0.2**2 + 2 * 0.3**4, rel=1e-14)
    assert float(dissipation) == pytest.approx(1.5 * 4.0**2, rel=1e-14)
    potential = float(robot.energy([0, 0, 0.3], [0, 0, 0], p)[1])
    assert potential - float(elastic) == pytest.approx(MASS * 9.8 * LENGTH * np.cos(0.3), rel=1e-14)


@pytest.mark.parametrize(
    ("make", "springs", "dampers"),
    [
        ((), False, False),
        ((lambda s: Spring(s, 1.0),), True, False),
        ((lambda s: Potential(ca.cos(s)),), True, False),
        ((lambda s: Damper(s, 1.0),), False, True),
        ((lambda s: RotorInertia(s, 1.0),), False, False),
        ((lambda s: Spring(s, 1.0), lambda s: Damper(s, 1.0)), True, True),
    ],
)
def test_a_robot_states_what_it_has(make, springs, dampers):
    robot = link(*make)
    assert (robot.has_springs, robot.has_dampers) == (springs, dampers)
    assert robot.n_works == robot.n_u + 1 + dampers


def test_a_stiffness_that_is_a_parameter_is_a_spring_whatever_its_value():
    for robot, expected in ((sprung_compass("spring", "damper"), True), (compass_biped(), False)):
        assert robot.has_springs is expected
        assert robot.has_dampers is expected


def test_a_cosine_potential_is_a_spring_at_small_angles():
    """k (1 - cos s) has the moment k sin s = k s - k s^3 / 6 + ...: order and limit by Richardson extrapolation."""
    stiffness, spring, potential = (
        50.0,
        link(lambda s: Spring(s, 50.0)),
        link(lambda s: Potential(50 * (1 - ca.cos(s)))),
    )
    inertia = INERTIA + MASS * LENGTH**2
    angles = 0.4 / 2 ** np.arange(5)
    excess = np.array([acceleration(potential, s, 0.0) - acceleration(spring, s, 0.0) for s in angles]) * inertia
    assert np.log2(excess[:-1] / excess[1:]) == pytest.approx(3, abs=0.02)
    ratio = excess / angles**3  # k / 6 + O(s^2)
    once = (4 * ratio[1:] - ratio[:-1]) / 3
    twice = (16 * once[1:] - once[:-1]) / 15
    assert twice[-1] == pytest.approx(stiffness / 6, rel=1e-9)


@pytest.mark.parametrize(("friction", "sign"), [(0.5, 0), (0.1, 1)])
def test_the_impact_includes_the_reflected_inertia(friction, sign):
    """Impulses and rates after an impact by hand: the rotor takes up angular momentum of the trailing leg."""
    hand = HandSprungCompass(mu=friction, slope=0.02)
    robot = sprung_compass("spring", "damper", "rotor")
    q, v = np.array([0, 0, 0.15, 0.15]), np.array([0, 0, 0.7, -0.4])
    impact = solve_impact(robot, q, v, robot.vector(robot.resolve(hand.parameters)))
    after, impulse = hand.impact(q[2:], v, sign)
    assert impact.mode.sign == sign
    np.testing.assert_allclose(impact.v_plus, after, atol=1e-12)
    np.testing.assert_allclose(impact.impulse, impulse, atol=1e-12)
    light = compass_biped()
    values = {name: value for name, value in hand.parameters.items() if name in light.resolve({})}
    other = solve_impact(light, q, v, light.vector(light.resolve(values)))
    assert np.max(np.abs(impact.v_plus - other.v_plus)) > 1e-3


def test_a_force_in_other_symbols_is_refused():
    with pytest.raises(InputError, match="coordinate of force 1 depends on a symbol 'elsewhere'"):
        link(lambda s: Spring(ca.SX.sym("elsewhere"), 1.0))
    with pytest.raises(InputError, match="stiffness of force 2 depends on a symbol 'k'"):
        link(lambda s: Damper(s, 1.0), lambda s: Spring(s, ca.SX.sym("k")))
