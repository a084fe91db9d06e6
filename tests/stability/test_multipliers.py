"""Exact derivatives of return maps against finite differences, closed forms and published multipliers."""

import math

import numpy as np
import pytest

from gaitopt import InputError, compass_biped, rimless_wheel
from gaitopt.control.law import passive
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.scipy_engine import ScipyEngine
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.simulation.taylor.heyoka_engine import HeyokaEngine
from gaitopt.stability.cycle_search import find_cycle
from gaitopt.stability.linearisation import Linearisation
from tests.references.storage import MULTIPLIER_ACCURACY, complex_numbers, reference

from .conftest import COMPASS, GAITS, NATURAL_TIME, WHEEL


def central_differences(robot, parameters, gait, step=2e-5):
    """Return the derivative of the return map by fourth-order central differences (no variational equations)."""
    p = robot.vector(robot.resolve(parameters))
    walker, section = Walker(robot, passive(robot), p, ScipyEngine()), gait.section

    def image(z):
        return section.project(walker.walk_step(section.embed(z)).following)

    columns = []
    for unit in np.eye(gait.z.size):
        one, two = (image(gait.z + k * step * unit) - image(gait.z - k * step * unit) for k in (1, 2))
        columns.append((8 * one - two) / (12 * step))
    return np.array(columns).T


def test_exact_derivative_agrees_with_finite_differences(study_gait):
    robot, parameters, gait = study_gait
    numerical = central_differences(robot, parameters, gait)
    assert np.max(np.abs(numerical - gait.derivative)) < 1e-6 * max(1, np.max(np.abs(numerical)))


def test_both_engines_have_the_same_derivative(study_gait):
    pytest.importorskip("heyoka")
    robot, parameters, gait = study_gait
    walker = Walker(robot, passive(robot), robot.vector(robot.resolve(parameters)), HeyokaEngine())
    start = gait.z if gait.section.sliding else np.append(gait.z, gait.section.foot_speed)
    fast = find_cycle(walker, start)
    assert fast.sequence == gait.sequence
    assert fast.z == pytest.approx(gait.z, abs=1e-9)
    assert np.max(np.abs(fast.derivative - gait.derivative)) < 1e-8 * max(1, np.max(np.abs(gait.derivative)))


def test_gaits_of_both_robots_have_no_to_three_events(cycle):
    """Changes of mode between touchdowns, as each robot's contact sequences list them."""
    found = {(find[0]().name, len(cycle(find[0](), *find[1:]).sequences[0].phases) - 1) for find in GAITS.values()}
    assert found >= {(robot, events) for robot in ("compass_biped", "rimless_wheel") for events in range(4)}


def test_passive_gait_loses_what_gravity_gives(study_gait):
    robot, _, gait = study_gait
    p, given = robot.vector(gait.parameters), gait.parameters
    weight = float(robot.mass(p)) * given["gravity"]
    assert gait.energy.gravity == pytest.approx(weight * math.sin(given["slope"]) * gait.travel, rel=1e-9)
    assert gait.energy.relative_residual < 1e-9
    lost = gait.energy.impact_loss + gait.energy.friction_loss + gait.energy.kinetic_change
    assert lost == pytest.approx(gait.energy.gravity, rel=1e-9)


def test_fixed_point_is_fixed_to_rounding(study_gait):
    assert study_gait[2].residual < 1e-11


# Contact sequences, speeds (rad/tau_c) and multipliers: Gamus & Or (2015), digits as printed there.
@pytest.mark.parametrize(
    ("name", "sequence", "speed", "multiplier", "digits"),
    [
        ("wheel A, no event", "stick | stick", 0.876031, 0.734042, 5e-7),
        ("wheel B, one event", "stick slip+ | stick", 0.88075, 0.7623, 5e-5),
        ("wheel D, complete slip", "slip+ | slip+", 1.07204, 0.356, 5e-4),
    ],
)
def test_rimless_wheel_types(cycle, name, sequence, speed, multiplier, digits):
    robot, parameters, z = GAITS[name]
    gait = cycle(robot(), parameters, z)
    assert gait.sequence == sequence
    assert gait.z[0] * NATURAL_TIME == pytest.approx(speed, abs=max(digits / 10, 5e-7) if speed == 0.876031 else 5e-6)
    assert gait.multipliers[0] == pytest.approx(multiplier, abs=digits)


def test_rimless_wheel_sequences_over_friction(cycle):
    # Gamus & Or (2015): Type B begins its step with a slide below 0.2676; below 0.2450 its impact slips (Type C).
    sequences = {
        mu: cycle(rimless_wheel(), {**WHEEL, "friction": mu}, [2.39, 0]).sequence for mu in (0.268, 0.267, 0.2455)
    }
    assert sequences == {
        0.268: "stick slip+ | stick",
        0.267: "slip+ stick slip+ | stick",
        0.2455: "slip+ stick slip+ | stick",
    }
    assert cycle(rimless_wheel(), {**WHEEL, "friction": 0.2445}, [2.39, 0.01]).sequence == "slip+ stick slip+ | slip+"


def test_complete_slip_drifts_as_the_centre_of_mass_accelerates(cycle):
    robot, parameters, z = GAITS["wheel D, complete slip"]
    gait = cycle(robot(), parameters, z)
    # Newton's second law along the slope over a step: friction opposes the slide all the time, impact included.
    closed = 9.8 * gait.period * (math.sin(WHEEL["slope"]) - 0.3 * math.cos(WHEEL["slope"]))
    assert gait.drift == pytest.approx(closed, rel=1e-9)
    assert gait.drift * NATURAL_TIME == pytest.approx(-0.0517, abs=5e-5)  # Gamus & Or (2015), l/tau_c


def test_rimless_wheel_eigenvalue_is_four_ninths(cycle):
    # n = 6, kappa = 1/2: beta = (cos(2 pi / 6) + 1/2) / (1 + 1/2) = 2/3, multiplier beta^2; time unit sqrt(l / g).
    parameters = {"spokes": 6, "inertia_ratio": 0.5, "slope": 0.2, "gravity": 1.0}
    gait = cycle(rimless_wheel(), parameters, [0.46, 0])
    assert abs(gait.multipliers[0] - 4 / 9) < 1e-12
    assert gait.z[0] == pytest.approx(0.460341126609, abs=1e-12)  # energy balance in closed form


def check_against_reference(gait, name):
    """Compare a gait with tests/references/compass_passive.py: other equations, with two other integrators."""
    stored = reference("compass_passive", name)
    assert gait.sequence == stored["sequence"]
    assert gait.z == pytest.approx(stored["z"], abs=3 * stored["accuracy"])
    for quantity in ("period", "travel", "impact_ratio"):
        assert getattr(gait, quantity) == pytest.approx(stored[quantity], abs=3 * stored["accuracy"])
    expected = complex_numbers(stored["multipliers"])
    assert order_multipliers(gait.multipliers) == pytest.approx(expected, abs=2 * MULTIPLIER_ACCURACY)


def order_multipliers(values):
    """Return multipliers in the order of the references: by imaginary part, then by real part."""
    return np.array(sorted(values, key=lambda m: (round(m.imag, 6), m.real)))


def test_compass_gait_a(cycle):
    robot, parameters, z = GAITS["compass A, no event"]
    gait = cycle(robot(), parameters, z)
    check_against_reference(gait, "gait_a")
    critical = reference("compass_passive", "gait_a")["critical_friction"]
    assert gait.critical_friction.friction == pytest.approx(critical, abs=1e-9)
    assert gait.critical_friction.time == pytest.approx(0, abs=1e-9)


def test_compass_gaits_b_and_c(cycle):
    b, c = (cycle(GAITS[n][0](), *GAITS[n][1:]) for n in ("compass B, two events", "compass C, one event"))
    check_against_reference(b, "gait_b")
    check_against_reference(c, "gait_c")
    assert b.stable
    assert not c.stable


def test_goswami_compass(cycle):
    # Goswami et al.: m = 5, m_h = 10, l = 1, d = 0.5, slope 3 deg, g = 9.81.
    parameters = {"leg_mass": 5, "hip_mass": 10, "leg_length": 1, "leg_com": 0.5, "gravity": 9.81}
    gait = cycle(compass_biped(), {**parameters, "slope": math.radians(3)}, [-0.271, 1.092, -0.377, 0])
    check_against_reference(gait, "goswami")


def test_critical_friction_is_where_slipping_begins(cycle):
    gait = cycle(compass_biped(), {**COMPASS, "friction": 0.3}, GAITS["compass A, no event"][2])
    critical = gait.critical_friction.friction
    for factor, slips in ((1 + 1e-6, False), (1 - 1e-6, True)):
        sequence = cycle(compass_biped(), {**COMPASS, "friction": critical * factor}, [*gait.z, 0]).sequence
        assert ("slip" in sequence) is slips


def test_wheel_critical_friction(cycle):
    gait = cycle(rimless_wheel(), {**WHEEL, "friction": 1.0}, [2.4, 0])
    assert gait.critical_friction.friction == pytest.approx(0.914, abs=5e-4)  # Gamus & Or (2015)
    assert gait.critical_friction.state[2] == pytest.approx(math.pi / 10, abs=1e-9)  # at the end of the step
    assert gait.impact_ratio == pytest.approx(-0.2374, abs=5e-5)


def test_multiplier_of_a_wheel_that_only_just_rolls_over(cycle):
    """Type D 1e-6 above its least friction creeps over its spoke, where neighbouring motions part a million times."""
    parameters = {**WHEEL, "friction": 0.0799653719}
    gait = cycle(rimless_wheel(), parameters, [1.146228, 2.5])
    assert gait.sequence == "slip+ | slip+"
    assert gait.period > 4 * NATURAL_TIME
    numerical = central_differences(rimless_wheel(), parameters, gait, step=1e-6)
    assert gait.multipliers[0] == pytest.approx(numerical[0, 0], abs=1e-6)


def test_a_step_without_touchdown_has_no_derivative(cycle, wheel):
    gait = cycle(wheel, {**WHEEL, "friction": 1.0}, [2.4, 0])
    walker = Walker(
        wheel, passive(wheel), wheel.vector(gait.parameters), ScipyEngine(), step_limits=StepLimits(duration=0.01)
    )
    state = gait.section.embed(gait.z)
    with pytest.raises(InputError, match="only if it ends in a touchdown"):
        Linearisation(walker).derivative(state, walker.walk_step(state))
