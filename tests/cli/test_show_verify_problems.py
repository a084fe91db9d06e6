import itertools
import json
import re
import shutil
from pathlib import Path

import pytest

from tests.hdf5 import edit_hdf5


def test_show_prints_the_facts(command, slip_file):
    run = command("show", slip_file)
    assert run.status == 0
    assert run.err == ""
    for fact in ("slip+ stick | slip+", "0.0158", "compass_biped", "friction 0.14", "passed"):
        assert fact in run.out


def test_show_and_verify_give_the_same_json(command, slip_file):
    shown, verified = command("show", slip_file, "--json"), command("verify", slip_file, "--json")
    assert (shown.status, verified.status) == (0, 0)
    assert set(shown.json) == set(verified.json)
    assert shown.json["cost_of_transport"] == verified.json["cost_of_transport"]
    assert verified.json["verification"]["passed"] is True
    assert verified.json["file"] == str(slip_file)


def test_show_states_the_problem_of_a_script(command, root):
    script = root / "problems" / "compass_slip.py"
    shown = command("show", script, "--set", "friction=0.2")
    assert "Optimal gait of compass_biped: slip+ stick | slip+" in shown.out
    assert "μ = 0.2, slope = 0 rad" in shown.out
    assert command("show", script, "--set", "friction=0.2", "--json").json["friction"] == 0.2
    walk = command("show", root / "problems" / "kneed_walker.py", "--json")
    assert (walk.status, walk.json["robot"]) == (0, "kneed_walker")


@pytest.mark.parametrize("text", ["walker = {}()\n", "def problem():\n    return {}()\n"])
def test_show_prints_the_robot_of_a_script_without_a_problem(command, script, text):
    for module, robot, coordinates in (
        ("gaitopt", "compass_biped", ["x", "y", "th1", "th2"]),
        ("gaitopt.model", "vertical_hopper", ["body", "foot"]),
    ):
        path = script(f"from {module} import {robot}\n\n{text.format(robot)}")
        shown = command("show", path)
        assert (shown.status, shown.out.splitlines()[0]) == (0, f"Robot {robot}"), shown.err
        assert "M(q) dv/dt + h(q, v) =" in shown.out
        data = command("show", path, "--json").json
        assert (data["robot"], data["coordinates"]) == (robot, coordinates)
        assert data["parameters"]["gravity"] > 9
        assert command("show", path, "--set", "gravity=1").status == 2


ROBUST = """
from gaitopt import Family, GaitProblem, Limits, Scenarios, compass_biped
from gaitopt.design import RobustProblem


def problem(low=0.15, family=False):
    gait = GaitProblem(robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=0.6,
                       limits=Limits(torque=6), free={"hip_mass": (1, 3)} if family else {})
    if family:
        return Family([gait, gait.replace(speed=0.7, limits=Limits())], worst_case=True, name="speeds")
    return RobustProblem(gait, Scenarios(ranges={"friction": (low, 0.25)}, push=0.05), law="lqr")
"""


def test_show_states_a_robust_problem_with_its_scenarios(command, script):
    shown = command("show", script(ROBUST), "--set", "low=0.1")
    assert shown.status == 0, shown.err
    for text in (
        "Robust gait of compass_biped",
        "μ = 0.2",
        "the law lqr",
        "0.1 ≤ friction ≤ 0.25, 5 values",
        "|δ| ≤ 0.05 rad/s, 2 pushes",
        "15 candidate scenarios",
        "minimise",
    ):
        assert text in shown.out
    data = command("show", "own.py", "--json").json
    assert (data["kind"], data["law"], data["scenarios"]["candidates"]) == ("robust problem", "lqr", 15)
    assert (data["scenarios"]["ranges"], data["nominal"]["friction"]) == ({"friction": [0.15, 0.25]}, 0.2)


def test_show_states_a_family_with_what_its_gaits_share_and_how_they_differ(command, script):
    shown = command("show", script(ROBUST), "--set", "family=True")
    assert shown.status == 0, shown.err
    lines = [line.strip() for line in shown.out.splitlines()]
    assert lines[0] == "Family 'speeds' of 2 gaits of compass_biped"
    assert lines[1].endswith("max(0.5 J1, 0.5 J2)")
    assert lines[2].endswith("1 ≤ hip_mass ≤ 3 kg")
    assert lines[-3].endswith("stick | stick, otherwise as gait 1, without limits, with")
    assert lines[-1].endswith("speed L/T = 0.7 m/s")
    data = command("show", "own.py", "--set", "family=True", "--json").json
    assert (data["kind"], data["worst_case"], data["weights"]) == ("family", True, [0.5, 0.5])
    assert [gait["speed"] for gait in data["gaits"]] == [0.6, 0.7]


def test_show_rejects_settings_of_a_file(command, slip_file):
    run = command("show", slip_file, "--set", "friction=0.2")
    assert run.status == 2
    assert "is not a script ending in .py" in run.err


def test_verify_does_not_change_the_file(command, slip_file, folder):
    copy = folder / "gait.h5"
    shutil.copy(slip_file, copy)
    before = copy.read_bytes()
    assert command("verify", copy).status == 0
    assert copy.read_bytes() == before


def test_verify_refutes_a_gait_with_other_torques(command, slip_file, folder):
    copy = folder / "gait.h5"
    shutil.copy(slip_file, copy)
    with edit_hdf5(copy) as file:
        file["motion/segments/0001/torque"][1] *= 1.01
    run = command("verify", copy, "--json")
    assert run.status == 1
    assert run.json["status"] == "not_verified"
    assert run.json["verification"]["passed"] is False
    assert run.json["verification"]["reasons"]
    table = command("verify", copy)
    assert table.status == 1
    assert "failed" in table.out


def test_a_robot_from_a_script(command, script, slip_file, root):
    assert command("verify", slip_file, "--problem", root / "problems/compass_slip.py").status == 0


def test_an_old_file_of_an_unknown_robot_needs_its_script(command, folder, write_old_file):
    write_old_file(folder / "gait.h5", "my_robot")
    run = command("verify", "gait.h5")
    assert run.status == 2
    assert "my_robot" in run.err
    assert "--problem SCRIPT.py" in run.err


@pytest.mark.parametrize("verb", ["verify", "stability", "simulate", "tune", "push", "export"])
def test_a_script_with_another_robot_is_refused(command, root, slip_file, verb):
    more = ("-o", "controller.c") if verb == "export" else ()
    run = command(verb, slip_file, "--problem", root / "problems/five_link.py", *more)
    assert run.status == 2
    assert "The robot 'five_link' is not the robot 'compass_biped' of the gait. It differs in:" in run.err


def test_problems_lists_scripts_with_descriptions_and_parameters(command, root):
    run = command("problems", root / "problems", "--json")
    assert run.status == 0
    listed = {entry["script"].rsplit("/")[-1]: entry for entry in run.json["problems"]}
    assert set(listed) >= {"compass_slip.py", "compass_stick.py"}
    slip, stick = listed["compass_slip.py"], listed["compass_stick.py"]
    assert slip["description"] == "Energy-optimal compass-biped gait whose touchdown slips forward."
    # names and defaults promised to users
    assert slip["parameters"] == {
        "leg_length": 1.6,
        "leg_com": 0.8,
        "leg_mass": 4.0,
        "hip_mass": 2.0,
        "gravity": 9.8,
        "slope": 0.0,
        "friction": 0.14,
        "speed": 0.633,
        "step_length": 0.4713,
        "torque_limit": 6.0,
        "objective": "cost_of_transport",
        "intervals": 40,
        "sequence": "slip+ stick | slip+",
        "transcription": "collocation",
    }
    assert stick["parameters"] == {**slip["parameters"], "sequence": "stick | stick"}


def test_problems_in_the_present_folder(command, folder, root):
    (folder / "problems").symlink_to(root / "problems")
    run = command("problems")
    assert run.status == 0
    assert "compass_slip.py" in run.out
    assert "friction=0.14" in run.out


def test_problems_without_a_folder_are_the_installed_ones(command, folder):
    run = command("problems")
    assert run.status == 0
    assert "compass_slip.py" in run.out
    assert "to copy one: gaitopt new NAME --from SCRIPT" in run.out
    assert any(Path(entry["script"]).is_file() for entry in command("problems", "--json").json["problems"])


def test_problems_of_a_folder_that_does_not_exist(command, folder):
    run = command("problems", "problems")
    assert run.status == 2
    assert run.err.startswith("Error: There is no folder problems")


def test_a_module_that_defines_no_problem_is_not_run_for_the_list(command, folder):
    (folder / "analysis.py").write_text("from pathlib import Path\nPath('touched').touch()\n")
    (folder / "bound.py").write_text("problem = None\n")
    entries = command("problems", ".", "--json").json["problems"]
    assert [entry["script"] for entry in entries] == ["bound.py"]
    assert not (folder / "touched").exists()


def test_a_broken_script_does_not_hide_the_others(command, script, folder):
    script('"""Speed in [m/s] and [/nothing]."""\n\n\ndef problem(names=("[a]", 1)):\n    pass\n', "good.py")
    script("import nosuchmodule\n\n\ndef problem():\n    pass\n", "broken.py")
    (folder / "binary.py").write_bytes(b"\xff\xfe\x00")
    (folder / "latin.py").write_bytes('# coding: latin-1\n"""Fünf."""\ndef problem(a=1): pass\n'.encode("latin-1"))
    entries = {entry["script"]: entry for entry in command("problems", ".", "--json").json["problems"]}
    assert "ModuleNotFoundError" in entries["broken.py"]["error"]
    assert "error" in entries["binary.py"]
    assert entries["latin.py"]["description"] == "Fünf."
    table = command("problems", ".")
    assert table.status == 0
    assert "Speed in [m/s] and [/nothing]." in table.out
    assert "'[a]'" in table.out


@pytest.mark.parametrize("flag", ["--help", "--version"])
def test_help_and_version(process, flag):
    run = process(flag)
    assert run.status == 0
    assert run.err == ""
    assert run.out.strip()


@pytest.mark.parametrize("verb", ["solve", "show", "verify", "plot", "animate", "problems"])
def test_every_command_helps_with_an_example(command, verb):
    run = command(verb, "--help")
    assert run.status == 0
    assert f"Example: gaitopt {verb}" in run.out


def test_paragraphs_of_help_are_wrapped_to_the_terminal_only(command, monkeypatch):
    monkeypatch.setenv("COLUMNS", "80")
    described = command("push", "--help").out.partition("Options")[0]
    paragraphs = [part.splitlines() for part in re.split(r"\n\s*\n", described.strip())]
    broken = [
        line
        for lines in paragraphs
        for line, following in itertools.pairwise(lines)
        if len(f"{line.rstrip()} {following.split()[0]}") < 79
    ]
    assert len(paragraphs) > 4
    assert not broken


def test_json_is_one_object_and_nothing_else(command, slip_file):
    assert isinstance(json.loads(command("show", slip_file, "--json").out), dict)


@pytest.mark.parametrize("arguments", [("verify",), ("report",), ("stability",), ("push",)])
def test_a_file_of_gains_is_named_with_the_commands_that_check_it(command, folder, arguments):
    gains = folder / "gains.json"
    gains.write_text('{"format": "gaitopt tuned gains", "format_version": 1}', encoding="utf-8")
    run = command(*arguments, gains)
    text = " ".join(run.err.split())
    assert run.status == 2
    assert "gains.json contains tuned gains, not a gait" in text
    assert "gaitopt push GAIT.h5 --law " in text
    assert "damaged" not in text
    gains.write_text('{"format": "a poem"}', encoding="utf-8")
    assert "damaged or of another kind" in " ".join(command("verify", gains).err.split())


def test_a_push_test_is_named(command, folder):
    path = folder / "push.json"
    path.write_text('{"format": "gaitopt push test", "format_version": 1}', encoding="utf-8")
    assert "push.json contains a push test, not a gait" in " ".join(command("verify", path).err.split())
