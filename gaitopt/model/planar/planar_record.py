"""The fields of a planar robot as a record, and back."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

import casadi as ca
import numpy as np

from gaitopt.errors import ArchiveError
from gaitopt.model.planar.contact_entry import read_contact_entry
from gaitopt.model.planar.mirror import Mirror
from gaitopt.model.planar.newton_euler import NewtonEuler
from gaitopt.model.robot_record import RobotRecord, describe_parameter, explain_casadi_error, read_parameter

KIND = "planar robot"
"""Entry ``kind`` of the content of a record; the records of robots with one foot on the ground have none."""

_FORMS = ("recursive", "lifted")
"""Equations without a mass matrix."""
_NAMES = ("coordinates", "units", "actuators", "actuator_units", "switches", "points")


def write_planar_record(robot_fields: Mapping[str, Any]) -> RobotRecord:
    """Return the record of a planar robot.

    Parameters
    ----------
    robot_fields : mapping
        The fields of a :class:`PlanarRobot` by name.
    """
    functions = {name: value for name, value in robot_fields.items() if isinstance(value, ca.Function)}
    content = {
        "kind": KIND,
        **{name: robot_fields[name] for name in ("travel", "links", *_NAMES)},
        "parameters": [describe_parameter(parameter) for parameter in robot_fields["parameters"]],
        "contacts": [asdict(contact) for contact in robot_fields["contacts"]],
        "mirror": describe_mirror(robot_fields["mirror"]),
        "functions": {name: function.serialize() for name, function in functions.items()},
        "newton_euler": {name: _describe_equations(robot_fields[name]) for name in _FORMS},
    }
    return RobotRecord.of(robot_fields["name"], content, casadi=ca.CasadiMeta.version())


def read_planar_fields(record: RobotRecord) -> dict[str, Any]:
    """Return the fields of the planar robot of a record by name.

    Raises
    ------
    ArchiveError
        If the record is damaged, or the installed CasADi cannot read it.
    """
    content = record.content()
    try:
        functions = {name: ca.Function.deserialize(text) for name, text in content["functions"].items()}
        forms = {name: _read_equations(content["newton_euler"][name]) for name in _FORMS}
    except RuntimeError as error:
        raise ArchiveError(explain_casadi_error(record, error, ca.CasadiMeta.version())) from None
    return {
        "name": record.name,
        "travel": content["travel"],
        **{name: tuple(content[name]) for name in _NAMES},
        "links": tuple((int(a), int(b)) for a, b in content["links"]),
        "parameters": tuple(map(read_parameter, content["parameters"])),
        "contacts": tuple(map(read_contact_entry, content["contacts"])),
        "mirror": read_mirror(content["mirror"]),
        **functions,
        **forms,
    }


def _describe_equations(equations: NewtonEuler) -> dict[str, Any]:
    return {"motion": equations.motion.serialize(), "impact": equations.impact.serialize(), "joints": equations.n_j}


def _read_equations(described: Mapping[str, Any]) -> NewtonEuler:
    motion, impact = (ca.Function.deserialize(described[name]) for name in ("motion", "impact"))
    return NewtonEuler(motion, impact, int(described["joints"]))


def is_planar(record: RobotRecord) -> bool:
    """Return whether a record is that of a planar robot."""
    return record.content().get("kind") == KIND


def describe_mirror(mirror: Mirror | None) -> dict[str, Any] | None:
    """Return an exchange of the legs as plain data."""
    if mirror is None:
        return None
    return {
        "coordinates": mirror.coordinates.tolist(),
        "actuators": mirror.actuators.tolist(),
        "contacts": list(mirror.contacts),
    }


def read_mirror(described: Mapping[str, Any] | None) -> Mirror | None:
    """Return the exchange of the legs that :func:`describe_mirror` described.

    Examples
    --------
    >>> exchange = Mirror(np.eye(2)[::-1], np.zeros((0, 0)), (1, 0))
    >>> read_mirror(describe_mirror(exchange)).contacts
    (1, 0)
    """
    if described is None:
        return None
    matrices = []
    for name in ("coordinates", "actuators"):
        size = len(described[name])
        matrices.append(np.array(described[name], dtype=float).reshape(size, size))
    return Mirror(matrices[0], matrices[1], tuple(int(place) for place in described["contacts"]))
