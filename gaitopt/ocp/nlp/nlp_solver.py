"""Protocol of NLP solvers, and their result."""

from collections.abc import Callable
from typing import Protocol

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.progress import Observer
from gaitopt.status import Status

UpdateData = Callable[[Array], Array]
"""Function from a decision vector, shape (n_variables,), to the data of the NLP near it, shape (n_z,)."""

Barrier = float | tuple[float, float]
"""Barrier parameter of a warm start, or the least distance of its variables from their bounds and the least multiplier
of a bound; with a barrier parameter both are a tenth of it."""

CONVERGED = "converged to a local optimum"
"""Message of a solved NLP, independent of the solver."""


@dataclass(frozen=True, eq=False)
class NlpResult:
    """Result of an NLP solver.

    Attributes
    ----------
    status : Status
    message : str
        `CONVERGED` for a solved NLP, otherwise the report of the solver.
    x : (n_variables,) array
    g : (n_constraints,) array
    objective : float
    iterations : int
    multipliers : (n_variables,), (n_constraints,) arrays
        Multipliers of the bounds and of the constraints.
    data : (n_z,) array, optional
        Data of the NLP that was solved, if the solver has updated them.
    """

    status: Status
    message: str
    x: Array
    g: Array
    objective: float
    iterations: int
    multipliers: tuple[Array, Array]
    data: Array | None = None


class NlpSolver(Protocol):
    """A solver of NLPs; the object stores its options."""

    def minimise(
        self,
        nlp: Nlp,
        x: Array,
        data: Array,
        bounds: Bounds,
        observer: Observer,
        multipliers: tuple[Array, Array] | None = None,
        barrier: Barrier = 1e-6,
        update_data: UpdateData | None = None,
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
            Multipliers of a nearby solution, from which the solver is warm-started.
        barrier : float or (float, float)
            Barrier parameter of a warm start: the expected complementarity of the initial point, scaled objective.
            Otherwise the least distance from bounds and the least multiplier of a bound.
        update_data : callable, optional
            Data that depend on the solution, such as the sign changes of joint powers.  `data` are those of `x`; a
            solver may update them after a step, and then returns those of the result.
        """
