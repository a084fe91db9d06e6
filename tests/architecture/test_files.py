"""Files stay small, have honest names, and only the command line prints."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FILES = sorted((ROOT / "gaitopt").rglob("*.py"))
VAGUE = {"utils", "util", "helpers", "helper", "common", "misc", "tools", "stuff"}


def calls(tree, name):
    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == name
    ]


@pytest.mark.slow
def test_files_stay_small_enough_to_read():
    assert [path for path in FILES if len(path.read_text().splitlines()) > 400] == []


@pytest.mark.slow
def test_only_the_command_line_prints(trees):
    quiet = [path for path in FILES if "cli" not in path.relative_to(ROOT).parts]
    assert [(path, lines) for path in quiet if (lines := calls(trees[path], "print"))] == []


@pytest.mark.slow
def test_nothing_is_asserted_without_a_sentence(trees):
    """Python leaves asserts out with -O, and their messages help no user."""
    asserts = [(path, node.lineno) for path in FILES for node in ast.walk(trees[path]) if isinstance(node, ast.Assert)]
    assert asserts == []


@pytest.mark.slow
def test_every_file_says_what_it_holds(trees):
    assert [path for path in FILES if not ast.get_docstring(trees[path])] == []


def test_no_file_has_a_name_that_says_nothing():
    every = [*FILES, *(ROOT / "tests").rglob("*.py"), *(ROOT / "problems").rglob("*.py")]
    assert not [path for path in every if VAGUE & {path.stem, path.parent.name}]


def test_costly_test_files_exist():
    from conftest import COSTLY

    assert [name for name in COSTLY if not (ROOT / name).is_file()] == []
