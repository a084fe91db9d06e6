"""Commands of the pages that run elsewhere with a check of their results, or with fewer points than on the page."""

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

ONE_PROCESS = ("--workers", "1")

REDUCED = {
    "gaitopt pareto problems/compass_slip.py": ("--points", "2", *ONE_PROCESS),
    "gaitopt push compass_robust/compass_robust.h5": ("--starts", "3", "--steps", "20", *ONE_PROCESS),
    "gaitopt sweep problems/compass_slip.py --over friction=0.16:0.18:2": ("--set", "intervals=20", *ONE_PROCESS),
    "gaitopt trace problems/compass_passive.py --set leg_mass=5": ("--doublings", "2"),
    "gaitopt trace problems/compass_optima.py --over friction": ("--points", "10"),
}
"""Options that replace those of a page when its command runs as a test, by the beginning of the command.

Such a test checks that the command succeeds; tests of the command check its results.
"""


def read_arguments(line):
    """Return the program and its arguments in a line of a page, with the options of `REDUCED` added."""
    options = [words for command, words in REDUCED.items() if line.startswith(command)]
    return [*shlex.split(line, comments=True), *(word for words in options for word in words)]


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
