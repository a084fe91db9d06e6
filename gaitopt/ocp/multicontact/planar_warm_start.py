"""Warm start of a planar gait near its problem: its refined grid, all its unknowns and its multipliers."""

import math
from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np
from attrs import evolve

from gaitopt.dataclass import dataclass
from gaitopt.motion.gait import BEFORE_REFINEMENT
from gaitopt.motion.motion import Array
from gaitopt.motion.nlp_solution import Solution, Table
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.summary import plain
from gaitopt.ocp.multicontact.early_touchdown import share_of_clearance
from gaitopt.ocp.multicontact.planar_guess import FromPlanarGait
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.keys import Kind
from gaitopt.ocp.nlp.layout import Layout
from gaitopt.ocp.statement.limits import Range
from gaitopt.ocp.transcription.collocation import Collocation
from gaitopt.ocp.transcription.method import MOST_INTERVALS

MOST_DOUBLED = 2
"""Largest number of times the intervals are doubled, once no more points are added."""
NEARBY = 0.1
"""Largest relative difference of a parameter or target from that of the gait; farther away, the active constraints
differ so much that its multipliers mislead the solver."""

ACTIVE = 1e-6
"""Multiplier, relative to the largest one, above which a bound is active."""

SAME_GAP = 1e-7
"""Difference from the bound after an early touchdown below which a gap has this bound [m]."""

_GRID_AND_GUESS = ("guess", "script", "intervals", "transcription", "cost_tolerance", "objective_unit")


@dataclass(frozen=True, eq=False)
class PlanarWarmStart:
    """A solved gait near a problem, on a grid that the refinement of the problem contains.

    Attributes
    ----------
    solution : Solution
    number : int
        Place of the grid of the gait among the grids of the refinement, counted from 0.
    is_same : bool
        Whether the gait solves this very problem.
    """

    solution: Solution
    number: int
    is_same: bool = False

    def fill(self, transcription: PlanarTranscription) -> tuple[Array, tuple[Array, Array]] | None:
        """Return the unknowns and multipliers of an NLP, or None if the gait does not have all of them."""
        variables, constraints = transcription.variables, transcription.constraints
        if not (_covers(self.solution.unknowns, variables) and _covers(self.solution.constraints, constraints)):
            return None
        x, on_bounds, on_rows = np.zeros(variables.size), np.zeros(variables.size), np.zeros(constraints.size)
        for table, index in variables.tables.items():
            part = self.solution.unknowns[variables.names[table]]
            x[index], on_bounds[index] = part.values, part.multipliers
        for table, index in constraints.tables.items():
            on_rows[index] = self.solution.constraints[constraints.names[table]].multipliers
        return x, (on_bounds, on_rows)

    def find_raised_rows(
        self, transcription: PlanarTranscription, bounds: Bounds, clearance: float
    ) -> dict[int, float]:
        """Return the rows of gaps that were bounded to exclude invalid touchdowns of the gait, with their bounds [m].

        Such a row has a multiplier in the gait, but no bound in the problem.  Without the bound, the solve would leave
        the gait and find it again in further solves.  The bound is that of an early touchdown, or the gap of the gait
        if it differs.

        Parameters
        ----------
        transcription : PlanarTranscription
        bounds : Bounds
            Bounds of the problem.
        clearance : float [m]
        """
        rows, constraints = dict[int, float](), transcription.constraints
        tables = {name: self.solution.constraints[constraints.names[name]] for name in constraints.tables}
        largest = max((np.abs(part.multipliers).max(initial=0.0) for part in tables.values()), default=0.0)
        for name, index in constraints.tables.items():
            active = np.abs(tables[name].multipliers) > ACTIVE * largest
            unbounded = np.isneginf(bounds.g_lower[index]) & np.isposinf(bounds.g_upper[index])
            for place in zip(*(active & unbounded).nonzero(), strict=True):
                row = int(index[place])
                if constraints.entries[row][1].kind is Kind.GAP:
                    least, gap = clearance * share_of_clearance(transcription, row), float(tables[name].values[place])
                    rows[row] = least if abs(gap - least) < SAME_GAP else gap
        return rows


def list_refinements(problem: PlanarProblem) -> Iterator[Collocation]:
    """Return the transcription of a problem and its refinements: more points first, then more intervals."""
    method = evolve(problem.transcription, intervals=problem.counts)
    yield method
    while (finer := method.refine()) is not None:
        method = finer
        yield method
    for doubled in range(1, MOST_DOUBLED + 1):
        counts = tuple(count * 2**doubled for count in problem.counts)
        if max(counts) <= MOST_INTERVALS:
            yield evolve(method, intervals=counts)


def find_warm_start(problem: PlanarProblem) -> PlanarWarmStart | None:
    """Return the start of a problem whose guess is a gait nearby, or None."""
    guess = problem.guess
    if not isinstance(guess, FromPlanarGait) or not _is_near(problem, guess.gait):
        return None
    solution, described = guess.gait.solution, guess.gait.problem
    if solution is None:
        return None
    for number, method in enumerate(list_refinements(problem)):
        if method.name == described.get("transcription") and method.intervals == tuple(solution.intervals):
            return PlanarWarmStart(solution, number, _is_same(problem, described))
    return None


def _is_near(problem: PlanarProblem, gait: PlanarGait) -> bool:
    """Return whether a gait solves a problem with the same objective and with parameters and targets nearby.

    The solution on a coarser grid that an interrupt has left does so too.
    """
    is_solution = gait.status.ok or gait.solver.message.endswith(BEFORE_REFINEMENT)
    if not is_solution or str(gait.sequence) != str(problem.sequence):
        return False
    if gait.problem.get("objective") != problem.objective.name:
        return False
    known = gait.motion.parameters
    fixed = {name: value for name, value in problem.values.items() if name not in problem.free}
    if not all(name in known and _is_within(known[name], Range(value, value)) for name, value in fixed.items()):
        return False
    targets = ((gait.speed, problem.speed_range), (gait.step_length, problem.step_length_range))
    return problem.robot.travel is None or all(_is_within(value, ends) for value, ends in targets)


def _is_same(problem: PlanarProblem, described: Mapping[str, Any]) -> bool:
    """Return whether a problem is that of a gait, apart from its guess and its grid."""
    stated = {name: value for name, value in plain(problem.describe()).items() if name not in _GRID_AND_GUESS}
    known = plain(dict(described))
    return all(known.get(name) == value for name, value in stated.items())


def _is_within(value: float, ends: Range) -> bool:
    """Return whether a value is within a range, or at most a tenth of its size outside."""
    nearest = min(max(value, ends.lower), ends.upper)
    return math.isclose(value, nearest, rel_tol=NEARBY * (1 + 1e-9))


def _covers(tables: Mapping[str, Table], layout: Layout) -> bool:
    """Return whether tables have exactly the entries of a layout."""
    return all(
        (name := layout.names[key]) in tables
        and tables[name].keys == layout.identifiers[key]
        and tables[name].values.shape == index.shape
        for key, index in layout.tables.items()
    )
