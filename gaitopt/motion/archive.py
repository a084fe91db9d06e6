"""Gaits in open files: HDF5, version 2 of the layout documented in ``docs/file_format.md``.

Numbers are plain datasets with a ``unit`` attribute; names and text are attributes; the resolved problem is JSON.
Nothing of Python is needed to read a file.
"""

import dataclasses
import json
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from gaitopt.errors import ArchiveError, WordError
from gaitopt.model.modes import Mode
from gaitopt.motion.atomic import replacing_hdf5
from gaitopt.motion.gait import Gait, SolverReport, Verification, Violation
from gaitopt.motion.motion import Array, Jump, Motion, Segment
from gaitopt.motion.proposal import Proposal
from gaitopt.motion.solution import Solution, Table
from gaitopt.motion.summary import plain
from gaitopt.motion.word import Word
from gaitopt.progress import HomotopyStep
from gaitopt.status import Status

FORMAT = "gaitopt gait"
VERSION = 2
"""Version 1 had a bare vector of unknowns instead of ``solution``; its files are read without it."""

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
}
_JUMP_UNITS = {
    "impulse": "N s",
    "q": "m, m, then rad",
    "v_minus": "m/s, m/s, then rad/s",
    "v_plus": "m/s, m/s, then rad/s",
    "q_next": "m, m, then rad",
    "v_next": "m/s, m/s, then rad/s",
}
_SOLUTION_PARTS = ("unknowns", "constraints")
_JUMP_SCALARS = ("time", "energy_lost", "separation")


def save(gait: Gait, path: str | Path) -> Path:
    """Write a gait to a file, whole or not at all.

    Parameters
    ----------
    gait : Gait
    path : str or Path
        Usually ends in ``.h5``.

    Returns
    -------
    Path

    Raises
    ------
    ArchiveError
        If the file cannot be written; an older file of that name is then left as it was.

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import load, save
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = save(gait, f"{folder}/copy.h5")
    ...     load(path).word == gait.word
    True
    """
    path = Path(path)
    with replacing_hdf5(path) as file:
        write_gait(file, gait)
    return path


def write_gait(group: h5py.Group, gait: Gait) -> None:
    """Write a gait into a group of an open file, whose root is one too."""
    group.attrs.update(
        format=FORMAT, format_version=VERSION, robot=gait.robot, word=str(gait.word), status=gait.status.key
    )
    group.attrs["problem"] = json.dumps(plain(gait.problem))
    group.create_group("versions").attrs.update(gait.versions)
    _write_record(group.create_group("solver"), gait.solver)
    if gait.verification is not None:
        _write_record(group.create_group("verification"), gait.verification)
    if gait.proposal is not None:
        _write_record(group.create_group("proposal"), gait.proposal)
    if gait.solution is not None:
        _write_solution(group.create_group("solution"), gait.solution)
    _write_motion(group.create_group("motion"), gait.motion)


def load(path: str | Path) -> Gait:
    """Read a gait from a file.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Gait

    Raises
    ------
    ArchiveError
        If the file is missing, is not a gait of gaitopt, is damaged, or was written by a newer version.

    Examples
    --------
    >>> str(load("docs/examples/compass_slip.h5").word)
    'slip+ stick | slip+'
    """
    path = Path(path)
    if not path.is_file():
        raise ArchiveError(f"There is no file {path}.")
    if path.suffix == ".py":
        raise ArchiveError(
            f"{path} is a script, not a gait; run 'gaitopt solve {path}' first and name the file it writes."
        )
    try:
        with h5py.File(path, "r") as file:
            _check_format(file, path)
            return read_gait(file)
    except OSError as error:
        raise ArchiveError(f"{path} cannot be read as HDF5; it is damaged or another kind of file ({error}).") from None
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, RuntimeError, WordError) as error:
        raise ArchiveError(f"{path} is damaged: {type(error).__name__}: {error}") from None


def _check_format(file: h5py.File, path: Path) -> None:
    if file.attrs.get("format") != FORMAT:
        raise ArchiveError(f"{path} is an HDF5 file, but not a gait written by gaitopt.")
    version = int(file.attrs.get("format_version", 0))
    if version > VERSION:
        raise ArchiveError(
            f"{path} has format version {version}; this gaitopt reads up to {VERSION}. Upgrade gaitopt to read it."
        )


def _write_motion(group: h5py.Group, motion: Motion) -> None:
    for name in ("angles", "actuators", "points"):
        group.attrs[name] = json.dumps(getattr(motion, name))
    group.attrs["links"] = json.dumps(motion.links)
    group.attrs["total_mass"] = motion.total_mass
    group.attrs["total_mass_unit"] = "kg"
    group.create_group("parameters").attrs.update(motion.parameters)
    group.create_group("segments")
    group.create_group("jumps")  # there even when empty
    for i, segment in enumerate(motion.segments):
        part = group.create_group(f"segments/{i:04d}")
        part.attrs.update(mode=segment.mode.value, step=segment.step)
        _write_arrays(part, segment, _SEGMENT_UNITS)
    for i, jump in enumerate(motion.jumps):
        part = group.create_group(f"jumps/{i:04d}")
        part.attrs.update(mode=jump.mode.value, step=jump.step)
        part.attrs.update({name: getattr(jump, name) for name in _JUMP_SCALARS})
        part.attrs.update(time_unit="s", energy_lost_unit="J", separation_unit="m/s")
        _write_arrays(part, jump, _JUMP_UNITS)


def _write_arrays(group: h5py.Group, source: Segment | Jump, units: dict[str, str]) -> None:
    for name, unit in units.items():
        dataset = group.create_dataset(name, data=getattr(source, name))
        dataset.attrs["unit"] = unit


def _write_record(group: h5py.Group, record: SolverReport | Verification | Proposal) -> None:
    """Write a flat record as attributes: numbers and text as they are, lists as JSON."""
    for name, value in dataclasses.asdict(record).items():
        group.attrs[name] = json.dumps(plain(value)) if isinstance(value, list | tuple) else value


def _read_record(group: h5py.Group) -> dict[str, Any]:
    return {name: value.item() if hasattr(value, "item") else value for name, value in group.attrs.items()}


def read_gait(file: h5py.Group) -> Gait:
    """Read what :func:`write_gait` wrote into a group."""
    solver = _read_record(file["solver"])
    solver["violations"] = tuple(_violation(**violation) for violation in json.loads(solver["violations"]))
    solver["warnings"] = tuple(json.loads(solver["warnings"]))
    verification = None
    if "verification" in file:
        fields = _read_record(file["verification"])
        verification = Verification(**{**fields, "reasons": tuple(json.loads(fields["reasons"]))})
    return Gait(
        robot=str(file.attrs["robot"]),
        word=Word.parse(str(file.attrs["word"])),
        status=Status[str(file.attrs["status"]).upper()],
        motion=_read_motion(file["motion"]),
        problem=_numbers(json.loads(file.attrs["problem"])),
        solver=SolverReport(**solver),
        versions={name: str(value) for name, value in file["versions"].attrs.items()},
        solution=_read_solution(file["solution"]) if "solution" in file else None,
        verification=verification,
        proposal=_read_proposal(file["proposal"]) if "proposal" in file else None,
    )


def _read_proposal(group: h5py.Group) -> Proposal:
    fields = _read_record(group)
    rows: list[dict[str, Any]] = _numbers(json.loads(fields["steps"]))
    for row in rows:
        row.update({name: float("nan") for name, value in row.items() if value is None})  # JSON has nan as null
    steps = tuple(HomotopyStep(**row) for row in rows)
    return Proposal(**{**fields, "words": tuple(json.loads(fields["words"])), "steps": steps})


def _write_solution(group: h5py.Group, solution: Solution) -> None:
    group.attrs["intervals"] = solution.intervals
    for kind in _SOLUTION_PARTS:
        group.create_group(kind)  # there even when empty
        for name, table in getattr(solution, kind).items():
            part = group.create_group(f"{kind}/{name}")
            part.attrs["rows"] = json.dumps(table.rows)
            for field in ("values", "multipliers"):
                part.create_dataset(field, data=getattr(table, field)).attrs["unit"] = "SI, of each row its own"


def _read_solution(group: h5py.Group) -> Solution:
    parts = {
        kind: {
            name: Table(tuple(json.loads(part.attrs["rows"])), part["values"][...], part["multipliers"][...])
            for name, part in group[kind].items()
        }
        for kind in _SOLUTION_PARTS
    }
    return Solution(intervals=tuple(int(count) for count in group.attrs["intervals"]), **parts)


def _violation(place: str, name: str, size: float | str | None) -> Violation:
    """Return a violation from plain data, where null stands for nan and a text for an infinity."""
    return Violation(place, name, float("nan" if size is None else size))


def _numbers(value: Any) -> Any:
    """Return nested data with the texts "inf" and "-inf" as the numbers they stand for."""
    if isinstance(value, dict):
        return {key: _numbers(item) for key, item in value.items()}
    if isinstance(value, list):
        return [_numbers(item) for item in value]
    return float(value) if value in ("inf", "-inf") else value


def _read_motion(group: h5py.Group) -> Motion:
    return Motion(
        angles=tuple(json.loads(group.attrs["angles"])),
        actuators=tuple(json.loads(group.attrs["actuators"])),
        points=tuple(json.loads(group.attrs["points"])),
        links=tuple((int(a), int(b)) for a, b in json.loads(group.attrs["links"])),
        total_mass=float(group.attrs["total_mass"]),
        parameters={name: float(value) for name, value in group["parameters"].attrs.items()},
        segments=tuple(_read_segment(part) for _, part in sorted(group["segments"].items())),
        jumps=tuple(_read_jump(part) for _, part in sorted(group["jumps"].items())),
    )


def _read_segment(group: h5py.Group) -> Segment:
    return Segment(mode=Mode(group.attrs["mode"]), step=int(group.attrs["step"]), **_arrays(group, _SEGMENT_UNITS))


def _read_jump(group: h5py.Group) -> Jump:
    arrays: dict[str, Any] = _arrays(group, _JUMP_UNITS)
    scalars: dict[str, Any] = {name: float(group.attrs[name]) for name in _JUMP_SCALARS}
    return Jump(mode=Mode(group.attrs["mode"]), step=int(group.attrs["step"]), **scalars, **arrays)


def _arrays(group: h5py.Group, units: dict[str, str]) -> dict[str, Array]:
    return {name: np.asarray(group[name][...], dtype=float) for name in units}
