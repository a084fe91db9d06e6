"""Iteration callback of CasADi solvers: reports progress, records the best feasible iterate, stops on request."""

import math
from dataclasses import dataclass

import casadi as ca
import numpy as np

from gaitopt.ocp.nlp.bounds import Bounds
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.progress import Iteration, Observer
from gaitopt.reductions import worst

FEASIBLE = 1e-6
"""Largest violation of an iterate that is worth keeping."""

OUTPUTS = tuple(ca.nlpsol_out(i) for i in range(ca.nlpsol_n_out()))
"""What a solver of CasADi tells its iteration callback, in this order."""


@dataclass(frozen=True, eq=False)
class BestIterate:
    """An iterate and its number."""

    number: int
    values: dict[str, ca.DM]


class IterationCallback(ca.Callback):
    """Ipopt's iteration callback: tells the observer, keeps the best iterate and passes on an interrupt."""

    def __init__(self, nlp: Nlp) -> None:
        ca.Callback.__init__(self)
        self._sizes = {"x": nlp.n_variables, "g": nlp.n_constraints, "f": 1, "p": 0}
        self._sizes |= {"lam_x": nlp.n_variables, "lam_g": nlp.n_constraints, "lam_p": 0}
        self._observer: Observer | None = None
        self._limits = np.empty(0), np.empty(0)
        self._count = 0
        self.best: BestIterate | None = None
        self.interrupted = False
        self.failure: Exception | None = None
        self.construct("iteration_tap", {})

    def watch(self, observer: Observer, bounds: Bounds) -> None:
        """Begin to listen to a solve."""
        self._observer, self._limits, self._count = observer, (bounds.g_lower, bounds.g_upper), 0
        self.interrupted, self.failure, self.best = False, None, None

    def interrupt(self) -> None:
        """Ask Ipopt to stop after the present iteration."""
        self.interrupted = True

    def rest(self) -> None:
        """Listen no more."""
        self._observer = None

    def get_n_in(self) -> int:
        """Return how many values CasADi hands over."""
        return ca.nlpsol_n_out()

    def get_n_out(self) -> int:
        """Return how many values it gets back."""
        return 1

    def get_name_in(self, i: int) -> str:
        """Return the name of a value handed over."""
        return ca.nlpsol_out(i)

    def get_name_out(self, i: int) -> str:
        """Return the name of the answer."""
        return "stop"

    def get_sparsity_in(self, i: int) -> ca.Sparsity:
        """Return the size of a value handed over."""
        return ca.Sparsity.dense(self._sizes[ca.nlpsol_out(i)], 1)

    def eval(self, arguments: list[ca.DM]) -> list[int]:
        """Take note of an iterate; the answer 1 stops the solver."""
        if self._observer is None:
            return [0]
        try:
            values = dict(zip(OUTPUTS, arguments, strict=True))
            g, (lower, upper) = np.asarray(values["g"]).ravel(), self._limits
            excess = worst(0.0, lower - g, g - upper)
            objective = float(values["f"])
            cheaper = self.best is None or objective < float(self.best.values["f"])
            if excess <= FEASIBLE and math.isfinite(objective) and cheaper:
                self.best = BestIterate(self._count, values)
            self._observer(Iteration(self._count, objective, excess))
            self._count += 1
        except KeyboardInterrupt:
            self.interrupt()
        except Exception as failure:  # CasADi would print it with all arguments and lose it
            self.failure = failure
            self.interrupt()
        return [int(self.interrupted)]
