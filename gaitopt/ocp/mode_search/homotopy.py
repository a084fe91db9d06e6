"""Homotopy: a sequence of relaxed problems in which the complementarity pairs become exact."""

from collections.abc import Callable

import numpy as np
from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.nlp_solver import NlpResult, NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.transcription.method import Method
from gaitopt.ocp.transcription.relaxation import ExactPenalty, Relaxation
from gaitopt.ocp.transcription.transcription import Transcription
from gaitopt.parameters import instance_of, number_within, whole_number
from gaitopt.progress import HomotopyIteration, SolveObserver

LEAST_BARRIER, MOST_BARRIER = 1e-8, 1e-2
"""Bounds of the barrier parameter of a warm-started relaxed problem, which is a tenth of its relaxation parameter."""


@check_arguments
@frozen(kw_only=True)
class Homotopy:
    """Options of the homotopy that determines the open modes of a contact sequence.

    Attributes
    ----------
    relaxation : ExactPenalty, Scholtes or FischerBurmeister
    first : float
        Initial value of the relaxation parameter t.
    factor : float
        Factor by which t is multiplied after each relaxed problem.
    tolerance : float
        Complementarity residual at which the homotopy ends, see :class:`gaitopt.motion.Proposal`; at least 1e-7, as the
        tolerance of the solver is about 1e-8.
    max_steps : int
        Largest number of relaxed problems.
    intervals : int
        Number of intervals of an open phase, of equal length; the contact mode may change from one to the next.

    Raises
    ------
    InputError
        If the relaxation or a number is invalid.

    Examples
    --------
    >>> Homotopy(first=1e-2).relaxation
    ExactPenalty()
    """

    relaxation: Relaxation = field(
        factory=ExactPenalty, validator=instance_of(Relaxation, example="a relaxation such as ExactPenalty()")
    )
    first: float = field(default=0.1, validator=number_within(lower=1e-7, upper=1e3))
    factor: float = field(default=0.01, validator=number_within(lower=1e-4, upper=0.9))
    tolerance: float = field(default=1e-6, validator=number_within(lower=1e-7, upper=1e-2))
    max_steps: int = field(default=10, validator=whole_number(1, 100))
    intervals: int = field(default=40, validator=whole_number(10, 400))


def choose_relaxed_grid(problem: GaitProblem, homotopy: Homotopy) -> Method:
    """Return the grid of the relaxed problems of an open sequence: the coarsest one, or that of open phases."""
    sequence, method = problem.sequence, problem.transcription
    if not sequence.has_open_phases:
        return method.list_grids(sequence)[0]
    parts = {Mode.ANY: 1, Mode.STICK: 2}
    return method.replace_grid(tuple(homotopy.intervals // parts.get(mode, 4) for mode in sequence.phases))


@dataclass(frozen=True, eq=False)
class HomotopyPath:
    """Result of a homotopy.

    Attributes
    ----------
    steps : tuple of HomotopyIteration
    outcome : NlpResult
        Result of the last relaxed problem.
    ended : bool
        Whether the last relaxed problem was solved with a residual within the tolerance.
    """

    steps: tuple[HomotopyIteration, ...]
    outcome: NlpResult
    ended: bool


def follow_homotopy(
    homotopy: Homotopy,
    transcription: Transcription,
    x: Array,
    data: Array,
    limits: Bounds,
    residual: Callable[[Array], float],
    solver: NlpSolver,
    observer: SolveObserver,
) -> HomotopyPath:
    """Solve relaxed problems from an initial point until the pairs hold, or one is not solved.

    Parameters
    ----------
    homotopy : Homotopy
    transcription : Transcription
        Transcription of a structure with the relaxation of the homotopy.
    x, data : arrays
        Initial point, and data without the relaxation parameter.
    limits : Bounds
    residual : callable
        Function that returns the complementarity residual of a decision vector.
    solver : NlpSolver
    observer : SolveObserver
    """
    steps: list[HomotopyIteration] = []
    multipliers, t = None, homotopy.first
    while True:
        barrier = min(max(0.1 * t, LEAST_BARRIER), MOST_BARRIER)
        outcome = solver.minimise(transcription.nlp, x, np.append(data, t), limits, observer, multipliers, barrier)
        steps.append(
            HomotopyIteration(
                number=len(steps) + 1,
                relaxation=t,
                objective=float(transcription.nlp.objective(outcome.x, np.append(data, t))),
                complementarity=residual(outcome.x),
                iterations=outcome.iterations,
                status=outcome.status.key,
            )
        )
        observer(steps[-1])
        ended = outcome.status.ok and steps[-1].complementarity <= homotopy.tolerance
        if ended or not outcome.status.ok or len(steps) == homotopy.max_steps:
            return HomotopyPath(tuple(steps), outcome, ended)
        x, multipliers, t = outcome.x, outcome.multipliers, t * homotopy.factor
