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
