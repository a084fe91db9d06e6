"""Periodic gaits of planar robots: reference numbers, closed forms and finite differences.

The numbers of the walkers with round feet and with knees are no published measurements.  They were computed
independently of this package, twice: with hand-written equations of motion and with other coordinates and another
integrator.  Those of the hopper follow from a closed form.
"""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from scipy.optimize import brentq

from gaitopt import compass_biped
from gaitopt.errors import InputError
from gaitopt.model import check_planar, compass_with_two_feet, kneed_walker, monopod, round_foot_walker, vertical_hopper
from gaitopt.simulation import place_planar, simulate_planar
from gaitopt.simulation.planar_simulation import planar_walker
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_simulator import follow
from gaitopt.stability import find_planar_cycle
from gaitopt.stability.planar_gaits.planar_linearisation import planar_derivative
from gaitopt.stability.planar_gaits.planar_section import PlanarSection
from tests.simulation.planar_examples import heel_toe_walker

ROUND_FEET = {
    "z": (0.1894382832527, -0.2390109878129, -0.1876139814681),
    "period": 2.427955842630,
    "multipliers": [0.43344487, 0.37046539 + 0.18370392j, 0.37046539 - 0.18370392j],
    "slope": 0.01,
}
KNEES = {
    "z": (0.2385854602534, -1.1095873311766, -0.0571481063377),
    "period": 0.5643281659150,
    "multipliers": [0.35257374 + 0.55221146j, 0.35257374 - 0.55221146j, 0.14382267],
    "slope": 0.0504,
}
KNEE_STRIKE = 0.3486120004843
HOPPER = {"body_mass": 8, "foot_mass": 2, "stiffness": 4000, "thrust": 0.02, "gravity": 9.81}


def begin(robot, z, parameters):
    """Return the state of a walker on foot A, right after foot B has left the ground."""
    angle, stance, swing = z
    coordinates = {"x": 0, "a": angle, "b": -angle} | dict.fromkeys(
        [name for name in robot.coordinates if name.startswith("flexion")], 0
    )
    rates = dict.fromkeys(coordinates, 0) | {"a": stance, "b": swing}
    del rates["x"]
    return place_planar(robot, coordinates, rates, parameters, on=["foot A"])


def find(robot, reference, offset):
    parameters = {"slope": reference["slope"]}
    q, v = begin(robot, [value * (1 + offset) for value in reference["z"]], parameters)
    return find_planar_cycle(robot, q, v, parameters, section="foot B closes")


@pytest.fixture(scope="module")
def round_gait():
    return find(round_foot_walker(), ROUND_FEET, 1e-3)


@pytest.fixture(scope="module")
def kneed_gait():
    return find(kneed_walker(), KNEES, 1e-4)


@pytest.mark.parametrize(("gait", "reference"), [("round_gait", ROUND_FEET), ("kneed_gait", KNEES)])
def test_walkers_have_the_reference_gaits(gait, reference, request):
    gait = request.getfixturevalue(gait)
    assert gait.residual < 1e-13
    assert [gait.state[name] for name in ("a", "a_rate", "b_rate")] == pytest.approx(reference["z"], abs=5e-13)
    assert gait.period == pytest.approx(reference["period"], abs=1e-12)
    assert gait.multipliers == pytest.approx(
        np.array(reference["multipliers"]), abs=7.1e-9
    )  # half a unit of the last digit in both parts
    assert gait.stable
    assert gait.travel == pytest.approx(2 * np.sin(reference["z"][0]) + 2 * radius_of(gait) * reference["z"][0])


def radius_of(gait):
    return gait.parameters.get("foot_radius", 0.0)


def test_the_knee_strikes_at_the_reference_time(kneed_gait):
    strike = kneed_gait.motion.events[0]
    assert strike.names == ("knee B closes",)
    assert strike.time == pytest.approx(KNEE_STRIKE, abs=1e-12)
    assert kneed_gait.sequence == ("foot A stick, knee A latched | foot A stick, knee A latched, knee B latched |")
    assert kneed_gait.motion.events[1].names == ("foot B closes", "foot A opens", "knee A released")


def test_the_energy_lost_is_the_work_of_gravity(round_gait, kneed_gait):
    for gait in (round_gait, kneed_gait):
        energy = gait.energy
        weight = gait.motion.total_mass * gait.parameters["gravity"]
        assert energy.gravity == pytest.approx(weight * gait.travel * np.sin(gait.parameters["slope"]), rel=1e-10)
        assert energy.impact_loss == pytest.approx(energy.gravity, rel=1e-10)
        assert energy.relative_residual < 1e-10


def test_the_number_of_samples_of_a_periodic_gait_is_not_limited(monkeypatch):
    """Only the walks of a push test end after a number of samples; a period of the flat foot has more of them."""
    monkeypatch.setattr(planar_walker, "SAMPLES", 5)
    gait = find_planar_cycle(vertical_hopper(), [0.7, 0.2], [0, 0], HOPPER, section="sole closes")
    assert sum(segment.time.size for segment in gait.motion.segments) > 10


def test_the_closed_form_of_the_hopper_has_the_published_digits():
    """The next height r^2 (k x^2 + 2 k x D - 2 mb g x) / (2 mb g) of a hop from height h, x its compression."""
    body, foot, stiffness, thrust, gravity = HOPPER.values()
    weight, ratio = body * gravity, body / (body + foot)

    def rise(height):
        x = (weight + np.sqrt(weight**2 + 2 * stiffness * weight * height)) / stiffness
        return ratio**2 * (stiffness * x**2 + 2 * stiffness * x * thrust - 2 * weight * x) / (2 * weight) - height

    height = brentq(rise, 0.1, 0.4, xtol=1e-16, rtol=1e-15)
    root = np.sqrt(weight**2 + 2 * stiffness * weight * height)
    assert height == pytest.approx(0.19997936094436, abs=5e-15)
    assert ratio**2 * (1 + stiffness * thrust / root) == pytest.approx(0.78107619584119, abs=5e-15)


def test_the_hopper_has_the_height_and_multiplier_of_the_closed_form():
    body, foot, stiffness, thrust, gravity = HOPPER.values()
    gait = find_planar_cycle(vertical_hopper(), [0.7, 0.2], [0, 0], HOPPER, section="sole closes")
    height = gait.state["body_rate"] ** 2 / (2 * gravity)
    weight, ratio = body * gravity, body / (body + foot)
    root = np.sqrt(weight**2 + 2 * stiffness * weight * height)
    assert height == pytest.approx(0.19997936094436, abs=5e-13)
    assert gait.multipliers == pytest.approx([0.78107619584119], abs=5e-13)
    assert gait.multipliers == pytest.approx([ratio**2 * (1 + stiffness * thrust / root)], abs=5e-13)
    assert gait.sequence == "sole closed > sole closed | full length latched |"
    energy = gait.energy
    compression = (weight + root) / stiffness
    work = stiffness * thrust * compression  # k ((x + D)^2 - x^2 - D^2) / 2: at the end the energy k D^2 / 2 is lost
    assert energy.actuator == pytest.approx(work, rel=1e-11)
    assert energy.actuator == pytest.approx(energy.impact_loss, rel=1e-11)


@pytest.mark.parametrize(("robot", "reference"), [(round_foot_walker(), ROUND_FEET), (kneed_walker(), KNEES)])
def test_the_derivative_of_a_step_agrees_with_differences(robot, reference):
    """The full derivative on the section, on deviations that keep the contacts closed."""
    parameters = {"slope": reference["slope"]}
    automaton, n = PlanarAutomaton(robot, robot.resolve(parameters)), robot.n_q

    def step(z):
        state = automaton.begin(*begin(robot, z, parameters))
        return follow(automaton, state, duration=10, until="foot B closes")

    exact = planar_derivative(automaton, step(reference["z"]))
    for entry in range(3):
        shift, states, starts = 1e-6 * np.eye(3)[entry], [], []
        for sign in (1, -1):
            rollout = step(np.array(reference["z"]) + sign * shift)
            starts.append(rollout.start.y)
            states.append(rollout.end.y)
        deviation, difference = (starts[0] - starts[1]) / 2e-6, (states[0] - states[1]) / 2e-6
        np.testing.assert_allclose(exact @ deviation, difference, rtol=1e-6, atol=1e-7)
    assert exact.shape == (2 * n, 2 * n)


def test_a_state_that_does_not_reach_the_section_is_rejected():
    robot = round_foot_walker()
    q, v = begin(robot, (0.19, -0.5, -0.2), {})
    with pytest.raises(
        InputError, match="does not reach the event 'foot B slip-': A foot on ground of infinite friction"
    ):
        find_planar_cycle(robot, q, v, {}, section="foot B slip-")
    with pytest.raises(InputError, match="must be one of foot A, foot B, hip point followed by one of closes, opens"):
        find_planar_cycle(robot, q, v, {}, section="foot C closes")


def test_the_kneed_walker_walks_on():
    robot, parameters = kneed_walker(), {"slope": KNEES["slope"]}
    rollout = simulate_planar(robot, *begin(robot, KNEES["z"], parameters), parameters, duration=3.0)
    landings = [
        event.time
        for event in rollout.motion.events
        if any("foot" in name and "closes" in name for name in event.names)
    ]
    np.testing.assert_allclose(np.diff(landings), KNEES["period"], atol=1e-9)
    assert len(landings) == 5


COMPASS_STATES = {
    "A": (0.3, (-0.147836890, 0.732796791, -0.500667882, 0.0), [0.48361 + 0.51892j, 0.48361 - 0.51892j, 0.38575]),
    "B": (0.14, (-0.140807105, 0.710208797, -0.516847656, 0.0), [0.8206]),
    "C": (0.14, (-0.079038, 0.043777, -0.431761, 0.634174), [1.8235, -1.0695, 0.0579, 0.0]),
}


@pytest.mark.parametrize("gait", COMPASS_STATES)
def test_the_compass_with_two_feet_has_the_gaits_of_the_single_support_robot(gait, cycle):
    """Gamus & Or (2015): A sticks, B slips and sticks and slips, C lands with a slip."""
    friction, start, published = COMPASS_STATES[gait]
    parameters, length = {"slope": np.deg2rad(1), "friction": friction}, 1.6
    th1, th1_rate, th2_rate, slip = start
    q = [length * np.sin(th1), length * np.cos(th1), -th1, th1]
    v = [slip + length * np.cos(th1) * th1_rate, -length * np.sin(th1) * th1_rate, -th1_rate, th2_rate]
    found = find_planar_cycle(compass_with_two_feet(), q, v, parameters, section="foot B closes")
    single = cycle(compass_biped(), parameters, start)
    assert found.period == pytest.approx(single.period, abs=1e-11)
    assert found.travel == pytest.approx(single.travel, abs=1e-11)
    assert [-found.state["a"], -found.state["a_rate"], found.state["b_rate"]] == pytest.approx(single.z[:3], abs=1e-10)
    assert found.multipliers == pytest.approx(single.multipliers, abs=1e-8)
    sizes = np.abs(found.multipliers)[: len(published)]
    assert sizes == pytest.approx(np.abs(published), abs=6e-5)
    assert found.energy.friction_loss == pytest.approx(single.energy.friction_loss, abs=1e-12)


@pytest.mark.parametrize(
    ("friction", "angle", "stance"),
    [
        (0.8, 0.12, "foot stick > foot slip+"),
        (0.4, 0.25, "foot slip+ > foot stick > foot slip+ > foot stick > foot slip-"),
        (0.2, 0.12, "foot slip+"),
    ],
)
def test_landing_lift_off_and_slip_have_exact_derivatives(friction, angle, stance):
    """The monopod lands, may slip and stick, lifts off by itself and lands again, under feedback of its leg."""
    robot = monopod()
    t, q, v = ca.SX.sym("t"), ca.SX.sym("q", 5), ca.SX.sym("v", 5)
    torque = ca.Function("torque", [t, q, v], [ca.vertcat(-5 * v[4], 3 * (q[3] - q[2]) + ca.sin(q[2]) - v[3])])
    automaton = PlanarAutomaton(robot, robot.resolve({"friction": friction}), torque)

    def bounce(y):
        state, rollouts = automaton.begin(y[:5], y[5:]), []
        for event in ("foot closes", "foot opens", "foot closes"):
            rollouts.append(follow(automaton, state, duration=2.0, until=event))
            state = rollouts[-1].end
        return rollouts

    start = np.array([0.0, 0.75, 0.05, angle, 0.6, 0.8, 0.0, -0.1, 0.3, 0.0])
    rollouts, exact = bounce(start), np.eye(10)
    for rollout in rollouts:
        exact = planar_derivative(automaton, rollout) @ exact
    assert [rollout.motion.sequence for rollout in rollouts] == ["flight |", stance, "flight |"]
    for unit in np.random.default_rng(1).normal(size=(3, 10)):
        sides = [bounce(start + sign * 1e-6 * unit)[-1].end.y for sign in (1, -1)]
        np.testing.assert_allclose(exact @ unit, (sides[0] - sides[1]) / 2e-6, rtol=1e-5, atol=2e-6)


def test_a_torque_that_depends_on_time_enters_the_derivative():
    robot = monopod()
    t, q, v = ca.SX.sym("t"), ca.SX.sym("q", 5), ca.SX.sym("v", 5)
    torque = ca.Function("torque", [t, q, v], [ca.vertcat(300 * ca.sin(9 * t), 2 * ca.cos(7 * t))])
    automaton = PlanarAutomaton(robot, robot.resolve({"friction": 0.9}), torque)

    def land_and_leave(y):
        return follow(automaton, automaton.begin(y[:5], y[5:]), duration=2.0, until="foot opens")

    start = np.array([0.0, 0.75, 0.05, 0.12, 0.6, 0.8, 0.0, -0.1, 0.3, 0.0])
    exact = planar_derivative(automaton, land_and_leave(start))
    for unit in np.random.default_rng(2).normal(size=(3, 10)):
        sides = [land_and_leave(start + sign * 1e-6 * unit).end.y for sign in (1, -1)]
        np.testing.assert_allclose(exact @ unit, (sides[0] - sides[1]) / 2e-6, rtol=1e-5, atol=2e-6)


HEEL_TOE = {
    "coordinates": {"x": 0, "a": 0.279, "b": -0.329},
    "rates": {"a": -1.184, "b": -0.718},
    "parameters": {"slope": 0.04, "friction": 2.0},
    "on": ["heel a"],
    "section": "heel b closes",
}


@pytest.fixture(scope="module")
def heel_toe_gait():
    robot, parameters = heel_toe_walker(), HEEL_TOE["parameters"]
    q, v = place_planar(robot, HEEL_TOE["coordinates"], HEEL_TOE["rates"], parameters, on=HEEL_TOE["on"])
    return robot, find_planar_cycle(robot, q, v, parameters, section=HEEL_TOE["section"])


def test_the_walker_with_heels_and_toes_walks_on_both(heel_toe_gait):
    robot, gait = heel_toe_gait
    assert gait.sequence == "heel a stick | toe a stick |"
    assert [event.names for event in gait.motion.events] == [
        ("toe a closes", "heel a opens"),
        ("heel b closes", "toe a opens"),
    ]
    gravity = 14 * 9.81 * gait.travel * np.sin(0.04)
    assert gait.energy.impact_loss == pytest.approx(gravity, rel=1e-10)
    assert not gait.stable
    assert check_planar(robot).passed


@pytest.mark.parametrize("which", ["heel_toe", "kneed"])
def test_multipliers_agree_with_differences_of_the_return_map(which, heel_toe_gait, kneed_gait):
    robot, gait = heel_toe_gait if which == "heel_toe" else (kneed_walker(), kneed_gait)
    automaton = PlanarAutomaton(robot, gait.parameters)
    y = np.array([*gait.state.values()])
    n = robot.n_q
    first = follow(automaton, automaton.begin(y[:n], y[n:]), duration=5.0, until=gait.section)
    section = PlanarSection(automaton, first.arcs[-1], first.motion.events[-1], robot.mirror)
    start = section.exchange(first.end)
    basis, columns = section.tangent(start.y), []
    for direction in basis.T:
        ends = []
        for sign in (1, -1):
            near = section.correct(start.y + sign * 1e-6 * direction)
            state = automaton.events.choose(replace(start, q=near[:n], v=near[n:]), start.closed, start.latched, {})
            rollout = follow(automaton, state, duration=5.0, until=gait.section)
            ends.append(section.project(section.exchange(rollout.end).y))
        columns.append(basis.T @ (ends[0] - ends[1]) / 2e-6)
    found = np.linalg.eigvals(np.column_stack(columns))
    np.testing.assert_allclose(np.sort_complex(found), np.sort_complex(gait.multipliers), rtol=1e-5, atol=1e-5)
