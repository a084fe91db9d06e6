"""Gait libraries: exact at the points of the grid, of second order between them, and the same in exported code."""

import numpy as np
import pytest

from gaitopt import Collocation, InputError, feedforward, sweep
from gaitopt.export import write_library
from gaitopt.study import load_library, load_sweep, load_sweep_gait, measure_library
from gaitopt.study.libraries import gait_library
from gaitopt.study.libraries.library_errors import CellError, LibraryErrors
from tests.study.conftest import quick_problem

SPEEDS, LENGTHS = [0.60, 0.62, 0.64], [0.45, 0.46]


@pytest.fixture(scope="module")
def grid_problem():
    return quick_problem(speed=None, step_length=None, friction=0.25, transcription=Collocation(intervals=10))


@pytest.fixture(scope="module")
def swept(grid_problem, tmp_path_factory):
    path = tmp_path_factory.mktemp("library") / "sweep.nc"
    sweep(grid_problem, {"speed": SPEEDS, "step_length": LENGTHS}, starts=1, path=path)
    return path


@pytest.fixture(scope="module")
def library(swept):
    return load_library(swept)


def test_a_grid_point_is_its_gait(library, swept):
    gait = load_sweep_gait(swept, "stick | stick", speed=0.62, step_length=0.46)
    motion = library.motion_at(speed=0.62, step_length=0.46)
    assert motion.period == pytest.approx(gait.period)
    assert motion.travel == pytest.approx(0.46, abs=1e-6)
    assert str(motion.sequence()) == str(gait.sequence)
    time = gait.motion.channel("time")
    for name in ("q", "torque"):
        stored = [np.interp(time, motion.channel("time"), row) for row in motion.channel(name)]
        assert gait.motion.channel(name) == pytest.approx(np.array(stored), abs=1e-5)
    law = feedforward(library.robot, motion)
    assert law.torque_at(0.2, np.zeros(4), np.zeros(4)) == pytest.approx(
        feedforward(library.robot, gait.motion).torque_at(0.2, np.zeros(4), np.zeros(4)), abs=0.05
    )


def thin(library, *steps):
    """Return the library with every n-th point along each axis."""
    chosen = tuple(slice(None, None, step) for step in steps)
    axes = {name: values[part] for (name, values), part in zip(library.axes.items(), chosen, strict=True)}
    tables = {name: getattr(library, name)[chosen] for name in ("values", "durations", "samples")}
    return type(library)(**{**vars(library), "axes": axes, **tables})


def test_the_error_in_the_middle_is_of_second_order(library, grid_problem):
    fine, coarse = (measure_library(thin(library, step, 2), problem=grid_problem) for step in (1, 2))
    assert (len(fine.cells), len(coarse.cells)) == (2, 1)
    assert fine.largest("state") < 0.02  # rad, rad/s
    for name in ("torque", "state"):
        assert coarse.largest(name) / fine.largest(name) == pytest.approx(4, rel=0.3)
    assert "largest difference of the angles from the optimum" in str(fine)
    assert str(fine).endswith(f"cost of transport from the optimum: {fine.largest('cost'):.3g}")
    failed = LibraryErrors((*fine.cells, CellError(place={}, sequence="", state=0.1)), fine.sequence)
    assert f"angles from the optimum: {fine.largest('angle'):.3g} rad; 1 cell without an optimum" in str(failed)


def test_exported_code_interpolates_alike(library, tmp_path, rng):
    namespace = {}
    exec(write_library(library, tmp_path / "library.py").read_text(encoding="utf-8"), namespace)
    for speed, length in zip(rng.uniform(0.6, 0.64, 5), rng.uniform(0.45, 0.46, 5), strict=True):
        step = namespace["step_at"](speed=speed, step_length=length)
        motion = library.motion_at(speed=speed, step_length=length)
        for name in ("time", "q", "v", "torque"):
            assert step[name] == pytest.approx(motion.channel(name), abs=1e-8)
    with pytest.raises(ValueError, match=r"speed must be from 0\.6 to 0\.64, got 1"):
        namespace["step_at"](speed=1, step_length=0.45)


def test_rounding_does_not_lead_out_of_a_range(library, tmp_path):
    """Weights of four corners whose sum is below one, and an axis that ends in a number of 17 digits."""
    for place in np.linspace(0.601, 0.639, 40):
        library.motion_at(speed=place, step_length=0.4537)  # the static friction ratio is at least 1
    last = 0.1 + 0.2
    moved = type(library)(**{**vars(library), "axes": {**library.axes, "speed": np.array([0.1, 0.2, last])}})
    namespace = {}
    exec(write_library(moved, tmp_path / "library.py").read_text(encoding="utf-8"), namespace)
    assert namespace["step_at"](speed=last, step_length=0.45)["time"][-1] > 0


def test_places_outside_and_missing_gaits_are_rejected(library, swept):
    with pytest.raises(InputError, match="must be"):
        library.motion_at(speed=0.7, step_length=0.45)
    with pytest.raises(InputError, match=r"no axis 'sped'\. Did you mean 'speed'"):
        library.motion_at(sped=0.6)
    with pytest.raises(InputError, match="needs a value for speed, step_length"):
        library.motion_at(speed=0.6)
    durations = library.durations.copy()
    durations[0, 0] = np.nan
    holed = type(library)(**{**vars(library), "durations": durations})
    assert holed.motion_at(speed=0.63, step_length=0.45).period > 0
    assert len(list(holed.midpoints())) == 1
    with pytest.raises(InputError, match=r"no gait at a corner of the grid cell that contains speed 0\.61"):
        holed.motion_at(speed=0.61, step_length=0.455)
    with pytest.raises(InputError, match="has no contact sequence 'slip"):
        load_library(swept, "slip- | slip-")


def test_the_error_of_several_sequences_names_the_option(swept, monkeypatch):
    table = load_sweep(swept).isel(sequence=[0, 0]).assign_coords(sequence=["stick | stick", "slip+ stick | slip+"])
    monkeypatch.setattr(gait_library, "load_sweep", lambda path: table)
    with pytest.raises(InputError, match=r"specify one of 'stick \| stick', .* by sequence=\.\.\., or --sequence\."):
        load_library(swept)


def test_the_command_exports_a_library_and_reports_its_errors(swept, tmp_path, monkeypatch, capsys):
    from gaitopt.cli.app import main

    with pytest.raises(SystemExit) as stop:
        main(["export", str(swept), "-o", str(tmp_path / "speeds.py")])
    assert stop.value.code == 0
    assert "2 cells, 0 of them with another contact sequence" in capsys.readouterr().out
    assert "def step_at(" in (tmp_path / "speeds.py").read_text(encoding="utf-8")
    for options in (["--law", "lqr"], ["--gain", "10"], ["--torque-limit", "5"]):
        with pytest.raises(SystemExit) as stop:
            main(["export", str(swept), "-o", str(tmp_path / "law.py"), *options])
        assert stop.value.code == 2, options
    assert not (tmp_path / "law.py").exists()
