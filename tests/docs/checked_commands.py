"""Commands of the pages that a test runs with a check of their results, so that they do not run twice."""

import contextlib
import shlex
from pathlib import Path

import pytest

from gaitopt import load_diagram

PAGES = Path(__file__).parents[2] / "docs"

CHECKED = {
    "gaitopt trace problems/compass_passive.py --over friction": "howto/branches.md",
    "gaitopt trace problems/simplest_walker.py": "howto/branches.md",
}
"""Beginning of each command, and its page; see tests/continuation/test_trace.py and tests/cli/test_trace_command.py."""


def is_checked(line):
    """Return whether a test runs a line of a page and checks its results."""
    return any(line.startswith(command) for command in CHECKED)


def read_command(command):
    """Return the words after ``gaitopt`` of the one command of its page with this beginning."""
    lines = (PAGES / CHECKED[command]).read_text(encoding="utf-8").splitlines()
    (line,) = [line for line in lines if line.startswith(command)]
    return shlex.split(line)[1:]


def run_trace(command, folder):
    """Run the command in a folder that sees the problems, with a dataset as its output, and return the dataset."""
    from gaitopt.cli.app import main

    (folder / "problems").symlink_to(PAGES.parent / "problems")
    with contextlib.chdir(folder), pytest.raises(SystemExit) as stop:
        main([*read_command(command), "-o", "diagram.nc"])
    assert stop.value.code == 0
    return load_diagram(folder / "diagram.nc")
