"""Figures as wide as a column show all labels, and nothing that the result does not contain."""

import warnings
from dataclasses import replace
from itertools import combinations, pairwise
from types import SimpleNamespace

import numpy as np
import pytest
import xarray as xr
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from gaitopt import FigureStyle, compare, feedforward, load, load_diagram, plot_comparison, plot_gait, simulate
from gaitopt.motion.view_motion import view_motion
from gaitopt.plot import (
    comparison_figure,
    plot_branch_basin,
    plot_branches,
    plot_motion,
    plot_ranking,
    plot_sweep,
    view_result,
)
from gaitopt.plot.gait_figure import LEAST_BAR, _row_heights, choose_rows
from gaitopt.plot.mode_bar import draw_mode_bar
from gaitopt.plot.panels import name_phases
from gaitopt.plot.stick_figures import draw_stick_figures
from gaitopt.plot.style import line_style
from gaitopt.study.sequence_search.ranking import RankedGait, Ranking
from tests.conftest import ROOT
from tests.plot.test_gait_figure import axes_of, check_texts, draw
from tests.plot.test_result_figures import make_sweep

COLUMN = FigureStyle(width=3.5)


def is_inside(figure):
    """Return whether all that is drawn is inside the page, within 0.02 inch."""
    figure.draw_without_rendering()
    box, (across, upward) = figure.get_tightbbox(), figure.get_size_inches()
    return box.x0 > -0.02 and box.y0 > -0.02 and box.x1 < across + 0.02 and box.y1 < upward + 0.02


def labels_of(axes):
    return [text.get_text() for text in axes.get_legend().get_texts()]


def test_the_warning_of_a_failed_gait_is_inside_a_column(infeasible):
    with warnings.catch_warnings():
        warnings.simplefilter("error", UserWarning)  # such as that of a layout in which axes have no size
        figure = plot_gait(infeasible, style=COLUMN)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    (text,) = axes_of(figure)["warning"].texts
    assert infeasible.status.hint in text.get_text().replace("\n", " ")
    box = text.get_bbox_patch().get_window_extent(canvas.get_renderer())
    assert figure.bbox.contains(*box.min)
    assert figure.bbox.contains(*box.max)
    assert axes_of(figure)["stick figures"].get_window_extent().width > 0.8 * figure.bbox.width


def test_a_gait_in_a_column_is_two_thirds_of_a_page_high_and_its_labels_do_not_touch(slipping):
    figure = draw(slipping, style=COLUMN)
    assert figure.get_figheight() <= 6.5
    assert is_inside(figure)
    check_texts(figure)
    panels = [axes for axes in figure.axes if axes.get_ylabel()]
    boxes = [axes.yaxis.label.get_window_extent() for axes in panels]
    assert [upper.y0 > lower.y1 for upper, lower in pairwise(boxes)] == [True] * 3
    ratio = axes_of(figure)["force ratio"]
    diamond = ratio.get_legend().get_window_extent()
    assert not any(label.get_window_extent().overlaps(diamond) for label in ratio.get_yticklabels())


def test_a_comparison_does_not_magnify_rounding_errors(slipping, rng):
    segments = [replace(s, torque=1e-12 * rng.standard_normal(s.torque.shape)) for s in slipping.motion.segments]
    idle = replace(slipping, motion=replace(slipping.motion, segments=tuple(segments)))
    torques = [axes for axes in plot_comparison(compare([idle])).axes if "torque" in axes.get_ylabel()]
    assert [axes.get_ylim() for axes in torques] == [(-0.5, 0.5)] * 2


def test_a_comparison_does_not_magnify_errors_of_the_plan(slipping, rng):
    noise = [replace(s, torque=300 + 1e-4 * rng.random(s.torque.shape)) for s in slipping.motion.segments]
    idle = replace(slipping, motion=replace(slipping.motion, segments=tuple(noise)))
    torques = [axes for axes in plot_comparison(compare([idle])).axes if "torque" in axes.get_ylabel()]
    assert [np.ptp(axes.get_ylim()) >= 1 for axes in torques] == [True] * 2


def test_panels_of_a_column_are_lower_if_there_are_many(hop_gait):
    assert len(choose_rows(view_motion(hop_gait.motion))) == 7
    figure = draw(hop_gait, style=COLUMN)
    assert figure.get_figheight() <= 7.0
    assert is_inside(figure)
    check_texts(figure)
    panels = [axes for axes in figure.axes if axes.get_ylabel()]
    boxes = [axes.yaxis.label.get_window_extent() for axes in panels]
    assert [upper.y0 > lower.y1 for upper, lower in pairwise(boxes)] == [True] * 5
    inside = [axes for axes in panels if axes.get_legend().get_window_extent().y0 < axes.get_window_extent().y1 - 5]
    assert {axes.get_label() for axes in inside} >= {"torques", "normal forces"}
    for axes in inside:
        key = axes.get_legend().get_window_extent()
        paths = [line.get_transform().transform_path(line.get_path()) for line in axes.lines]
        assert not any(path.intersects_bbox(key, filled=False) for path in paths)


@pytest.mark.parametrize("width", [3.5, 7.0])
def test_a_figure_with_many_panels_is_not_taller_than_a_page(hop_gait, width):
    figure = draw(hop_gait, style=FigureStyle(width=width, font_size=8.5))
    assert sum(axes.get_label() in choose_rows(view_motion(hop_gait.motion)) for axes in figure.axes) > 4
    assert figure.get_figheight() <= 9.0
    check_texts(figure)


@pytest.mark.slow
@pytest.mark.parametrize("width", [3.5, 7.0])
def test_a_comparison_with_many_rows_is_not_taller_than_a_page(slipping, width, monkeypatch):
    rows = comparison_figure._rows

    def add_rows(comparison, *, unit_line):
        *angles, force, speed = rows(comparison, unit_line=unit_line)
        unit = "torque\n[N m]" if unit_line else "torque [N m]"
        more = [(f"{name} knee\n{unit}", force[1]) for name in ("stance", "swing", "left", "right", "other")]
        return [*angles, *more, force, speed]

    monkeypatch.setattr(comparison_figure, "_rows", add_rows)
    figure = plot_comparison(compare({"one": slipping, "other": slipping}), style=FigureStyle(width=width))
    assert len(figure.axes) == 12
    assert figure.get_figheight() <= 9.0
    assert is_inside(figure)
    check_texts(figure)


@pytest.mark.parametrize("width", [2.5, 3.0, 3.5, 4.0])
def test_the_facts_of_a_title_are_not_divided(slipping, title_of, width):
    title = title_of(slipping, style=FigureStyle(width=width))
    lines = title.splitlines()[2:]
    known = ("cost of transport 0.01585", "speed 0.633 m/s", "step length 0.4713 m", r"friction $\mu$ = 0.14")
    facts = ", ".join(lines).split(", ")
    assert tuple(facts) == known
    assert len(lines) == {2.5: 4, 3.0: 3}.get(width, 2)


@pytest.mark.parametrize(("width", "below"), [(3.5, -1.25), (7.2, -1.75)])
def test_a_panel_has_room_for_a_legend_only_if_it_contains_one(slipping, width, below):
    low, high = axes_of(draw(slipping, style=FigureStyle(width=width)))["force ratio"].get_ylim()
    assert high == pytest.approx(1.25 * 0.14, rel=1e-6)
    assert low == pytest.approx(below * 0.14, rel=1e-6)


@pytest.mark.slow
def test_ticks_of_enlargements_side_by_side_lie_apart(slipping):
    first, parameters = slipping.motion.segments[0], slipping.motion.parameters
    law = feedforward(slipping.robot, slipping.motion)
    walk = simulate(slipping.robot, first.q[:, 0], first.v[:, 0], parameters, law=law, steps=3)
    figure = plot_motion(walk.motion)
    assert sum(axes.get_label() == "foot speed enlarged" for axes in figure.axes) == 3
    check_texts(figure)
    check_texts(plot_motion(walk.motion, style=COLUMN))


def test_labels_of_the_rows_of_a_comparison_lie_apart(slipping):
    figure = plot_comparison(compare({"one": slipping, "other": slipping}), style=COLUMN)
    renderer = FigureCanvasAgg(figure).get_renderer()
    figure.draw_without_rendering()
    boxes = [axes.yaxis.label.get_window_extent(renderer) for axes in figure.axes[:-1]]
    assert not any(one.overlaps(other) for one, other in pairwise(boxes))


@pytest.mark.parametrize("width", [3.5, 7.2])
def test_labels_of_bars_lie_apart_and_names_are_divided_after_underscores_only(slipping, sticking, width):
    gaits = {"slip+ stick | slip+ (compass_slip)": slipping, "stick | stick (compass_stick)": sticking}
    figure = plot_comparison(compare(gaits), style=FigureStyle(width=width))
    check_texts(figure)
    bars = figure.axes[-1]
    labels = [label.get_text() for label in bars.get_xticklabels()]
    assert [label.replace("_\n", "_").splitlines()[-1] for label in labels] == ["(compass_slip)", "(compass_stick)"]
    assert [number.get_rotation() for number in bars.texts] == [0, 0]


def test_numbers_of_two_bars_without_labels_are_horizontal(slipping):
    long = "heel A stick, toe B stick > heel A stick | heel A stick, toe A stick > toe A stick |"
    figure = plot_comparison(compare({long: slipping, f"{long} (other)": slipping}), style=COLUMN)
    assert [number.get_rotation() for number in figure.axes[-1].texts] == [0, 0]


def test_the_foot_speed_of_gaits_that_do_not_slip_is_not_drawn(slipping, sticking):
    for gaits, drawn in ([sticking], False), ([sticking, slipping], True):
        labels = [axes.get_ylabel() for axes in plot_comparison(compare(gaits)).axes]
        assert any(label.startswith("foot") for label in labels) == drawn


def test_labels_of_two_columns_are_inside_the_page_and_the_columns_end_at_the_bottom():
    gait = load(ROOT / "tests/problems/bounding_quadruped.h5")
    figure = plot_comparison(compare([gait]), style=COLUMN)
    rows = figure.axes[:-1]
    figure.draw_without_rendering()
    titles = [axes.get_title(loc="left") for axes in rows]
    assert "" not in titles
    assert all(axes._left_title.get_window_extent().x1 < figure.bbox.x1 for axes in rows)
    lowest = [axes for axes in rows if axes.get_xlabel()]
    assert len(lowest) == 2
    assert lowest[0].get_position().y0 == pytest.approx(lowest[1].get_position().y0)


def test_numbers_of_many_bars_are_below_their_legend(slipping, sticking):
    gaits = {f"gait {number}": slipping if number % 2 else sticking for number in range(12)}
    figure = plot_comparison(compare(gaits), style=COLUMN)
    figure.draw_without_rendering()
    bars = figure.axes[-1]
    assert all(number.get_window_extent().y1 < bars.get_legend().get_window_extent().y0 for number in bars.texts)


@pytest.mark.parametrize(("width", "named"), [(6.0, True), (2.2, True), (0.8, False)])
def test_names_of_phases_lie_apart_or_are_omitted(slipping_both_ways, width, named):
    figure = Figure(figsize=(width, 2.0))
    axes = figure.add_subplot()
    view = view_motion(slipping_both_ways.motion)
    name_phases(axes, view)
    boxes = [text.get_window_extent() for text in axes.texts]
    assert len(boxes) == named * len(view.segments)
    assert not any(one.overlaps(other) for one, other in combinations(boxes, 2))


@pytest.mark.parametrize("count", [3, 4, 8])
def test_bars_of_many_contacts_are_as_high_in_a_column_as_those_of_three(hop_gait, count):
    view = view_motion(hop_gait.motion)
    rows = choose_rows(view)
    place = list(rows).index("modes")
    many = SimpleNamespace(closing=range(count))
    assert _row_heights(rows, many, LEAST_BAR)[place] / count == pytest.approx(1 / 3, abs=0.01)
    assert _row_heights(rows, many)[place] == 1


def test_the_unit_of_an_objective_is_inside_a_column(slipping):
    gait = replace(slipping, problem={**slipping.problem, "objective": "torque_squared", "objective_unit": "N^2 m^2 s"})
    ranking = Ranking((RankedGait(sequence=gait.sequence, status="solved", gait=gait),), True)
    assert is_inside(plot_ranking(ranking, style=COLUMN))


def test_modes_are_named_where_their_names_fit(hop_gait):
    names = {}
    for width in (1.2, 7.2):
        axes = Figure(figsize=(width, 1.0)).add_subplot()
        draw_mode_bar(axes, view_motion(hop_gait.motion))
        names[width] = [text.get_text() for text in axes.texts]
    assert names == {1.2: ["flight"], 7.2: ["stick", "flight"]}


def test_a_limit_of_one_actuator_has_its_colour_and_its_name(slipping):
    for hip in (np.inf, 0.0):  # the line of an idle actuator is its own limit
        gait = replace(slipping, problem={**slipping.problem, "torque_limit": {"ankle": 6.0, "hip": hip}})
        torques = axes_of(plot_gait(gait))["torques"]
        lines = {line.get_label(): line for line in torques.lines}
        assert lines["limit, ankle"].get_color() == lines["ankle"].get_color() == line_style(2)["color"]
        levels = {line.get_ydata()[0] for line in torques.lines if len(line.get_ydata()) == 2}
        assert levels == {6.0, -6.0}


def test_legs_of_a_walk_of_several_steps_have_their_colours(slipping):
    first, parameters = slipping.motion.segments[0], slipping.motion.parameters
    law = feedforward(slipping.robot, slipping.motion)
    walk = simulate(slipping.robot, first.q[:, 0], first.v[:, 0], parameters, law=law, steps=2)
    assert len(walk.motion.jumps) == 2
    assert view_motion(walk.motion).link_contacts == view_motion(slipping.motion).link_contacts
    figure = plot_motion(walk.motion)
    assert labels_of(axes_of(figure)["stick figures"]) == ["stance leg", "swing leg", "contact force", "friction cone"]


def test_the_legend_contains_no_friction_cone_on_ground_of_infinite_friction(slipping):
    motion = replace(slipping.motion, parameters={**slipping.motion.parameters, "friction": np.inf})
    figure = plot_gait(replace(slipping, motion=motion))
    assert labels_of(axes_of(figure)["stick figures"]) == ["stance leg", "swing leg", "contact force"]
    assert "infinite friction" in figure.get_suptitle()


def test_friction_cones_of_neighbouring_stick_figures_lie_apart(hop_gait):
    axes = Figure().add_subplot()
    draw_stick_figures(axes, hop_gait.motion)
    spans = [(patch.get_xy()[:, 0].min(), patch.get_xy()[:, 0].max()) for patch in axes.patches]
    assert len(spans) > 1
    assert all(one[1] < other[0] or other[1] < one[0] for one, other in combinations(spans, 2))


def test_equal_values_of_a_sweep_are_drawn_as_equal(rng):
    table = make_sweep(slope=np.linspace(0.0, 0.1, 5))
    table["peak_torque"][:] = 6.0 - 1e-9 * rng.random(table.peak_torque.shape)  # optima with a limit of 6 N m
    (axes,) = plot_sweep(table, quantity="peak_torque", style=COLUMN).axes
    assert np.ptp(axes.get_ylim()) > 0.1
    plane = make_sweep(slope=[0.0, 0.1], friction=[0.1, 0.2])
    plane["peak_torque"][:] = 6.0 - 1e-9 * rng.random(plane.peak_torque.shape)
    assert np.ptp(plot_sweep(plane, quantity="peak_torque").axes[0].collections[0].get_clim()) > 0.1


@pytest.mark.parametrize(("sizes", "scale"), [([0.70, 0.72], "linear"), ([0.01, 0.7], "log")])
def test_pushes_of_similar_sizes_have_a_linear_axis(sizes, scale):
    table = xr.Dataset(
        {
            "share": (("friction", "ending"), [[1.0], [1.0]]),
            "push": ("friction", sizes),
            "edge": (("friction", "coordinate", "side"), np.full((2, 1, 1), np.nan)),
        },
        {"friction": [0.1, 0.2], "ending": ["fell"], "coordinate": ["th1_rate"], "side": ["forward"]},
    )
    assert plot_branch_basin(table).axes[1].get_yscale() == scale
    titled = plot_branch_basin(table.assign_attrs(title="rimless_wheel: basins along a branch over friction"))
    assert titled.legends[0].get_title().get_text() == "rimless wheel"


def test_the_axis_of_the_spectral_radius_ends_above_the_largest():
    diagram = load_diagram(ROOT / "docs/examples/compass_slope.nc")
    largest = max(float(np.nanmax(branch.radii)) for branch in diagram.branches)
    assert largest < plot_branches(diagram).axes[1].get_ylim()[1] < 1.1 * largest


def test_a_view_in_a_notebook_fits_in_a_narrow_window_and_shortens_long_attributes():
    table = make_sweep(slope=np.linspace(0.0, 0.1, 5)).assign_attrs(question="friction " * 100)
    page = view_result(table)
    assert '<svg style="max-width: 100%; height: auto"' in page
    assert 1 < page.count("friction ") < 50
    assert len(table.attrs["question"]) == 900


def test_labels_of_time_are_inside_their_columns():
    gait = load(ROOT / "tests/problems/bounding_quadruped.h5")
    figure = plot_comparison(compare([gait]), style=COLUMN)
    figure.draw_without_rendering()
    for axes in figure.axes[:-1]:
        assert not axes.get_xlabel() or axes.xaxis.label.get_window_extent().width < axes.get_window_extent().width
