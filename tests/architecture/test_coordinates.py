"""Only the model indexes q and v by position; other modules use the names in ``model/coordinate_entries.py``."""

import ast
from pathlib import Path

import pytest

from tests.architecture.conftest import parse

PACKAGE = Path(__file__).parents[2] / "gaitopt"
MODEL = "model"

VECTORS = {"q", "v"}
"""Coordinates and velocities, also with a suffix such as `q_next`, and joined over segments, `channel("q")`."""
RATES = {"acceleration", "velocity", "velocity_jump", "mass_matrix", "bias", "actuation"}
"""Other quantities with one entry for each coordinate."""
STATES = {"state", "y", "start", "following"}
"""States (q, v)."""


def name_of(node):
    """Return the last name of an expression: `q` for `q`, `segment.q`, and for `motion.channel("q")`."""
    if isinstance(node, ast.Call) and node.args and isinstance(node.args[0], ast.Constant):
        return str(node.args[0].value) if name_of(node.func) == "channel" else ""
    return getattr(node, "attr", getattr(node, "id", ""))


def contains_number(node):
    """Return whether an index is written with a whole number, such as `0`, `2 + i`, `2:`, or `:1`."""
    return any(isinstance(part, ast.Constant) and isinstance(part.value, int) for part in ast.walk(node))


def is_dimension(node):
    """Return whether an index of a state is the number of coordinates, at which the velocities begin."""
    return name_of(node) in {"n", "n_q"} or (isinstance(node, ast.BinOp) and is_dimension(node.left))


def positions_of(source):
    """Return line and text of every entry of q, v or (q, v) that is written as a position."""
    found = []
    for node in ast.walk(parse(source)):
        if not isinstance(node, ast.Subscript):
            continue
        name = name_of(node.value)
        index = node.slice.elts[0] if isinstance(node.slice, ast.Tuple) and node.slice.elts else node.slice
        coordinates = name.partition("_")[0] in VECTORS or name in RATES
        if (coordinates and contains_number(index)) or (name in STATES and is_dimension(index)):
            found.append((node.lineno, ast.unparse(node)))
    return found


FILES = [path for path in sorted(PACKAGE.rglob("*.py")) if path.relative_to(PACKAGE).parts[0] != MODEL]


def test_no_position_outside_the_model():
    assert len(FILES) > 180
    by_file = {path.relative_to(PACKAGE).as_posix(): positions_of(path.read_text()) for path in FILES}
    by_position = {name: found for name, found in by_file.items() if found}
    assert not by_position, by_position


@pytest.mark.parametrize(
    "text",
    [
        "q[2:]",
        "q[:2]",
        "segment.v[0]",
        "jump.q_next[0]",
        "gait.motion.segments[0].q[0, -1]",
        "inputs.v[2 + angle]",
        "motion.channel('q')[0]",
        "actuation[2:, :]",
        "state[n]",
        "state[robot.n_q]",
        "following[n + 2]",
    ],
)
def test_positions_are_found(text):
    assert positions_of(text) == [(1, text)]


@pytest.mark.parametrize(
    "text",
    ["q[ANGLES]", "v[SLIDE, -1]", "q[:, 0]", "state[:n]", "state[n:]", "q[entry]", "x[0]", "channel('force')[0]"],
)
def test_names_and_other_indices_pass(text):
    assert positions_of(text) == []
