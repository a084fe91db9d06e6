"""Conclusion from a failed solve of an open contact sequence.

Without the complementarity pairs, that is if the foot may stick and slip at the same time, an open problem admits the
motions of all its closed sequences.  If no such motion satisfies the limits, no closed sequence does.
"""

import time
from collections.abc import Sequence
from dataclasses import replace

from gaitopt.motion.gait import Gait
from gaitopt.ocp.mode_search.homotopy import Homotopy, choose_relaxed_grid
from gaitopt.ocp.nlp.elastic import ElasticResult
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.conflict_search import elastic_solver
from gaitopt.ocp.solution.feasibility import ElasticProblem
from gaitopt.ocp.solution.infeasibility import SMALL_EXCESS, conclude_failure, excesses_agree
from gaitopt.ocp.solution.mesh_refinement import STOPPED_EARLY
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.ocp.transcription.relaxation import ExactPenalty
from gaitopt.progress import Observer
from gaitopt.status import Status


def conclude_without_pairs(
    problem: GaitProblem,
    failure: Gait,
    guesses: Sequence[Guess],
    solver: NlpSolver,
    observer: Observer,
    homotopy: Homotopy,
) -> Gait:
    """Return the failure as infeasible if no motion near the guesses satisfies all limits without the pairs.

    Parameters
    ----------
    problem : GaitProblem
        A problem with an open contact sequence.
    failure : Gait
        Result of a solve that failed.
    guesses : sequence of Guess
    solver : NlpSolver
    observer : Observer
    homotopy : Homotopy
    """
    started = time.perf_counter()
    # The penalty adds no rows, so the pairs are absent from the elastic problem.
    elastic = ElasticProblem(
        problem, choose_relaxed_grid(problem, homotopy), elastic_solver(solver), observer, ExactPenalty()
    )
    infeasible: list[ElasticResult] = []
    try:
        for guess in guesses:
            result = elastic.minimise_excess(guess)
            if result.status is Status.INTERRUPTED:
                raise KeyboardInterrupt
            if result.status in STOPPED_EARLY:
                return failure.with_failure(result.status, "stopped during the search for a feasible motion")
            if not result.status.ok or elastic.excess(result) < SMALL_EXCESS:
                return failure
            infeasible.append(result)
            if excesses_agree([elastic.excess(each) for each in infeasible]):
                break
        conflicts = elastic.find_conflicts(min(infeasible, key=elastic.excess))
    except KeyboardInterrupt:
        return failure.with_failure(Status.INTERRUPTED, "User_Requested_Stop")
    if isinstance(conflicts, ElasticResult):
        return failure
    near = f"any of {len(infeasible)} initial guesses" if len(infeasible) > 1 else "the initial guess"
    message = (
        f"no feasible motion of any sequence that matches '{problem.sequence}' found near {near}: the smallest "
        "possible violation of the limits is not zero"
    )
    seconds = time.perf_counter() - started
    return failure.with_failure(Status.INFEASIBLE, message, conflicts, seconds=seconds)


def conclude_proposal(
    problem: GaitProblem, failure: Gait, guesses: Sequence[Guess], solver: NlpSolver, observer: Observer
) -> Gait:
    """Return a gait of the proposed closed sequence, or the failure with the conclusion for this sequence.

    Parameters
    ----------
    problem : GaitProblem
        A problem with an open contact sequence.
    failure : Gait
        Result of a solve that failed.
    guesses : sequence of Guess
    solver : NlpSolver
    observer : Observer
    """
    concluded = conclude_failure(problem.replace(sequence=failure.sequence), failure, guesses, solver, observer)
    if concluded.status.ok and failure.proposal is not None:
        reason = f"{failure.proposal.reason}; '{failure.sequence}' was solved from a motion that satisfies all limits"
        return concluded.replace_fields(proposal=replace(failure.proposal, reason=reason))
    if concluded.status is Status.INFEASIBLE:
        message = f"{concluded.solver.message}, with the proposed sequence '{failure.sequence}'"
        return concluded.with_failure(concluded.status, message, concluded.solver.conflicts)
    return concluded
