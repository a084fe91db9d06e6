"""Round feet in motions: where they touch the ground, what files keep of them, and the arcs that are drawn."""

from dataclasses import replace

import numpy as np
import pytest

from gaitopt import load, save
from gaitopt.motion.animation_frames import AnimationFrames
from gaitopt.motion.foot_arc import MARKS, FootArc, figure_points, find_foot_arc
from gaitopt.motion.link_roles import classify_links


@pytest.fixture(scope="module")
def motion(rolling_gait):
    return rolling_gait.motion


def test_the_foot_touches_the_ground_below_the_centre_of_its_rim(motion):
    for segment in motion.segments:
        x, y, radius, angle = segment.rims[:, 0]
        assert radius == pytest.approx(0.3)
        np.testing.assert_allclose(segment.contact, [x, np.zeros(x.size)], atol=1e-15)
        np.testing.assert_allclose(y, radius)
        np.testing.assert_allclose(x - segment.q[0], radius * angle, atol=1e-15)  # less the slide, it has rolled


def test_the_next_step_touches_where_the_landing_foot_came_down(motion):
    landed = motion.segments[-1].rims[:, 1, -1]
    start = motion.segments[0].rims[:, 0, 0] + [motion.travel, 0, 0, 0]
    np.testing.assert_allclose(landed, start, atol=1e-7)


def test_files_keep_the_rims_of_round_feet(rolling_gait, tmp_path):
    again = load(save(rolling_gait, tmp_path / "gait.h5")).motion
    for segment, copy in zip(rolling_gait.motion.segments, again.segments, strict=True):
        np.testing.assert_array_equal(copy.rims, segment.rims)
        np.testing.assert_array_equal(copy.contact, segment.contact)


def test_point_feet_have_no_rims_and_touch_where_they_are(slipping, tmp_path):
    again = load(save(slipping, tmp_path / "gait.h5")).motion
    for segment in again.segments:
        assert segment.rims is None
        assert segment.contact is not segment.points
        np.testing.assert_array_equal(segment.contact, segment.q[:2])
        assert figure_points(again, segment) is segment.points
    assert find_foot_arc(again) is None


def test_the_arc_covers_every_contact(motion):
    arc = find_foot_arc(motion)
    for segment in motion.segments:
        outline = arc.outline(segment.rims)
        assert outline.shape == (2, 49, 2, segment.time.size)
        np.testing.assert_allclose(outline[1, :, 0].min(axis=0), 0, atol=2e-4)
        heel, toe = outline[0, 0, 0], outline[0, -1, 0]
        assert np.all((heel < segment.contact[0]) & (segment.contact[0] < toe))
    assert figure_points(motion, segment).shape == (2, 3 + 2 * 49, segment.time.size)


def test_marks_turn_with_the_foot_and_start_on_its_rim():
    arc = FootArc(np.pi)
    marks = arc.marks(np.array([1.0, 0.5, 0.5, 0.0]))
    assert marks.shape == (2, MARKS, 2)
    distance = np.linalg.norm(marks - np.array([1.0, 0.5])[:, None, None], axis=0)
    np.testing.assert_allclose(distance, np.tile([0.5, 0.43], (MARKS, 1)))
    quarter = arc.marks(np.array([1.0, 0.5, 0.5, np.pi / 2])) - np.array([1.0, 0.5])[:, None, None]
    before = marks - np.array([1.0, 0.5])[:, None, None]
    np.testing.assert_allclose(quarter, [before[1], -before[0]], atol=1e-15)  # clockwise


def test_a_wheel_that_has_turned_is_drawn_whole(motion):
    rims = motion.segments[0].rims + np.array([0, 0, 0, 9.0])[:, None, None]
    turned = replace(motion, segments=(replace(motion.segments[0], rims=rims),))
    assert find_foot_arc(turned).half_opening == np.pi


def test_legs_are_told_apart_by_the_true_contact_points(motion):
    roles = classify_links(motion)
    assert (roles.stance_foot, roles.swing_foot, roles.stance, roles.swing) == (0, 2, ((0, 1),), ((1, 2),))


def test_marks_of_slides_begin_at_the_contact_and_are_as_long_as_the_slide(motion):
    film = AnimationFrames(motion, steps=2, rate=60, slow=2.0)
    slides = film.slides(film.frame(len(film) - 1))
    start = motion.segments[0].contact[0, 0]
    assert [slide.start for slide in slides] == pytest.approx([start, start + motion.travel])
    assert [slide.end - slide.start for slide in slides] == pytest.approx([motion.foot_slide] * 2)
    assert start < -0.05  # behind the place where the unrolled foot would be
    middle = film.frame(5)
    assert film.slides(middle)[0].end - start == pytest.approx(middle.slides[0])
    np.testing.assert_allclose(middle.places[:, 0], [middle.rims[0, 0], 0], atol=1e-15)


def test_the_second_step_begins_where_the_first_ended(motion):
    film = AnimationFrames(motion, steps=2, rate=200, slow=4.0)
    frames = [film.frame(number) for number in range(len(film))]
    first = next(number for number, frame in enumerate(frames) if frame.step == 1)
    np.testing.assert_allclose(frames[first].rims, frames[first - 1].rims[:, ::-1], atol=5e-3)
