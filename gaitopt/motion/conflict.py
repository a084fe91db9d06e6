"""Conflicting limits of a gait problem."""

import math

from gaitopt.dataclass import dataclass


@dataclass(frozen=True, kw_only=True)
class Conflict:
    """A limit that excludes all gaits near the starts of a solve, given the other limits.

    Attributes
    ----------
    name : str
        The limit, such as ``"torque limit of hip"``, or a condition of the contact sequence.
    setting : str
        Argument of the problem that specifies it, such as ``"Limits.torque"``.
    limit : float
        Its value; for a range, the bound that is exceeded.
    missing : float
        Least excess over the limit in a motion that satisfies all other limits; if the conflict is not separable, in
        one that satisfies all limits that do not conflict.
    sufficient : float
        Value of the limit at which such a motion exists on the examined grid, with a margin; nan if no admissible value
        is known.  The gait with this limit may still differ from its plan between the nodes or in its replay.
    unit : str
        Unit of `limit`, `missing` and `sufficient`.
    separable : bool
        Whether it is enough to relax this limit alone; otherwise all limits of the conflict must be relaxed.
    verified : bool or None
        Whether a gait was solved with the sufficient value and passed its replay; None if this was not tried.
    item : str
        The actuator, coordinate or point that is limited, if `setting` has a value for each; otherwise empty.

    Examples
    --------
    >>> print(Conflict(name="torque limit of hip", setting="Limits.torque", limit=6.0, missing=2.1, sufficient=8.15,
    ...                unit="N m", separable=True))
    torque limit of hip (Limits.torque) is 6 N m: 8.15 N m alone would suffice
    >>> print(Conflict(name="speed", setting="speed", limit=3.0, missing=2.0, sufficient=0.94, unit="m/s",
    ...                separable=True))
    speed is 3 m/s: 0.94 m/s alone would suffice
    """

    name: str
    setting: str
    limit: float
    missing: float
    sufficient: float
    unit: str
    separable: bool
    verified: bool | None = None
    item: str = ""

    def __str__(self) -> str:
        unit = "" if self.unit in ("", "1") else f" {self.unit}"
        name = self.name if self.name == self.setting else f"{self.name} ({self.setting})"
        if math.isnan(self.sufficient):
            text = f"{name} is violated by {self.missing:.3g}{unit}"
            return text if self.separable else f"{text}, together with the other conflicting limits"
        text = f"{name} is {self.limit:.4g}{unit}: {self.sufficient:.4g}{unit}"
        if self.verified is not None and self.separable:
            return f"{text} alone suffices for " + (
                "a verified gait"
                if self.verified
                else "a motion on a coarse grid, but no verified gait was found with it"
            )
        alone = f"{text} alone would suffice"
        return alone if self.separable else f"{text} would suffice if the other conflicting limits were relaxed too"
