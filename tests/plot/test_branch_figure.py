"""Figures of branches: radii beyond the axis are stated."""

from dataclasses import replace

import numpy as np
import pytest

from gaitopt import FigureStyle, load_diagram, plot_branches
from tests.conftest import ROOT
from tests.plot.test_gait_figure import check_texts


@pytest.fixture(scope="module")
def diagram():
    return load_diagram(ROOT / "docs/examples/compass_slope.nc")


@pytest.mark.parametrize("width", [7.2, 3.5])
def test_radii_beyond_the_axis_are_stated(diagram, width):
    style = FigureStyle(width=width)
    assert plot_branches(diagram, style=style).axes[1].get_title(loc="right") == ""
    factor = 12.3 / max(float(np.nanmax(branch.radii)) for branch in diagram.branches)
    grown = [replace(branch, multipliers=factor * branch.multipliers) for branch in diagram.branches]
    figure = plot_branches(replace(diagram, branches=tuple(grown)), style=style)
    text = figure.axes[1].get_title(loc="right")
    assert text == "\N{UPWARDS ARROW} radii above 4, up to 12.3, are off the scale"
    check_texts(figure)


@pytest.mark.parametrize("width", [7.2, 3.5])
def test_branches_of_longer_periods_have_a_colour_and_an_entry_in_the_legend(diagram, width):
    figure = plot_branches(diagram, style=FigureStyle(width=width))
    upper, lower = figure.axes
    (legend,) = figure.legends
    entries = dict(zip((text.get_text() for text in legend.get_texts()), legend.legend_handles, strict=True))
    names = ["stick | stick", *(f"stick | stick, {steps} steps" for steps in (2, 4, 8, 16))]
    assert list(entries)[:5] == names
    colors = [entries[name].get_color() for name in names]
    assert len(set(colors)) == 5
    for axes in (upper, lower):
        assert {line.get_color() for line in axes.lines if line.get_label() in ("_stable", "_unstable")} == set(colors)
    assert lower.get_ylabel() == "spectral radius\nof the period"
    one_step = replace(diagram, branches=diagram.branches[:1])
    assert plot_branches(one_step).axes[1].get_ylabel() == "spectral radius"
    check_texts(figure)


def test_markers_are_smaller_where_special_points_are_closer(diagram):
    figure = plot_branches(diagram)
    sizes = {
        line.get_xdata().size: line.get_markersize()
        for line in figure.axes[0].lines
        if line.get_label() == "period doubling"
    }
    assert list(sizes) == sorted(sizes)
    assert list(sizes.values()) == sorted(sizes.values(), reverse=True)
    assert sizes[1] >= 1.9 * sizes[8]
