"""Inaccurate plans of a problem: the solution on the coarsest grid that leads to one is not refined again."""

from gaitopt.motion.gait import Gait
from gaitopt.ocp.solution.grid_solve import GridSolution
from gaitopt.ocp.solution.mesh_refinement import NEGLIGIBLE
from gaitopt.status import Status

EQUAL_COST = 1e-6
"""Relative difference of cost below which two solutions on the coarsest grid are the same."""


class InaccuratePlans:
    """Gaits with an inaccurate plan, and the solutions on the coarsest grid from which they were refined."""

    def __init__(self) -> None:
        self._known: list[tuple[GridSolution, Gait]] = []

    def find(self, solution: GridSolution) -> Gait | None:
        """Return the gait with an inaccurate plan that was refined from the same solution, or None."""
        if not solution.outcome.status.ok:
            return None
        scale = max(abs(solution.cost), NEGLIGIBLE * solution.problem.objective.typical)
        same = (gait for known, gait in self._known if abs(known.cost - solution.cost) <= EQUAL_COST * scale)
        return next(same, None)

    def add(self, solution: GridSolution, gait: Gait) -> None:
        """Add the gait refined from a solution on the coarsest grid if its plan is inaccurate."""
        if gait.status is Status.PLAN_INACCURATE:
            self._known.append((solution, gait))
