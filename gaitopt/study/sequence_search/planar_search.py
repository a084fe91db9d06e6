"""Search for the contact sequence of lowest objective of a robot with several contacts."""

import hashlib
import math
from collections.abc import Iterable, MutableMapping
from pathlib import Path
from typing import Any

from gaitopt.errors import InputError
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.ocp.multicontact.open_sequences import close_sequence
from gaitopt.ocp.multicontact.planar_enumeration import enumerate_planar_sequences
from gaitopt.ocp.multicontact.planar_impossibility import explain_planar_impossibility
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.parallel.execution import Execution
from gaitopt.parallel.runner import collect_tasks, run_tasks
from gaitopt.parallel.task_graph import Task
from gaitopt.study.planar_starts import solve_default, verify_best_planar
from gaitopt.study.sequence_search.ranking import RankedGait, Ranking, rank_gaits
from gaitopt.study.storage.failure_reason import IMPOSSIBLE, LOST, MERGED, PENDING, UNFINISHED, explain_failure
from gaitopt.study.storage.gait_store import GaitStore

LONGEST_NAME = 80
"""Number of characters above which the file name of a sequence ends with a digest."""


def list_planar_sequences(
    problem: PlanarProblem, max_phases: int, sequences: Iterable[PhaseSequence | str] | None
) -> tuple[PhaseSequence, ...]:
    """Return the contact sequences that a search solves.

    Parameters
    ----------
    problem : PlanarProblem
    max_phases : int
        Largest number of phases, 1 to 3.
    sequences : iterable of PhaseSequence or str, or None
        Sequences to solve, and those that open ones stand for; None for all of :func:`enumerate_planar_sequences`.

    Raises
    ------
    InputError
        If a sequence is invalid, or the sequences of the robot cannot be enumerated.
    """
    if sequences is None:
        return enumerate_planar_sequences(problem.robot, max_phases)
    parsed = [PhaseSequence.parse(each, problem.robot) for each in sequences]
    return tuple(dict.fromkeys(closed for each in parsed for closed in close_sequence(each, problem.robot)))


def search_planar_sequences(
    problem: PlanarProblem,
    tried: Iterable[PhaseSequence],
    *,
    starts: int,
    execution: Execution,
    kept: MutableMapping[str, Any],
) -> Ranking:
    """Return the ranking of the contact sequences of a robot with several contacts by their objectives.

    Parameters
    ----------
    problem : PlanarProblem
    tried : iterable of PhaseSequence
    starts : int
        Number of starts of each sequence.
    execution : Execution
    kept : mutable mapping of str to PlanarGait
        Gaits by :func:`name_file` of their sequence; those it contains are not solved again.
    """
    problems, findings = dict[PhaseSequence, PlanarProblem](), list[RankedGait]()
    for sequence in tried:
        try:
            candidate = problem.replace(sequence=sequence)
            reason = explain_planar_impossibility(candidate)
        except InputError as error:
            reason = str(error)
        if reason is None:
            problems[sequence] = candidate
        else:
            findings.append(RankedGait(sequence=sequence, status=IMPOSSIBLE, reason=reason))
    tasks = [Task(name_file(sequence), (sequence, starts), label=str(sequence)) for sequence in problems]
    running = run_tasks(_solve, tasks, problem, known=kept, execution=execution)
    lost = collect_tasks(running, kept, tasks, execution.observer, known_suffice=True).failures
    for sequence in problems:
        name = name_file(sequence)
        if name in kept:
            file = kept.file(name) if isinstance(kept, GaitStore) else None
            findings.append(judge_planar_gait(kept[name], problem.limits.shortest_phase, file))
        else:
            status, reason = (LOST, lost[name]) if name in lost else (PENDING, UNFINISHED)
            findings.append(RankedGait(sequence=sequence, status=status, reason=reason))
    return rank_gaits(findings, all(finding.status not in (LOST, PENDING) for finding in findings))


def name_file(sequence: PhaseSequence) -> str:
    """Return a contact sequence as part of a file name; a long one is shortened and ends with a digest.

    Examples
    --------
    >>> name_file(PhaseSequence.parse("foot A slip+, foot B stick > foot B stick |"))
    'foot_A_slip+,foot_B_stick_-_foot_B_stick__'
    """
    text = str(sequence).replace(" |", "__").replace(">", "-").replace(", ", ",").replace(" ", "_")
    if len(text) <= LONGEST_NAME:
        return text
    return f"{text[:LONGEST_NAME]}~{hashlib.sha256(text.encode()).hexdigest()[:8]}"


def _solve(problem: PlanarProblem, argument: tuple[PhaseSequence, int]) -> PlanarGait:
    """Run a task of a search: the verified gait of one sequence."""
    sequence, starts = argument
    changed = problem.replace(sequence=sequence)
    return verify_best_planar([solve_default(changed, starts)])


def judge_planar_gait(gait: PlanarGait, shortest_phase: float, file: Path | None) -> RankedGait:
    """Return the result for the contact sequence of a gait; one with a phase of minimum duration is degenerate."""
    durations = [segment.time[-1] - segment.time[0] for segment in gait.motion.segments]
    if gait.status.ok and len(durations) > 1 and min(durations, default=math.inf) < 1.01 * shortest_phase:
        reason = "this gait is degenerate: one phase has its minimum duration"
        return RankedGait(sequence=gait.sequence, status=MERGED, reason=reason, gait=gait, file=file)
    status = gait.status.key
    return RankedGait(sequence=gait.sequence, status=status, reason=explain_failure(gait), gait=gait, file=file)
