"""Family: several gait problems whose free parameters, torques or gains have the same values in all gaits."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.design.shared_quantities import check_shared_quantities
from gaitopt.errors import InputError
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.ocp.nlp.nlp_solver import NlpSolver
from gaitopt.ocp.problem import GaitProblem
from gaitopt.parameters import check_type
from gaitopt.progress import SolveObserver, silent

if TYPE_CHECKING:
    from gaitopt.design.family_gaits import FamilyGaits


@check_arguments
@dataclass(frozen=True, eq=False)
class Family:
    """Several gaits of one walker with the same values of the free parameters and of other shared quantities.

    The gaits may differ in speed, slope, friction, contact sequence, limits and objective.

    Attributes
    ----------
    problems : tuple of GaitProblem
        Problems with the same robot and the same bounds of their free parameters.
    weights : tuple of float, optional
        Positive weights of the objectives; equal ones by default.  They are divided by their sum.
    worst_case : bool
        Whether the largest weighted objective is minimised instead of their sum.
    name : str
    shared : tuple of str
        Other quantities with the same values in all gaits: ``"torques"`` at equal fractions of each phase, and
        ``"gains"`` of the law of :class:`gaitopt.StabilityBound`.  The grids are then
        those of the problems, by default with 40 intervals in a sticking phase, and not refined.

    Raises
    ------
    InputError
        If there are fewer than two problems, they share nothing or have different free parameters, or the weights or
        the shared quantities are invalid.

    Examples
    --------
    >>> from gaitopt import Family, GaitProblem, Limits, compass_biped
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared", free={"hip_mass": (1, 3)},
    ... )
    >>> family = Family([problem.replace(speed=speed) for speed in (0.55, 0.6)])
    >>> result = family.solve()
    >>> result.status.ok, 1 < result.design["hip_mass"] < 3
    (True, True)
    """

    problems: Sequence[GaitProblem]
    weights: Sequence[float] | None = None
    worst_case: bool = False
    name: str = "family"
    shared: Sequence[str] = ()

    def __post_init__(self) -> None:
        problems = tuple(self.problems)
        shared = (self.shared,) if isinstance(self.shared, str) else tuple(self.shared)
        if len(problems) < 2:
            raise InputError(f"A Family needs at least two problems, got {len(problems)}.")
        for number, problem in enumerate(problems, start=1):
            if isinstance(problem, PlanarProblem):
                raise InputError(
                    f"A Family is designed for robots with one foot on the ground (GaitProblem) only; problem {number} "
                    "is a PlanarProblem. For a robot with several contacts, free={...} of one PlanarProblem makes "
                    "parameters optimisation variables of its gait."
                )
            check_type(f"problem {number} of a Family", problem, GaitProblem, "a GaitProblem(...)")
            problem.sequence.require_closed("A Family")
            if problem.robot is not problems[0].robot:
                raise InputError(f"Problem {number} of a Family must have the same robot as the first one.")
            if not (problems[0].free or shared):
                raise InputError(
                    "The problems of a Family must have at least one free parameter; problem 1 has none. Without free "
                    "parameters, set shared='torques' or shared='gains'."
                )
            if problem.free != problems[0].free:
                raise InputError(
                    f"All problems of a Family must have the same free parameters: problem {number} has "
                    f"free={problem.free}, but problem 1 has free={problems[0].free}."
                )
        check_shared_quantities(shared, problems)
        object.__setattr__(self, "problems", problems)
        object.__setattr__(self, "shared", shared)
        object.__setattr__(self, "weights", self._normalise_weights(len(problems)))

    def __str__(self) -> str:
        from gaitopt.design.design_formulation import formulate_family

        return str(formulate_family(self))

    def _repr_latex_(self) -> str:
        from gaitopt.design.design_formulation import formulate_family

        return formulate_family(self).latex

    def describe(self) -> dict[str, Any]:
        """Return weights, shared quantities and gait problems as plain data (SI units, angles in rad)."""
        first = self.problems[0]
        return {
            "name": self.name,
            "kind": "family",
            "worst_case": self.worst_case,
            "weights": list(self.weights or ()),
            "free": {name: list(ends) for name, ends in first.free_ranges.items()},
            "shared": list(self.shared),
            "gaits": [problem.describe() for problem in self.problems],
        }

    def _normalise_weights(self, count: int) -> tuple[float, ...]:
        try:
            weights = np.ones(count) if self.weights is None else np.array(self.weights, dtype=float)
        except (TypeError, ValueError):
            weights = np.empty(0)
        if weights.shape != (count,) or not np.all(np.isfinite(weights) & (weights > 0)):
            raise InputError(f"weights of a Family must be {count} positive numbers, got {self.weights!r}.")
        return tuple((weights / weights.sum()).tolist())

    def solve(self, *, solver: NlpSolver | None = None, observer: SolveObserver = silent) -> "FamilyGaits":
        """Find the parameters and the gaits of least weighted cost.

        One NLP of all gaits is solved on the coarsest grids, from gaits with the parameters at their start values.
        Each gait is then solved with the optimal parameters on a grid refined for it, and the NLP of all gaits is
        solved again on these grids, until the parameters no longer change.  If the gaits share other quantities, one
        NLP of all gaits is solved on their common grid.

        Parameters
        ----------
        solver : Ipopt, optional
            Solver of the NLP of all gaits.
        observer : SolveObserver
            Receives an :class:`gaitopt.progress.Iteration` per iteration.

        Returns
        -------
        FamilyGaits
            A numerical failure raises no exception: check its ``status``.
        """
        from gaitopt.design.family_solve import solve_family

        return solve_family(self, Ipopt() if solver is None else solver, observer)
