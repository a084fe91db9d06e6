"""Syntax trees of the package, shared by all tests of one process."""

import ast
import functools
import gc
from pathlib import Path

import pytest

parse = functools.cache(ast.parse)
"""Return the syntax tree of a text; all files are parsed once in a process."""


@pytest.fixture(scope="session")
def trees():
    """Return the syntax tree of every file; they are left out of searches for unreachable objects: a million."""
    package = Path(__file__).parents[2] / "gaitopt"
    trees = {path: parse(path.read_text()) for path in sorted(package.rglob("*.py"))}
    gc.freeze()
    return trees
