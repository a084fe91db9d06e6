"""Branches of periodic gaits over a parameter and their special points."""

from dataclasses import dataclass

from gaitopt.motion.motion import Array
from gaitopt.stability.cycle import Cycle


@dataclass(frozen=True)
class SpecialPoint:
    """A change of contact sequence or stability along a branch, or its end.

    Attributes
    ----------
    kind : str
        ``"sequence"``, ``"stability"`` or ``"end"``.
    value : float
        Value of the parameter, in the middle of the interval to which the point is located.
    width : float
        Width of this interval.
    before : str
        Contact sequence of the gait before the point, with ``stable`` or ``unstable`` if the stability changes.
    after : str
        The same after the point; at an end, the outcome of a step beyond it: the key of a :class:`gaitopt.Stop`, or
        ``"no gait"``.

    Examples
    --------
    >>> print(SpecialPoint("sequence", 0.9141, 1e-6, "stick slip+ | stick", "stick | stick"))
    sequence at 0.914100: stick slip+ | stick -> stick | stick
    """

    kind: str
    value: float
    width: float
    before: str
    after: str

    def __str__(self) -> str:
        return f"{self.kind} at {self.value:.6f}: {self.before} -> {self.after}"


@dataclass(frozen=True, eq=False)
class Branch:
    """Gaits followed over a parameter.

    Attributes
    ----------
    parameter : str
    values : (K,) array
        Parameter of each gait, in order along the branch.
    cycles : tuple of K Cycle
    ended : str
        Reason for which the branch ends.
    special : tuple of SpecialPoint
        Changes of sequence and of stability, and the end of the branch, in order; the gaits on either side of each are
        among `cycles`.

    Examples
    --------
    >>> import numpy as np
    >>> Branch("friction", np.array([]), (), "no gait found").ended
    'no gait found'
    """

    parameter: str
    values: Array
    cycles: tuple[Cycle, ...]
    ended: str
    special: tuple[SpecialPoint, ...] = ()

    def __repr__(self) -> str:
        ends = f" from {self.values[0]:.6g} to {self.values[-1]:.6g}" if self.values.size else ""
        counts = f"gaits: {len(self.cycles)}{ends}, special points: {len(self.special)}"
        return f"Branch({self.parameter!r}, {counts}, ended: {self.ended})"

    def changes(self, kind: str) -> tuple[SpecialPoint, ...]:
        """Return the special points of a kind: ``"sequence"``, ``"stability"`` or ``"end"``."""
        return tuple(point for point in self.special if point.kind == kind)
