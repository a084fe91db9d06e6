"""Pictures of round feet: arcs, contact points, forces and marks are where the foot touches the ground."""

import json
import re

import numpy as np
import pytest
from matplotlib.figure import Figure

from gaitopt import FigureStyle, animate, compare, plot_comparison, plot_gait, write_report
from gaitopt.motion.animation_frames import AnimationFrames
from gaitopt.motion.link_roles import tilt
from gaitopt.plot.insets import EnlargedFoot
from gaitopt.plot.scene import Scene
from gaitopt.plot.stick_figures import draw_stick_figures
from gaitopt.report.walker_drawing import Stage


@pytest.fixture(scope="module")
def film(rolling_gait):
    return AnimationFrames(rolling_gait.motion, steps=2, rate=30, slow=2.0)


def arcs(axes):
    return [np.array(line.get_data()) for line in axes.lines if len(line.get_xdata()) == 49]


def test_stick_figures_stand_on_their_arcs(rolling_gait):
    axes = Figure().add_subplot()
    draw_stick_figures(axes, rolling_gait.motion, 5)
    drawn = arcs(axes)
    assert len(drawn) == 10
    for foot in drawn[::2]:
        assert foot[1].min() == pytest.approx(0, abs=2e-4)
    marked = [line.get_xydata()[0] for line in axes.lines if line.get_marker() == "o" and line.get_zorder() == 6]
    for (x, y), foot in zip(marked, drawn[::2], strict=True):
        assert y == pytest.approx(0, abs=1e-12)
        assert x == pytest.approx(foot[0][np.argmin(foot[1])], abs=0.3 * 0.03)


def test_force_and_cone_stand_on_the_contact_point(rolling_gait, film):
    scene = Scene(Figure().add_subplot(), rolling_gait, film)
    for number in (3, len(film) - 5):
        frame = film.frame(number)
        scene.show(frame)
        foot = tilt(frame.rims[:2, 0] - [0, frame.rims[2, 0]], 0.0)
        np.testing.assert_allclose(scene._contacts[0][2].get_offsets()[0], foot, atol=1e-12)
        np.testing.assert_allclose(scene._contacts[0][1].get_xy()[0], foot, atol=1e-12)
        assert abs(foot[0] - frame.slides[0]) > 1e-3  # the slide coordinate is another place
        outline = np.array(scene._feet[0][0].get_data())
        assert outline[1].min() == pytest.approx(0, abs=2e-4)
        assert len(scene._feet) == 2


def test_the_glass_shows_the_slide_alone(rolling_gait, film):
    enlarged = EnlargedFoot(Figure().add_subplot(), rolling_gait, film, 1.0)
    for number in range(0, len(film), 7):
        frame = film.frame(number)
        enlarged.show(frame)
        slid = 1e3 * (frame.slides[0] - frame.step * rolling_gait.motion.travel)
        assert float(enlarged._foot.get_xdata()[0]) == pytest.approx(slid)
        assert 0 <= slid <= 1e3 * rolling_gait.motion.foot_slide + 1e-6
    ends = np.concatenate([mark.get_xdata() for mark in enlarged._marks])
    assert ends == pytest.approx([0, 1e3 * rolling_gait.motion.foot_slide])


def test_the_stage_of_the_report_rolls_its_arcs(rolling_gait):
    one = AnimationFrames(rolling_gait.motion, steps=1, rate=30, slow=2.0)
    stage = Stage(one, steps=2, name="walker")
    places = np.array([position["rims"][0] for position in stage.frames()])
    feet = np.array([position["foot"][0] for position in stage.frames()])
    np.testing.assert_allclose(places[:, 0], feet[:, 0], atol=0.02)
    assert np.ptp(places[:, 1] - feet[:, 1]) < 0.05  # a radius above the ground
    angles = np.rad2deg(rolling_gait.motion.channel("q")[2])
    assert places[0, 2] == pytest.approx(angles[0], abs=0.01)
    assert places[-1, 2] == pytest.approx(angles[-1], abs=1.5)
    rims = [part for part in stage.draw() if part.get("class", "").startswith("rim")]
    assert [part.get("class") for part in rims] == ["rim stance", "rim swing"]


def test_the_report_has_a_transform_for_each_foot_in_every_frame(rolling_gait, tmp_path):
    text = write_report({"round feet": rolling_gait}, tmp_path / "page.html").read_text(encoding="utf-8")
    film = json.loads(re.search(r'class="film">(.*?)</script>', text, re.DOTALL).group(1))
    assert {np.shape(frame["rims"]) for frame in film["frames"]} == {(2, 3)}


def test_point_feet_have_no_arcs(slipping):
    axes = Figure().add_subplot()
    draw_stick_figures(axes, slipping.motion, 5)
    assert arcs(axes) == []
    stage = Stage(AnimationFrames(slipping.motion, steps=1, rate=30, slow=2.0), steps=2, name="walker")
    assert stage.frames()[0]["rims"] == []
    assert not [part for part in stage.draw() if part.get("class", "").startswith("rim")]


@pytest.mark.parametrize("width", [7.2, 3.5])
def test_figures_of_every_kind_are_drawn(rolling_gait, width):
    style = FigureStyle(width=width)
    assert plot_gait(rolling_gait, style=style).get_figwidth() == width
    assert plot_comparison(compare({"one": rolling_gait}), style=style).get_figwidth() == width


def test_it_is_animated(rolling_gait, tmp_path):
    assert animate(rolling_gait, tmp_path / "gait.gif", steps=1, fps=5, slow=1.0).stat().st_size > 10_000
