"""The command ``stability`` on scripts of robots with several contacts."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from gaitopt import save
from gaitopt.cli.app import app
from gaitopt.cli.planar_walks import print_planar_cycles
from gaitopt.cli.progress_display import Display
from gaitopt.cli.script import call_script
from gaitopt.continuation.gait_lookup import _are_same
from gaitopt.errors import InputError
from gaitopt.report.sections import cycle_card
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.stability import assess_planar, find_planar_cycle

SINGLE_SUPPORT = "problems/rimless_wheel.py"
NAMES = "kneed_walker", "hopper", "round_feet", "monopod"
KNEES, HOPPER, ROUND_FEET, MONOPOD = (f"problems/{name}.py" for name in NAMES)


def run(*arguments):
    return CliRunner().invoke(app, [str(a) for a in arguments])


def gaits_of(*arguments):
    result = run("stability", *arguments, "--json")
    assert result.exit_code == 0, result.output
    return json.loads(result.stdout)["gaits"]


@pytest.mark.slow
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


def test_gaits_of_all_robots_have_the_same_keys():
    gaits = [gaits_of(script, "--starts", 1)[0] for script in (KNEES, HOPPER, ROUND_FEET)]
    for gait, contact in zip(gaits, ("foot A", "sole", "foot A"), strict=True):
        assert set(gait) == set(gaits[0])
        assert gait["forces"][contact]["largest_normal"] > 0
        assert all(len(impulse) == 2 for impact in gait["impacts"] for impulse in impact["impulse"].values())


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


def test_the_engine_heyoka_is_stated_and_used():
    pytest.importorskip("heyoka")
    result = run("stability", HOPPER, "--starts", 1, "--engine", "heyoka", "--json")
    facts = json.loads(result.stdout)
    assert (result.exit_code, facts["engine"]) == (0, "heyoka")
    assert facts["gaits"][0]["multipliers"][0] == pytest.approx([0.78107619584119, 0], abs=1e-10)  # closed form
    result = run("simulate", HOPPER, "--engine", "heyoka", "--steps", 2, "--json")
    facts = json.loads(result.stdout)
    assert (result.exit_code, facts["engine"], facts["steps"]) == (0, "heyoka", 2)
    result = run("basin", HOPPER, "--over", "body_rate=-1.9,-1.8", "--steps", 2, "--engine", "heyoka", "--json")
    facts = json.loads(result.stdout)
    assert (result.exit_code, facts["engine"], facts["fractions"]) == (0, "heyoka", {"unsettled": 1.0})


def test_the_table_lists_sequence_and_multipliers():
    result = run("stability", HOPPER, "--starts", 1)
    assert result.exit_code == 0
    assert "sole closed" in result.output
    assert "0.781076" in result.output
    assert "no friction" in result.output  # it has no foot that sticks or slips


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("stability", HOPPER, "--steps", 2), "--steps must be 1 for a robot with several contacts, got 2"),
        (("stability", HOPPER, "--engine", "heyoca"), "There is no engine 'heyoca'. Did you mean 'heyoka'"),
        (("simulate", HOPPER, "--engine", "heyoca"), "There is no engine 'heyoca'. Did you mean 'heyoka'"),
        (("basin", HOPPER, "--over", "body=0.6,0.7", "--engine", "heyoca"), "There is no engine 'heyoca'. Did you"),
        (("trace", HOPPER, "--over", "thrust=0.02:0.03", "--engine", "heyoca"), "There is no engine 'heyoca'. Did you"),
        (("basin", HOPPER, "--over", "knee=0.6:0.7:2"), "has no coordinate or parameter 'knee'"),
        (
            ("basin", HOPPER, "--over", "body=0.6,0.7", "--law", "lqr"),
            "without optimisation (PlanarWalkProblem) is defined",
        ),
        (("basin", HOPPER, "--over", "body=0.6", "--state", "body=0.7"), "body is set by both --over and --state"),
        (("push", HOPPER), f"(PlanarWalkProblem); 'gaitopt stability {HOPPER}' assesses its gaits"),
        (("push", MONOPOD, "--problem", MONOPOD), "--problem specifies the robot of a saved gait"),
        (
            ("solve", HOPPER),
            f"a walking problem without optimisation (PlanarWalkProblem); use 'gaitopt stability {HOPPER}'",
        ),
        (
            ("plot", HOPPER),
            f"(PlanarWalkProblem), not a result; use 'gaitopt stability {HOPPER}', 'gaitopt simulate {HOPPER} -o hop",
        ),
        (("verify", HOPPER), f"not a result; use 'gaitopt stability {HOPPER}'"),
        (("animate", HOPPER), "-o hopper.png' (or .gif), or 'gaitopt report"),
        (("export", HOPPER, "-o", "hopper.csv"), f"not a result; use 'gaitopt stability {HOPPER}'"),
        (("stability", HOPPER, "--set", "thrst=1"), "Did you mean 'thrust'"),
    ],
)
def test_what_these_robots_do_not_support_is_said(arguments, message):
    result = run(*arguments)
    assert result.exit_code != 0
    assert message in " ".join(str(result.exception).split()) or message in " ".join(result.output.split())


@pytest.mark.slow
def test_no_gait_is_exit_status_1():
    result = run("stability", ROUND_FEET, "--set", "slope=-0.1", "--starts", 1)
    assert result.exit_code == 1
    assert "no periodic gait found" in result.output


@pytest.mark.slow
def test_an_optimal_gait_is_assessed_in_open_loop_and_under_a_law(hop_gait, tmp_path):
    settings = ("clearance=0.02", "stance_intervals=6", "flight_intervals=16")  # as for `hop_gait`
    monopod = ("problems/monopod.py", *(word for setting in settings for word in ("--set", setting)))
    saved = save(hop_gait, tmp_path / "hop.h5")  # the gait of the script, which is solved for one law only
    (open_loop,), (controlled,) = gaits_of(saved), gaits_of(*monopod, "--law", "step-lqr")
    (along,) = gaits_of(saved, "--law", "lqr", "--torque-limit", 1000)
    (by_angle,) = gaits_of(saved, "--law", "lqr", "--stance-angle")
    assert open_loop["radius"] > 3
    assert controlled["radius"] < 0.5
    assert along["radius"] < 0.5
    assert 0.5 < by_angle["radius"] < 0.9
    assert set(open_loop) == set(controlled)
    assert controlled["forces"]["foot"]["largest_normal"] > 100


@pytest.mark.slow
def test_a_saved_gait_is_assessed_like_that_of_a_script(hop_gait, tmp_path):
    (gait,) = gaits_of(save(hop_gait, tmp_path / "hop.h5"))
    expected = assess_planar(hop_gait)
    assert gait["radius"] == pytest.approx(expected.radius, rel=1e-9)
    assert gait["period"] == pytest.approx(expected.period, rel=1e-12)
    result = run("stability", tmp_path / "hop.h5", "--set", "friction=0.5")
    assert isinstance(result.exception, InputError)
    assert "--set changes the parameters of a script" in str(result.exception)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (("--law", "phase-pd"), "There is no feedback law 'phase-pd' for a robot with several contacts"),
        (("--gain", "hip_stiffness=1"), "has no gains and no torque limit to set"),
        (("--law", "lqr", "--gain", "hip_stiffness=1"), "has no gains to set"),
        (("--law", "joint-pd", "--gain", "knee_stiffness=1"), "has no gain 'knee_stiffness'"),
        (("--steps", 2), "--steps must be 1"),
    ],
)
def test_wrong_options_of_an_optimal_gait_get_a_sentence(options, message):
    error = run("stability", "problems/monopod.py", *options).exception
    assert isinstance(error, InputError)
    assert message in str(error)


@pytest.mark.slow
def test_a_sweep_of_a_robot_with_several_contacts_is_a_command(tmp_path):
    script = "problems/compass_double_support.py"
    settings = ("--set", "sequence=foot A stick |", "--set", "single_intervals=8", "--set", "step_length=0.3")
    result = run(
        "sweep", script, "--over", "friction=0.5,0.9", *settings, "-o", tmp_path / "a.nc", "--starts", 1, "--json"
    )
    assert result.exit_code == 0, result.output
    facts = json.loads(result.stdout)
    assert [point["status"] for point in facts["points"]] == ["solved", "solved"]
    assert facts["points"][0]["verified"]


def test_the_position_along_the_ground_is_not_part_of_the_printed_state(capsys):
    """It is arbitrary: the same gait that begins 0.36 m farther has the same printed state."""
    problem = call_script(Path(KNEES), [])
    cycle = next(problem.search(1))
    q, v = np.split(cycle.start.y, 2)
    along = problem.robot.coordinates.index(problem.robot.travel)
    q[along] += 0.36
    moved = find_planar_cycle(problem.robot, q, v, problem.parameters, section=problem.section)
    assert abs(moved.state[problem.robot.travel] - cycle.state[problem.robot.travel]) > 0.3
    printed = []
    for each in (cycle, moved):
        print_planar_cycles((each,))
        printed.append(capsys.readouterr().out)
    name = problem.robot.travel
    assert not any(line.strip().startswith(f"{name} ") for line in printed[1].splitlines())
    assert f"{name}, the position along the ground, does not repeat" in " ".join(printed[1].split())
    assert f"{name}_rate" in printed[1]
    assert _are_same(cycle, moved)
    assert name not in {cell.text for cell in cycle_card(moved).iter("th")}


def test_an_interrupted_walk_is_reported_until_its_last_event(command, hop_gait, folder, monkeypatch):
    saved = save(hop_gait, folder / "hop.h5")
    flow, counts = PlanarAutomaton.flow, list[tuple[int, int]]()

    def interrupt(self, state, duration):
        if counts and counts[-1][0] == 2:
            raise KeyboardInterrupt
        return flow(self, state, duration)

    monkeypatch.setattr(PlanarAutomaton, "flow", interrupt)
    monkeypatch.setattr(Display, "count", lambda self, done, total, remark="": counts.append((done, total)))
    run = command("simulate", saved, "--steps", "5", "--json")
    walk = json.loads(run.out)
    assert run.status == 130
    assert (walk["stop"], walk["steps"], counts) == ("interrupted", 2, [(1, 5), (2, 5)])
    assert "Interrupted; the walk until its last event is reported." in run.err
