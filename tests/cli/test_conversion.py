"""Start of a command: no import of the validation library of Typer."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
import typer
from typer.testing import CliRunner

from gaitopt.cli.command import Command

PROBLEMS = Path(__file__).parents[2] / "problems"
COMMAND = """
import sys
from gaitopt.cli.app import main
try:
    main([*sys.argv[1:], "--set", "friction=nothing"])
finally:
    print(*sys.modules)
"""


@pytest.fixture
def received():
    """Return a function that runs a command on some words and returns the values it receives, or its exit status."""
    app, values = typer.Typer(), []

    @app.command(cls=Command)
    def command(file: Path, other: Path | None = None, text: list[str] | None = None, number: int = 3):
        values.append((file, other, text, number))

    def run(*words):
        result = CliRunner().invoke(app, list(words))
        return values.pop() if result.exit_code == 0 else result.exit_code

    return run


@pytest.mark.parametrize(
    ("command", "script", "refused"),
    [
        ("solve", "compass_slip.py", {"pydantic", "gaitopt.ocp.multicontact.planar_problem"}),
        ("stability", "compass_passive.py", {"pydantic"}),
    ],
)
def test_a_command_imports_neither_the_validation_library_nor_problems_of_other_robots(command, script, refused):
    words = [sys.executable, "-c", COMMAND, command, PROBLEMS / script]
    run = subprocess.run(words, capture_output=True, text=True, check=False)
    assert run.returncode == 2
    assert "friction" in run.stderr
    assert not refused & {*run.stdout.splitlines()[-1].split()}


def test_texts_and_paths_are_converted(received):
    assert received("a.h5") == (Path("a.h5"), None, None, 3)
    words = ("a.h5", "--other", "b.h5", "--text", "x=1", "--text", "y=2")
    assert received(*words) == (Path("a.h5"), Path("b.h5"), ["x=1", "y=2"], 3)


def test_other_values_are_validated_by_typer(received):
    assert received("a.h5", "--number", "5") == (Path("a.h5"), None, None, 5)
    assert received("a.h5", "--number", "five") == 2
    assert received() == 2


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("plot", "a.h5", "--width", "nan"), "'--width': must be a number from 2.5 to 20, got 'nan'."),
        (("plot", "a.h5", "--width", "0"), "'--width': must be a number from 2.5 to 20, got '0'."),
        (("compare", "a.h5", "b.h5", "--width", "wide"), "'--width': must be a number from 2.5 to 20, got 'wide'."),
        (("simulate", "a.h5", "--width=-inf"), "'--width': must be a number from 2.5 to 20, got '-inf'."),
        (("trace", "a.h5", "--over", "slope=0:1", "--points", "1"), "must be a whole number of at least 2, got '1'."),
        (("sweep", "a.py", "--starts", "0"), "'--starts': must be a whole number from 1 to 100, got '0'."),
        (("sweep", "a.py", "--starts", "2.5"), "'--starts': must be a whole number from 1 to 100, got '2.5'."),
    ],
)
def test_an_invalid_number_is_named_with_the_valid_ones(command, words, message):
    result = command(*words)
    assert result.status == 2
    assert message in " ".join(result.err.split())


def test_an_unreadable_file_is_refused(received, tmp_path, monkeypatch):
    file = tmp_path / "a.h5"
    file.touch()
    assert received(str(file))[0] == file
    monkeypatch.setattr("os.access", lambda path, mode: mode == os.F_OK)
    assert received(str(file)) == 2
