"""write_torques: the torques of a gait and the gains of a law as JSON, for a custom controller."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.signature import control_slope
from gaitopt.errors import InputError
from gaitopt.model.coordinate_entries import ANGLES, SLIDE, StateEntries, angle_entry
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.motion import Array, Motion, Segment, check_motion
from gaitopt.motion.summary import plain
from gaitopt.simulation.law_memory import LawMemory
from gaitopt.version import __version__

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
        A feedback law about this motion.  Its gains, gain matrices in each piece (``gain_matrices``; ``slope`` is their
        derivative by the time since the piece began), latched values and the derivative of its torques by the state at
        each sample (``torque_by_state``) are written as well.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the motion has no actuators or no samples.
    ArchiveError
        If the file is not writable; an older file of that name is then unchanged.

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
    check_motion(motion)
    if not motion.actuators or not motion.segments:
        raise InputError("The motion has no torques: it has no actuators or no samples.")
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
        "angle": dict(zip(motion.angles, q[ANGLES].tolist(), strict=True)),
        "rate_unit": "rad/s",
        "rate": dict(zip(motion.angles, v[ANGLES].tolist(), strict=True)),
        "foot_speed_unit": "m/s",
        "foot_speed": v[SLIDE].tolist(),
        "law": None if law is None else law.name,
        "gains": {} if law is None else law.gain_values,
    }
    if law is not None:
        names = {angle_entry(number): name for number, name in enumerate(motion.angles)}
        data["pieces"] = {
            "by": "clock" if law.index is None else names[law.index],
            "begin": law.breakpoints.tolist(),
        }
        data["gain_matrices"] = _gain_matrices(law)
        latched = np.array(_states(law, first)).T[2 * q.shape[0] :].tolist()
        data["latched"] = dict(zip(law.memory.values, latched, strict=True))
        data["events"] = law.memory.events
        data["torque_by_state_unit"] = "N m/rad, N m s/rad, N s"
        data["torque_by_state"] = _torque_by_state(law, motion, first)
    checked: dict[str, Any] = plain(data)
    return checked


def _states(law: Law, segments: list[Segment]) -> list[Array]:
    """Return the state y = (q, v, latched) at every sample of a step, with the events of the law that it releases."""
    memory, states = LawMemory(law), list[Array]()
    for segment in segments:
        for time, q, v in zip(segment.time - segments[0].time[0], segment.q.T, segment.v.T, strict=True):
            state = np.concatenate((q, v))
            last = states[-1][state.size :] if states else memory.begin(state)[state.size :]
            states.append(memory.apply_events(float(time), np.concatenate((state, last))))
    return states


def _gain_matrices(law: Law) -> list[dict[str, Any]]:
    """Return the matrices of a linear feedback in each piece of a law."""
    return [
        {
            "name": matrix.name,
            "rows": matrix.rows,
            "columns": matrix.columns,
            "value": matrix.values(law.table, matrix.first).tolist(),
            "slope": None if matrix.slope is None else matrix.values(law.table, matrix.slope).tolist(),
        }
        for matrix in law.gain_matrices
    ]


def _torque_by_state(law: Law, motion: Motion, segments: list[Segment]) -> dict[str, dict[str, list[float]]]:
    """Return how each torque, without its limits, changes with angles, rates and foot speed, at every sample."""
    entries = StateEntries(segments[0].q.shape[0])
    slopes = {sign: control_slope(law.control, sign) for sign in {segment.mode.sign for segment in segments}}
    columns = [*entries.angles, *entries.rates, entries.slip_velocity]
    values, states = [], iter(_states(law, segments))
    for segment in segments:
        for k, time in enumerate(segment.time - segments[0].time[0]):
            now = next(states)
            piece = law.piece(law.measure(time, now) - (1e-9 if k else 0.0))  # the last sample belongs to this phase
            values.append(np.asarray(slopes[segment.mode.sign](time, now, law.table[:, piece]))[:, columns])
    names = [*motion.angles, *(f"{name}_rate" for name in motion.angles), "foot_speed"]
    table = np.moveaxis(np.array(values), 0, -1)
    return {
        actuator: dict(zip(names, rows.tolist(), strict=True))
        for actuator, rows in zip(motion.actuators, table, strict=True)
    }
