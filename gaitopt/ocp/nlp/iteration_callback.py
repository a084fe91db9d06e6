"""Iteration callback of CasADi solvers: reports progress, records the best feasible iterate, stops the solver."""

import math
import time

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.progress import Iteration, Observer
from gaitopt.reductions import worst

FEASIBLE = 1e-6
"""Largest constraint violation of a feasible iterate."""

FAR_FROM_FEASIBLE = 0.5
"""Constraint violation, in scaled units, above which an iterate is far from feasible; that of initial points is 10."""

OUTPUTS = tuple(ca.nlpsol_out(i) for i in range(ca.nlpsol_n_out()))
"""Names of the values that a CasADi solver passes to its iteration callback, in order."""


@dataclass(frozen=True, eq=False)
class BestIterate:
    """An iterate and its number."""

    number: int
    values: dict[str, Array]


class IterationCallback(ca.Callback):
    """Iteration callback of Ipopt: calls the observer, records the best feasible iterate, stops when it has to.

    It stops Ipopt after an interrupt and at the deadline of a solve.
    """

    def __init__(self, nlp: Nlp) -> None:
        ca.Callback.__init__(self)
        self._sizes = {"x": nlp.n_variables, "g": nlp.n_constraints, "f": 1, "p": 0}
        self._sizes |= {"lam_x": nlp.n_variables, "lam_g": nlp.n_constraints, "lam_p": 0}
        self._observer: Observer | None = None
        self._limits = np.empty(0), np.empty(0)
        self._count, self._deadline, self._patience = 0, math.inf, 0
        self.best: BestIterate | None = None
        self.interrupted, self.stop_message = False, ""
        self.failure: Exception | None = None
        self.construct("iteration_tap", {})

    def watch(self, observer: Observer, bounds: Bounds, deadline: float, patience: int) -> None:
        """Set the observer, the constraint bounds and the limits of a solve, and reset the record.

        Parameters
        ----------
        observer : Observer
        bounds : Bounds
        deadline : float [s]
            Time on the clock of `time.perf_counter` after which the solve is stopped.
        patience : int
            Number of the iteration after which it is stopped at the next iterate that is far from feasible.
        """
        self._observer, self._limits, self._count = observer, (bounds.g_lower, bounds.g_upper), 0
        self._deadline, self._patience, self.stop_message = deadline, patience, ""
        self.interrupted, self.failure, self.best = False, None, None

    def interrupt(self) -> None:
        """Request that Ipopt stops after the present iteration."""
        self.interrupted = True

    def release(self) -> None:
        """Remove the observer after a solve."""
        self._observer = None

    def get_n_in(self) -> int:
        """Return the number of values that CasADi passes."""
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        """Return the number of values that CasADi receives."""
        return 1

    def get_name_in(self, i: int) -> str:
        """Return the name of a value that CasADi passes."""
        return ca.nlpsol_out(i)

    def get_name_out(self, i: int) -> str:
        """Return the name of the value that CasADi receives."""
        return "stop"

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        """Return the size of a value that CasADi passes."""
        return ca.Sparsity.dense(self._sizes[ca.nlpsol_out(i)], 1)

    def has_eval_buffer(self) -> bool:
        """Return whether values are passed as memory, which takes a fifth of the time of matrices."""
        return True

    def eval_buffer(self, arguments: tuple[memoryview | None, ...], results: tuple[memoryview, ...]) -> int:
        """Record an iterate and report it; a result of 1 stops the solver."""
        values = {name: np.frombuffer(part or b"") for name, part in zip(OUTPUTS, arguments, strict=True)}
        np.frombuffer(results[0])[:] = self.record(values)
        return 0

    def record(self, values: dict[str, Array]) -> bool:
        """Record an iterate, whose values are overwritten later, and report it; return whether the solver stops."""
        if self._observer is None:
            return False
        try:
            g, (lower, upper), objective = values["g"], self._limits, float(values["f"][0])
            excess = worst(0.0, lower - g, g - upper)
            better = self.best is None or objective < self.best.values["f"][0]
            if excess <= FEASIBLE and math.isfinite(objective) and better:
                self.best = BestIterate(self._count, {name: part.copy() for name, part in values.items()})
            self._observer(Iteration(self._count, objective, excess))
            self._check_limits(excess)
            self._count += 1
        except KeyboardInterrupt:
            self.interrupt()
        except Exception as failure:  # CasADi would print and discard it
            self.failure = failure
            self.interrupt()
        return self.interrupted or bool(self.stop_message)

    def _check_limits(self, excess: float) -> None:
        """Set the message of a stop if a limit of the solve is reached."""
        if time.perf_counter() > self._deadline:
            self.stop_message = "Maximum_WallTime_Exceeded"
        elif self._count >= self._patience and not excess <= FAR_FROM_FEASIBLE:
            self.stop_message = "Maximum_Iterations_Exceeded"
