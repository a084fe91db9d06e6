"""Every public name can be reached, and says what it is, with an example that runs as a doctest."""

import inspect
import types

import pytest

import gaitopt

NAMES = [name for name in gaitopt.__all__ if name != "__version__"]


def test_the_list_of_public_names_is_sorted_and_complete():
    assert len(NAMES) > 50
    assert sorted(NAMES) == NAMES
    assert set(dir(gaitopt)) >= set(NAMES)
    assert gaitopt.__version__.count(".") == 2


def test_an_unknown_name_is_refused():
    with pytest.raises(AttributeError, match="no attribute 'solv'"):
        _ = gaitopt.solv


@pytest.mark.parametrize("name", NAMES)
def test_every_public_name_is_documented(name):
    thing = getattr(gaitopt, name)
    assert inspect.getdoc(thing), f"{name} has no docstring"
    own = thing.__doc__ or ""
    assert own.strip(), f"{name} only inherits a docstring"
    assert thing.__module__ == gaitopt._HOME[name], f"{name} is not defined where gaitopt looks for it"


def without_example(thing):
    """Return whether a name is an exception, which shows itself, or abstract, which nobody makes."""
    return inspect.isclass(thing) and (issubclass(thing, Exception) or inspect.isabstract(thing))


@pytest.mark.parametrize("name", NAMES)
def test_every_public_function_and_class_has_an_example(name):
    thing = getattr(gaitopt, name)
    if not isinstance(thing, type | types.FunctionType) or without_example(thing):
        return
    documentation = inspect.getdoc(thing)
    assert "Examples\n--------" in documentation, f"{name} has no example"
    assert ">>>" in documentation.split("Examples\n--------")[1], f"the example of {name} is not tested"


@pytest.mark.parametrize("name", NAMES)
def test_every_public_method_is_documented(name):
    thing = getattr(gaitopt, name)
    if not inspect.isclass(thing):
        return
    for member, value in vars(thing).items():
        if member.startswith("_") or not (inspect.isfunction(value) or isinstance(value, property | classmethod)):
            continue
        assert inspect.getdoc(getattr(thing, member)), f"{name}.{member} has no docstring"
