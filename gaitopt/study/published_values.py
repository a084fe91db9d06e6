"""Studies: a figure with the numbers it stands on, beside published ones."""

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class PublishedValue:
    """A computed number beside a published one.

    Attributes
    ----------
    name : str
    value : float
        Ours.
    reference : float
        The published one.
    tolerance : float
        Largest difference its printed digits allow.
    source : str
        Where it is published, or how it was obtained independently.
    unit : str

    Examples
    --------
    >>> PublishedValue("multiplier", 0.734042, 0.734, 5e-4, "a paper").agrees
    True
    """

    name: str
    value: float
    reference: float
    tolerance: float
    source: str
    unit: str = "1"

    @property
    def difference(self) -> float:
        """Ours minus the published one."""
        return self.value - self.reference

    @property
    def agrees(self) -> bool:
        """Whether the difference is within what the printed digits allow."""
        return bool(abs(self.difference) <= self.tolerance)


@dataclass(frozen=True, eq=False)
class Reproduction:
    """What a study script returns.

    Attributes
    ----------
    figure : matplotlib Figure
    numbers : tuple of Number
        May be empty.
    remarks : tuple of str
        What a reader should know, such as a published number that does not come out.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> Reproduction(Figure()).numbers
    ()
    """

    figure: "Figure"
    numbers: tuple[PublishedValue, ...] = ()
    remarks: tuple[str, ...] = field(default=())
