"""What a new user meets first: help, completion, gaitopt new, gaitopt doctor."""

import ast
import os
import re
import shlex
import subprocess
import sys
from importlib import metadata

import pytest
import typer

from gaitopt.cli import setup
from gaitopt.cli.app import app
from gaitopt.cli.installed_scripts import SCRIPT_OF_ROBOT, find_robot_definition, read_scripts
from gaitopt.cli.script import call_script
from gaitopt.model import robot_named
from gaitopt.model.physics import find_differences, physics_of
from gaitopt.model.robots.catalogue import CATALOGUE
from gaitopt.model.robots.planar_catalogue import PLANAR_CATALOGUE

COMMANDS = typer.main.get_command(app).commands


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_an_example_that_it_understands(name):
    command = COMMANDS[name]
    example = re.search(rf"Example: gaitopt {name}\b(.*)", command.help)
    assert example, f"the help of {name} shows no example"
    command.make_context(name, shlex.split(example.group(1)))  # raises where it does not understand


@pytest.mark.parametrize("name", COMMANDS)
def test_every_option_says_what_it_does(name):
    for parameter in COMMANDS[name].params:
        assert parameter.help, f"{name} {parameter.name}"


def test_exit_statuses_stand_in_the_help(command):
    assert "Exit status: 0 success, 1 no gait found or a failed check" in " ".join(command("--help").out.split())


def test_completion(folder):
    environment = {"_GAITOPT_COMPLETE": "complete_bash", "COMP_WORDS": "gaitopt so", "COMP_CWORD": "1"}
    code = "from gaitopt.cli.app import app; app(prog_name='gaitopt')"
    done = subprocess.run(
        [sys.executable, "-c", code], env={**os.environ, **environment}, capture_output=True, text=True, check=False
    )
    assert done.stdout.split() == ["solve"]


@pytest.mark.slow
def test_a_new_script_is_solved_as_it_is(command, folder):
    assert command("new", "my_walker").out == "wrote my_walker.py\nnext: gaitopt solve my_walker.py\n"
    plain = command("solve", "my_walker.py", "--json")
    assert plain.status == 0
    assert plain.json["cost_of_transport"] == pytest.approx(0.01586, abs=1e-5)  # weight 0: the cost of transport alone
    shooting = command("solve", "my_walker.py", "--set", "transcription=multiple_shooting", "--json")
    assert shooting.json["cost_of_transport"] == pytest.approx(plain.json["cost_of_transport"], rel=1e-3)
    priced = command("solve", "my_walker.py", "--set", "torque_weight=0.01", "--json")
    assert priced.json["problem"]["objective"] == "work_and_torque"
    assert priced.json["cost_of_transport"] > plain.json["cost_of_transport"]


def test_a_script_is_not_overwritten(command, script):
    path = script("mine", "mine.py")
    for name in ("mine", "mine.py"):
        run = command("new", name)
        assert run.status == 2
        assert "already exists" in run.err
    assert path.read_text() == "mine"


@pytest.mark.parametrize("name", ["", "..", ".py"])
def test_a_script_needs_a_name(command, folder, name):
    run = command("new", name)
    assert run.status == 2
    assert "The name of a script must not be empty or begin with a dot" in run.err
    assert not list(folder.iterdir())


def test_a_script_in_a_folder_that_is_not_there(command):
    run = command("new", "nowhere/mine")
    assert run.status == 2
    assert "Cannot write nowhere/mine.py" in run.err


def test_an_installed_script_is_copied_with_what_it_imports(command, folder, root):
    run = command("new", "walkers/mine", "--from", "compass_stick")
    assert run.status == 2
    (folder / "walkers").mkdir()
    assert command("new", "walkers/mine", "--from", "compass_stick").status == 0
    copies = {path.name: path.read_text() for path in (folder / "walkers").iterdir()}
    assert set(copies) == {"mine.py", "compass_slip.py"}
    assert copies["compass_slip.py"] == (root / "problems/compass_slip.py").read_text()
    assert "gaitopt solve walkers/mine.py" in copies["mine.py"]
    assert command("new", "walkers/other.py", "--from", "compass_slip.py", "--json").json == {
        "file": "walkers/other.py"
    }
    assert command("problems", "walkers").status == 0


@pytest.mark.parametrize("name", [*CATALOGUE, *PLANAR_CATALOGUE])
def test_every_robot_of_the_catalogue_has_a_script_to_start_from(command, folder, name):
    assert set(SCRIPT_OF_ROBOT) == {*CATALOGUE, *PLANAR_CATALOGUE}
    assert command("new", "mine", "--robot", name).status == 0
    robot = call_script(folder / "mine.py", []).robot
    assert robot is not robot_named(name)  # the script defines it
    assert find_differences(physics_of(robot), robot_named(name)) == ()


def test_an_unknown_robot_and_two_sources_are_refused(command, folder):
    assert "Did you mean 'monopod'?" in command("new", "mine", "--robot", "monopods").err
    run = command("new", "mine", "--robot", "monopod", "--from", "hopper")
    assert (run.status, list(folder.iterdir())) == (2, [])
    assert "--robot monopod and --from hopper exclude each other" in run.err


def test_a_script_without_a_name_has_that_of_its_robot_or_source(command, folder):
    run = command("new", "--robot", "hopper")
    assert run.status == 2
    assert "Did you mean 'vertical_hopper'?" in run.err
    assert command("new", "--robot", "vertical_hopper", "--json").json == {"file": "vertical_hopper.py"}
    assert command("new", "--from", "hopper.py", "--json").json == {"file": "hopper.py"}
    run = command("new")
    assert run.status == 2
    assert "The name of the script is missing" in run.err


def test_a_copy_overwrites_nothing(command, folder, root):
    (folder / "compass_slip.py").write_text("mine")
    for name, source in (("compass_slip", "compass_slip"), ("new", "compass_stick"), ("compass_slip", "compass_stick")):
        assert command("new", name, "--from", source).status == 2
    assert [path.name for path in folder.iterdir()] == ["compass_slip.py"]
    assert (folder / "compass_slip.py").read_text() == "mine"
    run = command("new", "mine", "--from", "compas_slip")
    assert run.status == 2
    assert "Did you mean 'compass_slip'?" in run.err


def test_an_open_sequence_shows_its_homotopy(command, root):
    settings = ("--set", "sequence=slip+ stick | any", "--set", "intervals=10")
    run = command("solve", root / "problems/compass_slip.py", *settings)
    head, *lines = run.err.split("\n\n")[0].strip().splitlines()
    assert head.split() == ["step", "relaxation", "cost_of_transport", "complementarity", "iterations", "status"]
    assert [line.split()[0] for line in lines] == [str(i + 1) for i in range(len(lines))]
    assert lines[-1].split()[-1] == "solved"
    assert float(lines[-1].split()[3]) < 1e-6
    assert "contact sequence found" in run.out
    assert "from 'slip+ stick | any' (exact penalty, " in run.out
    quiet = command("solve", root / "problems/compass_slip.py", *settings, "--json")
    assert quiet.err == ""
    assert quiet.json["proposal"]["sequence"] == "slip+ stick | any"


def test_verbose_writes_iterations_to_standard_error(command, root):
    run = command("solve", root / "problems/compass_slip.py", "--verbose", "--json")
    assert run.status == 0
    assert run.json["status"] == "solved"
    assert "iteration   0   cost_of_transport" in run.err


def test_a_healthy_installation(command):
    run = command("doctor")
    assert run.status == 0
    assert run.out.count("works:") == 4
    facts = command("doctor", "--json").json
    assert facts["well"] is True
    assert facts["versions"]["casadi"]


def test_a_broken_solver_is_told(command, monkeypatch):
    def broken():
        raise RuntimeError("no such plugin")

    monkeypatch.setitem(setup.CHECKS, "solver", broken)
    run = command("doctor")
    assert run.status == 1
    assert "fails: RuntimeError: no such plugin" in run.out


def test_extras_are_told_by_what_they_ask_for(command, monkeypatch):
    asked = ["numpy>=1", "casadi>=3; extra == 'one'", "no-such-thing>=1; extra == 'two'", "numpy; extra == 'two'"]
    monkeypatch.setattr(metadata, "requires", lambda name: asked)
    assert command("doctor", "--json").json["extras"] == {"one": True, "two": False}
    assert "not installed: pip install 'gaitopt[two]'" in command("doctor").out


def test_doctor_reports_packages_that_are_too_old_and_what_extras_are_for(command, monkeypatch):
    asked = ["casadi>=999.1", "numpy >= 1.0", "no-such-thing>=1; extra == 'import'"]
    monkeypatch.setattr(metadata, "requires", lambda name: asked)
    run = command("doctor")
    assert run.status == 1
    assert "accepted: 999.1 or newer" in run.out
    assert "numpy 2" not in run.out.partition("versions")[2]
    assert "for robots from URDF and MJCF files" in run.out


def test_doctor_reports_an_extra_that_installs_nothing_on_this_system(command, monkeypatch):
    asked = ["no-such-thing>=7; (platform_system == 'Plan9') and extra == 'fast'"]
    monkeypatch.setattr(metadata, "requires", lambda name: asked)
    monkeypatch.setattr(setup.platform, "system", lambda: "Darwin")
    reason = "not available: no-such-thing is for Plan9 only, not for Darwin"
    assert command("doctor", "--json").json["unavailable_extras"] == {"fast": reason}
    assert reason in command("doctor").out
    monkeypatch.setattr(setup.platform, "system", lambda: "Plan9")
    assert command("doctor", "--json").json["unavailable_extras"] == {}


def test_a_script_of_a_robot_contains_its_bodies_and_contacts(command, folder):
    wrote, defined = command("new", "mine", "--robot", "flat_foot_walker").out.splitlines()
    assert wrote == "wrote mine.py"
    assert defined == "flat_foot_walker is defined in mine.py: change its bodies, contacts and actuators there"
    path = folder / "mine.py"
    text = path.read_text(encoding="utf-8")
    for part in ('Parameter("heel_length"', "RigidLink(", "PointContact(", "actuators={", "mirror={"):
        assert text.count(part) >= 1, part
    path.write_text(text.replace('Parameter("heel_length", 0.06', 'Parameter("heel_length", 0.09'), encoding="utf-8")
    assert call_script(path, []).values["heel_length"] == 0.09


def test_a_wrong_leg_exchange_of_a_changed_robot_is_found_before_a_solve(command, folder):
    """The robots of the catalogue are exempt from this check; without it, the error is found after the solve."""
    assert command("new", "mine", "--robot", "compass_biped").status == 0
    path = folder / "mine.py"
    text = path.read_text(encoding="utf-8")
    path.write_text(text.replace("exchange=[-th2, -th1]", "exchange=[-th2, -0.9 * th1]"), encoding="utf-8")
    run = command("solve", path)
    assert run.status == 2
    assert "the leg exchange changes the angular momentum by 3.14 %" in " ".join(run.err.split())


@pytest.mark.parametrize("name", SCRIPT_OF_ROBOT)
def test_a_definition_hides_no_name_of_its_script(name):
    script, definition = (
        {target for node in ast.parse(text).body for target in names_of(node)}
        for text in (
            next(iter(read_scripts(SCRIPT_OF_ROBOT[name]).values())),
            find_robot_definition(name).read_text(encoding="utf-8"),
        )
    )
    assert name in definition
    assert script & definition == set()


def names_of(node):
    """Return the names that a statement at the top level of a file defines."""
    if isinstance(node, ast.FunctionDef | ast.ClassDef):
        return [node.name]
    return [target.id for target in node.targets] if isinstance(node, ast.Assign) else []
