"""Figures of branches: radii beyond the axis are stated."""

import math
from dataclasses import replace
from itertools import combinations

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from gaitopt import FigureStyle, load_diagram, plot_branches
from gaitopt.continuation.special_point import SpecialKind
from gaitopt.plot.branch_figure import STABLE_PIECE
from gaitopt.plot.radius_curves import interpolate_radii
from gaitopt.plot.special_marks import LEAST_MARKER, MARKER, choose_marker_size
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
def test_branches_on_one_line_are_counted(diagram, width):
    def count(*branches):
        figure = plot_branches(replace(diagram, branches=branches), style=FigureStyle(width=width))
        check_texts(figure)
        texts = [text.get_text() for text in figure.legends[0].get_texts()]
        return [text for text in texts if "coincide" in text]

    first, *others = diagram.branches
    piece = take_gaits(first, slice(3, 20))
    assert count(first, *others) == []
    assert count(piece, first) == ["1 of 2 branches coincides with another one"]
    assert count(first, piece, first, *others) == [f"2 of {len(others) + 3} branches coincide with another one"]


def test_radii_that_are_all_large_are_shown(diagram):
    branch = diagram.branches[0]
    large = replace(branch, multipliers=9 / float(np.nanmin(branch.radii)) * branch.multipliers)
    lower = plot_branches(replace(diagram, branches=(large,))).axes[1]
    assert lower.get_title(loc="right") == ""
    assert lower.get_ylim()[1] > np.nanmax(large.radii)
    assert max(float(np.max(line.get_ydata())) for line in lower.lines) >= np.nanmax(large.radii)


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
    labels = [text.get_text() for text in figure.legends[0].get_texts()]
    assert labels[-2:] == ["period doubling", "smaller: longer periods"]
    large, small = figure.legends[0].legend_handles[-2:]
    assert small.get_markersize() < large.get_markersize()


@pytest.mark.parametrize("width", [7.2, 3.5])
def test_the_end_of_an_interrupted_branch_is_marked(diagram, width):
    cut = take_gaits(diagram.branches[1], slice(0, 8), end="interrupted")
    branches = (*diagram.branches[:1], cut)
    figure = plot_branches(replace(diagram, branches=branches), style=FigureStyle(width=width))
    (mark,) = [line for line in figure.axes[0].lines if line.get_label() == "interrupted"]
    np.testing.assert_allclose(mark.get_xdata(), np.degrees(cut.values[-1]))
    np.testing.assert_allclose(mark.get_ydata(), np.degrees(cut.orbits[-1, :, 0]))
    check_texts(figure)


def take_gaits(branch, chosen, **changes):
    """Return a branch with some of its gaits, and no special points."""
    names = ("values", "orbits", "multipliers", "sequences")
    arrays = {name: getattr(branch, name)[chosen] for name in names if name not in changes}
    return replace(branch, special=(), **(arrays | changes))


def errors_of(branch):
    """Return the errors of curve and chord of the radius at every other gait, computed from those between them."""
    coarse = take_gaits(branch, slice(0, (branch.values.size - 1) // 2 * 2 + 1, 2))
    errors = []
    for k, (values, radii) in enumerate(interpolate_radii(coarse)):
        value, radius = branch.values[2 * k + 1], branch.radii[2 * k + 1]
        chord = np.interp(value, values[[0, -1]], radii[[0, -1]])
        errors.append((abs(np.interp(value, values, radii) - radius), abs(chord - radius)))
    return np.array(errors)


def test_the_curve_of_the_radius_passes_through_gaits_that_it_does_not_know(diagram):
    for branch in diagram.branches:
        curve, chord = errors_of(branch).max(axis=0)
        assert curve < 2e-3
        assert curve < 0.05 * chord


def test_the_curve_of_the_radius_of_gaits_whose_state_is_constant_stays_between_them(diagram, rng):
    first = diagram.branches[0]
    orbits = first.orbits.copy()
    orbits[20:] = orbits[20] * (1 + 1e-14 * rng.standard_normal(orbits[20:].shape))
    names = ("stick | stick",) * 20 + ("slip+ stick | stick",) * (first.values.size - 20)
    branch = take_gaits(first, slice(None), orbits=orbits, sequences=names)
    for k, (values, radii) in enumerate(interpolate_radii(branch)):
        assert np.all((values >= first.values[k]) & (values <= first.values[k + 1]))
        assert (values.size == 2) == (k == 19)
        assert radii[0] == first.radii[k]


def test_the_curve_of_the_radius_does_not_overshoot_between_distant_gaits(diagram):
    """The parameter rises along the branch, but gaits are near each other at its start and far apart at its end."""
    first = diagram.branches[0]
    chosen = [0, 1, 2, 3, 4, 5, first.values.size // 2, first.values.size - 1]
    branch = take_gaits(first, chosen, sequences=tuple(first.sequences[k] for k in chosen))
    orbits = branch.orbits.copy()
    orbits[-1] += 3 * (orbits[-1] - orbits[0])
    for k, (values, _) in enumerate(interpolate_radii(replace(branch, orbits=orbits))):
        assert np.all((values >= branch.values[k]) & (values <= branch.values[k + 1]))


def test_the_lower_panel_shows_a_curve_between_the_gaits(diagram):
    upper, lower = plot_branches(diagram).axes
    assert max(len(line.get_xdata()) for line in lower.lines) > 5 * max(len(line.get_xdata()) for line in upper.lines)


@pytest.mark.parametrize("width", [7.2, 3.5])
def test_every_kind_of_special_points_has_its_marker(diagram, width):
    first = diagram.branches[0]
    point = first.special[0]
    points = [replace(point, kind=kind) for kind in SpecialKind]
    points.append(replace(point, kind=SpecialKind.ROLL_OVER, test=math.nan))  # a fall with kinetic energy
    places = np.linspace(0, first.values.size - 1, len(points)).astype(int)
    special = [
        replace(each, value=float(first.values[k]), z=first.states[k]) for each, k in zip(points, places, strict=True)
    ]
    figure = plot_branches(
        replace(diagram, branches=(replace(first, special=tuple(special)),)), style=FigureStyle(width=width)
    )
    (legend,) = figure.legends
    entries = dict(zip((text.get_text() for text in legend.get_texts()), legend.legend_handles, strict=True))
    markers = [entries[each.label].get_marker() for each in points]
    assert len(set(markers)) == len(markers)
    check_texts(figure)


def test_markers_are_small_on_short_branches():
    axes = Figure(figsize=(7, 3)).add_subplot()
    axes.plot([0, 100], [0, 1])
    whole, values = np.array([[0.0], [1.0]]), np.array([0.0, 100.0])
    assert choose_marker_size(axes, 1, values, whole) == MARKER
    assert choose_marker_size(axes, 4, values, whole) == MARKER / 2
    assert LEAST_MARKER < choose_marker_size(axes, 1, values / 20, whole / 20) < MARKER
    assert choose_marker_size(axes, 1, values / 1000, whole / 1000) == LEAST_MARKER


def test_a_title_has_four_lines_and_counts_further_parameters(diagram):
    lasts = {
        7.2: "hip mass 10 kg, gravity 9.81 m/s²",
        3.5: "hip mass 10 kg, gravity 9.81 m/s²",
        2.0: "5 parameters are not the defaults",
    }
    for width, last in lasts.items():
        figure = plot_branches(diagram, style=FigureStyle(width=width))
        title = figure.legends[0].get_title().get_text().splitlines()
        assert len(title) <= 4
        assert title[-1] == last


@pytest.mark.parametrize("width", [7.2, 3.5])
def test_short_branches_are_drawn_above_the_markers(diagram, width):
    upper = plot_branches(diagram, style=FigureStyle(width=width)).axes[0]
    markers = [line for line in upper.lines if line.get_label() == "period doubling"]
    short = next(
        line.get_color() for line in upper.lines if line.get_label() == STABLE_PIECE and is_eight(line, diagram)
    )
    orders = {line.get_zorder() for line in upper.lines if line.get_color() == short}
    assert max(orders) > max(line.get_zorder() for line in markers)
    first = upper.lines[0].get_color()
    assert max(line.get_zorder() for line in upper.lines if line.get_color() == first) < markers[0].get_zorder()


def is_eight(line, diagram):
    """Return whether a line begins at the value of the branch of eight steps."""
    values = next(np.degrees(branch.values) for branch in diagram.branches if branch.steps == 8)
    return min(line.get_xdata()) == pytest.approx(values.min(), abs=1e-9)


def test_the_sequences_of_several_contacts_are_named_as_by_the_search_for_gaits(diagram):
    branch = replace(diagram.branches[0], sequences=("heel a stick | toe a stick | heel b stick",) * 41)
    texts = [t.get_text() for t in plot_branches(replace(diagram, branches=(branch,))).legends[0].get_texts()]
    assert texts[0] == "heel a stick | toe a stick |"


@pytest.mark.parametrize("width", [7.2, 3.5])
def test_markers_of_points_that_almost_coincide_lie_side_by_side_on_the_page(diagram, width):
    first = diagram.branches[0]
    kinds = (SpecialKind.SLIP_ONSET, SpecialKind.IMPACT_CONE, SpecialKind.FOLD, SpecialKind.FOLD)
    place = np.argmin(np.abs(first.values - math.radians(4.0)))
    values = [float(first.values[place]) + 1e-6 * number for number in range(len(kinds))]
    special = [
        replace(first.special[0], kind=kind, value=value, z=first.states[place])
        for kind, value in zip(kinds, values, strict=True)
    ]
    branches = (replace(first, special=tuple(special)), *diagram.branches[1:])
    figure = plot_branches(replace(diagram, branches=branches), style=FigureStyle(width=width))
    FigureCanvasAgg(figure).draw()
    upper, labels = figure.axes[0], [kind.label for kind in kinds]
    marks = [line for line in upper.lines if line.get_label() in labels]
    assert [mark.get_label() for mark in marks] == labels
    np.testing.assert_allclose([mark.get_xdata()[0] for mark in marks], np.degrees(values))
    places = np.array([mark.get_transform().transform(mark.get_xydata())[0] for mark in marks])
    gaps = [np.linalg.norm(one - other) for one, other in combinations(places, 2)]
    assert min(gaps) > MARKER / 72 * figure.dpi
    on_branch = upper.transData.transform(marks[0].get_xydata())[0]
    np.testing.assert_allclose(places[0], on_branch)
    assert np.ptp(places[:, 0]) < 1  # above each other, as the branch is not steep
    assert all(figure.bbox.contains(*each) for each in places)
    check_texts(figure)


def test_one_point_on_several_branches_has_one_marker(diagram):
    first = diagram.branches[0]
    upper = plot_branches(replace(diagram, branches=(first, first))).axes[0]
    marks = [line for line in upper.lines if line.get_label() == "period doubling"]
    one, other = [mark.get_transform().transform(mark.get_xydata()) for mark in marks]
    np.testing.assert_allclose(one, other)


def test_gaits_that_differ_in_the_outcome_of_an_impact_alone_have_their_names_and_colours(diagram):
    first = diagram.branches[0]
    half = first.values.size // 2
    outcomes = ("a stick | b stick",) * half + ("a stick | b slip+",) * (first.values.size - half)
    branch = replace(first, sequences=outcomes, special=())
    figure = plot_branches(replace(diagram, branches=(branch,)))
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts[:2] == ["a stick | b stick", "a stick | b slip+"]
    for axes in figure.axes:
        lines = [line for line in axes.lines if line.get_label() in (STABLE_PIECE, "_unstable")]
        assert len({line.get_color() for line in lines}) == 2
    alone = replace(branch, sequences=outcomes[:1] * first.values.size)
    texts = [text.get_text() for text in plot_branches(replace(diagram, branches=(alone,))).legends[0].get_texts()]
    assert texts[0] == "a stick |"


def test_branches_do_not_magnify_rounding_errors(diagram, rng):
    first = diagram.branches[0]
    constant = replace(first, orbits=0.2 + 1e-9 * rng.random(first.orbits.shape), special=())
    assert np.ptp(plot_branches(replace(diagram, branches=(constant,))).axes[0].get_ylim()) > 1
