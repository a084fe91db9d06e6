"""Scripts with a periodic walk in place of a result: the commands that accept them."""

from pathlib import Path

from gaitopt.errors import InputError


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
    """Raise InputError if a file is a script with a walking problem, which has no result to be solved first.

    Any other file, also a script with an error, is left to the reader of the result.

    Examples
    --------
    >>> refuse_walk_script(Path("docs/examples/compass_slip.h5"))
    """
    if file.suffix != ".py" or not file.is_file():
        return
    from gaitopt.cli.script import read_script
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
    from gaitopt.stability.walk_problem import WalkProblem

    try:
        problem = read_script(file)()
    except Exception:  # not a script with a problem, which the reader of the result reports as a script
        return
    if isinstance(problem, WalkProblem | PlanarWalkProblem):
        raise InputError(
            f"{file} is a script with a walking problem without optimisation ({type(problem).__name__}), not a result; "
            f"{name_walk_commands(file)}."
        )
