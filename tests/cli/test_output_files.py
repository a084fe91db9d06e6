"""Output files are checked before the work of a command begins."""

import pytest

from gaitopt.cli import output_files
from gaitopt.cli.output_files import ACCEPTED
from gaitopt.plot import animation, saving

SCRIPT = """\
from pathlib import Path


def work():
    Path("begun").touch()


study = problem = work
"""
OPTIONS = {"sweep": ("--over", "friction=1:2:2"), "trace": ("--over", "friction=1:2"), "basin": ("--over", "a=1:2:2")}
OF_SCRIPTS = ("run", "sweep", "pareto", "trace", "basin", "simulate", "push", "tune")


@pytest.fixture
def work(script):
    """Return a script that leaves a file if its functions are called."""
    return script(SCRIPT)


@pytest.mark.parametrize("verb", OF_SCRIPTS)
@pytest.mark.parametrize(
    ("name", "refusal"),
    [
        ("study", "the file name has no suffix"),
        ("study.xyz", "the suffix '.xyz' is not that of a known format"),
        ("missing/study{}", "does not exist"),
        ("folder{}", "it is a folder"),
    ],
)
def test_an_output_is_refused_before_the_work(command, work, folder, verb, name, refusal):
    name = name.format(next(iter(ACCEPTED[verb])))
    if refusal == "it is a folder":
        (folder / name).mkdir()
    before = sorted(folder.iterdir())
    run = command(verb, work, *OPTIONS.get(verb, ()), "-o", name)
    assert run.status == 2
    assert f"Cannot write {name}" in run.err
    assert refusal in run.err
    assert sorted(folder.iterdir()) == before


def test_the_figure_of_a_front_is_refused_before_the_work(command, work, folder):
    run = command("pareto", work, "-o", "front.nc", "--figure", "front")
    assert (run.status, "front: the file name has no suffix" in run.err) == (2, True)
    assert not (folder / "begun").exists()


@pytest.mark.parametrize("verb", ["plot", "animate", "report", "export", "compare"])
def test_an_output_of_gaits_is_refused_before_they_are_read(command, folder, verb):
    (folder / "gait.h5").touch()
    run = command(verb, "gait.h5", "-o", "result")
    assert (run.status, "result: the file name has no suffix" in run.err) == (2, True)


def test_every_accepted_figure_and_animation_is_one_of_the_writers():
    assert (output_files.FIGURES, output_files.ANIMATIONS) == (saving._KINDS, animation._KINDS)


def test_every_command_with_an_output_file_states_its_suffixes():
    import typer

    from gaitopt.cli.app import app

    commands = typer.main.get_command(app).commands
    verbs = {name for name, each in commands.items() if any(each.name == "output" for each in each.params)}
    assert verbs - set(ACCEPTED) == {"solve", "design", "search"}  # a gait file, and folders
