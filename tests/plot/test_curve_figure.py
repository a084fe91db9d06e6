"""The map of the regions that curves of special points bound."""

from dataclasses import replace

import numpy as np
import pytest

from gaitopt import InputError, load_diagram
from gaitopt.continuation import SpecialCurve, SpecialKind
from gaitopt.plot import plot_curves
from tests.conftest import ROOT


@pytest.fixture
def diagram():
    return load_diagram(ROOT / "docs/examples/compass_slope.nc")


def curve(kind, values, before, after, end="range_end"):
    return SpecialCurve(
        kind=kind,
        parameters=("friction", "slope"),
        values=np.array(values),
        states=np.zeros((len(values), 3)),
        before=before,
        after=after,
        begin="range_end",
        end=end,
    )


def test_each_curve_is_drawn_with_its_change_and_its_points_of_codimension_two(diagram):
    onset = curve(SpecialKind.SLIP_ONSET, [[0.2, 0.1], [0.3, 0.2]], "stick | stick", "slip+ stick | stick")
    cone = curve(SpecialKind.IMPACT_CONE, [[0.1, 0.1], [0.2, 0.15]], "a | stick", "a | slip+", "meets slip onset")
    figure = plot_curves(replace(diagram, curves=(onset, cone)))
    (axes,) = figure.axes
    lines = {line.get_label(): line for line in axes.lines}
    assert axes.get_xlabel() == "slope [deg]"
    assert axes.get_ylabel() == "friction"
    drawn = lines["slip onset: stick | stick \N{RIGHTWARDS ARROW} slip+ stick | stick"]
    np.testing.assert_allclose(drawn.get_xydata(), [[np.degrees(0.1), 0.2], [np.degrees(0.2), 0.3]])
    np.testing.assert_allclose(lines["codimension two"].get_xydata(), [[np.degrees(0.15), 0.2]])


def test_a_diagram_without_curves_is_named(diagram):
    with pytest.raises(InputError, match="has no curves of special points"):
        plot_curves(diagram)
