"""Search for the contact sequence of lowest cost."""

import contextlib
from collections.abc import Iterable, Mapping, MutableMapping, Sequence
from pathlib import Path

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.model.step_check import require_valid_step
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solution.impossible_sequences import explain_impossibility
from gaitopt.ocp.solution.start_selection import SAME_COST
from gaitopt.ocp.transcription.method import check_count
from gaitopt.parallel.execution import Execution
from gaitopt.parallel.runner import collect_tasks, run_tasks
from gaitopt.parallel.task_graph import Task
from gaitopt.study.multistart import (
    default_starts,
    neighbour_of,
    objective,
    solve_coarse,
    solve_cold,
    solve_fine,
    verify_best,
)
from gaitopt.study.sequence_search.planar_search import list_planar_sequences, search_planar_sequences
from gaitopt.study.sequence_search.ranking import (
    RankedGait,
    Ranking,
    judge_gait,
    rank_gaits,
    report_first_pass,
    save_ranking,
)
from gaitopt.study.sequence_search.sequence_enumeration import (
    closed_sequences,
    enumerate_sequences,
    neighbours,
)
from gaitopt.study.storage.failure_reason import IMPOSSIBLE, LOST, PENDING, UNFINISHED
from gaitopt.study.storage.gait_store import RANKING, GaitStore
from gaitopt.study.storage.study_key import study_key
from gaitopt.study.storage.study_lock import lock_study

SOLVES = 2
"""Tasks of each contact sequence: its two passes."""

NEIGHBOUR_STARTS = 1
"""Number of starts from neighbouring contact sequences, those of lowest cost."""


@check_arguments
def search(
    problem: GaitProblem | PlanarProblem,
    *,
    max_phases: int = 3,
    starts: int = 4,
    sequences: Iterable[ContactSequence | PhaseSequence | str] | None = None,
    execution: Execution | None = None,
    directory: str | Path | None = None,
) -> Ranking:
    """Find the optimal gait of every contact sequence, replay each, and rank them.

    Each sequence is solved on a coarse grid from gaits of shorter sequences and from the default starts, and the best
    of these solutions on the problem's grid.  Then each is solved again from its neighbour of lowest cost, longer ones
    included.  The result does not depend on the number of workers.

    Parameters
    ----------
    problem : GaitProblem or PlanarProblem
        Its contact sequence is ignored.
    max_phases : int
        Largest number of phases, 1 to 6; 1 to 3 for a robot with several contacts.
    starts : int
        Number of default starts of each sequence: the problem's guess or the linear guess, a passive gait if one
        exists, and random perturbations of the linear guess with fixed seeds.
    sequences : iterable of ContactSequence, PhaseSequence or str, optional
        Sequences to solve instead of all, each without open phases.
    execution : Execution, optional
        Workers, and the observer of (steps done, steps in all); this process alone by default.
    directory : str or Path, optional
        Folder that stores a gait file for each contact sequence; the same call with the same folder resumes.

    Returns
    -------
    Ranking
        Solved and replayed gaits in order of cost; then degenerate ones, failures and impossible sequences, each with
        the reason.  After an interrupt it ranks the finished sequences.

    Raises
    ------
    InputError
        If a number or a sequence is invalid, a sequence has open phases, the robot fails the check of
        :func:`gaitopt.solve`, or the folder contains a different study.
    ArchiveError
        If the folder is not writable, or another process computes it.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, search
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.14, speed=0.633, step_length=0.4713,
    ...     limits=Limits(torque=6), transcription=MultipleShooting(intervals=16),
    ... )
    >>> ranking = search(problem, sequences=["stick | stick", "slip+ stick | slip+"], starts=1)
    >>> [str(finding.sequence) for finding in ranking.findings]
    ['slip+ stick | slip+', 'stick | stick']
    """
    check_count("starts", starts, 1, 1000)
    if isinstance(problem, PlanarProblem):
        return _search_planar(problem, max_phases, starts, sequences, execution or Execution(), directory)
    require_valid_step(problem.robot)
    _require_one_grid(problem)
    tried = enumerate_sequences(max_phases)
    if sequences is not None:
        tried = closed_sequences([ContactSequence.parse(str(sequence)) for sequence in sequences], "A search")
    tried = tuple(sorted(dict.fromkeys(tried), key=lambda sequence: len(sequence.phases)))
    if directory is None:
        return _solve_sequences(problem, tried, starts, {}, execution or Execution())
    key = study_key(
        problem.replace(sequence="stick | stick"), sequences=[str(sequence) for sequence in tried], starts=starts
    )
    kept = GaitStore(directory, key)
    with lock_study(kept.path):
        ranking = _solve_sequences(problem, tried, starts, kept, execution or Execution())
        if ranking.complete:  # results of the first pass are no longer needed
            kept.keep_only(map(file_name_of, tried))
        save_ranking(ranking, kept.path / RANKING)
    return ranking


def list_sequences(
    problem: GaitProblem | PlanarProblem, max_phases: int
) -> tuple[ContactSequence, ...] | tuple[PhaseSequence, ...]:
    """Return all contact sequences that a search ranks, impossible ones included.

    Parameters
    ----------
    problem : GaitProblem or PlanarProblem
    max_phases : int
        Largest number of phases.

    Raises
    ------
    InputError
        If the number is invalid, or the sequences of the robot cannot be enumerated.

    Examples
    --------
    >>> from gaitopt import GaitProblem, compass_biped
    >>> len(list_sequences(GaitProblem(robot=compass_biped(), sequence="stick | stick"), 2))
    15
    """
    if isinstance(problem, PlanarProblem):
        return list_planar_sequences(problem, max_phases, None)
    return enumerate_sequences(max_phases)


def _solve_sequences(
    problem: GaitProblem,
    tried: Sequence[ContactSequence],
    starts: int,
    kept: MutableMapping[str, Gait],
    execution: Execution,
) -> Ranking:
    """Solve the sequences whose gaits are not stored yet, and rank all."""
    impossible = {sequence: reason for sequence in tried if (reason := explain_impossibility(sequence, problem))}
    planned = plan_search([sequence for sequence in tried if sequence not in impossible], starts)
    running = run_tasks(solve_sequence, planned, problem, known=kept, execution=execution)
    lost = collect_tasks(running, kept, planned, execution.observer, known_suffice=True).failures
    findings = [
        RankedGait(sequence=sequence, status=IMPOSSIBLE, reason=reason) for sequence, reason in impossible.items()
    ]
    findings += [_finding(sequence, problem, kept, lost) for sequence in tried if sequence not in impossible]
    return rank_gaits(findings, all(finding.status not in (LOST, PENDING) for finding in findings))


def _search_planar(
    problem: PlanarProblem,
    max_phases: int,
    starts: int,
    sequences: Iterable[ContactSequence | PhaseSequence | str] | None,
    execution: Execution,
    directory: str | Path | None,
) -> Ranking:
    """Return the ranking of a robot with several contacts, and write it into the folder."""
    named = None if sequences is None else [str(sequence) for sequence in sequences]
    tried = list_planar_sequences(problem, max_phases, named)
    kept: MutableMapping[str, Gait] = {}
    if directory is not None:
        key = study_key(problem, sequences=[str(each) for each in tried], starts=starts)
        for ignored in ("sequence", "events", "intervals"):  # those of the problem's own sequence
            key["problem"].pop(ignored)
        key["intervals"] = repr(problem.transcription.intervals)
        kept = GaitStore(directory, key)
    with lock_study(kept.path) if isinstance(kept, GaitStore) else contextlib.nullcontext():
        ranking = search_planar_sequences(problem, tried, starts=starts, execution=execution, kept=kept)
        if isinstance(kept, GaitStore):
            save_ranking(ranking, kept.path / RANKING)
    return ranking


def _require_one_grid(problem: GaitProblem) -> None:
    """Raise InputError if the intervals are those of the phases of one sequence."""
    intervals = problem.transcription.intervals
    if intervals is not None and not isinstance(intervals, int):
        raise InputError(
            f"A search needs one number of intervals for all contact sequences, such as intervals={max(intervals)}, "
            f"got {intervals} for the phases of '{problem.sequence}'."
        )


def plan_search(sequences: Sequence[ContactSequence], starts: int) -> list[Task]:
    """Return the tasks of a search: a first pass over sequences after their shorter neighbours, then a second pass."""
    near = {sequence: [other for other in neighbours(sequence) if other in sequences] for sequence in sequences}
    shorter = {
        sequence: [other for other in near[sequence] if len(other.phases) < len(sequence.phases)]
        for sequence in sequences
    }
    first = [
        Task(_first(sequence), (sequence, starts), tuple(map(_first, shorter[sequence])), str(sequence))
        for sequence in sequences
    ]
    return first + [
        Task(file_name_of(sequence), (sequence, 0), tuple(map(_first, (sequence, *near[sequence]))), str(sequence))
        for sequence in sequences
    ]


def file_name_of(sequence: ContactSequence) -> str:
    """Return a contact sequence as part of a file name.

    Examples
    --------
    >>> file_name_of(ContactSequence.parse("slip+ stick | slip+"))
    'slip+_stick__slip+'
    """
    return str(sequence).replace(" | ", "__").replace(" ", "_")


def _first(sequence: ContactSequence) -> str:
    return f"{file_name_of(sequence)}.first"


def solve_sequence(problem: GaitProblem, argument: tuple[ContactSequence, int], *results: Gait | None) -> Gait:
    """Run a task of a search: the first pass of a sequence with a number of default starts, or its second pass (0)."""
    sequence, starts = argument
    problem = problem.replace(sequence=sequence)
    gaits = sorted((gait for gait in results if gait is not None and gait.status.ok), key=objective)
    if starts:
        return solve_fine(
            problem, solve_coarse(problem, [*gaits[:NEIGHBOUR_STARTS], *default_starts(problem, starts)])
        )[0]
    first = results[0] or solve_cold(problem, 1)[0]  # None if the process of its first pass died
    better = [
        gait for gait in gaits if gait.sequence != sequence and objective(gait) < (1 - SAME_COST) * objective(first)
    ]
    untried = [gait for gait in better if first.status.ok or len(gait.sequence.phases) > len(sequence.phases)]
    again = []
    if untried and not (first.status.ok and neighbour_of(first) == untried[0].sequence):  # else it is found again
        again = solve_fine(problem, solve_coarse(problem, untried[:1], after_failure=not first.status.ok))
    return verify_best(problem, [first, *again])


def _finding(
    sequence: ContactSequence, problem: GaitProblem, kept: Mapping[str, Gait], lost: Mapping[str, str]
) -> RankedGait:
    key = file_name_of(sequence)
    if key in kept:
        file = kept.file(key) if isinstance(kept, GaitStore) else None
        return judge_gait(kept[key], problem.limits.shortest_phase, file)
    if key not in lost and _first(sequence) in kept:
        return report_first_pass(sequence, kept[_first(sequence)])
    status, reason = (LOST, lost[key]) if key in lost else (PENDING, UNFINISHED)
    return RankedGait(sequence=sequence, status=status, reason=reason)
