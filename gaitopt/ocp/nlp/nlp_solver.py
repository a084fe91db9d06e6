"""Protocol of NLP solvers, and their result."""

from dataclasses import dataclass
from typing import Protocol

from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bounds import Bounds
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.progress import Observer
from gaitopt.status import Status

CONVERGED = "converged to a local optimum"
"""Message of a solved NLP, the same whichever solver finished."""


@dataclass(frozen=True, eq=False)
class NlpResult:
    """Result of an NLP solver.

    Attributes
    ----------
    status : Status
    message : str
        Of a solved NLP `CONVERGED`, otherwise the solver's report.
    x : (n_variables,) array
    g : (n_constraints,) array
    objective : float
    iterations : int
    multipliers : (n_variables,), (n_constraints,) arrays
        Of the bounds and of the constraints.
    """

    status: Status
    message: str
    x: Array
    g: Array
    objective: float
    iterations: int
    multipliers: tuple[Array, Array]


class NlpSolver(Protocol):
    """A solver of NLPs, an object that holds its options."""

    def minimise(
        self,
        nlp: Nlp,
        x: Array,
        data: Array,
        bounds: Bounds,
        observer: Observer,
        multipliers: tuple[Array, Array] | None = None,
        barrier: float = 1e-6,
    ) -> NlpResult:
        """Solve an NLP from a starting point.

        Parameters
        ----------
        nlp : Nlp
        x : (n_variables,) array
        data : (n_z,) array
        bounds : Bounds
        observer : Observer
            Called once per iteration.
        multipliers : (n_variables,), (n_constraints,) arrays, optional
            Of a nearby solution, from which the solver is warm-started.
        barrier : float
            How close: about the complementarity the start is expected to have (in units of the scaled objective).
        """
