"""The figure of a gait: what is drawn, and that everything is legible."""

import functools
import re
import subprocess
import sys
from dataclasses import replace
from itertools import combinations

import matplotlib
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.text import Text

from gaitopt import FigureStyle, plot_gait
from gaitopt.motion.force_ratio import find_force_ratio
from gaitopt.plot.panels import short_slips
from gaitopt.plot.stick_figures import choose_instants

PANELS = ("angles", "torques", "force ratio", "foot speed")


draw = functools.cache(plot_gait)
"""Figures, each drawn once for all tests, which do not change them."""


def axes_of(figure):
    return {axes.get_label(): axes for axes in figure.axes}


def shades(axes):
    return [patch.get_gid() for patch in axes.patches if patch.get_gid()]


def every_text(figure):
    """Return all texts that are seen, after a layout."""
    FigureCanvasAgg(figure).draw()
    return [text for text in figure.findobj(Text) if text.get_visible() and text.get_text().strip()]


def test_panels_share_a_time_axis_and_name_their_units(slipping):
    axes = axes_of(draw(slipping))
    labels = [axes[name].get_ylabel() for name in PANELS]
    assert labels == ["angle [deg]", "torque [N m]", "force ratio $f_t/f_n$", "foot speed [m/s]"]
    assert axes["foot speed"].get_xlabel() == "time [s]"
    assert all(axes[name].get_xlim() == axes["angles"].get_xlim() for name in PANELS)
    begin, end = axes["angles"].get_xlim()
    assert begin == 0
    assert slipping.period < end < 1.02 * slipping.period  # the mark of the touchdown impulse is within the axes


def test_title_sums_up_the_gait(slipping, title_of):
    assert title_of(slipping) == draw(slipping).get_suptitle()
    title = title_of(slipping, title="A walker on ice")
    assert title.startswith("A walker on ice\n")
    for part in (str(slipping.sequence), "0.01585", "0.633 m/s", "0.4713 m", r"$\mu$ = 0.14"):
        assert part in title


def test_title_of_a_robust_gait_states_the_friction_of_the_plan_and_the_nominal_one(slipping, title_of):
    gait = replace(slipping, problem={**slipping.problem, "robust": {"nominal_friction": 0.3}})
    title = title_of(gait, style=FigureStyle(width=20)).replace("\N{NO-BREAK SPACE}", " ")
    assert r"planned for the lowest friction $\mu$ = 0.14, nominal $\mu$ = 0.3" in title
    assert "nominal" not in draw(slipping).get_suptitle()
    assert "robust" not in title


@pytest.mark.parametrize(
    ("survived", "unseen", "verdict"), [(8, 20, "robust"), (8, 19, "not fully robust"), (7, 20, "not robust")]
)
def test_title_of_a_robust_gait_states_whether_all_scenarios_are_survived(
    slipping, title_of, survived, unseen, verdict
):
    plan = {"survived": survived, "candidates": 8, "unseen": {"survived": unseen, "scenarios": 20}}
    robust = replace(slipping, problem={**slipping.problem, "robust": plan})
    for width in (7.2, 3.5, 2.5):  # a column omits no verdict
        title = title_of(robust, style=FigureStyle(width=width)).replace("\N{NO-BREAK SPACE}", " ")
        assert re.search(rf"\(verified( by replay)?, {verdict}\)", " ".join(title.split()))


def test_title_states_the_minimised_objective_first(slipping, title_of):
    problem = {**slipping.problem, "objective": "torque_squared", "objective_unit": "N^2 m^2 s"}
    gait = replace(slipping, problem=problem, solver=replace(slipping.solver, objective=2.8299))
    title = title_of(gait).splitlines()
    assert title[2].startswith("torque squared 2.83 N² m² s, cost of transport 0.01585")
    narrow = title_of(gait, style=FigureStyle(width=3.5)).splitlines()
    assert [len(title), len(narrow)] == [4, 5]
    assert title[3] == r"speed 0.633 m/s, step length 0.4713 m, friction $\mu$ = 0.14"
    assert narrow[3] == "speed 0.633 m/s, step length 0.4713 m"
    assert narrow[4] == r"friction $\mu$ = 0.14"
    assert narrow[2].startswith("torque squared 2.83 N² m² s")


def test_a_narrow_title_omits_only_the_numbers_that_do_not_fit(slipping, title_of):
    problem = {**slipping.problem, "objective": "torque_squared", "objective_unit": "N^2 m^2 s"}
    gait = replace(slipping, problem=problem, solver=replace(slipping.solver, objective=2.8))
    title = title_of(gait, style=FigureStyle(width=3.5)).splitlines()
    assert title[2] == "torque squared 2.8 N² m² s, speed 0.633 m/s"  # without the cost of transport


def test_title_states_the_parameters_that_were_set(slipping, title_of):
    parameters = {"friction": 0.2, "hip_mass": 12.5, "intervals": 8}
    script = {"file": "own.py", "sha256": "0", "parameters": parameters, "set": ["hip_mass", "intervals"]}
    gait = replace(slipping, problem={**slipping.problem, "script": script})
    assert title_of(gait).splitlines()[-1] == "set: hip mass 12.5, intervals 8"
    script["set"] = ["hip_mass", "intervals", "friction"]
    narrow = title_of(gait, style=FigureStyle(width=2.5)).splitlines()
    assert narrow[-1] == "set: hip mass 12.5, 2 more"
    assert "set:" not in title_of(gait, title="my own")


def test_a_thin_leg_is_drawn_above_the_thick_one_that_would_hide_it(slipping):
    axes = axes_of(draw(slipping))["stick figures"]
    legs = {line.get_linewidth(): line.get_zorder() for line in axes.lines if line.get_linewidth() in (1.3, 2.6)}
    assert legs[1.3] > legs[2.6]


def test_title_says_whether_the_gait_was_replayed(slipping, title_of):
    assert "verified by replay" in draw(slipping).get_suptitle()
    assert "not replayed" in title_of(replace(slipping, verification=None))


def test_the_bar_of_an_impact_does_not_begin_a_line_of_the_title(slipping, title_of):
    for width in (2.5, 3.5, 5.0):
        title = title_of(slipping, style=FigureStyle(width=width))
        assert not any(line.startswith("|") for line in title.splitlines())


def test_a_column_explains_its_shading_and_keeps_the_size_of_its_letters(slipping):
    axes = axes_of(plot_gait(slipping, style=FigureStyle(width=3.5, font_size=6)))
    assert "slip+ phase" in [text.get_text() for text in axes["angles"].get_legend().get_texts()]
    assert {text.get_fontsize() for text in axes["stick figures"].texts} == {5.5}


def test_only_slip_phases_are_shaded(slipping, sticking, slipping_both_ways):
    for gait, expected in ((slipping, ["slip+"]), (sticking, []), (slipping_both_ways, ["slip+", "slip-"])):
        axes = axes_of(draw(gait))
        assert ("foot speed" in axes) == bool(expected)  # a panel of zeros is not drawn
        assert all(shades(axes[name]) == expected for name in PANELS if name in axes)


def test_phases_are_named_above_the_panels(slipping_both_ways):
    texts = [text.get_text() for text in axes_of(draw(slipping_both_ways))["angles"].texts]
    assert texts == ["slip+", "stick", "slip\N{MINUS SIGN}"]


def test_short_slip_phases_are_enlarged(slipping, sticking, slipping_both_ways):
    for gait, count in ((slipping, 1), (sticking, 0), (slipping_both_ways, 2)):
        figure = draw(gait)
        enlarged = [axes for axes in figure.axes if axes.get_label() == "foot speed enlarged"]
        assert len(enlarged) == len(short_slips(gait.motion)) == count
        for axes, phase in zip(enlarged, short_slips(gait.motion), strict=True):
            assert axes.get_xlim()[0] < phase.time[0] < phase.time[-1] < axes.get_xlim()[1]
            assert np.ptp(axes.get_xlim()) < 2 * phase.duration


def test_torque_limits_and_cone_are_drawn_where_they_are_finite(slipping):
    axes = axes_of(draw(slipping))

    def levels(name):
        return {round(line.get_ydata()[0], 9) for line in axes[name].lines if len(line.get_ydata()) == 2}

    assert levels("torques") == {6.0, -6.0}
    assert levels("force ratio") == {0.14, -0.14}
    free = replace(slipping, problem={**slipping.problem, "torque_limit": {"ankle": np.inf, "hip": np.inf}})
    motion = replace(slipping.motion, parameters={**slipping.motion.parameters, "friction": np.inf})
    axes = axes_of(plot_gait(replace(free, motion=motion)))
    assert levels("torques") == levels("force ratio") == set()


@pytest.mark.parametrize(("factor", "drawn"), [(1.02, True), (1.4, True), (3.0, False), (30.0, False)])
def test_the_torque_axis_is_scaled_to_the_torques(slipping, factor, drawn):
    """A limit far from the torques is stated in the legend only, so that the torques are not flat."""
    torques = np.hstack([segment.torque for segment in slipping.motion.segments])
    limit = round(factor * np.abs(torques).max(), 2)
    gait = replace(slipping, problem={**slipping.problem, "torque_limit": {"ankle": limit, "hip": limit}})
    axes = axes_of(plot_gait(gait))["torques"]
    assert np.ptp(torques) > 0.4 * np.ptp(axes.get_ylim())
    levels = {abs(line.get_ydata()[0]) for line in axes.lines if len(line.get_ydata()) == 2}
    handles, labels = axes.get_legend_handles_labels()
    assert levels == ({limit} if drawn else set())
    stated = f"limit \N{PLUS-MINUS SIGN}{limit:g} N m, off scale"
    assert [label.replace("\N{NO-BREAK SPACE}", " ") for label in labels[2:]] == (["limit"] if drawn else [stated])
    assert handles[2].get_linestyle() == "--"
    check_texts(plot_gait(gait, style=FigureStyle(width=3.5)))


@pytest.mark.parametrize(
    ("limits", "labels"),
    [
        ({"ankle": 60.0, "hip": 6.0}, ["limit, hip", "other limits off scale"]),
        ({"ankle": 60.0, "hip": 50.0}, ["limits off scale"]),
        ({"ankle": 7.0, "hip": 6.0}, ["limit, ankle", "limit, hip"]),
        ({"ankle": 60.0, "hip": np.inf}, ["limits off scale"]),
        ({"ankle": 0.0, "hip": np.inf}, []),
    ],
)
def test_limits_of_single_actuators_are_drawn_or_stated_not_to_be(slipping, limits, labels):
    figure = plot_gait(replace(slipping, problem={**slipping.problem, "torque_limit": limits}))
    assert axes_of(figure)["torques"].get_legend_handles_labels()[1][2:] == labels
    check_texts(figure)


def test_force_ratio_of_a_slip_lies_on_the_cone_and_lost_contact_is_left_out(slipping):
    slip = slipping.motion.segments[0]
    np.testing.assert_allclose(find_force_ratio(slip.force, slip.force[1].max()), -0.14, rtol=1e-6)
    assert np.isnan(find_force_ratio(slip.force * [[1.0], [0.0]], 0.0)).all()


def test_jumps_between_phases_are_left_open(slipping):
    line = axes_of(draw(slipping))["torques"].lines[0]
    assert np.isnan(line.get_ydata()).sum() == len(slipping.motion.segments)


def test_every_slip_phase_has_a_stick_figure(slipping_both_ways):
    instants = choose_instants(slipping_both_ways.motion)
    assert len(instants) == 9
    assert [instant.time for instant in instants] == sorted(instant.time for instant in instants)
    assert {instant.segment.mode.value for instant in instants} == {"slip+", "stick", "slip-"}


def test_a_failed_gait_says_so(infeasible, slipping):
    texts = [text.get_text() for text in axes_of(draw(infeasible))["warning"].texts]
    assert any(text.startswith("NOT A SOLUTION (infeasible)") for text in texts)
    assert "warning" not in axes_of(draw(slipping))


def test_a_gait_of_nan_is_drawn_as_a_message(not_a_number):
    texts = [text.get_text() for text in every_text(plot_gait(not_a_number))]
    assert any("not finite" in text for text in texts)


def test_ground_is_inclined_on_a_slope(sloping, slipping, title_of):
    def slope(gait):
        ground = max(axes_of(draw(gait))["stick figures"].lines, key=lambda line: np.ptp(line.get_xdata()))
        return float(np.ptp(ground.get_ydata()) / np.ptp(ground.get_xdata()))

    assert slope(slipping) == 0
    assert slope(sloping) == pytest.approx(np.tan(np.deg2rad(3)))
    assert "slope of 3\N{DEGREE SIGN} downhill" in draw(sloping).get_suptitle()
    parameters = {**sloping.motion.parameters, "slope": -sloping.motion.parameters["slope"]}
    rising = replace(sloping, motion=replace(sloping.motion, parameters=parameters))
    assert "slope of 3\N{DEGREE SIGN} uphill" in title_of(rising)


def check_texts(figure, *, least=8):
    """Check that the texts of a figure are large enough [pt], inside the page and apart from each other."""
    texts = every_text(figure)
    assert min(text.get_fontsize() for text in texts) >= least
    page = figure.bbox.padded(1)
    # Ticks beyond the limits are laid out but not drawn.
    hidden = {
        id(label)
        for axes in figure.axes
        for axis in (axes.xaxis, axes.yaxis)
        for tick in axis.get_major_ticks()
        for label in (tick.label1, tick.label2)
        if not axes.axison or not min(axis.get_view_interval()) <= tick.get_loc() <= max(axis.get_view_interval())
    }
    boxes = [(text.get_text(), text.get_window_extent()) for text in texts if id(text) not in hidden]
    assert all(page.contains(*box.min) and page.contains(*box.max) for _, box in boxes)
    overlapping = [(a, b) for (a, one), (b, two) in combinations(boxes, 2) if one.padded(-0.5).overlaps(two)]
    assert overlapping == []


@pytest.mark.slow
@pytest.mark.parametrize("name", ["slipping", "sticking", "slipping_both_ways", "sloping", "infeasible"])
def test_texts_are_large_enough_inside_the_page_and_apart(name, request):
    check_texts(draw(request.getfixturevalue(name)))


def test_settings_of_matplotlib_are_left_alone(slipping):
    before = dict(matplotlib.rcParams)
    plot_gait(slipping)
    assert dict(matplotlib.rcParams) == before


def test_importing_the_wing_does_not_import_matplotlib():
    modules = "animation, gait_figure, insets, panels, saving, scene, stage, stick_figures, style"
    code = f"import sys; from gaitopt.plot import {modules}; sys.exit('matplotlib' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0


def test_drawing_does_not_import_pyplot():
    code = (
        "import sys; from gaitopt import load, plot_gait;"
        "plot_gait(load('docs/examples/compass_slip.h5')); sys.exit('matplotlib.pyplot' in sys.modules)"
    )
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
