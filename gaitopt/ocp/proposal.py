"""Closing an open word: relaxed problems propose closed words, which are solved as smooth programmes."""

import math
import time
from dataclasses import dataclass, replace

from gaitopt.motion.gait import Gait
from gaitopt.motion.proposal import Proposal
from gaitopt.motion.word import Word
from gaitopt.ocp.attempt import attempt
from gaitopt.ocp.candidates import Candidates, Relaxed
from gaitopt.ocp.carrying import solution_of
from gaitopt.ocp.guess import Guess
from gaitopt.ocp.homotopy import Homotopy
from gaitopt.ocp.impact_proposal import propose_impact
from gaitopt.ocp.ipopt import Ipopt
from gaitopt.ocp.outcome import Minimiser
from gaitopt.ocp.phase_proposal import propose_phases
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.step import NEAR, Attempt, Step
from gaitopt.progress import SolveObserver, silent
from gaitopt.status import Status


@dataclass(frozen=True, eq=False)
class Check:
    """A proposed word, solved on a coarse grid: that of the relaxed problem where its phases are known.

    Attributes
    ----------
    word : Word
    step : Step
    start : Relaxed
        For the word on the problem's own grid.
    """

    word: Word
    step: Step
    start: Relaxed

    @property
    def rank(self) -> tuple[bool, float]:
        """What it is sorted by: solutions first, the cheapest before the others."""
        return (not self.step.outcome.status.ok, self.step.outcome.objective)


def attempt_open(
    problem: GaitProblem, guess: Guess, solver: Minimiser, observer: SolveObserver, *, homotopy: Homotopy
) -> Gait:
    """Close the word of a problem from one start, and solve the cheapest word proposed."""
    began = time.perf_counter()
    propose = propose_phases if problem.word.has_open_phases else propose_impact
    found = propose(problem, guess, solver, observer, homotopy)
    ending = found.trail.outcome.status
    if ending in (Status.INTERRUPTED, Status.TIME_LIMIT):  # what there is, without another iteration
        closed = problem.replace(word=found.words[0])
        gait = attempt(closed, found.guesses[0], Ipopt(max_iterations=0), silent)
        return _judged(problem, homotopy, found, [], replace(gait, status=ending))
    checks = [
        _checked(problem.replace(word=word), start, solver, observer)
        for word, start in zip(found.words, found.guesses, strict=True)
    ]
    checks.sort(key=lambda check: check.rank)
    gait = attempt(problem.replace(word=checks[0].word), checks[0].start, solver, observer)
    earlier = sum(step.iterations for step in found.trail.steps) + sum(c.step.outcome.iterations for c in checks)
    report = replace(
        gait.solver,
        iterations=gait.solver.iterations + earlier,
        solve_seconds=time.perf_counter() - began - gait.solver.build_seconds,
    )
    return _judged(problem, homotopy, found, checks, replace(gait, solver=report))


def _checked(problem: GaitProblem, start: Relaxed, solver: Minimiser, observer: SolveObserver) -> Check:
    method = problem.transcription.approach(problem.word)[0]
    step = Attempt(problem, start, solver, observer).run(method, start.solution_for(problem.word), NEAR)
    if step.outcome.status.ok:
        start = replace(start, solution=solution_of(step.transcription, step.outcome))
    return Check(problem.word, step, start)


def _judged(problem: GaitProblem, homotopy: Homotopy, found: Candidates, checks: list[Check], gait: Gait) -> Gait:
    """Return a gait with the record of its proposal, and with another status if the two disagree."""
    last, reasons = found.trail.steps[-1], []
    after = checks[0].step.outcome.objective if checks else math.nan
    if not found.trail.ended:
        reasons.append(
            f"the homotopy stopped at t = {last.relaxation:.0e} ({last.status}) with complementarity residual "
            f"{last.complementarity:.1e}, its tolerance is {homotopy.tolerance:.1e}"
        )
    if not gait.status.ok:
        reasons.append(f"the proposed word '{gait.word}' is not solved ({gait.status.key})")
    elif found.trail.ended and not abs(after - last.objective) <= found.agreement * abs(last.objective):
        reasons.append(f"the proposed word '{gait.word}' costs {after:.6g}, the relaxed problem {last.objective:.6g}")
        gait = replace(gait, status=Status.UNCONFIRMED)
    proposal = Proposal(
        word=str(problem.word),
        relaxation=homotopy.relaxation.name,
        steps=found.trail.steps,
        complementarity=last.complementarity,
        words=tuple(str(check.word) for check in checks),
        stationarity=_stationarity(found, checks),
        cost_before=last.objective,
        cost_after=after,
        reason="; ".join(reasons),
    )
    return replace(gait, proposal=proposal)


def _stationarity(found: Candidates, checks: list[Check]) -> str:
    """Return what is known of the choice of the word."""
    if not found.trail.ended:
        return "unknown: the homotopy did not end"
    endings = [(check.word, check.step.outcome.status) for check in checks]
    unsolved = [f"'{word}' ({status.key})" for word, status in endings if not status.ok]
    if unsolved:
        return f"unknown: not solved {', '.join(unsolved)}"
    if found.on_edge:
        return (
            f"unknown: {found.on_edge} intervals of the open phases stick on the edge of the cone (biactive pairs); "
            "the closed word is optimal by itself"
        )
    if not found.biactive:
        return "strong: no pair is biactive, so the closed word's optimality is the open one's"
    words = ", ".join(f"'{word}'" for word, _ in endings)
    return f"B: a pair is biactive; of the periodic words that meet there none is cheaper than the first: {words}"
