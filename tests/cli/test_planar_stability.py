"""The command ``stability`` on scripts of robots with several contacts."""

import json
import math

import pytest
from typer.testing import CliRunner

from gaitopt.cli.app import app

SINGLE_SUPPORT = "problems/rimless_wheel.py"
KNEES, HOPPER, ROUND_FEET = (f"problems/{name}.py" for name in ("kneed_walker", "hopper", "round_foot_walker"))


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def gaits_of(*arguments):
    result = run("stability", *arguments, "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)["gaits"]


def test_the_kneed_walker_has_the_keys_of_every_gait():
    (gait,) = gaits_of(KNEES, "--starts", 2)
    (wheel,) = gaits_of(SINGLE_SUPPORT, "--set", "friction=inf", "--starts", 10)
    assert set(gait) == set(wheel) | {"impacts", "forces"}
    assert set(gait["energy"]) == set(wheel["energy"])
    assert gait["period"] == pytest.approx(0.5643281659150, abs=1e-12)  # source: tests/stability/test_planar_cycles.py
    assert gait["multipliers"][2] == pytest.approx([0.14382267, 0], abs=5e-9)
    landing = gait["impacts"][-1]
    assert landing["outcome"]["foot B"] == "stick"
    tangential, normal = landing["impulse"]["foot B"]
    assert tangential / normal == pytest.approx(gait["impact_ratio"])
    assert gait["forces"]["foot A"]["largest_ratio"] == pytest.approx(gait["critical_friction"], rel=1e-3)
    assert gait["critical_impact_ratio"] >= abs(gait["impact_ratio"])


def test_the_walker_with_round_feet_has_its_reference_gait():
    (gait,) = gaits_of(ROUND_FEET, "--starts", 2)
    assert gait["period"] == pytest.approx(2.427955842630, abs=1e-12)  # source: tests/stability/test_planar_cycles.py
    assert gait["multipliers"][0] == pytest.approx([0.43344487, 0], abs=5e-9)
    assert gait["state"]["a"] == pytest.approx(0.1894382832527, abs=2e-13)


def test_the_critical_friction_is_the_least_at_which_the_gait_does_not_slip():
    (gait,) = gaits_of(KNEES, "--starts", 1)
    least = max(gait["critical_friction"], gait["critical_impact_ratio"])
    (above,) = gaits_of(KNEES, "--starts", 1, "--set", f"friction={least * (1 + 1e-9)}")
    assert above["sequence"] == gait["sequence"]
    below = run("stability", KNEES, "--starts", 1, "--json", "--set", f"friction={least * (1 - 1e-6)}")
    assert gait["sequence"] not in [other["sequence"] for other in json.loads(below.stdout)["gaits"]]


def test_the_hopper_has_the_multiplier_of_its_closed_form_for_other_parameters():
    (gait,) = gaits_of(HOPPER, "--set", "body_mass=10", "--set", "thrust=0.03", "--starts", 1)
    height, weight, ratio = gait["state"]["body_rate"] ** 2 / (2 * 9.81), 10 * 9.81, 10 / 12
    root = math.sqrt(weight**2 + 2 * 4000 * weight * height)
    assert gait["multipliers"] == [pytest.approx([ratio**2 * (1 + 4000 * 0.03 / root), 0], abs=1e-10)]
    assert gait["impact_ratio"] == 0


def test_the_table_lists_sequence_and_multipliers():
    result = run("stability", HOPPER, "--starts", 1)
    assert result.exit_code == 0
    assert "sole closed" in result.output
    assert "0.781076" in result.output


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("stability", HOPPER, "--steps", 2), "--steps must be 1 for a robot with several contacts, got 2"),
        (
            ("stability", HOPPER, "--engine", "heyoka"),
            "--engine must be auto or scipy for a robot with several contacts",
        ),
        (
            ("simulate", HOPPER, "--engine", "heyoka"),
            "--engine must be auto or scipy for a robot with several contacts",
        ),
        (
            ("basin", HOPPER, "--over", "body=0.6:0.7:2"),
            "has a robot with several contacts; 'gaitopt stability', 'gaitopt simulate' and 'gaitopt impact' accept it",
        ),
        (("solve", HOPPER), "is a walking problem without optimisation"),
        (("stability", HOPPER, "--set", "thrst=1"), "Did you mean 'thrust'"),
    ],
)
def test_what_these_robots_do_not_support_is_said(arguments, message):
    result = run(*arguments)
    assert result.exit_code != 0
    assert message in " ".join(str(result.exception).split()) or message in " ".join(result.output.split())


def test_no_gait_is_exit_status_1():
    assert run("stability", HOPPER, "--set", "thrust=0", "--starts", 1).exit_code == 1
