"""Figures of branches, and the map of the regions that curves of special points bound."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gaitopt import InputError, compass_biped, load_diagram, plot_branches
from gaitopt.continuation import SpecialCurve, SpecialKind
from gaitopt.continuation.branch_diagram import split_branch
from gaitopt.plot import plot_curves
from tests.conftest import ROOT


@pytest.fixture
def diagram():
    return load_diagram(ROOT / "docs/examples/compass_slope.nc")


def curve(kind, values, before, after, **fields):
    return SpecialCurve(
        kind=kind,
        parameters=("friction", "slope"),
        values=np.array(values),
        states=np.zeros((len(values), 3)),
        before=before,
        after=after,
        **{"begin": "range_end", "end": "range_end"} | fields,
    )


def title_of(figure):
    """Return the title of a figure, which is above its legend."""
    return figure.legends[0].get_title().get_text()


def test_each_curve_is_drawn_with_its_change_and_its_points_of_codimension_two(diagram):
    onset = curve(SpecialKind.SLIP_ONSET, [[0.2, 0.1], [0.3, 0.2]], "stick | stick", "slip+ stick | stick")
    cone = curve(
        SpecialKind.IMPACT_CONE, [[0.1, 0.1], [0.2, 0.15]], "a | stick", "a | slip+", codimension_two=(False, True)
    )
    figure = plot_curves(replace(diagram, curves=(onset, cone)))
    (axes,) = figure.axes
    lines = {line.get_label(): line for line in axes.lines}
    assert axes.get_xlabel() == "slope [deg]"
    assert axes.get_ylabel() == "friction"
    drawn = lines["slip onset: stick | stick \N{RIGHTWARDS ARROW} slip+ stick | stick"]
    np.testing.assert_allclose(drawn.get_xydata(), [[np.degrees(0.1), 0.2], [np.degrees(0.2), 0.3]])
    np.testing.assert_allclose(lines["codimension two"].get_xydata(), [[np.degrees(0.15), 0.2]])
    title = title_of(figure)
    assert title.startswith("compass biped\nleg length 1 m")
    assert "friction" not in title  # of an axis


def test_a_file_states_the_points_of_codimension_two_and_an_earlier_one_only_the_reasons():
    cone = curve(SpecialKind.IMPACT_CONE, [[0.1, 0.1]], "a | stick", "a | slip+", codimension_two=(True, False))
    record = cone.record()
    assert SpecialCurve.from_record(record).codimension_two == (True, False)
    del record["codimension_two"]
    assert SpecialCurve.from_record(record).codimension_two == (False, False)
    earlier = record | {"end": "the sequence before the special point becomes 'slip+ | slip+'"}
    assert SpecialCurve.from_record(earlier).codimension_two == (False, True)


def test_axes_of_curves_have_the_units_of_both_parameters(diagram):
    fold = curve(SpecialKind.FOLD, [[0.1, 4.0], [0.2, 5.0]], "stick | stick", "stick | stick")
    fold = replace(fold, parameters=("slope", "leg_mass"), units=("rad", "kg"))
    (axes,) = plot_curves(replace(diagram, curves=(fold,))).axes
    assert (axes.get_xlabel(), axes.get_ylabel()) == ("leg mass [kg]", "slope [deg]")
    np.testing.assert_allclose(axes.lines[0].get_ydata(), np.degrees([0.1, 0.2]))


def test_a_diagram_without_curves_is_named(diagram):
    with pytest.raises(InputError, match="has no curves of special points"):
        plot_curves(diagram)


def test_special_points_of_a_longer_period_are_marked_at_each_step(diagram):
    """The second doubling is that of a gait of two steps; each marker lies on its branch."""
    branch = diagram.branches[1]
    (point,) = branch.special_of(SpecialKind.PERIOD_DOUBLING)
    orbit = branch.orbit_of(point)
    np.testing.assert_array_equal(orbit[0], point.z)
    nearest = np.argmin(np.abs(branch.values - point.value))
    np.testing.assert_allclose(orbit[1], branch.orbits[nearest, 1], atol=1e-6)
    assert np.max(np.abs(orbit[1] - orbit[0])) > 0.01
    markers = [line.get_ydata() for line in plot_branches(diagram).axes[0].lines if line.get_marker() == "D"]
    assert [len(heights) for heights in markers] == [1, 2, 4, 8, 16]
    np.testing.assert_allclose(np.deg2rad(markers[1]), orbit[:, 0])


def test_the_orbit_of_a_special_point_is_known_if_a_coordinate_is_constant(diagram):
    """The speed of a foot that never slips differs from zero by rounding errors only."""
    branch = diagram.branches[1]
    (point,) = branch.special_of(SpecialKind.PERIOD_DOUBLING)
    constant = branch.orbits.copy()
    constant[..., 0] = 0.0
    moved = replace(point, z=np.concatenate([[1e-13], point.z[1:]]))
    orbit = replace(branch, orbits=constant).orbit_of(moved)
    np.testing.assert_allclose(orbit[1, 1:], branch.orbit_of(point)[1, 1:], atol=1e-6)
    assert orbit[1, 0] == 0


def test_a_stable_line_ends_at_the_bifurcation(diagram):
    branch = diagram.branches[0]
    (point,) = branch.special_of(SpecialKind.PERIOD_DOUBLING)
    pieces = list(split_branch(branch))
    assert [stable for _, _, stable in pieces] == [True, False]
    for piece, end in zip((piece for piece, _, _ in pieces), (-1, 0), strict=True):
        assert branch.values[piece][end] == pytest.approx(point.value, abs=1e-9)
    # Without the located point, the line between the neighbours is that of the unstable gait.
    apart = np.abs(branch.radii - 1) > 1e-6
    arrays = {name: getattr(branch, name)[apart] for name in ("values", "orbits", "multipliers")}
    coarse = replace(branch, sequences=tuple(np.array(branch.sequences)[apart].tolist()), **arrays)
    (_, *_), (piece, _, stable) = split_branch(coarse)
    assert not stable
    assert coarse.stable[piece.start]


def test_pieces_of_different_sequences_are_joined_only_where_the_quantity_is_continuous(diagram):
    branch = replace(diagram.branches[0], sequences=("a | b",) * 3 + ("c | b",) * (len(diagram.branches[0].values) - 3))
    assert next(piece.stop for piece, _, _ in split_branch(branch)) == 4
    apart = list(split_branch(branch, joined=False))
    assert (apart[0][0].stop, apart[1][0].start, apart[0][1], apart[1][1]) == (3, 3, "a | b", "c | b")


def test_the_legend_of_branches_has_unstable_gaits_only_if_one_is_drawn(diagram):
    """The limit of stability is not drawn with the dashes of unstable gaits."""
    (branch, *_), legends = diagram.branches, []
    for multipliers in (branch.multipliers, np.zeros_like(branch.multipliers)):
        figure = plot_branches(replace(diagram, branches=(replace(branch, multipliers=multipliers),)))
        legends.append([text.get_text() for text in figure.legends[0].get_texts()])
        assert {line.get_linestyle() for line in figure.axes[1].lines if line.get_label() != "_unstable"} == {"-", ":"}
    assert set(legends[0]) - set(legends[1]) == {"unstable"}


def test_the_title_of_branches_states_changed_parameters(diagram):
    default = {each.name: each.default for each in compass_biped().parameters}
    titles = [
        title_of(plot_branches(replace(diagram, parameters=diagram.parameters | default | changes)))
        for changes in (
            {"friction": math.inf},
            {"friction": math.inf, "hip_mass": 14.0, "leg_length": 0.9},
            {"friction": math.inf, "gravity": 1.62},
        )
    ]
    assert titles[0] == "compass biped, infinite friction"
    assert titles[1] == "compass biped, infinite friction\nleg length 0.9 m, hip mass 14 kg"
    assert titles[2] == "compass biped, infinite friction\ngravity 1.62 m/s\N{SUPERSCRIPT TWO}"
    lines = title_of(plot_branches(diagram)).splitlines()
    assert (len(lines), max(map(len, lines)) <= 58) == (3, True)
    assert "leg mass 5 kg" in lines[1]
