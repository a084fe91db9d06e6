"""Motion: lengths, distances and channels of a record made by hand."""

import numpy as np
import pytest

from gaitopt import Mode


@pytest.fixture
def walk(segment, jump, motion):
    place = np.zeros((4, 3))
    place[0] = [0.1, 0.13, 0.15]
    slide = segment(np.array([0.0, 0.1, 0.2]), mode=Mode.SLIP_FORWARD, q=place)
    held = segment(np.array([0.2, 0.5]), q=np.repeat(place[:, -1:], 2, axis=1))
    back = np.zeros((4, 2))
    back[0] = [0.65, 0.61]
    again = segment(np.array([0.5, 0.9]), mode=Mode.SLIP_BACKWARD, step=1, q=back)
    jumps = [
        jump(0.5, mode=Mode.SLIP_BACKWARD, q_next=back[:, 0]),
        jump(0.9, step=1, q_next=np.array([1.1, 0, 0, 0])),
    ]
    return motion([slide, held, again], jumps)


def test_period_travel_and_slide(walk):
    assert walk.period == pytest.approx(0.9)
    assert walk.travel == pytest.approx(1.0)
    assert walk.foot_slide == pytest.approx(0.05 - 0.04)
    assert [segment.duration for segment in walk.segments] == pytest.approx([0.2, 0.3, 0.4])
    assert walk.jumps[0].ratio == pytest.approx(-0.25)


def test_travel_without_touchdown_is_the_slide(segment, motion):
    q = np.zeros((4, 2))
    q[0] = [1.0, 1.2]
    assert motion([segment(np.array([0.0, 1.0]), q=q)]).travel == pytest.approx(0.2)


def test_channels_join_along_time(walk):
    np.testing.assert_array_equal(walk.channel("time"), [0, 0.1, 0.2, 0.2, 0.5, 0.5, 0.9])
    assert walk.channel("q").shape == (4, 7)
    assert walk.channel("points").shape == (2, 3, 7)


def test_sequences_of_steps(walk, segment, motion):
    assert str(walk.sequence()) == "slip+ stick | slip-"
    assert str(walk.sequence(1)) == "slip- | stick"
    assert walk.sequence(2) is None
    assert motion([segment(np.array([0.0, 1.0]))]).sequence() is None


def test_a_step_that_starts_stuck_and_lands_sliding_has_a_sequence(segment, jump, motion):
    """Not the contact sequence of a periodic gait, but of a step that was walked."""
    walk = motion([segment(np.array([0.0, 1.0]))], [jump(1.0, mode=Mode.SLIP_FORWARD)])
    assert str(walk.sequence()) == "stick | slip+"


def test_a_motion_that_never_began(motion):
    never = motion([])
    assert (never.period, never.travel, never.foot_slide, never.sequence()) == (0.0, 0.0, 0, None)
