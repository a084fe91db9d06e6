"""Problem scripts: loading them, their parameters, and values given on the command line."""

import ast
import importlib.util
import inspect
import math
import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from gaitopt.errors import GaitoptError, InputError, ScriptError, suggest
from gaitopt.model.robot import Robot
from gaitopt.model.robots.catalogue import robot_named
from gaitopt.motion.gait import Gait
from gaitopt.ocp.problem import GaitProblem
from gaitopt.stability.walk_problem import WalkProblem


def load_script(path: Path, function: str = "problem") -> Callable[..., Any]:
    """Return a function of a script, ``problem`` or ``study``.

    Raises
    ------
    InputError
        If the script is missing or has no such function.
    ScriptError
        If it raises while it loads; the message names the script's line.
    """
    if not path.is_file():
        folder = path.parent
        scripts = [str(folder / other.name) for other in sorted(folder.glob("*.py"))] if folder.is_dir() else []
        raise InputError(f"There is no problem script {path}. {suggest(str(path), scripts)}")
    name = f"problem script {path.stem}"  # not the name of any module the script may want to import
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise InputError(f"{path} is not a Python script; a problem script ends in .py.")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # dataclasses look their own module up
    with _running(path):
        spec.loader.exec_module(module)
    found = getattr(module, function, None)
    if not callable(found):
        verbs = {"problem": "solve' or 'gaitopt stability", "study": "run"}
        others = [name for name in verbs if callable(getattr(module, name, None))]
        hint = f" It has {others[0]}(...): use 'gaitopt {verbs[others[0]]}'." if others else ""
        raise InputError(f"{path} has no function {function}(**parameters).{hint}")
    return found


def script_parameters(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the keyword parameters of a problem function with their defaults."""
    return {
        name: parameter.default
        for name, parameter in inspect.signature(function).parameters.items()
        if parameter.default is not inspect.Parameter.empty
    }


def build_problem(path: Path, settings: Sequence[str]) -> GaitProblem:
    """Return the gait problem of a script with ``NAME=VALUE`` settings applied; errors as :func:`call_script`."""
    problem = call_script(path, settings)
    if isinstance(problem, WalkProblem):
        raise InputError(f"{path} is a walking problem without optimisation; use 'gaitopt stability {path}'.")
    if not isinstance(problem, GaitProblem):
        raise InputError(f"problem() of {path} must return a GaitProblem, it returned {type(problem).__name__}.")
    return problem


def robot_of(gait: Gait, script: Path | None) -> Robot:
    """Return the robot of a gait: the one of a problem script if one is named, else of gaitopt's catalogue.

    Raises
    ------
    InputError
        If the script has no gait problem, or its robot is another one, or the robot is not known.
    """
    return robot_named(gait.robot, build_problem(script, []).robot if script else None)


def call_script(path: Path, settings: Sequence[str], function: str = "problem") -> Any:
    """Return what a function of a script returns with ``NAME=VALUE`` settings applied.

    Raises
    ------
    InputError
        If a setting names no parameter or has a value of another kind than the default.
    ScriptError
        If the script raises anything else.
    """
    called = load_script(path, function)
    defaults = script_parameters(called)
    arguments = dict(_setting(text, defaults, path) for text in settings)
    with _running(path):
        return called(**arguments)


def run_function(path: Path, function: str, *arguments: Any) -> Any:
    """Return what a function of a script returns for positional arguments; errors as :func:`call_script`."""
    called = load_script(path, function)
    with _running(path):
        return called(*arguments)


def _setting(text: str, defaults: dict[str, Any], path: Path) -> tuple[str, Any]:
    name, equals, value = (part.strip() for part in text.partition("="))
    if not equals or not name:
        raise InputError(f"--set needs NAME=VALUE, got {text!r}.")
    if name not in defaults:
        raise InputError(f"{path.name} has no parameter {name!r}. {suggest(name, defaults)}")
    default, given = defaults[name], _value(value)
    if isinstance(default, int | float) and not isinstance(given, int | float | tuple | list | dict | None):
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


@contextmanager
def _running(path: Path) -> Iterator[None]:
    """Let a script import its neighbours, as ``python SCRIPT`` would, and turn what it raises into a ScriptError."""
    former = list(sys.path)
    sys.path.insert(0, str(path.parent.resolve()))
    try:
        yield
    except GaitoptError:
        raise
    except (Exception, SystemExit) as error:
        raise _script_error(path, error) from error
    finally:
        sys.path[:] = former


def _script_error(path: Path, error: BaseException) -> ScriptError:
    """Return one sentence for whatever a script raised, with the script's own line where there is one."""
    if isinstance(error, SyntaxError) and error.lineno is not None:
        return ScriptError(f"{path}, line {error.lineno}: {error.msg}.")
    own, frames = path.resolve(), traceback.extract_tb(error.__traceback__)
    lines = [frame.lineno for frame in frames if Path(frame.filename).resolve() == own]
    place = f"{path}, line {lines[-1]}" if lines else str(path)
    return ScriptError(f"{place} raised {type(error).__name__}: {' '.join(str(error).split())}")
