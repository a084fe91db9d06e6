"""Commands of the pages that a test runs with a check of their results, so that they do not run twice."""

import shlex
from pathlib import Path

PAGES = Path(__file__).parents[2] / "docs"

CHECKED = {
    "gaitopt trace problems/simplest_walker.py": "howto/branches.md",  # tests/cli/test_trace_command.py
}
"""Beginning of each command, and its page."""


def is_checked(line):
    """Return whether a test runs a line of a page and checks its results."""
    return any(line.startswith(f"{command} ") for command in CHECKED)


def read_command(command):
    """Return the words after ``gaitopt`` of the one command of its page with this beginning."""
    lines = (PAGES / CHECKED[command]).read_text(encoding="utf-8").splitlines()
    (line,) = [line for line in lines if line.startswith(f"{command} ")]
    return shlex.split(line)[1:]
