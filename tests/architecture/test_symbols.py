"""Symbols live where equations are stated and compiled; everything else calls named Functions with numbers."""

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[2] / "gaitopt"

SYMBOLIC = {
    "model",  # the equations of motion, contacts and impact
    "ocp",  # the NLP: its unknowns, data and multipliers, and the derivatives of an objective
    "control",  # laws as functions of clock, state, latched values and data
    "simulation",  # compiles the closed loop of a robot and a law, and expands it for the Taylor engine
    "stability",  # the section as a map of its coordinates, and derivatives of flow and reset
    "tuning",  # the linear-quadratic weights of a step
    "cli/setup.py",  # the check of an installation solves min x^2
}


def symbols_of(source):
    """Return the lines that make a CasADi symbol: `SX.sym` or `MX.sym`, by any name of the module."""
    return [
        node.lineno
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.Attribute)
        and node.attr == "sym"
        and ast.unparse(node.value).rpartition(".")[2] in {"SX", "MX"}
    ]


def place_of(path):
    """Return the wing of a file, or the file itself if it is listed."""
    name = path.relative_to(PACKAGE).as_posix()
    return name if name in SYMBOLIC else name.partition("/")[0]


FILES = {path: symbols_of(path.read_text()) for path in sorted(PACKAGE.rglob("*.py"))}


def test_symbols_live_where_equations_are_stated():
    assert len(FILES) > 200
    astray = {
        path.relative_to(PACKAGE): lines for path, lines in FILES.items() if lines and place_of(path) not in SYMBOLIC
    }
    assert not astray, astray


def test_every_listed_place_makes_symbols():
    assert {place_of(path) for path, lines in FILES.items() if lines} == SYMBOLIC


@pytest.mark.parametrize(
    ("source", "lines"),
    [
        ("import casadi as ca\nx = ca.SX.sym('x')", [2]),
        ("from casadi import MX\nx = MX.sym('x')", [2]),
        ("y = x.sym", []),
        ("'SX.sym'", []),
    ],
)
def test_symbols_are_found(source, lines):
    assert symbols_of(source) == lines
