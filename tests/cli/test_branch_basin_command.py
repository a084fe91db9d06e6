"""gaitopt basin of a diagram: basins along one of its branches."""

import math

import pytest

from gaitopt import WalkProblem, rimless_wheel, trace
from gaitopt.continuation import save_diagram
from gaitopt.study import load_result, locate_basin_edges

SLOPE = math.radians(13)


@pytest.fixture(scope="module")
def diagram_file(tmp_path_factory):
    wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": SLOPE})
    return save_diagram(trace(wheel, {"friction": (1.0, 0.9)}), tmp_path_factory.mktemp("branch") / "wheel.nc")


@pytest.mark.slow
def test_basins_along_a_branch_are_reported_and_written(command, diagram_file, folder):
    result = command("basin", diagram_file, "--over", "friction=1.0,0.95", "--json", "-o", "basin.nc")
    assert result.status == 0, result.err
    assert result.json["parameter"] == "friction"
    assert [record["friction"] for record in result.json["basins"]] == [1.0, 0.95]
    # The smallest fatal push is the distance of the gait from the nearest edge, located by bisection over the rate.
    rates = {"theta_rate": [0.1 + 0.3 * k for k in range(14)]}
    parameters = {"slope": SLOPE, "friction": 1.0}
    edges = [value for value, *_ in locate_basin_edges(rimless_wheel(), parameters, rates, tolerance=1e-8)]
    for record in result.json["basins"]:
        assert record["shares"] == {"branch 0 (stick | stick)": 1.0}
        (change,) = (value for name, value in record["change"].items() if name == "theta_rate")
        assert record["push"] == pytest.approx(abs(change), rel=1e-9)
    gait = load_result(diagram_file).branches[0].states[0, 0]
    nearest = min(abs(edge - gait) for edge in edges)
    assert result.json["basins"][0]["push"] == pytest.approx(nearest, rel=2e-4)
    assert load_result(folder / "basin.nc").push.values.tolist() == [each["push"] for each in result.json["basins"]]
    table = command("basin", diagram_file, "--over", "friction=1.0")
    assert "fatal push [rad/s]" in table.out


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (["--over", "slope=0.1:0.2:3"], "must be the parameter of the diagram, friction=FROM:TO:COUNT; got slope"),
        (["--over", "friction=3:4:2"], "has no gait at any of the 2 values"),
        (["--over", "friction=1", "--branch", "4"], "must have a branch 4"),
        (["--over", "friction=1", "--set", "slope=3"], "--set is not accepted for a diagram"),
        (["--over", "friction=1", "--steps", "5"], "--steps is not accepted for a diagram"),
        (["--over", "friction=1", "--gain", "k=3"], "--gain is not accepted for a diagram"),
        (["--over", "friction=1", "--law", "lqr"], "--law is not accepted for a diagram"),
        (["--over", "friction=1", "--torque-limit", "3"], "--torque-limit is not accepted for a diagram"),
        (["--over", "friction=1", "-o", "basin.png"], "basin.png"),
        (["--over", "friction=1", "-o", "nowhere/basin.nc"], "does not exist"),
        (["--over", "friction=1", "--problem", "problems/compass_passive.py"], "--problem must name"),
    ],
)
def test_invalid_requests_are_named(command, root, diagram_file, folder, arguments, sentence):
    (folder / "problems").symlink_to(root / "problems")
    result = command("basin", diagram_file, *arguments)
    assert result.status == 2
    assert sentence in " ".join(result.err.split())


def test_a_branch_is_named_for_a_diagram_only(command, root):
    result = command("basin", root / "problems/rimless_wheel.py", "--over", "theta_rate=1,2", "--branch", "1")
    assert (result.status, "--branch is accepted for a diagram (.nc) only" in result.err) == (2, True)
