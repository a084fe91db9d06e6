"""Scripts of optimal gaits of robots with several contacts: solved, replayed, and in balance."""

import functools

import numpy as np
import pytest
from attrs import evolve
from scipy.interpolate import CubicSpline

from gaitopt import load, verify
from gaitopt.cli.script import call_script
from gaitopt.motion.ground_penetration import find_penetrations
from gaitopt.motion.planar_gait_summary import summarise_planar
from gaitopt.motion.planar_gait_table import tabulate_planar_gait
from gaitopt.motion.summary import summarise
from gaitopt.ocp import solve_planar
from gaitopt.simulation import verify_planar
from tests.conftest import ROOT

every_script = pytest.mark.parametrize("name", ["bounding_quadruped", "compass_with_torso", "kneed_walker_motors"])


STORED = {"bounding_quadruped": ROOT / "tests" / "problems" / "bounding_quadruped.h5"}
"""Optimal gaits in files, whose refined grids take ten seconds."""


@functools.cache
def gait_of(name):
    if name in STORED:
        return verify_planar(load(STORED[name]))
    return verify_planar(solve_planar(call_script(ROOT / "problems" / f"{name}.py", [])))


def integrate(time, values):
    """Return the integral of samples along the last axis, which are denser near the ends of intervals."""
    return CubicSpline(time, values, axis=-1).integrate(*time[[0, -1]])


@pytest.mark.slow
@every_script
def test_it_is_solved_and_its_replay_is_the_plan(name):
    gait = gait_of(name)
    assert gait.status.ok, gait.solver.violations
    assert gait.verification.passed, gait.verification.reasons
    assert gait.verification.sequence == str(gait.sequence)


@pytest.mark.slow
@every_script
def test_forces_and_impulses_balance_the_weight(name):
    """In a period the impulse of all contact forces is opposite to that of the weight."""
    gait = gait_of(name)
    motion, feet = gait.motion, [i for i, contact in enumerate(gait.robot.contacts) if contact.kind != "stop"]
    slope, weight = motion.parameters["slope"], motion.total_mass * motion.parameters["gravity"]
    impulse = sum(integrate(segment.time, segment.force[feet].sum(axis=0)) for segment in motion.segments)
    impulse = impulse + sum(event.impulse[feet].sum(axis=0) for event in motion.events)
    expected = weight * motion.period * np.array([-np.sin(slope), np.cos(slope)])
    assert impulse == pytest.approx(expected, abs=1e-3 * weight * motion.period)


@pytest.mark.slow
@every_script
def test_the_energy_of_a_period_is_in_balance(name):
    ledger = gait_of(name).energy
    losses = ledger.impact_loss + ledger.friction_loss
    assert ledger.actuator + ledger.gravity == pytest.approx(losses, rel=1e-6, abs=1e-9)
    assert losses > 0


def test_a_straight_leg_that_scuffs_the_ground_in_mid_swing_is_a_fact_and_not_a_warning():
    """The armed foot is 2.8 mm below the ground and then rises by 4.9 mm, so that its touchdown is from above."""
    gait = gait_of("compass_with_torso")
    assert gait.verification.passed
    assert gait.solver.warnings == ()
    (penetration,) = find_penetrations(gait.robot, gait.motion)
    assert 0.002 < penetration.depth < penetration.rise
    (text,) = (text for name, text in tabulate_planar_gait(gait) if name == "below ground")
    assert text.startswith("foot B by up to ")
    assert text.endswith(
        f"and by up to {1e3 * penetration.depth:.3g} mm while it is armed; it then rises to "
        f"{1e3 * penetration.rise:.3g} mm above the ground, a height greater than this depth, so that its touchdown is "
        "valid"
    )


def test_only_gravity_turns_the_compass_with_torso_about_its_foot():
    """Without a torque at the foot, the angular momentum about it changes by the moment of the weight alone."""
    gait = gait_of("compass_with_torso")
    segment, values, robot = gait.motion.segments[0], gait.motion.parameters, gait.robot
    p, masses = robot.vector(values), [values[f"{name}_mass"] for name in ("hip", "torso", "leg", "leg")]

    def places(q):
        x, y, torso, *legs = q
        hip, down = np.array([x, y]), [np.array([np.sin(leg), -np.cos(leg)]) for leg in legs]
        above = (values["leg_length"] - values["leg_com"]) * np.array(down)
        head = hip + values["torso_length"] * np.array([np.sin(torso), np.cos(torso)])
        return np.array([hip, head, hip + above[0], hip + above[1]]), hip + values["leg_length"] * down[0]

    def moments(q, v):
        foot, h = places(q)[1], 1e-6
        rates = (places(q + h * v)[0] - places(q - h * v)[0]) / (2 * h)
        arms = places(q)[0] - foot
        weight = -values["gravity"] * np.dot(masses, arms[:, 0])
        return np.dot(masses, arms[:, 0] * rates[:, 1] - arms[:, 1] * rates[:, 0]), weight

    momentum, weight = np.array([moments(q, v) for q, v in zip(segment.q.T, segment.v.T, strict=True)]).T
    assert momentum[-1] - momentum[0] == pytest.approx(integrate(segment.time, weight), rel=1e-5)
    assert float(robot.mass(p)) == pytest.approx(sum(masses))


def test_the_quadruped_alternates_between_its_pairs_of_legs():
    gait = gait_of("bounding_quadruped")
    phases = [{name for name, mode in segment.state.modes if mode.value == "stick"} for segment in gait.motion.segments]
    assert phases == [{"back foot"}, set(), {"front foot"}, set()]
    flight = gait.motion.segments[1]
    drop = flight.time - flight.time[0]
    p = gait.robot.vector(gait.motion.parameters)
    momentum = np.array(
        [np.array(gait.robot.momentum(q, v, p)[0]).ravel() for q, v in zip(flight.q.T, flight.v.T, strict=True)]
    )
    weight = gait.motion.total_mass * gait.motion.parameters["gravity"]
    assert momentum[:, 1] == pytest.approx(momentum[0, 1] - weight * drop, abs=1e-6 * weight)
    assert momentum[:, 0] == pytest.approx(np.full(drop.size, momentum[0, 0]), abs=1e-6 * weight)


@pytest.mark.slow
def test_the_solve_of_the_quadruped_does_not_depend_on_rounding_errors():
    problem = call_script(ROOT / "problems" / "bounding_quadruped.py", [])
    problem = problem.replace(transcription=evolve(problem.transcription, tolerance=np.inf))
    gravity = problem.parameters["gravity"]
    gaits = [
        solve_planar(problem.replace(parameters={**problem.parameters, "gravity": gravity * (1 + k * 1e-10)}))
        for k in range(3)
    ]
    assert all(gait.status.ok and gait.solver.iterations < 100 for gait in gaits)
    assert [gait.solver.objective for gait in gaits] == pytest.approx([2.911515] * 3, abs=1e-5)


@pytest.mark.slow
@pytest.mark.parametrize(
    "settings", [["sequence=stick | stick"], ["sequence=slip+ stick | slip+", "friction=0.14", "speed=0.633"]]
)
def test_the_compass_walks_in_single_support_as_its_script_states(settings):
    """Without margins the impulse is on its cone and a slip ends immediately, so that no replay matches the plan."""
    gait = verify_planar(solve_planar(call_script(ROOT / "problems" / "compass_double_support.py", settings)))
    assert gait.status.ok
    assert gait.verification.passed, gait.verification.reasons


@pytest.mark.slow
def test_the_knee_of_the_kneed_walker_strikes_before_its_foot_lands():
    gait = gait_of("kneed_walker_motors")
    assert gait.motion.events[0].names == ("knee B closes",)
    flexion = gait.robot.coordinates.index("flexion_b")
    assert gait.motion.segments[0].q[flexion].max() > 0.1
    assert gait.motion.segments[1].q[flexion] == pytest.approx(np.zeros(gait.motion.segments[1].time.size), abs=1e-9)


def missing(reference, other):
    """Return the keys of nested dictionaries that the second one lacks, apart from those of the problem."""
    if isinstance(reference, list) and isinstance(other, list) and reference and other:
        return missing(reference[0], other[0])
    if not isinstance(reference, dict) or not isinstance(other, dict):
        return []
    lacking = [key for key in reference if key not in other]
    common = [key for key in reference if key in other and key != "problem"]
    return lacking + [f"{key}/{below}" for key in common for below in missing(reference[key], other[key])]


@every_script
def test_its_summary_has_the_keys_of_a_robot_with_one_contact(name, slip_gait):
    reference, summary = summarise(verify(slip_gait)), summarise_planar(gait_of(name))
    assert missing(reference, summary) == []
    assert missing(reference["impact"], summary["impact"]) == []
    assert summary["verification"]["cone_margin"] == pytest.approx(summary["friction_margin"], abs=0.02)
    assert summary["verification"]["cost_of_transport"] == pytest.approx(summary["cost_of_transport"], rel=5e-3)
    impact = summary["impact"]
    assert set(impact["ratio"]) == set(impact["mode"]) == set(impact["impulse"])
    for contact, (tangential, normal) in impact["impulse"].items():
        assert impact["ratio"][contact] == pytest.approx(tangential / normal)
    for phase in summary["phases"]:
        assert set(phase["largest_normal_force"]) == {n for n, mode in phase["modes"].items() if mode != "free"}
