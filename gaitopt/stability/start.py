"""Start of a walk on the section: the state of a periodic gait with some coordinates changed."""

from collections.abc import Mapping

from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.section import Section


def choose_start(robot: Robot, p: Array, changes: Mapping[str, float], cycle: Cycle | None = None) -> dict[str, float]:
    """Return every coordinate of a start on the section with foot speed.

    Parameters
    ----------
    robot : Robot
    p : (n_p,) array
    changes : mapping of str to float
        Values of coordinates (SI units, rad).
    cycle : Cycle, optional
        Periodic gait that provides the other coordinates.  Without a gait the foot speed is 0 m/s.

    Raises
    ------
    InputError
        If a coordinate is unknown, or has a value neither in `changes` nor in a gait.

    Examples
    --------
    >>> from gaitopt import rimless_wheel
    >>> wheel = rimless_wheel()
    >>> choose_start(wheel, wheel.vector(wheel.resolve({"slope": 0.2})), {"theta_rate": 1.2})
    {'theta_rate': 1.2, 'foot_speed': 0.0}
    """
    names = Section(robot, p, sliding=True).names
    for name in changes:
        if name not in names:
            raise InputError(f"The section of {robot.name!r} has no coordinate {name!r}. {suggest(name, names)}")
    values = {"foot_speed": 0.0, **({} if cycle is None else cycle.state), **changes}
    missing = [name for name in names if name not in values]
    if missing:
        raise InputError(
            f"The start needs values of {', '.join(missing)}, because there is no periodic gait that provides them."
        )
    return {name: values[name] for name in names}
