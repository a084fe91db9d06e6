"""Animations of robots with several contacts: forces, cones and marks of all feet, and none in flight."""

from unittest.mock import patch

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from gaitopt import InputError, animate
from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
from gaitopt.model.robots.spoked_wheel import spoked_wheel
from gaitopt.motion.animation_frames import AnimationFrames
from gaitopt.motion.force_scale import LONGEST_FORCE, force_scale
from gaitopt.motion.view_motion import view_motion
from gaitopt.plot.insets import EnlargedFoot, ForceDiagram, choose_foot
from gaitopt.plot.scene import Scene
from gaitopt.plot.stage import draw_pictures
from gaitopt.plot.style import leg_color
from gaitopt.simulation import simulate_planar


@pytest.fixture(scope="module")
def both_feet():
    robot, th = compass_with_two_feet(), 0.5
    q = [0, 1.6 * np.cos(th), -th, th]
    v = [1.6 * np.cos(th), -1.6 * np.sin(th), -1, 0.5]
    return simulate_planar(robot, q, v, {"friction": 0.3}, duration=0.25).motion


def visible(scene):
    """Return for each foot whether its mark, cone and force are visible."""
    return {foot: {artist.get_visible() for artist in parts} for foot, parts in scene._contacts.items()}


def test_nothing_touches_the_ground_in_flight(hop_gait):
    film = AnimationFrames(hop_gait.motion, steps=1, rate=60, slow=2.0)
    scene, diagram = Scene(Figure().add_subplot(), hop_gait, film), ForceDiagram(Figure().add_subplot(), hop_gait)
    seen = {}
    for number in range(len(film)):
        frame = film.frame(number)
        scene.show(frame)
        diagram.show(frame)
        seen[frame.modes[0].value] = visible(scene)[0], len(diagram._tips[0].get_xdata())
    assert seen == {"stick": ({True}, 1), "free": ({False}, 0)}


def test_each_foot_has_its_force_its_cone_and_its_slide(both_feet):
    film = AnimationFrames(both_feet, steps=1, rate=60, slow=2.0)
    frame = film.frame(len(film) - 1)
    scene = Scene(Figure().add_subplot(), None, film)
    scene.show(frame)
    assert visible(scene) == {0: {True}, 1: {True}}
    for foot, (_, cone, force) in scene._contacts.items():
        np.testing.assert_allclose(force.get_offsets()[0], frame.places[:, foot], atol=1e-12)
        np.testing.assert_allclose(cone.get_xy()[0], frame.places[:, foot], atol=1e-12)
    slides = film.slides(frame)
    assert [(slide.contact, slide.mode.value) for slide in slides] == [
        (0, "slip+"),
        (1, "slip+"),
        (0, "slip-"),
        (1, "slip+"),
    ]
    assert choose_foot(film.motion)[0] == 1  # it slides the furthest


def test_a_leg_keeps_its_colour_when_the_legs_exchange_roles(both_feet):
    view = view_motion(both_feet)
    assert [view.owner(0, exchanges) for exchanges in range(3)] == [0, 1, 0]
    diagram, film = ForceDiagram(Figure().add_subplot(), both_feet_gait(both_feet)), AnimationFrames
    frames = film(both_feet, steps=2, rate=20, slow=1.0)
    colors = set()
    for number in range(len(frames)):
        frame = frames.frame(number)
        diagram.show(frame)
        colors.add((frame.step, diagram._lines[0].get_color()))
    assert colors == {(0, leg_color(0)), (1, leg_color(1))}


def both_feet_gait(motion):
    return AnimationFrames(motion, steps=1, rate=20, slow=1.0)


def test_large_forces_stay_in_the_picture(hop_gait):
    view = view_motion(hop_gait.motion)
    largest = max(part.forces[0, 1].max() for part in view.segments)
    assert largest > 4 * view.weight
    assert force_scale(view) * largest == pytest.approx(LONGEST_FORCE)


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_a_hop_is_animated(hop_gait, tmp_path, suffix):
    path = animate(hop_gait, tmp_path / f"hop{suffix}", steps=2, fps=5, slow=1.0)
    assert path.stat().st_size > 5_000


def test_the_enlarged_foot_is_omitted_if_no_foot_slides(hop_gait, both_feet):
    for motion, shown in ((hop_gait.motion, False), (both_feet, True)):
        film = AnimationFrames(motion, steps=1, rate=5, slow=1.0)
        with patch("gaitopt.plot.stage.EnlargedFoot", wraps=EnlargedFoot) as glass:
            next(draw_pictures(None, film))
        assert glass.called is shown


def test_a_simulated_motion_is_animated(both_feet, tmp_path):
    with Image.open(animate(both_feet, tmp_path / "slide.gif", steps=1, fps=5, slow=4.0)) as image:
        assert image.n_frames > 3


def test_a_simulated_walk_is_animated_as_its_motion(tmp_path):
    walk = simulate_planar(spoked_wheel(), [0, 1.0, 0.1], [0.3, 0, 0.2], {"friction": 0.3}, duration=0.5)
    assert animate(walk, tmp_path / "walk.gif", steps=1, fps=5, slow=1.0).exists()


def test_a_wheel_shows_the_spokes_that_touch_the_ground(tmp_path):
    wheel = spoked_wheel()
    motion = simulate_planar(wheel, [0, 1.2, 0.1], [0.3, 0, 0.2], {"friction": 0.3}, duration=1.0).motion
    view = view_motion(motion)
    assert 0 < len(view.contacts) < 10
    assert set(view.link_contacts) >= {0, 1}
    assert animate(motion, tmp_path / "wheel.gif", steps=1, fps=5, slow=1.0).exists()


def test_what_cannot_be_animated_is_refused(tmp_path, both_feet):
    empty = both_feet.__class__(**{**vars(both_feet), "segments": ()})
    with pytest.raises(InputError, match="not finite or has no duration"):
        animate(empty, tmp_path / "none.gif")
    flight = simulate_planar(spoked_wheel(), [0, 2.0, 0.1], [0.3, 0, 0.2], {}, duration=0.1)
    with pytest.raises(InputError, match="No foot is on the ground"):
        animate(flight, tmp_path / "none.gif")
    with pytest.raises(InputError, match="gait must be"):
        animate("walk", tmp_path / "none.gif")
