"""The command impact: one impact of a robot with several contacts."""

import numpy as np
import pytest

SCRIPT = """
from dataclasses import dataclass, field

from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet


@dataclass
class Compass:
    robot: object = field(default_factory=compass_with_two_feet)
    parameters: dict = field(default_factory=dict)


def problem(friction=0.14):
    return Compass(parameters={"friction": friction})
"""


def state(th, rate):
    """Foot A at rest, leaning back; B ahead, with a rate."""
    return [part for value in (f"a={-th}", f"b={th}", "a_rate=-1", f"b_rate={rate}") for part in ("--state", value)]


def test_one_impact_as_json(command, script):
    """Numbers as in tests/model/test_multicontact_impact.py."""
    run = command("impact", script(SCRIPT), *state(0.15, 0.1), "--json")
    assert run.status == 0, run.err
    assert run.json["status"] == "unique"
    assert run.json["outcome"] == {"foot A": "free", "foot B": "slip+"}
    assert run.json["impulse"]["foot A"] == [0, 0]
    assert run.json["impulse"]["foot B"] == pytest.approx([-0.249931040758, 1.785221719703], abs=1e-11)
    assert run.json["energy_lost"] == pytest.approx(0.638584550216, abs=1e-11)
    expected = [1.449474427638, -0.057929599128, -0.802319104207, 0.242280861356]
    assert run.json["velocity_after"] == pytest.approx(expected, abs=1e-11)


def test_a_setting_of_the_script_and_a_complete_state(command, script):
    """The hip's height and rates may be named, too."""
    th = 0.5
    hip = {"x": 0, "y": 1.6 * np.cos(th), "x_rate": 1.6 * np.cos(th), "y_rate": -1.6 * np.sin(th)}
    named = [part for name, value in hip.items() for part in ("--state", f"{name}={value!r}".replace("np.float64", ""))]
    named = [part.replace("(", "").replace(")", "") for part in named]
    for arguments in (named, []):
        run = command("impact", script(SCRIPT), "--set", "friction=0.3", *state(th, 0.5), *arguments, "--json")
        assert run.status == 0, run.err
        assert run.json["outcome"] == {"foot A": "slip+", "foot B": "slip+"}
        assert run.json["impulse"]["foot A"] == pytest.approx([-0.068433127303, 0.228110424342], abs=1e-11)
        assert run.json["energy_lost"] == pytest.approx(1.214225267088, abs=1e-11)


def test_one_impact_as_text(command, script):
    run = command("impact", script(SCRIPT), *state(0.15, 0.1))
    assert run.status == 0
    table = ("normal", "foot A", "slip+", "1.78522172", "N s")
    for text in ("unique outcome", *table, "energy lost 0.63858455 J"):
        assert text in run.out
    assert "velocity after  x 1.44947443 m/s  y -0.0579295991 m/s  a -0.802319104 rad/s  b 0.242280861 rad/s" in run.out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "The script states no motion, and a robot at rest has no impact: state rates with --state NAME=VALUE ("),
        (["--state", "c=1"], "no state coordinate 'c'"),
        (["--state", "a=-0.5", "--state", "b=0.1"], "foot B"),
        ([*state(0.15, 0.1), "--on", "foot C"], "no contact 'foot C'"),
        (["--state", "a=x"], "NAME=NUMBER"),
        (["--state", "a=nan"], "--state a must be a finite number, got nan"),
        (["--state", "y=5", "--state", "a=0.1"], "does not stand on foot A"),
    ],
)
def test_an_invalid_state_gets_a_sentence(command, script, arguments, message):
    run = command("impact", script(SCRIPT), *arguments)
    assert run.status == 2
    assert message in run.err


def test_a_robot_with_one_stance_foot_is_refused(command, root):
    run = command("impact", root / "problems/compass_passive.py", *state(0.1, 0.1))
    assert run.status == 2
    assert "assemble_planar" in run.err


def test_the_start_of_a_script_is_the_default_state(command, root):
    """At its knee strike the kneed walker has one foot at rest and the stance knee latched."""
    knees = ["--state", "flexion_b=0", "--state", "b=0.3", "--state", "flexion_b_rate=-4", "--set", "friction=1"]
    run = command("impact", root / "problems/kneed_walker.py", *knees, "--state", "a=-0.1", "--json")
    assert run.status == 0, run.err
    assert run.json["outcome"] == {"foot A": "stick", "knee A": "latched", "knee B": "closed"}
    assert run.json["impulse"]["knee B"][1] > 0
    assert run.json["energy_lost"] > 0
    beyond = command("impact", root / "problems/kneed_walker.py", "--state", "flexion_a=-0.1")
    assert beyond.status == 2
    assert "'knee A' is 0.1 rad beyond its limit" in beyond.err
