"""Curves of special points in the plane of two parameters, as plain arrays."""

from typing import Any

import numpy as np

from gaitopt.continuation.special_point import SpecialKind
from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array


@dataclass(frozen=True, eq=False, kw_only=True)
class SpecialCurve:
    """A curve of special points of one kind in the plane of two parameters.

    Attributes
    ----------
    kind : SpecialKind
    parameters : (str, str)
    units : (str, str)
        Units of the parameters; empty if they are unknown, as in files of earlier versions.
    values : (K, 2) array
        Both parameters of each point, in order along the curve, SI units.
    states : (K, n) array
        Gait of each point on the section.
    before, after : str
        Contact sequences on both sides.
    begin, end : str
        Reasons for which the curve ends: ``"closed"``, ``"range_end"``, or a text if no such point was found beyond.

    Examples
    --------
    >>> import numpy as np
    >>> curve = SpecialCurve(kind=SpecialKind.FOLD, parameters=("friction", "slope"), values=np.zeros((3, 2)),
    ...                      states=np.zeros((3, 1)), before="", after="", begin="closed", end="closed")
    >>> curve.closed
    True
    """

    kind: SpecialKind
    parameters: tuple[str, str]
    values: Array
    states: Array
    before: str
    after: str
    begin: str
    end: str
    units: tuple[str, str] = ("", "")

    def record(self) -> dict[str, Any]:
        """Return the curve as plain data."""
        return {
            "kind": self.kind.key,
            "parameters": list(self.parameters),
            "values": self.values.tolist(),
            "states": self.states.tolist(),
            "before": self.before,
            "after": self.after,
            "begin": self.begin,
            "end": self.end,
            "units": list(self.units),
        }

    @staticmethod
    def from_record(record: dict[str, Any]) -> "SpecialCurve":
        """Return the curve of plain data."""
        first, second = record["parameters"]
        unit, other = record.get("units", ("", ""))
        changed = {
            "kind": SpecialKind[record["kind"].upper()],
            "parameters": (first, second),
            "units": (unit, other),
            "values": np.array(record["values"], dtype=float).reshape(-1, 2),
            "states": np.array(record["states"], dtype=float),
        }
        return SpecialCurve(**{**record, **changed})

    def __repr__(self) -> str:
        return f"SpecialCurve({self.kind.key} in {' and '.join(self.parameters)}, points: {len(self.values)})"

    @property
    def closed(self) -> bool:
        """Whether the curve returns to its start."""
        return self.begin == "closed"
