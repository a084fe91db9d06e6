"""Reports and notebook cards of robots with several contacts."""

import json
import re
import types

import numpy as np
import pytest

from gaitopt import load_ipython_extension, write_report
from gaitopt.report import show_in_notebook
from gaitopt.report.motion_charts import time_charts
from gaitopt.stability import assess_planar


@pytest.fixture(scope="module")
def text(hop_gait, slip_gait, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "page.html"
    return write_report({"hop": hop_gait, "walk": slip_gait}, path).read_text(encoding="utf-8")


def test_a_comparison_states_every_phase(text):
    comparison = text.partition("<h2>Comparison</h2>")[2].partition("</section>")[0]
    assert re.search(r"foot stick for [\d.]+ s; flight for [\d.]+ s", comparison)


def films(text):
    return [json.loads(film) for film in re.findall(r'class="film">(.*?)</script>', text)]


def test_the_page_names_every_contact_its_modes_and_its_impulse(text, hop_gait):
    for part in (
        "foot stick",
        "flight",
        "foot closes at 0.4 s; impulse foot (",
        "Normal forces over the weight",
        "Lengths",
    ):
        assert part in text
    for contact in ("foot",):
        assert re.search(rf'<i class="swatch stance"></i>{contact}<', text)
    assert "Forces of actuators" in text
    radius = assess_planar(hop_gait).radius
    assert f"unstable: largest modulus {radius:.4g}" in text
    assert "NaN" not in text


def test_the_player_hides_the_force_in_flight(text, hop_gait):
    film = films(text)[0]
    modes = {frame["modes"][0] for frame in film["frames"]}
    assert modes == {"stick", "free"}
    assert all(len(frame["foot"]) == len(frame["force"]) == 1 for frame in film["frames"])
    flight = next(frame for frame in film["frames"] if frame["modes"] == ["free"])
    marks = [mark for chart in flight["charts"] for mark in chart]
    assert [-99, -99, "\N{EN DASH}"] in marks


def test_charts_are_as_long_as_the_period_and_contain_no_nan(hop_gait):
    charts = time_charts(hop_gait.motion, {"hip": 30.0})
    assert [chart.title for chart in charts] == [
        "Angles",
        "Lengths",
        "Torques",
        "Forces of actuators",
        "Normal forces over the weight",
        "Force ratio and friction cone",
    ]  # no slide, which would be rounding noise
    for chart in charts:
        assert (chart.x_axis.low, chart.x_axis.high) == (0.0, pytest.approx(hop_gait.period))
        assert all(np.isfinite(piece).all() for line in chart.lines for piece in line.y)
    assert charts[3].limits == ()


def test_limits_far_from_the_torques_are_not_drawn(hop_gait):
    (chart,) = (chart for chart in time_charts(hop_gait.motion, {"hip": 30.0}) if chart.title == "Torques")
    assert chart.limits == ()
    near = 1.2 * max(float(np.abs(piece).max()) for line in chart.lines for piece in line.y)
    assert near < 20  # of an axis from -30 to 30 N m, the curve would fill a third
    (chart,) = (chart for chart in time_charts(hop_gait.motion, {"hip": near}) if chart.title == "Torques")
    assert set(chart.limits) <= {near, -near}
    assert chart.limits


def test_a_gait_is_displayed_in_a_notebook(hop_gait):
    card = show_in_notebook(hop_gait)
    assert card.count("<svg") == 2
    assert "foot stick &gt; flight |" in card


def test_ipython_displays_it(hop_gait):
    shown = {}

    def register(module, name, display):
        shown[module, name] = display

    formatter = types.SimpleNamespace(for_type_by_name=register)
    shell = types.SimpleNamespace(
        display_formatter=types.SimpleNamespace(formatters={"text/html": formatter, "image/png": formatter})
    )
    load_ipython_extension(shell)
    assert "<svg" in shown["gaitopt.motion.planar_gait", "PlanarGait"](hop_gait)
