"""AnimationFrames: which instant a frame shows."""

from dataclasses import replace

import numpy as np
import pytest

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.animation_frames import SHORTEST_SLIP, AnimationFrames
from gaitopt.motion.link_roles import classify_links


@pytest.fixture(scope="module")
def film(slipping):
    return AnimationFrames(slipping.motion, steps=3, rate=100, slow=2.0)


def test_time_runs_from_the_start_to_the_end_of_the_last_step(film, slipping):
    times = [film.frame(number).time for number in range(len(film))]
    assert times[0] == 0
    assert np.all(np.diff(times) > 0)
    assert times[-1] == pytest.approx(3 * slipping.period, abs=0.02)


def test_a_short_slip_is_slowed_until_it_can_be_seen(film):
    frames = [film.frame(number) for number in range(len(film))]
    slipping = [frame for frame in frames if frame.mode is Mode.SLIP_FORWARD and frame.step == 0]
    assert len(slipping) == pytest.approx(SHORTEST_SLIP * 100, abs=1)
    assert slipping[0].slowness == pytest.approx(SHORTEST_SLIP / film.motion.segments[0].duration)
    assert {round(frame.slowness, 9) for frame in frames if frame.mode is Mode.STICK} == {2.0}
    assert [replace(slipping[0], slowness=value).pace for value in (2.0, 25.4, 254.0)] == ["2", "25", "254"]


def test_the_landing_foot_becomes_the_stance_foot(film, slipping):
    skeleton = classify_links(slipping.motion)
    frames = [film.frame(number) for number in range(len(film))]
    first = next(number for number, frame in enumerate(frames) if frame.step == 1)
    before, after = frames[first - 1].points, frames[first].points
    np.testing.assert_allclose(before[:, skeleton.swing_foot], after[:, skeleton.stance_foot], atol=5e-3)
    np.testing.assert_allclose(before[:, skeleton.stance_foot], after[:, skeleton.swing_foot], atol=5e-3)
    assert frames[first].touchdown
    assert not frames[first - 1].touchdown


def test_samples_are_met(film, slipping):
    np.testing.assert_array_equal(film.motion.segments[0].forces[0], slipping.motion.segments[0].force)
    segment = film.motion.segments[0]
    frame = film.frame(0)
    np.testing.assert_allclose(frame.points, segment.points[:, :, 0])
    np.testing.assert_allclose(frame.forces, segment.forces[..., 0])


def test_slides_of_past_steps_stay_on_the_ground(film, slipping):
    last = film.frame(len(film) - 1)
    slides = film.slides(last)
    travel, slid = film.motion.travel, slipping.motion.foot_slide
    assert [slide.start for slide in slides] == pytest.approx([0, travel, 2 * travel])
    assert [slide.end - slide.start for slide in slides] == pytest.approx([slid] * 3)
    assert film.slides(film.frame(0))[0].end == film.slides(film.frame(0))[0].start


def test_no_slides_without_slip(sticking):
    film = AnimationFrames(sticking.motion, steps=2, rate=10, slow=1.0)
    assert film.slides(film.frame(len(film) - 1)) == []
