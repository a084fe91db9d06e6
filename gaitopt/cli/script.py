"""Problem scripts: their functions, parameters and problems."""

import functools
import hashlib
import inspect
import sys
import types
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from difflib import get_close_matches
from importlib.machinery import SourceFileLoader
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.cli.script_errors import running_script
from gaitopt.cli.settings import read_setting
from gaitopt.cli.unlisted_parameter import explain_unlisted_parameter
from gaitopt.cli.walk_script import (
    advise_design,
    explain_law_alone,
    explain_robot_alone,
    name_design,
    name_walk_commands,
)
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.provenance import ScriptRecord

if TYPE_CHECKING:
    from gaitopt.motion.planar_gait import AnyGait
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
    from gaitopt.stability.walk_problem import WalkProblem

ROBOT_OF_SCRIPT = (
    "--problem specifies the robot of a saved gait; it is not accepted for a script, which defines its robot."
)
"""Error message if --problem is stated together with a script."""


@dataclass(frozen=True, eq=False)
class Script:
    """A function of a script and the settings it is called with.

    Attributes
    ----------
    path : Path
    function : callable
        ``problem`` or ``study``.
    settings : dict of str to object
        Changed parameters.
    """

    path: Path
    function: Callable[..., Any]
    settings: dict[str, Any]

    @functools.cached_property
    def defaults(self) -> dict[str, Any]:
        """The parameters of the function with their defaults."""
        return script_parameters(self.function)

    def __call__(self, **changes: Any) -> Any:
        """Return what the function returns, with some parameters changed once more.

        Raises
        ------
        InputError
            If a value is invalid.
        ScriptError
            If the script raises anything else.
        """
        settings = self.settings | changes
        with running_script(self.path, changed=bool(settings)):
            return self.function(**settings)

    def record(self) -> ScriptRecord:
        """Return file name, digest and parameters."""
        return ScriptRecord(
            file=self.path.name,
            sha256=hashlib.sha256(self.path.read_bytes()).hexdigest(),
            parameters=self.defaults | self.settings,
            changed=tuple(self.settings),
        )


def read_script(path: Path, settings: Sequence[str] | None = None, function: str = "problem") -> Script:
    """Return a function of a script with ``NAME=VALUE`` settings; errors as :func:`load_script` and `read_setting`."""
    script = Script(path, load_script(path, function), {})
    return replace(script, settings=dict(_read_setting(text, script) for text in settings or ()))


def _read_setting(text: str, script: Script) -> tuple[str, Any]:
    """Return name and value of a setting; the error of an unlisted robot parameter states how it becomes settable."""
    try:
        return read_setting(text, script.defaults, script.path.name)
    except InputError as error:
        name = text.partition("=")[0].strip()
        hint = "" if name in script.defaults else explain_unlisted_parameter(script.function, name)
        raise InputError(f"{error} {hint}".rstrip()) from None


def load_script(path: Path, function: str = "problem") -> Callable[..., Any]:
    """Return a function of a script: ``problem``, ``study``, or that of a law.

    Raises
    ------
    InputError
        If the script is missing or has no such function.
    ScriptError
        If it raises an exception while it is loaded; the message names the line.
    """
    module = run_module(path, function)
    loaded = getattr(module, function, None)
    if not callable(loaded):
        raise InputError(_missing_function(path, function, module))
    return loaded


def run_module(path: Path, function: str = "problem") -> types.ModuleType:
    """Return the module of a script, whose function is named in errors, as those of :func:`load_script`."""
    if path.is_dir():
        raise InputError(f"{path} is a folder, not a script; 'gaitopt problems {path}' lists the problems in it.")
    if not path.is_file():
        kind = function if function in ("problem", "study") else "law"
        raise InputError(f"There is no {kind} script {path}. {_nearest_script(path, kind)}")
    name = f"problem script {path.stem}"  # not the name of any module the script may want to import
    if path.suffix != ".py":
        raise InputError(f"{path} is not a Python script; a problem script ends in .py.")
    loader = _ScriptLoader(name, str(path))
    module = types.ModuleType(name)
    module.__file__, module.__loader__ = str(path), loader
    sys.modules[name] = module  # dataclasses look up their module
    with running_script(path):
        loader.exec_module(module)
    return module


def _missing_function(path: Path, function: str, module: types.ModuleType) -> str:
    """Return a sentence on a function that a script does not have, and on those that it has."""
    verbs = {"problem": "solve' or 'gaitopt stability", "study": "run"}
    if function not in verbs:
        known = [each.__name__ for each in list_functions(module) if each.__name__[0] != "_"]
        if hasattr(module, function):
            kind = type(getattr(module, function)).__name__
            return f"{function} of {path} must be a function, got an object of type {kind}."
        return f"{path} has no function {function}. {suggest(function, known) if known else 'It defines no functions.'}"
    others = [name for name in verbs if callable(getattr(module, name, None))]
    hint = f" It has {others[0]}(...): use 'gaitopt {verbs[others[0]]}'." if others else ""
    hint = hint or explain_law_alone(path, list_functions(module))
    near = get_close_matches(function, [each.__name__ for each in list_functions(module)], n=1, cutoff=0.75)
    hint = hint or (f" It has {near[0]}: did you mean {function!r}?" if near else "")
    alone = explain_robot_alone(vars(module)) if function == "problem" and not hint else ""
    if function == "problem" and not hint and not alone:
        alone = "'gaitopt new NAME' writes a script that has one."
    return f"{path} has no function {function}(**parameters).{hint} {alone}".rstrip()


def list_functions(module: types.ModuleType) -> list[types.FunctionType]:
    """Return the functions that a module defines."""
    return [each for each in vars(module).values() if inspect.isfunction(each) and each.__module__ == module.__name__]


def _nearest_script(path: Path, kind: str) -> str:
    """Return a sentence with the most similar name among the scripts beside a missing one, or how to list them."""
    folder = path.parent
    scripts = [str(folder / other.name) for other in sorted(folder.glob("*.py"))] if folder.is_dir() else []
    near = get_close_matches(str(path), scripts, n=1)
    if near:
        return f"Did you mean '{near[0]}'?"
    if kind == "law":
        return (
            "State its path as SCRIPT.py:FUNCTION; the script of tuned gains is to be moved together with their file."
        )
    if not scripts:
        return f"The folder {folder} contains no scripts; 'gaitopt new NAME' writes one."
    return f"'gaitopt problems {folder}' lists the scripts of the folder."


def script_parameters(function: Callable[..., Any]) -> dict[str, Any]:
    """Return the keyword parameters of a problem function with their defaults."""
    return {
        name: parameter.default
        for name, parameter in inspect.signature(function).parameters.items()
        if parameter.default is not inspect.Parameter.empty
    }


def call_script(path: Path, settings: Sequence[str], function: str = "problem") -> Any:
    """Return what a function of a script returns with ``NAME=VALUE`` settings applied.

    Raises
    ------
    InputError
        If a setting names no parameter, or its value is invalid.
    ScriptError
        If the script raises anything else.
    """
    return read_script(path, settings, function)()


def run_function(path: Path, function: str, *arguments: Any) -> Any:
    """Return what a function of a script returns for positional arguments; errors as :func:`call_script`."""
    return run_in_script(path, load_script(path, function), *arguments)


def run_in_script(path: Path, loaded: Callable[..., Any], *arguments: Any) -> Any:
    """Return what a loaded function of a script returns for positional arguments; errors as :func:`call_script`."""
    with running_script(path):
        return loaded(*arguments)


def build_problem(path: Path, settings: Sequence[str] | None = None) -> GaitProblem:
    """Return the gait problem of a script with ``NAME=VALUE`` settings applied; errors as :func:`call_script`."""
    return gait_problem(read_script(path, settings))


def optimal_problem(script: Script) -> "GaitProblem | PlanarProblem":
    """Return the problem of an optimal gait a script states, of a robot with any contacts."""
    return require_optimal_problem(script(), script)


def require_optimal_problem(problem: object, script: Script) -> "GaitProblem | PlanarProblem":
    """Return the problem that a script has returned, with the record of that script; see :func:`optimal_problem`."""
    if isinstance(problem, GaitProblem):
        return require_gait_problem(problem, script)
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem

    if isinstance(problem, PlanarProblem):
        return problem.replace(script=script.record())
    return require_gait_problem(problem, script)


def gait_problem(script: Script) -> GaitProblem:
    """Return the gait problem a script states, with the record of that script.

    Raises
    ------
    InputError
        If it states something else, or a value is invalid.
    ScriptError
        If the script raises anything else.
    """
    return require_gait_problem(script(), script)


def require_gait_problem(problem: object, script: Script) -> GaitProblem:
    """Return the gait problem that a script has returned, with the record of that script; see :func:`gait_problem`."""
    if isinstance(problem, GaitProblem):
        return problem.replace(script=script.record())
    from gaitopt.design.family import Family
    from gaitopt.design.robust_problem import RobustProblem
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
    from gaitopt.stability.walk_problem import WalkProblem

    if isinstance(problem, PlanarProblem):
        raise InputError(
            f"{script.path} has a robot with several contacts, which this command does not accept; 'gaitopt solve', "
            "'stability', 'simulate', 'tune', 'push', 'basin' and 'impact' do."
        )
    if isinstance(problem, WalkProblem | PlanarWalkProblem):
        kind = type(problem).__name__
        raise InputError(
            f"{script.path} is a walking problem without optimisation ({kind}); {name_walk_commands(script.path)}."
        )
    if isinstance(problem, Family | RobustProblem):
        raise InputError(f"{script.path} has {name_design(problem)}; use 'gaitopt design {script.path}'.")
    kinds = "GaitProblem, PlanarProblem, MultiStepProblem, WalkProblem, PlanarWalkProblem, Family or RobustProblem"
    returned = "None: a return statement is missing" if problem is None else type(problem).__name__
    text = f"problem() of {script.path} must return a {kinds}; it returned {returned}."
    raise InputError(f"{text} {explain_robot_alone({'problem': problem})}".rstrip())


def walk_problem(script: Script) -> "WalkProblem":
    """Return the walking problem of a robot with one foot on the ground; errors as :func:`gait_problem`."""
    return require_single_support(any_walk_problem(script), script.path)


def require_single_support(problem: "WalkProblem | PlanarWalkProblem", path: Path) -> "WalkProblem":
    """Return a walking problem, or raise InputError if its robot has several contacts."""
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem

    if isinstance(problem, PlanarWalkProblem):
        raise InputError(
            f"{path} has a robot with several contacts, which this command does not accept; 'gaitopt stability', "
            "'simulate', 'trace', 'basin', 'report' and 'impact' do."
        )
    return problem


def load_feedback_gait(file: Path, script: Path | None) -> "AnyGait":
    """Return the gait of a file, or of the script of a robot with several contacts, for a command on feedback.

    Raises
    ------
    InputError
        If the script is a walking problem or another one names the robot, or the gait is not a solution.
    """
    from gaitopt.cli.planar_gait_walk import find_planar_gait
    from gaitopt.design.family import Family
    from gaitopt.design.robust_problem import RobustProblem
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
    from gaitopt.stability.walk_problem import WalkProblem

    if file.suffix == ".py" and file.is_file():
        stated = read_script(file)()
        if isinstance(stated, PlanarProblem):
            if script is not None:
                raise InputError(ROBOT_OF_SCRIPT)
            return find_planar_gait(stated)
        if isinstance(stated, WalkProblem | PlanarWalkProblem):
            raise InputError(
                f"{file} is a walking problem without optimisation ({type(stated).__name__}); 'gaitopt stability "
                f"{file}' assesses its gaits."
            )
        if isinstance(stated, Family | RobustProblem):
            raise InputError(f"{file} is a script with {name_design(stated)}, not a gait; {advise_design(file)}.")
    return load_any_gait(file, script).require()


def any_walk_problem(script: Script) -> "WalkProblem | PlanarWalkProblem":
    """Return the walking problem a script states, of a robot with any contacts; errors as :func:`gait_problem`."""
    return require_walk_problem(script(), script)


def require_walk_problem(problem: object, script: Script) -> "WalkProblem | PlanarWalkProblem":
    """Return the walking problem that a script has returned; errors as :func:`gait_problem`."""
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
    from gaitopt.stability.walk_problem import WalkProblem

    if isinstance(problem, PlanarProblem):
        raise InputError(
            f"{script.path} optimises a robot with several contacts, which this command does not accept; 'gaitopt "
            f"solve' finds its gait, 'gaitopt stability {script.path}' assesses it (under feedback with --law lqr), "
            f"and 'gaitopt simulate {script.path}' simulates some steps. 'gaitopt trace GAIT.h5' follows the saved "
            "gait over a parameter; the guide 'Stability and branches of a custom robot' shows how."
        )
    if not isinstance(problem, WalkProblem | PlanarWalkProblem):
        kind, alone = type(problem).__name__, explain_robot_alone({"problem": problem})
        if alone:
            raise InputError(f"{script.path} returns a {kind}. {alone}")
        verb = "design" if kind in ("Family", "RobustProblem") else "solve"
        raise InputError(
            f"{script.path} returns a {kind}, not a WalkProblem; run 'gaitopt {verb} {script.path}' first and name the "
            "gait file."
        )
    return problem


def load_any_gait(file: Path, script: Path | None) -> "AnyGait":
    """Return the gait in a file, with the robot of a problem script if one is named.

    Raises
    ------
    ArchiveError
        If the file is unreadable.
    InputError
        If the script states no gait problem, or its robot has other physics than the robot of the gait.
    """
    from gaitopt.motion.archive import load

    gait = load(file)
    return gait if script is None else gait.with_robot(_robot_of(script))


def load_gaits(files: Mapping[str, Path], script: Path | None) -> "dict[str, AnyGait]":
    """Return gaits by label; those of a robot with the name of the script's robot get that robot, if one is named."""
    from gaitopt.motion.archive import load

    robot = None if script is None else _robot_of(script)
    gaits = {label: load(file) for label, file in files.items()}
    return {
        label: gait if robot is None or gait.robot_name != robot.name else gait.with_robot(robot)
        for label, gait in gaits.items()
    }


def _robot_of(script: Path) -> Any:
    """Return the robot of the gait problem of a script."""
    return optimal_problem(read_script(script)).robot


class _ScriptLoader(SourceFileLoader):
    """Loader that writes no bytecode, as ``python SCRIPT`` writes none of the script."""

    def set_data(self, path: str, data: Any, **options: Any) -> None:
        """Discard the bytecode."""
