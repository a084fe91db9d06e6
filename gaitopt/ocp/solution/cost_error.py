"""Estimate of the difference between the objective on a grid and its value on an infinitely fine grid.

The objective on a grid exceeds its limit by about  c times the variation of the torques  (:class:`TorqueRamps`).  The
factor c follows from the objectives on two grids (Richardson's extrapolation with a measured error term).  Two
measures of the variation are used, without and with jumps that extend over two intervals.  The estimate is the root
mean square of both: each alone is wrong by more than a factor of 3 in two or three of 100 random problems.
"""

import math
from collections.abc import Iterable, Sequence

from gaitopt.dataclass import dataclass

LEAST_RATIO = 1.5
"""Least ratio of the variations of two grids from which the factor is determined."""

NEGLIGIBLE = 1e-6
"""Share of a typical objective below which its error is relative to this share."""


@dataclass(frozen=True)
class GridCost:
    """Objective and variation of the torques of the solution on one grid.

    Attributes
    ----------
    cost : float
    variation, wide_variation : float
        See :class:`gaitopt.ocp.solution.node_placement.TorqueRamps` [N m s^2].
    """

    cost: float
    variation: float
    wide_variation: float = math.nan


def estimate_factor(grids: Iterable[GridCost], last: GridCost) -> float:
    """Return the error of the objective per variation, the largest found from pairs of grids; nan if none exists.

    Parameters
    ----------
    grids : iterable of GridCost
        Other grids; those with about the same variation are ignored, and coarser ones if a finer one is known.
    last : GridCost

    Examples
    --------
    >>> round(estimate_factor([GridCost(1.2, 0.5)], GridCost(1.0, 0.1)), 6)
    0.5
    """
    others = list(grids)
    narrow = _list_factors([(one.cost, one.variation) for one in others], last.cost, last.variation)
    wide = _list_factors([(one.cost, one.wide_variation) for one in others], last.cost, last.wide_variation)
    if not narrow or not wide or last.variation == 0:
        return max(narrow, default=math.nan)
    return math.hypot(max(narrow), max(wide) * last.wide_variation / last.variation) / math.sqrt(2)


def _list_factors(others: Sequence[tuple[float, float]], cost: float, variation: float) -> list[float]:
    """Return the differences of cost per difference of variation, from finer grids if there are any."""
    finer = [one for one in others if variation > LEAST_RATIO * one[1]]
    coarser = [one for one in others if one[1] > LEAST_RATIO * variation]
    return [abs(other_cost - cost) / abs(other - variation) for other_cost, other in finer or coarser]
