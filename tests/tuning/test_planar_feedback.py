"""Feedback on optimised planar gaits: exact closed-loop multipliers, and walks that return to the gait."""

import functools
from dataclasses import replace

import numpy as np
import pytest

from gaitopt import load
from gaitopt.control import PlanarLaw, passive, planar_feedforward, planar_joint_pd, planar_step_to_step
from gaitopt.control.planar_laws.law_slopes import law_slope
from gaitopt.control.planar_laws.planar_feedback import select_actuators
from gaitopt.control.planar_laws.planar_state_feedback import planar_state_feedback
from gaitopt.errors import InputError
from gaitopt.model import compass_with_two_feet, monopod
from gaitopt.ocp import PlanarLimits, solve_planar
from gaitopt.simulation import simulate_planar, verify_planar
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_simulator import follow
from gaitopt.stability import assess_planar
from gaitopt.stability.planar_gaits.planar_section import PlanarSection
from gaitopt.tuning import planar_lqr, planar_step_lqr
from tests.conftest import ROOT
from tests.ocp.multicontact_examples import drag, hop, knee_strike, walk
from tests.stability.difference_quotients import planar_differences

DRAG = PlanarLimits(torque={"ankle A": 0}, impulse=0.05)

PROBLEMS = {
    "monopod": lambda: hop(clearance=1e-2),
    "double support": lambda: drag().replace(limits=DRAG),
    "single support": walk,
    "two parts": lambda: knee_strike().replace(step_length=0.45),
}


@functools.cache
def control(name):
    """Return the gait of a problem, its step-to-step feedback, and the periodic gait under this law."""
    gait = solve_planar(PROBLEMS[name]())
    law = planar_step_lqr(gait)
    return gait, law, assess_planar(gait, law)


@pytest.fixture(scope="module", params=PROBLEMS)
def controlled(request):
    gait, law, cycle = control(request.param)
    assert verify_planar(gait).verification.passed
    return gait, law, cycle


@pytest.fixture(scope="module")
def gait(controlled):
    return controlled[0]


@pytest.fixture(scope="module")
def law(controlled):
    return controlled[1]


@pytest.fixture(scope="module")
def cycle(controlled):
    return controlled[2]


STEPS = {"monopod": 1e-8}
"""Steps of the differences that are not 1e-6: the force of the monopod vanishes at lift-off at the friction limit, and
second derivatives jump there; the error of a difference is proportional to its step."""


@pytest.mark.slow
def test_feedback_along_the_gait_stabilises_it_with_exact_multipliers(gait):
    law = planar_lqr(gait)
    cycle = assess_planar(gait, law)
    assert cycle.radius < 0.6
    assert cycle.period == pytest.approx(gait.period, abs=1e-6)
    scale = max(1.0, np.max(np.abs(cycle.derivative)))
    found = planar_differences(gait.robot, cycle, law, 1e-7)
    np.testing.assert_allclose(found, cycle.derivative, atol=1e-5 * scale)


@pytest.mark.slow
def test_feedback_along_the_gait_respects_its_actuators_and_limits(gait):
    chosen = select_actuators(gait, None)[:1]
    law, robot = planar_lqr(gait, actuators=chosen, torque_limit=1e3), gait.robot
    idle = [robot.actuators.index(name) for name in robot.actuators if name not in chosen]
    for part in law.parts:
        slope = law_slope(part.control)
        inputs = [np.zeros(part.control.size_in(i)) for i in range(5)]
        by_state = np.array(slope(*inputs, part.table[: part.control.size1_in(5), 0])[1])
        assert not by_state[idle].any()
        assert by_state.any()
        assert part.limited
    with pytest.raises(InputError, match=r"gains must have the shapes"):
        planar_state_feedback(gait, [])


@pytest.mark.slow
def test_step_to_step_feedback_stabilises_the_gait(gait, cycle):
    assert cycle.radius < 0.9
    assert cycle.period == pytest.approx(gait.period, abs=1e-6)


@pytest.mark.slow
def test_closed_loop_multipliers_agree_with_differences(gait, law, cycle):
    joint_pd = planar_joint_pd(gait, stiffness=30, damping=3)
    for feedback, closed in ((joint_pd, assess_planar(gait, joint_pd)), (law, cycle)):
        scale = max(1.0, np.max(np.abs(closed.derivative)))
        step = STEPS.get(gait.robot.name, 1e-6)
        found = planar_differences(gait.robot, closed, feedback, step)
        np.testing.assert_allclose(found, closed.derivative, atol=1e-5 * scale)


@pytest.mark.slow
def test_a_perturbed_walk_returns_to_the_gait_over_exchanged_legs(gait, law, cycle):
    robot = gait.robot
    y, n = np.array([*cycle.state.values()]), gait.robot.n_q
    section = first_section(gait, law, y)
    start = section.correct(y + cycle.basis @ np.full(cycle.basis.shape[1], 1e-4))
    rollout = simulate_planar(
        robot, start[:n], start[n:], gait.motion.parameters, torque=law, duration=8.5 * gait.period
    )
    assert rollout.stop.key == "duration_done"
    errors = []
    for number, state in enumerate(landings(rollout, law.section, robot)):
        mirror = np.eye(n) if robot.mirror is None or number % 2 else robot.mirror.coordinates
        landed = np.kron(np.eye(2), mirror) @ state
        errors.append(np.max(np.abs(section.project(landed - y))))
    assert len(errors) == 8
    assert errors[-1] < 0.1 * np.max(np.abs(section.project(start - y)))


def first_section(gait, law, y):
    n, automaton = gait.robot.n_q, PlanarAutomaton(gait.robot, gait.motion.parameters, law)
    first = follow(automaton, automaton.begin(y[:n], y[n:]), duration=5.0, until=law.section)
    return PlanarSection(automaton, first.arcs[-1], first.motion.events[-1], gait.robot.mirror)


def landings(rollout, section, robot):
    """Return the state after each impact that ends a period."""
    contact, happens = section.rsplit(" ", 1)
    place = robot.contact_names.index(contact)
    partner = robot.contact_names[place if robot.mirror is None else robot.mirror.contacts[place]]
    ends = {f"{name} {happens}" for name in (contact, partner)}
    return [np.concatenate([e.q, e.v_plus]) for e in rollout.motion.events if ends & set(e.names)]


@pytest.mark.slow
def test_the_monopod_is_unstable_in_open_loop_and_its_body_turns_freely():
    """The hip is the centre of mass of the body: its angle and its rate do not return, so two multipliers are 1."""
    cycle = assess_planar(control("monopod")[0])
    assert cycle.radius > 3
    assert np.sort(np.abs(cycle.multipliers - 1))[:2] == pytest.approx([0, 0], abs=1e-6)


@pytest.mark.slow
def test_a_slip_that_stays_below_the_tolerance_ends_by_itself():
    """Just before lift-off the foot slips backward for an instant, and then forward, at less than 1e-9 m/s."""
    gait, law, cycle = control("monopod")
    n = gait.robot.n_q
    y = np.array([*cycle.state.values()])
    section = first_section(gait, law, y)
    for size in (1e-6, 3e-6):
        start = section.correct(y + cycle.basis @ np.full(cycle.basis.shape[1], size))
        rollout = simulate_planar(
            gait.robot, start[:n], start[n:], gait.motion.parameters, torque=law, duration=2 * gait.period
        )
        assert rollout.stop.key == "duration_done"


def test_a_least_impulse_keeps_the_trailing_foot_loaded():
    free, loaded = (
        solve_planar(drag().replace(limits=limits)) for limits in (PlanarLimits(torque={"ankle A": 0}), DRAG)
    )
    trailing = [gait.motion.events[-1].impulse[1, 1] for gait in (free, loaded)]
    assert trailing == [pytest.approx(0, abs=1e-6), pytest.approx(0.05, abs=1e-6)]
    with pytest.raises(InputError, match=r"impulse must be at least 0 \[N s\], got -1"):
        PlanarLimits(impulse=-1)


def test_zero_gains_are_the_feedforward_torques():
    gait = solve_planar(walk())
    open_loop, zero = assess_planar(gait), assess_planar(gait, planar_joint_pd(gait))
    assert zero.multipliers == pytest.approx(open_loop.multipliers, abs=1e-8)
    assert planar_joint_pd(gait, stiffness=5).gain_values == {
        "ankle A_stiffness": 5.0,
        "ankle B_stiffness": 0.0,  # the plan leaves it idle
        "hip_stiffness": 5.0,
        "ankle A_damping": 0.0,
        "ankle B_damping": 0.0,
        "hip_damping": 0.0,
    }


def test_wrong_laws_are_rejected():
    robot = monopod()
    law = PlanarLaw("passive", "foot closes", (passive(robot),))
    with pytest.raises(InputError, match="does not belong to robot 'compass_with_two_feet'"):
        PlanarAutomaton(compass_with_two_feet(), {}, law)
    with_index = replace(passive(robot), index=0)
    with pytest.raises(InputError, match="of a robot with several contacts must be a function of the clock without ev"):
        PlanarLaw("angle", "foot closes", (with_index,))
    with pytest.raises(InputError, match="needs a law for each part of its period, got none"):
        PlanarLaw("nothing", "foot closes", ())
    with pytest.raises(InputError, match=r"gains of shape \(2, 10\), got \(10,\) and \(1, 10\)"):
        planar_step_to_step(robot, law, np.zeros(10), np.zeros((1, 10)), actuators=["hip"], windows=2, duration=0.4)
    gait = load(ROOT / "docs" / "examples" / "heel_toe.h5")
    with pytest.raises(InputError, match="has no actuator 'knee'"):
        planar_joint_pd(gait, stiffness=1.0, actuators=["knee"])
    with pytest.raises(InputError, match="gait must be a PlanarGait"):
        planar_feedforward(gait.motion)
    limited = planar_joint_pd(gait, stiffness=1.0, torque_limit=500.0)
    with pytest.raises(InputError, match="without limits or latched values, got 'joint_pd'"):
        planar_step_lqr(gait, law=limited)
