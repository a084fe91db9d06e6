"""Curves of special points in the plane of two parameters, as plain arrays."""

from typing import Any

import numpy as np

from gaitopt.continuation.special_point import SpecialKind
from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array

_MEETINGS = ("meets", "the sequence before", "the gait before it becomes")
"""Beginnings of the reasons of an end of codimension two in files of earlier versions, which state nothing else."""


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
    codimension_two : (bool, bool)
        Whether the curve begins and ends at a point of codimension two, because it meets a special point of another
        kind or of another contact sequence.

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
    codimension_two: tuple[bool, bool] = (False, False)

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
            "codimension_two": list(self.codimension_two),
        }

    @staticmethod
    def from_record(record: dict[str, Any]) -> "SpecialCurve":
        """Return the curve of plain data."""
        first, second = record["parameters"]
        unit, other = record.get("units", ("", ""))
        meets = [record[name].startswith(_MEETINGS) for name in ("begin", "end")]
        begins, ends = record.get("codimension_two", meets)
        changed = {
            "kind": SpecialKind[record["kind"].upper()],
            "parameters": (first, second),
            "units": (unit, other),
            "codimension_two": (begins, ends),
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
