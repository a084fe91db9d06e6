"""Walks of several steps: nothing jumps but what an impact makes jump."""

import itertools

import numpy as np
import pytest

from gaitopt import Stop, simulate


@pytest.fixture(params=["compass", "wheel"])
def walk(request, compass_walk, wheel_walk, gait_b):
    if request.param == "compass":
        return compass_walk(gait_b["z"], mu=0.14, steps=4)
    return wheel_walk(1.12, xd=0.7, mu=0.3, steps=18)


def test_time_runs_on(walk):
    assert walk.stop is Stop.STEPS_DONE
    segments = walk.motion.segments
    assert segments[0].time[0] == 0.0
    assert np.all(np.diff(walk.motion.channel("time")) >= 0)
    for before, after in itertools.pairwise(segments):
        assert after.time[0] == before.time[-1]
    assert [jump.time for jump in walk.motion.jumps] == [
        max(segment.time[-1] for segment in segments if segment.step == jump.step) for jump in walk.motion.jumps
    ]


def test_states_run_on_within_a_step_and_jump_as_recorded_between(walk):
    segments = walk.motion.segments
    for before, after in itertools.pairwise(segments):
        if before.step == after.step:
            np.testing.assert_array_equal(after.q[:, 0], before.q[:, -1])
            np.testing.assert_allclose(after.v[:, 0], before.v[:, -1], atol=1e-13)
        else:
            jump = walk.motion.jumps[before.step]
            np.testing.assert_array_equal(jump.q, before.q[:, -1])
            np.testing.assert_array_equal(jump.v_minus, before.v[:, -1])
            np.testing.assert_array_equal(after.q[:, 0], jump.q_next)
            np.testing.assert_array_equal(after.v[:, 0], jump.v_next)


def test_the_body_does_not_move_at_touchdown(walk):
    """The same points in space are drawn before and after the legs change names."""
    segments = walk.motion.segments
    for before, after in itertools.pairwise(segments):
        if before.step != after.step:
            np.testing.assert_allclose(after.points[:, 0, 0], before.points[:, -1, -1], atol=1e-12)
            np.testing.assert_allclose(after.points[:, 1, 0], before.points[:, 1, -1], atol=1e-12)
            assert after.potential[0] == pytest.approx(before.potential[-1], rel=1e-12)
            lost = before.kinetic[-1] - after.kinetic[0]
            assert lost == pytest.approx(walk.motion.jumps[before.step].energy_lost, rel=1e-9)


def test_the_feet_stay_on_the_ground(walk):
    np.testing.assert_allclose(walk.motion.channel("q")[1], 0.0, atol=1e-12)
    np.testing.assert_array_equal(walk.motion.channel("v")[1], 0.0)


def test_travel_is_chords_and_slides(walk):
    """Each step carries the foot by the chord between the feet; between steps it may slide."""
    chords = sum(jump.q_next[0] - jump.q[0] for jump in walk.motion.jumps)
    assert walk.motion.travel == pytest.approx(chords + walk.motion.foot_slide, rel=1e-12)


def test_steps_one_by_one_are_the_same_walk(compass_walk, gait_b):
    together = compass_walk(gait_b["z"], mu=0.14, steps=3)
    z = gait_b["z"]
    for jump in together.motion.jumps:
        alone = compass_walk(z, mu=0.14).motion.jumps[0]
        z = (alone.q_next[2], *alone.v_next[2:])
        np.testing.assert_allclose(z, [jump.q_next[2], *jump.v_next[2:]], atol=1e-11)


def test_where_the_walk_starts_does_not_matter(compass, engine, compass_walk, gait_b):
    here = compass_walk(gait_b["z"], mu=0.14)
    parameters = here.motion.parameters
    z = gait_b["z"]
    there = simulate(compass, [7.0, 0.5, z[0], z[0]], [0, 0, z[1], z[2]], parameters, engine=engine)
    assert there.motion.travel == pytest.approx(here.motion.travel, rel=1e-12)
    np.testing.assert_allclose(there.motion.jumps[0].v_next, here.motion.jumps[0].v_next, atol=1e-11)
