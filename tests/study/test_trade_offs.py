"""Trade-offs: fronts that no point dominates, the same from both ends, with the knee, stored and resumed."""

from types import SimpleNamespace

import numpy as np
import pytest

from gaitopt import ArchiveError, Collocation, Execution, InputError, solve
from gaitopt.plot import plot_front
from gaitopt.status import Status
from gaitopt.study import Pareto, load_front, load_front_gait
from gaitopt.study.storage.gait_store import GaitStore
from gaitopt.study.trade_offs.front_grid import FrontEnds, FrontGrid
from gaitopt.study.trade_offs.front_table import Front, _tabulate_end_costs, find_front, find_knee
from gaitopt.study.trade_offs.quantity import quantity_named, restrict_torque
from tests.study.conftest import quick_problem

TORQUE = Pareto(objectives=("cost", "peak_torque"), points=6)


@pytest.fixture(scope="module")
def front():
    return TORQUE.trace(quick_problem())


def test_every_point_is_solved_replayed_and_not_dominated(front):
    assert (front.status == "solved").all()
    assert (front.verified == 1).all()
    assert (front.front == 1).all()
    assert np.all(np.diff(front.cost.values) > 0)
    assert np.all(front.peak_torque.values <= front.bound_peak_torque.values * (1 + 1e-6))


def test_the_front_is_the_same_from_both_ends(front):
    assert np.abs(front.forward_cost.values / front.backward_cost.values - 1).max() < 1e-5


def test_the_costs_from_the_ends_are_those_of_independent_chains():
    """The last chains begin with the better gait of both ends, so that their costs hardly ever differ."""
    grid = FrontGrid(FrontEnds(quick_problem(), (quantity_named("peak_torque"),), 1), (np.array([2.0, 1.0]),))
    costs = {"forward-return": 1.0, "backward-return": 1.1, "forward-last": 0.9, "backward-last": 0.9}
    gaits = {
        f"{kind}-{name}": SimpleNamespace(status=Status.SOLVED, solver=SimpleNamespace(objective=cost))
        for kind, cost in costs.items()
        for name in ("000", "001")
    }
    table = _tabulate_end_costs(Front(grid, (quantity_named("cost"),), gaits, {}, {}))
    assert table["forward_cost"][1] == [1.0, 1.0]
    assert table["backward_cost"][1] == [1.1, 1.1]
    needs = {task.key: task.needs for task in grid.tasks()}
    for kind, other in (("forward", "backward"), ("backward", "forward")):
        needed = [need for key, own in needs.items() if key.startswith((f"{kind}-0", f"{kind}-return")) for need in own]
        assert needed
        assert not any(need.startswith(other) for need in needed)


def test_the_better_gait_of_both_ends_is_continued_where_their_costs_differ(monkeypatch):
    grid = FrontGrid(FrontEnds(quick_problem(), (quantity_named("peak_torque"),), 1), (np.array([2.0, 1.0]),))
    last = {task.key: task for task in grid.tasks()}["forward-last-001"]
    own = ("forward-return-001", "backward-return-001")
    assert last.needs == (*own, "forward-return-000", "backward-return-000", "forward-last-000")
    continued = []

    def gait(cost):
        return SimpleNamespace(status=Status.SOLVED, solver=SimpleNamespace(objective=cost, constraint_violation=0.0))

    def resume(grid, problem, gaits):
        continued.extend(gait.solver.objective for gait in gaits)
        return [gait(0.5)]

    monkeypatch.setattr(FrontGrid, "_continue", resume)
    same, differ = [gait(1.0), gait(1.0)], [gait(1.0), gait(1.1)]
    assert grid.solve(last.argument, *same, gait(3.0), gait(3.0), gait(3.0)).solver.objective == 1.0
    assert not continued
    assert grid.solve(last.argument, *differ, gait(3.0), gait(3.0), gait(3.0)).solver.objective == 0.5
    assert grid.solve(last.argument, *same, gait(3.0), gait(3.1), gait(2.9)).solver.objective == 0.5
    assert continued == [3.0, 2.9]


def test_the_front_begins_at_the_lowest_cost_and_points_agree_with_single_solves(front):
    alone = solve(quick_problem())
    assert front.cost.values[0] == pytest.approx(alone.solver.objective, rel=1e-6)
    again = solve(restrict_torque(quick_problem(), float(front.bound_peak_torque.values[3])))
    assert front.cost.values[3] == pytest.approx(again.solver.objective, rel=1e-5)


def test_the_knee_is_the_point_farthest_from_the_line_between_the_ends(front):
    cost, torque = front.cost.values, front.peak_torque.values
    line = np.array([torque[-1] - torque[0], cost[-1] - cost[0]])
    distances = [abs(line[0] * (c - cost[0]) - line[1] * (t - torque[0])) for c, t in zip(cost, torque, strict=True)]
    assert front.knee.values.tolist().index(1) == int(np.argmax(distances))


def test_speed_is_bounded_from_below_and_multipliers_are_measured():
    trade = Pareto(objectives=("cost", "speed", "spectral_radius"), points=2, bounds={"speed": (0.64, 0.7)})
    table = trade.trace(quick_problem(speed=0.6))
    assert table.speed.values == pytest.approx([0.64, 0.7], rel=1e-6)
    assert np.all(np.isfinite(table.spectral_radius.values))


def test_an_interrupt_while_points_are_measured_leaves_the_front_incomplete(monkeypatch):
    def interrupt(names, gait):
        raise KeyboardInterrupt

    monkeypatch.setattr("gaitopt.study.trade_offs.pareto.measure_point", interrupt)
    trade = Pareto(objectives=("cost", "speed", "spectral_radius"), points=2, bounds={"speed": (0.64, 0.7)})
    table = trade.trace(quick_problem(speed=0.6))
    assert table.attrs["complete"] == 0
    assert np.all(np.isfinite(table.cost.values))
    assert np.all(np.isnan(table.spectral_radius.values))


@pytest.mark.slow
def test_the_spectral_radius_is_bounded_if_its_range_is_stated():
    problem = quick_problem(sequence="slip+ stick | slip+", transcription=Collocation(intervals=(8, 16)))
    trade = Pareto(objectives=("cost", "spectral_radius"), points=2, bounds={"spectral_radius": (0.73, 0.76)})
    assert [quantity.name for quantity in trade.bounded] == ["spectral_radius"]
    table = trade.trace(problem)
    assert table.spectral_radius.values == pytest.approx([0.76, 0.73], abs=1e-5)
    assert (table.front == 1).all()


def test_friction_demand_is_bounded_while_the_foot_sticks():
    trade = Pareto(
        objectives=("cost", "peak_friction_demand"), points=2, bounds={"peak_friction_demand": (0.12, 0.135)}
    )
    table = trade.trace(quick_problem(friction=0.2))
    assert table.peak_friction_demand.values == pytest.approx([0.135, 0.12], rel=1e-3)
    with pytest.raises(InputError, match="without slip"):
        trade.trace(quick_problem(sequence="slip+ stick | slip+"))
    with pytest.raises(InputError, match="finite friction"):
        quantity_named("peak_friction_demand").restrict(quick_problem(friction=float("inf")), 0.1)


@pytest.mark.slow
def test_two_processes_and_an_interrupted_run_give_the_same_front(front, tmp_path):
    path = tmp_path / "front.nc"
    seen = []

    def stop(done, total):
        seen.append(done)
        if len(seen) == 5:
            raise KeyboardInterrupt

    part = TORQUE.trace(quick_problem(), execution=Execution(observer=stop), path=path)
    assert part.attrs["complete"] == 0
    assert any(GaitStore.beside(path).glob("*.h5"))
    whole = TORQUE.trace(quick_problem(), execution=Execution(workers=2), path=path)
    assert whole.attrs["complete"] == 1
    assert not GaitStore.beside(path).exists()
    np.testing.assert_allclose(whole.cost.values, front.cost.values, rtol=1e-9)
    GaitStore.beside(path).mkdir()  # as left by an interrupt between the last write and the removal
    assert load_front(path).identical(TORQUE.trace(quick_problem(), path=path))
    assert not GaitStore.beside(path).exists()
    assert load_front_gait(path, 2).solver.objective == pytest.approx(front.cost.values[2], rel=1e-9)
    with pytest.raises(InputError, match="no gait at point 6"):
        load_front_gait(path, 6)
    with pytest.raises(InputError, match="different study"):
        Pareto(points=3).trace(quick_problem(), path=path)


@pytest.mark.slow
def test_a_front_that_exceeds_the_disk_is_refused_and_its_gaits_are_kept(tmp_path, full_disk):
    """The HDF5 library would crash (segmentation fault)."""
    trade, path = Pareto(points=2, bounds={"peak_torque": (5, 6)}), tmp_path / "front.nc"
    with full_disk(150_000), pytest.raises(ArchiveError, match=r"Cannot write .*front\.nc: File too large"):
        trade.trace(quick_problem(), path=path)
    assert not path.exists()
    assert trade.trace(quick_problem(), path=path).attrs["complete"] == 1


def test_dominated_points_and_repetitions_are_not_on_a_front():
    values = np.array([[1.0, 3.0], [2.0, 2.0], [2.5, 2.0], [1.0, 3.0], [np.nan, 0.0], [3.0, 1.0]])
    assert find_front(values).tolist() == [True, True, False, False, False, True]
    assert find_knee(values, np.array([True, False, False, False, False, True])) is None


def test_a_front_of_two_bounded_quantities_covers_their_grid():
    trade = Pareto(
        objectives=("cost", "peak_torque", "speed"), points=2, bounds={"peak_torque": (5, 6), "speed": (0.64, 0.66)}
    )
    table = trade.trace(quick_problem(speed=0.64))
    assert table.sizes["point"] == 4
    assert (table.status == "solved").all()
    assert table.cost.values[0] == table.cost.values.min()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"objectives": ("cost",)}, "at least one other"),
        ({"objectives": ("cost", "peak_torqe")}, "Did you mean|peak_torque"),
        ({"objectives": ("cost", "spectral_radius")}, "cannot span a front"),
        ({"points": 1}, "points"),
        ({"bounds": {"speed": (1, 2)}}, "not a bounded quantity"),
        ({"bounds": {"peak_torque": (3, 2)}}, "lower, upper"),
    ],
)
def test_invalid_trade_offs_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        Pareto(**options)


def test_the_figure_has_a_panel_for_each_other_quantity(front):
    figure = plot_front(front)
    assert [axes.get_xlabel() for axes in figure.axes] == ["peak torque [N m]"]
    with pytest.raises(InputError, match="no solved gait"):
        plot_front(front.assign(front=front.front * 0))
