"""The fields of a robot as a record, and back."""

from collections.abc import Mapping
from typing import Any

import casadi as ca

from gaitopt.errors import ArchiveError
from gaitopt.lazy import Deferred
from gaitopt.model.contacts.contact_model import ContactModel
from gaitopt.model.contacts.contact_model_record import describe_contact_model, restore_contact_model
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot_record import RobotRecord, describe_parameter, explain_casadi_error, read_parameter

_NAMES = ("angles", "actuators", "points")


def write_record(robot_fields: Mapping[str, Any]) -> RobotRecord:
    """Return the record of a robot.

    Parameters
    ----------
    robot_fields : mapping
        The fields of a :class:`gaitopt.Robot` by name.
    """
    values = dict(robot_fields)
    functions = {name: values.pop(name) for name in list(values) if isinstance(values[name], ca.Function)}
    content = {
        **{name: values[name] for name in ("description", "links", *_NAMES)},
        "parameters": [describe_parameter(parameter) for parameter in values["parameters"]],
        "contact_model": describe_contact_model(values["contact_model"]),
        "functions": {name: function.serialize() for name, function in functions.items()},
        "acceleration": {mode.value: function.serialize() for mode, function in values["acceleration"].items()},
    }
    return RobotRecord.of(values["name"], content, casadi=ca.CasadiMeta.version())


def read_fields(record: RobotRecord, contact_model: ContactModel | None = None) -> dict[str, Any]:
    """Return the fields of the robot of a record by name.

    Parameters
    ----------
    record : RobotRecord
    contact_model : ContactModel, optional
        Instead of the one described in the record, from which custom classes are not restored.

    Raises
    ------
    ArchiveError
        If the record is damaged, or the installed CasADi cannot read it.
    InputError
        If the contact model is custom and not given.
    """
    content = record.content()
    model = contact_model or restore_contact_model(content["contact_model"], record.name)
    try:
        functions = {name: ca.Function.deserialize(text) for name, text in content["functions"].items()}
        modes = {Mode(mode): ca.Function.deserialize(text) for mode, text in content["acceleration"].items()}
    except RuntimeError as error:
        raise ArchiveError(explain_casadi_error(record, error, ca.CasadiMeta.version())) from None
    return {
        "name": record.name,
        "description": content["description"],
        "parameters": tuple(map(read_parameter, content["parameters"])),
        "links": tuple((int(a), int(b)) for a, b in content["links"]),
        **{name: tuple(content[name]) for name in _NAMES},
        "contact_model": model,
        "acceleration": modes,
        "inverse_dynamics": Deferred(lambda: _inverse_dynamics(functions["dynamics"])),  # not in older records
        **functions,
    }


def _inverse_dynamics(dynamics: ca.Function) -> ca.Function:
    """Return the Function (q, v, a, u, p) -> M a + h - E u of the Function `dynamics`."""
    q, v, p = dynamics.sx_in()
    mass_matrix, bias, actuation = dynamics(q, v, p)
    a, u = ca.SX.sym("a", q.numel()), ca.SX.sym("u", actuation.shape[1])
    names, force = ["q", "v", "a", "u", "p"], mass_matrix @ a + bias - actuation @ u
    return ca.Function("inverse_dynamics", [q, v, a, u, p], [force], names, ["force"])
