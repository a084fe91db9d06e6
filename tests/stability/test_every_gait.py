"""The default search finds every known gait once, with its own period and multipliers."""

import math

import numpy as np
import pytest

from gaitopt import InputError, compass_biped, find_cycles, passive, rimless_wheel
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.cycle_iteration import find_cycle
from gaitopt.stability.deflation import Deflation, KnownPoint
from gaitopt.stability.section import Section

COMPASS, WHEEL = compass_biped(), rimless_wheel()
GOSWAMI = {"leg_mass": 5.0, "hip_mass": 10.0, "leg_length": 1.0, "leg_com": 0.5, "gravity": 9.81}


def find_on_slope(robot, degrees, friction=math.inf, **options):
    steps = {name: options.pop(name) for name in ("steps", "starts") if name in options}
    return find_cycles(robot, {**options, "slope": math.radians(degrees), "friction": friction}, **steps)


@pytest.mark.slow
@pytest.mark.parametrize("percent", range(10, 31))
def test_both_gaits_of_the_compass_are_found_at_every_friction_of_the_study(percent):
    # Gamus & Or 2015: Gait A sticks above friction 0.17492, Gait B replaces it below; Gait C exists together with them.
    sequences = {gait.sequence for gait in find_on_slope(COMPASS, 1, percent / 100)}
    assert {"stick | stick" if percent >= 18 else "slip+ stick slip- | stick", "slip+ stick | slip+"} <= sequences


def test_gaits_at_friction_0_14_are_those_of_the_study():
    # Gamus & Or 2015, and computed independently with two integrators.
    gaits = {gait.sequence: gait for gait in find_on_slope(COMPASS, 1, 0.14)}
    gait_b, gait_c = gaits["slip+ stick slip- | stick"], gaits["slip+ stick | slip+"]
    assert gait_b.z == pytest.approx([-0.140807105, 0.710208797, -0.516847656], abs=1e-8)
    assert gait_c.z == pytest.approx([-0.079038, 0.043777, -0.431761, 0.634174], abs=2e-6)
    assert gait_b.radius == pytest.approx(0.8206, abs=1e-4)
    assert gait_c.multipliers.real == pytest.approx([1.8235, -1.0695, 0.0579, 0], abs=1e-4)


@pytest.mark.parametrize(
    ("friction", "sequences"),
    [
        (0.1, {"slip+ | slip+"}),
        (0.24, {"slip+ | slip+", "slip+ stick slip+ | slip+"}),
        (0.25, {"slip+ | slip+", "slip+ stick slip+ | stick"}),
        (0.3, {"slip+ | slip+", "stick slip+ | stick"}),
        (0.32, {"slip+ | slip+", "stick slip+ | stick"}),
        (0.9, {"stick slip+ | stick"}),
        (1.0, {"stick | stick"}),
    ],
)
def test_every_type_of_the_wheel_is_found(friction, sequences):
    # Gamus & Or 2015: Type A sticks, B ends in slip, C has a slipping impact, D slips throughout.
    assert {gait.sequence for gait in find_on_slope(WHEEL, 13, friction)} == sequences


def test_the_stable_gait_of_two_steps_is_found_with_its_own_multipliers():
    # Goswami, Thuilot & Espiau 1998: the first period doubling is at a slope of about 4.4 deg.
    gaits = find_on_slope(COMPASS, 4.6, steps=2, **GOSWAMI)
    assert gaits[0].radius == pytest.approx(0.2736, abs=1e-4)  # computed from a walk to the attractor
    assert len(gaits[0].points) == 2
    assert [gait.radius for gait in gaits if len(gait.points) == 1][:2] == pytest.approx([1.1985, 5.8828], abs=1e-4)
    check_multipliers(gaits[0])


def test_the_period_doubling_cascade_is_found_up_to_eight_steps():
    gaits = find_on_slope(COMPASS, 5.03, steps=8, **GOSWAMI)
    flips = [gait for gait in gaits if gait.multipliers[0].real < -1 and len(gait.points) != 3]
    cascade = {len(gait.points): gait for gait in [*flips, *(gait for gait in gaits if gait.stable)]}
    assert set(cascade) == {1, 2, 4, 8}
    assert cascade[8].stable
    for steps, gait in cascade.items():
        assert steps == 1 or np.ptp([point[0] for point in gait.points]) > 1e-3
        assert gait.period == pytest.approx(0.75 * steps, rel=0.02)  # steps are about as long as those of one step
    check_multipliers(cascade[4])


@pytest.mark.parametrize(("slope", "steps", "radius"), [(4.41, 2, 0.9215), (4.92, 4, 0.8867), (5.04, 8, 1.6855)])
def test_a_gait_of_doubled_period_is_found_near_and_far_from_its_branching(slope, steps, radius):
    """Starts at fixed distances miss the gait of eight steps, which is unstable at this slope.

    The radii were computed from starts at 12 distances on both sides, and agree with differences of simulated steps.
    """
    gaits = [gait for gait in find_on_slope(COMPASS, slope, steps=steps, **GOSWAMI) if len(gait.points) == steps]
    nearest = min(gaits, key=lambda gait: abs(gait.radius - radius))
    assert nearest.radius == pytest.approx(radius, abs=2e-4)
    check_multipliers(nearest)


def test_a_slipping_gait_doubles_its_period_too():
    # A multiplier of Gait C is -1.0017 at friction 0.1442 and -0.9968 at 0.1445: the gaits of two steps lie beyond.
    doubled = [gait for gait in find_on_slope(COMPASS, 1, 0.1445, steps=2) if len(gait.points) == 2]
    assert [gait.sequence for gait in doubled] == ["slip+ stick | slip+; slip+ stick | slip+"]
    check_multipliers(doubled[0])


def test_a_gait_whose_impacts_slip_and_stick_in_turn_is_found_once():
    mixed = [gait for gait in find_on_slope(COMPASS, 1, 0.12, steps=2) if len(set(map(str, gait.sequences))) == 2]
    radii = sorted(gait.radius for gait in mixed)
    assert radii == pytest.approx([2.2943, 3.0919, 3.5999], abs=1e-3)  # checked below by differences of simulated steps
    for gait in mixed:
        assert gait.section.sliding  # the foot speed after a step is zero, after the other it is not
        assert sorted(point[-1] != 0 for point in gait.points) == [False, True]
        check_multipliers(gait)


def check_multipliers(gait):
    """Compare the derivative of the return map with finite differences of simulated steps."""
    walker = Walker(COMPASS, passive(COMPASS), COMPASS.vector(gait.parameters), default_engine())

    def image(z):
        state = gait.section.embed(z)
        for _ in gait.points:
            state = walker.walk_step(state).following
        return gait.section.project(state)

    step, columns = 1e-6, []
    for unit in np.eye(gait.z.size):
        one, two = (image(gait.z + k * step * unit) - image(gait.z - k * step * unit) for k in (1, 2))
        columns.append((8 * one - two) / (12 * step))
    derivative = np.array(columns).T
    assert np.max(np.abs(derivative - gait.derivative)) < 1e-5 * np.max(np.abs(gait.derivative))
    largest = np.max(np.abs(np.linalg.eigvals(derivative)))
    assert largest == pytest.approx(gait.radius, rel=1e-4)


def test_a_gait_of_one_step_is_reported_once_with_its_own_period():
    gaits = find_on_slope(WHEEL, 13, steps=4, starts=5)
    assert [gait.sequence for gait in gaits] == ["stick | stick"]
    assert gaits[0].multipliers[0] == pytest.approx(0.734042, abs=2e-6)  # closed form: ((cos 36 deg + k) / (1 + k))^2


def test_states_are_starts():
    gait_c = {"th1": -0.07, "th1_rate": 0.0, "th2_rate": -0.4, "foot_speed": 0.6}
    assert [gait.sequence for gait in find_on_slope(COMPASS, 1, 0.13, starts=[gait_c])] == ["slip+ stick | slip+"]
    resting = find_on_slope(WHEEL, 13, starts=[{"theta_rate": 2.3}])
    assert [gait.sequence for gait in resting] == ["stick | stick"]
    assert find_on_slope(WHEEL, 13, starts=[resting[0].state])[0].z == pytest.approx(resting[0].z)


def test_a_state_starts_a_gait_of_several_steps():
    gaits = find_on_slope(COMPASS, 4.6, steps=2, starts=[{"th1": -0.3, "th1_rate": 1.15, "th2_rate": -0.16}], **GOSWAMI)
    assert gaits[0].stable
    assert len(gaits[0].points) == 2


@pytest.mark.parametrize(
    ("starts", "message"),
    [
        ([{"theta_rat": 2.0}], "no coordinate 'theta_rat'"),
        ([{}], "needs values of theta_rate, because"),
        ([{"theta_rate": 2.0, "foot_speed": 0.1}], "must have foot_speed 0"),
        ([2.0], "a start must be a state by name such as cycle.state, got 2.0"),
        ("many", "starts must be"),
    ],
)
def test_invalid_starts_are_reported(starts, message):
    with pytest.raises(InputError, match=message):
        find_on_slope(WHEEL, 13, starts=starts)


def test_counts_may_be_whole_floats():
    assert len(find_on_slope(WHEEL, 13, steps=1.0, starts=3.0)) == 1


def test_infinite_friction_never_moves_the_foot():
    # Newton steps with foot speed once ended this search with an error.
    assert len(find_on_slope(COMPASS, 5.03, starts=150, **GOSWAMI)) >= 2


def test_deflation_leads_to_another_gait():
    p = COMPASS.vector(COMPASS.resolve({**GOSWAMI, "slope": math.radians(3)}))
    walker = Walker(COMPASS, passive(COMPASS), p, default_engine())
    start = np.array([-0.265, 1.15, -0.55, 0.0])
    first = find_cycle(walker, start)
    known = KnownPoint(first.z, np.array([0.2, 0.6, 0.6]))
    other = find_cycle(walker, start, deflation=Deflation([known]))
    assert other is not None
    assert not np.allclose(first.z, other.z, atol=1e-2)


def test_the_ratio_of_deflated_steps_is_that_of_the_deflated_jacobian():
    known = KnownPoint(np.array([0.3, -0.2]), np.array([0.5, 2.0])), KnownPoint(np.array([-1.0, 0.4]), np.ones(2))
    deflation, z = Deflation(known), np.array([0.8, 0.1])
    jacobian, residual = np.array([[2.0, 1.0], [0.5, -1.0]]), np.array([0.4, -0.3])
    gradient = [(deflation.factor(z + h) - deflation.factor(z - h)) / 2e-6 for h in 1e-6 * np.eye(2)]
    deflated = deflation.factor(z) * jacobian + np.outer(residual, gradient)
    expected = np.linalg.solve(deflated, -deflation.factor(z) * residual)
    direction = np.linalg.solve(jacobian, -residual)
    assert deflation.step_ratio(z, direction) * direction == pytest.approx(expected, rel=1e-8)


def test_the_section_of_a_sticking_foot_has_no_foot_speed():
    gait = find_on_slope(COMPASS, 3, starts=20, **GOSWAMI)[0]
    assert gait.section.names == Section(COMPASS, gait.section.p, sliding=False).names
