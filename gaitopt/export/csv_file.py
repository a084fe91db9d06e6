"""write_csv: a motion as a CSV table."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from gaitopt.errors import InputError
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.motion import Array, Motion, Segment, check_motion


def write_csv(motion: Motion, path: str | Path) -> Path:
    """Write the trajectories of a motion as a table: a line for each sample, a column for each quantity.

    Columns are named by quantity and unit such as ``th1_rad`` or ``hip_torque_Nm``, in letters that MATLAB's
    ``readtable`` and Julia's ``CSV.jl`` take as they are.  Each phase has its own first and last sample, so a time
    comes twice where a phase ends and the next begins.  Numbers are written with all digits.  ``damping_work_J`` and
    ``elastic_J`` are those of robots with dampers and springs; ``potential_J`` includes the elastic energy.

    Parameters
    ----------
    motion : Motion
        Motion of a gait or of a simulated walk.
    path : str or Path
        Usually ends in ``.csv``.

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
    check_motion(motion)
    if not motion.segments:
        raise InputError("The motion has no samples: the simulation stopped at its start.")
    path = Path(path)
    header = ["step", "mode", *(name for name, _ in _columns(motion, motion.segments[0]))]
    with write_atomically(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as file:
        file.write(",".join(header) + "\n")
        for segment in motion.segments:
            values = np.array([row for _, row in _columns(motion, segment)])
            start = f"{segment.step},{segment.mode.value},"
            file.writelines(start + ",".join(map(repr, sample.tolist())) + "\n" for sample in values.T)
    return path


def _present(motion: Motion, segment: Segment, name: str) -> Iterator[tuple[str, Array]]:
    """Yield an energy that only robots with dampers or springs have, if it is not zero throughout the motion."""
    if np.any(motion.channel(name)):
        yield f"{name}_J", getattr(segment, name)


def _columns(motion: Motion, segment: Segment) -> Iterator[tuple[str, Array]]:
    """Yield the name and the samples of each quantity."""
    yield "time_s", segment.time
    places = (("x", "m"), ("y", "m"), *((name, "rad") for name in motion.angles))
    for (name, unit), row in zip(places, segment.q, strict=True):
        yield f"{name}_{unit}", row
    for (name, unit), row in zip(places, segment.v, strict=True):
        yield f"{name}_rate_{unit}_per_s", row
    for kind, unit, rows in (
        ("torque", "Nm", segment.torque),
        ("power", "W", segment.power),
        ("work", "J", segment.work),
    ):
        for name, row in zip(motion.actuators, rows, strict=True):
            yield f"{name}_{kind}_{unit}", row
    yield "tangential_force_N", segment.force[0]
    yield "normal_force_N", segment.force[1]
    yield "friction_work_J", segment.friction_work
    yield from _present(motion, segment, "damping_work")
    yield "kinetic_J", segment.kinetic
    yield "potential_J", segment.potential
    yield from _present(motion, segment, "elastic")
    for number, name in enumerate(motion.points):
        label = name.replace(" ", "_")
        yield f"{label}_x_m", segment.points[0, number]
        yield f"{label}_y_m", segment.points[1, number]
