"""Figures of every kind of result fit on a journal column and on a page, and show what the result contains."""

import json
import re
from dataclasses import replace
from itertools import combinations, pairwise

import numpy as np
import pytest
import xarray as xr
from matplotlib.colors import to_hex, to_rgb
from matplotlib.patches import Patch
from matplotlib.text import Text

from gaitopt import FigureStyle, InputError, basin, compare, compass_biped, load_diagram, rimless_wheel
from gaitopt.continuation.optimal.optimal_branch import OptimalBranch, OptimalDiagram
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.printable import show_minus
from gaitopt.plot import (
    basin_figure,
    plot_basin,
    plot_optima,
    plot_ranking,
    plot_result,
    plot_robustness,
    plot_sweep,
    plot_tuning,
    view_result,
)
from gaitopt.plot.basin_figure import FAILURES, ending_looks
from gaitopt.plot.comparison_figure import TERMS
from gaitopt.plot.style import BODY, CONE, FORCE, LINES, MODE_FILL, area_color, leg_color, line_style
from gaitopt.plot.sweep_figure import find_lowest
from gaitopt.report.chart import COLOURS
from gaitopt.stability.recovery import Recovery
from gaitopt.study import RobustnessMargins, RobustnessRecord
from gaitopt.study.sequence_search.ranking import RankedGait, Ranking, judge_gait, rank_gaits
from gaitopt.tuning.controller_family import FamilySettings
from gaitopt.tuning.record import Trial
from gaitopt.tuning.tuning_file import TunedGains
from tests.conftest import ROOT
from tests.plot.test_gait_figure import check_texts

SEQUENCES = ["stick | stick", "slip+ stick | slip+", "slip- stick slip+ | stick"]


def make_sweep(**axes):
    """A sweep in which the first sequence has the lowest cost below the middle of the last axis, the second above."""
    shape = (3, *(len(values) for values in axes.values()))
    cost = np.full(shape, np.nan)
    cost[0] = np.linspace(1, 2, shape[-1])
    cost[1] = np.linspace(1.39, 1.59, shape[-1])
    cost[0, ..., 0] = np.nan  # its first point failed
    dims = ("sequence", *axes)
    table = xr.Dataset(
        {
            "cost_of_transport": (dims, cost, {"units": "1"}),
            "objective": (dims, cost, {"units": "1"}),
            "peak_torque": ((*dims, "actuator"), np.stack([cost, -3 * cost], axis=-1), {"units": "N m"}),
            "status": (dims, np.where(np.isfinite(cost), "solved", "infeasible")),
        },
        {"sequence": SEQUENCES, **{name: (name, values, {"units": "rad"}) for name, values in axes.items()}},
    )
    return table.assign_attrs(format="gaitopt sweep", question='{"problem": {"robot": "compass_biped"}}')


def make_front():
    columns = {"cost": [1.0, 2.0, 4.0], "peak_torque": [6.0, 3.0, 2.0], "front": [1, 1, 1], "knee": [0, 1, 0]}
    table = xr.Dataset({name: ("point", values) for name, values in columns.items()})
    return table.assign_attrs(objectives=["cost", "peak_torque"], objective="cost_of_transport", format="gaitopt front")


def make_record():
    kinds = ("push", "downhill slope", "uphill slope", "friction patch", "torque noise", "sensor delay")
    units = ("rad/s", "rad", "rad", "1", "N m", "s")
    margins = [RobustnessMargins(kind, 0.1, 0.12, unit) for kind, unit in zip(kinds, units, strict=True)]
    recovery = Recovery(radius=0.1, starts=4, returned=3, steps=30, tolerance=1e-4, settling=(5, 9, 7))
    recoveries = {"computed torque, by the stance angle": recovery, "open loop": recovery, "none": None}
    return RobustnessRecord(law="lqr", radius=0.5, steps=50, margins=tuple(margins), recoveries=recoveries)


def make_gains():
    gains = {"stiffness": 30.0}
    trials = tuple(Trial(gains, value) for value in (0.8, float("inf"), 0.5, 0.6))
    options = {"settings": FamilySettings(), "objective": "spectral radius", "trials": trials, "radius_before": 0.7}
    return TunedGains(family="joint_pd", gains=gains, radius=0.5, multipliers=(0.3 + 0.4j, 0.3 - 0.4j), **options)


@pytest.fixture(scope="module")
def results(slipping_both_ways, hop_gait):
    diagram = load_diagram(ROOT / "docs/examples/compass_slope.nc")
    rates = {"theta_rate": np.linspace(0.1, 3, 6)}
    wheel = basin(rimless_wheel(), {"slope": 0.23}, rates)
    plane = basin(rimless_wheel(), {}, {**rates, "slope": [0.1, 0.3]})
    ranking = rank_gaits([judge_gait(gait, 5e-4, None) for gait in (slipping_both_ways, slipping_both_ways)], True)
    planar = RankedGait(sequence=hop_gait.sequence, status="solved", gait=hop_gait)
    return {
        "gait": slipping_both_ways,
        "gait of several contacts": hop_gait,
        "comparison": compare({"one": slipping_both_ways, "other": slipping_both_ways}),
        "branches": diagram,
        "sweep": make_sweep(slope=np.linspace(0.0, 0.1, 5)),
        "sweep over two": make_sweep(slope=[0.0, 0.1], friction=np.linspace(0.1, 0.2, 4)),
        "basin": wheel,
        "basin over two": plane,
        "front": make_front(),
        "ranking": ranking,
        "ranking of several contacts": Ranking((planar,), True),
        "push test": make_record(),
        "tuned gains": make_gains(),
    }


@pytest.mark.slow
@pytest.mark.parametrize(("width", "names"), [(3.5, ()), (7.0, ("sweep over two", "ranking", "push test"))])
def test_no_figure_is_clipped_and_no_texts_overlap(results, width, names):
    style = FigureStyle(width=width, font_size=8)
    for name, result in results.items():
        if names and name not in names:
            continue
        figure = plot_result(result, style=style)
        figure.draw_without_rendering()
        box, (across, upward) = figure.get_tightbbox(), figure.get_size_inches()
        tolerance = 0.02  # inch
        inside = (box.x0 > -tolerance, box.y0 > -tolerance, box.x1 < across + tolerance, box.y1 < upward + tolerance)
        assert all(inside), (name, box.bounds, (across, upward))
        assert across == width
        check_texts(figure, least=6)


def test_a_sweep_over_one_parameter_has_a_line_for_each_sequence_and_marks_the_lowest_cost():
    figure = plot_sweep(make_sweep(slope=np.linspace(0.0, 0.1, 5)))
    (axes,) = figure.axes
    lines = {line.get_label(): line for line in axes.lines}
    assert [line.get_label() for line in axes.lines if line.get_label()[0] != "_"][:3] == SEQUENCES
    np.testing.assert_allclose(lines["stick | stick"].get_xdata(), np.degrees(np.linspace(0.0, 0.1, 5)))
    marks = [line.get_xdata() for line in axes.lines if line.get_label() == "_lowest"]
    np.testing.assert_allclose(np.degrees([0.025]), marks[0])
    np.testing.assert_allclose(np.degrees([0.0, 0.05, 0.075, 0.1]), marks[1])
    failures = [line for line in axes.lines if line.get_label() == "_failure"]
    assert [line.get_xdata().size for line in failures] == [1, 5]
    assert axes.get_xlabel() == "slope [deg]"


@pytest.mark.parametrize(("name", "label"), [("torque_squared", "lowest torque squared"), (None, "lowest cost")])
def test_the_legend_of_a_sweep_names_the_objective_and_the_points_without_a_gait(name, label):
    table = make_sweep(slope=np.linspace(0.0, 0.1, 5))
    if name:
        table["objective"].attrs["name"] = name
    texts = [text.get_text() for legend in plot_sweep(table).legends for text in legend.get_texts()]
    assert texts == [*map(show_minus, SEQUENCES), label, "no gait"]
    table["peak_torque"][0, 2] = np.nan  # of a solved gait
    texts = [text.get_text() for legend in plot_sweep(table, quantity="peak_torque").legends for text in legend.texts]
    assert texts[-1] == "no value"
    complete = plot_sweep(table.isel(sequence=[1]))
    assert [text.get_text() for legend in complete.legends for text in legend.get_texts()] == [SEQUENCES[1]]


def test_a_sweep_shows_its_objective_unless_another_quantity_is_named():
    table = make_sweep(slope=np.linspace(0.0, 0.1, 5))
    table["objective"] = 100 * table.cost_of_transport
    table["objective"].attrs |= {"name": "torque_squared", "units": "N^2 m^2 s"}
    (axes,) = plot_sweep(table).axes
    assert axes.get_ylabel() == "torque squared [N² m² s]"
    np.testing.assert_allclose(axes.lines[0].get_ydata()[1:], table.objective.values[0, 1:])
    assert plot_sweep(table, quantity="cost_of_transport").axes[0].get_ylabel() == "cost of transport"
    table["objective"].attrs |= {"name": "cost_of_transport", "units": "1"}
    assert plot_sweep(table).axes[0].lines[0].get_ydata()[1] < 10  # without the quadrature error of the objective


def test_a_sweep_of_spectral_radii_shows_the_stability_limit():
    line = make_sweep(slope=np.linspace(0.0, 0.1, 5))
    plane = make_sweep(slope=[0.0, 0.05, 0.1], friction=np.linspace(0.1, 0.2, 4))
    for table in (line, plane):
        table["spectral_radius"] = (table.cost_of_transport.dims, table.cost_of_transport.values - 0.4, {"units": "1"})
        figure = plot_sweep(table, quantity="spectral_radius")
        texts = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
        assert "stability limit" in texts
        assert "stability limit" not in [t.get_text() for each in plot_sweep(table).legends for t in each.get_texts()]
    (axes,) = plot_sweep(line, quantity="spectral_radius").axes
    (limit,) = [each for each in axes.lines if each.get_label() == "stability limit" and len(each.get_ydata())]
    assert list(limit.get_ydata()) == [1, 1]
    plane["spectral_radius"] -= 0.9  # all gaits are stable
    assert len(plot_sweep(plane, quantity="spectral_radius").legends[0].texts) == 2


def test_the_lowest_cost_is_that_of_the_sequences_that_are_left():
    table = make_sweep(slope=np.linspace(0.0, 0.1, 5))
    table["lowest_sequence"] = ("slope", np.array([SEQUENCES[1], SEQUENCES[0], *[SEQUENCES[1]] * 3], dtype=object))
    assert find_lowest(table).tolist() == [1, 0, 1, 1, 1]
    assert find_lowest(table.isel(sequence=[0])).tolist() == [-1, 0, 0, 0, 0]


def test_a_sweep_of_many_sequences_names_those_with_a_gait_and_marks_points_without_any_in_one_row():
    few, names = make_sweep(slope=np.linspace(0.0, 0.1, 5)), [f"stick | {number}" for number in range(12)]
    many = xr.concat([few.isel(sequence=[number % 3]) for number in range(12)], "sequence")
    many = many.assign_coords(sequence=names)  # sequences 2, 5, 8, 11 have no gait; 0, 3, 6, 9 none at the first point
    axes = plot_sweep(many).axes[0]
    texts = [text.get_text() for text in axes.get_figure().legends[0].texts]
    assert texts == [*(name for number, name in enumerate(names) if number % 3 < 2), "lowest cost"]
    many["status"][:, 2], many["cost_of_transport"][:, 2], many["objective"][:, 2] = "infeasible", np.nan, np.nan
    axes = plot_sweep(many).axes[0]
    crosses = [line for line in axes.lines if line.get_label() == "_failure"]
    assert [line.get_xdata().tolist() for line in crosses] == [[pytest.approx(np.degrees(0.05))]]
    assert axes.get_figure().legends[0].texts[-1].get_text() == "no gait"


def test_the_ticks_of_a_map_with_few_cells_are_at_their_centres():
    few, many = np.array([0.1, 0.125, 0.16]), np.linspace(0.1, 0.2, 9)
    quantity, regions = plot_sweep(make_sweep(slope=np.radians(few), friction=many)).axes[:2]
    for axes in (quantity, regions):
        np.testing.assert_allclose(axes.get_xticks(), few)
    assert [text.get_text() for text in regions.get_xticklabels()] == ["0.1", "0.125", "0.16"]
    assert len(quantity.get_yticks()) != many.size
    crowded = np.array([0.1, 0.101, 0.16])
    assert len(plot_sweep(make_sweep(slope=np.radians(crowded), friction=many)).axes[0].get_xticks()) > 3


def test_a_sweep_without_a_gait_states_whether_it_was_interrupted():
    table = make_sweep(slope=np.linspace(0.0, 0.1, 5))
    table["status"][:] = "infeasible"
    for complete, said in ((1, r"draw\.$"), (0, "the same command resumes it")):
        with pytest.raises(InputError, match=said):
            plot_sweep(table.assign_attrs(complete=complete))


def test_a_sweep_over_two_parameters_shows_the_sequence_of_lowest_cost():
    figure = plot_sweep(make_sweep(slope=[0.0, 0.1], friction=np.linspace(0.1, 0.2, 4)), quantity="peak_torque")
    quantity, regions = figure.axes[0].collections[0], figure.axes[1].collections[0]
    assert np.asarray(regions.get_array()).reshape(4, 2)[:, 0].tolist() == [1, 0, 1, 1]
    np.testing.assert_allclose(np.asarray(quantity.get_array()).reshape(4, 2)[1], 3 * (1 + 1 / 3))
    texts = [text.get_text() for legend in figure.legends for text in legend.get_texts()]
    assert texts == SEQUENCES[:2]


def title_of(figure):
    """Return the title of a figure; it is that of a legend, as both would lie at the top of the page."""
    assert not (figure.get_suptitle() and figure.legends)
    return figure.legends[0].get_title().get_text() if figure.legends else figure.get_suptitle()


def test_a_sweep_states_its_robot_and_its_only_sequence_and_names_points_without_a_gait():
    table = make_sweep(slope=[0.0, 0.1], friction=np.linspace(0.1, 0.2, 4)).isel(sequence=[0])
    figure = plot_sweep(table)
    assert title_of(figure) == f"compass biped, {SEQUENCES[0]}"
    assert [text.get_text() for legend in figure.legends for text in legend.get_texts()] == ["no gait"]
    several = make_sweep(slope=np.linspace(0.0, 0.1, 5))
    assert title_of(plot_sweep(several)) == "compass biped"
    assert title_of(plot_sweep(several, style=FigureStyle(titled=False))) == ""
    complete = table.assign(lowest_sequence=(table.status.dims[1:], np.full(table.status.shape[1:], SEQUENCES[0])))
    assert title_of(plot_sweep(complete.fillna(1.0))) == f"compass biped, {SEQUENCES[0]}"


def test_the_title_of_a_sweep_has_at_most_three_lines():
    long = "heel A stick, toe B stick > heel A stick, toe B slip+ | heel A stick, toe A stick > toe A stick |"
    long += " heel B stick > heel B stick, toe B stick |"
    table = make_sweep(slope=[0.0, 0.1], friction=np.linspace(0.1, 0.2, 4)).isel(sequence=[1])
    table = table.assign_coords(sequence=[long])
    assert title_of(plot_sweep(table)).replace("\n", " ") == f"compass biped, {long}"
    title = title_of(plot_sweep(table, style=FigureStyle(width=3.5)))
    assert title.count("\n") == 2
    assert title.endswith("\N{HORIZONTAL ELLIPSIS}")


def test_the_title_of_a_sweep_states_the_targets_that_are_not_axes_and_the_legend_its_only_sequence():
    problem = {"robot": "compass_biped", "slope": 0.1, "friction": 0.25, "speed": 0.6, "step_length": [0.4, 0.5]}
    table = make_sweep(slope=np.linspace(0.0, 0.1, 5)).isel(sequence=[1])
    figure = plot_sweep(table.assign_attrs(question=json.dumps({"problem": problem})))
    assert title_of(figure) == "compass biped, friction 0.25, speed 0.6 m/s"
    assert figure.legends[0].get_texts()[0].get_text() == SEQUENCES[1]


def test_the_title_of_a_sweep_states_the_parameters_of_the_script_that_were_set():
    table = make_sweep(friction=np.linspace(0.1, 0.2, 4))
    values = {"leg_mass": 5.0, "speed": 0.7, "friction": 0.2, "torque_limit": 8.0, "hip_mass": 2.0}
    script = {"set": ["leg_mass", "speed", "friction", "torque_limit"], "parameters": values}
    question = json.dumps({"problem": {"robot": "compass_biped", "speed": 0.7}})
    table = table.assign_attrs(question=question, script=json.dumps(script))
    lines = ["compass biped, speed 0.7 m/s", "set: leg mass 5, torque limit 8"]
    assert title_of(plot_sweep(table)).splitlines() == lines
    plane = make_sweep(slope=[0.0, 0.1], friction=[0.1, 0.2]).assign_attrs(table.attrs)
    assert title_of(plot_sweep(plane)).splitlines() == lines


def test_the_title_of_a_front_states_its_robot_and_what_was_set():
    problem = {"robot": "compass_biped", "sequence": "stick | stick", "friction": 0.25, "speed": 0.6}
    script = {"set": ["leg_mass", "speed"], "parameters": {"leg_mass": 5.0, "speed": 0.6}}
    front = make_front().assign_attrs(question=json.dumps({"problem": problem}), script=json.dumps(script))
    lines = ["compass biped, stick | stick, friction 0.25, speed 0.6 m/s", "set: leg mass 5"]
    assert plot_result(front).get_suptitle().splitlines() == lines
    assert plot_result(front, style=FigureStyle(titled=False)).get_suptitle() == ""
    assert plot_result(make_front()).get_suptitle() == ""
    speeds = front.rename(peak_torque="speed").assign_attrs(objectives=["cost", "speed"])
    assert "speed" not in plot_result(speeds).get_suptitle()


def test_the_title_of_optima_states_robot_and_fixed_parameters_as_that_of_branches():
    values, flags, counts = np.linspace(0.1, 0.2, 3), np.ones(3, dtype=bool), np.zeros(3, dtype=int)
    branch = OptimalBranch(
        sequence="stick | stick",
        names=("th1",),
        values=values,
        costs=values,
        cost_slopes=values,
        cost_errors=values,
        states=np.ones((3, 1)),
        multipliers=np.full((3, 1), 0.5 + 0j),
        replayed=flags,
        passed=flags,
        state_errors=values,
        negative=counts,
        dependent=counts,
        strictness=values,
        active=counts,
        special=(),
        end="range_end",
    )
    diagram = OptimalDiagram(
        robot="compass_biped",
        objective="torque_squared",
        parameter="friction",
        unit="1",
        parameters={"slope": np.radians(2.0), "leg_mass": 5.0},
        ends=(0.1, 0.2),
        branches=(branch,),
    )
    assert plot_optima(diagram).legends[0].get_title().get_text() == "compass biped, slope 2 deg\nleg mass 5 kg"
    fixed = replace(diagram, targets={"speed": 0.6, "step_length": 0.45})
    title = "compass biped, slope 2 deg, speed 0.6 m/s,\nstep length 0.45 m\nleg mass 5 kg"
    for width in (3.5, 7.2):
        figure = plot_optima(fixed, style=FigureStyle(width=width))
        text = figure.legends[0].get_title().get_text()
        assert text.split() == title.split()
        figure.draw_without_rendering()
        assert figure.legends[0].get_title().get_window_extent().x1 < figure.bbox.x1
    assert text.count("\n") == 1
    assert plot_optima(diagram, style=FigureStyle(titled=False)).legends[0].get_title().get_text() == ""


def test_the_centre_of_the_colours_of_a_map_of_spectral_radii_is_the_stability_limit():
    table = make_sweep(slope=[0.0, 0.1], friction=np.linspace(0.1, 0.2, 4)).isel(sequence=[1])
    for radii, ends, extent in (([0.5, 0.9, 1.2, 30.0], (0, 2), "max"), ([0.8, 0.9, 1.1, 1.2], (0.8, 1.2), "neither")):
        table["spectral_radius"] = table.cost_of_transport.dims, np.broadcast_to(radii, table.status.shape)
        table.spectral_radius.attrs["units"] = "1"
        figure = plot_sweep(table, quantity="spectral_radius")
        mesh = figure.axes[0].collections[0]
        assert (mesh.norm.vmin, mesh.norm.vmax) == pytest.approx(ends)
        assert float(mesh.norm(1.0)) == 0.5
        assert mesh.colorbar.extend == extent
        assert mesh.colorbar.ax.get_xlim() == pytest.approx((min(radii), min(max(radii), 2)))
        blue, grey, red = (mesh.to_rgba(value)[:3] for value in (ends[0], 1.0, ends[1]))
        assert blue[2] > blue[0] + 0.3
        assert red[0] > red[2] + 0.3
        assert np.ptp(grey) < 0.02 < 0.1 < 1 - max(grey)  # points without a gait are white


def test_axes_of_a_sweep_begin_at_zero_instead_of_a_margin_below_it():
    table = make_sweep(friction=np.linspace(0.0, 0.1, 5)).isel(sequence=[0])
    table["objective"].attrs |= {"name": "torque_squared", "units": "N^2 m^2 s"}
    for factor in (1.0, 0.0):
        table["objective"].values[:] = factor * (table.cost_of_transport.values - 1.25)
        (axes,) = plot_sweep(table).axes  # of a sequence with a point without a gait
        (failure,) = [line for line in axes.lines if line.get_label() == "_failure"]
        assert max(failure.get_ydata()) < 0  # below the line
        assert min(axes.get_yticks()) >= 0
        (axes,) = plot_sweep(table.isel(friction=slice(1, None))).axes
        assert axes.get_ylim()[0] == 0
    table["objective"].values[:] = table.cost_of_transport.values - 2
    (axes,) = plot_sweep(table).axes
    assert axes.get_ylim()[0] < -0.75
    assert plot_sweep(table.fillna(1.0)).axes[0].get_xlim()[0] == 0


def test_a_basin_has_a_colour_for_each_ending(results):
    handles = plot_basin(results["basin over two"]).legends[0].legend_handles
    colors = {handle.get_label(): handle.get_facecolor() for handle in handles if isinstance(handle, Patch)}
    assert {"fell", "stick | stick"} <= set(colors)
    assert len(set(colors.values())) == len(colors)
    labels = ["a | b", "ambiguous", "fell", "jam", "lift_off", "no_start", "no_touchdown", "painleve", "unsettled"]
    looks = ending_looks(labels)
    failures = [looks[label] for label in labels[1:]]
    for one, other in combinations(failures, 2):  # greys that are far apart, or different hatches
        assert one.hatch != other.hatch or np.abs(np.subtract(to_rgb(one.color), to_rgb(other.color))).max() > 0.4


def test_a_basin_states_its_robot_and_marks_its_gaits():
    wheel = rimless_wheel()
    table = basin(wheel, {"slope": 0.2}, {"theta_rate": [0.1, 1.0, 3.0]})
    figure = plot_basin(table)
    assert figure.legends[0].get_title().get_text() == "rimless wheel, slope 11.46 deg, infinite friction"
    marked = [line.get_xdata()[0] for line in figure.axes[0].lines if line.get_label() == "gait"]
    assert marked == pytest.approx([float(table.final[1, 0])])
    over_two = basin(wheel, {"friction": 1.0}, {"theta_rate": [0.1, 1.0, 3.0], "slope": [0.15, 0.2]})
    (marks,) = [line for line in plot_basin(over_two).axes[0].lines if line.get_label() == "gait"]
    np.testing.assert_allclose(marks.get_xdata(), over_two.final[1, :, 0], atol=1e-6)
    np.testing.assert_allclose(marks.get_ydata(), np.degrees([0.15, 0.2]))
    failed = basin(wheel, {"slope": 0.2}, {"theta_rate": [0.1, 0.12]})
    assert "gait" not in [text.get_text() for text in plot_basin(failed).legends[0].get_texts()]


@pytest.mark.parametrize("width", [3.5, 7.2])
def test_the_other_coordinates_of_the_starts_of_a_basin_are_inside_the_figure_as_symbols(width):
    starts = {"slope": 0.04, "friction": 0.14, "th1": -0.14741, "foot_speed": 0.13681}
    table = basin(compass_biped(), starts, {"th1_rate": [0.5, 0.6], "th2_rate": [0.4, 0.5]})
    figure = plot_basin(table, style=FigureStyle(width=width))
    assert r"$\theta_{1}$ -0.1474" in figure.axes[0].get_title()
    check_texts(figure)


def test_large_radii_of_a_sweep_are_on_a_logarithmic_axis_and_its_crosses_below_them():
    table = make_sweep(friction=np.linspace(0.1, 0.2, 4)).isel(sequence=[1])
    for radii, scale in (([0.5, 0.7, 0.8, 3.0], "linear"), ([0.5, 0.7, np.nan, 1e4], "log")):
        table["spectral_radius"] = table.cost_of_transport.dims, np.broadcast_to(radii, table.status.shape)
        table.spectral_radius.attrs["units"] = "1"
        figure = plot_sweep(table, quantity="spectral_radius")
        (axes,) = figure.axes
        assert axes.get_yscale() == scale
        check_texts(figure)
    (crosses,) = [line for line in axes.lines if line.get_label() == "_failure"]
    assert axes.get_ylim()[0] < crosses.get_ydata()[0] < 0.5
    assert crosses.get_ydata()[0] > 0


@pytest.mark.parametrize(("width", "across", "upward"), [(3.5, 1, 2), (7.2, 2, 1)])
def test_labels_of_the_maps_of_a_sweep_are_beside_their_panels(width, across, upward):
    figure = plot_sweep(make_sweep(slope=[0.0, 0.1], friction=[0.1, 0.2]), style=FigureStyle(width=width))
    panels = [axes for axes in figure.axes if axes.get_label() != "<colorbar>"]
    assert [axes.xaxis.label.get_visible() and bool(axes.get_xlabel()) for axes in panels].count(True) == across
    assert [axes.yaxis.label.get_visible() and bool(axes.get_ylabel()) for axes in panels].count(True) == upward


def test_failures_of_a_basin_have_hatches(results, monkeypatch):
    labels = np.array([["fell"] * 2, ["lift_off"] * 2] * 3)
    monkeypatch.setattr(basin_figure, "ending_labels", lambda _: labels)
    figure = plot_basin(results["basin over two"])
    assert [part.get_hatch() for part in figure.axes[0].collections] == [None, FAILURES["lift_off"].hatch]
    assert [handle.get_hatch() or "" for handle in figure.legends[0].legend_handles] == ["", FAILURES["lift_off"].hatch]


def test_the_ranking_is_drawn_from_the_lowest_cost_down(results, slipping_both_ways):
    costs = plot_ranking(results["ranking"]).axes[0]
    assert next(text.get_text() for text in costs.texts).startswith(show_minus(str(slipping_both_ways.sequence)))
    modes = plot_ranking(results["ranking of several contacts"]).axes[1]
    assert sum(patch.get_width() for patch in modes.patches) == pytest.approx(100)
    assert modes.get_xlabel() == "fraction of the step [%]"


def test_each_bar_of_a_ranking_has_a_named_row_for_every_foot(hop_gait, slipping):
    gaits = [RankedGait(sequence=gait.sequence, status="solved", gait=gait) for gait in (hop_gait, slipping)]
    figure = plot_ranking(Ranking(tuple(gaits), True))
    costs, modes = figure.axes
    assert modes.get_xlabel().splitlines()[1] == "from top: foot, stance foot"
    widths = {}
    for patch in modes.patches:
        level = round(patch.get_y() + patch.get_height() / 2, 6)
        widths[level] = widths.get(level, 0.0) + patch.get_width()
    assert list(widths.values()) == pytest.approx([100.0] * 4)
    assert costs.texts[0].get_text().startswith("'foot stick > flight |': ")


def test_tuned_gains_show_the_search_and_the_multipliers(results):
    search, plane = plot_tuning(results["tuned gains"]).axes
    lowest = next(line for line in search.lines if line.get_label() == "lowest so far")
    assert lowest.get_ydata().tolist() == [0.8, 0.8, 0.5, 0.5]
    assert {line.get_label() for line in search.lines} >= {"open loop", "stability limit"}
    assert sorted(plane.lines[-1].get_ydata()) == [-0.4, 0.4]


@pytest.mark.parametrize("width", [7.2, 3.5])
def test_evaluations_have_ticks_at_integers(results, width):
    for count in (2, 9, 10):
        trials = tuple(Trial({"stiffness": 30.0}, 0.8) for _ in range(count))
        search = plot_tuning(replace(results["tuned gains"], trials=trials), style=FigureStyle(width=width)).axes[0]
        assert all(float(tick).is_integer() for tick in search.get_xticks())


@pytest.mark.parametrize("lowest", [0.5, 1e-3])
def test_an_open_loop_below_the_stability_limit_is_a_line(results, lowest):
    trials = tuple(Trial({"stiffness": 30.0}, value) for value in (0.8, lowest))
    search = plot_tuning(replace(results["tuned gains"], trials=trials, radius_before=0.634)).axes[0]
    assert "open loop" in {line.get_label() for line in search.lines}
    assert not search.texts


@pytest.mark.parametrize(("radius", "drawn"), [(2.424, True), (50.0, False)])
def test_the_open_loop_of_tuned_gains_lies_within_the_axis_or_is_a_text(results, radius, drawn):
    search = plot_tuning(replace(results["tuned gains"], radius_before=radius)).axes[0]
    assert ("open loop" in {line.get_label() for line in search.lines}) == drawn
    assert (search.get_ylim()[1] > radius) == drawn
    assert [text.get_text() for text in search.texts] == ([] if drawn else ["\N{UPWARDS ARROW} open loop: 50"])
    assert all(text.get_window_extent().y0 > search.get_window_extent().y1 for text in search.texts)


def test_an_open_loop_slightly_above_the_stability_limit_is_a_line_above_it(results):
    trials = tuple(Trial({"stiffness": 30.0}, value) for value in (0.8, 1e-3))
    search = plot_tuning(replace(results["tuned gains"], trials=trials, radius_before=1.01)).axes[0]
    assert "open loop" in {line.get_label() for line in search.lines}
    assert search.get_ylim()[1] > 1.01
    assert not search.texts


def test_the_colour_bar_of_stable_gaits_ends_at_the_largest_radius():
    table = make_sweep(slope=[0.0, 0.1], friction=np.linspace(0.1, 0.2, 4)).isel(sequence=[1])
    for radii, ends in (([0.5, 0.7, 0.8, 0.9], (0.5, 0.9)), ([0.7] * 4, (0.7, 0.75)), ([1.4] * 4, (1.35, 1.4))):
        table["spectral_radius"] = table.cost_of_transport.dims, np.broadcast_to(radii, table.status.shape)
        table.spectral_radius.attrs["units"] = "1"
        bar = plot_sweep(table, quantity="spectral_radius").axes[0].collections[0].colorbar
        assert bar.ax.get_xlim() == pytest.approx(ends)


def test_walks_none_of_which_returns_are_above_the_axis(results):
    axes = plot_robustness(results["push test"]).axes[-1]
    assert axes.get_ylabel() == "returned [%]"
    assert axes.get_ylim()[0] < -2


def test_a_push_test_has_an_axis_for_each_disturbance(results):
    record = results["push test"]
    figure = plot_robustness({"one": record, "other": replace(record, margins=record.margins[:1])})
    titles = [axes.get_title(loc="left") for axes in figure.axes]
    assert titles[:2] == ["push [rad/s]", "downhill slope [deg]"]
    assert figure.axes[1].patches[0].get_width() == pytest.approx(np.degrees(0.1))
    assert [[text.get_text() for text in axes.texts] for axes in figure.axes[:2]] == [[], ["not tested"]]
    returned = figure.axes[-1].lines[0].get_ydata()
    assert returned.max() == 75


def test_lines_of_a_test_have_the_colour_of_its_bars(results):
    record = results["push test"]
    figure = plot_robustness({"open loop": record, "other": record})
    lines = {line.get_label(): line for line in figure.axes[-1].lines}
    names = ["computed torque, by the stance angle", "open loop"]
    assert list(lines) == [f"open loop: {names[0]}", "open loop", f"other: {names[0]}", "other: open loop"]
    bars = [to_hex(patch.get_facecolor()) for patch in figure.axes[0].patches]
    assert [to_hex(line.get_color()) for line in lines.values()] == [bars[0], bars[0], bars[1], bars[1]]
    assert len({str(line.get_linestyle()) for line in list(lines.values())[:2]}) == 2


def test_a_test_of_which_nothing_is_survived_has_a_cross_or_states_it(results):
    """A cross at the end of the axis is drawn whole, and the numbers of two columns lie apart."""
    record = results["push test"]
    values = {"push": (0.0, None), "torque noise": (0.0, 1e-3), "sensor delay": (0.5, None), "uphill slope": (0.1, 0.2)}
    weak = tuple(RobustnessMargins(kind, *margin, "1") for kind, margin in values.items())
    strong = tuple(RobustnessMargins(kind, 5.0, 6.0, "1") for kind in values)
    figure = plot_robustness({"weak": replace(record, margins=weak), "strong": replace(record, margins=strong)})
    axes = dict(zip(values, figure.axes, strict=False))
    assert [text.get_text() for each in axes.values() for text in each.texts] == ["none survived"]
    crosses = {kind: [line.get_xdata()[0] for line in each.lines] for kind, each in axes.items()}
    assert crosses == {"push": [6.0], "torque noise": [1e-3, 6.0], "sensor delay": [6.0], "uphill slope": [0.2, 6.0]}
    assert not any(line.get_clip_on() for line in axes["torque noise"].lines)
    left, right = axes["push"].get_position(), axes["sensor delay"].get_position()
    assert (right.x0 - left.x1) * figure.get_figwidth() > 0.25


@pytest.mark.slow
def test_push_tests_of_the_width_of_a_column_fit_on_half_a_page(results):
    """The key of several tests has an entry for each, and below the lines one for each kind of line."""
    record = replace(results["push test"], law="lqr")
    kinds = ["push", "downhill slope", "uphill slope", "friction patch", "torque noise", "sensor delay"]
    recovery = next(iter(record.recoveries.values()))
    margins = tuple(RobustnessMargins(kind, 0.1, 0.2, "1") for kind in kinds)
    for count, tallest in [(1, 4.5), (2, 5.0), (4, 6.0)]:
        names = [f"law_{number}" for number in range(count)]
        tests = {
            name: replace(record, law=name, margins=margins, recoveries={name: recovery, "open loop": recovery})
            for name in names
        }
        figure = plot_robustness(tests, style=FigureStyle(width=3.5))
        assert figure.get_figheight() <= tallest
        lower, upper = ([text.get_text() for text in legend.get_texts()] for legend in figure.legends)
        assert upper == [*(names if count > 1 else [f"{names[0]}: largest survived"]), "smallest not survived"]
        assert lower == ["under the law" if count > 1 else names[0], "open loop"]
        figure.draw_without_rendering()
        page = figure.bbox
        for axes in figure.axes:
            title = axes.get_title(loc="left")
            extents = [text.get_window_extent() for text in (axes._left_title, *axes.texts)]
            assert all(extent.x1 <= page.x1 for extent in extents), title


def test_what_has_no_figure_is_refused(results):
    flat = make_sweep(slope=[0.0], friction=[0.1])
    three = make_sweep(slope=[0.0, 0.1], friction=[0.1, 0.2], speed=[0.5, 0.6])
    for action, message in [
        (lambda: plot_sweep(flat), "at least two values"),
        (lambda: plot_sweep(three), r"at most two parameters of a sweep.*table.sel\(speed=0.5\)"),
        (lambda: plot_sweep(results["sweep"], quantity="peak_torqe"), "peak_torque"),
        (lambda: plot_result(1.0), "no figure of an object of class float"),
        (lambda: plot_result(results["tuned gains"], quantity="x"), "only sweeps and diagrams of periodic gaits"),
        (lambda: plot_robustness({}), "at least one record"),
    ]:
        with pytest.raises(InputError, match=message):
            action()


def test_numbers_of_many_evaluations_lie_apart_in_a_column():
    trials = make_gains().trials * 3000
    figure = plot_tuning(replace(make_gains(), trials=trials), style=FigureStyle(width=3.5))
    check_texts(figure)
    figure.draw_without_rendering()
    search = figure.axes[0]
    low, high = search.get_xlim()
    labels = [tick.label1 for tick in search.xaxis.get_major_ticks() if low <= tick.get_loc() <= high]
    boxes = [label.get_window_extent() for label in labels]
    assert len(boxes) > 2
    assert all(one.x1 + 2 < other.x0 for one, other in pairwise(boxes))
    assert boxes[-1].x1 < figure.bbox.x1


def simulate_deuteranopia(color):
    """Return a colour as readers without green cones see it (Vienot, Brettel and Mollon 1999, linear RGB)."""
    linear = np.array(to_rgb(color)) ** 2.2
    to_cones = np.array([[17.8824, 43.5161, 4.1194], [3.4557, 27.1554, 3.8671], [0.0300, 0.1843, 1.4671]])
    without_green = np.array([[1, 0, 0], [0.494207, 0, 1.24827], [0, 0, 1]])
    seen = np.linalg.solve(to_cones, without_green @ to_cones @ linear)
    return np.clip(seen, 0, 1) ** (1 / 2.2)


def test_colours_of_lines_and_areas_differ_without_green_cones():
    for colors in ([line_style(k)["color"] for k in range(5)], [area_color(k) for k in range(4)]):
        seen = [simulate_deuteranopia(color) for color in colors]
        gaps = [np.linalg.norm(a - b) for i, a in enumerate(seen) for b in seen[:i]]
        assert min(gaps) > 0.1, gaps


def test_legs_contact_modes_and_forces_differ_without_green_cones():
    marks = [MODE_FILL[mode] for mode in (Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)]
    for seen in (simulate_deuteranopia, lambda color: np.array(to_rgb(color))):
        colors = [seen(color) for color in (leg_color(0), leg_color(1), *marks, FORCE, CONE, BODY)]
        gaps = [np.linalg.norm(a - b) for i, a in enumerate(colors) for b in colors[:i]]
        assert min(gaps) > 0.2, gaps


def test_colours_of_lines_differ_from_those_of_slip():
    slips = [MODE_FILL[mode] for mode in (Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)]
    lines = [line_style(number)["color"] for number in range(len(LINES))]
    assert len(set(lines)) == len(LINES)
    for seen in (simulate_deuteranopia, lambda color: np.array(to_rgb(color))):
        gaps = [np.linalg.norm(seen(line) - seen(slip)) for line in lines for slip in slips]
        assert min(gaps) > 0.15, gaps


def test_colours_of_lines_in_pages_differ_from_those_of_slip():
    light, dark, *_ = (ROOT / "gaitopt/report/assets/parts.css").read_text(encoding="utf-8").split("@media")
    for rules in (light, light + dark):  # the dark theme overrides colours
        colors = dict(re.findall(r"--([a-z]+(?:-\d)?): (#[0-9a-f]{6})", rules))
        lines = [np.array(to_rgb(colors[f"line-{number}"])) for number in range(COLOURS)]
        slips = [np.array(to_rgb(colors[name])) for name in ("forward", "backward")]
        assert min(np.linalg.norm(line - slip) for line in lines for slip in slips) > 0.15


@pytest.mark.parametrize("name", ["gait", "sweep", "ranking"])
def test_contact_modes_have_a_minus_sign(results, name):
    texts = [text.get_text() for text in plot_result(results[name]).findobj(Text)]
    assert any("slip\N{MINUS SIGN}" in text for text in texts)
    assert not any("slip-" in text for text in texts)


def test_terms_of_the_cost_differ_from_the_lines_of_gaits_and_from_each_other():
    terms = [np.array(to_rgb(color)) for _, _, color, _ in TERMS]
    lines = [np.array(to_rgb(line_style(number)["color"])) for number in range(len(LINES))]
    assert min(np.linalg.norm(term - line) for term in terms for line in lines) > 0.2
    assert min(np.linalg.norm(a - b) for i, a in enumerate(terms) for b in terms[:i]) > 0.2


@pytest.mark.slow
def test_a_notebook_shows_results_with_their_figures(results):
    for name in ("ranking", "push test", "tuned gains", "branches"):
        page = view_result(results[name])
        assert page.count("<svg") == 1, name
        assert "<code>" in page
        assert len(repr(results[name])) < 300, name
    assert "<td>30</td>" in view_result(results["tuned gains"])
    front = view_result(results["front"])
    assert "<svg" in front
    assert "xarray" in front
    for other in (xr.Dataset({"a": 1.0}), results["sweep"].isel(sequence=0), results["sweep"][["objective"]]):
        assert view_result(other).count("<svg") == other._repr_html_().count("<svg")


def test_every_displayed_class_exists():
    from importlib import import_module

    from gaitopt.ipython import DISPLAYED, DRAWN

    for module, name in [*DISPLAYED.items(), *DRAWN]:
        assert getattr(import_module(module), name).__module__ == module
