"""write_csv: a motion as a CSV table."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import MotionView, PhaseView
from gaitopt.motion.planar_motion import PlanarMotion
from gaitopt.motion.planar_steps import number_steps
from gaitopt.motion.printable import column_name
from gaitopt.motion.view_motion import AnyMotion, view_motion


@check_arguments
def write_csv(
    motion: AnyMotion, path: str | Path, *, section: Sequence[str] = (), robot: PlanarRobot | None = None
) -> Path:
    """Write the trajectories of a motion as a table: a line for each sample, a column for each quantity.

    Columns are named by quantity and unit such as ``th1_rad`` or ``hip_torque_Nm``, in characters that MATLAB's
    ``readtable`` and Julia's ``CSV.jl`` accept unchanged.  Each phase has its own first and last sample, so a time
    appears twice where a phase ends and the next begins.  Numbers are written with all digits.  ``damping_work_J`` and
    ``elastic_J`` are those of robots with dampers and springs; ``potential_J`` includes the elastic energy.  For a
    robot with several contacts, each contact that closes has its columns, such as ``foot_A_mode`` and
    ``foot_A_normal_force_N``.

    Parameters
    ----------
    motion : Motion or PlanarMotion
        Motion of a gait or of a simulated walk.
    path : str or Path
        Usually ends in ``.csv``.
    section : sequence of str, optional
        Events that end the steps of a walk of a robot with several contacts in turn, such as
        ``["foot B closes", "foot A closes"]``; without any, the motion is one step.
    robot : PlanarRobot, optional
        Robot of a motion with several contacts, such as ``gait.robot``, for the columns of the powers of its actuators.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the motion has no samples.
    ArchiveError
        If the file is not writable; an older file of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import load, write_csv
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = write_csv(load("docs/examples/compass_slip.h5").motion, f"{folder}/gait.csv")
    ...     path.read_text(encoding="utf-8")[:44]
    'step,mode,time_s,x_m,y_m,th1_rad,th2_rad,x_r'
    """
    view = view_motion(motion)
    if not view.segments:
        raise InputError("The motion has no samples: the simulation stopped at its start.")
    path = Path(path)
    modes = [f"{view.contacts[i].column}mode" for i in view.closing]
    parts = [dict(_columns(view, replace(part, power=_find_powers(view, part, robot)))) for part in view.segments]
    header = [column_name(name) for name in ("step", *modes, *parts[0])]
    with write_atomically(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(header) + "\n")
        for segment, part, step in zip(view.segments, parts, _steps(motion, view, section), strict=True):
            values = np.array([*part.values()])
            start = ",".join([str(step), *(segment.modes[i].value for i in view.closing), ""])
            file.writelines(start + ",".join(map(repr, sample.tolist())) + "\n" for sample in values.T)
    return path


def _steps(motion: AnyMotion, view: MotionView, section: Sequence[str]) -> list[int]:
    """Return the step of each phase of the view, which omits segments without duration."""
    if not isinstance(motion, PlanarMotion):
        return [segment.step for segment in view.segments]
    numbers = number_steps(motion, section)
    return [step for step, part in zip(numbers, motion.segments, strict=True) if part.time[-1] > part.time[0]]


def _find_powers(view: MotionView, segment: PhaseView, robot: PlanarRobot | None) -> Array | None:
    """Return the powers of the actuators [W], shape (n_u, K); None if neither the motion nor a robot states them."""
    if segment.power is not None or robot is None:
        return segment.power
    known = {each.name for each in robot.parameters}
    values = {name: value for name, value in view.parameters.items() if name in known}
    p = np.tile(robot.vector(robot.resolve(values))[:, None], segment.time.size)
    rates = robot.joint_rates.map(segment.time.size)(segment.q, segment.v, p)
    return np.asarray(segment.torque * np.asarray(rates).reshape(segment.torque.shape))


def _present(view: MotionView, segment: PhaseView, name: str) -> Iterator[tuple[str, Array]]:
    """Yield an energy that only robots with dampers or springs have, if it is not zero throughout the motion."""
    if np.any(view.channel(name)):
        yield f"{name}_J", getattr(segment, name)


def _columns(view: MotionView, segment: PhaseView) -> Iterator[tuple[str, Array]]:
    """Yield the name and the samples of each quantity."""
    yield "time_s", segment.time
    for channel, row in zip(view.coordinates, segment.q, strict=True):
        yield f"{channel.name}_{channel.unit}", row
    for channel, row in zip(view.coordinates, segment.v, strict=True):
        yield f"{channel.name}_rate_{channel.unit}_per_s", row
    for channel, row in zip(view.actuators, segment.torque, strict=True):
        yield f"{channel.name}_{'torque_Nm' if channel.unit == 'N m' else 'force_N'}", row
    for kind, unit, rows in (("power", "W", segment.power), ("work", "J", segment.work)):
        for channel, row in zip(view.actuators, () if rows is None else rows, strict=rows is not None):
            yield f"{channel.name}_{kind}_{unit}", row
    for contact in view.closing:
        yield from _contact_columns(view, segment, contact)
    yield from _present(view, segment, "damping_work")
    yield "kinetic_J", segment.kinetic
    yield "potential_J", segment.potential
    yield from _present(view, segment, "elastic")
    for number, name in enumerate(view.points):
        yield f"{name}_x_m", segment.points[0, number]
        yield f"{name}_y_m", segment.points[1, number]


def _contact_columns(view: MotionView, segment: PhaseView, number: int) -> Iterator[tuple[str, Array]]:
    """Yield the force and the friction work of a contact, and gap and slip speed of one that has a name."""
    contact = view.contacts[number]
    column = contact.column
    if contact.is_stop:
        yield f"{column}{'stop_force_N' if contact.unit == 'm' else 'stop_torque_Nm'}", segment.forces[number, 1]
        yield f"{column}gap_{contact.unit}", segment.gaps[number]
        return
    yield f"{column}tangential_force_N", segment.forces[number, 0]
    yield f"{column}normal_force_N", segment.forces[number, 1]
    yield f"{column}friction_work_J", segment.friction_works[number]
    if column:
        yield f"{column}gap_m", segment.gaps[number]
        yield f"{column}slip_speed_m_per_s", segment.slip_speeds[number]
