"""Progress of long work, as data handed to an observer.

The library never prints.  A function that takes long accepts ``observer``, a callable that receives one
:class:`Iteration` at a time; the default looks away.
"""

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Iteration:
    """One iteration of an optimisation.

    Attributes
    ----------
    number : int
        Iteration count, from 0.
    objective : float
        Objective in its own unit (dimensionless for a cost of transport).
    infeasibility : float
        Largest violation of a scaled constraint.

    Examples
    --------
    >>> Iteration(3, 0.016, 1e-9).number
    3
    """

    number: int
    objective: float
    infeasibility: float


Observer = Callable[[Iteration], None]


def silent(iteration: Iteration) -> None:
    """Observe nothing; the default observer."""
