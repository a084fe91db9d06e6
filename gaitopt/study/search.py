"""Search: which word walks cheapest."""

from collections.abc import Iterable, Mapping, MutableMapping, Sequence
from concurrent.futures import Executor
from pathlib import Path

from gaitopt.motion.gait import Gait
from gaitopt.motion.word import Word
from gaitopt.ocp.method import check_count
from gaitopt.ocp.problem import GaitProblem
from gaitopt.study.attempt import ALIKE, finished, found_cold, objective, own_starts, proven, scouted
from gaitopt.study.gait_folder import GaitFolder
from gaitopt.study.parcel import Prepare
from gaitopt.study.question import question
from gaitopt.study.ranking import Finding, Ranking, judge, rank, save_ranking
from gaitopt.study.runner import Observer, collect_tasks, run_tasks
from gaitopt.study.task import Task
from gaitopt.study.verdict import IMPOSSIBLE, LOST, PENDING, UNFINISHED
from gaitopt.study.vocabulary import closed_words, neighbours, why_impossible, words_up_to

RANKING = "ranking.json"

BORROWED = 1
"""Starts a word takes over from its neighbours, the cheapest ones."""


def search(
    problem: GaitProblem,
    *,
    max_phases: int = 3,
    starts: int = 4,
    words: Iterable[Word | str] | None = None,
    workers: int = 1,
    executor: Executor | None = None,
    prepare: Prepare | None = None,
    directory: str | Path | None = None,
    observer: Observer | None = None,
) -> Ranking:
    """Find the optimal gait of every word, replay each, and rank them.

    Each word is tried on a coarse grid from gaits of shorter words and from starts of its own; what is found there is
    finished on the problem's grid.  Then each is tried once more from its cheapest neighbour, longer ones included.
    The answer does not depend on the number of workers.

    Parameters
    ----------
    problem : GaitProblem
        Its own word does not matter.
    max_phases : int
        Longest words tried, 1 to 6 phases.
    starts : int
        Starts of its own each word has: the problem's guess or a straight line, a passive cycle if one exists, lines
        with random waves from fixed seeds.
    words : iterable of Word or str, optional
        Only these, each of them closed.
    workers : int
        Processes.
    executor : concurrent.futures.Executor, optional
        Solves the words instead of own processes: a :class:`DaskCluster`, or any other, `workers` tasks at a time.
    prepare : callable, optional
        Called once in each process, to import what the problem needs.
    directory : str or Path, optional
        Folder that keeps a gait file for each word; the same call goes on from there.
    observer : callable, optional
        Called with (steps done, steps in all).

    Returns
    -------
    Ranking
        Solved and replayed gaits first, cheapest first; then words in disguise, failures and impossible words, each
        with the reason.  Interrupted, it ranks what was finished.

    Raises
    ------
    InputError
        If a number or a word cannot be, a word leaves something open, or the folder holds another study.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, MultipleShooting, compass_biped, search
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), word="stick | stick", friction=0.14, speed=0.633, step_length=0.4713,
    ...     limits=Limits(torque=6), transcription=MultipleShooting(intervals=16),
    ... )
    >>> found = search(problem, words=["stick | stick", "slip+ stick | slip+"], starts=1)
    >>> [str(finding.word) for finding in found.findings]
    ['slip+ stick | slip+', 'stick | stick']
    """
    check_count("starts", starts, 1, 1000)
    tried = words_up_to(max_phases) if words is None else closed_words(words, "A search")
    tried = tuple(sorted(dict.fromkeys(tried), key=lambda word: len(word.phases)))
    kept: MutableMapping[str, Gait] = {}
    if directory is not None:
        asked = question(problem.replace(word="stick | stick"), words=[str(word) for word in tried], starts=starts)
        kept = GaitFolder(directory, asked)
    impossible = {word: reason for word in tried if (reason := why_impossible(word, problem))}
    planned = tasks([word for word in tried if word not in impossible], starts)
    running = run_tasks(solve_word, planned, problem, known=kept, workers=workers, executor=executor, prepare=prepare)
    lost = collect_tasks(running, kept, planned, observer)
    found = [Finding(word=word, status=IMPOSSIBLE, reason=reason) for word, reason in impossible.items()]
    found += [_finding(word, problem, kept, lost) for word in tried if word not in impossible]
    ranking = rank(found, all(finding.status not in (LOST, PENDING) for finding in found))
    if isinstance(kept, GaitFolder):
        if ranking.complete:  # first looks have served
            kept.keep_only(map(spelled, tried))
        save_ranking(ranking, kept.path / RANKING)
    return ranking


def tasks(words: Sequence[Word], starts: int) -> list[Task]:
    """Return the tasks of a search: a first look at each word after its shorter neighbours, then a second one."""
    near = {word: [other for other in neighbours(word) if other in words] for word in words}
    shorter = {word: [other for other in near[word] if len(other.phases) < len(word.phases)] for word in words}
    first = [Task(_first(word), (word, starts), tuple(map(_first, shorter[word]))) for word in words]
    return first + [Task(spelled(word), (word, 0), tuple(map(_first, (word, *near[word])))) for word in words]


def spelled(word: Word) -> str:
    """Return a word as part of a file name.

    Examples
    --------
    >>> spelled(Word.parse("slip+ stick | slip+"))
    'slip+_stick__slip+'
    """
    return str(word).replace(" | ", "__").replace(" ", "_")


def _first(word: Word) -> str:
    return f"{spelled(word)}.first"


def solve_word(problem: GaitProblem, duty: tuple[Word, int], *found: Gait | None) -> Gait:
    """Do one task of a search: a first look at a word (with so many starts of its own), or the second look (0)."""
    word, starts = duty
    problem = problem.replace(word=word)
    gaits = sorted((gait for gait in found if gait is not None and gait.status.ok), key=objective)
    if starts:
        return finished(problem, scouted(problem, [*gaits[:BORROWED], *own_starts(problem, starts)]))[0]
    own = found[0] or found_cold(problem, 1)[0]  # its first look was lost with its process
    better = [gait for gait in gaits if gait.word != word and objective(gait) < (1 - ALIKE) * objective(own)]
    untried = [gait for gait in better if own.status.ok or len(gait.word.phases) > len(word.phases)]
    again = finished(problem, scouted(problem, untried[:1])) if untried else []
    return proven(problem, [own, *again])


def _finding(word: Word, problem: GaitProblem, kept: Mapping[str, Gait], lost: Mapping[str, str]) -> Finding:
    key = spelled(word)
    if key in kept:
        file = kept.file(key) if isinstance(kept, GaitFolder) else None
        return judge(kept[key], problem.limits.shortest_phase, file)
    status, reason = (LOST, lost[key]) if key in lost else (PENDING, UNFINISHED)
    return Finding(word=word, status=status, reason=reason)
