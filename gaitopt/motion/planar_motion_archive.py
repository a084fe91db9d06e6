"""Motions of planar robots in groups of HDF5 files: arrays with a ``unit`` attribute each, names as attributes."""

import json
from collections.abc import Iterable
from dataclasses import asdict
from typing import Any

import h5py
import numpy as np

from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.planar.contact_entry import FORCE_UNITS, read_contact_entry
from gaitopt.model.terrain import Terrain
from gaitopt.motion.actuator_impulses import MOMENTS, ActuatorImpulses
from gaitopt.motion.contact_trajectories import ContactTrajectories
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_motion import PlanarEvent, PlanarMotion, PlanarSegment
from gaitopt.motion.stated_changes import spell_release

_NAMES = ("coordinates", "units", "actuators", "actuator_units", "points")
_SEGMENT = ("time", "q", "v", "torque", "force", "work", "friction_work", "damping_work", "kinetic", "potential")
_SEGMENT_ARRAYS = (*_SEGMENT, "elastic", "points")
_KINEMATICS = ("gap", "slide", "slip_speed", "rims")
_EVENT_ARRAYS = ("q", "v_minus", "v_plus", "impulse")
_IMPULSE_ARRAYS = ("impulse", "reaction", "v_minus", "v_plus", "generated", "absorbed")
_EVENT_NUMBERS = ("time", "energy_lost", "switch_work")


def write_planar_motion(group: h5py.Group, motion: PlanarMotion) -> None:
    """Write a motion into a group of an open file."""
    for name in _NAMES:
        group.attrs[name] = json.dumps(getattr(motion, name))
    group.attrs["contacts"] = json.dumps([asdict(entry) for entry in motion.contact_entries])
    group.attrs["travel"] = json.dumps(motion.travel)
    group.attrs["exchange"] = json.dumps(motion.exchange)
    group.attrs["links"] = json.dumps(motion.links)
    group.attrs.update(total_mass=motion.total_mass, total_mass_unit="kg")
    if motion.terrain is not None:
        group.attrs["terrain"] = json.dumps(motion.terrain.describe())
    group.create_group("parameters").attrs.update(motion.parameters)
    group.create_group("segments")
    group.create_group("events")  # created even if empty
    units = _units_of(motion)
    for i, segment in enumerate(motion.segments):
        part = group.create_group(f"segments/{i:04d}")
        part.attrs["modes"] = _describe_state(segment.state)
        _write_arrays(part, segment, _SEGMENT_ARRAYS, units)
        _write_arrays(part, segment.kinematics, _KINEMATICS, units)
    for i, event in enumerate(motion.events):
        part = group.create_group(f"events/{i:04d}")
        part.attrs.update({name: getattr(event, name) for name in _EVENT_NUMBERS})
        part.attrs.update(time_unit="s", energy_lost_unit="J", switch_work_unit="J", names=json.dumps(event.names))
        part.attrs.update(before=_describe_state(event.before), after=_describe_state(event.after))
        if event.outcome is not None:
            part.attrs["outcome"] = _describe_state(event.outcome)
        _write_arrays(part, event, _EVENT_ARRAYS, units)
        for stage in event.actuator_impulses:
            _write_impulses(part.create_group(f"actuator_impulses_{stage.moment}"), stage, units)


def read_planar_motion(group: h5py.Group) -> PlanarMotion:
    """Read what :func:`write_planar_motion` wrote into a group."""
    exchange = json.loads(group.attrs["exchange"])
    names: dict[str, Any] = {name: tuple(json.loads(group.attrs[name])) for name in _NAMES}
    return PlanarMotion(
        **names,
        contact_entries=tuple(map(read_contact_entry, json.loads(group.attrs["contacts"]))),
        travel=json.loads(group.attrs["travel"]),
        exchange=None if exchange is None else tuple(int(place) for place in exchange),
        links=tuple((int(a), int(b)) for a, b in json.loads(group.attrs["links"])),
        total_mass=float(group.attrs["total_mass"]),
        parameters={name: float(value) for name, value in group["parameters"].attrs.items()},
        segments=tuple(_read_segment(part) for _, part in sorted(group["segments"].items())),
        events=tuple(_read_event(part) for _, part in sorted(group["events"].items())),
        terrain=Terrain(**json.loads(group.attrs["terrain"])) if "terrain" in group.attrs else None,
    )


def _units_of(motion: PlanarMotion) -> dict[str, str]:
    """Return the unit of each array; units of rows are separated by commas."""
    stops = [FORCE_UNITS[entry.unit] for entry in motion.contact_entries]
    rates = _join(f"{unit}/s" for unit in motion.units)
    return {
        "time": "s",
        "q": _join(motion.units),
        "v": rates,
        "v_minus": rates,
        "v_plus": rates,
        "torque": _join(motion.actuator_units),
        "force": _join(stops),
        "impulse": _join(f"{unit} s" for unit in stops),
        "actuator impulse": _join(f"{unit} s" for unit in motion.actuator_units),
        "points": "m",
        "gap": _join(entry.unit for entry in motion.contact_entries),
        "slide": "m",
        "slip_speed": "m/s",
        "rims": "m, m, m, rad",
    }


def _write_impulses(group: h5py.Group, stage: ActuatorImpulses, units: dict[str, str]) -> None:
    group.attrs["outcome"] = _describe_state(stage.outcome)
    named = units | {"impulse": units["actuator impulse"], "reaction": units["impulse"]}
    _write_arrays(group, stage, _IMPULSE_ARRAYS, named)


def _join(units: Iterable[str]) -> str:
    return ", ".join(units) or "1"


def _write_arrays(group: h5py.Group, source: object, names: Iterable[str], units: dict[str, str]) -> None:
    for name in names:
        group.create_dataset(name, data=getattr(source, name)).attrs["unit"] = units.get(name, "J")


def _describe_state(state: ContactState) -> str:
    return json.dumps({name: mode.value for name, mode in state.modes})


def _read_state(text: str) -> ContactState:
    return ContactState.of(json.loads(text))


def _read_segment(group: h5py.Group) -> PlanarSegment:
    arrays: dict[str, Any] = _read_arrays(group, _SEGMENT_ARRAYS)
    kinematics = ContactTrajectories(**_read_arrays(group, _KINEMATICS))
    return PlanarSegment(state=_read_state(group.attrs["modes"]), kinematics=kinematics, **arrays)


def _read_event(group: h5py.Group) -> PlanarEvent:
    arrays: dict[str, Any] = _read_arrays(group, _EVENT_ARRAYS)
    numbers: dict[str, Any] = {name: float(group.attrs[name]) for name in _EVENT_NUMBERS}
    before = _read_state(group.attrs["before"])
    return PlanarEvent(
        names=tuple(spell_release(name, dict(before.modes)) for name in json.loads(group.attrs["names"])),
        before=before,
        after=_read_state(group.attrs["after"]),
        outcome=_read_state(group.attrs["outcome"]) if "outcome" in group.attrs else None,
        actuator_impulses=tuple(
            ActuatorImpulses(
                moment=moment,
                outcome=_read_state(group[name].attrs["outcome"]),
                **_read_arrays(group[name], _IMPULSE_ARRAYS),
            )
            for moment in MOMENTS
            if (name := f"actuator_impulses_{moment}") in group
        ),
        **numbers,
        **arrays,
    )


def _read_arrays(group: h5py.Group, names: Iterable[str]) -> dict[str, Array]:
    return {name: np.asarray(group[name][...], dtype=float) for name in names}
