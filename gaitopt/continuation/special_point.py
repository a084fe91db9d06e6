"""Special points of branches: bifurcations, changes of contact sequence, and ends."""

import math
from collections.abc import Callable, Hashable, Sequence
from dataclasses import replace
from enum import Enum

import numpy as np
from numpy.typing import NDArray

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array


class SpecialKind(Enum):
    """Kind of a special point; the value states what happens there.

    Examples
    --------
    >>> SpecialKind.PERIOD_DOUBLING.key
    'period_doubling'
    """

    FOLD = "the branch turns back: a multiplier passes +1"
    PERIOD_DOUBLING = "a multiplier passes -1: a gait of twice the period branches off"
    NEIMARK_SACKER = "a complex pair of multipliers leaves the unit circle"
    BRANCH_POINT = "two branches cross: a multiplier passes +1"
    DRIFT_REVERSAL = "the drift of the foot speed in complete slip changes its sign"
    SLIP_ONSET = "the force at a sticking foot touches the friction cone: a slip phase appears or vanishes"
    IMPACT_CONE = "the impulse of a touchdown touches the friction cone: its outcome changes"
    LOSS_OF_STICK = "the force at the end of a slip leaves the friction cone: the stick phase there appears or vanishes"
    EVENT_COINCIDENCE = "two events coincide: a phase at the end of a step appears or vanishes"
    SEQUENCE_CHANGE = "the contact sequence changes in several places"
    JOINT_STOP = "a joint stop is touched: its impact appears or vanishes"
    LIFT_OFF = "the normal force at the foot touches zero"
    ROLL_OVER = "the walker falls before the next touchdown"
    SCUFFING = "the swing foot touches the ground in the middle of a step"
    NO_TOUCHDOWN = "the swing foot does not touch down within the time limit of a step"
    DOUBLE_SUPPORT = "the trailing foot no longer separates at the touchdown"
    PAINLEVE = "slip is no longer well posed"
    UNBOUNDED_MULTIPLIER = "a multiplier grows without bound, as where a contact closes with no normal velocity"
    END = "no gait was found beyond this point"

    @property
    def label(self) -> str:
        """Name for tables and figures."""
        return LABELS.get(self, self.key.replace("_", " "))

    @property
    def key(self) -> str:
        """Name for files and JSON, in lower case."""
        return self.name.lower()


LABELS = {
    SpecialKind.NEIMARK_SACKER: "Neimark-Sacker",
    SpecialKind.PAINLEVE: "Painleve paradox",
    SpecialKind.ROLL_OVER: "fall",
}
"""Labels of the kinds that differ from their keys."""
LIMIT_OF_ROLLING = "limit of rolling over"
"""Label of the end of a branch at which the walker just rolls over its stance foot."""

ONE_FOLD = 1e-3
"""Largest scaled distance of the gaits of two folds that are one, if the parameter is the same, too."""

STOP_KINDS = {
    "lift_off": SpecialKind.LIFT_OFF,
    "fell": SpecialKind.ROLL_OVER,
    "no_touchdown": SpecialKind.NO_TOUCHDOWN,
    "double_support": SpecialKind.DOUBLE_SUPPORT,
    "painleve": SpecialKind.PAINLEVE,
    "jam": SpecialKind.PAINLEVE,
}
"""Kind of the end of a branch, by the reason for which a step beyond it stops."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SpecialPoint:
    """A point of a branch at which the gait changes qualitatively.

    Attributes
    ----------
    kind : SpecialKind
    value : float
        Parameter.
    width : float
        Width of the interval of the parameter to which the point is located.
    z : (n,) array
        Gait on the section.
    before, after : str
        Contact sequence of the gait on both sides, in the direction of the branch; at an end, `after` is the reason.
    multipliers_before, multipliers_after : complex arrays
        Multipliers on both sides; they differ if the return map has a kink.  Empty after an end.
    test : float
        Value of the test function whose zero is located; nan for changes of structure, which are located by bisection,
        and at an end by a fall whose kinetic energy is not zero.
    direction : (n,) array or None
        Eigenvector along which a gait of twice the period, or a crossing branch, leaves.

    Examples
    --------
    >>> import numpy as np
    >>> none = np.array([])
    >>> print(SpecialPoint(kind=SpecialKind.FOLD, value=0.5, width=1e-12, z=none, before="stick | stick",
    ...                    after="stick | stick", multipliers_before=none, multipliers_after=none))
    fold at 0.5: stick | stick
    """

    kind: SpecialKind
    value: float
    width: float
    z: Array
    before: str
    after: str
    multipliers_before: NDArray[np.complex128]
    multipliers_after: NDArray[np.complex128]
    test: float = float("nan")
    direction: Array | None = None

    @property
    def label(self) -> str:
        """Name for tables and figures; it distinguishes the limit of rolling over from other falls."""
        located = self.kind is SpecialKind.ROLL_OVER and not math.isnan(self.test)
        return LIMIT_OF_ROLLING if located else self.kind.label

    def __str__(self) -> str:
        change = self.before if self.before == self.after else f"{self.before} -> {self.after}"
        return f"{self.kind.key} at {self.value:.10g}: {change}"


def classify_change(before: Hashable, after: Hashable) -> SpecialKind:
    """Return the kind of a change between two structures of steps, each a sequence of modes and an impact.

    Examples
    --------
    >>> stick, slip = "stick", "slip+"
    >>> classify_change((((stick,), stick),), (((stick, slip), stick),)).key
    'slip_onset'
    """
    if not isinstance(before, tuple) or not isinstance(after, tuple) or len(before) != len(after):
        return SpecialKind.SEQUENCE_CHANGE
    pairs = [(one, other) for one, other in zip(before, after, strict=True) if one != other]
    if any(one[1] != other[1] for one, other in pairs):
        return SpecialKind.IMPACT_CONE
    kinds = {_classify_phases(one[0], other[0]) for one, other in pairs}
    return kinds.pop() if len(kinds) == 1 else SpecialKind.SEQUENCE_CHANGE


def _classify_phases(one: tuple[Hashable, ...], other: tuple[Hashable, ...]) -> SpecialKind:
    """Return the kind of the change between the phases of a step."""
    short, long = sorted((one, other), key=len)
    start = next((k for k in range(len(short)) if short[k] != long[k]), len(short))
    end = len(long) - len(short) + start
    if short[start:] != long[end:]:
        # The extra phases repeat the phase before: stick [slip stick], found one place earlier.
        return SpecialKind.SEQUENCE_CHANGE
    extra, neighbours = long[start:end], {*long[max(start - 1, 0) : start], *long[end : end + 1]}
    if not extra:
        return SpecialKind.SEQUENCE_CHANGE
    if all(_slips(mode) for mode in neighbours):
        last = not long[end:] and not _slips(extra[-1])
        return SpecialKind.EVENT_COINCIDENCE if last else SpecialKind.LOSS_OF_STICK
    return SpecialKind.SLIP_ONSET


def _slips(mode: Hashable) -> bool:
    return str(getattr(mode, "value", mode)).startswith("slip")


def merge_changes(
    points: Sequence[SpecialPoint], width: float, classify: Callable[[str, str], SpecialKind]
) -> list[SpecialPoint]:
    """Return special points in which successive changes of the contact sequence closer than a width are one change.

    Between them the gait has a sequence that exists only within rounding errors; a change to such a sequence and back
    is dropped.

    Parameters
    ----------
    points : sequence of SpecialPoint
        In order along a branch.
    width : float
        In the unit of the parameter.
    classify : callable
        Kind of a change between two contact sequences.
    """
    merged = list[SpecialPoint]()
    for point in points:
        last = merged[-1] if merged else None
        if last is None or not _are_one_change(last, point, width):
            merged.append(point)
            continue
        kind = classify(last.before, point.after)
        merged[-1] = replace(
            last,
            kind=kind,
            width=max(last.width, abs(point.value - last.value)),
            after=point.after,
            multipliers_after=point.multipliers_after,
        )
        if last.before == point.after:
            merged.pop()
    return merged


def merge_folds(points: Sequence[SpecialPoint], width: float, scale: Array) -> list[SpecialPoint]:
    """Return special points in which successive folds that coincide are one fold, or none if the branch does not turn.

    The sign of the slope between them is that of rounding errors: an even number of coinciding folds is no turn.

    Parameters
    ----------
    points : sequence of SpecialPoint
        In order along a branch.
    width : float
        Largest distance of coinciding folds, in the unit of the parameter.
    scale : (n,) array
        Natural size of each coordinate.

    Examples
    --------
    >>> import numpy as np
    >>> none = np.array([])
    >>> fold = SpecialPoint(kind=SpecialKind.FOLD, value=0.5, width=1e-12, z=np.zeros(1), before="stick | stick",
    ...                     after="stick | stick", multipliers_before=none, multipliers_after=none)
    >>> [len(merge_folds([fold] * count, 1e-10, np.ones(1))) for count in (1, 2, 3)]
    [1, 0, 1]
    """
    merged = list[SpecialPoint]()
    for point in points:
        last = merged[-1] if merged else None
        if last is not None and last.kind is point.kind is SpecialKind.FOLD:
            shift = float(np.max(np.abs(point.z - last.z) / scale))
            if abs(point.value - last.value) <= width and shift <= ONE_FOLD:
                merged.pop()
                continue
        merged.append(point)
    return merged


def _are_one_change(one: SpecialPoint, other: SpecialPoint, width: float) -> bool:
    near = abs(one.value - other.value) <= width and one.after == other.before
    return near and one.before != one.after and bool(other.multipliers_after.size) and other.before != other.after


def read_structure(name: str) -> tuple[tuple[tuple[str, ...], str], ...]:
    """Return phases and outcome of the touchdown of each step of a sequence as text."""
    steps = (step.partition(" | ") for step in name.split("; "))
    return tuple((tuple(phases.split()), impact) for phases, _, impact in steps)
