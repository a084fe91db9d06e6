"""Gains of a controller family with their bounds."""

import math

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError


@check_arguments
@dataclass(frozen=True)
class Gain:
    """A gain that is tuned between bounds.

    Attributes
    ----------
    name : str
    start : float
        Initial value.
    lower, upper : float
        Bounds.
    logarithmic : bool
        Whether the search uses the logarithm of the gain; `lower` must then be positive.

    Examples
    --------
    >>> Gain("hip_stiffness", 20.0, 0.0, 100.0).at(0.5)
    50.0
    """

    name: str
    start: float
    lower: float
    upper: float
    logarithmic: bool = False

    def __post_init__(self) -> None:
        if not self.lower <= self.start <= self.upper or not self.lower < self.upper < math.inf:
            raise InputError(f"Gain {self.name!r} needs finite bounds that contain its start, got {self}.")
        if self.logarithmic and self.lower <= 0:
            raise InputError(
                f"The lower bound of the logarithmic gain {self.name!r} must be positive, got {self.lower:g}."
            )

    def at(self, share: float) -> float:
        """Return the value at a fraction of the interval from the lower to the upper bound."""
        if self.logarithmic:
            return float(self.lower * (self.upper / self.lower) ** share)
        return float(self.lower + share * (self.upper - self.lower))

    @property
    def share(self) -> float:
        """Position of the start in the interval from the lower to the upper bound, as a fraction."""
        if self.logarithmic:
            return math.log(self.start / self.lower) / math.log(self.upper / self.lower)
        return (self.start - self.lower) / (self.upper - self.lower)
