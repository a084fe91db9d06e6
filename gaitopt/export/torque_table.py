"""write_torques: the torques of a gait and the gains of a law as JSON, for a controller of one's own."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt import __version__
from gaitopt.control.law import Law, demand_slope
from gaitopt.errors import InputError
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.motion import Motion, Segment
from gaitopt.motion.summary import plain

FORMAT, VERSION = "gaitopt torques", 1


def write_torques(motion: Motion, path: str | Path, *, law: Law | None = None) -> Path:
    """Write the first step of a motion as a table of torques and reference states over the time since touchdown.

    Torques are linear between samples.  Where a time comes twice, a phase ends and the next begins, and a torque may
    jump.

    Parameters
    ----------
    motion : Motion
    path : str or Path
        Usually ends in ``.json``.
    law : Law, optional
        A feedback law about this motion, whose gains are written too, and how its torques change with the state at
        each sample, ``torque_by_state``.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the motion has no actuators or no samples.
    ArchiveError
        If the file cannot be written; an older file of that name is then left as it was.

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import load, write_torques
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = write_torques(load("docs/examples/compass_slip.h5").motion, f"{folder}/torques.json")
    ...     table = json.loads(path.read_text(encoding="utf-8"))
    >>> list(table["torque"]), table["torque_unit"], table["time"][0]
    (['ankle', 'hip'], 'N m', 0.0)
    """
    if not motion.actuators or not motion.segments:
        raise InputError("There are no torques to write: the motion has no actuators or no samples.")
    path = Path(path)
    text = json.dumps(_table(motion, law), indent=1, allow_nan=False)
    with write_atomically(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
    return path


def _table(motion: Motion, law: Law | None) -> dict[str, Any]:
    first = [segment for segment in motion.segments if segment.step == motion.segments[0].step]
    time, torque, q, v = (
        np.concatenate([getattr(segment, name) for segment in first], axis=-1) for name in ("time", "torque", "q", "v")
    )
    data: dict[str, Any] = {
        "format": FORMAT,
        "format_version": VERSION,
        "gaitopt": __version__,
        "sequence": str(motion.sequence(first[0].step) or ""),
        "parameters": motion.parameters,
        "time_unit": "s",
        "time": (time - time[0]).tolist(),
        "mode": [segment.mode.value for segment in first for _ in segment.time],
        "torque_unit": "N m",
        "torque": dict(zip(motion.actuators, torque.tolist(), strict=True)),
        "angle_unit": "rad",
        "angle": dict(zip(motion.angles, q[2:].tolist(), strict=True)),
        "rate_unit": "rad/s",
        "rate": dict(zip(motion.angles, v[2:].tolist(), strict=True)),
        "foot_speed_unit": "m/s",
        "foot_speed": v[0].tolist(),
        "law": None if law is None else law.name,
        "gains": {} if law is None else law.gain_values,
    }
    if law is not None:
        data["torque_by_state_unit"] = "N m/rad, N m s/rad, N s"
        data["torque_by_state"] = _torque_by_state(law, motion, first)
    checked: dict[str, Any] = plain(data)
    return checked


def _torque_by_state(law: Law, motion: Motion, segments: list[Segment]) -> dict[str, dict[str, list[float]]]:
    """Return how each torque, without its limits, changes with angles, rates and foot speed, at every sample."""
    n = segments[0].q.shape[0]
    slopes = {sign: demand_slope(law, n, sign) for sign in {segment.mode.sign for segment in segments}}
    columns = [*range(2, n), *range(n + 2, 2 * n), n]
    begin, values = segments[0], []
    held = np.zeros(0)
    if law.hold is not None:
        held = np.asarray(law.hold(begin.q[:, 0], begin.v[:, 0], law.table[:, 0])).ravel()
    for segment in segments:
        for k, time in enumerate(segment.time - begin.time[0]):
            now = np.concatenate((segment.q[:, k], segment.v[:, k], held))
            piece = law.piece(law.measure(time, now) - (1e-9 if k else 0.0))  # the last sample belongs to this phase
            values.append(np.asarray(slopes[segment.mode.sign](time, now, law.table[:, piece]))[:, columns])
    names = [*motion.angles, *(f"{name}_rate" for name in motion.angles), "foot_speed"]
    table = np.moveaxis(np.array(values), 0, -1)
    return {
        actuator: dict(zip(names, rows.tolist(), strict=True))
        for actuator, rows in zip(motion.actuators, table, strict=True)
    }
