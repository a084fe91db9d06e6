"""Elastic form of the problem of a plan whose contacts neither close too early nor touch down from below.

The bounds of a problem do not contain the gaps of contacts that close only while they are armed.  As in its solve, the
gaps that are too small in a solution are bounded, and the elastic problem is solved again near this solution.
"""

from dataclasses import replace

import numpy as np

from gaitopt.interrupts import defer_interrupt
from gaitopt.motion.motion import Array
from gaitopt.ocp.multicontact.grid_result import GridResult
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.multicontact.touchdown_repair import MOST_REPAIRS, Rows
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.elastic import ElasticNlp, ElasticResult, RelaxedSide
from gaitopt.ocp.nlp.nlp_solver import NlpResult, NlpSolver
from gaitopt.ocp.solution.relaxable_limits import RelaxableLimit, relaxed_sides
from gaitopt.progress import Observer
from gaitopt.status import Status


class ElasticPlan:
    """A plan with elastic limits, without invalid touchdowns.

    Parameters
    ----------
    problem : PlanarProblem
    transcription : PlanarTranscription
    bounds : Bounds
    limits : sequence of RelaxableLimit
    sizes, least : (n_variables,) arrays
        Typical sizes of the unknowns, and their lower bounds that are not relaxed.
    only : int, optional
        Number of the only limit that is relaxed; it then has the first slack.  By default all are relaxed.
    """

    def __init__(
        self,
        problem: PlanarProblem,
        transcription: PlanarTranscription,
        bounds: Bounds,
        limits: list[RelaxableLimit],
        sizes: Array,
        least: Array,
        only: int | None = None,
    ) -> None:
        self._problem, self._transcription, self._bounds = problem, transcription, bounds
        self._limits = limits if only is None else [limits[only]]
        self._sizes, self._least = sizes, least
        self._plain = self._bound_gaps({})

    @property
    def sides(self) -> tuple[RelaxedSide, ...]:
        """Relaxed sides of the bounds of the problem."""
        return self._plain.sides

    @property
    def n_limits(self) -> int:
        """Number of slacks."""
        return self._plain.n_limits

    def find_excesses(self, x: Array, data: Array) -> tuple[Array, list[RelaxedSide | None]]:
        """Return the excess over each limit of the problem, and the side of largest excess; see `ElasticNlp`."""
        return self._plain.find_excesses(x, data)

    def minimise(
        self,
        x: Array,
        data: Array,
        prices: Array,
        solver: NlpSolver,
        observer: Observer,
        multipliers: tuple[Array, Array] | None = None,
    ) -> ElasticResult:
        """Minimise the weighted sum of the slacks, see :meth:`ElasticNlp.minimise`, without invalid touchdowns.

        If this fails, the solution with them is returned with the status `Status.PLAN_INACCURATE`: its excess is at
        most that of a solution without them.
        """
        plain = result = self._plain.minimise(x, data, prices, solver, observer, multipliers)
        rows: Rows = {}
        for _ in range(MOST_REPAIRS):
            invalid = self._list_repairs(result)
            if not invalid:
                break
            rows |= invalid
            elastic = self._bound_gaps(rows)
            result = elastic.minimise(result.x, data, prices, solver, observer, elastic.zero_multipliers())
        if result.status is Status.INTERRUPTED or (result.status.ok and not self._list_repairs(result)):
            return self._omit_raised_gaps(result, self._bound_gaps(rows).sides) if rows else result
        return replace(plain, status=Status.PLAN_INACCURATE) if plain.status.ok else plain

    def _bound_gaps(self, rows: Rows) -> ElasticNlp:
        """Return the elastic NLP with lower bounds of further gaps, which belong to the limit of the clearance."""
        g_lower = self._bounds.g_lower.copy()
        g_lower[list(rows)] = list(rows.values())
        bounds = Bounds(self._bounds.x_lower, self._bounds.x_upper, g_lower, self._bounds.g_upper)
        sides = relaxed_sides(self._limits, bounds)
        return ElasticNlp(self._transcription.nlp, bounds, sides, self._sizes, self._least)

    def _omit_raised_gaps(self, result: ElasticResult, sides: tuple[RelaxedSide, ...]) -> ElasticResult:
        """Return a result with the multipliers of the rows that the elastic problem has without repair."""
        at_bounds, at_rows = result.multipliers
        numbers = {side: number for number, side in enumerate(sides, start=at_rows.size - len(sides))}
        kept = np.array([numbers[side] for side in self.sides], dtype=int)
        return replace(result, multipliers=(at_bounds, np.append(at_rows[: at_rows.size - len(sides)], at_rows[kept])))

    @defer_interrupt()
    def _list_repairs(self, result: ElasticResult) -> Rows:
        """Return the rows of gaps that are too small in a solution, and their bounds; none if the solve failed."""
        if not result.status.ok:
            return {}
        empty = np.zeros(0)
        outcome = NlpResult(result.status, "", result.x, empty, 0.0, result.iterations, (empty, empty))
        grid = GridResult(self._problem, self._transcription, self._bounds, outcome)
        return grid.list_repairs(from_below=True)
