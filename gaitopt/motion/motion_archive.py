"""Motions in groups of HDF5 files: arrays with a ``unit`` attribute each, names and scalars as attributes."""

import json
from typing import Any

import h5py
import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.hdf5_items import write_attributes, write_dataset
from gaitopt.motion.motion import Array, Jump, Motion, Segment

_SEGMENT_UNITS = {
    "time": "s",
    "q": "m, m, then rad",
    "v": "m/s, m/s, then rad/s",
    "torque": "N m",
    "force": "N",
    "power": "W",
    "work": "J",
    "friction_work": "J",
    "kinetic": "J",
    "potential": "J",
    "points": "m",
    "rims": "m, m, m, then rad",
    "positive_work": "J",
}
_FORCE_UNITS = {"damping_work": "J", "elastic": "J"}
"""Arrays of a segment that are written only if they are not zero: those of robots with dampers or springs."""
_OPTIONAL = {"rims", "positive_work"}
"""Arrays that only some segments have: rims for round feet, and positive work for plans; earlier files have neither."""

_JUMP_UNITS = {
    "impulse": "N s",
    "q": "m, m, then rad",
    "v_minus": "m/s, m/s, then rad/s",
    "v_plus": "m/s, m/s, then rad/s",
    "q_next": "m, m, then rad",
    "v_next": "m/s, m/s, then rad/s",
}
_JUMP_SCALARS = ("time", "energy_lost", "separation")


def write_motion(group: h5py.Group, motion: Motion) -> None:
    """Write a motion into a group of an open file."""
    names = {name: json.dumps(getattr(motion, name)) for name in ("angles", "actuators", "points", "links")}
    write_attributes(group, names | {"total_mass": motion.total_mass, "total_mass_unit": "kg"})
    write_attributes(group.create_group("parameters"), motion.parameters)
    group.create_group("segments")
    group.create_group("jumps")  # created even if empty
    for i, segment in enumerate(motion.segments):
        part = group.create_group(f"segments/{i:04d}")
        write_attributes(part, {"mode": segment.mode.value, "step": segment.step})
        present = {name: unit for name, unit in _FORCE_UNITS.items() if np.any(getattr(segment, name))}
        _write_arrays(part, segment, _SEGMENT_UNITS | present)
    for i, jump in enumerate(motion.jumps):
        part = group.create_group(f"jumps/{i:04d}")
        scalars = {name: getattr(jump, name) for name in _JUMP_SCALARS}
        units = {"time_unit": "s", "energy_lost_unit": "J", "separation_unit": "m/s"}
        write_attributes(part, {"mode": jump.mode.value, "step": jump.step} | scalars | units)
        _write_arrays(part, jump, _JUMP_UNITS)


def _write_arrays(group: h5py.Group, source: Segment | Jump, units: dict[str, str]) -> None:
    for name, unit in units.items():
        if name in _OPTIONAL and getattr(source, name) is None:
            continue
        write_dataset(group, name, getattr(source, name), unit)


def read_motion_group(group: h5py.Group) -> Motion:
    """Read what :func:`write_motion` wrote into a group."""
    return Motion(
        angles=tuple(json.loads(group.attrs["angles"])),
        actuators=tuple(json.loads(group.attrs["actuators"])),
        points=tuple(json.loads(group.attrs["points"])),
        links=tuple((int(a), int(b)) for a, b in json.loads(group.attrs["links"])),
        total_mass=float(group.attrs["total_mass"]),
        # Files of versions 1 and 2 have one coefficient of friction.
        parameters={"static_friction_ratio": 1.0}
        | {name: float(value) for name, value in group["parameters"].attrs.items()},
        segments=tuple(_read_segment(part) for _, part in sorted(group["segments"].items())),
        jumps=tuple(_read_jump(part) for _, part in sorted(group["jumps"].items())),
    )


def _read_segment(group: h5py.Group) -> Segment:
    present = {name: unit for name, unit in _FORCE_UNITS.items() if name in group}
    arrays: dict[str, Any] = _arrays(group, _SEGMENT_UNITS | present)
    return Segment(mode=Mode(group.attrs["mode"]), step=int(group.attrs["step"]), **arrays)


def _read_jump(group: h5py.Group) -> Jump:
    arrays: dict[str, Any] = _arrays(group, _JUMP_UNITS)
    scalars: dict[str, Any] = {name: float(group.attrs[name]) for name in _JUMP_SCALARS}
    return Jump(mode=Mode(group.attrs["mode"]), step=int(group.attrs["step"]), **scalars, **arrays)


def _arrays(group: h5py.Group, units: dict[str, str]) -> dict[str, Array]:
    return {name: np.asarray(group[name][...], dtype=float) for name in units if name in group or name not in _OPTIONAL}
