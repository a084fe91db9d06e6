"""Problem scripts: loading them, their parameters, and values given on the command line."""

import ast
import importlib.util
import inspect
import math
import sys
import traceback
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from gaitopt.errors import GaitoptError, InputError, ScriptError, suggest
from gaitopt.ocp.problem import GaitProblem


def load_script(path: Path) -> Callable[..., Any]:
    """Return the ``problem`` function of a script.

    Raises
    ------
    InputError
        If the script is missing or has no ``problem``.
    ScriptError
        If it raises while it loads; the message names the script's line.
    """
    if not path.is_file():
        folder = path.parent
        scripts = [str(folder / other.name) for other in sorted(folder.glob("*.py"))] if folder.is_dir() else []
        raise InputError(f"There is no problem script {path}. {suggest(str(path), scripts)}")
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path} is not a Python script; a problem script ends in .py.")
    module = importlib.util.module_from_spec(spec)
    sys.path.insert(0, str(path.parent.resolve()))
    try:
        spec.loader.exec_module(module)
    except GaitoptError:
        raise
    except (Exception, SystemExit) as error:
        raise _script_error(path, error) from error
    finally:
        sys.path.pop(0)
    function = getattr(module, "problem", None)
    if not callable(function):
        raise InputError(f"{path} has no function problem(**parameters); define one that returns a GaitProblem.")
    return function


def script_parameters(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the keyword parameters of a problem function with their defaults."""
    return {
        name: parameter.default
        for name, parameter in inspect.signature(function).parameters.items()
        if parameter.default is not inspect.Parameter.empty
    }


def build_problem(path: Path, settings: Sequence[str]) -> GaitProblem:
    """Return the problem of a script with ``NAME=VALUE`` settings applied.

    Raises
    ------
    InputError
        If a setting names no parameter or has a value of another kind than the default.
    ScriptError
        If the script raises anything else.
    """
    function = load_script(path)
    defaults = script_parameters(function)
    arguments = dict(_setting(text, defaults, path) for text in settings)
    try:
        problem = function(**arguments)
    except GaitoptError:
        raise
    except (Exception, SystemExit) as error:
        raise _script_error(path, error) from error
    if not isinstance(problem, GaitProblem):
        raise InputError(f"problem() of {path} must return a GaitProblem, it returned {type(problem).__name__}.")
    return problem


def _setting(text: str, defaults: dict[str, Any], path: Path) -> tuple[str, Any]:
    name, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not name:
        raise InputError(f"--set needs NAME=VALUE, got {text!r}.")
    if name not in defaults:
        raise InputError(f"{path.name} has no parameter {name!r}. {suggest(name, defaults)}")
    default, given = defaults[name], _value(value)
    if isinstance(default, int | float) and not isinstance(given, int | float | tuple | list | None):
        raise InputError(f"--set {name}: {name} must be a number like its default {default!r}, got {value!r}.")
    if isinstance(default, str):
        given = value.strip("'\"")
    return name, given


def _value(text: str) -> Any:
    """Return a Python literal, a float such as inf, or the text itself."""
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        try:
            number = float(text)
        except ValueError:
            return text
        return number if math.isinf(number) or math.isnan(number) else text


def _script_error(path: Path, error: BaseException) -> ScriptError:
    """Return one sentence for whatever a script raised, with the script's own line where there is one."""
    if isinstance(error, SyntaxError) and error.lineno is not None:
        return ScriptError(f"{path}, line {error.lineno}: {error.msg}.")
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if Path(frame.filename) == path]
    place = f"{path}, line {lines[-1]}" if lines else str(path)
    return ScriptError(f"{place} raised {type(error).__name__}: {error}")
