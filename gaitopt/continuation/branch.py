"""Branches of periodic gaits over a parameter, and the points at which something changes along them."""

from dataclasses import dataclass

from gaitopt.motion.motion import Array
from gaitopt.stability.cycle import Cycle


@dataclass(frozen=True)
class SpecialPoint:
    """Where something changes along a branch.

    Attributes
    ----------
    kind : str
        ``"sequence"``, ``"stability"`` or ``"end"``.
    value : float
        Of the parameter there, in the middle of what is known.
    width : float
        Of the interval known to hold it.
    before : str
        ContactSequence of the gait before, and ``stable`` or ``unstable`` where that is what changes.
    after : str
        The same behind it; at an end, what becomes of a step beyond it: the key of a :class:`gaitopt.Stop`, or
        ``"no gait"``.

    Examples
    --------
    >>> print(SpecialPoint("sequence", 0.9141, 1e-6, "stick slip+ | stick", "stick | stick"))
    contact sequence at 0.914100: stick slip+ | stick -> stick | stick
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
        Parameter of each gait, in the order they were found.
    cycles : tuple of K Cycle
    ended : str
        Why the branch was not followed further.
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
