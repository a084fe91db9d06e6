"""Files stay small, have honest names, and only the command line prints."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FILES = sorted((ROOT / "gaitopt").rglob("*.py"))
VAGUE = {"utils", "util", "helpers", "helper", "common", "misc", "tools", "stuff"}

every_file = pytest.mark.parametrize("path", FILES, ids=lambda path: str(path.relative_to(ROOT)))


def calls(tree, name):
    return [
        node.lineno
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name) and node.func.id == name
    ]


@every_file
def test_files_stay_small_enough_to_read(path):
    assert len(path.read_text().splitlines()) <= 400


@every_file
def test_only_the_command_line_prints(path):
    if "cli" not in path.relative_to(ROOT).parts:
        assert not calls(ast.parse(path.read_text()), "print")


@every_file
def test_nothing_is_asserted_without_a_sentence(path):
    """Python leaves asserts out with -O, and they tell a user nothing."""
    assert not [node.lineno for node in ast.walk(ast.parse(path.read_text())) if isinstance(node, ast.Assert)]


@every_file
def test_every_file_says_what_it_holds(path):
    assert ast.get_docstring(ast.parse(path.read_text()))


def test_no_file_has_a_name_that_says_nothing():
    every = [*FILES, *(ROOT / "tests").rglob("*.py"), *(ROOT / "problems").rglob("*.py")]
    assert not [path for path in every if VAGUE & {path.stem, path.parent.name}]


def test_costly_test_files_exist():
    from conftest import COSTLY

    assert [name for name in COSTLY if not (ROOT / name).is_file()] == []
