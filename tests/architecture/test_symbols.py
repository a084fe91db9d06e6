"""Symbols live where equations are stated and compiled; everything else calls named Functions with numbers."""

import ast
import functools
from pathlib import Path

import pytest

from tests.architecture.conftest import parse

PACKAGE = Path(__file__).parents[2] / "gaitopt"

SYMBOLIC = {
    "model",  # the equations of motion, contacts and impact
    "ocp",  # the NLP: its unknowns, data and multipliers, and the derivatives of an objective
    "control",  # laws as functions of clock, state, latched values and data
    # Outside these wings, only the files that compile their Functions:
    "simulation/closed_loop.py",  # the equations of a robot under a law in a contact mode
    "simulation/contact_choice.py",  # the force at rest under a law
    "simulation/law_memory.py",  # the resets of a law and their derivatives
    "simulation/scipy_engine.py",  # the variational equations of the reference engine
    "simulation/taylor",  # the closed loop in the form of the Taylor engine
    "stability/section.py",  # the angle that the touchdown condition determines
    "stability/linearisation.py",  # derivatives of flow, guards and reset
    "tuning/lqr.py",  # the linearised dynamics of a step
    "export/c_code.py",  # C code of the Functions
    "export/c_controller.py",  # C code of a law
    "export/python_code.py",  # Python code of the Functions
    "simulation/event_location.py",  # derivatives of the guards
    "cli/setup.py",  # the check of an installation solves min x^2
}
"""Packages, sub-packages and files that make or take symbols."""
TAKEN = {"sx_in", "mx_in", "symvar"}
"""Calls that return the symbols of a Function or of an expression."""


def symbols_of(source):
    """Return the lines that make a CasADi symbol, `SX.sym` or `MX.sym`, or take those of a Function, `f.sx_in()`."""
    return [
        node.lineno
        for node in ast.walk(parse(source))
        if isinstance(node, ast.Attribute)
        and (node.attr in TAKEN or (node.attr == "sym" and ast.unparse(node.value).rpartition(".")[2] in {"SX", "MX"}))
    ]


def place_of(path):
    """Return the listed wing, room or file that contains a file, otherwise the file itself."""
    name = path.relative_to(PACKAGE).as_posix()
    places = [name, *(parent.as_posix() for parent in path.relative_to(PACKAGE).parents)]
    return next((place for place in places if place in SYMBOLIC), name)


@functools.cache
def read_files():
    """Return the lines with symbols of every file."""
    return {path: symbols_of(path.read_text()) for path in sorted(PACKAGE.rglob("*.py"))}


def test_symbols_live_where_equations_are_stated():
    files = read_files()
    assert len(files) > 200
    astray = {
        path.relative_to(PACKAGE): lines for path, lines in files.items() if lines and place_of(path) not in SYMBOLIC
    }
    assert not astray, astray


def test_every_listed_place_makes_symbols():
    assert {place_of(path) for path, lines in read_files().items() if lines} == SYMBOLIC


@pytest.mark.parametrize(
    ("source", "lines"),
    [
        ("import casadi as ca\nx = ca.SX.sym('x')", [2]),
        ("from casadi import MX\nx = MX.sym('x')", [2]),
        ("y = x.sym", []),
        ("t, y = function.sx_in()", [1]),
        ("import casadi as ca\nx = ca.symvar(y)", [2]),
        ("'SX.sym'", []),
    ],
)
def test_symbols_are_found(source, lines):
    assert symbols_of(source) == lines
