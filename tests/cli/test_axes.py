"""Axes of --over mean what --set means, and reach the library in SI units."""

import json
import math
import re

import numpy as np
import pytest

from gaitopt import InputError, load_sweep
from gaitopt.cli.axis import convert_axes, grid, unconverted_axes
from gaitopt.cli.script import gait_problem, read_script, walk_problem

SLIP, WHEEL = "problems/compass_slip.py", "problems/rimless_wheel.py"


def converted(source, name, *values, settings=(), kind=gait_problem):
    script = read_script(source, settings)
    return convert_axes(script, kind(script), {name: np.array(values, dtype=float)})[name].tolist()


def test_a_slope_in_degrees_of_the_script_is_one_in_degrees_of_an_axis(root):
    assert converted(root / SLIP, "slope", -2, 0, 2) == pytest.approx(np.deg2rad([-2, 0, 2]).tolist())
    assert converted(root / WHEEL, "slope", 13, kind=walk_problem) == [math.radians(13)]
    assert converted(root / WHEEL, "spokes", 8, 10, kind=walk_problem) == [8, 10]


def test_values_that_the_problem_refuses_stay_on_the_line_of_the_others(root):
    assert converted(root / SLIP, "step_length", 0.4, 20) == [
        0.4,
        20,
    ]  # longer than the legs reach: a point without gait
    assert converted(root / SLIP, "slope", -2, 0, 200) == pytest.approx(np.deg2rad([-2, 0, 200]).tolist())
    with pytest.raises(InputError, match="longer than the"):
        converted(root / SLIP, "step_length", 20, 30)


def test_an_axis_that_is_named_twice_is_named_in_the_message():
    with pytest.raises(InputError, match="must be different, got 'speed' twice"):
        grid(["friction=0.1:0.3:3", "speed=0.5", "speed=0.6"], 10)


TWO = """\
from gaitopt import GaitProblem, compass_biped


def problem(friction=0.3, speed=0.6):
    return GaitProblem(
        robot=compass_biped(), sequence="stick | stick", friction=friction, speed=speed, step_length=0.45 * speed / 0.6
    )
"""


def test_a_parameter_that_changes_more_than_one_quantity_is_refused(script):
    path = script(TWO)
    assert converted(path, "friction", 0.2, 0.3) == [0.2, 0.3]
    with pytest.raises(
        InputError, match=r"must change one quantity, but problem\(\) of own.py also changes step_length"
    ):
        converted(path, "speed", 0.5, 0.7)
    path = script(TWO.replace("speed=speed,", "speed=(0.9 * speed, speed),").replace(" * speed / 0.6", ""))
    with pytest.raises(InputError, match="must return a number for it"):
        converted(path, "speed", 0.5, 0.7)


@pytest.mark.parametrize("count", [0, -3])
def test_a_count_below_one_is_named(count):
    with pytest.raises(InputError, match=rf"COUNT of an axis NAME=FROM:TO:COUNT must be at least 1, got {count} in"):
        grid([f"friction=0.1:0.3:{count}"], 10)


def test_a_range_has_at_least_two_values():
    with pytest.raises(InputError, match=r"must be at least 2, got 1 in .*; a single value is written th1=-0\.2\."):
        grid(["th1=-0.2:-0.1:1"], 10)
    assert grid(["th1=-0.2:-0.2:1"], 10)["th1"].tolist() == [-0.2]


def test_quantities_that_are_no_parameters_of_the_script_are_named(script, root):
    source = read_script(script(TWO))
    problem = gait_problem(source)
    axes = {"slope": np.array([0.01]), "friction": np.array([0.2])}
    assert convert_axes(source, problem, axes)["slope"].tolist() == [0.01]
    assert unconverted_axes(source, problem, axes) == (
        "--over takes slope in SI units and rad: problem() of own.py has no such parameter."
    )
    assert unconverted_axes(source, problem, {"slope": np.linspace(2.0, 3.0, 5)}).endswith(
        "has no such parameter. 2 to 3 deg is slope=0.0349066:0.0523599."
    )
    source = read_script(root / WHEEL)
    assert unconverted_axes(source, walk_problem(source), {"slope": axes["slope"], "theta_rate": axes["slope"]}) == ""


def test_a_sweep_over_slopes_in_degrees_is_stored_in_rad(command, root, folder):
    settings = ("--set", "intervals=8", "--set", "objective=torque_squared", "--set", "sequence=stick | stick")
    run = command(
        "sweep", root / SLIP, "--over", "slope=0,1", *settings, "--starts", "1", "--workers", "1", "-o", "f.nc"
    )
    assert run.status == 0, run.err
    assert "slope [deg]" in run.out
    assert re.search(r"^ *1 +\d", run.out, re.MULTILINE)
    table = load_sweep(folder / "f.nc")
    assert table.slope.values.tolist() == [0, math.radians(1)]
    assert table.slope.attrs["units"] == "rad"
    assert (table.status == "solved").all()


def test_a_basin_over_slopes_in_degrees(command, root):
    arguments = ("--over", "slope=-1,13", "--set", "friction=inf", "--state", "theta_rate=1.2", "--json")
    facts = json.loads(command("basin", root / WHEEL, *arguments).out)
    assert facts["axes"]["slope"] == [math.radians(-1), math.radians(13)]
    assert facts["endings"][1] == "stick | stick"
