"""Solution of a gait problem from one or several starts."""

import time
from typing import TYPE_CHECKING, overload

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.locks import one_at_a_time
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.step_check import require_valid_step
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait
from gaitopt.ocp.nlp.active_set import Newton
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.impossible_sequences import explain_impossibility
from gaitopt.ocp.solution.inaccurate_plans import InaccuratePlans
from gaitopt.ocp.solution.iteration_limits import RETRY, limit_iterations, limit_refinement
from gaitopt.ocp.solution.single_start import solve_from_start
from gaitopt.ocp.solution.start_selection import keep_interrupt, list_starts, solve_from_starts
from gaitopt.ocp.statement.initial_guess import Guess, LinearGuess, RandomPerturbation
from gaitopt.ocp.statement.warm_start import WarmStart
from gaitopt.ocp.transcription.method import check_count
from gaitopt.parameters import check_type
from gaitopt.progress import HomotopyIteration, Iteration, SolveObserver, silent
from gaitopt.reductions import rank_of
from gaitopt.status import Status

if TYPE_CHECKING:
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.ocp.mode_search.homotopy import Homotopy
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem

RETRIES = 3
"""Number of further starts that are tried if none has converged.

With a bound on the spectral radius there are none: other starts are farther from a stable gait than the optimum
without the bound.
"""

CLOSING = (Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD)
"""Modes in place of an open one, in order."""

INACCURATE = (Status.PLAN_INACCURATE, Status.UNCONFIRMED)
"""Statuses of a converged solve whose result is not a solution."""


@check_arguments
@overload
def solve(
    problem: GaitProblem,
    *,
    starts: int | None = None,
    solver: NlpSolver | None = None,
    homotopy: "Homotopy | None" = None,
    observer: SolveObserver = silent,
) -> Gait: ...


@check_arguments
@overload
def solve(
    problem: "PlanarProblem",
    *,
    starts: int = 1,
    solver: NlpSolver | None = None,
    homotopy: None = None,
    observer: SolveObserver = silent,
) -> "PlanarGait": ...


@check_arguments
@one_at_a_time
def solve(
    problem: "GaitProblem | PlanarProblem",
    *,
    starts: int | None = None,
    solver: NlpSolver | None = None,
    homotopy: "Homotopy | None" = None,
    observer: SolveObserver = silent,
) -> "Gait | PlanarGait":
    """Find an optimal gait: on a coarse grid first, which is refined until the plan is accurate between its nodes.

    Several starts are solved on the coarsest grid, and the two of lowest cost that differ are refined.  On the default
    grid, nodes are placed where the torques jump, and the grid is refined until the estimated error of the objective,
    ``gait.solver.cost_error``, is at most ``cost_tolerance`` of the transcription.

    After a failure on the coarsest grid, a motion that satisfies all limits is sought near the first start and three
    others.  The problem is solved from it if there is one; otherwise it is reported as infeasible, with the
    conflicting limits in ``gait.solver.conflicts``.  If neither is found, up to three other starts are tried.

    Open places of the sequence, as in ``"slip+ stick | any"``, are formulated as relaxed complementarity pairs; their
    solution proposes closed sequences, which are then solved.  ``gait.proposal`` is the record of this.

    Parameters
    ----------
    problem : GaitProblem or PlanarProblem
        A planar robot with any contacts is solved by :func:`gaitopt.ocp.solve_planar`.
    starts : int, optional
        Number of starts; the gait of lowest objective is returned.  By default, problems with a guess, a smooth
        objective or an open sequence have one start: their guess or the linear guess.  Others have two or three: the
        gait of least squared torques, that of the sequence ``"stick | stick"`` if the foot slips, and, unless these two
        nearly agree or lead to the same solution, the linear guess with a delayed swing.  With 1, the start is the
        guess of the problem or the linear guess.  A larger number is taken in this order from the guess of the problem,
        the three starts above and the linear guess (for a smooth objective, the linear guess without and with a delayed
        swing), and random perturbations of the linear guess with fixed seeds.
    solver : Newton or Ipopt, optional
        :class:`gaitopt.Newton` by default: Newton's method for smooth objectives, otherwise Ipopt.
    homotopy : Homotopy, optional
    observer : SolveObserver
        Receives an :class:`gaitopt.progress.Iteration` per iteration, those with another objective included (starts of
        least squared torques, feasible motions), and a :class:`gaitopt.progress.HomotopyIteration` per relaxed problem.

    Returns
    -------
    Gait or PlanarGait
        A numerical failure raises no exception: check ``gait.status``, then :func:`gaitopt.verify` the gait.  The file
        of a failed solve contains the problem, which ``gaitopt solve FILE`` solves again and
        :func:`gaitopt.ocp.restore_problem` returns.

    Raises
    ------
    InputError
        If `starts` is not a whole number of at least 1, `solver` is not a solver, or the robot fails the check of its
        leg exchange and touchdown guard (see :func:`gaitopt.check_robot`).

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, compass_biped, solve
    >>> gait = solve(GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared"))
    >>> gait.status.ok, round(gait.step_length, 6)
    (True, 0.45)
    """
    if isinstance(problem, GaitProblem):
        began, count = time.perf_counter(), _IterationCount(observer)
        best = _solve_problem(problem, starts, solver, homotopy, count)
        seconds = time.perf_counter() - began
        gait: Gait | PlanarGait = best if best.status.ok else _report_totals(best, count.iterations, seconds)
    else:
        from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
        from gaitopt.ocp.multicontact.planar_solver import solve_planar

        check_type("problem", problem, PlanarProblem, "a GaitProblem(...) or a PlanarProblem(...)")
        gait = solve_planar(problem, starts=1 if starts is None else starts, solver=solver, observer=observer)
    if gait.status.ok:
        return gait
    from gaitopt.ocp.problem_definition import record_definition

    return record_definition(gait, problem)


class _IterationCount:
    """An observer that counts the iterations of all starts and of the search for a feasible motion."""

    def __init__(self, observer: SolveObserver) -> None:
        self.iterations, self._observer = 0, observer

    def __call__(self, step: Iteration | HomotopyIteration) -> None:
        self.iterations += isinstance(step, Iteration) and step.number > 0
        self._observer(step)


def _report_totals(gait: Gait, iterations: int, seconds: float) -> Gait:
    """Return a failure with the iterations and the time of the whole solve, not of the start that it is taken from."""
    report = gait.solver
    solving = max(seconds - report.build_seconds, report.solve_seconds)
    total = max(iterations, report.iterations)
    return gait.replace_fields(solver=report.replace_fields(iterations=total, solve_seconds=solving))


def _solve_problem(
    problem: GaitProblem,
    starts: int | None,
    solver: NlpSolver | None,
    homotopy: "Homotopy | None",
    observer: SolveObserver,
) -> Gait:
    """Find the gait of a robot with one foot on the ground, or conclude why none exists."""
    check_count("starts", 1 if starts is None else starts, 1, 1000)
    solver = _check_solver(Newton() if solver is None else solver)
    if isinstance(solver, Newton | Ipopt):
        solver = solver.start_clock()
    require_valid_step(problem.robot)
    if reason := explain_impossibility(problem.sequence, problem):
        return _refuse(problem, reason)
    if problem.sequence.is_open:
        return _solve_open(problem, starts or 1, solver, homotopy, observer)
    if problem.stability is not None and _is_new(problem):
        return _solve_with_stability(problem, starts, solver, observer)
    plans = InaccuratePlans()
    gaits, conclusions = _solve_first(problem, starts, solver, observer, plans)
    if any(gait.solver.conflicts for gait in conclusions):
        return conclusions[0]
    if any(gait.status.ok or gait.status is Status.INTERRUPTED for gait in (*gaits, *conclusions)):
        return _best([*gaits, *conclusions])
    while not _is_finished(gaits, conclusions, starts or 1, _count_retries(problem)):
        gaits.append(solve_from_start(problem, _start(problem, len(gaits)), solver, observer, None, plans))
    return _best([*gaits, *conclusions])


def _refuse(problem: GaitProblem, reason: str) -> Gait:
    """Return the failure of a problem that is known to have no solution; its motion is near that of its guess."""
    closed = problem.replace(sequence=_close(problem.sequence)) if problem.sequence.is_open else problem
    gait = solve_from_start(closed, _start(closed, 0), Ipopt(max_iterations=1), silent)
    if gait.status is Status.INTERRUPTED:
        return gait
    failure = gait.with_failure(Status.INFEASIBLE, reason)
    return failure.replace_fields(solver=failure.solver.replace_fields(iterations=0, violations=()))


def _close(sequence: ContactSequence) -> ContactSequence:
    """Return one of the closed sequences with as many phases that an open one stands for.

    Examples
    --------
    >>> str(_close(ContactSequence.parse("slip+ any | any"))), str(_close(ContactSequence.parse("any stick | any")))
    ('slip+ stick | slip+', 'slip+ stick | slip+')
    """
    phases = list(sequence.phases)
    for number, mode in enumerate(phases):
        if mode is Mode.ANY:
            beside = (*phases[max(number - 1, 0) : number], *phases[number + 1 : number + 2])
            phases[number] = next(one for one in CLOSING if one not in beside)
    return ContactSequence(tuple(phases), phases[0] if sequence.impact is Mode.ANY else sequence.impact)


def _count_retries(problem: GaitProblem) -> int:
    return RETRIES if problem.stability is None else 0


def _is_new(problem: GaitProblem) -> bool:
    """Return whether the problem does not start from a solution."""
    return problem.guess is None or problem.guess.solution_for(problem.sequence) is None


def _solve_with_stability(problem: GaitProblem, starts: int | None, solver: NlpSolver, observer: SolveObserver) -> Gait:
    """Solve a problem from the optimal gait without its bound on the spectral radius."""
    from gaitopt.ocp.solution.radius_conflict import check_conflicts_with_radius, report_radius_conflict

    gait = _solve_problem(problem.replace(stability=None), starts, solver, None, observer)
    if gait.status is Status.INFEASIBLE:
        guesses = [_start(problem, number) for number in range(max(starts or 1, 2))]
        return check_conflicts_with_radius(problem, gait, guesses, solver, observer)
    if not gait.status.ok:
        return gait
    bounded = _solve_problem(problem.replace(guess=WarmStart(gait)), starts, solver, None, observer)
    return report_radius_conflict(problem, bounded, gait) if bounded.status in RETRY else bounded


def _solve_first(
    problem: GaitProblem, starts: int | None, solver: NlpSolver, observer: SolveObserver, plans: InaccuratePlans
) -> tuple[list[Gait], list[Gait]]:
    """Return the gaits of the first starts, or none if they are to be repeated, and the conclusion from a failure."""
    limited, listed = limit_iterations(solver), list_starts(problem, starts)
    limited_refinement, same = limit_refinement(solver), starts is None
    gaits = solve_from_starts(problem, listed, limited_refinement, observer, limited, plans=plans, stop_if_same=same)
    first = gaits[0]
    if any(gait.status not in RETRY or gait.status is Status.PLAN_INACCURATE for gait in gaits):
        return gaits, []
    bounded = _solve_by_homotopy(problem, first, limited_refinement, observer)
    if bounded is not None:
        return [bounded], []
    from gaitopt.ocp.solution.infeasibility import conclude_failure  # which few solves need

    guesses = [_start(problem, number) for number in range(max(starts or 1, 1 + _count_retries(problem)))]
    conclusion = conclude_failure(problem, first, guesses, solver, observer, plans)
    if conclusion is not first:
        others = listed[1:] if conclusion.status.ok else []
        more = solve_from_starts(problem, others, solver, observer, limited, plans=plans) if others else []
        return [first], keep_interrupt([conclusion, *more])
    return ([] if first.status is Status.ITERATION_LIMIT and limited != solver else [first]), []


def _solve_by_homotopy(problem: GaitProblem, failure: Gait, solver: NlpSolver, observer: SolveObserver) -> Gait | None:
    """Return a gait with the bound on the spectral radius, approached from the initial gait; None if none exists.

    After an interrupt, the failed gait is returned with the status of an interrupt.
    """
    if problem.stability is None or not isinstance(problem.guess, WarmStart) or _is_new(problem):
        return None
    from gaitopt.ocp.solution.radius_homotopy import approach_radius

    near = approach_radius(problem, problem.guess.gait, solver, observer)
    if near is not None and near.status is Status.INTERRUPTED:
        return failure.with_failure(Status.INTERRUPTED, near.solver.message)
    gait = None if near is None else solve_from_start(problem, WarmStart(near), solver, observer)
    return gait if gait is not None and (gait.status.ok or gait.status is Status.INTERRUPTED) else None


def _solve_open(
    problem: GaitProblem, starts: int, solver: NlpSolver, homotopy: "Homotopy | None", observer: SolveObserver
) -> Gait:
    """Solve a problem with an open contact sequence from each start, or conclude why it is not solved."""
    from gaitopt.ocp.mode_search.homotopy import Homotopy
    from gaitopt.ocp.mode_search.open_infeasibility import conclude_proposal, conclude_without_pairs
    from gaitopt.ocp.mode_search.sequence_proposal import solve_open_sequence

    homotopy = homotopy or Homotopy()
    guesses = [_start(problem, number) for number in range(max(starts, 1 + RETRIES))]
    gaits: list[Gait] = []
    while not _is_finished(gaits, [], starts, RETRIES):
        guess = guesses[len(gaits)]
        gaits.append(solve_open_sequence(problem, guess, solver, observer, homotopy=homotopy))
        if len(gaits) == 1 and gaits[0].status in RETRY and gaits[0].status not in INACCURATE:
            concluded = conclude_without_pairs(problem, gaits[0], guesses, solver, observer, homotopy)
            if concluded is not gaits[0]:
                return concluded
    gait = _best(gaits)
    if gait.status not in RETRY or gait.status in INACCURATE:
        return gait
    return conclude_proposal(problem, gait, guesses, solver, observer)


def _check_solver(solver: NlpSolver) -> NlpSolver:
    """Return a solver; raise InputError if it is not one."""
    if isinstance(solver, type) or not hasattr(solver, "minimise"):
        raise InputError(f"solver must be a Newton(...) or an Ipopt(...), got {solver!r}.")
    return solver


def _is_finished(gaits: list[Gait], conclusions: list[Gait], starts: int, retries: int) -> bool:
    """Return whether no further start is tried."""
    if not gaits:
        return False
    if any(not gait.status.ok and gait.status not in RETRY for gait in (gaits[-1], *conclusions)):
        return True
    return len(gaits) >= (starts if any(gait.status.ok for gait in (*gaits, *conclusions)) else starts + retries)


def _best(gaits: list[Gait]) -> Gait:
    """Return the gait of lowest objective, or if none is solved the one of least constraint violation."""
    solved = [gait for gait in gaits if gait.status.ok]
    if solved:
        return min(solved, key=lambda gait: rank_of(gait.solver.objective))
    return min(gaits, key=lambda gait: (gait.status in RETRY, rank_of(gait.solver.constraint_violation)))


def _start(problem: GaitProblem, number: int) -> Guess:
    """Return the guess of a start, counted from 0."""
    if number == 0:
        return problem.guess or LinearGuess()
    return RandomPerturbation(number)
