"""Commands take the robot from the gait file; a script whose robot has other physics is refused."""

import re
import shutil

import pytest

from gaitopt import load, save, solve, verify
from gaitopt.cli.script import load_script
from tests.conftest import ROOT

SCRIPT = ROOT / "problems" / "five_link.py"


@pytest.fixture(scope="module")
def solved(tmp_path_factory):
    """A gait of the five-link walker, which is not in the catalogue."""
    return save(verify(solve(load_script(SCRIPT)())), tmp_path_factory.mktemp("solved") / "five_link.h5")


@pytest.fixture
def gait_file(solved, folder):
    return shutil.copy(solved, folder / "five_link.h5")


@pytest.fixture
def edited(folder):
    """The script with another expression for the mass of a shank."""
    text, count = re.subn(
        r"rod\(shank_mass, c\.foot", "rod(1.01 * shank_mass, c.foot", SCRIPT.read_text(encoding="utf-8")
    )
    assert count == 1
    path = folder / "edited.py"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments",
    [
        ("show",),
        ("verify",),
        ("plot", "-o", "figure.png"),
        ("export", "-o", "controller.c", "--law", "joint_pd"),
        ("export", "-o", "torques.json"),
        ("compare", "--multipliers"),
        ("report", "-o", "page.html"),
    ],
    ids=lambda arguments: arguments[0],
)
def test_no_script_is_needed(command, gait_file, arguments):
    verb, *more = arguments
    run = command(verb, gait_file, *more)
    assert run.status == 0, run.err
    if verb == "report":
        assert "Not assessed" not in (gait_file.parent / "page.html").read_text(encoding="utf-8")


@pytest.mark.slow
def test_another_process_needs_no_script(process, gait_file):
    run = process("verify", gait_file, "--json")
    assert run.status == 0, run.err
    assert run.json["robot"] == "five_link"
    assert run.json["verification"]["passed"] is True


@pytest.mark.parametrize("verb", ["verify", "stability", "simulate", "tune", "push", "export", "compare", "report"])
def test_an_edited_robot_is_refused_and_what_differs_is_named(command, gait_file, edited, verb):
    more = {"export": ("-o", "controller.c"), "compare": ("--multipliers",)}.get(verb, ())
    run = command(verb, gait_file, "--problem", edited, *more)
    assert run.status == 2
    told = " ".join(run.err.split())
    assert "The robot 'five_link' is not the robot 'five_link' of the gait. It differs in: total mass (by 0." in told
    assert "mass matrix (by" in told
    assert "solve the problem again with this one" in told


def test_the_script_itself_is_accepted(command, gait_file):
    run = command("verify", gait_file, "--problem", SCRIPT)
    assert run.status == 0, run.err


def test_other_defaults_are_the_same_robot(command, gait_file, folder):
    """The parameters of a gait are in its file."""
    path = folder / "defaults.py"
    text = SCRIPT.read_text(encoding="utf-8")
    assert '("shank_mass", 3.2,' in text
    path.write_text(text.replace('("shank_mass", 3.2,', '("shank_mass", 3.0,'), encoding="utf-8")
    assert command("verify", gait_file, "--problem", path).status == 0
    assert load(gait_file).motion.parameters["shank_mass"] == 3.2
