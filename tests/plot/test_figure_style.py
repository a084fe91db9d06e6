"""FigureStyle: sizes for pages and columns, in every format."""

from itertools import pairwise

import matplotlib
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg

from gaitopt import FigureStyle, InputError, Mode, plot_gait, save_figure
from gaitopt.plot.style import line_style, panel_styles

COLUMN = FigureStyle(width=3.5, font_size=8, titled=False)


@pytest.fixture(scope="module")
def narrow(slipping_both_ways):
    return plot_gait(slipping_both_ways, style=COLUMN)


def test_a_column_is_as_wide_as_asked_and_has_every_panel(narrow):
    assert narrow.get_figwidth() == 3.5
    labels = [axes.get_label() for axes in narrow.axes]
    assert labels == ["stick figures", "angles", "torques", "force ratio", "foot speed"]


def test_a_caption_takes_the_place_of_the_title(narrow):
    assert narrow.get_suptitle() == ""


def test_letters_have_the_size_asked_for(narrow):
    axes = narrow.axes[1]
    assert axes.yaxis.label.get_fontsize() == 8
    assert axes.get_yticklabels()[0].get_fontsize() == 7.5


def test_axis_labels_lie_apart(narrow):
    renderer = FigureCanvasAgg(narrow).get_renderer()
    narrow.draw_without_rendering()
    boxes = [axes.yaxis.label.get_window_extent(renderer) for axes in narrow.axes[1:]]
    assert not any(a.overlaps(b) for a, b in pairwise(boxes))


@pytest.mark.parametrize("suffix", [".pdf", ".svg", ".png"])
def test_a_column_in_every_format(narrow, tmp_path, suffix):
    assert save_figure(narrow, tmp_path / f"column{suffix}").stat().st_size > 5000


def test_the_style_holds_inside_its_context_only():
    before = matplotlib.rcParams["font.size"]
    with COLUMN.figure(2.0) as figure:
        assert matplotlib.rcParams["font.size"] == 8
        figure.add_subplot().fill([0, 1, 1], [0, 0, 1], color=COLUMN.mode_fill[Mode.SLIP_FORWARD])
    assert matplotlib.rcParams["font.size"] == before


@pytest.mark.parametrize("size", [0, -1, float("nan"), "wide"])
def test_sizes_that_cannot_be(size):
    with pytest.raises(InputError, match="width must be"):
        FigureStyle(width=size)


def test_lines_of_a_panel_have_different_dashes_and_their_colours():
    numbers = [1, 5, 6, 4, 0]
    styles = panel_styles(numbers)
    assert len({str(style["linestyle"]) for style in styles}) == len(numbers)
    assert [style["color"] for style in styles] == [line_style(number)["color"] for number in numbers]
    assert styles[:2] == [line_style(1), line_style(5)]
