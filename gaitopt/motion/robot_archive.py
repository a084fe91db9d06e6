"""Robots in groups of HDF5 files: the serialised model, and physical quantities to compare robots by."""

import json
import weakref
from typing import Any

import h5py
import numpy as np

from gaitopt.errors import InputError
from gaitopt.lazy import Deferred
from gaitopt.model.physics_samples import Array, PhysicsSamples
from gaitopt.model.robot_record import RobotRecord, share_record
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Motion
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.stored_robot import StoredRobot

GROUP = "robot"

_STORED: "weakref.WeakValueDictionary[str, StoredRobot]" = weakref.WeakValueDictionary()
"""Robots of the gaits in use, by digest: the gaits of a study have one."""

SharedGroups = dict[str, h5py.Group]
"""Groups of robots that a file has already, by digest."""


def write_robot(group: h5py.Group, gait: Gait | PlanarGait, shared: SharedGroups | None = None) -> None:
    """Write the robot of a gait into the gait's group; a robot that the file already contains is linked.

    A gait of an older file whose robot is not known stays without: it keeps the name only.
    """
    stored = _to_store(gait)
    if stored is None:
        return
    record, physics = stored
    if shared is not None and record.digest in shared:
        group[GROUP] = shared[record.digest]
        return
    part = group.create_group(GROUP)
    part.attrs.update(name=record.name, casadi=record.casadi, sha256=record.digest)
    # Compressed here once for all files, not by the HDF5 library for each.
    size = len(record.text)
    model = part.create_dataset("model", (size,), np.uint8, chunks=(size,), compression="gzip")
    model.id.write_direct_chunk((0,), record.compressed)
    model.attrs.update(unit="1", content="JSON, UTF-8")
    for name in ("points", "values"):
        _write_table(part, name, getattr(physics, name))
    if shared is not None:
        shared[record.digest] = part


def serialise_robot(gait: Gait | PlanarGait) -> None:
    """Serialise the robot of a gait in advance; :func:`write_robot` then takes a fraction of the time.

    Examples
    --------
    >>> from gaitopt import load
    >>> serialise_robot(load("docs/examples/compass_slip.h5"))
    """
    stored = _to_store(gait)
    if stored is not None:
        _ = stored[0].compressed


def read_robot(group: h5py.Group, name: str, motion: Motion | None) -> StoredRobot:
    """Return the robot of the gait in a group, to be restored when it is used.

    A group without a robot contains its name only, which `motion` must fit; None if a robot is always stored.
    """
    if GROUP not in group and motion is not None:
        return StoredRobot.from_name(name, motion)
    part = group[GROUP]
    digest = str(part.attrs["sha256"])
    stored = _STORED.get(digest)
    if stored is None:
        text, casadi = bytes(part["model"][...]), str(part.attrs["casadi"])
        record = RobotRecord(str(part.attrs["name"]), text, digest, casadi)
        physics = PhysicsSamples(_read_table(part["points"]), _read_table(part["values"]))
        stored = StoredRobot.from_record(share_record(record), physics)
        if not record.is_intact():
            return stored
        _STORED[digest] = stored
    return stored


def _to_store(gait: Gait | PlanarGait) -> tuple[RobotRecord, PhysicsSamples] | None:
    """Return what is written of the robot of a gait; a robot that was not used since it was read stays unread."""
    source: Any = gait.robot_source
    if isinstance(source, StoredRobot) and source.record is not None and source.physics is not None:
        return source.record, source.physics
    try:
        robot: Any = gait.robot
    except InputError:
        if isinstance(source, Deferred):
            return None
        raise
    from gaitopt.model.physics import physics_of

    return robot.record, physics_of(robot)


def _write_table(group: h5py.Group, name: str, table: dict[str, Array]) -> None:
    """Write quantities of K states each as one dataset, (rows, K), with the name and number of rows of each."""
    rows = {key: np.atleast_2d(values) for key, values in table.items()}
    dataset = group.create_dataset(name, data=np.vstack(list(rows.values())))
    dataset.attrs["unit"] = "SI unit of each row"
    dataset.attrs["rows"] = json.dumps({key: None if table[key].ndim == 1 else len(rows[key]) for key in table})


def _read_table(dataset: h5py.Dataset) -> dict[str, Array]:
    numbers, table, first = np.asarray(dataset[...], dtype=float), {}, 0
    for name, count in json.loads(dataset.attrs["rows"]).items():
        last = first + (1 if count is None else count)
        table[name] = numbers[first] if count is None else numbers[first:last]
        first = last
    return table
