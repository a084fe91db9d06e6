"""Contacts of planar robots as plain data."""

from collections.abc import Mapping
from typing import Any

from gaitopt.dataclass import dataclass

METRE, RADIAN = "m", "rad"

FORCE_UNITS = {METRE: "N", RADIAN: "N m"}
"""Units of the forces that do work on lengths and on angles."""


@dataclass(frozen=True)
class ContactEntry:
    """A contact of a planar robot, as plain data.

    Attributes
    ----------
    name : str
    kind : str
        ``"point"``, ``"arc"`` or ``"stop"``.
    slides : bool
        Whether the contact has a slide coordinate: a joint stop and a foot that only moves vertically have none.
    body : str
        Rigid body; closed contacts of one body share the slip direction and the tangential force.
    falls : bool
        Whether the robot has fallen as soon as the contact closes.
    conditional : bool
        Whether the contact closes only while it is armed.
    latched : bool
        Whether a stop holds in both directions once it has closed.
    released_by : tuple of (str, bool) or None
        Name of the contact whose opening (True) or closing (False) releases a latched stop.
    unit : str
        Unit of the gap: ``"m"``, or ``"rad"`` for the stop of an angle.

    Examples
    --------
    >>> ContactEntry("knee", "stop", slides=False, latched=True, released_by=("foot", True)).falls
    False
    """

    name: str
    kind: str
    slides: bool
    body: str = ""
    falls: bool = False
    conditional: bool = False
    latched: bool = False
    released_by: tuple[str, bool] | None = None
    unit: str = METRE

    @property
    def is_stop(self) -> bool:
        """Whether the contact is a joint stop."""
        return self.kind == "stop"


def read_contact_entry(described: Mapping[str, Any]) -> ContactEntry:
    """Return the contact that ``dataclasses.asdict`` described.

    Examples
    --------
    >>> from dataclasses import asdict
    >>> knee = ContactEntry("knee", "stop", slides=False, latched=True, released_by=("foot", True), unit="rad")
    >>> read_contact_entry(asdict(knee)) == knee
    True
    """
    release = described["released_by"]
    return ContactEntry(
        **{**described, "released_by": None if release is None else (str(release[0]), bool(release[1]))}
    )
