"""Solution of a problem of a planar robot on one grid: its accuracy, and remarks on its replay."""

import math
from dataclasses import replace

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.locks import cached_property
from gaitopt.motion.gait import BEFORE_REFINEMENT
from gaitopt.motion.ground_penetration import Penetration, find_penetrations_of_parts
from gaitopt.motion.motion import Array
from gaitopt.motion.undecided_touchdowns import UndecidedTouchdown, find_undecided_touchdowns_of_parts
from gaitopt.ocp.multicontact.early_touchdown import find_early_touchdowns
from gaitopt.ocp.multicontact.planar_plan import SampledPlan, errors_between_nodes, plan_parameters
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_remarks import (
    REPLAYABLE,
    find_least_forces,
    find_worst_phase,
    report_cost_of_grid,
    report_early_touchdowns,
    report_inaccuracy,
    report_magnification,
    report_overhead_angles,
    report_penetrations,
    report_shortest_phases,
)
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.multicontact.replay_prediction import predict_replay_error
from gaitopt.ocp.multicontact.touchdown_from_below import find_highest_rows, find_rows_below
from gaitopt.ocp.multicontact.undecided_rows import find_rows_beside
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.nlp_solver import NlpResult
from gaitopt.ocp.solution.cost_error import NEGLIGIBLE
from gaitopt.reductions import worst
from gaitopt.status import Status


@dataclass(frozen=True, eq=False)
class GridResult:
    """The solution of a problem on one grid.

    Attributes
    ----------
    problem : PlanarProblem
    transcription : PlanarTranscription
    bounds : Bounds
    outcome : NlpResult
    ending : str
        How the solve on a finer grid failed; empty otherwise.
    coarser_errors : (n_phases,) array or None
        Errors between nodes of the solution on the next coarser grid; None if there is none.
    cost_error : float
        Relative difference of the objective from that on a grid with half or twice the intervals; nan if none is known.
    cost_ending : str
        Why `cost_error` exceeds its tolerance; empty otherwise.
    """

    problem: PlanarProblem
    transcription: PlanarTranscription
    bounds: Bounds
    outcome: NlpResult
    ending: str = ""
    coarser_errors: Array | None = None
    cost_error: float = math.nan
    cost_ending: str = ""

    @property
    def values(self) -> dict[str, float]:
        """Every parameter by name, the free ones with their optimised values."""
        return plan_parameters(self.transcription, self.problem, self.outcome.x)

    @cached_property
    def _plan(self) -> SampledPlan:
        return SampledPlan(self.transcription, self.values, self.outcome.x)

    @property
    def error(self) -> float:
        """Error between nodes; inf without a solution."""
        return worst(0.0, self.errors)

    @cached_property
    def errors(self) -> Array:
        """Error between nodes of each phase; inf without a solution."""
        if not (self.outcome.status.ok or self.outcome.status is Status.PLAN_INACCURATE):
            return np.full(len(self.transcription.phases), np.inf)
        return errors_between_nodes(self.transcription, self.values, self.outcome.x)

    @cached_property
    def replay_error(self) -> float:
        """Predicted error of the state at the end of a replay; nan if it is not known, see `predict_replay_error`."""
        if not self.outcome.status.ok:
            return float("nan")
        return predict_replay_error(self.transcription, self.values, self.outcome.x)

    @property
    def fails_replay(self) -> bool:
        """Whether a plan that is accurate between its nodes is predicted to fail its replay; False if not known.

        A problem whose tolerance is that of a replay or larger accepts such a plan.
        """
        return self.problem.transcription.tolerance < REPLAYABLE and self.replay_error > REPLAYABLE

    @cached_property
    def early_touchdowns(self) -> dict[int, float]:
        """Rows of gaps that are negative after an early touchdown, and their bounds; see `find_early_touchdowns`."""
        if not (self.outcome.status.ok or self.outcome.status is Status.PLAN_INACCURATE):
            return {}
        return find_early_touchdowns(self._plan, self.problem.limits.clearance)

    @cached_property
    def penetrations(self) -> tuple[Penetration, ...]:
        """Contacts that are below the ground while armed; see `find_penetrations_of_parts`."""
        if not (self.outcome.status.ok or self.outcome.status is Status.PLAN_INACCURATE):
            return ()
        return tuple(find_penetrations_of_parts(self._plan.robot, self._plan.values, self._plan.parts))

    @cached_property
    def undecided_touchdowns(self) -> tuple[UndecidedTouchdown, ...]:
        """Touchdowns that rounding errors decide; see `find_undecided_touchdowns_of_parts`."""
        if not (self.outcome.status.ok or self.outcome.status is Status.PLAN_INACCURATE):
            return ()
        return tuple(find_undecided_touchdowns_of_parts(self._plan.robot, self._plan.values, self._plan.parts))

    @property
    def touchdowns_from_below(self) -> tuple[Penetration, ...]:
        """Those of the penetrations after which the contact touches down from below."""
        return tuple(penetration for penetration in self.penetrations if penetration.is_touchdown_from_below)

    @property
    def has_invalid_touchdown(self) -> bool:
        """Whether a contact touches down too early or from below."""
        return bool(self.early_touchdowns or self.touchdowns_from_below)

    def list_repairs(self, *, from_below: bool) -> dict[int, float]:
        """Return the rows of gaps that are too small because of early touchdowns alone, or of all, and their bounds."""
        return self.list_raised_rows() if from_below else self.early_touchdowns

    def list_raised_rows(self) -> dict[int, float]:
        """Return the rows of gaps that are too small because of invalid touchdowns or grazes, and their bounds.

        Early touchdowns are first: without them, a plan may have no touchdown from below and no graze.
        """
        if self.early_touchdowns or not (self.touchdowns_from_below or self.undecided_touchdowns):
            return self.early_touchdowns
        clearance = self.problem.limits.clearance
        rows = find_rows_below(self._plan, self.touchdowns_from_below, clearance)
        return rows | find_rows_beside(self._plan, self.undecided_touchdowns, clearance)

    def list_highest_rows(self) -> list[int]:
        """Return the rows of the largest gaps between a penetration and the touchdown; see `find_highest_rows`."""
        return find_highest_rows(self._plan, [each for each in self.penetrations if each.lands])

    def mark_inaccurate(self, ending: str | None = None, coarser_errors: Array | None = None) -> "GridResult":
        """Return the solution with the status of an inaccurate plan, whose refinement ended as stated."""
        outcome = replace(self.outcome, status=Status.PLAN_INACCURATE)
        ending, errors = (self.ending if ending is None else ending), coarser_errors
        return replace(
            self, outcome=outcome, ending=ending, coarser_errors=self.coarser_errors if errors is None else errors
        )

    def compare_cost(self, other: "GridResult") -> "GridResult":
        """Return the solution with the relative difference of its objective from that on another grid."""
        cost, difference = self.outcome.objective, abs(self.outcome.objective - other.outcome.objective)
        size = max(abs(cost), NEGLIGIBLE * self.problem.objective.typical)
        return replace(self, cost_error=difference / size)

    def mark_costly(self, ending: str) -> "GridResult":
        """Return the solution with the reason why the error of its objective exceeds the tolerance."""
        return replace(self, cost_ending=ending)

    def mark_interrupted(self, message: str) -> "GridResult":
        """Return the solution with the status of an interrupted solve, and the message of its last solve."""
        text = f"{message.partition('; ')[0]}; {BEFORE_REFINEMENT}"
        return replace(self, outcome=replace(self.outcome, status=Status.INTERRUPTED, message=text))

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences on large angles, inaccuracy of the plan, failure of its replay and phases of minimum duration."""
        status = self.outcome.status
        if not (status.ok or status is Status.PLAN_INACCURATE):
            return ()
        postures = report_overhead_angles(self.transcription, self.problem, self.outcome.x)
        remarks = [*report_early_touchdowns(self.transcription, self.early_touchdowns, self.outcome.x, self.outcome.g)]
        if not remarks:
            remarks += [f"{undecided.describe_failure()}." for undecided in self.undecided_touchdowns]
        remarks += report_penetrations(self.penetrations)
        if not self.error <= self.problem.transcription.tolerance and status is Status.PLAN_INACCURATE:
            phase = find_worst_phase(self.transcription, self.errors)
            contacts = find_least_forces(self.transcription, phase, self.bounds, self.outcome.x)
            coarser = self.coarser_errors
            remarks.append(
                report_inaccuracy(self.transcription, self.problem, self.errors, self.ending, contacts, coarser)
            )
        elif self.fails_replay:
            remarks.append(report_magnification(self.problem, self.error, self.replay_error))
        if self.cost_ending:
            remarks.append(report_cost_of_grid(self.problem, self.cost_error, self.cost_ending))
        return (*postures, *remarks, *report_shortest_phases(self.transcription, self.problem, self.outcome.x))
