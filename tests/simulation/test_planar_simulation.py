"""Simulation of planar robots with any contacts: reference numbers, closed forms, and the single-support simulator."""

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest

from gaitopt import Mode, Stop, check_robot, compass_biped, rimless_wheel, simulate
from gaitopt.errors import InputError
from gaitopt.lazy import Deferred
from gaitopt.model import (
    check_planar,
    compass_with_two_feet,
    kneed_walker,
    monopod,
    spoked_wheel,
    vertical_hopper,
)
from gaitopt.simulation import place_planar, simulate_planar
from gaitopt.simulation.planar_simulation.phase_torque import LawState
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_simulator import follow

from .planar_examples import box, rod

COMPASS = compass_with_two_feet()
LENGTH = 1.6


def compass_state(th1, rates, slip=0.0):
    """Return the state with both feet on the ground, from the coordinates of the single-support robot."""
    q = np.array([LENGTH * np.sin(th1), LENGTH * np.cos(th1), -th1, th1])
    hip = [slip + LENGTH * np.cos(th1) * rates[0], -LENGTH * np.sin(th1) * rates[0]]
    return q, np.array([*hip, -rates[0], rates[1]])


@pytest.mark.parametrize(
    ("friction", "th1", "rates", "slip"),
    [
        (0.3, -0.14783689, (0.732796791, -0.500667882), 0.0),
        (0.14, -0.140807105, (0.710208797, -0.516847656), 0.0),
        (0.14, -0.079038, (0.043777, -0.431761), 0.634174),
    ],
)
def test_single_support_agrees_with_the_single_support_simulator(friction, th1, rates, slip):
    """Gaits A, B and C of Gamus & Or (2015): slip, rest, slip in the other direction, and touchdown."""
    parameters = {"slope": np.deg2rad(1), "friction": friction}
    walk = simulate(compass_biped(), [0, 0, th1, th1], [slip, 0, *rates], parameters)
    rollout = simulate_planar(COMPASS, *compass_state(th1, rates, slip), parameters, until="foot B closes")
    motion, jump = rollout.motion, walk.motion.jumps[0]
    assert rollout.stop is Stop.EVENT_REACHED
    assert motion.sequence == " > ".join(f"foot A {segment.mode.value}" for segment in walk.motion.segments) + " |"
    assert [event.time for event in motion.events] == pytest.approx(
        [s.time[-1] for s in walk.motion.segments], abs=1e-10
    )
    landing = motion.events[-1]
    assert landing.names == ("foot B closes", "foot A opens")
    assert landing.impulse[1] == pytest.approx(jump.impulse, abs=1e-9)
    assert landing.energy_lost == pytest.approx(jump.energy_lost, abs=1e-9)
    assert landing.v_plus[2:] == pytest.approx([jump.v_next[3], -jump.v_next[2]], abs=1e-9)
    times, force = motion.force("foot A")
    assert force[:, -1] == pytest.approx(walk.motion.segments[-1].force[:, -1], abs=1e-8)
    assert motion.ledger().relative_residual < 1e-12
    assert motion.ledger().friction_loss == pytest.approx(
        sum(segment.friction_work[-1] for segment in walk.motion.segments), abs=1e-10
    )
    assert times[-1] == pytest.approx(landing.time)


def test_both_feet_of_the_compass_slide():
    """Reference computed independently of this package, by enumeration and by a second method, two integrators."""
    th, rates = 0.5, (-1.0, 0.5)
    q = np.array([LENGTH * np.sin(th), LENGTH * np.cos(th), -th, th])
    v = np.array([LENGTH * np.cos(th), -LENGTH * np.sin(th), *rates])
    contacts = PlanarAutomaton(COMPASS, COMPASS.resolve({"friction": 0.3})).events.contacts(())
    outcome = contacts.impact(q, v, [0, 1], frozenset())
    assert outcome.impulse["foot A"] == pytest.approx((-0.068433127303, 0.228110424342), abs=1e-12)
    assert outcome.impulse["foot B"] == pytest.approx((-0.422289898954, 1.407632996512), abs=1e-12)
    assert outcome.energy_lost == pytest.approx(1.214225267088, abs=1e-12)
    rollout = simulate_planar(COMPASS, q, outcome.velocity_plus, {"friction": 0.3}, duration=0.25)
    assert rollout.motion.sequence == "foot A slip+, foot B slip+ > foot A slip-, foot B slip+"
    assert rollout.motion.events[0].time == pytest.approx(0.0082341570, abs=5e-11)
    assert rollout.end.q == pytest.approx([1.0666923, 1.11500657, -0.79975965, 0.79975965], abs=5e-8)
    assert rollout.motion.ledger().relative_residual < 1e-12
    assert rollout.motion.ledger().friction_loss > 0


def test_a_robot_on_two_sticking_feet_stays():
    q, v = place_planar(COMPASS, {"x": 0.1, "a": -0.2, "b": 0.2}, {}, {}, on=["foot A", "foot B"])
    rollout = simulate_planar(COMPASS, q, v, {"friction": 1.0}, duration=50.0)
    assert rollout.stop is Stop.DURATION_DONE
    assert rollout.motion.sequence == "foot A stick, foot B stick"
    assert rollout.end.y == pytest.approx(rollout.start.y, abs=1e-12)
    forces = sum(rollout.motion.force(foot)[1][:, -1] for foot in ("foot A", "foot B"))
    assert forces == pytest.approx([0, 10 * 9.8], abs=1e-9)


def test_the_monopod_flies_on_a_parabola_and_lands():
    robot, q = monopod(), np.array([0.0, 0.9, 0.1, -0.2, 0.55])
    v = np.array([1.5, 0.4, -0.3, 0.8, 0.2])
    rollout = simulate_planar(robot, q, v, {"friction": 0.6}, until="foot closes")
    flight, landing = rollout.motion.segments[0], rollout.motion.events[0]
    p = robot.vector(robot.resolve({"friction": 0.6}))
    momentum = [np.array(robot.momentum(*state, p)[0]).ravel() for state in zip(flight.q.T, flight.v.T, strict=True)]
    time = flight.time[:, None]
    np.testing.assert_allclose(momentum, momentum[0] - 9 * 9.81 * np.hstack([0 * time, time]), atol=1e-10)
    assert np.ptp(flight.kinetic + flight.potential) < 1e-10
    assert rollout.motion.sequence == "flight |"
    # The impact, solved here directly: a plastic impact of the foot that sticks if the impulse is in the cone.
    mass = np.array(robot.dynamics(landing.q, landing.v_minus, p)[0])
    rows = np.array([np.array(part)[0] for part in robot.rows(landing.q, landing.v_minus, p)[1::-1]])
    impulse = np.linalg.solve(rows @ np.linalg.solve(mass, rows.T), -rows @ landing.v_minus)
    if abs(impulse[0]) > 0.6 * impulse[1]:
        direction = rows[1] - np.sign(-impulse[0]) * 0.6 * rows[0]
        normal = -(rows[1] @ landing.v_minus) / (rows[1] @ np.linalg.solve(mass, direction))
        impulse = np.array([-np.sign(-impulse[0]) * 0.6, 1]) * normal
    assert landing.impulse[0] == pytest.approx(impulse, rel=1e-9)
    assert abs(landing.impulse[0, 0]) <= 0.6 * landing.impulse[0, 1] * (1 + 1e-12)


def test_samples_that_the_integration_does_not_need_are_evaluated_when_read():
    (segment,) = simulate_planar(monopod(), [0, 0.7, 0, 0, 0.6], np.zeros(5), {}, duration=0.1).motion.segments
    lazy = ("torque", "force", "kinetic", "potential", "elastic", "points")
    assert all(isinstance(vars(segment)[name], Deferred) for name in lazy)
    assert segment.kinetic + segment.potential == pytest.approx(np.full(segment.time.size, segment.potential[0]))
    assert not isinstance(vars(segment)["kinetic"], Deferred)


def test_the_spoked_wheel_rolls_like_the_rimless_wheel():
    parameters = {"slope": np.deg2rad(13), "friction": 0.3}
    half = np.pi / 10
    walk = simulate(rimless_wheel(), [0, 0, -half], [0, 0, 2.0], parameters, steps=4)
    wheel = spoked_wheel(10)
    q, v = place_planar(wheel, {"x": 0, "theta": -half}, {"theta": 2.0}, parameters, on=["spoke 0"])
    rollout = simulate_planar(wheel, q, v, parameters, until="spoke 4 closes")
    landings = [event for event in rollout.motion.events if event.is_impact]
    assert [event.time for event in landings] == pytest.approx([jump.time for jump in walk.motion.jumps], abs=1e-9)
    assert [event.v_plus[2] for event in landings] == pytest.approx(
        [jump.v_plus[2] for jump in walk.motion.jumps], abs=1e-9
    )
    assert [segment.mode.value for segment in walk.motion.segments] == [
        next(mode.value for _, mode in segment.state.modes if mode.value != "free")
        for segment in rollout.motion.segments
    ]
    assert rollout.motion.ledger().relative_residual < 1e-12


@pytest.mark.parametrize(
    ("friction", "angle", "modes"),
    [(0.5, 0.2, ("stick", "stick")), (0.3, 0.36, ("slip+", "slip+")), (0.5, 0.36, ("free", "stick"))],
)
def test_a_box_sticks_slides_or_tips(friction, angle, modes):
    """It sticks if tan(slope) < min(mu, b/h), slides if mu < b/h and tan(slope) > mu, and tips otherwise."""
    robot, parameters = box(), {"slope": angle, "friction": friction}
    q, v = place_planar(robot, {"x": 0.0}, {}, parameters, on=["rear", "front"])
    rollout = simulate_planar(robot, q, v, parameters, duration=0.2)
    first = rollout.motion.segments[0]
    assert tuple(mode.value for _, mode in first.state.modes) == modes
    if modes[0] == "slip+":
        rate = 9.81 * (np.sin(angle) - friction * np.cos(angle))
        assert rollout.end.v == pytest.approx([0.2 * rate, 0, 0], abs=1e-10)
        assert first.friction_work[:, -1].sum() == pytest.approx(
            friction * 9.81 * np.cos(angle) * 0.02 * rate, rel=1e-9
        )
    if modes == ("stick", "stick"):
        total = first.force[:, :, -1].sum(axis=0)
        assert total == pytest.approx(9.81 * np.array([-np.sin(angle), np.cos(angle)]), abs=1e-9)
        assert np.all(np.abs(first.force[:, 0, -1]) <= friction * first.force[:, 1, -1])
    if modes[0] == "free":
        assert first.force[1, 1, 0] == pytest.approx(9.27011905, abs=5e-9)  # enumeration and a second method agree
        assert rollout.end.q[2] > 0


def test_a_box_that_falls_back_closes_both_corners():
    """Impact on the second corner with the first closed: ratio of the rates of a rocking block."""
    robot, parameters = box(), {"friction": 10.0}
    q, v = place_planar(robot, {"x": 0, "angle": 0.1}, {"angle": -0.5}, parameters, on=["front"])
    rollout = simulate_planar(robot, q, v, parameters, until="rear closes")
    landing = rollout.motion.events[-1]
    assert landing.names == ("rear closes", "front opens")
    assert landing.v_plus[2] / landing.v_minus[2] == pytest.approx(1 - 1.5 * np.sin(np.arctan(1 / 3)) ** 2, abs=1e-10)


def test_a_rocking_box_comes_to_rest_after_infinitely_many_impacts():
    """The rate falls by a constant ratio at every impact; the last impacts close both corners."""
    robot, parameters = box(), {"friction": 5.0}
    q, v = place_planar(robot, {"x": 0, "angle": 0.05}, {"angle": 0}, parameters, on=["front"])
    rollout = simulate_planar(robot, q, v, parameters, duration=3.0)
    impacts = [event for event in rollout.motion.events if event.is_impact]
    ratios = [event.v_plus[2] / event.v_minus[2] for event in impacts[:10]]
    assert ratios == pytest.approx([1 - 1.5 * np.sin(np.arctan(1 / 3)) ** 2] * 10, abs=1e-9)
    assert rollout.stop is Stop.DURATION_DONE
    assert rollout.motion.segments[-1].state.closed == ("rear", "front")
    assert 30 < len(impacts) < 120
    assert rollout.end.v == pytest.approx(np.zeros(3), abs=1e-12)
    assert rollout.end.q[1:] == pytest.approx([0.3, 0], abs=1e-11)
    assert rollout.motion.ledger().relative_residual < 1e-9


def test_forces_that_grow_without_bound_end_the_motion():
    """A sliding foot whose force diverges before its slip ends or its well-posedness is lost."""
    robot, parameters = kneed_walker(), {"friction": 3.0, "slope": 0.4}
    q = [-0.0916317366, 0.9435758760, 0.2479142265, 0.7041315168, -0.4123456544, 0.0158091562]
    v = [-0.1361059398, 0.0027994264, -0.0054863118, 0.0898739789, -0.0914790352, -0.0625906524]
    rollout = simulate_planar(robot, q, v, parameters, duration=1.5)
    assert rollout.stop is Stop.PAINLEVE
    assert rollout.motion.force("foot A")[1][1, -1] > 1e3 * 1.6 * 9.81


@pytest.mark.parametrize(("speed", "mode"), [(0.0, "stick"), (2.0, "slip+")])
def test_contacts_that_close_together_are_one_event(speed, mode):
    """A level box falls on both corners; its impulse is shared, and friction acts on the sum."""
    robot, parameters, height = box(), {"friction": 0.2}, 0.1
    rollout = simulate_planar(robot, [0, 0.3 + height, 0], [speed, 0, 0], parameters, duration=0.2)
    (landing,) = (event for event in rollout.motion.events if event.is_impact)
    assert landing.names == ("rear closes", "front closes")
    assert {landing.outcome.mode("rear"), landing.outcome.mode("front")} == {Mode(mode)}
    normal = np.sqrt(2 * 9.81 * height)
    assert landing.impulse.sum(axis=0) == pytest.approx([-0.2 * normal if speed else 0, normal], abs=1e-9)
    assert rollout.end.v[1:] == pytest.approx([0, 0], abs=1e-11)
    fallen = np.sqrt(2 * height / 9.81)
    assert rollout.end.v[0] == pytest.approx(max(0, speed - 0.2 * normal - 0.2 * 9.81 * (0.2 - fallen)), abs=1e-9)


@pytest.mark.parametrize(
    ("friction", "outcome", "rate"),
    [(0.9, {"spoke 0": "free", "spoke 1": "stick"}, "beta"), (0.2, {"spoke 0": "free", "spoke 1": "slip+"}, "slip")],
)
def test_the_wheel_leaves_its_rear_spoke_by_sticking_or_slipping_at_the_front_one(friction, outcome, rate):
    """Rate ratio (cos 2a + kappa) / (1 + kappa), or (kappa - S) / (kappa + S) with S = sin a (sin a - mu cos a)."""
    wheel, half, kappa = spoked_wheel(8), np.pi / 8, 1 / 3
    parameters = {"friction": friction, "slope": 0.0}
    q, v = place_planar(wheel, {"x": 0, "theta": half}, {"theta": 1.0}, parameters, on=["spoke 0"])
    contacts = PlanarAutomaton(wheel, wheel.resolve(parameters)).events.contacts(())
    result = contacts.impact(q, v, [0, 1], frozenset())
    share = np.sin(half) * (np.sin(half) - friction * np.cos(half))
    expected = {"beta": (np.cos(2 * half) + kappa) / (1 + kappa), "slip": (kappa - share) / (kappa + share)}[rate]
    assert {name: mode.value for name, mode in result.modes.items()} == outcome
    assert result.velocity_plus[2] == pytest.approx(expected, abs=1e-12)


def test_static_friction_delays_the_onset_of_slip():
    robot = box()
    q, v = place_planar(robot, {"x": 0.0}, {}, {}, on=["rear", "front"])
    slope = {"slope": 0.27, "friction": 0.25}  # tan(slope) = .277
    assert simulate_planar(robot, q, v, slope, duration=0.01).motion.sequence == "rear slip+, front slip+"
    static = slope | {"static_friction_ratio": 1.2}
    assert simulate_planar(robot, q, v, static, duration=0.01).motion.sequence == "rear stick, front stick"


@pytest.mark.parametrize(("rate", "stop"), [(0.0, Stop.INCONSISTENT), (3.0, Stop.AMBIGUOUS)])
def test_a_sliding_rod_in_the_region_of_the_painleve_paradox_has_no_or_two_motions(rate, stop):
    """For friction 1.5 the region is 1 + 3 cos^2 - 4.5 sin cos < 0, tan(angle) from 1.219 to 3.281."""
    robot, parameters = rod(), {"friction": 1.5}
    for angle, expected in ((np.arctan(1.3), stop), (np.arctan(1.15), None)):
        q, v = place_planar(
            robot, {"x": 0, "angle": angle}, {"angle": rate, "x": 9}, parameters, on=["tip"], sliding=True
        )
        rollout = simulate_planar(robot, q, v, parameters, duration=1e-3)
        assert (rollout.stop is expected) if expected else rollout.stop is Stop.DURATION_DONE


def test_the_end_of_well_posed_sliding_is_located_and_named():
    robot = box()
    q, v = place_planar(robot, {"x": 0.0}, {"x": 1.0}, {}, on=["rear", "front"], sliding=True)
    automaton = PlanarAutomaton(robot, robot.resolve({"friction": 0.3}))
    automaton.well_posedness = lambda state: lambda y: y[0] < 0.05
    arc = automaton.flow(automaton.begin(q, v), 1.0)
    assert arc.states[0, -1] == pytest.approx(0.05, abs=1e-12)
    assert automaton.events.resolve(arc) is Stop.JAM


def test_named_stops():
    q, v = place_planar(COMPASS, {"x": 0, "a": 0.2, "b": 0.1}, {"a": 0.0, "b": 0.0}, {}, on=["foot A"])
    fall = simulate_planar(COMPASS, q, v, {"friction": 0.5}, duration=20.0)
    assert fall.stop is Stop.FELL
    fall = simulate_planar(monopod(), [0, 0, 0, np.pi / 2, 0.5], np.zeros(5), {})
    assert (fall.stop, fall.motion.segments) == (Stop.FELL, ())
    lift = simulate_planar(COMPASS, *compass_state(-0.2, (2.0, 1.0)), {}, duration=2.0)
    assert lift.stop is Stop.MUST_SLIP  # infinite friction pulls at the foot that lifts off


def test_an_actuator_works_and_the_energy_closes():
    robot = monopod()
    t, q, v = ca.SX.sym("t"), ca.SX.sym("q", 5), ca.SX.sym("v", 5)
    torque = ca.Function("torque", [t, q, v], [ca.vertcat(80 * ca.sin(5 * t), -10 * (q[3] - q[2]) - v[3] + v[2])])
    parameters = {"friction": 0.7}
    rollout = simulate_planar(robot, [0, 0.7, 0, 0.1, 0.55], [0.5, 0, 0, 0, 0], parameters, duration=0.6, torque=torque)
    energy = rollout.motion.ledger()
    assert len(rollout.motion.events) >= 2
    assert abs(energy.actuator) > 0.1
    assert energy.relative_residual < 1e-11
    segment = rollout.motion.segments[1]
    assert segment.torque[0, -1] == pytest.approx(80 * np.sin(5 * segment.time[-1]))


def test_kneed_walker_that_is_not_latched_bends_its_stance_knee():
    robot = kneed_walker()
    coordinates = {"x": 0, "a": 0.1, "b": -0.1, "flexion_a": 0, "flexion_b": 0}
    rates = {"a": -1.0, "b": 0.0, "flexion_a": 0, "flexion_b": 0}
    q, v = place_planar(robot, coordinates, rates, {}, on=["foot A"])
    assert "knee A latched" in simulate_planar(robot, q, v, {}, duration=0.01).motion.sequence
    free = simulate_planar(robot, q, v, {}, duration=0.01, latched=())
    assert "latched" not in free.motion.sequence


def test_contacts_that_start_below_the_ground_are_rejected():
    with pytest.raises(InputError, match=r"'foot' starts below the ground: its gap must be at least 0, got -0\.1"):
        simulate_planar(monopod(), [0, 0.5, 0, 0, 0.6], np.zeros(5), {})
    with pytest.raises(InputError, match=r"'full length' starts beyond its limit"):
        simulate_planar(vertical_hopper(), [0.8, 0.2], [0, 0], {})
    swing = place_planar(COMPASS, {"x": 0, "a": -0.1, "b": 0.05}, {"a": -1, "b": 1}, {}, on=["foot A"])
    assert simulate_planar(COMPASS, *swing, {}, duration=0.01).stop is Stop.DURATION_DONE


@pytest.mark.parametrize("gap", [-1e-10, 0.0, 1e-10])
def test_a_contact_that_touches_and_approaches_at_the_beginning_closes_at_once(gap):
    rollout = simulate_planar(monopod(), [0, 0.6 + gap, 0, 0, 0.6], [0.1, -1, 0, 0, 0], {"friction": 1}, duration=0.01)
    assert rollout.motion.events[0].names == ("foot closes",)
    assert rollout.motion.events[0].time == 0


def test_invalid_arguments_are_rejected():
    robot = vertical_hopper()
    with pytest.raises(InputError, match=r"q needs 2 finite entries \(body, foot\), got \[1.0\]"):
        simulate_planar(robot, [1.0], [0, 0], {})
    with pytest.raises(InputError, match="v needs numbers"):
        simulate_planar(robot, [1, 0], "fast", {})
    with pytest.raises(InputError, match=r"no parameter 'frction'\. Did you mean 'friction'"):
        simulate_planar(robot, [0.5, 0], [0, 0], {"frction": 1})
    with pytest.raises(InputError, match="has no contact 'knee'"):
        simulate_planar(robot, [0.5, 0], [0, 0], {}, latched=("knee",))
    with pytest.raises(InputError, match="torque of 'vertical_hopper' must be a Function"):
        simulate_planar(robot, [0.5, 0], [0, 0], {}, torque=ca.Function("f", [ca.SX.sym("t")], [0]))
    for duration in (-1.0, 1e308):
        with pytest.raises(InputError, match="duration must be at least 0 and at most 100000"):
            simulate_planar(robot, [0.5, 0], [0, 0], {}, duration=duration)
    with pytest.raises(InputError, match="An event must be one of sole, full length followed by"):
        simulate_planar(robot, [0.5, 0], [0, 0], {}, until="sole lands")
    with pytest.raises(InputError, match="has no coordinate 'hip'"):
        place_planar(robot, {"hip": 1}, {}, {}, on=["sole"])
    with pytest.raises(InputError, match="does not stand on sole, full length with"):
        place_planar(robot, {"body": 0.3, "foot": 0.0}, {}, {}, on=["sole", "full length"])


@pytest.mark.parametrize("speed", [0.0, 1.0])
def test_a_phase_with_too_many_samples_is_not_called_singular_or_jammed(speed):
    robot = monopod()
    automaton = PlanarAutomaton(robot, robot.resolve({"friction": 0.3}), samples=4)
    state = automaton.begin(np.array([0, 0.6, 0, 0, 0.6]), np.array([speed, 0, 0, 0, 0]))
    assert follow(automaton, state, duration=1.0).stop is Stop.TOO_MANY_EVENTS


def test_the_equations_of_contact_states_with_other_latched_values_are_not_all_stored():
    """A law that latches other values in each step has other equations in each step."""
    robot = monopod()
    automaton = PlanarAutomaton(robot, robot.resolve({}))
    state = automaton.begin(np.array([0, 0.7, 0, 0, 0.6]), np.zeros(5))
    for number in range(200):
        last = automaton.phase(replace(state, memory=LawState(0, 0.0, (float(number),), mirrored=False)))
    assert len(automaton._phases) <= 50
    assert automaton.phase(replace(state, memory=LawState(0, 0.0, (199.0,), mirrored=False))) is last


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: simulate(monopod(), [0] * 5, [0] * 5, {}), "PlanarRobot 'monopod' is for simulate_planar"),
        (lambda: simulate_planar(compass_biped(), [0] * 4, [0] * 4, {}), "Robot 'compass_biped' is for simulate"),
        (lambda: check_robot(monopod()), "PlanarRobot 'monopod' is for check_planar"),
        (lambda: check_planar(compass_biped()), "Robot 'compass_biped' is for check_robot"),
    ],
)
def test_a_robot_of_the_other_type_names_the_function_that_accepts_it(call, message):
    with pytest.raises(InputError, match=rf"{message}\.$"):
        call()
