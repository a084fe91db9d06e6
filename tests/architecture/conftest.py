"""Syntax trees of the package, shared by the tests of a module."""

import ast
from pathlib import Path

import pytest


@pytest.fixture(scope="module")
def trees():
    """Return the syntax tree of every file; kept for one module only, since they are a million objects."""
    package = Path(__file__).parents[2] / "gaitopt"
    return {path: ast.parse(path.read_text()) for path in sorted(package.rglob("*.py"))}
