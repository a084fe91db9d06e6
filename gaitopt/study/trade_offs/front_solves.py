"""How the gaits of a front are solved and replayed: of robots with one foot on the ground, and with any contacts."""

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

from attrs import evolve

from gaitopt.model.planar.planar_check import require_planar
from gaitopt.model.step_check import require_valid_step
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.ocp.multicontact.planar_guess import FromPlanarGait
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.statement.objective import Objective
from gaitopt.study.multistart import (
    FINE_SOLVER,
    best,
    skip_refinement,
    solve_cold,
    solve_start,
    verify_best,
    verify_by_cost,
)
from gaitopt.study.planar_starts import select_best, solve_default, solve_planar_start, verify_best_planar
from gaitopt.study.trade_offs.quantity import AnyProblem, Quantity

SHARE = 0.01
"""Share of the cost in the objective of an end of a front of a robot with several contacts.  Without it, many motions
have the same extreme value of a quantity, among them some that no grid resolves."""


class FrontSolves(ABC):
    """Solves and replays of the problems of a front; none has a certificate, which takes as long as a solve."""

    @abstractmethod
    def check(self, problem: Any) -> None:
        """Raise InputError if the robot of a problem fails its check."""

    @abstractmethod
    def fix_grid(self, problem: Any) -> Any:
        """Return a problem with stated numbers of intervals."""

    @abstractmethod
    def solve_cold(self, problem: Any, starts: int, *, refine: bool = True) -> list[Any]:
        """Return the gaits from the default starts, lowest cost first; with `refine`, on a grid that is refined."""

    @abstractmethod
    def solve_near(self, problem: Any, gait: Any, *, refine: bool = True) -> Any:
        """Return the gait warm-started from another one."""

    @abstractmethod
    def solve_extreme(self, problem: Any, quantity: Quantity, gaits: Sequence[Any], starts: int) -> Any:
        """Return the gait of the best value of a quantity, also from gaits of low cost; `extreme` is its objective."""

    @abstractmethod
    def best(self, gaits: Sequence[Any]) -> Any:
        """Return the gait of lowest cost, or the failure of least violation."""

    @abstractmethod
    def verify_best(self, problem: Any, gaits: Sequence[Any]) -> Any:
        """Return the gait of lowest cost that passes its replay, or a failure with its explanation."""

    @abstractmethod
    def verify_near(self, problem: Any, gait: Any) -> Any:
        """Return the replayed gait that is warm-started from another one."""


class _SingleFootSolves(FrontSolves):
    """Solves and replays for robots with one foot on the ground at a time."""

    def check(self, problem: GaitProblem) -> None:
        require_valid_step(problem.robot)

    def fix_grid(self, problem: GaitProblem) -> GaitProblem:
        counts = problem.transcription.intervals_for(problem.sequence)
        return problem.replace(transcription=evolve(problem.transcription, intervals=counts))

    def solve_cold(self, problem: GaitProblem, starts: int, *, refine: bool = True) -> list[Any]:
        return list(solve_cold(problem if refine else skip_refinement(problem), starts))

    def solve_near(self, problem: GaitProblem, gait: Any, *, refine: bool = True) -> Any:
        return solve_start(problem, gait) if refine else solve_start(skip_refinement(problem), gait, FINE_SOLVER)

    def solve_extreme(self, problem: GaitProblem, quantity: Quantity, gaits: Sequence[Any], starts: int) -> Any:
        extreme = problem.replace(objective=_extreme_of(quantity))
        return best([*(solve_start(extreme, gait) for gait in gaits), *solve_cold(extreme, starts)])

    def best(self, gaits: Sequence[Any]) -> Any:
        return best(gaits)

    def verify_best(self, problem: GaitProblem, gaits: Sequence[Any]) -> Any:
        return verify_best(problem, gaits)

    def verify_near(self, problem: GaitProblem, gait: Any) -> Any:
        return verify_by_cost(problem, [solve_start(problem, gait)])


class _PlanarSolves(FrontSolves):
    """Solves and replays for planar robots with any contacts."""

    def check(self, problem: PlanarProblem) -> None:
        require_planar(problem.robot, problem.parameters)

    def fix_grid(self, problem: PlanarProblem) -> PlanarProblem:
        return problem.replace(transcription=evolve(problem.transcription, intervals=problem.counts))

    def solve_cold(self, problem: PlanarProblem, starts: int, *, refine: bool = True) -> list[Any]:
        return [solve_default(problem if refine else _skip_refinement(problem), starts)]

    def solve_near(self, problem: PlanarProblem, gait: PlanarGait, *, refine: bool = True) -> PlanarGait:
        guessed = problem.replace(guess=FromPlanarGait(gait))
        return solve_planar_start(guessed if refine else _skip_refinement(guessed))

    def solve_extreme(
        self, problem: PlanarProblem, quantity: Quantity, gaits: Sequence[PlanarGait], starts: int
    ) -> PlanarGait:
        """Return the gait of the best value of a quantity and a small share of the cost, from gaits of low cost."""
        objective = _extreme_of(quantity)
        if gaits:
            size = abs(quantity.read(gaits[0]))
            size = 1 / size if quantity.sign < 0 else size
            objective = objective + (SHARE * size / gaits[0].solver.objective) * problem.objective
        extreme = problem.replace(objective=objective)
        near = [self.solve_near(extreme, gait, refine=False) for gait in gaits]
        solved = [gait for gait in near if gait.status.ok]
        return select_best(solved or [*near, *self.solve_cold(extreme, starts)])

    def best(self, gaits: Sequence[PlanarGait]) -> PlanarGait:
        return select_best(list(gaits))

    def verify_best(self, problem: PlanarProblem, gaits: Sequence[PlanarGait]) -> PlanarGait:
        return verify_best_planar(list(gaits))

    def verify_near(self, problem: PlanarProblem, gait: PlanarGait) -> PlanarGait:
        return verify_best_planar([self.solve_near(problem, gait)])


def solves_of(problem: AnyProblem) -> FrontSolves:
    """Return how the gaits of a problem are solved."""
    return _PlanarSolves() if isinstance(problem, PlanarProblem) else _SingleFootSolves()


def _extreme_of(quantity: Quantity) -> Objective:
    if quantity.extreme is None:
        raise ValueError(f"{quantity.name} has no objective")
    return quantity.extreme


def _skip_refinement(problem: PlanarProblem) -> PlanarProblem:
    return problem.replace(transcription=evolve(problem.transcription, tolerance=math.inf))
