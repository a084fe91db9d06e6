"""Contact models as plain data: the class of each part by name, and its fields."""

from collections.abc import Callable, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from gaitopt.errors import InputError
from gaitopt.model.contacts.contact_model import ContactModel
from gaitopt.model.contacts.impact_law import PlasticFrictional
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.transition import ComingToRest, LiftOff, PainleveParadox, SlipOnset

_BUILT_IN: dict[str, Callable[..., Any]] = {
    f"{part.__module__}:{part.__qualname__}": part
    for part in (PlasticFrictional, SlipOnset, ComingToRest, LiftOff, PainleveParadox)
}
"""Classes that are restored from a description.  A custom class is code, which a file does not contain."""


def describe_contact_model(model: ContactModel) -> dict[str, Any]:
    """Return a contact model as plain data.

    Examples
    --------
    >>> describe_contact_model(ContactModel())["impact"]["class"]
    'gaitopt.model.contacts.impact_law:PlasticFrictional'
    """
    return {"impact": _describe(model.impact), "transitions": [_describe(part) for part in model.transitions]}


def restore_contact_model(described: Mapping[str, Any], name: str) -> ContactModel:
    """Return the contact model that was described.

    Parameters
    ----------
    described : mapping
    name : str
        Name of the robot, for the error message.

    Raises
    ------
    InputError
        If a part of it is not a class of gaitopt.

    Examples
    --------
    >>> restore_contact_model(describe_contact_model(ContactModel()), "compass_biped") == ContactModel()
    True
    """
    parts = [described["impact"], *described["transitions"]]
    for part in parts:
        if part["class"] not in _BUILT_IN:
            raise InputError(
                f"The contact model of the stored robot {name!r} has the custom class {part['class']!r}, which a file "
                "cannot contain. Specify the robot: gait.with_robot(robot), or --problem SCRIPT.py on the command line."
            )
    impact, *transitions = (_BUILT_IN[part["class"]](**_read_fields(part["fields"])) for part in parts)
    return ContactModel(impact, tuple(transitions))


def is_described_by(model: ContactModel, described: Mapping[str, Any]) -> bool:
    """Return whether a contact model has the classes and fields of a description, wherever custom classes are defined.

    Examples
    --------
    >>> is_described_by(ContactModel(), describe_contact_model(ContactModel()))
    True
    """
    return _without_modules(describe_contact_model(model)) == _without_modules(described)


def _describe(part: object) -> dict[str, Any]:
    kind = type(part)
    values = {entry.name: getattr(part, entry.name) for entry in fields(part)} if is_dataclass(part) else {}
    return {
        "class": f"{kind.__module__}:{kind.__qualname__}",
        "fields": {name: _plain(value) for name, value in values.items()},
    }


def _plain(value: Any) -> Any:
    if isinstance(value, Mode):
        return {"mode": value.value}
    return value if isinstance(value, str | int) else repr(value)


def _read_fields(values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: Mode(value["mode"]) if isinstance(value, dict) else value for name, value in values.items()}


def _without_modules(described: Mapping[str, Any]) -> list[tuple[str, Any]]:
    """Return classes and fields; the module of a script has another name each time."""
    return [
        (part["class"].rsplit(":", 1)[-1].rsplit(".", 1)[-1], part["fields"])
        for part in (described["impact"], *described["transitions"])
    ]
