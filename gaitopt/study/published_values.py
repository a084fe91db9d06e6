"""Reproductions: the figure of a study and its numbers, compared with published values."""

from dataclasses import field
from typing import TYPE_CHECKING

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@check_arguments
@dataclass(frozen=True)
class PublishedValue:
    """A computed value and the published one.

    Attributes
    ----------
    name : str
    value : float
        Computed value.
    reference : float
        Published value.
    tolerance : float
        Largest difference that the printed digits permit.
    source : str
        Publication, or the independent method.
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
        """Computed minus published value."""
        return self.value - self.reference

    @property
    def agrees(self) -> bool:
        """Whether the difference is within the tolerance."""
        return bool(abs(self.difference) <= self.tolerance)


@check_arguments
@dataclass(frozen=True, eq=False)
class Reproduction:
    """Result of a study script: a figure, its numbers and remarks.

    Attributes
    ----------
    figure : matplotlib Figure
    numbers : tuple of PublishedValue
        May be empty.
    remarks : tuple of str
        Remarks for readers, such as a published number that is not reproduced.

    Examples
    --------
    >>> from matplotlib.figure import Figure
    >>> Reproduction(Figure()).numbers
    ()
    """

    figure: "Figure"
    numbers: tuple[PublishedValue, ...] = ()
    remarks: tuple[str, ...] = field(default=())
