"""Rankings of contact sequences by the cost of their gaits."""

import dataclasses
import json
import math
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.energy import positive_work
from gaitopt.motion.gait import Gait
from gaitopt.motion.gait_table import name_objective
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.summary import plain
from gaitopt.ocp.solution.start_selection import SAME_COST
from gaitopt.ocp.statement.criteria import CostOfTransport, PositiveWork
from gaitopt.reductions import rank_of
from gaitopt.study.multistart import objective
from gaitopt.study.sequence_search.sequence_enumeration import is_degenerate
from gaitopt.study.storage.failure_reason import MERGED, PENDING, explain_failure

MOST_CONFLICTS = 2
"""Number of conflicting limits that are listed in a table."""


@dataclass(frozen=True, eq=False, kw_only=True)
class RankedGait:
    """Result of the search for one contact sequence.

    Attributes
    ----------
    sequence : ContactSequence or PhaseSequence
    status : str
        Status of its gait; ``"merged"`` if the gait degenerates to a shorter sequence without a lower cost than the
        gaits of fewer phases; ``"impossible"``; ``"lost"`` if its process died; ``"pending"`` if the search was
        interrupted before; its gait is then that of a first solve, if there is one.
    reason : str
        Reason why it is not ranked; empty if it is.
    gait : Gait, PlanarGait or None
    merged_into : ContactSequence or None
    file : Path or None
        File of the gait.

    Examples
    --------
    >>> RankedGait(sequence=ContactSequence.parse("slip+ | slip+"), status="impossible", reason="it gains speed").ranked
    False
    """

    sequence: ContactSequence | PhaseSequence
    status: str
    reason: str = ""
    gait: Gait | PlanarGait | None = None
    merged_into: ContactSequence | None = None
    file: Path | None = None

    def __repr__(self) -> str:
        cost = "" if self.gait is None or not self.ranked else f", {ranking_cost(self.gait):.6g}"
        return f"RankedGait({str(self.sequence)!r}, {self.status}{cost})"

    @property
    def ranked(self) -> bool:
        """Whether its gait is solved, passes its replay, and does not degenerate to another contact sequence."""
        return self.status == "solved"

    @property
    def short_reason(self) -> str:
        """Reason with the most informative conflicting limits only; :meth:`record` contains all."""
        if self.gait is None or not self.gait.solver.conflicts:
            return self.reason
        return self.reason.replace(
            explain_failure(self.gait), explain_failure(self.gait, most_conflicts=MOST_CONFLICTS)
        )

    def record(self) -> dict[str, Any]:
        """Return the result as plain data."""
        known = self.gait is not None and self.gait.status.ok
        gait = self.gait if known and (self.ranked or self.status in (MERGED, PENDING)) else None
        verification = None if self.gait is None else self.gait.verification
        return plain(
            {
                "sequence": str(self.sequence),
                "status": self.status,
                "cost_of_transport": None if gait is None else gait.cost_of_transport,
                "objective": None if gait is None else gait.solver.objective,
                "ranked_by": None if gait is None else gait.problem["objective"],
                "cost": None if gait is None else ranking_cost(gait),
                "phases": [] if gait is None else phase_durations(gait),
                "verification": None if verification is None else dataclasses.asdict(verification),
                "merged_into": None if self.merged_into is None else str(self.merged_into),
                "file": None if self.file is None else str(self.file),
                "reason": self.reason,
            }
        )


@dataclass(frozen=True, eq=False)
class Ranking:
    """Contact sequences: ranked ones first, in order of cost.

    Attributes
    ----------
    findings : tuple of RankedGait
    complete : bool
        False if the search was interrupted.

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> ranking = rank_gaits([judge_gait(gait, 5e-3, None)], complete=True)
    >>> ranking.best is gait, ranking.records()[0]["status"]
    (True, 'solved')
    """

    findings: tuple[RankedGait, ...]
    complete: bool

    def __repr__(self) -> str:
        count = sum(finding.ranked for finding in self.findings)
        lowest = f", lowest cost {self.findings[0]!r}" if count else ""
        ended = "" if self.complete else ", incomplete"
        return f"Ranking({count} of {len(self.findings)} sequences ranked{lowest}{ended})"

    @property
    def best(self) -> Gait | PlanarGait:
        """The gait of lowest cost.

        Raises
        ------
        InputError
            If no contact sequence has a gait.
        """
        first = self.findings[0]
        if not first.ranked or first.gait is None:
            raise InputError(f"No contact sequence has a gait; for example '{first.sequence}': {first.reason}.")
        return first.gait

    def records(self) -> list[dict[str, Any]]:
        """Return the findings as plain data, in order."""
        return [finding.record() for finding in self.findings]


def phase_durations(gait: Gait | PlanarGait) -> list[list[Any]]:
    """Return mode and duration [s] of each phase.

    Examples
    --------
    >>> from gaitopt import load
    >>> [mode for mode, _ in phase_durations(load("docs/examples/compass_slip.h5"))]
    ['slip+', 'stick']
    """
    if isinstance(gait, PlanarGait):
        parts = zip(gait.sequence.describe_phases(), gait.motion.segments, strict=True)
        return [[text, float(segment.time[-1] - segment.time[0])] for text, segment in parts]
    return [[part.mode.value, part.duration] for part in gait.motion.segments]


def ranking_cost(gait: Gait | PlanarGait) -> float:
    """Return the cost by which a solved gait is ranked: the objective, without its quadrature error if known.

    The cost of transport is that of the replayed step, or of the plan before a replay; positive work is integrated over
    the motion like the cost of transport.  Any other objective is that of the solver, in its unit.

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> ranking_cost(gait) == gait.verification.cost_of_transport
    True
    """
    if isinstance(gait, PlanarGait):
        return gait.solver.objective
    name, motion = gait.problem["objective"], gait.motion
    if name == CostOfTransport.name:
        return gait.cost_of_transport if gait.verification is None else gait.verification.cost_of_transport
    if name == PositiveWork.name:
        positive = positive_work(motion)
        regeneration = gait.problem.get("objective_parameters", {}).get("regeneration")
        if regeneration is not None:
            braking = positive - gait.energy.actuator
            return (positive - regeneration * braking) / (
                motion.total_mass * motion.parameters["gravity"] * motion.travel
            )
    return gait.solver.objective


def judge_gait(gait: Gait, shortest_phase: float, file: Path | None) -> RankedGait:
    """Return the result for the contact sequence of a gait.

    Parameters
    ----------
    shortest_phase : float
        Lower bound of phase durations in the problem [s].
    """
    other = is_degenerate(gait, shortest_phase) if gait.status.ok else None
    if other is None:
        return RankedGait(
            sequence=gait.sequence, status=gait.status.key, reason=explain_failure(gait), gait=gait, file=file
        )
    reason = f"this gait degenerates to '{other}': one phase has its minimum duration"
    return RankedGait(sequence=gait.sequence, status=MERGED, reason=reason, gait=gait, merged_into=other, file=file)


def report_first_pass(sequence: ContactSequence, gait: Gait) -> RankedGait:
    """Return the result for a sequence of which an interrupted search has computed the first pass only."""
    reason = f"first solve: {explain_failure(gait)}"
    if gait.status.ok:
        name = name_objective(gait.problem["objective"])
        reason = f"first solve: {name} {ranking_cost(gait):.6f}, neither replayed nor improved from other sequences yet"
    return RankedGait(sequence=sequence, status=PENDING, reason=reason, gait=gait)


def rank_gaits(findings: list[RankedGait], complete: bool) -> Ranking:
    """Return the ranking of results: ranked, merged, then the others.

    A degenerate gait of lower cost than all gaits with fewer phases counts as a separate gait: its shortest phase is at
    its bound, but the optimum without it is worse.
    """
    costs = [
        (len(finding.sequence.phases), objective(finding.gait))
        for finding in findings
        if finding.gait is not None and finding.status != PENDING
    ]

    def restore_separate(finding: RankedGait) -> RankedGait:
        gait, count = finding.gait, len(finding.sequence.phases)
        simpler = min((cost for phases, cost in costs if phases < count), default=math.inf)
        if gait is None or finding.status != MERGED or objective(gait) >= (1 - SAME_COST) * simpler:
            return finding
        return replace(finding, status=gait.status.key, reason="", merged_into=None)

    findings = [restore_separate(finding) for finding in findings]
    order = {"solved": 0, MERGED: 1}

    def place(finding: RankedGait) -> tuple[int, float]:
        gait = finding.gait
        cost = math.inf if gait is None or not gait.status.ok else rank_of(ranking_cost(gait))
        return order.get(finding.status, 2), cost

    return Ranking(tuple(sorted(findings, key=place)), complete)


def save_ranking(ranking: Ranking, path: Path) -> None:
    """Write a ranking as JSON atomically."""
    with write_atomically(path) as temporary:
        content: Mapping[str, Any] = {"ranked": ranking.records(), "complete": ranking.complete}
        temporary.write_text(json.dumps(content, indent=1), encoding="utf-8")
