"""Closure of an open sequence: relaxed problems propose closed sequences, which are solved as smooth NLPs."""

import math
import time
from dataclasses import replace

from gaitopt.dataclass import dataclass
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait
from gaitopt.motion.printable import format_count
from gaitopt.motion.proposal import Proposal
from gaitopt.ocp.initial.solution_transfer import solution_of
from gaitopt.ocp.mode_search.candidate_sequences import Candidates, RelaxedSolution
from gaitopt.ocp.mode_search.homotopy import Homotopy
from gaitopt.ocp.mode_search.impact_proposal import propose_impact
from gaitopt.ocp.mode_search.phase_proposal import propose_phases
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.grid_solve import BARRIER_NEARBY_PROBLEM, STOPPED_EARLY, GridSolution, SingleStart
from gaitopt.ocp.solution.single_start import solve_from_start
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.progress import SolveObserver, silent
from gaitopt.reductions import rank_of
from gaitopt.status import Status

NEGLIGIBLE = 1e-6
"""Share of a typical objective below which an optimum counts as zero when costs are compared."""


@dataclass(frozen=True, eq=False)
class CandidateCheck:
    """A proposed contact sequence, solved on a coarse grid: that of the relaxed problem if only the impact is open.

    Attributes
    ----------
    sequence : ContactSequence
    solution : GridSolution
        Solution on the coarse grid.
    guess : RelaxedSolution
        Initial guess for the grid of the problem.
    """

    sequence: ContactSequence
    solution: GridSolution
    guess: RelaxedSolution

    @property
    def rank(self) -> tuple[bool, float]:
        """Sorting key: solutions first, in the order of their cost."""
        return (not self.solution.outcome.status.ok, rank_of(self.solution.cost))


def solve_open_sequence(
    problem: GaitProblem, guess: Guess, solver: NlpSolver, observer: SolveObserver, *, homotopy: Homotopy
) -> Gait:
    """Close the contact sequence of a problem from one start, and solve the proposed sequence of lowest cost."""
    started = time.perf_counter()
    propose = propose_phases if problem.sequence.has_open_phases else propose_impact
    candidates = propose(problem, guess, solver, observer, homotopy)
    ending, checks = candidates.path.outcome.status, list[CandidateCheck]()
    for sequence, closed_guess in zip(candidates.sequences, candidates.guesses, strict=True):
        if ending not in STOPPED_EARLY:
            checks.append(_check_candidate(problem.replace(sequence=sequence), closed_guess, solver, observer))
            if checks[-1].solution.outcome.status is Status.INTERRUPTED:
                ending = Status.INTERRUPTED
    if ending in STOPPED_EARLY:  # the last iterate, without further iterations
        closed = problem.replace(sequence=candidates.sequences[0])
        gait = solve_from_start(closed, candidates.guesses[0], Ipopt(max_iterations=0), silent)
        return _judge_candidate(problem, homotopy, candidates, [], gait.replace_fields(status=ending))
    checks.sort(key=lambda check: check.rank)
    gait = solve_from_start(problem.replace(sequence=checks[0].sequence), checks[0].guess, solver, observer)
    relaxed = sum(step.iterations for step in candidates.path.steps)
    coarse = sum(check.solution.outcome.iterations for check in checks)
    report = gait.solver.replace_fields(
        iterations=gait.solver.iterations + relaxed + coarse,
        solve_seconds=time.perf_counter() - started - gait.solver.build_seconds,
    )
    return _judge_candidate(problem, homotopy, candidates, checks, gait.replace_fields(solver=report))


def _check_candidate(
    problem: GaitProblem, guess: RelaxedSolution, solver: NlpSolver, observer: SolveObserver
) -> CandidateCheck:
    method = problem.transcription.list_grids(problem.sequence)[0]
    solution = SingleStart(problem, guess, solver, observer).solve_on_grid(
        method, guess.solution_for(problem.sequence), BARRIER_NEARBY_PROBLEM, locate=False
    )
    if solution.outcome.status.ok:
        guess = replace(guess, solution=solution_of(solution.transcription, solution.outcome))
    return CandidateCheck(problem.sequence, solution, guess)


def _judge_candidate(
    problem: GaitProblem, homotopy: Homotopy, candidates: Candidates, checks: list[CandidateCheck], gait: Gait
) -> Gait:
    """Return a gait with the record of its proposal; its status is `UNCONFIRMED` if the two costs disagree."""
    last, reasons = candidates.path.steps[-1], []
    after = checks[0].solution.outcome.objective if checks else math.nan
    scale = max(abs(last.objective), NEGLIGIBLE * problem.objective.typical)
    if not candidates.path.ended:
        reasons.append(
            f"the homotopy stopped at t = {last.relaxation:.0e} ({last.status}) with complementarity residual "
            f"{last.complementarity:.1e} (tolerance {homotopy.tolerance:.1e})"
        )
    if not gait.status.ok:
        reasons.append(f"the proposed contact sequence '{gait.sequence}' is not solved ({gait.status.key})")
    elif candidates.path.ended and not abs(after - last.objective) <= candidates.agreement * scale:
        reasons.append(
            f"on coarse grids, the proposed sequence '{gait.sequence}' has cost {after:.6g}, the relaxed problem "
            f"{last.objective:.6g}"
        )
        gait = gait.replace_fields(status=Status.UNCONFIRMED, certificate=None)
    proposal = Proposal(
        sequence=str(problem.sequence),
        relaxation=homotopy.relaxation.name,
        steps=candidates.path.steps,
        complementarity=last.complementarity,
        sequences=tuple(str(check.sequence) for check in checks),
        stationarity=_describe_stationarity(candidates, checks),
        cost_before=last.objective,
        cost_after=after,
        reason="; ".join(reasons),
    )
    return gait.replace_fields(proposal=proposal)


def _describe_stationarity(candidates: Candidates, checks: list[CandidateCheck]) -> str:
    """Return the stationarity of the gait with respect to the choice of the contact sequence."""
    if not candidates.path.ended:
        return "unknown: the homotopy did not reach its end"
    endings = [(check.sequence, check.solution.outcome.status) for check in checks]
    unsolved = [f"'{sequence}' ({status.key})" for sequence, status in endings if not status.ok]
    if unsolved:
        return f"unknown: not all proposed sequences are solved: {', '.join(unsolved)}"
    if candidates.on_edge:
        return (
            f"unknown: in {format_count(candidates.on_edge, 'interval')} of the open phases the foot sticks on the "
            "boundary of the cone (biactive pairs); optimality is known for the closed contact sequence only"
        )
    if not candidates.biactive:
        return "strong: no pair is biactive, so the optimality of the closed sequence implies that of the open one"
    sequences = ", ".join(f"'{sequence}'" for sequence, _ in endings)
    return (
        "B: a pair is biactive (zero on both sides); the first of these adjacent periodic sequences has the lowest "
        f"cost: {sequences}"
    )
