"""Functions fit on a screen, and public calls have few parameters.

The length of a function is counted from ``def`` to its last line without the lines of its docstring: a NumPy docstring
with shapes, units and an example is long on purpose.
"""

import ast
from pathlib import Path

import pytest

from gaitopt.lazy_exports import exported_names

PACKAGE = Path(__file__).parents[2] / "gaitopt"
LONGEST, MOST_PARAMETERS = 50, 8


def functions_of(tree):
    return [node for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)]


def length(function):
    """Return the lines of a function without those of its docstring."""
    docstring = function.body[0] if ast.get_docstring(function) is not None else None
    lines = function.end_lineno - function.lineno + 1
    return lines - (docstring.end_lineno - docstring.lineno + 1) if docstring else lines


def parameter_count(function, *, method=False):
    """Return the number of parameters of a call; `self` and `cls` are not counted."""
    arguments = function.args
    count = len([*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs])
    static = any(ast.unparse(decorator) == "staticmethod" for decorator in function.decorator_list)
    return count - (method and not static)


def calls_of(tree):
    """Yield the public calls of a module: functions, and methods and constructors of classes.

    The fields of a record (dataclass or attrs) are its data and are not counted: it defines no `__init__`.
    """
    for node in tree.body:
        if isinstance(node, ast.FunctionDef):
            yield node.name, node, parameter_count(node)
        if isinstance(node, ast.ClassDef):
            for member in node.body:
                if isinstance(member, ast.FunctionDef) and (member.name == "__init__" or member.name[0] != "_"):
                    yield f"{node.name}.{member.name}", member, parameter_count(member, method=True)


@pytest.mark.slow
def test_functions_fit_on_a_screen(trees):
    long = [
        f"{path.relative_to(PACKAGE)}:{function.lineno}: {function.name} has {length(function)} lines"
        for path, tree in trees.items()
        for function in functions_of(tree)
        if length(function) > LONGEST
    ]
    assert not long, "\n".join(long)


def test_public_calls_have_few_parameters(trees):
    """Commands in ``gaitopt/cli`` are exempt: each parameter of a Typer command is a flag."""
    wide = [
        f"{path.relative_to(PACKAGE)}:{function.lineno}: {name} has {count} parameters"
        for path, tree in trees.items()
        if path.relative_to(PACKAGE).parts[0] != "cli"
        for name, function, count in calls_of(tree)
        if not function.name.startswith("_") or function.name == "__init__"
        if count > MOST_PARAMETERS
    ]
    assert not wide, "\n".join(wide)


def test_the_public_names_are_among_the_calls(trees):
    names = {name for tree in trees.values() for name, _, _ in calls_of(tree)}
    assert {"solve", "sweep", "ProgressLine.__init__", "ContactSequence.parse"} <= names
    assert "solve" in exported_names("gaitopt.ocp")


SOURCE = '''
class A:
    def f(self, a, *, b=1, **more):
        """Print it.

        At length.
        """
        return 1

    @staticmethod
    def g(a, b): ...
'''


@pytest.mark.parametrize(("name", "lines", "count"), [("f", 2, 2), ("g", 1, 2)])
def test_length_and_parameters_are_counted(name, lines, count):
    (function,) = (function for function in functions_of(ast.parse(SOURCE)) if function.name == name)
    assert length(function) == lines
    assert parameter_count(function, method=True) == count
