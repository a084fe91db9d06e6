"""RobustProblem: a gait problem, the scenarios that its gait must survive, and the law of the walks."""

from collections.abc import Mapping
from typing import Any

import attrs

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.design.law_choice import LawChoice, check_law_choice
from gaitopt.design.robust_plan import RobustPlan, solve_scenarios
from gaitopt.design.scenarios import Scenarios
from gaitopt.errors import InputError
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.problem import GaitProblem
from gaitopt.parallel.execution import Execution
from gaitopt.parameters import check_type
from gaitopt.tuning.controller_family import TorqueLimit
from gaitopt.tuning.gain_search import GainSearchOptions


@check_arguments
@dataclass(frozen=True, eq=False)
class RobustProblem:
    """A gait problem with the scenarios that its gait must survive under a law; ``gaitopt design`` solves it.

    Attributes
    ----------
    problem : GaitProblem
        The nominal problem.
    scenarios : Scenarios
    law, torque_limit, search
        As in :func:`gaitopt.design.solve_scenarios`.

    Raises
    ------
    InputError
        If a range is not that of a parameter or does not contain its nominal value, or the law is invalid.

    Examples
    --------
    >>> from gaitopt import Limits, compass_biped
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.19, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared")
    >>> robust = RobustProblem(problem, Scenarios(ranges={"friction": (0.18, 0.2)}, values=2), law="feedforward")
    >>> robust.solve().robust
    True
    """

    problem: GaitProblem
    scenarios: Scenarios
    law: LawChoice = "computed_torque"
    torque_limit: TorqueLimit | None = None
    search: GainSearchOptions | None = None

    def __post_init__(self) -> None:
        if isinstance(self.problem, PlanarProblem):
            raise InputError(
                "Robust gaits are planned for robots with one foot on the ground (GaitProblem) only, got "
                f"{self.problem!r}. For a robot with several contacts, tune a law of its gait for several friction "
                "coefficients ('gaitopt tune GAIT.h5 --law joint_pd --friction 0.3 --friction 0.5'), measure its "
                "margins ('gaitopt push'), and follow the controlled gait over a parameter ('gaitopt trace GAIT.h5 "
                "--law joint_pd')."
            )
        check_type("problem", self.problem, GaitProblem, "a GaitProblem(...)")
        check_type("scenarios", self.scenarios, Scenarios, "Scenarios(ranges={'friction': (0.1, 0.2)})")
        self.scenarios.check_problem(self.problem)
        check_law_choice(self.law)

    def __str__(self) -> str:
        from gaitopt.design.design_formulation import formulate_robust_problem

        return str(formulate_robust_problem(self))

    def _repr_latex_(self) -> str:
        from gaitopt.design.design_formulation import formulate_robust_problem

        return formulate_robust_problem(self).latex

    def describe(self) -> dict[str, Any]:
        """Return the nominal problem, the scenarios and the law as plain data (SI units, angles in rad)."""
        from gaitopt.design.design_formulation import name_law

        scenarios = attrs.asdict(self.scenarios)
        scenarios["ranges"] = {name: list(pair) for name, pair in self.scenarios.ranges.items()}
        limit = dict(self.torque_limit) if isinstance(self.torque_limit, Mapping) else self.torque_limit
        return {
            "name": self.name,
            "kind": "robust problem",
            "law": name_law(self.law),
            "torque_limit": limit,
            "scenarios": scenarios | {"candidates": len(self.scenarios.candidates())},
            "nominal": self.problem.describe(),
        }

    @property
    def name(self) -> str:
        """Name of the problem."""
        return self.problem.name

    def solve(self, *, execution: Execution | None = None) -> RobustPlan:
        """Find one gait and one law for all scenarios; see :func:`gaitopt.design.solve_scenarios`."""
        return solve_scenarios(
            self.problem,
            self.scenarios,
            law=self.law,
            torque_limit=self.torque_limit,
            search=self.search,
            execution=execution,
        )
