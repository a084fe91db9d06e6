"""Search for the contact sequence of lowest objective of a robot with several contacts."""

import math
from collections.abc import Iterable

from gaitopt.errors import InputError
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.ocp.multicontact.open_sequences import close_sequence
from gaitopt.ocp.multicontact.planar_enumeration import enumerate_planar_sequences
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.parallel.execution import Execution
from gaitopt.parallel.runner import collect_tasks, run_tasks
from gaitopt.parallel.task_graph import Task
from gaitopt.study.planar_starts import solve_default, verify_best_planar
from gaitopt.study.sequence_search.ranking import RankedGait, Ranking, rank_gaits
from gaitopt.study.storage.failure_reason import IMPOSSIBLE, LOST, MERGED, PENDING, UNFINISHED, explain_failure


def search_planar_sequences(
    problem: PlanarProblem,
    *,
    max_phases: int,
    starts: int,
    sequences: Iterable[PhaseSequence | str] | None,
    execution: Execution,
) -> Ranking:
    """Return the ranking of the contact sequences of a robot with several contacts by their objectives.

    Parameters
    ----------
    problem : PlanarProblem
    max_phases : int
        Largest number of phases, 1 to 3.
    starts : int
        Number of starts of each sequence.
    sequences : iterable of PhaseSequence or str, or None
        Sequences to solve, and those that open ones stand for; None for all of :func:`enumerate_planar_sequences`.
    execution : Execution

    Raises
    ------
    InputError
        If a sequence is invalid, or the sequences of the robot cannot be enumerated.
    """
    if sequences is None:
        tried = enumerate_planar_sequences(problem.robot, max_phases)
    else:
        parsed = [PhaseSequence.parse(each, problem.robot) for each in sequences]
        tried = tuple(dict.fromkeys(closed for each in parsed for closed in close_sequence(each, problem.robot)))
    problems, findings = dict[PhaseSequence, PlanarProblem](), list[RankedGait]()
    for sequence in tried:
        try:
            problems[sequence] = problem.replace(sequence=sequence)
        except InputError as error:
            findings.append(RankedGait(sequence=sequence, status=IMPOSSIBLE, reason=str(error)))
    tasks, kept = [Task(str(sequence), (sequence, starts)) for sequence in problems], dict[str, PlanarGait]()
    lost = collect_tasks(run_tasks(_solve, tasks, problem, execution=execution), kept, tasks, execution.observer)
    for sequence in problems:
        name = str(sequence)
        if name in kept:
            findings.append(_judge(kept[name], problem.limits.shortest_phase))
        else:
            status, reason = (LOST, lost[name]) if name in lost else (PENDING, UNFINISHED)
            findings.append(RankedGait(sequence=sequence, status=status, reason=reason))
    return rank_gaits(findings, all(finding.status not in (LOST, PENDING) for finding in findings))


def _solve(problem: PlanarProblem, argument: tuple[PhaseSequence, int]) -> PlanarGait:
    """Run a task of a search: the verified gait of one sequence."""
    sequence, starts = argument
    changed = problem.replace(sequence=sequence)
    return verify_best_planar([solve_default(changed, starts)])


def _judge(gait: PlanarGait, shortest_phase: float) -> RankedGait:
    """Return the result for the sequence of a gait; one with a phase of minimum duration is degenerate."""
    durations = [segment.time[-1] - segment.time[0] for segment in gait.motion.segments]
    if gait.status.ok and len(durations) > 1 and min(durations, default=math.inf) < 1.01 * shortest_phase:
        reason = "this gait is degenerate: one phase has its minimum duration"
        return RankedGait(sequence=gait.sequence, status=MERGED, reason=reason, gait=gait)
    return RankedGait(sequence=gait.sequence, status=gait.status.key, reason=explain_failure(gait), gait=gait)
