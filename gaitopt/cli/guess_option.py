"""The initial guess of `gaitopt solve --guess`: a gait, or a motion recorded by another program."""

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from gaitopt.cli.failed_solve import is_gait_file
from gaitopt.errors import InputError
from gaitopt.ocp.problem import GaitProblem

if TYPE_CHECKING:
    from gaitopt.motion.motion_fit import MotionFit
    from gaitopt.motion.planar_gait import AnyGait
    from gaitopt.ocp.multicontact.planar_guess import PlanarGuess
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
    from gaitopt.ocp.statement.initial_guess import Guess


def start_from_file(
    problem: "GaitProblem | PlanarProblem", file: Path | None, columns: Sequence[str] | None, angle_unit: str | None
) -> "tuple[Any, MotionFit | None]":
    """Return a problem that starts from the motion in a file, and the report on its fit if it was recorded.

    Parameters
    ----------
    problem : GaitProblem or PlanarProblem
    file : Path or None
        None leaves the problem as it is.
    columns : sequence of str or None
        ``NAME=COLUMN`` for coordinates, and the time, with another name in the file.
    angle_unit : str or None

    Raises
    ------
    InputError
        If the file does not fit the robot, or an option does not apply.
    ArchiveError
        If the file is unreadable.
    """
    recorded = file is not None and not is_gait_file(file)
    if (columns or angle_unit) and not recorded:
        raise InputError(
            "--column and --angle-unit are accepted only with a recorded motion (--guess CSV/MAT/STO/MOT)."
        )
    if file is None:
        return problem, None
    if not recorded:
        from gaitopt.motion.archive import load

        return problem.replace(guess=_guess_of_gait(problem, load(file), file)), None
    from gaitopt.motion.recorded_motion import read_motion
    from gaitopt.ocp.multicontact.planar_guess import PlanarKeyframes
    from gaitopt.ocp.statement.warm_start import FromMotion

    motion = read_motion(
        file,
        problem.robot,
        parameters=problem.values,
        angle_unit=angle_unit,
        columns=_read_columns(columns),
        sequence=None if isinstance(problem, GaitProblem) else problem.sequence,
    )
    if not isinstance(problem, GaitProblem):
        return problem.replace(guess=PlanarKeyframes(motion.time.tolist(), motion.coordinates)), motion.fit
    return problem.replace(guess=FromMotion(motion.motion, label=f"recorded motion {file.name}")), motion.fit


def _guess_of_gait(problem: "GaitProblem | PlanarProblem", gait: "AnyGait", file: Path) -> "Guess | PlanarGuess":
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.ocp.multicontact.planar_guess import FromPlanarGait
    from gaitopt.ocp.statement.warm_start import WarmStart

    if not isinstance(problem, GaitProblem) and isinstance(gait, PlanarGait):
        return FromPlanarGait(gait)
    if isinstance(problem, GaitProblem) and not isinstance(gait, PlanarGait):
        return WarmStart(gait, label=f"gait {file.name}")
    raise InputError(
        f"{file} is a gait of {gait.robot_name}, whose contacts are not those of {problem.robot.name}; "
        "name another gait."
    )


def _read_columns(columns: Sequence[str] | None) -> dict[str, str]:
    """Return NAME=COLUMN settings as a mapping."""
    pairs = [text.partition("=")[::2] for text in columns or ()]
    for text, (name, column) in zip(columns or (), pairs, strict=True):
        if not name or not column:
            raise InputError(f"--column must have the form NAME=COLUMN, got {text!r}.")
    return dict(pairs)
