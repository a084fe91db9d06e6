"""Recorded motions of other programs are read with their units, and misfits are reported where they are."""

import dataclasses

import numpy as np
import pytest
import scipy.io

from gaitopt import GaitProblem, InputError, Limits, compass_biped, solve, write_csv
from gaitopt.errors import ArchiveError
from gaitopt.model.robots.flat_foot_walker import flat_foot_walker
from gaitopt.model.robots.monopod import monopod
from gaitopt.motion import read_motion
from gaitopt.ocp import Collocation, FromMotion, PlanarKeyframes, PlanarProblem, Tracking


@pytest.fixture(scope="module")
def exported(slip_gait, tmp_path_factory):
    return write_csv(slip_gait.motion, tmp_path_factory.mktemp("recorded") / "walk.csv")


@pytest.fixture(scope="module")
def recorded(exported, slip_gait):
    return read_motion(exported, compass_biped(), parameters=slip_gait.motion.parameters)


def test_an_exported_gait_is_read_back(recorded, slip_gait):
    time = slip_gait.motion.channel("time")
    for number, (fit, curve) in enumerate(zip(recorded.fit.coordinates, recorded.q, strict=True)):
        samples = np.interp(recorded.time, time, slip_gait.motion.channel("q")[2 + number])
        assert np.max(np.abs(curve - samples)) < 1e-3  # rad
        assert 0 < fit.rms <= fit.largest < 1e-3
        assert fit.closure == pytest.approx(0, abs=1e-3)
        assert fit.rate_error < 0.05  # rad/s
    assert recorded.fit.landing_height == pytest.approx(0, abs=1e-4)  # m
    assert recorded.slide[-1] == pytest.approx(slip_gait.motion.foot_slide, abs=1e-4)
    assert np.max(np.abs(recorded.torque)) == pytest.approx(6, abs=0.5)  # the limit of the script, N m
    assert "kinetic_J" in recorded.fit.ignored
    assert "mode" in recorded.fit.ignored
    assert f" and {len(recorded.fit.ignored) - 8} more" in str(recorded.fit)
    assert "gait file" not in str(recorded.fit)
    unused = dataclasses.replace(recorded.fit, ignored=("hip_torque_Nm",))  # that of a robot with several contacts
    assert "columns that were not used: hip_torque_Nm\nIf a gait file (.h5) of this motion exists" in str(unused)


def test_it_is_a_guess_and_a_reference_to_track(recorded, slip_gait):
    problem = GaitProblem(
        robot=compass_biped(),
        sequence=slip_gait.sequence,
        friction=0.14,
        speed=slip_gait.speed,
        step_length=slip_gait.step_length,
        limits=Limits(torque=6),
        guess=FromMotion(recorded.motion),
        objective=Tracking(recorded.motion),
        transcription=Collocation(intervals=(5, 20)),
    )
    gait = solve(problem, starts=1)
    assert gait.status.ok
    assert gait.solver.objective < 1e-5  # rad^2 s


def write_opensim(path, recorded, unit):
    factor = {"yes": 180 / np.pi, "no": 1.0}[unit]
    rows = np.column_stack([recorded.time + 2, factor * recorded.q.T])
    header = f"Coordinates\nversion=1\nnRows={len(rows)}\nnColumns=3\ninDegrees={unit}\n\nendheader\ntime\thip_r\tth2\n"
    path.write_text(header + "\n".join("\t".join(map(repr, row)) for row in rows.tolist()))
    return path


@pytest.mark.parametrize("unit", ["yes", "no"])
def test_opensim_files_state_their_unit(recorded, tmp_path, unit):
    path = write_opensim(tmp_path / "walk.mot", recorded, unit)
    again = read_motion(path, compass_biped(), columns={"th1": "hip_r"})
    assert again.q == pytest.approx(recorded.q, abs=1e-9)
    assert again.time[0] == 0
    with pytest.raises(InputError, match=r"no column of the coordinate 'th1'. Known: hip_r. Specify the column by"):
        read_motion(path, compass_biped())


def test_matlab_files_with_vectors_or_a_structure(recorded, tmp_path):
    columns = {"time": 1e3 * recorded.time, "th1": recorded.q[0], "th2": recorded.q[1], "scalar": 3.0}
    columns["time_ms"] = columns.pop("time")
    scipy.io.savemat(tmp_path / "vectors.mat", columns)
    scipy.io.savemat(tmp_path / "structure.mat", {"walk": columns})
    for name in ("vectors.mat", "structure.mat"):
        again = read_motion(tmp_path / name, compass_biped(), angle_unit="rad")
        assert again.q == pytest.approx(recorded.q, abs=1e-9)
        assert again.fit.duration == pytest.approx(recorded.fit.duration)
    with pytest.raises(InputError, match="'th1' has no unit; name it th1_rad or th1_deg"):
        read_motion(tmp_path / "vectors.mat", compass_biped())


def test_keyframes_pass_through_the_postures_without_overshoot(tmp_path):
    path = tmp_path / "poses.csv"
    path.write_text("time_s;th1_deg;th2_deg\n0;-8,5;-8,5\n0,4;0;9\n0,7;8,5;8,5\n")  # a decimal comma
    recorded = read_motion(path, compass_biped())
    assert recorded.q[:, [0, -1]] == pytest.approx(np.deg2rad([[-8.5, 8.5], [-8.5, 8.5]]))
    assert np.max(np.rad2deg(recorded.q[1])) == pytest.approx(9, abs=0.05)
    assert max(one.largest for one in recorded.fit.coordinates) < 1e-12


def test_the_place_of_a_misfit_and_doubtful_units_are_reported(recorded, tmp_path):
    time, angles = recorded.time, np.rad2deg(recorded.q.copy())
    angles[1, 48] += 5  # an outlier at three quarters of the step
    rows = np.column_stack([time, angles.T])
    path = tmp_path / "outlier.csv"
    np.savetxt(path, rows, delimiter=",", header="time_s,th1_rad,th2_rad", comments="")
    fit = read_motion(path, compass_biped(), pieces=8).fit
    assert fit.coordinates[1].place == pytest.approx(0.75)
    assert "th1 reaches 8.4" in str(fit)
    assert "if the values are in degrees" in str(fit)
    part = read_motion(path, compass_biped(), span=(0.1, 0.3), pieces=2).fit
    assert part.duration == pytest.approx(0.2, abs=0.02)


def test_a_renamed_column_states_its_unit(tmp_path):
    path = tmp_path / "poses.csv"
    path.write_text("time_s,stance_deg,th2_deg\n0,-8,-8\n0.4,0,6\n0.7,8,8\n")
    for unit in (None, "rad"):
        motion = read_motion(path, compass_biped(), columns={"th1": "stance_deg"}, angle_unit=unit)
        assert motion.q[0] == pytest.approx(motion.q[1], abs=0.2)
        assert motion.q[0, -1] == pytest.approx(np.deg2rad(8))


@pytest.mark.parametrize(
    ("name", "column", "scale"), [("time", "Zeit", 1), ("time_s", "Zeit_ms", 1e3), ("t", "Zeit", 1)]
)
def test_the_column_of_the_time_may_have_another_name(tmp_path, name, column, scale):
    path = tmp_path / "poses.csv"
    path.write_text(f"{column},th1_deg,th2_deg\n0,-8,-8\n{0.4 * scale},0,6\n{0.7 * scale},8,8\n")
    motion = read_motion(path, compass_biped(), columns={name: column})
    assert motion.time[-1] == pytest.approx(0.7)
    with pytest.raises(InputError, match=r"no column with the time. .* or --column time=COLUMN"):
        read_motion(path, compass_biped())


def test_the_time_of_a_matlab_file_may_have_another_name(recorded, tmp_path):
    path = tmp_path / "walk.mat"
    scipy.io.savemat(path, {"Zeit": recorded.time, "th1": recorded.q[0], "th2": recorded.q[1], "scalar": 3.0})
    again = read_motion(path, compass_biped(), columns={"time": "Zeit"}, angle_unit="rad")
    assert again.q == pytest.approx(recorded.q, abs=1e-9)


def test_planar_robots_have_lengths_and_angles(tmp_path):
    robot = monopod()
    units = ["mm" if unit == "m" else "deg" for unit in robot.units]
    header = ",".join(["t", *(f"{name}_{unit}" for name, unit in zip(robot.coordinates, units, strict=True))])
    path = tmp_path / "hop.csv"
    path.write_text(f"{header}\n" + "\n".join(",".join([str(t), *["100"] * robot.n_q]) for t in (0, 0.2, 0.5)))
    recorded = read_motion(path, robot)
    expected = [0.1 if unit == "m" else np.deg2rad(100) for unit in robot.units]
    assert recorded.q[:, 0] == pytest.approx(expected)
    problem = PlanarProblem(robot=robot, sequence="foot stick > flight |", friction=1, speed=1, step_length=0.5)
    guess = PlanarKeyframes(recorded.time, recorded.coordinates)
    assert problem.replace(guess=guess).guess.durations is not None
    with pytest.raises(InputError, match="use PlanarKeyframes"):
        _ = recorded.motion


def test_missing_columns_are_named_with_those_of_the_file(tmp_path):
    path, robot = tmp_path / "walk.csv", flat_foot_walker()
    given = [name for name in robot.coordinates if name not in ("x", "y")]
    path.write_text(f"time_s,{','.join(f'{name}_deg' for name in given)}\n{'0,' * len(given)}0\n{'1,' * len(given)}1\n")
    with pytest.raises(InputError) as raised:
        read_motion(path, robot)
    assert str(raised.value) == (
        f"{path} has no columns of the coordinates 'x', 'y'; it has those of the time and of {', '.join(given)}. "
        "Add x_m, y_m; state x, y such that the standing foot is on the ground."
    )


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("time_s,th1_rad\n0,1\n1,2\n", "no column of the coordinate 'th2'"),
        ("th1_rad,th2_rad\n0,1\n1,2\n", "no column with the time"),
        ("time_s,th1_rad,th2_rad\n1,1,1\n0,2,1\n", "the time must increase"),
        ("time_s,th1_rad,th2_rad\n0,1,1\n1,nan,1\n", "the values of th1 must be finite"),
        ("time_s,th1_rad,th1_rad\n0,1,1\n", "must be different"),
        ("time_s,th1_rad,th2_rad\n0,1\n", "row 2 has 2 entries"),
        ("", "no table with at least two rows"),
    ],
)
def test_invalid_tables_are_rejected_in_a_sentence(tmp_path, text, match):
    path = tmp_path / "walk.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=match):
        read_motion(path, compass_biped())


def test_other_and_damaged_files_are_rejected(tmp_path):
    for name, error, match in (
        ("walk.txt", InputError, "a recorded motion ends in .csv, .mat, .sto, .mot"),
        ("walk.mat", ArchiveError, "Cannot read"),
        ("walk.sto", InputError, "no line 'endheader'"),
    ):
        (tmp_path / name).write_text("damaged")
        with pytest.raises(error, match=match):
            read_motion(tmp_path / name, compass_biped())
