"""Sweeps: what they find, what they keep, and that nothing disturbs them."""

import math
import signal
import subprocess
import sys
import textwrap
from dataclasses import dataclass, replace

import casadi as ca
import h5py
import numpy as np
import pytest
import xarray as xr

from gaitopt import ArchiveError, Execution, InputError, Objective, load, load_sweep, load_sweep_gait, solve, sweep
from gaitopt.study.storage.gait_store import GaitStore
from gaitopt.study.sweeps.sweep_file import GAITS
from gaitopt.study.sweeps.sweep_grid import SweepGrid, axis_values, plan_sweep
from tests.model.test_physics import biped
from tests.study.conftest import quick_problem

FRICTION = [0.14, 0.18]
SEQUENCES = ["stick | stick", "slip+ stick | slip+"]
TASKS = 8
"""Tasks of the sweep below: at each point a cold gait, one from either side, and the proven best."""


def run(path=None, **options):
    return sweep(quick_problem(), {"friction": FRICTION}, starts=1, path=path, execution=Execution(**options))


@pytest.fixture(scope="module")
def whole():
    return run()


@pytest.fixture(scope="module")
def sequences(tmp_path_factory):
    """Return a sweep of two contact sequences, and its file."""
    path = tmp_path_factory.mktemp("sequences") / "frontier.nc"
    return sweep(quick_problem(), {"friction": [0.14, 0.16]}, sequences=SEQUENCES, starts=1, path=path), path


def test_every_point_is_solved_replayed_and_never_dearer_than_a_single_solve(sequences):
    table, _ = sequences
    assert (table.status == "solved").all()
    assert (table.verified == 1).all()
    for sequence in SEQUENCES:
        for friction in table.friction.values:
            alone = solve(quick_problem(sequence=sequence, friction=friction))
            found = table.sel(sequence=sequence, friction=friction)
            assert found.objective <= alone.solver.objective * (1 + 1e-6)


def test_the_table_is_labelled_and_agrees_with_the_gaits(sequences):
    table, path = sequences
    assert table.cost_of_transport.dims == ("sequence", "friction")
    assert all("long_name" in table[name].attrs for name in table.data_vars)
    assert table.friction.attrs["units"] == "1"
    gait = load_sweep_gait(path, SEQUENCES[1], friction=0.16)
    point = table.sel(sequence=SEQUENCES[1], friction=0.16)
    assert str(gait.sequence) == SEQUENCES[1]
    assert gait.verification.passed
    assert gait.cost_of_transport == point.cost_of_transport
    assert point.impact_loss + point.friction_loss == pytest.approx(float(point.actuator_work + point.gravity_work))
    assert [file.name for file in path.parent.iterdir()] == ["frontier.nc"]
    with xr.open_dataset(path, engine="h5netcdf") as read:
        assert read.identical(table)
    with h5py.File(path) as file:  # or else opening it takes seconds for every hundred gaits
        assert list(file) == sorted(file)
        assert list(file)[-1] == GAITS


@pytest.mark.slow
@pytest.mark.parametrize("workers", [1, 2])
def test_a_sweep_has_its_robot_once(tmp_path, workers):
    """In the file, and in this process, in which nothing is compiled twice."""
    path, robot = tmp_path / "sweep.nc", biped(f"mine {workers}")
    problem, execution = quick_problem(robot=robot), Execution(workers=workers)
    table = sweep(problem, {"friction": FRICTION}, starts=1, path=path, execution=execution)
    assert (table.verified == 1).all()
    with h5py.File(path) as file:
        groups = [gait["robot"] for gait in file[GAITS].values()]
        assert len(groups) == len(FRICTION)
        assert groups[0] == groups[1]
    for friction in FRICTION:
        assert load_sweep_gait(path, "stick | stick", friction=friction).robot is robot


@pytest.mark.slow
def test_two_workers_find_the_same(whole):
    assert run(workers=2).identical(whole)


KILLED = """
    import os, signal, sys
    from gaitopt import Execution, sweep
    from tests.study.conftest import quick_problem

    def observer(done, total):
        if done == int(sys.argv[2]):
            os.kill(os.getpid(), signal.SIGKILL)

    if __name__ == "__main__":
        sweep(
            quick_problem(), {{'friction': {friction}}}, starts=1, path=sys.argv[1],
            execution=Execution(observer=observer),
        )
"""


@pytest.mark.slow
def test_a_killed_sweep_goes_on_and_ends_with_the_same(whole, tmp_path):
    script, path = tmp_path / "killed.py", tmp_path / "frontier.nc"
    script.write_text(textwrap.dedent(KILLED).format(friction=FRICTION))
    for kill in (2, 5):
        done = subprocess.run([sys.executable, script, path, str(kill)], timeout=120, check=False)
        assert done.returncode == -signal.SIGKILL
        assert not path.exists()
        kept = GaitStore.beside(path)
        assert len(list(kept.glob("[!.]*.h5"))) == kill
    calls = []
    assert run(path, observer=lambda done, total: calls.append(done)).identical(whole)
    assert calls == list(range(6, TASKS + 1))
    assert not kept.exists()
    calls.clear()
    assert run(path, observer=lambda done, total: calls.append(done)).identical(whole)
    assert not calls


def test_an_interrupted_sweep_keeps_what_is_done(whole, tmp_path):
    path = tmp_path / "frontier.nc"

    def stop(done, total):
        assert total == TASKS
        if done == total - 1:
            raise KeyboardInterrupt

    part = run(path, observer=stop)
    assert not part.attrs["complete"]
    assert (part.status == "pending").sum() == 1
    assert load_sweep(path).identical(part)
    computed = part.status == "solved"
    assert np.array_equal(part.cost_of_transport.values[computed], whole.cost_of_transport.values[computed])
    assert run(path).identical(whole)


@pytest.mark.slow
def test_points_that_fail_say_why(tmp_path):
    path = tmp_path / "speeds.nc"
    # The robot cannot step 4 m; at 2 m/s it would need more torque than it has.
    table = sweep(quick_problem(), {"speed": [0.6, 2.0], "step_length": [0.45, 4.0]}, starts=1, path=path)
    found = table.sel(sequence="stick | stick")
    assert found.status.values[0, 0] == "solved"
    assert found.status.values[1, 0] == solve(quick_problem(speed=2.0)).status.key == "infeasible"
    assert str(found.reason.values[1, 0]).startswith("no gait found; speed is 2 m/s: ")
    assert (found.status.values[:, 1] == "impossible").all()
    assert "longer than the" in str(found.reason.values[0, 1])
    assert np.isfinite(found.cost_of_transport.values).tolist() == [[True, False], [False, False]]
    assert load_sweep_gait(path, "stick | stick", speed=2.0, step_length=0.45).status.key != "solved"
    with pytest.raises(InputError, match=r"no gait at this point: .*longer than"):
        load_sweep_gait(path, "stick | stick", speed=0.6, step_length=4)
    with pytest.raises(InputError, match=r"speed must be at least 0.6 and at most 2 \[m/s\], got 5"):
        load_sweep_gait(path, "stick | stick", speed=5, step_length=0.45)


def test_a_full_disk_loses_nothing(whole, tmp_path, full_disk):
    path, calls = tmp_path / "frontier.nc", []

    def observer(done, total):
        calls.append(done)

    with full_disk(20_000), pytest.raises(ArchiveError, match=r"Cannot write .*cold-0-000\.h5: File too large"):
        run(path, observer=observer)
    with full_disk(150_000), pytest.raises(ArchiveError, match=r"Cannot write .*frontier\.nc: File too large"):
        run(path, observer=observer)
    assert calls == list(range(1, TASKS + 1))
    assert [file.name for file in tmp_path.iterdir()] == ["frontier.nc.parts"]
    assert run(path, observer=observer).identical(whole)
    assert len(calls) == TASKS


def test_another_sweep_is_not_mixed_in(tmp_path):
    path = tmp_path / "frontier.nc"
    sweep(quick_problem(), {"friction": [0.18]}, starts=1, path=path)
    with pytest.raises(InputError, match=r"contains a different study \(different axes\): choose another path"):
        sweep(quick_problem(), {"friction": [0.19]}, starts=1, path=path)
    with pytest.raises(InputError, match="different problem"):
        sweep(quick_problem(speed=0.6), {"friction": [0.18]}, starts=1, path=path)
    with pytest.raises(ArchiveError, match="it is a folder"):
        sweep(quick_problem(), {"friction": [0.18]}, starts=1, path=tmp_path)
    parts = GaitStore.beside(tmp_path / "other.nc")
    GaitStore(parts, {"axes": 1})["cold-0"] = load("docs/examples/compass_slip.h5")  # without gaits, it is used again
    with pytest.raises(InputError, match="contains a different study"):
        sweep(quick_problem(), {"friction": [0.19]}, starts=1, path=tmp_path / "other.nc")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"axes": {}}, "needs an axis"),
        ({"axes": {"friction": []}}, r"increasing finite values, at least one, got \[\]\."),
        ({"axes": {"friction": [0.2, 0.1]}}, r"increasing finite values, at least one, got \[0\.2, 0\.1\]\."),
        ({"axes": {"friction": 0.5}}, r"got 0\.5; write \[0\.5\]\."),
        ({"axes": {"friction": [math.nan]}}, r"got \[nan\]\."),
        ({"axes": {"friction": [0.1] * 11}}, r"got 11 values\."),
        ({"axes": {"friction": ["high"]}}, "need numbers"),
        ({"axes": {"leg_mas": [4.0]}}, "'leg_mass'"),
        ({"axes": {"friction": [0.1]}, "sequences": []}, "needs a contact sequence"),
        (
            {"axes": {"friction": [0.1]}, "sequences": ["stick | stick", "stick | stick"]},
            "at least one contact sequence, without repetitions",
        ),
        ({"axes": {"friction": [-0.1, 0.0]}}, "No point of this sweep has a valid problem"),
    ],
)
def test_wrong_sweeps_are_refused(options, message):
    with pytest.raises(InputError, match=message):
        sweep(quick_problem(), **options)


def test_robot_parameters_can_be_axes():
    grid = SweepGrid(quick_problem(), (quick_problem().sequence,), {"leg_mass": np.array([4.0, 5.0])}, 1)
    assert grid.unit("leg_mass") == "kg"
    last = list(grid.points())[-1]
    assert grid.problem_at(last).parameters["leg_mass"] == 5.0


def test_axes_of_problems_have_one_order_however_they_are_given():
    given = {"leg_mass": [4.0], "speed": [0.6], "friction": [0.2]}
    assert list(axis_values(given)) == ["friction", "speed", "leg_mass"]


def test_who_starts_from_whom_is_decided_by_the_grid():
    axes = {"friction": np.linspace(0.1, 0.2, 4), "speed": np.linspace(0.5, 0.7, 3)}
    grid = SweepGrid(quick_problem(), (quick_problem().sequence,), axes, 1)
    needs = {task.key: task.needs for task in plan_sweep(grid)}
    assert needs["forward-0-001-001"] == ("forward-0-000-001", "forward-0-001-000")
    assert needs["backward-0-001-001"] == ("backward-0-002-001", "backward-0-001-002", "forward-0-001-001")
    assert needs["point-0-001-001"] == ("forward-0-001-001", "backward-0-001-001")
    assert needs["forward-0-002-001"][-1] == "cold-0-002-001"
    assert len(needs) == 3 * 12 + 9


def test_two_coarse_gaits_may_change_places_on_the_fine_grid(slip_gait, monkeypatch):
    import gaitopt.study.multistart as module

    def costing(factor):
        return replace(slip_gait, solver=replace(slip_gait.solver, objective=factor * slip_gait.solver.objective))

    first, second, far = map(costing, (1.0, 1.01, 1.1))
    finer, tried = {first: costing(1.02), second: costing(1.0)}, []

    def attempt(problem, start):
        tried.append(start)
        return finer[start]

    monkeypatch.setattr(module, "solve_start", attempt)
    assert module.select_leading(quick_problem(), [first, second, far]) is second
    assert tried == [first, second]
    assert (
        module.select_leading(quick_problem(), [first, far]) is first
    )  # alone near the best: not solved finely for this
    assert len(tried) == 2


@pytest.mark.slow
def test_an_objective_of_a_notebook_is_sent_to_workers():
    """A class of a function is pickled by value, like one of a notebook, which no module holds."""

    @dataclass(frozen=True)
    class Effort(Objective):
        exponent: int = 2
        name = "effort"
        uses_power = False
        per_weight_and_travel = False
        smooth = True

        def integrand(self, point):
            return weight * ca.sumsqr(point.torque) ** (self.exponent / 2)

    weight = 2.0
    problem, axes = quick_problem(objective=Effort()), {"friction": [0.14, 0.18]}
    here = sweep(problem, axes, starts=1)
    assert (here.status == "solved").all()
    assert sweep(problem, axes, starts=1, execution=Execution(workers=2)).identical(here)
