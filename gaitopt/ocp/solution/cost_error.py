"""Estimate of the difference between the objective on a grid and its value on an infinitely fine grid.

The objective on a grid exceeds its limit by about  c times the variation of the torques  (:class:`TorqueRamps`).  The
factor c follows from the objectives on two grids (Richardson's extrapolation with a measured error term).
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass

LEAST_REDUCTION = 1.5
"""Least ratio of the variations of two grids from which the factor is determined."""


@dataclass(frozen=True)
class GridCost:
    """Objective and variation of the torques of the solution on one grid.

    Attributes
    ----------
    cost : float
    variation : float
        See :attr:`gaitopt.ocp.solution.node_placement.TorqueRamps.variation` [N m s^2].
    """

    cost: float
    variation: float


def estimate_factor(grids: Iterable[GridCost], last: GridCost) -> float:
    """Return the error of the objective per variation, the largest found from pairs of grids; nan if there is none.

    Parameters
    ----------
    grids : iterable of GridCost
        Other grids; those whose variation is not clearly larger are ignored.
    last : GridCost

    Examples
    --------
    >>> round(estimate_factor([GridCost(1.2, 0.5)], GridCost(1.0, 0.1)), 6)
    0.5
    """
    factors = [
        abs(one.cost - last.cost) / (one.variation - last.variation)
        for one in grids
        if one.variation > LEAST_REDUCTION * last.variation
    ]
    return max(factors, default=math.nan)
