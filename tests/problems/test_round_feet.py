"""Round feet in every verb, from the problem script a user runs."""

import ctypes
import json
import subprocess

import numpy as np
import pytest

from gaitopt import (
    GainSearchOptions,
    MultipleShooting,
    PushTest,
    SettlingCriterion,
    basin,
    compare,
    feedforward,
    joint_pd,
    load,
    lqr,
    replay,
    save,
    search,
    solve,
    step_lqr,
    sweep,
    tune_feedback,
    verify,
    write_c,
    write_csv,
    write_torques,
)
from gaitopt.model.contacts.mode import PHYSICAL
from gaitopt.ocp.statement.touchdown_pose import find_longest_reach, touchdown_pose
from gaitopt.study import ending_labels
from gaitopt.tuning import controller_family_named
from tests.export.test_c_code import CC, call, compiled

FLAT = {"friction": 0.3, "speed": 0.7, "step_length": 0.4, "sequence": "stick | stick"}
METHODS = [None, MultipleShooting(intervals=30)]


def rolling_problem(rolling, radius, **changes):
    """Return a problem with the legs' masses halfway between hip and centre of the arc."""
    parameters = {**rolling.parameters, "foot_radius": radius, "leg_com": (1 + radius) / 2}
    changes = {name: value for name, value in changes.items() if value is not None}
    return rolling.replace(parameters=parameters, **{**FLAT, **changes})


def test_the_script_finds_a_gait_that_slips_and_rolls(rolling_gait):
    assert rolling_gait.status.ok
    assert rolling_gait.verification.passed
    assert str(rolling_gait.sequence) == "slip+ stick | slip+"
    assert rolling_gait.motion.foot_slide > 0.02
    assert rolling_gait.step_length == pytest.approx(0.5)
    ledger = rolling_gait.energy
    assert ledger.actuator + ledger.gravity == pytest.approx(ledger.impact_loss + ledger.friction_loss, abs=1e-7)


@pytest.mark.parametrize("transcription", METHODS, ids=["collocation", "shooting"])
def test_larger_feet_cost_less(rolling, transcription):
    gaits = {}
    for radius in (0.0, 0.2, 0.4):
        problem = rolling_problem(rolling, radius, transcription=transcription)
        gaits[radius] = verify(solve(problem))
        assert gaits[radius].status.ok, gaits[radius].solver.violations
    costs = [gait.cost_of_transport for gait in gaits.values()]
    assert costs == pytest.approx([0.0297, 0.0139, 0.0084], abs=6e-5)


@pytest.mark.parametrize("transcription", METHODS, ids=["collocation", "shooting"])
def test_slip_is_solved_by_both_transcriptions(rolling, transcription):
    problem = rolling_problem(rolling, 0.4, friction=0.1, sequence="slip+ stick | slip+", transcription=transcription)
    gait = verify(solve(problem))
    assert gait.status.ok, gait.solver.violations
    assert gait.cost_of_transport == pytest.approx(0.0077, abs=6e-5)


def test_poses_at_touchdown_are_as_far_apart_as_the_feet_roll(rolling):
    values = rolling.robot.resolve(rolling.parameters)
    for step in (0.2, 0.6):
        th1, th2 = touchdown_pose(rolling.robot, values, step)
        assert th1 == pytest.approx(th2)
        assert 2 * 0.7 * np.sin(th1) + 2 * 0.3 * th1 == pytest.approx(step)
    reach = find_longest_reach(rolling.robot, values, [(-0.8, 0.8), (-0.8, 0.8)])
    assert reach == pytest.approx(2 * 0.7 * np.sin(0.8) + 2 * 0.3 * 0.8)


def test_it_replays_two_steps(rolling, rolling_gait):
    walk = replay(rolling_gait, steps=2)
    assert [str(walk.motion.sequence(step)) for step in range(2)] == ["slip+ stick | slip+"] * 2


@pytest.mark.slow
def test_sweep_over_the_radius(rolling, tmp_path):
    problem = rolling_problem(rolling, 0.2)
    path = tmp_path / "radii.nc"
    found = sweep(problem, {"foot_radius": [0.1, 0.2, 0.3]}, starts=1, path=path)
    assert set(found.status.values.ravel()) == {"solved"}
    assert np.all(np.diff(found.cost_of_transport.values.ravel()) < 0)


def test_search_ranks_sequences(rolling):
    found = search(rolling, sequences=["stick | stick", "slip+ stick | slip+"], starts=1)
    assert [str(finding.sequence) for finding in found.findings] == ["slip+ stick | slip+", "stick | stick"]


@pytest.mark.slow
def test_laws_are_tuned(rolling, rolling_gait):
    family = controller_family_named("computed-torque", rolling.robot, rolling_gait.motion, torque_limit=40)
    options = GainSearchOptions(samples=2, starts=1, evaluations=2)
    tuned = tune_feedback(rolling_gait, family, search=options, test=PushTest(starts=1))
    assert tuned.radius_after < tuned.radius_before
    assert tuned.radius_after < 1


def test_the_basin_of_the_passive_walker(passive_rolling):
    walk = passive_rolling
    start = {"th1": -0.18944, "th2_rate": -0.18761}
    axes = {"th1_rate": [0.1, 0.239, 0.6]}
    found = basin(walk.robot, walk.parameters | start, axes, criterion=SettlingCriterion(steps=40, tolerance=1e-3))
    assert ending_labels(found).tolist()[1] == "stick | stick"


def test_gaits_on_feet_of_several_radii_are_compared(rolling, rolling_gait):
    other = solve(rolling_problem(rolling, 0.2))
    records = compare({"slips": rolling_gait, "sticks": other}, multipliers=True).records()
    assert [record["label"] for record in records] == ["slips", "sticks"]


def test_tables_hold_the_slide_coordinate_and_the_torques(rolling, rolling_gait, tmp_path):
    lines = write_csv(rolling_gait.motion, tmp_path / "gait.csv").read_text(encoding="utf-8").splitlines()
    rows = [dict(zip(lines[0].split(","), line.split(","), strict=True)) for line in (lines[1], lines[-1])]
    assert float(rows[1]["x_m"]) - float(rows[0]["x_m"]) == pytest.approx(rolling_gait.motion.foot_slide)
    law = joint_pd(rolling.robot, rolling_gait.motion, stiffness=50, damping=5)
    table = json.loads(write_torques(rolling_gait.motion, tmp_path / "gait.json", law=law).read_text(encoding="utf-8"))
    assert table


@compiled
@pytest.mark.parametrize("make", [feedforward, lqr])
def test_its_c_code_has_the_accelerations_of_the_model(rolling, rolling_gait, rng, tmp_path, make):
    robot, parameters = rolling.robot, rolling_gait.motion.parameters
    law = make(robot, rolling_gait.motion)
    source = write_c(robot, law, parameters, tmp_path / "walker.c")
    flags = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-shared", "-fPIC"]
    subprocess.run([CC, *flags, str(source), "-o", str(tmp_path / "walker.so"), "-lm"], check=True)
    library, p = ctypes.CDLL(str(tmp_path / "walker.so")), robot.vector(parameters)
    for mode in PHYSICAL:
        q, v, u = rng.normal(size=4), rng.normal(size=4), rng.normal(size=2)
        expected = robot.acceleration[mode](q, v, u, p)
        outputs = call(getattr(library, f"walker_acceleration_{mode.name.lower()}"), [q, v, u, p], [4, 2])
        for found, right in zip(outputs, expected, strict=True):
            np.testing.assert_allclose(found, np.asarray(right).ravel(), rtol=1e-10, atol=1e-10)


def test_step_to_step_feedback_is_designed(rolling, rolling_gait):
    assert step_lqr(rolling.robot, rolling_gait.motion).name == "step_lqr"


def test_a_file_of_it_is_read_without_the_robot(rolling_gait, tmp_path):
    again = load(save(rolling_gait, tmp_path / "gait.h5"))
    assert again.motion.segments[0].rims.shape[:2] == (4, 2)
