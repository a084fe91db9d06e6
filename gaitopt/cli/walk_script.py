"""Scripts with a periodic walk in place of a result, or with a robot or a law alone: which commands are needed."""

import inspect
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.errors import GaitoptError, InputError

if TYPE_CHECKING:
    from gaitopt.design.family import Family
    from gaitopt.design.robust_problem import RobustProblem
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.model.robot import Robot

    AnyRobot = Robot | PlanarRobot


def name_walk_commands(script: Path) -> str:
    """Return the commands that accept the script of a walking problem.

    Examples
    --------
    >>> name_walk_commands(Path("hopper.py"))
    "use 'gaitopt stability hopper.py', 'gaitopt simulate hopper.py -o hopper.png' (or .gif), or 'gaitopt report \
hopper.py'"
    """
    return (
        f"use 'gaitopt stability {script}', 'gaitopt simulate {script} -o {script.stem}.png' (or .gif), or 'gaitopt "
        f"report {script}'"
    )


def refuse_walk_script(file: Path) -> None:
    """Raise InputError if a file is a script whose problem 'gaitopt solve' does not solve.

    It contains a walking problem without optimisation, a robust problem or a family, or a robot or a law alone.

    Any other file, also a script with an error, is left to the reader of the result.

    Examples
    --------
    >>> refuse_walk_script(Path("docs/examples/compass_slip.h5"))
    """
    if file.suffix != ".py" or not file.is_file():
        return
    from gaitopt.cli.script import list_functions, run_in_script, run_module
    from gaitopt.design.family import Family
    from gaitopt.design.robust_problem import RobustProblem
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
    from gaitopt.stability.walk_problem import WalkProblem

    try:
        module = run_module(file)
    except GaitoptError:  # which the reader of the result reports as a script
        return
    if not hasattr(module, "problem") and not hasattr(module, "study"):
        hint = explain_law_alone(file, list_functions(module)).strip() or explain_robot_alone(vars(module))
        hint = hint or "Specify the file of a result (.h5, .nc or .json)."
        raise InputError(f"{file} is a script without a problem, not a result. {hint}")
    try:
        problem = run_in_script(file, module.problem)
    except Exception:  # not a script with a problem, which the reader of the result reports as a script
        return
    alone = explain_robot_alone({"problem": problem})
    if alone:
        raise InputError(f"{file} is a script with a robot alone, not a result. {alone}")
    if isinstance(problem, WalkProblem | PlanarWalkProblem):
        raise InputError(
            f"{file} is a script with a walking problem without optimisation ({type(problem).__name__}), not a result; "
            f"{name_walk_commands(file)}."
        )
    if isinstance(problem, Family | RobustProblem):
        raise InputError(f"{file} is a script with {name_design(problem)}, not a result; {advise_design(file)}.")


def name_design(problem: "Family | RobustProblem") -> str:
    """Return the kind of a problem that 'gaitopt design' solves, with its article."""
    from gaitopt.design.family import Family

    return "a family of gaits" if isinstance(problem, Family) else "a robust problem"


def advise_design(script: Path) -> str:
    """Return the command that solves a script of a design, as a clause.

    Examples
    --------
    >>> advise_design(Path("robust.py"))
    "run 'gaitopt design robust.py' first and name the file of a gait that it writes"
    """
    return f"run 'gaitopt design {script}' first and name the file of a gait that it writes"


def read_problem_or_robot(script: Path, settings: Sequence[str] | None) -> object:
    """Return what problem() of a script returns, or the robot of a script that has no problem().

    Raises
    ------
    InputError
        If the script has neither, or settings are stated for a robot without problem().
    """
    from gaitopt.cli.script import read_script, run_module

    module = run_module(script)
    robot = None if hasattr(module, "problem") or hasattr(module, "study") else find_robot(vars(module))
    if robot is None:
        return read_script(script, settings)()
    if settings:
        raise InputError(f"--set changes a parameter of problem(), which {script} does not define.")
    return robot


def find_robot(module: Mapping[str, object]) -> "AnyRobot | None":
    """Return the first robot among the variables of a script; None without any."""
    from gaitopt.model.planar.planar_robot import PlanarRobot
    from gaitopt.model.robot import Robot

    return next((value for value in module.values() if isinstance(value, Robot | PlanarRobot)), None)


def describe_robot(robot: "AnyRobot") -> dict[str, Any]:
    """Return coordinates, actuators and parameters of a robot as plain data (SI units, angles in rad).

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> describe_robot(compass_biped())["coordinates"]
    ['x', 'y', 'th1', 'th2']
    """
    from gaitopt.model.robot import Robot

    return {
        "name": robot.name,
        "robot": robot.name,
        "coordinates": list(("x", "y", *robot.angles) if isinstance(robot, Robot) else robot.coordinates),
        "actuators": list(robot.actuators),
        "parameters": {each.name: each.default for each in robot.parameters},
    }


def explain_robot_alone(module: Mapping[str, object]) -> str:
    """Return which problem a script with a robot and without a problem needs; empty if it has no robot.

    Parameters
    ----------
    module : mapping of str to object
        Variables of the script by name, or what its function returns.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> explain_robot_alone({"walker": compass_biped()})[:90]
    "Robot 'compass_biped' is not a problem: problem() must return a WalkProblem(robot=...) for"
    """
    from gaitopt.model.robot import Robot

    robot = find_robot(module)
    if robot is None:
        return ""
    if isinstance(robot, Robot):
        needed = "a WalkProblem(robot=...) for its passive gaits, or a GaitProblem(robot=...) for optimal ones"
        return (
            f"Robot {robot.name!r} is not a problem: problem() must return {needed}; see the guide 'Build a custom "
            "robot'."
        )
    return (
        f"Robot {robot.name!r} is not a problem: problem() must return a PlanarWalkProblem(robot=..., section=..., "
        "coordinates=..., rates=...) for its passive gaits, or a PlanarProblem(robot=...) for optimal ones; see "
        "the guide 'Stability and branches of a custom robot'."
    )


def explain_law_alone(script: Path, functions: Iterable[Any]) -> str:
    """Return the commands that use the law of a script without a problem; empty if it has no law.

    Parameters
    ----------
    script : Path
    functions : iterable of callable
        Functions that the script defines.

    Examples
    --------
    >>> def servo(robot, motion, torque_limit): ...
    >>> explain_law_alone(Path("servo.py"), [servo])[:75]
    " It defines the law servo, which acts on a gait: 'gaitopt stability GAIT.h5"
    """
    arguments = ["robot", "motion", "torque_limit"]
    laws = [each.__name__ for each in functions if [*inspect.signature(each).parameters][:3] == arguments]
    if not laws:
        return ""
    return (
        f" It defines the law {laws[0]}, which acts on a gait: 'gaitopt stability GAIT.h5 --law {script}:{laws[0]}' "
        f"assesses the gait with it, and 'gaitopt tune GAIT.h5 --law {script}:{laws[0]}' tunes its gains."
    )
