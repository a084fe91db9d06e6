"""Robust plans: one gait and one law for all scenarios, found by adding the most violated scenario."""

from dataclasses import dataclass, field

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.design.scenario_test import ScenarioSimulator, Walk, walk_scenarios, worst_walk
from gaitopt.design.scenarios import Scenario, Scenarios
from gaitopt.errors import InputError
from gaitopt.motion.gait import Gait
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solver import solve
from gaitopt.ocp.statement.warm_start import WarmStart
from gaitopt.parallel.execution import Execution
from gaitopt.parameters import check_type
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.verification import verify
from gaitopt.stability.recovery import PushTest
from gaitopt.tuning.controller_family import TorqueLimit, controller_family_named
from gaitopt.tuning.gain_search import GainSearchOptions
from gaitopt.tuning.record import Tuning
from gaitopt.tuning.tune import tune_feedback

MOST_ROUNDS = 8
"""Largest number of scenarios that are added."""

QUICK = PushTest(starts=1, steps=1, resolution=1.0)
"""Verification of the tuned law in each round, which the scenarios replace."""


@check_arguments
@dataclass(frozen=True, kw_only=True, eq=False)
class RobustPlan:
    """One gait and one law for all scenarios.

    Attributes
    ----------
    gait : Gait
        The plan.
    law : Law
    gains : dict of str to float
    nominal : Gait
        The optimum without scenarios.
    nominal_law : Law
        The law tuned for the nominal optimum.
    selected : tuple of Scenario
        Scenarios that were added, the most violated one in each round.
    violated : Walk or None
        The worst walk among the candidates that is not survived; None if the plan is robust.

    Examples
    --------
    Created by :func:`gaitopt.design.solve_scenarios`:

    >>> "selected" in RobustPlan.__dataclass_fields__
    True
    """

    gait: Gait
    law: Law = field(repr=False)
    gains: dict[str, float]
    nominal: Gait
    nominal_law: Law = field(repr=False)
    selected: tuple[Scenario, ...]
    violated: Walk | None

    def __repr__(self) -> str:
        robust = "robust" if self.robust else f"not robust: {self.violated!r}"
        count = len(self.selected)
        scenarios = "1 scenario" if count == 1 else f"{count} scenarios"
        return f"RobustPlan({self.gait!r}, {scenarios}, {robust}, {self.additional_cost:+.1%} cost)"

    @property
    def robust(self) -> bool:
        """Whether all candidate scenarios are survived."""
        return self.violated is None

    @property
    def additional_cost(self) -> float:
        """Objective of the plan relative to that of the nominal optimum, minus 1."""
        return self.gait.solver.objective / self.nominal.solver.objective - 1


@check_arguments
def solve_scenarios(
    problem: GaitProblem,
    scenarios: Scenarios,
    *,
    law: str = "computed_torque",
    torque_limit: TorqueLimit | None = None,
    search: GainSearchOptions | None = None,
    execution: Execution | None = None,
) -> RobustPlan:
    """Find one gait and one law for all scenarios, by adding the most violated scenario until all are survived.

    In each round the gait is planned for the lowest friction of the selected scenarios, other parameters being those of
    the problem, and the gains of the law are tuned for the worst of the selected scenarios.  The law does
    not know the scenario.

    Parameters
    ----------
    problem : GaitProblem
        The nominal problem.
    scenarios : Scenarios
    law : str
        Name of the controller family; see :func:`gaitopt.tuning.controller_family_named`.
    torque_limit : float or mapping of actuator to float, optional [N m]
        Limit of the torques under feedback; 1.2 times that of the problem by default.
    search : GainSearchOptions, optional
    execution : Execution, optional
        Workers of the walks in the candidate scenarios.

    Returns
    -------
    RobustPlan
        Check `robust`, then test it in unseen scenarios: :func:`gaitopt.design.check_scenarios`.

    Raises
    ------
    InputError
        If a range is not that of a parameter, or there is no gait or no law for the nominal problem or a scenario.

    Examples
    --------
    >>> from gaitopt import Limits, compass_biped
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.19, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared")
    >>> quick = GainSearchOptions(samples=0, starts=1, evaluations=1)
    >>> plan = solve_scenarios(problem, Scenarios(ranges={"friction": (0.18, 0.2)}, values=2), search=quick)
    >>> plan.robust, plan.additional_cost >= 0
    (True, True)
    """
    check_type("problem", problem, GaitProblem, "a GaitProblem(...)")
    check_type("scenarios", scenarios, Scenarios, "Scenarios(ranges={'friction': (0.1, 0.2)})")
    scenarios.check_problem(problem)
    execution, search = execution or Execution(), search or GainSearchOptions(samples=2, starts=1, evaluations=30)
    limit = _default_limit(problem) if torque_limit is None else torque_limit
    gait = _plan(problem, [], None)
    tuned, tuning_law = _tune(gait, [], law, limit, search)
    nominal, nominal_law, selected = gait, tuning_law, list[Scenario]()
    for _ in range(MOST_ROUNDS + 1):
        walker = ScenarioSimulator(gait, tuning_law, scenarios, default_engine(tuning_law, gait.robot), scenarios.seed)
        violated = worst_walk(walk_scenarios(walker, scenarios.candidates(), execution), scenarios.tolerance)
        if violated is None or violated.scenario in selected or len(selected) == MOST_ROUNDS:
            break
        selected.append(violated.scenario)
        gait = _plan(problem, selected, gait)
        tuned, tuning_law = _tune(gait, selected, law, limit, search)
    return RobustPlan(
        gait=gait,
        law=tuning_law,
        gains=tuned.gains,
        nominal=nominal,
        nominal_law=nominal_law,
        selected=tuple(selected),
        violated=violated,
    )


def _default_limit(problem: GaitProblem) -> dict[str, float]:
    actuators = problem.robot.actuators
    return {
        name: 1.2 * limit for name, limit in zip(actuators, problem.limits.torques(actuators), strict=True) if limit
    }


def _plan(problem: GaitProblem, selected: list[Scenario], before: Gait | None) -> Gait:
    """Return the verified gait for the lowest friction of some scenarios; InputError if there is none."""
    frictions = [scenario.parameters.get("friction", problem.friction) for scenario in selected]
    lowest = min([problem.friction, *frictions])
    stated = problem.replace(friction=lowest)
    if before is not None and lowest == before.motion.parameters["friction"]:
        return before
    candidates = [solve(stated)]
    if before is not None:
        candidates.append(solve(stated.replace(guess=WarmStart(before))))
    solved = [gait for gait in candidates if gait.status.ok]
    if not solved:
        raise InputError(f"There is no gait with friction {lowest:g}: {candidates[0].status.hint}")
    return verify(min(solved, key=lambda gait: gait.solver.objective)).require()


def _tune(
    gait: Gait, selected: list[Scenario], name: str, limit: TorqueLimit, search: GainSearchOptions
) -> tuple[Tuning, Law]:
    """Return the law tuned for the worst of some scenarios; InputError if there is none."""
    family = controller_family_named(name, gait.robot, gait.motion, torque_limit=limit)
    grounds = [scenario.parameters for scenario in selected if scenario.parameters]
    tuned = tune_feedback(gait, family, frictions=grounds, search=search, test=QUICK)
    if not isinstance(tuned.law, Law):
        raise InputError(f"No gains of the family {name!r} give a law for the gait.")
    return tuned, tuned.law
