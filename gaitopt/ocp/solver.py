"""solve: from a problem to a gait."""

import functools

from gaitopt.errors import InputError
from gaitopt.model.step_check import require_valid_step
from gaitopt.motion.gait import Gait
from gaitopt.ocp.mode_search.homotopy import Homotopy
from gaitopt.ocp.mode_search.sequence_proposal import solve_open_sequence
from gaitopt.ocp.nlp.active_set import Newton
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solve.single_start import solve_from_start
from gaitopt.ocp.statement.initial_guess import Guess, LinearGuess, RandomPerturbation
from gaitopt.ocp.transcription.method import check_count
from gaitopt.progress import SolveObserver, silent
from gaitopt.reductions import rank_of
from gaitopt.status import Status

RETRIES = 3
"""How many other starts are tried where none has led to a gait."""

_HOPEFUL = (
    Status.INFEASIBLE,
    Status.ITERATION_LIMIT,
    Status.FAILED,
    Status.ACCEPTABLE,
    Status.DIVERGING,
    Status.UNCONFIRMED,
)
"""Endings after which another start may lead to a gait."""


def solve(
    problem: GaitProblem,
    *,
    starts: int = 1,
    solver: NlpSolver | None = None,
    homotopy: Homotopy | None = None,
    observer: SolveObserver = silent,
) -> Gait:
    """Find an energy-optimal gait.

    The problem is solved on a coarse grid first, then on its own, then with a finer integration until the plan is
    accurate between its nodes.  Where a start leads nowhere, up to three others are tried.

    A sequence with an open place, such as ``"slip+ stick | any"``, is closed first: the contact laws of the open place
    enter as complementarity pairs, relaxed and tightened step by step, and propose closed sequences, which are then
    solved. The gait returned has the cheapest of them; ``gait.proposal`` says how it was found.

    Parameters
    ----------
    problem : GaitProblem
    starts : int
        Number of starts; of several the cheapest gait found is returned.  The first is the problem's own guess, or a
        straight line; the others are seeded, so that a second call finds the same.
    solver : Newton or Ipopt, optional
        :class:`gaitopt.Newton` if not given: Ipopt, but for smooth objectives Newton's method is tried first.
    homotopy : Homotopy, optional
        How open places of the contact sequence are closed.
    observer : SolveObserver
        Receives an :class:`gaitopt.progress.Iteration` per iteration, and a
        :class:`gaitopt.progress.HomotopyIteration` per relaxed problem.

    Returns
    -------
    Gait
        Look at ``gait.status`` first: a numerical failure is not an exception.  Then :func:`gaitopt.verify` it.

    Raises
    ------
    InputError
        If `starts` is not a whole number of at least 1, `solver` is none, or the robot's leg exchange moves the robot
        or its touchdown guard does not describe the landing of the foot (see :func:`gaitopt.check_robot`).

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, compass_biped, solve
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared",
    ... )
    >>> gait = solve(problem)
    >>> gait.status.ok, round(gait.step_length, 6)
    (True, 0.45)
    """
    check_count("starts", starts, 1, 1000)
    if solver is not None and (isinstance(solver, type) or not hasattr(solver, "minimise")):
        raise InputError(f"solver must be a Newton(...) or an Ipopt(...), got {solver!r}.")
    require_valid_step(problem.robot)
    gaits: list[Gait] = []
    once = (
        functools.partial(solve_open_sequence, homotopy=homotopy or Homotopy())
        if problem.sequence.is_open
        else solve_from_start
    )
    while True:
        gaits.append(once(problem, _start(problem, len(gaits)), solver or Newton(), observer))
        solved = [gait for gait in gaits if gait.status.ok]
        last = gaits[-1].status
        if not last.ok and last not in _HOPEFUL:
            break
        if len(gaits) >= (starts if solved else starts + RETRIES):
            break
    if solved:
        return min(solved, key=lambda gait: rank_of(gait.solver.objective))
    return min(gaits, key=lambda gait: (gait.status in _HOPEFUL, rank_of(gait.solver.constraint_violation)))


def _start(problem: GaitProblem, number: int) -> Guess:
    """Return the start of an attempt, counted from 0."""
    if number == 0:
        return problem.guess or LinearGuess()
    return RandomPerturbation(number)
