"""write_torques: the torques of a gait and the gains of a law as JSON, for a custom controller."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.signature import control_slope
from gaitopt.errors import InputError
from gaitopt.model.coordinate_entries import StateEntries, angle_entry
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.motion import Array, Motion, Segment
from gaitopt.motion.motion_view import MotionView
from gaitopt.motion.summary import plain
from gaitopt.motion.view_motion import AnyMotion, view_motion
from gaitopt.simulation.law_memory import LawMemory
from gaitopt.version import __version__

FORMAT, VERSION = "gaitopt torques", 1


@check_arguments
def write_torques(motion: AnyMotion, path: str | Path, *, law: Law | None = None) -> Path:
    """Write the first step of a motion as a table of torques and reference states over the time since touchdown.

    Torques are linear between samples.  Where a time appears twice, a phase ends and the next begins, and a torque may
    jump.

    Parameters
    ----------
    motion : Motion or PlanarMotion
        For a robot with several contacts, lengths, modes and slip speeds are written by name.
    path : str or Path
        Usually ends in ``.json``.
    law : Law, optional
        A feedback law about this motion, of a robot with one foot on the ground at a time.  Its gains, gain matrices in
        each piece (``gain_matrices``; ``slope`` is their derivative with respect to the time since the piece began),
        latched values and the derivative of its torques with respect to the state at each sample (``torque_by_state``)
        are written as well.

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
    view = view_motion(motion)
    if not view.actuators or not view.segments:
        raise InputError("The motion has no torques: it has no actuators or no samples.")
    path = Path(path)
    text = json.dumps(_table(motion, view, law), indent=1, allow_nan=False)
    with write_atomically(path) as temporary:
        temporary.write_text(text + "\n", encoding="utf-8")
    return path


def _table(motion: AnyMotion, view: MotionView, law: Law | None) -> dict[str, Any]:
    first = [segment for segment in view.segments if segment.step == view.segments[0].step]
    time, torque, q, v = (
        np.concatenate([getattr(segment, name) for segment in first], axis=-1) for name in ("time", "torque", "q", "v")
    )
    data: dict[str, Any] = {
        "format": FORMAT,
        "format_version": VERSION,
        "gaitopt": __version__,
        "sequence": " ".join(token.text for token in view.tokens),
        "parameters": view.parameters,
        "time_unit": "s",
        "time": (time - time[0]).tolist(),
        "mode": _by_contact(view, lambda i: [segment.modes[i].value for segment in first for _ in segment.time]),
        "torque_unit": _common_unit(view),
        "torque": {channel.name: row for channel, row in zip(view.actuators, torque.tolist(), strict=True)},
        **_coordinates(view, q, v, "rad", "angle", "rate"),
        **_coordinates(view, q, v, "m", "length", "length_rate"),
        "foot_speed_unit": "m/s",
        "foot_speed": _by_contact(view, lambda i: np.concatenate([part.slip_speeds[i] for part in first]).tolist()),
        "law": None if law is None else law.name,
        "gains": {} if law is None else law.gain_values,
    }
    if law is not None:
        if not isinstance(motion, Motion):
            raise InputError(
                "Gains are written for robots with one foot on the ground at a time; leave out the law, or export a "
                "controller (.c, .py)."
            )
        steps = [segment for segment in motion.segments if segment.step == motion.segments[0].step]
        names = {angle_entry(number): name for number, name in enumerate(motion.angles)}
        data["pieces"] = {
            "by": "clock" if law.index is None else names[law.index],
            "begin": law.breakpoints.tolist(),
        }
        data["gain_matrices"] = _gain_matrices(law)
        latched = np.array(_states(law, steps)).T[2 * q.shape[0] :].tolist()
        data["latched"] = dict(zip(law.memory.values, latched, strict=True))
        data["events"] = law.memory.events
        data["torque_by_state_unit"] = "N m/rad, N m s/rad, N s"
        data["torque_by_state"] = _torque_by_state(law, motion, steps)
    checked: dict[str, Any] = plain(data)
    return checked


def _by_contact(view: MotionView, values: Callable[[int], list[Any]]) -> Any:
    """Return values of each contact that closes by name; those of the only one without a name as they are."""
    named = {view.contacts[i].name: values(i) for i in view.closing if view.contacts[i].column}
    return named or values(view.closing[0])


def _common_unit(view: MotionView) -> Any:
    """Return the unit of the actuators; if they differ, each by name."""
    units = {channel.unit for channel in view.actuators}
    return units.pop() if len(units) == 1 else {channel.name: channel.unit for channel in view.actuators}


def _coordinates(view: MotionView, q: Array, v: Array, unit: str, name: str, rate: str) -> dict[str, Any]:
    """Return the coordinates of a unit and their rates by name; nothing if there are none."""
    rows = view.channels(unit)
    if not rows:
        return {}
    return {
        f"{name}_unit": unit,
        name: {channel.name: q[row].tolist() for row, channel in rows},
        f"{rate}_unit": f"{unit}/s",
        rate: {channel.name: v[row].tolist() for row, channel in rows},
    }


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
