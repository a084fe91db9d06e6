"""Progress of long work, as data handed to an observer.

The library never prints.  A function that takes long accepts ``observer``, a callable that receives one
:class:`Iteration` at a time, for a sequence left open one :class:`HomotopyIteration` after each of its relaxed problems, and for
a verification one :class:`VerificationStep` after each walk; the default ignores them.
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
class VerificationStep:
    """One walk of a verification by walks from perturbed starts.

    Attributes
    ----------
    radius : float [rad/s]
        Of the ball of pushes in which the start lies.
    walks, starts : int
        Walks that are done in this ball, and starts in all; the first walk that does not return ends the ball.

    Examples
    --------
    >>> VerificationStep(0.125, 3, 200).walks
    3
    """

    radius: float
    walks: int
    starts: int


Observer = Callable[[Iteration], None]
TuningObserver = Callable[[Iteration | VerificationStep], None]
SolveObserver = Callable[[Iteration | HomotopyIteration], None]


def silent(step: Iteration | HomotopyIteration | VerificationStep) -> None:
    """Observe nothing; the default observer."""
