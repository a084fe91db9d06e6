"""A robot as plain data: JSON text, with each of its Functions as CasADi serialises it."""

import hashlib
import json
import math
import weakref
import zlib
from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from gaitopt.dataclass import dataclass
from gaitopt.errors import ArchiveError
from gaitopt.locks import ONE_AT_A_TIME, cached_property
from gaitopt.parameters import Parameter

_LEVEL = 6
"""Level of the compression; the highest level takes fifteen times as long and reduces the size by a tenth."""

_NUMBERS = ("default", "lower", "upper")
"""Of a parameter."""

_RECORDS: "weakref.WeakValueDictionary[str, RobotRecord]" = weakref.WeakValueDictionary()


@dataclass(frozen=True, eq=False)
class RobotRecord:
    """A serialised robot.

    Attributes
    ----------
    name : str
    text : bytes
        JSON: names, parameters, contact model and Functions.
    digest : str
        SHA-256 of the text.  CasADi crashes on a damaged Function, so the text is read only if the digest agrees.
    casadi : str
        Version of CasADi that serialised the Functions.  It reads Functions of this and of older versions.

    Examples
    --------
    >>> record = RobotRecord.of("wheel", {"angles": ["theta"]}, casadi="3.8.2")
    >>> record.content()["angles"]
    ['theta']
    """

    name: str
    text: bytes
    digest: str
    casadi: str

    @staticmethod
    def of(name: str, content: Mapping[str, Any], *, casadi: str) -> "RobotRecord":
        """Return the record of a robot described by plain data."""
        text = json.dumps({"name": name, **content}, allow_nan=False).encode()
        return share_record(RobotRecord(name, text, hashlib.sha256(text).hexdigest(), casadi))

    @cached_property
    def compressed(self) -> bytes:
        """The text as a zlib stream."""
        return zlib.compress(self.text, _LEVEL)

    def is_intact(self) -> bool:
        """Return whether the text has the digest."""
        return hashlib.sha256(self.text).hexdigest() == self.digest

    def content(self) -> dict[str, Any]:
        """Return the plain data.

        Raises
        ------
        ArchiveError
            If the text is not the one that was written.
        """
        if not self.is_intact():
            raise ArchiveError(
                f"The stored robot {self.name!r} is damaged: its text does not have the stored SHA-256 digest. Use an "
                "intact copy of the file, or specify the robot: gait.with_robot(robot), or --problem SCRIPT.py on the "
                "command line."
            )
        content: dict[str, Any] = json.loads(self.text)
        return content

    def __reduce__(self) -> tuple[Any, ...]:
        return _expand, (self.name, self.compressed, self.digest, self.casadi)


def share_record(record: RobotRecord) -> RobotRecord:
    """Return the intact record of the same digest that is in use, or else this one: many gaits share one record."""
    if not record.is_intact():
        return record
    with ONE_AT_A_TIME:
        return _RECORDS.setdefault(record.digest, record)


def _expand(name: str, compressed: bytes, digest: str, casadi: str) -> RobotRecord:
    known = _RECORDS.get(digest)
    return known or share_record(RobotRecord(name, zlib.decompress(compressed), digest, casadi))


def describe_parameter(parameter: Parameter) -> dict[str, Any]:
    """Return a parameter as plain data; an infinite number is a text.

    Examples
    --------
    >>> describe_parameter(Parameter("friction", math.inf, "1", "friction", infinite=True))["default"]
    'inf'
    """
    numbers = {name: float(getattr(parameter, name)) for name in _NUMBERS}
    finite = {name: value if math.isfinite(value) else str(value) for name, value in numbers.items()}
    return asdict(parameter) | finite


def read_parameter(described: Mapping[str, Any]) -> Parameter:
    """Return the parameter that :func:`describe_parameter` described.

    Examples
    --------
    >>> read_parameter(describe_parameter(Parameter("friction", math.inf, "1", "friction", infinite=True))).default
    inf
    """
    return Parameter(**{**described, **{name: float(described[name]) for name in _NUMBERS}})


def explain_casadi_error(record: RobotRecord, error: Exception, installed: str) -> str:
    """Return the sentence on a record that the installed version of CasADi cannot read."""
    reason = next((line.strip() for line in reversed(str(error).splitlines()) if line.strip()), "no reason given")
    return (
        f"The stored robot {record.name!r} cannot be read: CasADi {record.casadi} wrote it and CasADi {installed} is "
        f"installed, which reads only files of the same or an older version ({reason}). Install CasADi {record.casadi} "
        "or newer, or specify the robot: gait.with_robot(robot), or --problem SCRIPT.py on the command line."
    )
