"""A class, a module and a public function have a name that nothing else in the package has."""

import ast
from collections import defaultdict
from pathlib import Path

import pytest

from tests.architecture.conftest import parse

PACKAGE = Path(__file__).parents[2] / "gaitopt"
TEMPLATES = PACKAGE / "cli" / "templates"
FILES = [path for path in sorted(PACKAGE.rglob("*.py")) if TEMPLATES not in path.parents]


def classes_of(tree):
    """Return the names of all classes, nested ones included; a leading underscore does not distinguish two names."""
    return [node.name.lstrip("_") for node in ast.walk(tree) if isinstance(node, ast.ClassDef)]


def functions_of(tree):
    """Return the names of the public functions of a module; the signatures of an overloaded one are not counted."""
    functions = [node for node in tree.body if isinstance(node, ast.FunctionDef) and node.name[0] != "_"]
    return [node.name for node in functions if "overload" not in map(ast.unparse, node.decorator_list)]


def module_name(path):
    """Return the name of a module or package; a module with the name of its package has the same meaning."""
    name = path.parent.name if path.stem == "__init__" else path.stem
    return None if name == "__main__" or (path.stem != "__init__" and name == path.parent.name) else name


def repeated(names):
    """Return the names with more than one place.

    Parameters
    ----------
    names : iterable of (str, Path)
    """
    places = defaultdict(list)
    for name, path in names:
        places[name].append(path.as_posix())
    return {name: found for name, found in places.items() if len(found) > 1}


@pytest.mark.slow
def test_every_class_has_its_own_name(trees):
    names = [(name, path) for path in FILES for name in classes_of(trees[path])]
    assert len(names) > 200
    assert not repeated(names)


def test_every_module_has_its_own_name():
    names = [(name, path) for path in FILES if (name := module_name(path)) is not None]
    assert len(names) > 200
    assert not repeated(names)


def test_every_public_function_has_its_own_name(trees):
    """The commands of the command line have the names of the functions they call."""
    names = [(name, path) for path in FILES if path.parent.name != "cli" for name in functions_of(trees[path])]
    assert len(names) > 300
    assert not repeated(names)


@pytest.mark.parametrize(
    ("source", "classes", "functions"),
    [("class A:\n    class _B: ...", ["A", "B"], []), ("def f(): ...\ndef _g(): ...", [], ["f"])],
)
def test_names_are_found(source, classes, functions):
    tree = parse(source)
    assert (classes_of(tree), functions_of(tree)) == (classes, functions)


def test_a_repeated_name_is_found():
    one, other = Path("a/stage.py"), Path("b/stage.py")
    assert repeated([("stage", one), ("stage", other), ("scene", one)]) == {"stage": ["a/stage.py", "b/stage.py"]}
