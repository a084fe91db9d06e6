"""LinkRoles: legs are identified from the points and links of a motion alone."""

from dataclasses import replace

import numpy as np

from gaitopt.motion.link_roles import assign_links, classify_links, is_drawable, tilt


def test_compass_has_a_leg_each_and_a_hip(slipping):
    skeleton = classify_links(slipping.motion)
    assert (skeleton.stance, skeleton.swing, skeleton.body) == (((0, 1),), ((1, 2),), ())
    assert (skeleton.stance_foot, skeleton.swing_foot, skeleton.joints) == (0, 2, (1,))


def test_knees_belong_to_their_legs_and_a_torso_to_the_body(slipping):
    # Points: foot, knee, hip, knee, foot, head; the coordinates of all but the feet do not matter.
    segments = tuple(replace(part, points=part.points[:, [0, 1, 1, 1, 2, 1]]) for part in slipping.motion.segments)
    links = ((0, 1), (1, 2), (2, 3), (3, 4), (2, 5))
    points = ("foot", "knee", "hip", "other knee", "other foot", "head")
    skeleton = classify_links(replace(slipping.motion, segments=segments, links=links, points=points))
    assert skeleton.stance == ((0, 1), (1, 2))
    assert skeleton.swing == ((2, 3), (3, 4))
    assert skeleton.body == ((2, 5),)
    assert skeleton.joints == (2,)


def test_downhill_is_to_the_right_and_down():
    np.testing.assert_allclose(tilt(np.array([[1.0, 0.0], [0.0, 1.0]]), np.pi / 6).T[0], [np.sqrt(3) / 2, -0.5])


def test_nan_is_not_drawable(slipping, not_a_number):
    assert is_drawable(slipping.motion)
    assert not is_drawable(not_a_number.motion)


def test_a_leg_with_heel_and_toe_has_one_colour():
    """Hip 0, ankle 1, heel 2, toe 3, and another leg without a foot, with knee 4 and end 5."""
    links = ((0, 1), (1, 2), (1, 3), (0, 4), (4, 5))
    assert assign_links(links, {0: 2, 1: 3, 2: 5}, ["foot", "foot", "peg"]) == (0, 0, 1, 2, 2)
    assert assign_links(links, {0: 2, 1: 3, 2: 5}, ["heel", "toe", "peg"]) == (None, 0, 1, 2, 2)
