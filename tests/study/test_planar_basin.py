"""Basins of robots with several contacts."""

import numpy as np
import pytest

from gaitopt import Collocation, basin
from gaitopt.cli.script import call_script
from gaitopt.control import passive, planar_feedforward
from gaitopt.errors import InputError
from gaitopt.model import compass_biped
from gaitopt.model.robots.vertical_hopper import vertical_hopper
from gaitopt.ocp import solve_planar
from gaitopt.plot.basin_figure import plot_basin
from gaitopt.simulation import ScipyEngine, planar_engine_named
from gaitopt.simulation.planar_simulation import planar_walker
from gaitopt.stability import PlanarWalkProblem, assess_planar
from gaitopt.study import SettlingCriterion, ending_labels, load_basin, locate_basin_edges
from gaitopt.study.basins.basin_file import basin_key
from tests.conftest import ROOT
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


def walk_of_script(name):
    return call_script(ROOT / "problems" / f"{name}.py", [])


STARTS = {"hopper": {"body_rate": [-2.2, -1.4]}, "round_feet": {"a_rate": [-0.28, -0.24], "b_rate": [-0.22, -0.15]}}


@pytest.mark.slow
@pytest.mark.parametrize("name", STARTS)
def test_both_engines_find_the_same_basin(name, monkeypatch):
    pytest.importorskip("heyoka")
    problem, criterion = walk_of_script(name), SettlingCriterion(steps=30, tolerance=1e-3)
    fast = basin(problem, {}, STARTS[name], criterion=criterion, engine=planar_engine_named("heyoka"))
    monkeypatch.setattr(planar_walker, "TOLERANCE", 1e-12)  # at the default, scipy differs by up to 3e-6
    reference = basin(problem, {}, STARTS[name], criterion=criterion, engine=ScipyEngine())
    assert ending_labels(fast).tolist() == ending_labels(reference).tolist()
    assert fast.steps.values.tolist() == reference.steps.values.tolist()
    np.testing.assert_allclose(fast.final.values, reference.final.values, atol=1e-8)


def test_the_engine_of_a_basin_takes_all_its_steps():
    steps = []

    class Counted(type(planar_engine_named("scipy"))):
        def begin(self, *arguments):
            steps.append(arguments)
            return super().begin(*arguments)

    criterion = SettlingCriterion(steps=2)
    basin(walk_of_script("hopper"), {}, {"body_rate": [-1.8]}, criterion=criterion, engine=Counted())
    assert len(steps) > 10
