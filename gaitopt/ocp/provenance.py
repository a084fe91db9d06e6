"""Provenance of a problem: the script that states it, and plain data of custom objects."""

import dataclasses
from collections.abc import Mapping
from typing import Any

from gaitopt.dataclass import dataclass


@dataclass(frozen=True, kw_only=True)
class ScriptRecord:
    """The script a problem comes from.

    Attributes
    ----------
    file : str
        File name.
    sha256 : str
        SHA-256 digest of the file, in hexadecimal digits.
    parameters : mapping of str to object
        Every parameter of the script with its value.
    changed : tuple of str
        Names of the parameters that differ from their defaults.

    Examples
    --------
    >>> ScriptRecord(file="walk.py", sha256="e3b0", parameters={"friction": 0.2}, changed=("friction",)).describe()
    {'file': 'walk.py', 'sha256': 'e3b0', 'parameters': {'friction': 0.2}, 'set': ['friction']}
    """

    file: str
    sha256: str
    parameters: Mapping[str, Any]
    changed: tuple[str, ...] = ()

    def describe(self) -> dict[str, Any]:
        """Return the record as plain data; other values are converted to text."""
        parameters = {name: value if is_plain(value) else repr(value) for name, value in self.parameters.items()}
        return {"file": self.file, "sha256": self.sha256, "parameters": parameters, "set": list(self.changed)}


def is_plain(value: Any) -> bool:
    """Return whether a value is a number, text, None, or a list or mapping of these.

    Examples
    --------
    >>> is_plain({"price": (0.1, None)}), is_plain(print)
    (True, False)
    """
    if isinstance(value, list | tuple):
        return all(map(is_plain, value))
    if isinstance(value, dict):
        return all(isinstance(key, str) and is_plain(item) for key, item in value.items())
    return value is None or isinstance(value, bool | int | float | str)


def plain_fields(options: Any) -> dict[str, Any]:
    """Return the fields of a dataclass that are plain data; fields that are dataclasses by their type and fields.

    Parameters
    ----------
    options : object
        Such as an objective; an object that is not a dataclass has no fields.

    Examples
    --------
    >>> from gaitopt import PositiveWork
    >>> plain_fields(PositiveWork(regeneration=0.5))
    {'regeneration': 0.5}
    """
    if not dataclasses.is_dataclass(options):
        return {}
    values = {field.name: getattr(options, field.name) for field in dataclasses.fields(options)}
    return {
        name: {"type": type(value).__name__} | plain_fields(value) if dataclasses.is_dataclass(value) else value
        for name, value in values.items()
        if dataclasses.is_dataclass(value) or is_plain(value)
    }
