"""The content of a report, read without a browser."""

import json
import re
from dataclasses import replace
from html.parser import HTMLParser

import numpy as np
import pytest

from gaitopt import (
    InputError,
    assess_stability,
    compare,
    compass_biped,
    find_cycles,
    load,
    plot_gait,
    simulate,
    write_report,
)
from gaitopt.model.contacts.mode import Mode
from gaitopt.report import show_in_notebook
from gaitopt.report.balance import draw_ledger, draw_multipliers
from gaitopt.report.chart import Axis, Chart, Curve
from gaitopt.report.motion_charts import time_charts

VOID = {"meta", "link", "input", "br"}


class Balanced(HTMLParser):
    """Checks that every tag is closed in its turn, and that no id comes twice."""

    def __init__(self):
        super().__init__()
        self.open, self.ids, self.links = [], [], []

    def handle_starttag(self, tag, attrs):
        self.ids += [value for name, value in attrs if name == "id"]
        self.links += [value for name, value in attrs if name in ("href", "src", "srcset")]
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


@pytest.fixture(scope="module")
def text(report_file):
    return report_file.read_text(encoding="utf-8")


def test_modes_are_written_as_they_are_typed(slipping_both_ways, tmp_path):
    """A sequence that is copied from a page is accepted by the commands."""
    text = write_report({"both": slipping_both_ways}, tmp_path / "page.html").read_text(encoding="utf-8")
    assert "slip\N{MINUS SIGN}" not in text
    assert ">slip-<" in text  # of the player
    assert f"<td>{slipping_both_ways.sequence}</td>" in text


def test_the_page_is_whole_small_and_needs_nothing_else(text):
    parser = Balanced()
    parser.feed(text)
    assert parser.open == []
    assert len(set(parser.ids)) == len(parser.ids)
    assert all((link.startswith("#") and link[1:] in parser.ids) or link == "data:," for link in parser.links)
    assert not re.search(r"https?://|@import|url\((?!#)", text)
    assert len(text) < 1_000_000  # bytes allowed: 8 million


def test_numbers_of_the_gait_stand_on_the_page(text, slipping):
    for number in ("0.015853", "0.633 m/s", "slip+, impulse ratio -0.1400", "1.362 mm", slipping.versions["casadi"]):
        assert number in text
    assert "torque_limit" in text


def test_multipliers_are_those_of_assess_stability(text, slipping):
    assert f"largest modulus {assess_stability(slipping).radius:.4g}" in text


@pytest.mark.parametrize(
    ("value", "shown"), [(783.2, "783"), (-783.2, "\N{MINUS SIGN}783"), (-300 + 400j, "modulus 500")]
)
def test_a_multiplier_drawn_at_the_rim_is_marked_with_its_value(value, shown):
    picture = draw_multipliers([0.5, value])
    texts = [text for text in picture.iter("text") if text.text == shown]
    (rim,) = (circle for circle in picture.iter("circle") if circle.get("class") == "limit")
    mark = next(circle for circle in picture.iter("circle") if circle.get("class") == "multiplier outside")
    centre = float(rim.get("cx"))
    distance = abs(complex(float(mark.get("cx")) - centre, float(mark.get("cy")) - centre))
    assert len(texts) == 1
    assert distance == pytest.approx(float(rim.get("r")), abs=0.02)
    assert "limit" not in [circle.get("class") for circle in draw_multipliers([0.5, -2.9]).iter("circle")]


def test_only_a_gait_that_slips_has_a_chart_of_its_slide(slipping):
    (phase,) = (part for part in slipping.motion.segments if part.mode is Mode.STICK)
    titles = [
        [chart.title for chart in time_charts(motion, {})]
        for motion in (slipping.motion, replace(slipping.motion, segments=(phase,)))
    ]
    assert titles[0] == [*titles[1], "Slide of the stance foot"]


def test_a_gait_whose_stability_cannot_be_assessed_says_why(text):
    assert "Not assessed. No periodic gait" in text  # the example with its slide cut off repeats nowhere


def test_a_failed_gait_is_not_shown_as_a_solution(tmp_path, infeasible, not_a_number):
    page = write_report({"a": infeasible, "b": not_a_number}, tmp_path / "failed.html").read_text(encoding="utf-8")
    assert page.count("Not a solution (") == 2
    assert page.count("is not finite and is not drawn") == 1
    assert "nan" not in page.replace("nan or inf", "")


def test_positions_on_the_page_are_those_of_the_motion(text, slipping):
    film = json.loads(re.search(r'class="film">(.*?)</script>', text).group(1))
    frames = film["frames"]
    legs = [np.hypot(x2 - x1, y2 - y1) for frame in frames for x1, y1, x2, y2 in frame["links"]]
    assert np.ptp(legs) < 0.03, "both legs keep their length [px]"
    scale = legs[0] / slipping.motion.parameters["leg_length"]
    assert film["shift"] == pytest.approx([scale * slipping.step_length, 0], abs=0.02)
    slide = frames[-1]["foot"][0][0] - frames[0]["foot"][0][0]
    assert slide == pytest.approx(scale * slipping.motion.foot_slide, abs=0.02)
    weight = slipping.motion.total_mass * slipping.motion.parameters["gravity"]
    ratios = [frame["force"][0][0] / -frame["force"][0][1] for frame in frames]
    assert np.max(np.abs(ratios)) == pytest.approx(0.14, abs=2e-3), "the force stays in the cone drawn"
    vertical = slipping.motion.channel("force")[1].max() / weight
    assert max(-frame["force"][0][1] for frame in frames) == pytest.approx(
        0.45 * scale * slipping.motion.channel("points")[1].max() * vertical, rel=1e-2
    )


def test_a_report_needs_gaits(tmp_path, slipping):
    with pytest.raises(InputError, match="mapping from titles to gaits"):
        write_report([slipping], tmp_path / "report.html")
    with pytest.raises(InputError, match="at least one gait"):
        write_report({}, tmp_path / "none.html")


def test_a_walk_in_a_notebook():
    angles, rates = [-0.147836890, -0.147836890], [0.732796791, -0.500667882]
    ground = {"slope": np.deg2rad(1), "friction": 0.3}
    html = show_in_notebook(simulate(compass_biped(), [0, 0, *angles], [0, 0, *rates], ground, steps=50))
    assert "50 steps: All requested steps were completed." in html
    assert "and 10 more events" in html


def test_a_walk_that_fell_at_once_in_a_notebook():
    html = show_in_notebook(simulate(compass_biped(), [0, 0, 1.6, 0], [0, 0, 1, 0], {}))
    assert "0 steps: The walker fell." in html


def test_a_cycle_in_a_notebook(wheel):
    cycle = find_cycles(wheel, {"slope": np.deg2rad(13)}, starts=10)[0]
    html = show_in_notebook(cycle)
    assert "stick | stick" in html
    assert html.count("multiplier inside") == 1
    assert "0.734" in html  # beta^2 of Gamus & Or


def test_a_comparison_in_a_notebook(slipping, sticking):
    html = show_in_notebook(compare({"slips": slipping, "<sticks>": sticking}))
    parser = Balanced()
    parser.feed(html)
    assert parser.open == []
    assert html.count("<svg") == 2
    assert "&lt;sticks&gt;" in html
    assert "0.015853" in html
    assert "Floquet multipliers, slips" in show_in_notebook(compare({"slips": slipping}, multipliers=True))


def test_ipython_shows_results_by_itself(slipping):
    formatters = pytest.importorskip("IPython.core.formatters")

    class Shell:
        display_formatter = formatters.DisplayFormatter()

    from gaitopt import load_ipython_extension

    load_ipython_extension(Shell)
    data, _ = Shell.display_formatter.format(slipping)
    assert data["text/html"] == show_in_notebook(slipping)
    assert "text/html" not in Shell.display_formatter.format(slipping.motion)[0]
    data, _ = Shell.display_formatter.format(plot_gait(slipping))
    assert data["image/png"].startswith(b"\x89PNG")


@pytest.mark.parametrize(
    ("low", "high", "ticks"),
    [(0, 1, [0, 0.25, 0.5, 0.75, 1]), (-7, 7, [-5, 0, 5]), (0.001, 0.0034, [0.001, 0.002, 0.003])],
)
def test_ticks_are_round(low, high, ticks):
    assert Axis(low, high, 0, 1).ticks(4) == ticks


def test_a_constant_is_drawn_in_the_middle():
    line = Curve(label="a", x=(np.array([0.0, 1.0]),), y=(np.array([3.0, 3.0]),))
    chart = Chart(title="a", x_label="x", y_label="y", unit="", lines=[line])
    assert chart.place(0.5, 3.0)[1] == pytest.approx((chart.y_axis.start + chart.y_axis.end) / 2)


def test_a_gait_on_a_slope_stands_on_it(tmp_path, sloping):
    page = write_report({"a": sloping}, tmp_path / "slope.html").read_text(encoding="utf-8")
    film = json.loads(re.search(r'class="film">(.*?)</script>', page).group(1))
    assert film["shift"][1] / film["shift"][0] == pytest.approx(np.tan(np.deg2rad(3)), rel=1e-2)


def test_without_friction_limit_the_cone_is_everything_above_ground(tmp_path, sticking):
    parameters = {**sticking.motion.parameters, "friction": np.inf}
    gait = replace(sticking, motion=replace(sticking.motion, parameters=parameters))
    assert 'class="cone"' in write_report({"a": gait}, tmp_path / "free.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_the_multipliers_of_a_custom_robot(tmp_path, slipping, compass, write_old_file):
    own = load(write_old_file(tmp_path / "old.h5", "my_robot"))
    unknown = write_report({"a": own}, tmp_path / "unknown.html").read_text(encoding="utf-8")
    assert (
        "Not assessed. The file of this gait has an older format and contains only the name of its robot, 'my_robot'"
        in unknown.replace("&#x27;", "'")
    )
    named = replace(compass, name="my_robot")
    both = write_report({"a": own.with_robot(named), "b": slipping}, tmp_path / "own.html").read_text(encoding="utf-8")
    alone = write_report({"b": slipping}, tmp_path / "alone.html").read_text(encoding="utf-8")
    assert both.count("largest modulus") == 2 * alone.count("largest modulus") > 0
    assert "Not assessed" not in both


def test_the_ledger_has_bars_for_dampers_and_springs_where_there_are_any(slip_gait, damped):
    names = ["actuators", "gravity", "impact", "friction", "kinetic change"]
    for gait, labels in ((slip_gait, names), (damped, [*names[:4], "dampers", names[4], "elastic change"])):
        drawing = draw_ledger(gait.energy)
        texts = [text.text for text in drawing.iter("text")]
        assert texts[::2] == labels
        assert len(list(drawing.iter("rect"))) == len(labels)
        height = float(drawing.get("viewBox").split()[-1])
        assert max(float(bar.get("y")) + float(bar.get("height")) for bar in drawing.iter("rect")) < height
