"""Progress of long work, as data handed to an observer.

The library never prints.  A function that takes long accepts ``observer``, a callable that receives one
:class:`Iteration` at a time, and for a sequence left open one :class:`HomotopyIteration` after each of its relaxed problems; the
default looks away.
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


@dataclass(frozen=True)
class HomotopyIteration:
    """One relaxed problem of a homotopy.

    Attributes
    ----------
    number : int
        From 1.
    relaxation : float
        The relaxation's parameter t.
    objective : float
        Objective in its own unit, without what a penalty adds.
    complementarity : float
        Residual of the unrelaxed complementarity pairs, see :class:`gaitopt.Proposal`.
    iterations : int
    status : str
        How the relaxed solve ended.

    Examples
    --------
    >>> HomotopyIteration(1, 0.1, 0.016, 2e-3, 25, "solved").status
    'solved'
    """

    number: int
    relaxation: float
    objective: float
    complementarity: float
    iterations: int
    status: str


@dataclass(frozen=True)
class TuningStep:
    """One evaluation of a search for gains.

    Attributes
    ----------
    number : int
        From 1.
    objective : float
        Of the gains tried.
    best : float
        Lowest objective so far.

    Examples
    --------
    >>> TuningStep(3, 0.71, 0.64).best
    0.64
    """

    number: int
    objective: float
    best: float


Observer = Callable[[Iteration], None]
TuningObserver = Callable[[TuningStep], None]
SolveObserver = Callable[[Iteration | HomotopyIteration], None]


def silent(step: Iteration | HomotopyIteration | TuningStep) -> None:
    """Observe nothing; the default observer."""
