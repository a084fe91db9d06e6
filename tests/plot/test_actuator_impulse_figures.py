"""Impulses of actuators in figures, animations and reports: values, units, colours, and when they are shown."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure

from gaitopt import FigureStyle, animate
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.robots.monopod import monopod
from gaitopt.motion.actuator_impulses import ActuatorImpulses
from gaitopt.motion.animation_frames import TOUCHDOWN_SHOWN, AnimationFrames
from gaitopt.motion.shown_impulses import list_shown_impulses
from gaitopt.motion.view_motion import view_motion
from gaitopt.plot import plot_motion
from gaitopt.plot.scene import Scene
from gaitopt.plot.style import NARROW
from gaitopt.report.markup import to_html
from gaitopt.report.motion_charts import time_charts
from gaitopt.report.player import PlayedGait, make_player
from gaitopt.simulation import simulate_planar
from tests.plot.test_gait_figure import axes_of, check_texts

IMPULSES = {"before": [0.0, 0.3], "after": [2.0, -0.1]}
"""Impulses of the actuators of the monopod just before and just after its landing."""


@pytest.fixture(scope="module")
def landing():
    """A monopod that falls and lands, with impulses of its actuators at the landing."""
    robot = monopod()
    walked = simulate_planar(robot, [0, 0.7, 0, 0, 0.6], [0.5, 0, 0, 0, 0], {}, duration=0.2).motion
    event, *others = walked.events
    assert event.names == ("foot closes",)
    stages = [
        ActuatorImpulses(
            moment=moment,
            impulse=np.array(values),
            reaction=np.array([[0.5 * (moment == "after"), 2.0 * (moment == "after")]] * len(robot.contacts)),
            outcome=ContactState.of({"foot": "stick"}),
            v_minus=event.v_minus,
            v_plus=event.v_plus,
            generated=np.zeros(2),
            absorbed=np.zeros(2),
        )
        for moment, values in IMPULSES.items()
    ]
    return replace(walked, events=(replace(event, actuator_impulses=tuple(stages)), *others))


def values_of(axes):
    """Return the instant, the value and the colour of the mark of each impulse of an axis."""
    marks = [line for line in axes.lines if line.get_linestyle() == "None"]
    return [(line.get_xdata()[0], line.get_ydata()[0], line.get_color()) for line in marks]


@pytest.mark.slow
@pytest.mark.parametrize("width", [7.2, 3.5])
def test_a_figure_has_the_impulses_beside_the_torques_and_forces(landing, width):
    figure = plot_motion(landing, style=FigureStyle(width=width))
    check_texts(figure)
    event, axes = landing.events[0], axes_of(figure)
    for panel, unit, row in (("torques", "N m", 1), ("actuator forces", "N", 0)):
        assert landing.actuator_units[row] == unit
        right, (line, *_) = axes[f"{panel} impulses"], axes[panel].lines
        expected = [values[row] for values in IMPULSES.values() if values[row]]
        assert values_of(right) == [(event.time, value, line.get_color()) for value in expected]
        assert right.get_ylabel().replace("\n", " ") == (f"impulse [{unit} s]" if width > NARROW else "")
        low, high = right.get_ylim()
        assert all(low < value < high for value in expected)
        zeros = [each.transData.transform((0.0, 0.0))[1] for each in (axes[panel], right)]
        assert zeros[0] == pytest.approx(zeros[1], abs=1e-6)
        labels = axes[panel].get_legend_handles_labels()[1]
        assert f"impulse after impact [{unit} s]" in labels
        assert (f"impulse before impact [{unit} s]" in labels) == (row == 1)


def test_without_impulses_no_axis_is_added(landing):
    plain = replace(landing, events=tuple(replace(event, actuator_impulses=()) for event in landing.events))
    assert not any("impulses" in name for name in axes_of(plot_motion(plain)))


def test_an_animation_shows_the_impulses_just_after_the_impact(landing):
    film = AnimationFrames(landing, steps=2, rate=60, slow=2.0)
    scene, seen = Scene(Figure().add_subplot(), None, film), {}
    ((_, (text, arrow)), _) = scene._impulses._shown
    for number in range(len(film)):
        frame = film.frame(number)
        scene.show(frame)
        seen[frame.time] = text.get_visible(), arrow.get_visible()
    shown = [time for time, visible in seen.items() if all(visible)]
    impact = landing.events[0].time
    assert min(shown) == pytest.approx(impact, abs=1 / 60)
    assert max(shown) == pytest.approx(impact + TOUCHDOWN_SHOWN / 2, abs=1 / 60)
    assert text.get_text().splitlines() == [
        "hip 0.3 N m s before impact",
        "leg 2 N s after impact",
        "hip \N{MINUS SIGN}0.1 N m s after impact",
    ]
    foot = view_motion(landing).segments[0].places[:, 0, -1]
    assert arrow.get_offsets()[0] == pytest.approx(foot, abs=1e-9)
    assert arrow.U[0] / arrow.V[0] == pytest.approx(0.25)


def test_impulses_at_the_end_of_the_last_step_are_not_shown(landing):
    event = replace(landing.events[0], time=float(landing.segments[-1].time[-1]))
    film = AnimationFrames(replace(landing, events=(event,)), steps=3, rate=30, slow=2.0)
    period = len(film) / 30 / 3
    assert [each.begin for each in list_shown_impulses(film, 3)] == pytest.approx([period, 2 * period], abs=0.05)


def test_an_animation_with_impulses_is_written(landing, tmp_path):
    assert animate(landing, tmp_path / "landing.gif", steps=1, fps=5, slow=1.0).stat().st_size > 0


def test_a_report_has_charts_of_the_impulses_and_shows_them_in_the_player(landing):
    charts = {chart.title: chart for chart in time_charts(landing, {})}
    torques, forces = charts["Impulses of torques at impacts"], charts["Impulses of actuator forces at impacts"]
    assert [(stem.x, stem.y, stem.label) for stem in torques.stems] == [
        (landing.events[0].time, 0.3, "hip before impact"),
        (landing.events[0].time, -0.1, "hip after impact"),
    ]
    assert {stem.style for stem in torques.stems} == {charts["Torques"].lines[0].style}
    assert forces.y_label == "impulse [N s]"
    assert forces.stems[0].style == charts["Forces of actuators"].lines[0].style
    low, high = torques.y_axis.low, torques.y_axis.high
    assert low < -0.1 < 0.3 < high
    player = make_player(PlayedGait(landing, landing.period, "flight"), list(charts.values()), name="p")
    text = to_html(player)
    groups = re.findall(r'<g class="impulse" data-begin="([\d.]+)" data-end="([\d.]+)">', text)
    assert len(groups) == 2
    assert float(groups[0][0]) == pytest.approx(2 * landing.events[0].time, abs=1e-3)
    film = json.loads(re.search(r'class="film">(.*?)</script>', text)[1])
    assert all(not frame["charts"][list(charts).index(torques.title)] for frame in film["frames"])
