"""Basins along a branch: shares of the gaits, and the smallest fatal push against a dense grid."""

import itertools
import math

import numpy as np
import pytest

from gaitopt import InputError, WalkProblem, compass_biped, find_cycles, passive, rimless_wheel, trace
from gaitopt.cli.file_check import examine_file
from gaitopt.cli.result_output import find_facts, print_result
from gaitopt.plot import plot_branch_basin, plot_result
from gaitopt.simulation import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.pushed_walk import push_scale
from gaitopt.stability.recovery import PushTest, count_settling_steps
from gaitopt.study import (
    PushSearch,
    find_fatal_push,
    find_push_limits,
    load_result,
    locate_basin_edges,
    save_branch_basin,
    trace_basin,
)

SLOPE = math.radians(13)
QUICK = PushSearch(directions=20, refinements=6)


def walker_of(robot, gait):
    law = passive(robot)
    return Walker(robot, law, robot.vector(gait.parameters), default_engine(law, robot))


def test_the_smallest_fatal_push_of_the_wheel_ends_at_the_edge_of_its_basin():
    gait = find_cycles(rimless_wheel(), {"slope": SLOPE}, starts=10)[0]
    push = find_fatal_push(walker_of(rimless_wheel(), gait), gait)
    rates = {"theta_rate": np.linspace(0.1, 4.0, 14)}
    edges = [value for value, *_ in locate_basin_edges(rimless_wheel(), {"slope": SLOPE}, rates, tolerance=1e-8)]
    nearest = min(edges, key=lambda edge: abs(edge - gait.z[0]))
    assert push.size == pytest.approx(abs(nearest - gait.z[0]), rel=2e-4)
    assert push.change["theta_rate"] == pytest.approx(nearest - gait.z[0], rel=2e-4)
    assert push.ending == "lift_off"
    assert push.safe < push.size


@pytest.mark.slow
def test_no_smaller_push_of_a_dense_grid_is_fatal():
    gait = find_cycles(compass_biped(), {"slope": math.radians(1), "friction": 0.3}, starts=10)[0]
    walker, test = walker_of(compass_biped(), gait), PushTest(steps=60)
    push = find_fatal_push(walker, gait, QUICK)
    scale, axis = push_scale(walker.robot, walker.p, gait.section), np.linspace(-1.4, 1.4, 11) * push.size
    fatal = []
    for point in itertools.product(axis, repeat=3):
        size = float(np.linalg.norm(point))
        if size <= 1.4 * push.size and count_settling_steps(walker, gait, scale * point, test) is None:
            fatal.append(size)
    spacing = axis[1] - axis[0]
    assert push.size * 0.995 <= min(fatal) <= push.size + math.sqrt(3) * spacing
    change = np.array([*push.change.values()])
    assert count_settling_steps(walker, gait, change, test) is None
    assert count_settling_steps(walker, gait, change * push.safe / push.size, test) is not None
    assert push.ending == "fell"


@pytest.fixture(scope="module")
def wheel_basin():
    wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": SLOPE})
    diagram = trace(wheel, {"friction": (1.0, 0.9)})
    balls = PushTest(starts=12, seed=3)
    search = PushSearch(refinements=1, largest=3.0)
    return trace_basin(wheel, diagram, [1.0, 0.91, 2.0], balls=balls, radius=1.0, search=search)


def test_shares_and_pushes_along_a_branch(wheel_basin):
    table = wheel_basin
    assert table.friction.values.tolist() == [1.0, 0.91]  # the branch has no gait at 2
    assert table.share.sum("ending").values == pytest.approx([1, 1])
    labels = table.ending.values.tolist()
    assert {"branch 0 (stick | stick)", "branch 0 (stick slip+ | stick)", "lift_off"} <= set(labels)
    # One coordinate: the share that returns is that of the rates below the edge of the basin.
    gait = find_cycles(rimless_wheel(), {"slope": SLOPE, "friction": 1.0}, starts=10)[0]
    assert float(table.push[0]) < 1.0
    lifted = float(table.share.sel(ending="lift_off")[0])
    rng = np.random.default_rng(3)
    pushes = [np.sign(rng.normal(size=gait.z.size)[0]) * rng.uniform() for _ in range(12)]
    assert lifted == pytest.approx(np.mean([push > float(table.push[0]) for push in pushes]), abs=1e-12)


def test_the_edge_along_a_coordinate_is_that_of_the_basin(wheel_basin):
    """Below its own edge the wheel falls, above it lifts off; the second gait's edges are sought from the first's."""
    for k, friction in enumerate(wheel_basin.friction.values):
        fixed = {"slope": SLOPE, "friction": friction}
        rate = find_cycles(rimless_wheel(), fixed, starts=10)[0].z[0]
        rates = {"theta_rate": np.linspace(0.1, 4.0, 14)}
        edges = [value for value, *_ in locate_basin_edges(rimless_wheel(), fixed, rates, tolerance=1e-7)]
        backward, forward = wheel_basin.edge.sel(coordinate="theta_rate").values[k]
        assert rate - backward == pytest.approx(max(edge for edge in edges if edge < rate), abs=2e-4)
        assert rate + forward == pytest.approx(min(edge for edge in edges if edge > rate), abs=2e-4)
        assert float(wheel_basin.push[k]) == pytest.approx(min(backward, forward), rel=3e-4)


def test_basins_of_a_branch_are_stored_drawn_and_printed(wheel_basin, tmp_path, capsys):
    stored = load_result(save_branch_basin(wheel_basin, tmp_path / "basin.nc"))
    assert stored.identical(wheel_basin)
    assert examine_file(tmp_path / "basin.nc")["content"] == f"{wheel_basin.push.size} gaits"
    upper, lower = plot_result(stored).axes
    assert upper.get_ylabel() == "share of the starts"
    drawn = {line.get_label(): line.get_ydata() for line in lower.lines}
    np.testing.assert_allclose(drawn["any direction"], wheel_basin.push.values[::-1])  # in order of friction
    assert len(drawn) == 3
    print_result(stored)
    assert "fatal push [rad/s]" in capsys.readouterr().out
    first = find_facts(stored)["basins"][0]
    assert first["shares"]["lift_off"] == float(wheel_basin.share.sel(ending="lift_off")[0])
    with pytest.raises(InputError, match="must be that of basins along a branch"):
        plot_branch_basin(stored.drop_vars("edge"))
    with pytest.raises(InputError, match="must be that of basins along a branch"):
        save_branch_basin(stored.drop_vars("edge"), tmp_path / "other.nc")
    with pytest.raises(InputError, match=r"the suffix '\.h5' is not that of a known format"):
        save_branch_basin(stored, tmp_path / "basin.h5")


def test_invalid_requests_are_named():
    wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": SLOPE})
    diagram = trace(wheel, {"friction": (1.0, 0.99)})
    with pytest.raises(InputError, match="must have a branch 3"):
        trace_basin(wheel, diagram, [1.0], branch=3)
    with pytest.raises(InputError, match="no gait at any of the 1 values of friction"):
        trace_basin(wheel, diagram, [3.0])
    for radius in (-1.0, math.nan):
        with pytest.raises(InputError, match="radius of the ball must be positive and finite"):
            trace_basin(wheel, diagram, [1.0], radius=radius)
    unstable = next(
        gait
        for gait in find_cycles(compass_biped(), {"slope": math.radians(1), "friction": 0.3}, starts=20)
        if not gait.stable
    )
    for find in (find_fatal_push, find_push_limits):
        with pytest.raises(InputError, match="A fatal push is defined for a stable gait of one step"):
            find(walker_of(compass_biped(), unstable), unstable)
