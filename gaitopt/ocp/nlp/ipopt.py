"""The interior-point solver Ipopt and its options."""

import functools
import math
import mmap
import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import casadi as ca
import numpy as np
from attrs import evolve, field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError, suggest
from gaitopt.interrupts import defer_interrupt, stop_on_interrupt
from gaitopt.locks import ONE_AT_A_TIME
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.iteration_callback import IterationCallback
from gaitopt.ocp.nlp.nlp import Nlp
from gaitopt.ocp.nlp.nlp_solver import CONVERGED, Barrier, NlpResult, UpdateData
from gaitopt.parameters import instance_of, number_within, positive, whole_number
from gaitopt.progress import Observer
from gaitopt.status import Status

_STATUS = {
    "Solve_Succeeded": Status.SOLVED,
    "Solved_To_Acceptable_Level": Status.ACCEPTABLE,
    "Infeasible_Problem_Detected": Status.INFEASIBLE,
    "Restoration_Failed": Status.INFEASIBLE,
    "Search_Direction_Becomes_Too_Small": Status.FAILED,
    "Maximum_Iterations_Exceeded": Status.ITERATION_LIMIT,
    "Maximum_CpuTime_Exceeded": Status.TIME_LIMIT,
    "Maximum_WallTime_Exceeded": Status.TIME_LIMIT,
    "User_Requested_Stop": Status.INTERRUPTED,
    "Diverging_Iterates": Status.DIVERGING,
    "Invalid_Number_Detected": Status.INVALID_NUMBER,
    "Invalid_Option": Status.INVALID_OPTION,
    "Invalid_Problem_Definition": Status.INVALID_OPTION,
}

STOPPED = (Status.ITERATION_LIMIT, Status.TIME_LIMIT, Status.INTERRUPTED)
"""Statuses of a stopped solve, whose result is the best feasible iterate."""

LINEAR_SOLVERS = ("mumps", "spral", "ma27", "ma57", "ma77", "ma86", "pardiso")
"""Linear solvers accepted by the Ipopt of CasADi's wheel; the first two are part of it (MA97 crashes the process)."""


METIS = 5
"""Number of the ordering by nested dissection in MUMPS, which is part of CasADi's wheel."""

LARGE, APPROXIMATE_MINIMUM_FILL = 2000, 2
"""Number of unknowns beyond which MUMPS orders the matrix for approximate minimum fill, and its number for this: 15 %
less time at 4000 unknowns, but 7 % more at 500."""

BLAS_BUFFER = 2**27
"""Size of the buffer that the OpenBLAS of CasADi's wheel allocates in the first solve of a process [bytes]."""

MOST_ITERATIONS = 2**31 - 1
"""Largest iteration count of Ipopt, a 32-bit integer."""

LARGEST_PERTURBATION = 1e20
"""Default of Ipopt for the largest perturbation of the Hessian."""

THREADS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS")
"""Variables of the environment with which users set the number of threads of OpenBLAS."""


@functools.cache
def _load() -> None:
    """Load Ipopt, once in a process, with one thread for linear algebra unless the user has set a number.

    The blocks of these linear systems are so small that a second thread takes half of the processor time, for waiting.
    """
    given = any(name in os.environ for name in THREADS)
    if not given:
        os.environ[THREADS[0]] = "1"  # it is read when the library is loaded
    try:
        ca.has_nlpsol("ipopt")  # loads it if it is not loaded yet
    finally:
        if not given:
            del os.environ[THREADS[0]]


@functools.cache
def _require_memory_of_blas() -> None:
    """Raise MemoryError, once in a process, if OpenBLAS cannot allocate its buffer: it would retry without end."""
    if hasattr(mmap, "MAP_PRIVATE"):
        try:
            mmap.mmap(-1, BLAS_BUFFER, flags=mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS).close()
        except OSError:
            raise MemoryError("The memory is insufficient for the linear algebra of Ipopt.") from None


def _check_linear_solver(options: object, attribute: object, value: str) -> None:
    if value not in LINEAR_SOLVERS:
        raise InputError(f"Ipopt has no linear solver {value!r}. {suggest(str(value), LINEAR_SOLVERS)}")


@check_arguments
@frozen(kw_only=True)
class Ipopt:
    """The interior-point solver Ipopt.

    Attributes
    ----------
    tolerance : float
        Convergence tolerance (scaled), at most 1.
    max_iterations : int
    time_limit : float [s]
        Limit of a whole solve: all starts, grids and searches for a feasible motion together.
    linear_solver : str
        ``"mumps"`` and the slower ``"spral"`` are part of CasADi; others must be installed.
    permute : bool
        Whether MUMPS permutes large entries to the diagonal: slower on fine grids, as unknowns are paired with
        constraints, but necessary if constraints are nearly dependent.

    Raises
    ------
    InputError
        If an option has a value that Ipopt does not accept, or an observer of a solve with Ipopt calls Ipopt again.

    Examples
    --------
    >>> Ipopt(max_iterations=100).tolerance
    1e-08
    """

    tolerance: float = field(default=1e-8, validator=positive(upper=1.0))
    max_iterations: int = field(default=500, validator=whole_number(0, MOST_ITERATIONS))
    time_limit: float = field(default=math.inf, validator=positive("s", infinite=True))
    linear_solver: str = field(default="mumps", validator=_check_linear_solver)
    permute: bool = field(default=False, validator=instance_of(bool, example="True or False"))
    _deadline: float = field(
        default=math.inf, eq=False, repr=False, alias="_deadline", validator=number_within("s", infinite=True)
    )
    _patience: int = field(
        default=MOST_ITERATIONS, eq=False, repr=False, alias="_patience", validator=whole_number(0, MOST_ITERATIONS)
    )
    _perturbation: float = field(
        default=LARGEST_PERTURBATION, repr=False, alias="_perturbation", validator=positive(upper=LARGEST_PERTURBATION)
    )

    def with_patience(self, iterations: int, *, max_iterations: int) -> "Ipopt":
        """Return the solver that ends after some iterations if it is far from feasible, otherwise later."""
        return evolve(self, max_iterations=max_iterations, _patience=iterations)

    def limit_perturbation(self, largest: float) -> "Ipopt":
        """Return the solver that begins its restoration phase if a step needs a larger perturbation of the Hessian.

        The perturbation increases from one factorisation to the next, and the last ones are the slowest.
        """
        return evolve(self, _perturbation=largest)

    def start_clock(self) -> "Ipopt":
        """Return the solver whose time limit, counted from now, is that of all NLPs it solves together."""
        started = math.isfinite(self._deadline) or math.isinf(self.time_limit)
        return self if started else evolve(self, _deadline=self.deadline())

    def deadline(self) -> float:
        """Return the time at which a solve that begins now ends at the latest, on the clock of `time.perf_counter`."""
        return min(self._deadline, time.perf_counter() + self.time_limit)

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
        """Solve an NLP from a starting point, see :class:`gaitopt.ocp.nlp.nlp_solver.NlpSolver`."""
        with defer_interrupt():
            untimed = evolve(self, time_limit=math.inf)  # so that solvers are built once for all limits
            solver, callback = _compile(nlp, untimed, None if multipliers is None else barrier)
        near = {} if multipliers is None else {"lam_x0": multipliers[0], "lam_g0": multipliers[1]}
        limits = {"lbx": bounds.x_lower, "ubx": bounds.x_upper, "lbg": bounds.g_lower, "ubg": bounds.g_upper}
        _require_memory_of_blas()
        with _lock_solves():
            try:
                with stop_on_interrupt(callback.interrupt):
                    callback.watch(observer, bounds, self.deadline(), self._patience)
                    answer = solver(x0=x, p=data, **limits, **near)
            finally:
                callback.release()
            # Read before the lock is released: the next thread overwrites these.
            stats, best, interrupted, failure = solver.stats(), callback.best, callback.interrupted, callback.failure
            stop = callback.stop_message
        if failure is not None:
            raise failure
        message = str(stats["return_status"])
        if message == "Invalid_Option":  # Ipopt has not run: its result and counts are meaningless
            answer, stats = answer | {"x": x, "g": nlp.derivatives["jac_g"](x, data)[0]}, {}
        elif interrupted or message == "User_Requested_Stop":
            message = "User_Requested_Stop" if interrupted else stop
        status = _STATUS.get(message, Status.FAILED)
        if status is Status.SOLVED:
            message = CONVERGED
        if status in STOPPED and best is not None:
            answer = best.values
            message = f"{message}; the result is iterate {best.number}, the best feasible one"
        return NlpResult(
            status=status,
            message=message,
            x=np.asarray(answer["x"]).ravel(),
            g=np.asarray(answer["g"]).ravel(),
            objective=float(np.asarray(answer["f"]).item()),
            iterations=int(stats.get("iter_count", 0)),
            multipliers=(np.asarray(answer["lam_x"]).ravel(), np.asarray(answer["lam_g"]).ravel()),
        )

    def _options(self, nlp: Nlp, barrier: Barrier | None) -> dict[str, Any]:
        options: dict[str, Any] = {
            "ipopt.tol": float(self.tolerance),
            "ipopt.max_iter": int(self.max_iterations),
            "ipopt.linear_solver": self.linear_solver,
            "ipopt.print_level": 0,
            "ipopt.sb": "yes",
            "ipopt.mu_strategy": "adaptive",
            "ipopt.max_hessian_perturbation": float(self._perturbation),
            "ipopt.obj_scaling_factor": 1 / nlp.typical,
            "error_on_fail": False,
        }
        if self.linear_solver == "mumps" and (nlp.dissect or not self.permute):
            options["ipopt.mumps_permuting_scaling"] = 0  # nested dissection is inaccurate with it
        if self.linear_solver == "mumps" and (nlp.dissect or (nlp.independent and not self.permute)):
            # In 450 random problems, neither refined directions nor (in warm starts) scaled matrices lead to fewer
            # iterations or lower costs; without them, iterations take 12 % less time.
            options["ipopt.fast_step_computation"] = "yes"
            options |= {} if nlp.dissect or barrier is None else {"ipopt.mumps_scaling": 0}
        if self.linear_solver == "mumps" and nlp.dissect:
            options["ipopt.mumps_pivot_order"] = METIS
        elif self.linear_solver == "mumps" and nlp.n_variables > LARGE:
            options["ipopt.mumps_pivot_order"] = APPROXIMATE_MINIMUM_FILL
        if barrier is not None:
            distance, multiplier = (barrier / 10, barrier / 10) if isinstance(barrier, float) else barrier
            kinds = ("bound_push", "bound_frac", "slack_bound_push", "slack_bound_frac")
            options |= {f"ipopt.warm_start_{kind}": distance for kind in kinds}
            options |= {"ipopt.warm_start_init_point": "yes", "ipopt.warm_start_mult_bound_push": multiplier}
        return options


_running = threading.local()


@contextmanager
def _lock_solves() -> Iterator[None]:
    """Hold the lock of all solves; InputError within a solve by this thread, as a nested one crashes the process."""
    if getattr(_running, "now", False):
        raise InputError(
            "An observer of a solve with Ipopt must not call Ipopt: store the iterates and solve afterwards."
        )
    with ONE_AT_A_TIME:
        _running.now = True
        try:
            yield
        finally:
            _running.now = False


@functools.lru_cache(maxsize=32)
def _compile(nlp: Nlp, options: Ipopt, barrier: Barrier | None) -> tuple[ca.Function, IterationCallback]:
    """Return the solver of an NLP and its iteration callback; built once for equal options."""
    _load()
    callback = IterationCallback(nlp)
    settings = {**options._options(nlp, barrier), "iteration_callback": callback}
    return nlp.solver("gait", "ipopt", settings), callback
