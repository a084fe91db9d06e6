"""Basins of robots with several contacts."""

import numpy as np
import pytest

from gaitopt import Collocation, basin
from gaitopt.control import passive, planar_feedforward
from gaitopt.errors import InputError
from gaitopt.model import compass_biped
from gaitopt.model.robots.vertical_hopper import vertical_hopper
from gaitopt.ocp import solve_planar
from gaitopt.plot.basin_figure import plot_basin
from gaitopt.stability import PlanarWalkProblem, assess_planar
from gaitopt.study import SettlingCriterion, ending_labels, load_basin, locate_basin_edges
from gaitopt.study.basins.basin_file import basin_key
from tests.ocp.multicontact_examples import walk


@pytest.fixture(scope="module")
def gait():
    return solve_planar(walk(transcription=Collocation(intervals=10)))


@pytest.fixture(scope="module")
def table(gait):
    rate = assess_planar(gait).state["a_rate"]
    criterion = SettlingCriterion(steps=40, tolerance=1e-4)
    return basin(gait, {}, {"a_rate": [rate - 0.05, rate, 0.5], "b_rate": [-0.5]}, criterion=criterion)


def test_walks_near_a_gait_return_to_it_and_others_fall(gait, table):
    assert ending_labels(table)[:, 0].tolist() == ["foot A stick |", "foot A stick |", "fell"]
    cycle = assess_planar(gait)
    final = dict(zip(table.coordinate.values.tolist(), table.final.values[0, 0], strict=True))
    assert final == pytest.approx({name: cycle.state[name] for name in final}, abs=1e-3)
    assert "x" not in final
    assert {name: table[name].attrs["units"] for name in table.ending.dims} == {"a_rate": "rad/s", "b_rate": "rad/s"}


def test_the_figure_marks_the_gait_and_states_the_other_coordinates(gait, table):
    axes = plot_basin(table).axes[0]
    assert axes.get_title() == "other coordinates: near the gait"
    (mark,) = (line for line in axes.lines if line.get_label() == "gait")
    assert mark.get_xdata() == pytest.approx([assess_planar(gait).state["a_rate"]], abs=1e-6)


def test_the_basin_of_the_hopper_resumes_and_a_start_in_the_air_is_none(tmp_path):
    hopper = PlanarWalkProblem(
        robot=vertical_hopper(), section="sole closes", coordinates={"body": 0.7, "foot": 0.2}, rates={}, on=()
    )
    (cycle,) = hopper.search(1)
    path, axes = tmp_path / "basin.nc", {"body_rate": np.array([1.0, 1.2]) * cycle.state["body_rate"]}
    criterion = SettlingCriterion(steps=60, tolerance=1e-3)
    found = basin(hopper, {}, axes, criterion=criterion, path=path)
    assert ending_labels(found).tolist() == [cycle.sequence.replace(", ", " and ")] * 2
    assert basin_key(found)["method"]["section"] == "sole closes"
    assert basin(hopper, {}, axes, criterion=criterion, path=path).equals(load_basin(path))
    assert ending_labels(basin(hopper, {}, {"foot": [1.0]})).tolist() == ["no_start"]  # the foot is not on the ground


@pytest.mark.slow
def test_the_edge_of_a_basin_is_located(gait):
    rate = assess_planar(gait).state["a_rate"]
    criterion = SettlingCriterion(steps=40, tolerance=1e-4)
    ((edge, below, above),) = locate_basin_edges(gait, {}, {"a_rate": [rate, 0.5]}, tolerance=1e-2, criterion=criterion)
    assert (below, above) == ("foot A stick |", "fell")
    assert rate < edge < 0.5


def test_a_basin_of_these_robots_refuses_other_laws_and_coordinates(gait):
    with pytest.raises(InputError, match="has no coordinate or parameter 'x'"):
        basin(gait, {}, {"x": [0.0]})
    with pytest.raises(InputError, match="must have finite values, got a = inf"):
        basin(gait, {"a": np.inf}, {"b": [0.1]})
    with pytest.raises(InputError, match="needs a PlanarLaw"):
        basin(gait, {}, {"a": [0.1]}, law=passive(compass_biped()))
    with pytest.raises(InputError, match="needs a Law, got the PlanarLaw"):
        basin(compass_biped(), {}, {"th1": [0.1]}, law=planar_feedforward(gait))
