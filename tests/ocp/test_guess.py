import dataclasses
import math
from pathlib import Path

import casadi as ca
import numpy as np
import pytest

from gaitopt import (
    ContactSequence,
    InputError,
    Keyframes,
    LinearGuess,
    RandomPerturbation,
    WarmStart,
    compass_biped,
    load,
    rimless_wheel,
)
from gaitopt.cli.script import load_script
from gaitopt.model.coordinate_entries import full_coordinates
from gaitopt.ocp import FromMotion
from gaitopt.ocp.bounds import bounds
from gaitopt.ocp.initial.initial_point import initial_point, setting
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.statement.initial_guess import Setting
from gaitopt.ocp.statement.touchdown_pose import _pose_by_newton, find_longest_reach, reaches, touchdown_pose
from tests.ocp.nlp_examples import SCHEMES, example_nlp, unknowns

PERIOD, STEP = 0.75, 0.47
ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def aim():
    robot = compass_biped()
    return Setting(robot, robot.resolve({}), ContactSequence.parse("slip+ stick | slip+"), STEP, PERIOD)


@pytest.fixture(scope="module")
def published():
    return load("docs/examples/compass_slip.h5").motion


def test_a_line_runs_from_one_touchdown_to_the_next(aim):
    time = np.linspace(0, PERIOD, 11)
    sample = LinearGuess().sample(aim, time)
    # Feet STEP apart with straight legs of 1.6 m: both angles are asin(STEP / 2 / 1.6); the swap negates them.
    angle = math.asin(STEP / 2 / 1.6)
    assert sample.angles[:, -1] == pytest.approx([angle, angle], abs=1e-6)
    assert sample.angles[:, 0] == pytest.approx([-angle, -angle], abs=1e-6)
    assert sample.rates == pytest.approx(np.full((2, 11), 2 * angle / PERIOD), abs=1e-5)
    assert not np.any(sample.torque)
    assert not np.any(sample.slide)


def test_slip_phases_get_a_sixth_of_the_time(aim):
    assert LinearGuess().durations(aim) == pytest.approx([PERIOD / 6, 5 * PERIOD / 6])


def test_keyframes_pass_through_their_poses_without_overshoot(aim):
    frames = Keyframes((0, 0.5, 1), {"th1": (-0.1, 0.0, 0.2), "th2": (-0.1, 0.3, 0.2)})
    time = np.linspace(0, PERIOD, 101)
    sample = frames.sample(aim, time)
    assert sample.angles[:, [0, 50, 100]] == pytest.approx(np.array([[-0.1, 0, 0.2], [-0.1, 0.3, 0.2]]))
    assert np.all(np.diff(sample.angles[0]) >= 0)
    assert sample.angles[1].max() == pytest.approx(0.3)
    slopes = np.gradient(sample.angles, time, axis=1)[:, 1:-1]
    assert sample.rates[:, 1:-1] == pytest.approx(slopes, abs=2e-2)


@pytest.mark.parametrize("fractions", [(0, 1, 1), (0.1, 1), (0, 0.9), (0,), (1, 0), (0, math.nan, 1)])
def test_fractions_that_do_not_run_from_0_to_1(fractions):
    with pytest.raises(InputError, match="fractions must increase from 0 to 1"):
        Keyframes(fractions, {"th1": [0.0] * len(fractions)})


@pytest.mark.parametrize("angles", [(0.0,), (0.0, math.nan), (0.0, math.inf)])
def test_keyframe_angles_that_cannot_be(angles):
    with pytest.raises(InputError, match="th1 needs 2 finite angles"):
        Keyframes((0, 1), {"th1": angles})


def test_keyframes_of_another_robot_are_refused(aim):
    with pytest.raises(InputError, match="must name the angles"):
        Keyframes((0, 1), {"theta": (0, 1)}).sample(aim, np.zeros(1))


def test_a_previous_motion_keeps_its_phases_and_is_stretched_in_time(aim, published):
    durations = FromMotion(published).durations(aim)
    own = np.array([segment.duration for segment in published.segments])
    assert durations == pytest.approx(own * PERIOD / own.sum())
    sample = FromMotion(published).sample(aim, np.array([0.0, PERIOD]))
    assert sample.angles[:, 0] == pytest.approx(published.segments[0].q[2:, 0])
    assert sample.angles[:, 1] == pytest.approx(published.segments[-1].q[2:, -1])
    assert sample.torque[:, 1] == pytest.approx(published.segments[-1].torque[:, -1])
    assert sample.slide[1] == pytest.approx(published.foot_slide)


def test_a_previous_motion_of_another_sequence_is_spread_over_the_new_phases(published):
    robot = compass_biped()
    aim = Setting(robot, robot.resolve({}), ContactSequence.parse("stick | stick"), STEP, PERIOD)
    assert FromMotion(published).durations(aim) == pytest.approx([PERIOD])


def test_a_previous_motion_of_another_robot_is_refused(published):
    robot = rimless_wheel()
    aim = Setting(robot, robot.resolve({}), ContactSequence.parse("stick | stick"), STEP, PERIOD)
    with pytest.raises(InputError, match=r"motion of .*th1"):
        FromMotion(published).sample(aim, np.zeros(1))


@pytest.mark.parametrize("guess", [LinearGuess(), Keyframes((0, 1), {"th1": (-0.1, 0.1), "th2": (-3.0, 3.0)})])
def test_a_start_lies_inside_the_bounds_and_is_finite(reference_problem, guess):
    problem = reference_problem(sequence="slip+ stick | slip+", intervals=8, guess=guess)
    transcription = example_nlp(problem.sequence, (5, 8), problem.objective)
    x, limits = initial_point(transcription, problem, guess), bounds(transcription, problem)
    assert np.all(np.isfinite(x))
    assert np.all((limits.x_lower <= x) & (x <= limits.x_upper))


def test_a_start_from_a_solution_is_that_solution(reference_problem, solved):
    gait = solved(sequence="slip+ stick | slip+")
    problem = reference_problem(sequence=gait.sequence, guess=FromMotion(gait.motion))
    transcription = example_nlp(problem.sequence, (10, 40), problem.objective, SCHEMES[1])
    x = initial_point(transcription, problem, problem.guess)
    expected = unknowns(gait, transcription)
    for name in ("angles", "rates", "torque", "duration", (Unknown.SLIDE, 0)):
        index = transcription.variables[name]
        assert x[index] == pytest.approx(expected[index], abs=1e-6), name


@pytest.mark.parametrize(
    ("speed", "step", "expected"),
    [
        (0.633, 0.4713, (0.4713, 0.4713 / 0.633)),
        ((0.6, 0.7), 0.4713, None),
        (None, (0.3, 0.4), None),
        (None, None, None),
    ],
)
def test_the_aim_of_a_guess_lies_within_the_targets(reference_problem, speed, step, expected):
    problem = reference_problem(speed=speed, step_length=step)
    aim = setting(problem)
    assert problem.step_length_range.lower <= aim.step_length <= problem.step_length_range.upper
    assert problem.speed_range.lower <= aim.step_length / aim.period * (1 + 1e-12)
    assert aim.step_length / aim.period <= problem.speed_range.upper * (1 + 1e-12)
    if expected is not None:
        assert (aim.step_length, aim.period) == pytest.approx(expected)


@pytest.mark.parametrize("limit", [0.3, 1.0, math.pi / 2, 3.0])
def test_the_longest_reach_of_straight_legs(limit):
    robot = compass_biped()
    # Both legs at the limit: l (sin + sin), and no farther than legs spread flat.
    expected = 2 * 1.6 * math.sin(min(limit, math.pi / 2))
    assert find_longest_reach(robot, robot.resolve({}), [(-limit, limit)] * 2) == pytest.approx(expected)


@pytest.mark.parametrize(("step", "possible"), [(1.5, True), (3.1, True), (3.2 + 1e-9, False)])
def test_steps_up_to_the_longest_reach_are_possible(step, possible):
    """The corners of the box are 1.92 m apart, legs spread flat 3.2 m."""
    robot = compass_biped()
    assert reaches(robot, robot.resolve({}), [(-2.5, 2.5)] * 2, step) is possible


@pytest.mark.parametrize("limit", [0.6, 1.0, 1.3])
def test_the_longest_reach_of_bent_legs_is_not_in_a_corner(limit):
    """Legs of two times 0.4 m, the knee being an angle between shank and thigh of 0.02 to 1.5 rad."""
    robot, free, knee = load_script(ROOT / "problems" / "five_link.py")().robot, (-limit, limit), (0.02, 1.5)
    reach = find_longest_reach(robot, robot.resolve({}), [free, knee, free, free, knee])
    # Both thighs are at their limits; the stance knee bends until the shank lies flat, the other as little as it may.
    assert reach == pytest.approx(0.4 * (1 + 2 * math.sin(limit) + math.sin(limit - 0.02)), rel=1e-9)
    rng = np.random.default_rng(0)
    angles = rng.uniform([-limit, 0.02, -limit, -limit, 0.02], [limit, 1.5, limit, limit, 1.5], size=(20000, 5))
    q = np.hstack([np.zeros((20000, 2)), angles])
    p = robot.vector(robot.resolve({}))
    found = robot.landing.map(20000)(q.T, 0, p)[0].full()[0]
    assert 0.9 * reach < np.max(found) <= reach


def test_a_reach_that_is_nan_is_refused(compass):
    landing = compass.landing
    q, v, p = (ca.SX.sym(landing.name_in(i), landing.sparsity_in(i)) for i in range(3))
    broken = ca.Function("landing", [q, v, p], [output * np.nan for output in landing(q, v, p)])
    with pytest.raises(InputError, match="not finite within"):
        find_longest_reach(dataclasses.replace(compass, landing=broken), compass.resolve({}), [(-1, 1)] * 2)


def test_a_step_beyond_reach_has_no_touchdown_pose():
    robot = compass_biped()
    with pytest.raises(InputError, match="no touchdown pose with a step length of 4 m"):
        touchdown_pose(robot, robot.resolve({}), 4.0)


def test_the_touchdown_pose_of_a_robot_with_knees_needs_no_general_solver(monkeypatch):
    monkeypatch.setattr("scipy.optimize.least_squares", None)
    robot = load_script(ROOT / "problems" / "five_link.py")().robot
    values, step = robot.resolve({}), 0.4
    q = full_coordinates(touchdown_pose(robot, values, step))
    np.testing.assert_allclose(robot.landing(q, 0, robot.vector(values))[0].full().ravel(), [step, 0], atol=1e-13)


def test_a_gait_for_a_motion_and_a_motion_for_a_gait_are_told_apart(solved):
    gait = solved(sequence="slip+ stick | slip+")
    with pytest.raises(InputError, match=r"FromMotion needs a Motion, got Gait\. Use WarmStart\(gait\)"):
        FromMotion(gait)
    with pytest.raises(InputError, match=r"WarmStart needs a Gait, got Motion\. Use FromMotion\(motion\)"):
        WarmStart(gait.motion)
    with pytest.raises(InputError, match="FromMotion needs a Motion, got str"):
        FromMotion("gait.h5")


def test_scattered_starts_differ_by_seed_and_meet_the_poses_at_both_ends(reference_problem):
    aim = setting(reference_problem())
    time = np.linspace(0, aim.period, 50)
    line, one, again, other = (
        guess.sample(aim, time)
        for guess in (LinearGuess(), RandomPerturbation(1), RandomPerturbation(1), RandomPerturbation(2))
    )
    assert np.array_equal(one.angles, again.angles)
    assert np.max(np.abs(one.angles - other.angles)) > 1e-2
    assert one.angles[:, [0, -1]] == pytest.approx(line.angles[:, [0, -1]], abs=1e-12)
    slopes = np.gradient(one.angles, time, axis=1)
    assert one.rates[:, 1:-1] == pytest.approx(slopes[:, 1:-1], abs=0.05)


@pytest.mark.parametrize("given", [{"seed": -1}, {"seed": 1.5}, {"seed": 1, "amplitude": -0.1}])
def test_waves_that_cannot_be(given):
    with pytest.raises(InputError, match=r"RandomPerturbation\."):
        RandomPerturbation(**given)


def test_a_pose_is_computed_once_for_all_masses_and_again_for_another_leg_length():
    robot = compass_biped()
    values = robot.resolve({})
    first, before = touchdown_pose(robot, values, 0.31), _pose_by_newton.cache_info().misses
    np.testing.assert_array_equal(touchdown_pose(robot, values | {"hip_mass": 7.0, "friction": 0.2}, 0.31), first)
    assert _pose_by_newton.cache_info().misses == before
    # Both legs are symmetric about the vertical: sin(angle) = step / (2 leg length).
    for length in (1.6, 0.8):
        pose = touchdown_pose(robot, values | {"leg_length": length, "leg_com": 0.4}, 0.31)
        np.testing.assert_allclose(np.sort(np.abs(pose)), np.arcsin(0.31 / (2 * length)), atol=1e-12)
