"""Gaits in open files: HDF5, in the layout documented in ``docs/file_format.md``.

Numbers are plain datasets with a ``unit`` attribute; names and text are attributes; the resolved problem is JSON.
Nothing of Python is needed to read a file.
"""

import dataclasses
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.errors import ArchiveError, InputError
from gaitopt.interrupts import hold_interrupt
from gaitopt.motion.atomic import check_gait_suffix
from gaitopt.motion.certificate import Certificate, NearConstraint, Sensitivity
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait, SolverReport, Verification, Violation
from gaitopt.motion.gait_schema import check_gait_content
from gaitopt.motion.hdf5 import read_hdf5, write_hdf5
from gaitopt.motion.hdf5_items import write_attributes, write_dataset
from gaitopt.motion.motion_archive import read_motion_group, write_motion
from gaitopt.motion.nlp_solution import Solution, Table
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.motion.planar_gait import AnyGait, PlanarGait, PlanarVerification, check_any_gait
from gaitopt.motion.planar_motion_archive import read_planar_motion, write_planar_motion
from gaitopt.motion.proposal import Proposal
from gaitopt.motion.robot_archive import SharedGroups, read_robot, write_robot
from gaitopt.motion.summary import plain
from gaitopt.progress import HomotopyIteration
from gaitopt.status import Status

KIND = "gait"
VERSION = 5
"""Version of the format.

Version 1 had a bare vector of unknowns instead of ``solution``; its files are read without it.  Versions 1 and 2 wrote
``word`` where version 3 writes ``sequence``.  Version 4 was that of robots with several contacts.  Since version 5,
files have a checksum.
"""

PLANAR = "several contacts"
"""Value of the attribute ``robot_kind`` in the files of robots with several contacts; other files have no such one."""

_FORMER_KEYS = {"word": "sequence", "words": "sequences"}

_SOLUTION_PARTS = ("unknowns", "constraints")


@check_arguments
def save(gait: AnyGait, path: str | Path) -> Path:
    """Write a gait to a file atomically; a Ctrl-C takes effect when the file is written.

    Parameters
    ----------
    gait : Gait or PlanarGait
    path : str or Path
        Ends in ``.h5`` or ``.hdf5``.

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the suffix is another one (CSV, JSON and C are written by ``gaitopt export``), or a solved gait has numbers
        that are not finite.
    ArchiveError
        If the file is not writable; an older file of that name is then unchanged.

    Examples
    --------
    >>> import tempfile
    >>> from gaitopt import load, save
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = save(gait, f"{folder}/copy.h5")
    ...     load(path).sequence == gait.sequence
    True
    """
    check_any_gait(gait)
    path = Path(path)
    check_gait_suffix(path)
    check_gait_content(gait)
    with hold_interrupt() as interrupt, write_hdf5(path) as file:
        write_gait(file, gait)
    interrupt.check()
    return path


def write_gait(group: h5py.Group, gait: AnyGait, shared: SharedGroups | None = None) -> None:
    """Write a gait into a group of an open file, whose root is one too.

    Parameters
    ----------
    group : h5py.Group
    gait : Gait or PlanarGait
    shared : dict, optional
        Robots in the file, for a file of many gaits: each robot is written once.
    """
    facts = {"format": f"gaitopt {KIND}", "format_version": VERSION, "robot": gait.robot_name}
    facts |= {"sequence": str(gait.sequence), "status": gait.status.key, "problem": json.dumps(plain(gait.problem))}
    write_attributes(group, facts)
    write_attributes(group.create_group("versions"), gait.versions)
    write_flat_record(group.create_group("solver"), gait.solver)
    for name in ("verification", "proposal", "certificate"):
        record = getattr(gait, name, None)
        if record is not None:
            write_flat_record(group.create_group(name), record)
    if gait.solution is not None:
        _write_solution(group.create_group("solution"), gait.solution)
    if isinstance(gait, PlanarGait):
        group.attrs["robot_kind"] = PLANAR
        write_planar_motion(group.create_group("motion"), gait.motion)
    else:
        write_motion(group.create_group("motion"), gait.motion)
    write_robot(group, gait, shared)


@check_arguments
def load(path: str | Path) -> AnyGait:
    """Read a gait from a file.

    Parameters
    ----------
    path : str or Path

    Returns
    -------
    Gait or PlanarGait

    Raises
    ------
    ArchiveError
        If the file is missing, is not a gait of gaitopt, is damaged, or was written by a newer version.

    Examples
    --------
    >>> str(load("docs/examples/compass_slip.h5").sequence)
    'slip+ stick | slip+'
    """
    path = Path(path)
    if path.suffix == ".py" and path.is_file():
        raise ArchiveError(
            f"{path} is a script, not a gait; run 'gaitopt solve {path}' first and name the file it writes."
        )
    with read_hdf5(path, KIND, VERSION) as file:
        return read_gait(file)


def write_flat_record(group: h5py.Group, record: Any) -> None:
    """Write a flat record as attributes: numbers and text as they are, lists as JSON."""
    fields = dataclasses.asdict(record).items()
    lists = {name: json.dumps(plain(value)) for name, value in fields if isinstance(value, list | tuple)}
    write_attributes(group, dict(fields) | lists)


def _read_record(group: h5py.Group) -> dict[str, Any]:
    record = {name: value.item() if hasattr(value, "item") else value for name, value in group.attrs.items()}
    return _rename_keys(record)


def _rename_keys(record: dict[str, Any]) -> dict[str, Any]:
    """Return a record with the keys of versions 1 and 2 renamed to those of version 3."""
    return {_FORMER_KEYS.get(name, name): value for name, value in record.items()}


def read_gait(file: h5py.Group) -> AnyGait:
    """Read what :func:`write_gait` wrote into a group, and check its content."""
    gait = _read_content(file)
    check_gait_content(gait)
    return gait


def _read_content(file: h5py.Group) -> AnyGait:
    kind = str(file.attrs.get("robot_kind", ""))
    if kind not in ("", PLANAR):
        raise ValueError(f"robot_kind must be {PLANAR!r}, got {kind!r}")
    fields: dict[str, Any] = {
        "status": Status[str(file.attrs["status"]).upper()],
        "problem": _rename_keys(_read_problem(file)),
        "solver": _read_solver(file["solver"]),
        "versions": {name: str(value) for name, value in file["versions"].attrs.items()},
        "solution": _read_solution(file["solution"]) if "solution" in file else None,
        "certificate": _read_certificate(file["certificate"]) if "certificate" in file else None,
    }
    sequence, name = str(_rename_keys(dict(file.attrs))["sequence"]), str(file.attrs["robot"])
    if kind == PLANAR:
        return PlanarGait(
            **fields,
            sequence=PhaseSequence.parse(sequence),
            motion=read_planar_motion(file["motion"]),
            robot=read_robot(file, name, None),
            verification=read_verification(file, PlanarVerification),
        )
    motion = read_motion_group(file["motion"])
    return Gait(
        **fields,
        sequence=ContactSequence.parse(sequence),
        motion=motion,
        robot=read_robot(file, name, motion),
        verification=read_verification(file, Verification),
        proposal=_read_proposal(file["proposal"]) if "proposal" in file else None,
    )


def _read_problem(file: h5py.Group) -> dict[str, Any]:
    problem = _numbers(json.loads(file.attrs["problem"]))
    if not isinstance(problem, dict):
        raise InputError(f"problem is {problem!s:.200}, accepted: a JSON object")
    return problem


def _read_solver(group: h5py.Group) -> SolverReport:
    solver = _read_record(group)
    solver["violations"] = tuple(_violation(**violation) for violation in json.loads(solver["violations"]))
    solver["warnings"] = tuple(json.loads(solver["warnings"]))
    solver["conflicts"] = tuple(_conflict(entry) for entry in json.loads(solver.get("conflicts", "[]")))
    return SolverReport(**solver)


def read_verification(file: h5py.Group, kind: Callable[..., Any]) -> Any:
    """Return the verification of a gait, if it has one."""
    if "verification" not in file:
        return None
    fields = _read_record(file["verification"])
    return kind(**{**fields, "reasons": tuple(json.loads(fields["reasons"]))})


def _read_proposal(group: h5py.Group) -> Proposal:
    fields = _read_record(group)
    rows: list[dict[str, Any]] = _numbers(json.loads(fields["steps"]))
    for row in rows:
        row.update({name: float("nan") for name, value in row.items() if value is None})  # JSON has nan as null
    steps = tuple(HomotopyIteration(**row) for row in rows)
    return Proposal(**{**fields, "sequences": tuple(json.loads(fields["sequences"])), "steps": steps})


def _read_certificate(group: h5py.Group) -> Certificate:
    fields = _read_record(group)
    nearest = tuple(NearConstraint(**constraint) for constraint in json.loads(fields["nearest"]))
    sensitivities = tuple(Sensitivity(**one) for one in json.loads(fields["sensitivities"]))
    return Certificate(**{**fields, "nearest": nearest, "sensitivities": sensitivities})


def _write_solution(group: h5py.Group, solution: Solution) -> None:
    group.attrs["intervals"] = solution.intervals
    group.attrs["cost_factor"] = solution.cost_factor
    if solution.fractions is not None:
        group.attrs["fractions"] = np.concatenate(solution.fractions)
    for kind in _SOLUTION_PARTS:
        group.create_group(kind)  # there even when empty
        for name, table in getattr(solution, kind).items():
            part = group.create_group(f"{kind}/{name}")
            write_attributes(part, {"rows": json.dumps(table.rows), "keys": json.dumps(table.keys)})
            for field in ("values", "multipliers"):
                write_dataset(part, field, getattr(table, field), "SI unit of each row")


def _read_solution(group: h5py.Group) -> Solution:
    parts = {
        kind: {
            name: Table(
                tuple(json.loads(part.attrs["rows"])),
                part["values"][...],
                part["multipliers"][...],
                tuple(json.loads(part.attrs.get("keys", "[]"))),
            )
            for name, part in group[kind].items()
        }
        for kind in _SOLUTION_PARTS
    }
    intervals = tuple(int(count) for count in group.attrs["intervals"])
    factor = float(group.attrs.get("cost_factor", np.nan))
    return Solution(intervals=intervals, fractions=_read_fractions(group, intervals), cost_factor=factor, **parts)


def _read_fractions(group: h5py.Group, intervals: tuple[int, ...]) -> tuple[tuple[float, ...], ...] | None:
    """Return the instants of the nodes of each phase as fractions of its duration; None for equal intervals."""
    if "fractions" not in group.attrs:
        return None
    nodes = np.split(np.asarray(group.attrs["fractions"], dtype=float), np.cumsum(np.array(intervals) + 1)[:-1])
    return tuple(tuple(part.tolist()) for part in nodes)


def _conflict(entry: dict[str, Any]) -> Conflict:
    numbers = {
        name: float("nan" if entry[name] is None else entry[name]) for name in ("limit", "missing", "sufficient")
    }
    return Conflict(**{**entry, **numbers})


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
