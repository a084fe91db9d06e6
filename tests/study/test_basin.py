import math
from dataclasses import replace

import numpy as np
import pytest

from gaitopt import (
    ArchiveError,
    InputError,
    SettlingCriterion,
    basin,
    compass_biped,
    load_basin,
    passive,
    rimless_wheel,
)
from gaitopt.simulation.scipy_engine import ScipyEngine
from gaitopt.study import basin_edges, save_basin
from gaitopt.study.basins.basin_file import Basin
from gaitopt.study.basins.basin_record import BasinRecord, Endings

WHEEL = {"slope": math.radians(13)}
NATURAL_TIME = math.sqrt((4 / 3) / 9.8)
GRID = {"theta_rate": np.linspace(0.1, 3.2, 6)}


def test_basin_of_type_a_without_friction_limit():
    edges = basin_edges(rimless_wheel(), WHEEL, "theta_rate", 0.05, 3.0, samples=8, tolerance=1e-7)
    assert [labels for _, *labels in edges] == [["fell", "stick | stick"], ["stick | stick", "lift_off"]]
    # Gamus & Or (2015): 0.0872 < thd < 0.9595 in rad/tau_c.
    assert [value * NATURAL_TIME for value, *_ in edges] == pytest.approx([0.0872, 0.9595], abs=5e-5)


def test_endings_do_not_depend_on_the_number_of_workers(monkeypatch):
    import gaitopt.study.basins.basin as module

    monkeypatch.setattr(module, "CHUNK", 10)  # so that two processes have something to do
    grid, friction = {"theta_rate": np.linspace(0.1, 3.2, 31)}, {**WHEEL, "friction": 0.3}
    settings = {"engine": ScipyEngine(relative=1e-8), "patience": SettlingCriterion(steps=5, tolerance=1e-2)}
    one = basin(rimless_wheel(), friction, grid, **settings)
    two = basin(rimless_wheel(), friction, grid, **settings, workers=2)
    assert one.labels == two.labels
    for name in ("outcome", "steps", "final"):
        assert getattr(one, name).tobytes() == getattr(two, name).tobytes()
    assert set(one.labels) >= {"fell", "stick slip+ | stick", "lift_off"}
    assert sum(one.fractions().values()) == pytest.approx(1)


def test_interrupted_basin_goes_on(tmp_path, monkeypatch):
    import gaitopt.study.basins.basin as module

    monkeypatch.setattr(module, "CHUNK", 2)
    path, calls = tmp_path / "basin.h5", []

    def stop(done, total):
        calls.append(done)
        if len(calls) == 2:
            raise KeyboardInterrupt

    part = basin(rimless_wheel(), WHEEL, GRID, path=path, observer=stop)
    kept = load_basin(path)
    assert kept.pending().tolist() == part.pending().tolist() == [False] * 4 + [True] * 2
    calls.clear()
    resumed = basin(rimless_wheel(), WHEEL, GRID, path=path, observer=lambda done, total: calls.append(done))
    assert calls == [6]
    assert resumed.labels_on_grid().tolist() == basin(rimless_wheel(), WHEEL, GRID).labels_on_grid().tolist()


def test_labels_are_sorted_whatever_came_first():
    record = BasinRecord(Basin.empty("", {}, {}, {"x": np.arange(4.0)}, {}), None)
    last = Endings(("stick", "fell"), np.array([1, 0], np.int16), np.array([7, 8], np.int32), np.array([[2.0], [3.0]]))
    record["later"] = (np.array([2, 3]), last)
    assert record.basin().labels_on_grid().tolist() == ["", "", "fell", "stick"]
    record["first"] = (
        np.array([1]),
        Endings(("stick",), np.array([0], np.int16), np.array([9], np.int32), np.ones((1, 1))),
    )
    found = record.basin()
    assert found.labels == ("fell", "stick")
    assert found.labels_on_grid().tolist() == ["", "stick", "fell", "stick"]
    assert found.steps.tolist() == [0, 9, 7, 8]


def test_two_axes_and_parameters_as_axes():
    found = basin(rimless_wheel(), {}, {"slope": np.radians([0.5, 13]), "theta_rate": [0.05, 2.0]})
    assert found.labels_on_grid().tolist() == [["fell", "fell"], ["fell", "stick | stick"]]


def test_axes_may_be_bounds_of_each_other():
    robot, start = compass_biped(), {"th1": -0.2, "th1_rate": 0.1}
    com, length = {"leg_com": [0.3, 0.6]}, {"leg_length": [0.6, 0.9]}
    assert basin(robot, {"leg_length": 0.7}, com, base=start).shape == (2,)
    assert basin(robot, {}, {**com, **length}, base=start).shape == (2, 2)
    with pytest.raises(InputError, match=r"leg_com .* must be at most leg_length = 0\.5 \[m\], got 0\.6"):
        basin(robot, {}, {**com, "leg_length": [0.5, 0.9]}, base=start)


def test_file_of_another_basin_is_not_overwritten(tmp_path):
    path = tmp_path / "basin.h5"
    basin(rimless_wheel(), WHEEL, {"theta_rate": [2.0]}, path=path)
    with pytest.raises(InputError, match=r"holds another study \(another axes\)"):
        basin(rimless_wheel(), WHEEL, {"theta_rate": [2.1]}, path=path)
    with pytest.raises(
        InputError, match=r"\(another parameters: slope 0\.2268.* there, 0\.2 here\): name another place"
    ):
        basin(rimless_wheel(), {"slope": 0.2}, {"theta_rate": [2.0]}, path=path)


def test_file_round_trip_and_damage(tmp_path):
    found = basin(rimless_wheel(), WHEEL, GRID)
    path = save_basin(found, tmp_path / "basin.h5")
    back = load_basin(path)
    assert back.labels == found.labels
    assert np.array_equal(back.final, found.final, equal_nan=True)
    assert back.axes["theta_rate"].tolist() == found.axes["theta_rate"].tolist()
    path.write_bytes(path.read_bytes()[:500])
    with pytest.raises(ArchiveError, match="damaged"):
        load_basin(path)
    with pytest.raises(ArchiveError, match="no file"):
        load_basin(tmp_path / "none.h5")
    assert replace(found, labels=()).robot == "rimless_wheel"


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
        basin(rimless_wheel(), WHEEL, {"theta_rate": [2.0]}, base={"foot_speed": 0.1})


def test_file_of_another_law_is_not_gone_on_with(tmp_path):
    robot, path = rimless_wheel(), tmp_path / "basin.h5"
    basin(robot, WHEEL, {"theta_rate": [2.0]}, path=path)
    with pytest.raises(InputError, match="holds another study"):
        basin(robot, WHEEL, {"theta_rate": [2.0]}, path=path, law=replace(passive(robot), name="another"))
    with pytest.raises(InputError, match="holds another study"):
        basin(robot, WHEEL, {"theta_rate": [2.0]}, path=path, patience=SettlingCriterion(tolerance=1e-3))


def test_edges_of_a_band_narrower_than_the_samples_are_found_when_one_is():
    # Between 'fell' and 'lift_off' at two far samples lies the whole basin of Type A.
    edges = basin_edges(rimless_wheel(), WHEEL, "theta_rate", 0.05, 3.5, samples=2, tolerance=1e-4)
    assert [labels for _, *labels in edges] == [["fell", "stick | stick"], ["stick | stick", "lift_off"]]


def test_edges_are_located_to_the_last_digit():
    edges = basin_edges(rimless_wheel(), WHEEL, "theta_rate", 2.0, 3.0, samples=2, tolerance=1e-300)
    (edge, below, above) = edges[0]
    assert (below, above) == ("stick | stick", "lift_off")
    assert basin(rimless_wheel(), WHEEL, {"theta_rate": [edge - 1e-14, edge + 1e-14]}).labels_on_grid().tolist() == [
        below,
        above,
    ]


@pytest.mark.parametrize(
    ("interval", "options", "message"),
    [
        ((2.0, 1.0), {}, "the lower first"),
        ((math.nan, 1.0), {}, "finite ends"),
        ((1.0, math.inf), {}, "finite ends"),
        ((1.0, 2.0), {"samples": 1}, "samples must be at least 2"),
        ((1.0, 2.0), {"tolerance": 0}, "tolerance must be greater than 0"),
    ],
)
def test_edges_that_cannot_be_are_refused(interval, options, message):
    with pytest.raises(InputError, match=message):
        basin_edges(rimless_wheel(), WHEEL, "theta_rate", *interval, **options)


def test_a_full_disk_leaves_a_basin_as_it_was(tmp_path, full_disk):
    path, arguments = (
        tmp_path / "basin.h5",
        (rimless_wheel(), {"slope": 0.23}, {"theta_rate": np.linspace(0.1, 3, 300)}),
    )
    settings = {"path": path, "engine": ScipyEngine(relative=1e-6), "patience": SettlingCriterion(steps=2)}

    def stop(done, total):
        raise KeyboardInterrupt

    part = basin(*arguments, **settings, observer=stop)
    with full_disk(5_000), pytest.raises(ArchiveError, match=r"Cannot write .*basin\.h5: File too large"):
        basin(*arguments, **settings)
    assert load_basin(path).outcome.tolist() == part.outcome.tolist()
    assert not basin(*arguments, **settings).pending().any()
