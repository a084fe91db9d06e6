"""Closing an open sequence: relaxed problems propose closed sequences, which are solved as smooth NLPs."""

import math
import time
from dataclasses import dataclass, replace

from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait
from gaitopt.motion.proposal import Proposal
from gaitopt.ocp.initial.solution_transfer import solution_of
from gaitopt.ocp.mode_search.candidate_sequences import Candidates, RelaxedSolution
from gaitopt.ocp.mode_search.homotopy import Homotopy
from gaitopt.ocp.mode_search.impact_proposal import propose_impact
from gaitopt.ocp.mode_search.phase_proposal import propose_phases
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.grid_solve import BARRIER_NEARBY_PROBLEM, GridSolution, SingleStart
from gaitopt.ocp.solution.single_start import solve_from_start
from gaitopt.ocp.statement.initial_guess import Guess
from gaitopt.progress import SolveObserver, silent
from gaitopt.reductions import rank_of
from gaitopt.status import Status

NEGLIGIBLE = 1e-6
"""Share of a typical objective below which an optimum counts as zero when costs are compared."""


@dataclass(frozen=True, eq=False)
class CandidateCheck:
    """A proposed contact sequence, solved on a coarse grid: that of the relaxed problem where its phases are known.

    Attributes
    ----------
    sequence : ContactSequence
    step : Step
    start : Relaxed
        For the contact sequence on the grid of the problem.
    """

    sequence: ContactSequence
    step: GridSolution
    start: RelaxedSolution

    @property
    def rank(self) -> tuple[bool, float]:
        """What it is sorted by: solutions first, the cheapest before the others."""
        return (not self.step.outcome.status.ok, rank_of(self.step.outcome.objective))


def solve_open_sequence(
    problem: GaitProblem, guess: Guess, solver: NlpSolver, observer: SolveObserver, *, homotopy: Homotopy
) -> Gait:
    """Close the contact sequence of a problem from one start, and solve the cheapest contact sequence proposed."""
    began = time.perf_counter()
    propose = propose_phases if problem.sequence.has_open_phases else propose_impact
    found = propose(problem, guess, solver, observer, homotopy)
    ending = found.trail.outcome.status
    if ending in (Status.INTERRUPTED, Status.TIME_LIMIT):  # what there is, without another iteration
        closed = problem.replace(sequence=found.sequences[0])
        gait = solve_from_start(closed, found.guesses[0], Ipopt(max_iterations=0), silent)
        return _judge_candidate(problem, homotopy, found, [], replace(gait, status=ending))
    checks = [
        _check_candidate(problem.replace(sequence=sequence), start, solver, observer)
        for sequence, start in zip(found.sequences, found.guesses, strict=True)
    ]
    checks.sort(key=lambda check: check.rank)
    gait = solve_from_start(problem.replace(sequence=checks[0].sequence), checks[0].start, solver, observer)
    earlier = sum(step.iterations for step in found.trail.steps) + sum(c.step.outcome.iterations for c in checks)
    report = replace(
        gait.solver,
        iterations=gait.solver.iterations + earlier,
        solve_seconds=time.perf_counter() - began - gait.solver.build_seconds,
    )
    return _judge_candidate(problem, homotopy, found, checks, replace(gait, solver=report))


def _check_candidate(
    problem: GaitProblem, start: RelaxedSolution, solver: NlpSolver, observer: SolveObserver
) -> CandidateCheck:
    method = problem.transcription.approach(problem.sequence)[0]
    step = SingleStart(problem, start, solver, observer).run(
        method, start.solution_for(problem.sequence), BARRIER_NEARBY_PROBLEM
    )
    if step.outcome.status.ok:
        start = replace(start, solution=solution_of(step.transcription, step.outcome))
    return CandidateCheck(problem.sequence, step, start)


def _judge_candidate(
    problem: GaitProblem, homotopy: Homotopy, found: Candidates, checks: list[CandidateCheck], gait: Gait
) -> Gait:
    """Return a gait with the record of its proposal, and with another status if the two disagree."""
    last, reasons = found.trail.steps[-1], []
    after = checks[0].step.outcome.objective if checks else math.nan
    scale = max(abs(last.objective), NEGLIGIBLE * problem.objective.typical)
    if not found.trail.ended:
        reasons.append(
            f"the homotopy stopped at t = {last.relaxation:.0e} ({last.status}) with complementarity residual "
            f"{last.complementarity:.1e}, its tolerance is {homotopy.tolerance:.1e}"
        )
    if not gait.status.ok:
        reasons.append(f"the proposed contact sequence '{gait.sequence}' is not solved ({gait.status.key})")
    elif found.trail.ended and not abs(after - last.objective) <= found.agreement * scale:
        reasons.append(
            f"the proposed sequence '{gait.sequence}' costs {after:.6g}, the relaxed problem {last.objective:.6g}"
        )
        gait = replace(gait, status=Status.UNCONFIRMED)
    proposal = Proposal(
        sequence=str(problem.sequence),
        relaxation=homotopy.relaxation.name,
        steps=found.trail.steps,
        complementarity=last.complementarity,
        sequences=tuple(str(check.sequence) for check in checks),
        stationarity=_stationarity(found, checks),
        cost_before=last.objective,
        cost_after=after,
        reason="; ".join(reasons),
    )
    return replace(gait, proposal=proposal)


def _stationarity(found: Candidates, checks: list[CandidateCheck]) -> str:
    """Return what is known of the choice of the contact sequence."""
    if not found.trail.ended:
        return "unknown: the homotopy did not end"
    endings = [(check.sequence, check.step.outcome.status) for check in checks]
    unsolved = [f"'{sequence}' ({status.key})" for sequence, status in endings if not status.ok]
    if unsolved:
        return f"unknown: not solved {', '.join(unsolved)}"
    if found.on_edge:
        return (
            f"unknown: {found.on_edge} intervals of the open phases stick on the edge of the cone (biactive pairs); "
            "the closed contact sequence is optimal by itself"
        )
    if not found.biactive:
        return "strong: no pair is biactive, so the closed sequence's optimality is the open one's"
    sequences = ", ".join(f"'{sequence}'" for sequence, _ in endings)
    return (
        f"B: a pair is biactive; of the periodic sequences that meet there none is cheaper than the first: {sequences}"
    )
