"""Search: which contact sequence walks cheapest."""

from collections.abc import Iterable, Mapping, MutableMapping, Sequence
from pathlib import Path

from gaitopt.model.step_check import require_valid_step
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.transcription.method import check_count
from gaitopt.parallel.execution import Execution
from gaitopt.parallel.runner import collect_tasks, run_tasks
from gaitopt.parallel.task_graph import Task
from gaitopt.study.multistart import ALIKE, default_starts, objective, solve_coarse, solve_cold, solve_fine, verify_best
from gaitopt.study.sequence_search.ranking import RankedGait, Ranking, judge_gait, rank_gaits, save_ranking
from gaitopt.study.sequence_search.sequence_enumeration import (
    closed_sequences,
    enumerate_sequences,
    explain_impossibility,
    neighbours,
)
from gaitopt.study.storage.failure_reason import IMPOSSIBLE, LOST, PENDING, UNFINISHED
from gaitopt.study.storage.gait_store import GaitStore
from gaitopt.study.storage.study_key import study_key

RANKING = "ranking.json"

BORROWED = 1
"""Starts a contact sequence takes over from its neighbours, the cheapest ones."""


def search(
    problem: GaitProblem,
    *,
    max_phases: int = 3,
    starts: int = 4,
    sequences: Iterable[ContactSequence | str] | None = None,
    execution: Execution | None = None,
    directory: str | Path | None = None,
) -> Ranking:
    """Find the optimal gait of every contact sequence, replay each, and rank them.

    Each sequence is tried on a coarse grid from gaits of shorter sequences and from starts of its own; what is found
    there is finished on the problem's grid.  Then each is tried once more from its cheapest neighbour, longer ones
    included. The answer does not depend on the number of workers.

    Parameters
    ----------
    problem : GaitProblem
        Its own contact sequence does not matter.
    max_phases : int
        Longest contact sequences tried, 1 to 6 phases.
    starts : int
        Starts of its own each sequence has: the problem's guess or a straight line, a passive cycle if one exists,
        lines with random waves from fixed seeds.
    sequences : iterable of ContactSequence or str, optional
        Only these, each of them closed.
    execution : Execution, optional
        Workers, and the observer of (steps done, steps in all); this process alone by default.
    directory : str or Path, optional
        Folder that keeps a gait file for each contact sequence; the same call goes on from there.

    Returns
    -------
    Ranking
        Solved and replayed gaits first, cheapest first; then sequences in disguise, failures and impossible sequences,
        each with the reason.  Interrupted, it ranks what was finished.

    Raises
    ------
    InputError
        If a number or a sequence cannot be, a sequence leaves something open, the robot fails :func:`gaitopt.solve`'s
        check, or the folder holds another study.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, search
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.14, speed=0.633, step_length=0.4713,
    ...     limits=Limits(torque=6), transcription=MultipleShooting(intervals=16),
    ... )
    >>> found = search(problem, sequences=["stick | stick", "slip+ stick | slip+"], starts=1)
    >>> [str(finding.sequence) for finding in found.findings]
    ['slip+ stick | slip+', 'stick | stick']
    """
    check_count("starts", starts, 1, 1000)
    require_valid_step(problem.robot)
    tried = enumerate_sequences(max_phases) if sequences is None else closed_sequences(sequences, "A search")
    tried = tuple(sorted(dict.fromkeys(tried), key=lambda sequence: len(sequence.phases)))
    kept: MutableMapping[str, Gait] = {}
    if directory is not None:
        asked = study_key(
            problem.replace(sequence="stick | stick"), sequences=[str(sequence) for sequence in tried], starts=starts
        )
        kept = GaitStore(directory, asked)
    impossible = {sequence: reason for sequence in tried if (reason := explain_impossibility(sequence, problem))}
    planned = tasks([sequence for sequence in tried if sequence not in impossible], starts)
    execution = execution or Execution()
    running = run_tasks(solve_sequence, planned, problem, known=kept, execution=execution)
    lost = collect_tasks(running, kept, planned, execution.observer)
    found = [RankedGait(sequence=sequence, status=IMPOSSIBLE, reason=reason) for sequence, reason in impossible.items()]
    found += [_finding(sequence, problem, kept, lost) for sequence in tried if sequence not in impossible]
    ranking = rank_gaits(found, all(finding.status not in (LOST, PENDING) for finding in found))
    if isinstance(kept, GaitStore):
        if ranking.complete:  # first looks have served
            kept.keep_only(map(file_name_of, tried))
        save_ranking(ranking, kept.path / RANKING)
    return ranking


def tasks(sequences: Sequence[ContactSequence], starts: int) -> list[Task]:
    """Return the tasks of a search: a first look at each sequence after its shorter neighbours, then a second one."""
    near = {sequence: [other for other in neighbours(sequence) if other in sequences] for sequence in sequences}
    shorter = {
        sequence: [other for other in near[sequence] if len(other.phases) < len(sequence.phases)]
        for sequence in sequences
    }
    first = [
        Task(_first(sequence), (sequence, starts), tuple(map(_first, shorter[sequence]))) for sequence in sequences
    ]
    return first + [
        Task(file_name_of(sequence), (sequence, 0), tuple(map(_first, (sequence, *near[sequence]))))
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


def solve_sequence(problem: GaitProblem, duty: tuple[ContactSequence, int], *found: Gait | None) -> Gait:
    """Do one task of a search: a first look at a sequence (with so many starts of its own), or the second look (0)."""
    sequence, starts = duty
    problem = problem.replace(sequence=sequence)
    gaits = sorted((gait for gait in found if gait is not None and gait.status.ok), key=objective)
    if starts:
        return solve_fine(problem, solve_coarse(problem, [*gaits[:BORROWED], *default_starts(problem, starts)]))[0]
    own = found[0] or solve_cold(problem, 1)[0]  # its first look was lost with its process
    better = [gait for gait in gaits if gait.sequence != sequence and objective(gait) < (1 - ALIKE) * objective(own)]
    untried = [gait for gait in better if own.status.ok or len(gait.sequence.phases) > len(sequence.phases)]
    again = solve_fine(problem, solve_coarse(problem, untried[:1])) if untried else []
    return verify_best(problem, [own, *again])


def _finding(
    sequence: ContactSequence, problem: GaitProblem, kept: Mapping[str, Gait], lost: Mapping[str, str]
) -> RankedGait:
    key = file_name_of(sequence)
    if key in kept:
        file = kept.file(key) if isinstance(kept, GaitStore) else None
        return judge_gait(kept[key], problem.limits.shortest_phase, file)
    status, reason = (LOST, lost[key]) if key in lost else (PENDING, UNFINISHED)
    return RankedGait(sequence=sequence, status=status, reason=reason)
