import json
import math
import signal
from dataclasses import replace

import h5py
import numpy as np
import pytest

from gaitopt import (
    ArchiveError,
    Execution,
    InputError,
    SettlingCriterion,
    basin,
    compass_biped,
    load_basin,
    passive,
    rimless_wheel,
)
from gaitopt.simulation.scipy_engine import ScipyEngine
from gaitopt.study import ending_labels, ending_shares, locate_basin_edges, save_basin
from gaitopt.study.basins.basin_file import Endings, basin_key, endings_of, make_basin
from gaitopt.study.basins.basin_record import BasinRecord
from gaitopt.study.basins.basin_source import make_source
from gaitopt.study.basins.basin_walk import walk_over

WHEEL = {"slope": math.radians(13)}
NATURAL_TIME = math.sqrt((4 / 3) / 9.8)
GRID = {"theta_rate": np.linspace(0.1, 3.2, 6)}


def test_basin_of_type_a_without_friction_limit():
    edges = locate_basin_edges(rimless_wheel(), WHEEL, {"theta_rate": np.linspace(0.05, 3.0, 8)}, tolerance=1e-7)
    assert [labels for _, *labels in edges] == [["fell", "stick | stick"], ["stick | stick", "lift_off"]]
    # Gamus & Or (2015): 0.0872 < thd < 0.9595 in rad/tau_c.
    assert [value * NATURAL_TIME for value, *_ in edges] == pytest.approx([0.0872, 0.9595], abs=5e-5)


@pytest.mark.slow
def test_endings_do_not_depend_on_the_number_of_workers(monkeypatch):
    import gaitopt.study.basins.basin as module

    monkeypatch.setattr(module, "CHUNK", 10)  # so that two processes have something to do
    grid, friction = {"theta_rate": np.linspace(0.1, 3.2, 31)}, {**WHEEL, "friction": 0.3}
    settings = {"engine": ScipyEngine(relative=1e-8), "criterion": SettlingCriterion(steps=5, tolerance=1e-2)}
    one = basin(rimless_wheel(), friction, grid, **settings)
    two = basin(rimless_wheel(), friction, grid, **settings, execution=Execution(workers=2))
    assert one.identical(two)
    for name in ("ending", "steps", "final"):
        assert one[name].values.tobytes() == two[name].values.tobytes()
    assert set(ending_shares(one)) >= {"fell", "stick slip+ | stick", "lift_off"}
    assert sum(ending_shares(one).values()) == pytest.approx(1)


def test_interrupted_basin_goes_on(tmp_path, monkeypatch):
    import gaitopt.study.basins.basin as module

    monkeypatch.setattr(module, "CHUNK", 2)
    path, calls = tmp_path / "basin.nc", []

    def stop(done, total):
        calls.append(done)
        if len(calls) == 2:
            raise KeyboardInterrupt

    part = basin(rimless_wheel(), WHEEL, GRID, path=path, execution=Execution(observer=stop))
    assert load_basin(path).identical(part)
    assert (part.ending == -1).values.tolist() == [False] * 4 + [True] * 2
    assert not part.attrs["complete"]
    calls.clear()
    resumed = basin(
        rimless_wheel(), WHEEL, GRID, path=path, execution=Execution(observer=lambda done, total: calls.append(done))
    )
    assert calls == [6]
    assert ending_labels(resumed).tolist() == ending_labels(basin(rimless_wheel(), WHEEL, GRID)).tolist()


def test_an_interrupt_before_the_first_walk_writes_no_file(tmp_path, monkeypatch):
    monkeypatch.setattr("gaitopt.study.basins.basin.import_packages", lambda *_: signal.raise_signal(signal.SIGINT))
    with pytest.raises(KeyboardInterrupt):
        basin(rimless_wheel(), WHEEL, GRID, path=tmp_path / "basin.nc")
    assert not (tmp_path / "basin.nc").exists()


def test_labels_are_sorted_whatever_came_first():
    pending = Endings((), np.full(4, -1, np.int16), np.zeros(4, np.int32), np.full((4, 1), np.nan))
    question = {"robot": "", "axes": {"x": [0.0, 1.0, 2.0, 3.0]}}
    record = BasinRecord(pending, lambda ends: make_basin(question, {}, ["theta_rate"], ends), None)
    last = Endings(("stick", "fell"), np.array([1, 0], np.int16), np.array([7, 8], np.int32), np.array([[2.0], [3.0]]))
    record["later"] = (np.array([2, 3]), last)
    assert ending_labels(record.basin()).tolist() == ["", "", "fell", "stick"]
    record["first"] = (
        np.array([1]),
        Endings(("stick",), np.array([0], np.int16), np.array([9], np.int32), np.ones((1, 1))),
    )
    found = record.basin()
    assert found.ending.attrs["flag_meanings"] == "fell, stick"
    assert ending_labels(found).tolist() == ["", "stick", "fell", "stick"]
    assert found.steps.values.tolist() == [0, 9, 7, 8]
    assert pending.outcome.tolist() == [-1] * 4


def test_a_basin_is_labelled():
    found = basin(rimless_wheel(), {"theta_rate": 2.0}, {"slope": [0.2, 0.23], "friction": [0.3]})
    assert found.ending.dims == found.steps.dims == ("slope", "friction")
    assert found.final.dims == ("slope", "friction", "coordinate")
    assert found.coordinate.values.tolist() == ["theta_rate", "foot_speed"]
    assert {name: found[name].attrs["units"] for name in ("slope", "friction")} == {"slope": "rad", "friction": "1"}
    assert all("long_name" in found[name].attrs for name in found.data_vars)
    assert found.ending.attrs["flag_values"].tolist() == list(range(len(ending_shares(found))))
    speeds = basin(rimless_wheel(), WHEEL, {"theta_rate": [2.0]})
    assert speeds.theta_rate.attrs["units"] == "rad/s"


def test_two_axes_and_parameters_as_axes():
    found = basin(rimless_wheel(), {}, {"slope": np.radians([0.5, 13]), "theta_rate": [0.05, 2.0]})
    assert ending_labels(found).tolist() == [["fell", "fell"], ["fell", "stick | stick"]]


def test_axes_may_be_bounds_of_each_other():
    robot, start = compass_biped(), {"th1": -0.2, "th1_rate": 0.1}
    com, length = {"leg_com": [0.3, 0.6]}, {"leg_length": [0.6, 0.9]}
    assert basin(robot, {"leg_length": 0.7, **start}, com).ending.shape == (2,)
    assert basin(robot, start, {**com, **length}).ending.shape == (2, 2)
    with pytest.raises(InputError, match=r"leg_com .* must be at most leg_length = 0\.5 \[m\], got 0\.6"):
        basin(robot, start, {**com, "leg_length": [0.5, 0.9]})


def test_file_of_another_basin_is_not_overwritten(tmp_path):
    path = tmp_path / "basin.h5"
    basin(rimless_wheel(), WHEEL, {"theta_rate": [2.0]}, path=path)
    with pytest.raises(InputError, match=r"contains a different study \(different axes\)"):
        basin(rimless_wheel(), WHEEL, {"theta_rate": [2.1]}, path=path)
    with pytest.raises(
        InputError, match=r"\(different parameters: slope 0\.2268.* stored, 0\.2 requested\): choose another path"
    ):
        basin(rimless_wheel(), {"slope": 0.2}, {"theta_rate": [2.0]}, path=path)


def test_axes_in_another_order_are_another_basin(tmp_path):
    slopes, rates, path = [0.2, 0.23], [0.1, 2.0], tmp_path / "basin.nc"
    basin(rimless_wheel(), {}, {"slope": slopes, "theta_rate": rates}, path=path)
    with pytest.raises(InputError, match=r"contains a different study \(its axes are in the order slope, theta_rate\)"):
        basin(rimless_wheel(), {}, {"theta_rate": rates, "slope": slopes}, path=path)


def test_file_round_trip_and_damage(tmp_path):
    found = basin(rimless_wheel(), WHEEL, GRID)
    path = save_basin(found, tmp_path / "basin.nc")
    assert load_basin(path).identical(found)
    path.write_bytes(path.read_bytes()[:500])
    with pytest.raises(ArchiveError, match="damaged"):
        load_basin(path)
    with pytest.raises(ArchiveError, match="no file"):
        load_basin(tmp_path / "none.nc")


def test_a_basin_with_nothing_computed_is_kept(tmp_path):
    def stop(done, total):
        raise KeyboardInterrupt

    walk = walk_over(make_source(rimless_wheel(), None, ScipyEngine()), WHEEL, GRID, SettlingCriterion())
    nothing = walk.basin(walk.pending())
    assert load_basin(save_basin(nothing, tmp_path / "basin.nc")).identical(nothing)
    assert ending_shares(nothing) == {}
    assert ending_labels(nothing).tolist() == [""] * 6


def test_many_values_of_an_axis_fit_into_the_file(tmp_path):
    rates = np.linspace(1, 2, 30_000)
    source = make_source(rimless_wheel(), None, ScipyEngine())
    walk = walk_over(source, WHEEL, {"theta_rate": rates}, SettlingCriterion())
    path = save_basin(walk.basin(walk.pending()), tmp_path / "basin.nc")
    assert basin_key(load_basin(path)) == walk.key()


def test_a_file_of_the_first_version_is_read_and_resumed(tmp_path):
    path, found = tmp_path / "basin.h5", basin(rimless_wheel(), WHEEL, GRID)
    ends, question = endings_of(found), basin_key(found)
    outcome = ends.outcome.copy()
    outcome[3:] = -1
    with h5py.File(path, "w") as file:
        file.attrs.update(format="gaitopt basin", format_version=1, question=json.dumps(question))
        file.attrs["labels"] = json.dumps(ends.labels)
        file.create_dataset("axes/theta_rate", data=GRID["theta_rate"])
        for name, values in (("outcome", outcome), ("steps", ends.steps), ("final", ends.final)):
            file.create_dataset(name, data=values)
    old = load_basin(path)
    assert ending_labels(old).tolist() == [*ending_labels(found)[:3].tolist(), "", "", ""]
    assert old.final.values[:3].tolist() == found.final.values[:3].tolist()
    assert basin(rimless_wheel(), WHEEL, GRID, path=path).identical(found)
    assert load_basin(path).identical(found)


@pytest.mark.parametrize(
    ("axes", "message"),
    [
        ({}, "one or two axes"),
        ({"thd": [1.0]}, "no coordinate or parameter 'thd'"),
        ({"theta_rate": [math.nan]}, "finite"),
        ({"theta_rate": "fast"}, "needs numbers, got 'fast'"),
        ({"friction": [-1.0]}, "friction must be at least 0"),
    ],
)
def test_wrong_axes_are_named(axes, message):
    with pytest.raises(InputError, match=message):
        basin(rimless_wheel(), WHEEL, axes)


def test_a_slide_despite_infinite_friction_is_refused():
    with pytest.raises(InputError, match="infinite friction cannot slide"):
        basin(rimless_wheel(), {**WHEEL, "foot_speed": 0.1}, {"theta_rate": [2.0]})


def test_file_of_another_law_is_not_gone_on_with(tmp_path):
    robot, path = rimless_wheel(), tmp_path / "basin.h5"
    basin(robot, WHEEL, {"theta_rate": [2.0]}, path=path)
    with pytest.raises(InputError, match="contains a different study"):
        basin(robot, WHEEL, {"theta_rate": [2.0]}, path=path, law=replace(passive(robot), name="another"))
    with pytest.raises(InputError, match="contains a different study"):
        basin(robot, WHEEL, {"theta_rate": [2.0]}, path=path, criterion=SettlingCriterion(tolerance=1e-3))


def test_edges_of_a_band_narrower_than_the_samples_are_found_when_one_is():
    # Between 'fell' and 'lift_off' at two far samples lies the whole basin of Type A.
    edges = locate_basin_edges(rimless_wheel(), WHEEL, {"theta_rate": [0.05, 3.5]}, tolerance=1e-4)
    assert [labels for _, *labels in edges] == [["fell", "stick | stick"], ["stick | stick", "lift_off"]]


def test_edges_are_located_to_the_last_digit():
    edges = locate_basin_edges(rimless_wheel(), WHEEL, {"theta_rate": [2.0, 3.0]}, tolerance=1e-300)
    (edge, below, above) = edges[0]
    assert (below, above) == ("stick | stick", "lift_off")
    assert ending_labels(basin(rimless_wheel(), WHEEL, {"theta_rate": [edge - 1e-14, edge + 1e-14]})).tolist() == [
        below,
        above,
    ]


@pytest.mark.parametrize(
    ("axes", "options", "message"),
    [
        ({"theta_rate": [2.0, 1.0]}, {}, r"needs increasing values, at least two, got \[2.0, 1.0\]"),
        ({"theta_rate": [math.nan, 1.0]}, {}, "finite values"),
        ({"theta_rate": [1.0, math.inf]}, {}, "finite values"),
        ({"theta_rate": [1.0]}, {}, "at least two"),
        ({"theta_rate": [1.0, 2.0], "slope": [0.1, 0.2]}, {}, "one axis, got 2: theta_rate, slope"),
        ({}, {}, "one axis, got 0: none"),
        ({"theta_rate": [1.0, 2.0]}, {"tolerance": 0}, "tolerance must be greater than 0"),
    ],
)
def test_edges_that_cannot_be_are_refused(axes, options, message):
    with pytest.raises(InputError, match=message):
        locate_basin_edges(rimless_wheel(), WHEEL, axes, **options)


def test_a_full_disk_leaves_a_basin_as_it_was(tmp_path, full_disk):
    path, arguments = (
        tmp_path / "basin.h5",
        (rimless_wheel(), {"slope": 0.23}, {"theta_rate": np.linspace(0.1, 3, 300)}),
    )
    settings = {"path": path, "engine": ScipyEngine(relative=1e-6), "criterion": SettlingCriterion(steps=2)}

    def stop(done, total):
        raise KeyboardInterrupt

    part = basin(*arguments, **settings, execution=Execution(observer=stop))
    with full_disk(5_000), pytest.raises(ArchiveError, match=r"Cannot write .*basin\.h5: File too large"):
        basin(*arguments, **settings)
    assert load_basin(path).identical(part)
    assert basin(*arguments, **settings).attrs["complete"]
