"""Legends stay inside the page, and a joint has one colour in all panels of figures and reports."""

import functools
from dataclasses import replace

import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.legend import Legend
from matplotlib.text import Text

from gaitopt import FigureStyle, InputError, compare, plot_comparison, plot_gait
from gaitopt.motion.animation_frames import AnimationFrames
from gaitopt.plot.insets import ForceDiagram, Header
from gaitopt.plot.legends import add_page_legend
from gaitopt.plot.style import LINES, line_style
from gaitopt.report.motion_charts import portraits, time_charts

ANGLES = ("stance thigh", "stance knee", "torso", "swing thigh", "swing knee")
ACTUATORS = ("stance knee", "stance hip", "swing hip", "swing knee")
WIDTHS = (3.5, 5.0, 7.0)


@pytest.fixture(scope="module")
def five_link(slipping):
    """Return the example with the names of five angles and four actuators, as a walker with knees and a torso has."""

    def widen(segment):
        rows = [0, 1, *(2 + number % 2 for number in range(len(ANGLES)))]
        driven = [number % 2 for number in range(len(ACTUATORS))]
        of_actuators = {name: getattr(segment, name)[driven] for name in ("torque", "work", "power")}
        return replace(segment, q=segment.q[rows], v=segment.v[rows], **of_actuators)

    motion = replace(
        slipping.motion,
        angles=ANGLES,
        actuators=ACTUATORS,
        segments=tuple(map(widen, slipping.motion.segments)),
    )
    problem = {**slipping.problem, "torque_limit": dict.fromkeys(ACTUATORS, 6.0)}
    return replace(slipping, motion=motion, problem=problem)


@pytest.fixture(params=["compass", "five links"])
def gait(request, slipping, five_link):
    return {"compass": slipping, "five links": five_link}[request.param]


@functools.cache
def draw(gait, width):
    """Return the figure of a gait, drawn once for all tests, which do not change it."""
    return plot_gait(gait, style=FigureStyle(width=width, font_size=8, titled=False))


def outside(figure, kind):
    """Return the artists of a kind that are not inside the page."""
    FigureCanvasAgg(figure).draw()
    page = figure.bbox.padded(0.5)
    boxes = [(artist, artist.get_window_extent()) for artist in figure.findobj(kind)]
    assert boxes
    return [artist for artist, box in boxes if not (page.contains(*box.min) and page.contains(*box.max))]


def overlapping(texts):
    boxes = [text.get_window_extent() for text in texts]
    return [(a, b) for a in range(len(boxes)) for b in range(a) if boxes[a].padded(-0.5).overlaps(boxes[b])]


def test_a_legend_on_a_narrow_page_has_two_columns_if_the_texts_fit():
    names = ["stick | stick", "slip+ stick | stick", "slip+ stick slip- | stick", "slip- slip+ stick slip- | slip-"]
    style = FigureStyle(width=3.5)
    for labels, columns in (
        ([*names, "unstable", "slip onset", "Neimark-Sacker", "period doubling", "impact cone"], 2),
        ([*names, *names], 1),
    ):
        with style.figure(4.6) as figure:
            handles = figure.subplots().plot([[0.0] * len(labels)])
            legend = add_page_legend(figure, handles, labels, columns=4, width=3.5, loc="outside upper left")
            assert legend.get_window_extent().width <= figure.bbox.width
            FigureCanvasAgg(figure).draw()
            assert len({round(text.get_window_extent().x0) for text in legend.get_texts()}) == columns


@pytest.mark.parametrize(("names", "columns", "height"), [("stick | stick, 16 steps", 2, 0.8), ("swing thigh", 3, 0.5)])
def test_lines_of_a_legend_are_close_to_each_other_if_there_are_many_and_columns_if_this_adds_one(
    names, columns, height
):
    with FigureStyle(width=3.5).figure(4.6) as figure:
        labels = [names] * 9
        handles = figure.subplots().plot([[0.0] * len(labels)])
        legend = add_page_legend(figure, handles, labels, columns=4, width=3.5, loc="outside upper left")
        FigureCanvasAgg(figure).draw()
        box = legend.get_window_extent()
        assert len({round(text.get_window_extent().x0) for text in legend.get_texts()}) == columns
    assert box.width < figure.bbox.width
    assert box.height < height * figure.dpi
    assert overlapping(legend.get_texts()) == []


def test_columns_of_a_legend_differ_by_at_most_one_line_if_they_need_no_further_line():
    for count, columns in ((4, 4), (5, 3), (6, 3), (9, 3)):
        with FigureStyle().figure(4.6) as figure:
            handles = figure.subplots().plot([[0.0] * count])
            legend = add_page_legend(figure, handles, ["stick | stick"] * count, columns=4, width=7.2)
            FigureCanvasAgg(figure).draw()
            assert len({round(text.get_window_extent().x0) for text in legend.get_texts()}) == columns


@pytest.mark.slow
@pytest.mark.parametrize("width", WIDTHS)
def test_legends_of_a_gait_are_inside_the_page(gait, width):
    figure = draw(gait, width)
    assert outside(figure, Legend) == []
    labels = [text.get_text() for legend in figure.findobj(Legend) for text in legend.get_texts()]
    assert {*gait.motion.actuators, "limit"} <= set(labels)
    angles = next(axes for axes in figure.axes if axes.get_label() == "angles")
    assert angles.get_window_extent().width > 0.55 * figure.bbox.width


@pytest.mark.slow
@pytest.mark.parametrize("count", [2, 4])
@pytest.mark.parametrize("width", WIDTHS[::2])
def test_legends_of_a_comparison_are_inside_the_page(gait, width, count):
    figure = plot_comparison(
        compare([replace(gait) for _ in range(count)]), style=FigureStyle(width=width, font_size=8)
    )
    assert outside(figure, Legend) == []
    rows, bars = figure.axes[:-1], figure.axes[-1]
    assert overlapping([axes.yaxis.label for axes in rows]) == []
    assert overlapping([text for text in bars.get_xticklabels() if text.get_text()]) == []
    assert overlapping(bars.texts) == []
    assert min(axes.get_window_extent().height for axes in rows) > 0.4 * figure.dpi


def test_a_label_longer_than_the_page_is_wrapped(slipping):
    comparison = compare({"a label that is much longer than a column is wide " * 2: slipping})
    figure = plot_comparison(comparison, style=FigureStyle(width=3.5, font_size=8))
    assert outside(figure, Legend) == []


def test_a_joint_has_one_colour_in_all_panels(gait):
    for width in WIDTHS:
        axes = {axes.get_label(): axes for axes in draw(gait, width).axes}
        styles = {}
        for panel in ("angles", "torques"):
            for line in axes[panel].lines:
                if len(line.get_xdata()) > 2:
                    style = (line.get_color(), line.get_linestyle(), line._unscaled_dash_pattern)
                    styles.setdefault(line.get_label(), set()).add(str(style))
        assert all(len(found) == 1 for found in styles.values())
        assert len(set.union(*styles.values())) == len(styles)


def test_a_joint_has_one_colour_in_all_charts_of_a_report(gait):
    charts = [*time_charts(gait.motion, {}), *portraits(gait.motion)]
    styles = {}
    for line in (line for chart in charts for line in chart.lines):
        styles.setdefault(line.label, set()).add(line.style)
    assert all(len(found) == 1 for found in styles.values())
    joints = {label: found for label, found in styles.items() if label not in ("ratio", "slide")}
    assert len(set.union(*joints.values())) == len(joints)
    assert styles["ratio"] == styles["slide"] == {"line-single"}
    page = "".join(str(chart.draw().attrib) + str([e.attrib for e in chart.draw().iter()]) for chart in charts)
    assert all(f"line {style}" in page for found in styles.values() for style in found)


def test_styles_repeat_colours_with_other_dashes():
    styles = [str(line_style(number)) for number in range(3 * len(LINES))]
    assert len(set(styles)) == len(styles)


def test_bars_compare_robots_of_any_weight_by_their_costs_of_transport(slipping):
    heavy = replace(slipping.motion, total_mass=10 * slipping.motion.total_mass)
    comparison = compare({"light": slipping, "heavy": replace(slipping, motion=heavy)})
    bars = plot_comparison(comparison).axes[-1]
    assert bars.get_ylabel() == "cost of transport"
    totals = [line.get_ydata()[0] for line in bars.lines]
    assert totals == pytest.approx([gait.cost_of_transport for gait in comparison.gaits.values()])


def test_thin_parts_of_bars_have_their_colours(slipping):
    bars = plot_comparison(compare([slipping])).axes[-1]
    labels = [text.get_text() for text in bars.get_legend().get_texts()]
    samples = dict(zip(labels, bars.get_legend().get_patches(), strict=True))
    parts = {
        label: [patch for patch in bars.patches if patch.get_facecolor() == samples[label].get_facecolor()]
        for label in labels
    }
    assert set(parts) == {"impact", "friction", "2 \N{MULTIPLICATION SIGN} braking"}
    for label, patches in parts.items():
        drawn = [patch for patch in patches if patch.get_height() > 0]
        assert len(drawn) == 1
        assert drawn[0].get_linewidth() == 0  # of a white edge
        assert not drawn[0].get_hatch()
        assert bool(samples[label].get_hatch()) == (label != "impact")


def test_the_force_in_the_cone_is_a_line_for_each_phase(slipping_both_ways):
    axes = Figure().add_subplot()
    ForceDiagram(axes, slipping_both_ways)
    traces = [line for line in axes.lines if len(line.get_xdata()) > 1]
    assert [len(line.get_xdata()) for line in traces] == [s.time.size for s in slipping_both_ways.motion.segments]
    assert {(line.get_linestyle(), line.get_marker()) for line in traces} == {("-", "None")}


def test_the_bar_between_phases_and_impact_is_never_highlighted(slipping_both_ways):
    film = AnimationFrames(slipping_both_ways.motion, steps=2, rate=30, slow=2.0)
    figure = Figure()
    header = Header(figure, slipping_both_ways, film)
    highlighted = set()
    for number in range(len(film)):
        header.show(film.frame(number))
        texts = [text for text in figure.findobj(Text) if text.get_bbox_patch() is not None]
        highlighted |= {text.get_text() for text in texts}
    assert highlighted == {"slip+", "stick", "slip\N{MINUS SIGN}"}


def test_a_comparison_names_a_gait_that_is_not_finite(slipping, not_a_number):
    with pytest.raises(InputError, match="The gait 'second' has no duration or is not finite"):
        plot_comparison(compare({"first": slipping, "second": not_a_number}))
