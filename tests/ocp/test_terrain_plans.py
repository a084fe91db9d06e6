"""Plans of several steps on a terrain: footholds, energy, and replay on the same ground."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from gaitopt import GaitProblem, InputError, Limits, Status, WarmStart, compass_biped, ledger, solve
from gaitopt.cli.script import load_script
from gaitopt.model import Terrain
from gaitopt.ocp import MultiStepProblem, load_steps, save_steps, solve_steps, state_after_touchdown
from gaitopt.ocp.multistep import multistep_solver
from gaitopt.ocp.multistep.foothold_ground import find_footholds, passes_change, rise_between
from gaitopt.ocp.multistep.multistep_gait import join_steps
from gaitopt.ocp.multistep.terrain_check import find_scuffs
from gaitopt.ocp.transcription.swing_terrain import smooth_height
from gaitopt.plot.ground_line import find_profile
from gaitopt.report.markup import to_html
from gaitopt.report.multistep_section import multistep_card
from gaitopt.simulation import ScipyEngine, verify_steps

WEIGHT = 10 * 9.8
"""Of two legs of 4 kg and a hip of 2 kg [N]."""

STEP = GaitProblem(
    robot=compass_biped(),
    sequence="stick | stick",
    friction=0.5,
    speed=0.6,
    step_length=0.45,
    limits=Limits(torque=30, longest_step=3),
    objective="torque_squared",
)


@pytest.fixture(scope="module")
def periodic():
    return solve(STEP)


def walk(periodic, terrain, sequences=("stick | stick",) * 3, **changes):
    """Return the problem of some steps from the periodic gait back to it."""
    free = STEP.replace(speed=None, step_length=None, guess=WarmStart(periodic))
    state = state_after_touchdown(periodic)
    steps = tuple(free.replace(sequence=sequence) for sequence in sequences)
    return MultiStepProblem(steps=steps, terrain=terrain, **{"start": state, "end": state, **changes})


def solve_and_replay(problem):
    gait = verify_steps(solve_steps(problem))
    assert gait.status.ok, gait.verification
    assert gait.verification.state_error < 1e-6
    assert gait.verification.energy_residual < 1e-9
    return gait


@pytest.fixture(scope="module")
def down(periodic):
    """Return a gait that steps down by 2 cm."""
    return solve_and_replay(walk(periodic, Terrain(steps=[(0.7, -0.02)])))


def test_level_terrain_is_the_plane(periodic):
    level, plane = (solve_steps(walk(periodic, terrain)) for terrain in (Terrain(), None))
    assert level.objective == pytest.approx(plane.objective, rel=1e-9)


def test_energy_and_heights_of_a_step_down(down):
    motion = down.motion
    places = np.array([jump.q_next[:2] for jump in motion.jumps])
    np.testing.assert_allclose(places[:, 1], [0, -0.02, -0.02], atol=1e-9)
    assert places[0, 0] <= 0.65 < 0.75 <= places[1, 0]  # a foot keeps 5 cm from the edge
    assert ledger(motion).gravity == pytest.approx(
        WEIGHT * 0.02, rel=1e-8
    )  # the same pose in the beginning and the end
    assert motion.travel == pytest.approx(places[-1, 0])
    stepwise = verify_steps(down, stepwise=True)
    assert stepwise.verification.passed
    assert 0 < stepwise.verification.state_error < 1e-9
    assert stepwise.verification.energy_residual < 1e-9
    stance = np.concatenate([segment.contact[1] for segment in motion.segments])
    assert set(stance.round(9)) == {0.0, -0.02}


def test_the_start_pose_has_both_feet_on_the_same_piece(periodic):
    problem = walk(periodic, Terrain(steps=[(0.3, -0.02)]), ("stick | stick",), end={})
    gait = solve_and_replay(problem)
    np.testing.assert_allclose(
        gait.plans[0].segments[0].q[2:, 0], [problem.start["th1"], problem.start["th2"]], atol=1e-8
    )


def test_an_obstacle_between_two_footholds_counts_also_behind_the_stance_foot(periodic):
    """A bump that is 2 cm high: the first step of 0.45 m clears it, and the foot drags through it in the second."""
    bump = Terrain(steps=[(0.25, 0.02), (0.3, -0.02)])
    problem = walk(periodic, bump, ("stick | stick",) * 2)
    motion = join_steps([periodic.motion] * 2, terrain=bump)
    motion = replace(motion, parameters=motion.parameters | {"rise": 0.0})
    (scuff,) = find_scuffs(problem, motion).items()
    assert scuff[0] == 1
    assert 0.01 < scuff[1][0] <= 0.02
    assert 0.25 <= scuff[1][1] <= 0.3
    level = Terrain(steps=[(0.25, 0.0)])
    assert not find_scuffs(walk(periodic, level, ("stick | stick",) * 2), motion)


@pytest.mark.slow
def test_the_swing_foot_clears_the_edge_of_a_step_up(periodic, monkeypatch):
    problem = walk(periodic, Terrain(steps=[(0.7, 0.015)]))
    gait = solve_and_replay(problem)
    assert not find_scuffs(problem, gait.motion)
    monkeypatch.setattr(multistep_solver, "find_scuffs", lambda *_: {})
    free = solve_steps(problem)
    assert list(find_scuffs(problem, free.motion)) == [1]
    assert free.objective < gait.objective


def test_a_swing_foot_that_remains_below_the_terrain_makes_the_plan_inaccurate(down, monkeypatch):
    monkeypatch.setattr(multistep_solver, "find_scuffs", lambda *_: {1: (0.01, 0.7)})
    monkeypatch.setattr(multistep_solver, "MOST_DOUBLINGS", 0)
    gait = solve_steps(down.problem)
    assert gait.status is Status.PLAN_INACCURATE
    assert "below the terrain in steps [1]" in gait.message


def test_a_clearance_counts_in_the_steps_onto_another_height_and_away_from_it():
    step = STEP.replace(speed=None, limits=Limits(torque=30, clearance=0.01))
    problem = MultiStepProblem(steps=(step,) * 4, start={}, end={}, terrain=Terrain(steps=[(0.7, 0.02)]))
    assert multistep_solver._steps_with_clearance(problem) == {1, 2}


@pytest.mark.slow
def test_a_walker_with_knees_steps_up_with_clearance():
    script = load_script(Path(__file__).parents[2] / "problems" / "five_link.py")
    step = script(intervals=40, sequence="stick | stick", friction=0.8)
    periodic = solve(step)
    free = step.replace(speed=None, step_length=None, guess=WarmStart(periodic))
    problem = MultiStepProblem(
        steps=(free, free),
        start=state_after_touchdown(periodic),
        end={},
        terrain=Terrain(steps=[(0.6, 0.01)]),
        footholds={1: (0.3, 0.48), 2: (0.7, 0.9)},
    )
    # Errors of the state grow by a factor of 50 000 in a step, and those of the rates by another 100 at the impact.
    # With its default tolerance of 1e-12 the reference engine adds up to 1e-5 to the 4e-6 of the Taylor engine.
    gait = verify_steps(solve_steps(problem), stepwise=True, engine=ScipyEngine(relative=1e-13))
    assert gait.verification.passed
    assert gait.verification.state_error < 1e-5
    segment = gait.motion.segments[1]
    p = problem.robot.vector(gait.plans[1].parameters)
    feet = np.asarray(problem.robot.landing.map(segment.time.size)(segment.q, 0, p)[0])
    stance = segment.q[0, 0]
    beside = np.abs(feet[0] - stance) < 0.02
    assert feet[1, beside].min() > 0.9 * step.limits.clearance


@pytest.mark.slow
def test_a_foot_slips_down_a_slippery_ramp(periodic, tmp_path):
    terrain = Terrain(ramps=[(0.6, 1.4, -0.05)], patches=[(0.6, 1.1, 0.05)])
    sequences = ("stick | stick",) * 2 + ("slip+ stick | slip+",) + ("stick | stick",) * 2
    footholds = {2: (0.75, 0.9), 3: (1.15, 1.3), 4: (1.45, 2.0)}
    gait = solve_and_replay(walk(periodic, terrain, sequences, footholds=footholds))
    grounds = [(plan.parameters["friction"], plan.parameters["incline"]) for plan in gait.plans]
    ramp = -np.arctan(0.05 / 0.8)
    np.testing.assert_allclose(grounds, [(0.5, 0), (0.5, 0), (0.05, ramp), (0.5, ramp), (0.5, 0)], atol=1e-15)
    slip = next(segment for segment in gait.motion.segments if segment.mode.slips)
    np.testing.assert_allclose(slip.contact[1], -0.05 * (slip.contact[0] - 0.6) / 0.8, atol=1e-9)
    assert np.ptp(slip.contact[0]) > 0.05

    loaded = load_steps(save_steps(gait, tmp_path / "ramp.h5"))
    assert loaded.problem.terrain == terrain
    assert verify_steps(loaded).verification.passed
    assert loaded.motion.terrain == terrain
    steep = gait.problem.replace(terrain=Terrain(ramps=[(0.6, 1.4, -0.06)], patches=[(0.6, 1.1, 0.05)]))
    assert not verify_steps(gait.replace_fields(problem=steep)).verification.passed


@pytest.mark.parametrize("terrain", [Terrain(), Terrain(patches=[(0.8, 1.1, 0.3)]), Terrain(patches=[(0.6, 1.1, 0.3)])])
def test_a_gait_from_its_file_has_the_same_ground(periodic, tmp_path, terrain):
    """A foothold may be next to a patch, or on it; the last one is behind it, where the stated friction counts."""
    gait = solve_steps(walk(periodic, terrain, footholds={2: (0.4, 1.2)}))
    loaded = load_steps(save_steps(gait, tmp_path / "walk.h5"))
    assert loaded.problem.ground == gait.problem.ground
    assert loaded.problem.footholds == gait.problem.footholds
    for number, stated in enumerate(gait.problem.resolved_steps):
        assert loaded.problem.resolved_steps[number].values == stated.values
    assert loaded.problem.last_friction == gait.problem.last_friction == 0.5


def test_a_foothold_with_one_bound_is_one_step_ahead_within_it():
    step = STEP.replace(speed=None)
    problem = MultiStepProblem(
        steps=(step, step), start={}, end={}, terrain=Terrain(steps=[(0.5, 0.02)]), footholds={1: (-np.inf, 0.9)}
    )
    assert problem.ground[1].expected == 0.45
    ahead = problem.replace(footholds={1: (0.56, np.inf)}).ground[1]
    assert (ahead.expected, ahead.piece.height) == (0.56, 0.02)
    unknown = STEP.replace(step_length=None)
    assert problem.replace(steps=(unknown,), footholds={1: (-np.inf, 0.4)}).ground[1].expected == 0.4


def test_the_replay_reports_a_swing_foot_below_the_terrain(down):
    block = Terrain(steps=[(0.7, -0.02), (0.72, 0.05), (0.74, -0.05)])
    places = {1: (0.3, 0.5), 2: (0.8, 1.2)}
    verification = verify_steps(
        down.replace_fields(problem=down.problem.replace(terrain=block, footholds=places))
    ).verification
    assert not verification.passed
    assert "steps[1] is up to" in verification.reasons[0]
    assert "below the terrain" in verification.reasons[0]


def test_the_profile_of_a_ramp_is_drawn():
    profile = find_profile(Terrain(ramps=[(1.0, 2.0, 0.1)]), 0.5, 1.5)
    np.testing.assert_allclose(profile, [[0.5, 1.0, 1.0, 1.5], [0, 0, 0, 0.05]], atol=1e-15)


def test_the_parts_of_a_straight_ramp_are_no_change_of_the_ground():
    terrain = Terrain(ramps=[(0.3, 0.9, 0.07)], patches=[(0.5, 0.7, 0.2)])
    step = STEP.replace(step_length=0.2)
    footholds = find_footholds(terrain, (step,) * 4, {}, {})
    assert [terrain.pieces.index(foothold.piece) for foothold in footholds] == [0, 0, 1, 2, 3]
    assert [passes_change(terrain, footholds, number) for number in range(1, 4)] == [True, False, False]
    assert rise_between(footholds[2].piece, footholds[3].piece) == (0, 0)


def test_the_smooth_profile_of_a_narrow_pit_has_no_bump():
    places = np.linspace(0.9, 1.1, 401)
    for steps in ([(1.0, -0.05), (1.03, 0.05)], [(1.0, -0.05), (1.03, 0.02)]):
        terrain = Terrain(steps=steps)
        profile = np.array([float(smooth_height(terrain, place)) for place in places])
        exact = np.array([terrain.height(place) for place in places])
        assert np.all(profile >= exact - 1e-15)
        assert profile.max() <= 1e-15


def test_the_rise_of_each_step_is_in_the_table(down):
    assert "rise [m]" in to_html(multistep_card(down))


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"start": None, "end": None}, "does not repeat"),
        ({"terrain": Terrain(steps=[(0.02, 0.1)])}, "Foothold 0 must be between 0 and 0 m"),
        ({"footholds": {1: (0.69, 0.72)}}, "leaves no position"),
        ({"footholds": {4: (0, 1)}}, r"one of \[1, 2, 3\]"),
        ({"terrain": True}, "terrain must be a Terrain"),
    ],
)
def test_problems_that_are_refused(down, changes, message):
    with pytest.raises(InputError, match=message):
        down.problem.replace(**changes)


def test_steps_of_unknown_length_and_of_different_slopes_are_refused():
    free = STEP.replace(step_length=None)
    with pytest.raises(InputError, match=r"needs a step_length, a guess from a motion, or bounds"):
        MultiStepProblem(steps=(free,), start={}, end={}, terrain=Terrain(steps=[(0.3, 0.01)]))
    with pytest.raises(InputError, match="all steps need the same slope"):
        MultiStepProblem(steps=(STEP, STEP.replace(slope=0.02)), start={}, end={})
