"""Trajectories as CSV: every digit of every quantity, readable without gaitopt."""

import csv

import numpy as np
import pytest

from gaitopt import InputError, compass_biped, simulate, write_csv


@pytest.fixture(scope="module")
def table(slip_gait, tmp_path_factory):
    path = write_csv(slip_gait.motion, tmp_path_factory.mktemp("csv") / "gait.csv")
    with path.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    return {name: [row[name] for row in rows] for name in rows[0]}


@pytest.mark.parametrize(
    ("name", "channel", "row"),
    [
        ("x_m", "q", 0),
        ("th2_rad", "q", 3),
        ("x_rate_m_per_s", "v", 0),
        ("th1_rate_rad_per_s", "v", 2),
        ("hip_torque_Nm", "torque", 1),
        ("ankle_power_W", "power", 0),
        ("ankle_work_J", "work", 0),
        ("tangential_force_N", "force", 0),
        ("normal_force_N", "force", 1),
    ],
)
def test_numbers_come_back_bit_by_bit(table, slip_gait, name, channel, row):
    assert np.array_equal(np.array(table[name], dtype=float), slip_gait.motion.channel(channel)[row])


def test_phases_and_points(table, slip_gait):
    sizes = [segment.time.size for segment in slip_gait.motion.segments]
    assert table["mode"] == ["slip+"] * sizes[0] + ["stick"] * sizes[1]
    hip = np.array(table["hip_y_m"], dtype=float)
    assert np.array_equal(hip, slip_gait.motion.channel("points")[1, slip_gait.motion.points.index("hip")])


def test_names_are_plain_and_differ(table):
    assert all(name.isidentifier() for name in table)


def test_a_walk_of_several_steps(tmp_path, compass):
    angles, rates = [-0.147836890, -0.147836890], [0.732796791, -0.500667882]
    walk = simulate(compass, [0, 0, *angles], [0, 0, *rates], {"slope": np.deg2rad(1)}, steps=2)
    lines = write_csv(walk.motion, tmp_path / "walk.csv").read_text(encoding="utf-8").splitlines()
    assert {line.split(",")[0] for line in lines[1:]} == {"0", "1"}


def test_nothing_to_write(tmp_path):
    walk = simulate(compass_biped(), [0, 0, 1.6, 0], [0, 0, 1, 0], {})
    if not walk.motion.segments:
        with pytest.raises(InputError, match="has no samples"):
            write_csv(walk.motion, tmp_path / "none.csv")


def test_dampers_and_springs_have_columns_where_there_are_any(table, damped, tmp_path):
    with write_csv(damped.motion, tmp_path / "damped.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [name for name in rows[0] if name not in table] == ["damping_work_J", "elastic_J"]
    for name in ("damping_work", "elastic"):
        assert np.array_equal([float(row[f"{name}_J"]) for row in rows], damped.motion.channel(name))
