"""What a solver of nonlinear programmes is asked, and what it answers."""

from dataclasses import dataclass
from typing import Protocol

from gaitopt.motion.motion import Array
from gaitopt.ocp.bounds import Bounds
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.progress import Observer
from gaitopt.status import Status


@dataclass(frozen=True, eq=False)
class NlpResult:
    """What a solver returned.

    Attributes
    ----------
    status : Status
    message : str
        The solver's own contact sequences.
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
    """A solver of nonlinear programmes that holds its options."""

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
        """Solve a programme from a starting point.

        Parameters
        ----------
        nlp : Nlp
        x : (n_variables,) array
        data : (n_z,) array
        bounds : Bounds
        observer : Observer
            Called once per iteration.
        multipliers : (n_variables,), (n_constraints,) arrays, optional
            Of a solution close by, from which the solver then goes on instead of starting anew.
        barrier : float
            How close: about the complementarity the start is expected to have (in units of the scaled objective).
        """
