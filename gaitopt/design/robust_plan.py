"""Robust plans: one gait and one law for all scenarios, found by adding the most violated scenario."""

import math
from dataclasses import field, replace
from typing import Any

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.dataclass import dataclass
from gaitopt.design.law_choice import LawChoice, check_law_choice, make_family
from gaitopt.design.scenario_test import ScenarioSimulator, ScenarioTest, Walk, walk_scenarios, worst_walk
from gaitopt.design.scenarios import Scenario, Scenarios
from gaitopt.errors import InputError, NoGaitError
from gaitopt.motion.gait import Gait
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solver import solve
from gaitopt.ocp.statement.warm_start import WarmStart
from gaitopt.parallel.execution import Execution
from gaitopt.parameters import check_type
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.verification import verify
from gaitopt.stability.recovery import PushTest, Recovery
from gaitopt.status import Status
from gaitopt.tuning.controller_family import FAMILIES, TorqueLimit
from gaitopt.tuning.gain_search import GainSearchOptions
from gaitopt.tuning.record import Tuning
from gaitopt.tuning.tune import tune_feedback

MOST_ROUNDS = 8
"""Largest number of scenarios that are added."""

LARGEST_TOLERANCE = 0.1
"""Largest tolerance that is advised [rad, rad/s, m/s]: rates of legs are of the order of 1 rad/s."""

QUICK = PushTest(starts=1, steps=1, resolution=1.0)
UNTESTED = Recovery(radius=0.0, starts=0, returned=0, steps=0, tolerance=0.0, beyond=0.0)
"""Verification of the tuned law in each round, which the scenarios replace, and its result."""


@check_arguments
@dataclass(frozen=True, kw_only=True, eq=False)
class RobustPlan:
    """One gait and one law for all scenarios.

    Attributes
    ----------
    gait : Gait
        The plan.
    law : Law
    tuning : Tuning or None
        The tuned gains, for :func:`gaitopt.tuning.save_tuning`; None for a law without gains.
    scenarios : Scenarios
    nominal : Gait
        The optimum without scenarios.
    nominal_law : Law
        The law tuned for the nominal optimum.
    selected : tuple of Scenario
        Scenarios that were added, the most violated one in each round.
    violated : Walk or None
        The worst walk in the candidate scenarios that are not survived; None if the plan is robust.
    survived : int
        Number of candidate scenarios that the gait survives.

    Examples
    --------
    Created by :func:`gaitopt.design.solve_scenarios`:

    >>> "selected" in RobustPlan.__dataclass_fields__
    True
    """

    gait: Gait
    law: Law = field(repr=False)
    tuning: Tuning | None = field(repr=False)
    scenarios: Scenarios
    nominal: Gait
    nominal_law: Law = field(repr=False)
    selected: tuple[Scenario, ...]
    violated: Walk | None
    survived: int

    def __repr__(self) -> str:
        return f"RobustPlan({self})"

    def __str__(self) -> str:
        text = f"{self.survived} of {len(self.scenarios.candidates())} candidate scenarios survived"
        text += f" under {self.law.name}, additional cost {100 * self.additional_cost:+.1f} %"
        if self.violated is None:
            return f"robust: {text}"
        return f"not robust: {text}; worst: {self.violated} (tolerance {self.scenarios.tolerance:g})"

    @property
    def advice(self) -> str:
        """Reason why the worst walk, if it does not fall, does not return to the plan; empty for another reason."""
        return self.explain_deviation(self.violated)

    def explain_deviation(self, walk: Walk | None) -> str:
        """Return the reason why a walk that does not fall does not return to the plan; empty for another reason.

        Examples
        --------
        >>> RobustPlan.explain_deviation.__name__
        'explain_deviation'
        """
        if walk is None or math.isinf(walk.distance):
            return ""
        others = [name for name in walk.scenario.parameters if name != "friction"]
        slips = any(segment.mode.slips for segment in self.gait.motion.segments)
        if slips and "friction" in walk.scenario.parameters:
            others.insert(0, "friction")
        if not others:
            return ""
        larger = float(f"{2 * walk.distance:.0e}")
        if larger > LARGEST_TOLERANCE:
            laws = ", ".join(name for name in FAMILIES if name != self.law.name)
            gains = "more evaluations to tune its gains (search=), " if self.gains else ""
            return (
                "The walk is too far from the plan to have returned to a nearby gait: the law "
                f"{self.law.name} does not stabilise the gait in this scenario. Remedies: {gains}a larger "
                f"torque_limit=, or another law (law=), such as {laws}. A tolerance that accepts this walk would not "
                "show that the gait is stabilised."
            )
        kind = "slipping gait" if slips else "gait"
        return (
            f"The periodic motion of a {kind} depends on {' and '.join(others)}, so the walk does not return to the "
            f"plan exactly: state a larger tolerance=, such as Scenarios(..., tolerance={larger:g})."
        )

    def describe(self) -> dict[str, Any]:
        """Return scenarios, law and result as plain data, which the file of the gait contains."""
        return {
            "ranges": {name: list(pair) for name, pair in self.scenarios.ranges.items()},
            "push": self.scenarios.push,
            "steps": self.scenarios.steps,
            "tolerance": self.scenarios.tolerance,
            "law": self.law.name,
            "gains": dict(self.gains),
            "selected": [str(scenario) for scenario in self.selected],
            "survived": self.survived,
            "candidates": len(self.scenarios.candidates()),
            "worst": "" if self.violated is None else str(self.violated),
            "nominal_friction": self.nominal.motion.parameters["friction"],
            "nominal_objective": self.nominal.solver.objective,
            "additional_cost": self.additional_cost,
        }

    def recorded_gait(self, unseen: ScenarioTest | None = None) -> Gait:
        """Return the gait with the scenarios and the result of the plan in its problem, for a file.

        Parameters
        ----------
        unseen : ScenarioTest, optional
            Test in unseen scenarios, which the file then contains.

        Examples
        --------
        >>> RobustPlan.recorded_gait.__name__
        'recorded_gait'
        """
        record = self.describe()
        if unseen is not None:
            record["unseen"] = {"scenarios": unseen.total, "survived": unseen.total_survived}
        return self.gait.replace_fields(problem={**self.gait.problem, "robust": record})

    @property
    def gains(self) -> dict[str, float]:
        """Tuned gains by name; empty for a law without gains."""
        return {} if self.tuning is None else self.tuning.gains

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
    law: LawChoice = "computed_torque",
    torque_limit: TorqueLimit | None = None,
    search: GainSearchOptions | None = None,
    execution: Execution | None = None,
) -> RobustPlan:
    """Find one gait and one law for all scenarios, by adding the most violated scenario until all are survived.

    In each round the gait is planned for the lowest friction of the selected scenarios, other parameters being those of
    the problem, and the gains of the law are tuned for the worst of the selected scenarios.  The law does
    not depend on the scenario.

    Parameters
    ----------
    problem : GaitProblem
        The nominal problem.
    scenarios : Scenarios
    law : str, Law or callable
        Name of a controller family, see :func:`gaitopt.tuning.controller_family_named`; ``"feedforward"`` for the
        planned torques; a law; or a function (robot, motion, torque_limit) that returns a law or a controller family of
        a gait.  Gains of a law are tuned between 0 and three times their values.
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
        If a range is not that of a parameter or does not contain its nominal value, or there is no gait or no law for
        the nominal problem or a scenario.

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
    check_law_choice(law)
    execution, search = execution or Execution(), search or GainSearchOptions(samples=2, starts=1, evaluations=30)
    limit = _default_limit(problem) if torque_limit is None else torque_limit
    gait = _plan(problem, [], None)
    tuning, chosen = _tune(gait, [], law, limit, search)
    nominal, nominal_law, selected = gait, chosen, list[Scenario]()
    for _ in range(MOST_ROUNDS + 1):
        walker = ScenarioSimulator(gait, chosen, scenarios, default_engine(chosen, gait.robot), scenarios.seed)
        walks = walk_scenarios(walker, scenarios.candidates(), execution)
        violated = worst_walk(walks, scenarios.tolerance)
        if violated is None or violated.scenario in selected or len(selected) == MOST_ROUNDS:
            break
        selected.append(violated.scenario)
        gait = _plan(problem, selected, gait)
        tuning, chosen = _tune(gait, selected, law, limit, search)
    return RobustPlan(
        gait=gait,
        law=chosen,
        tuning=tuning,
        scenarios=scenarios,
        nominal=nominal,
        nominal_law=nominal_law,
        selected=tuple(selected),
        violated=violated,
        survived=sum(walk.distance <= scenarios.tolerance for walk in walks),
    )


def _default_limit(problem: GaitProblem) -> dict[str, float]:
    actuators = problem.robot.actuators
    return {
        name: 1.2 * limit for name, limit in zip(actuators, problem.limits.torques(actuators), strict=True) if limit
    }


def _plan(problem: GaitProblem, selected: list[Scenario], before: Gait | None) -> Gait:
    """Return the verified gait for the lowest friction of some scenarios; InputError if none exists.

    An interrupt of a solve is raised again.
    """
    frictions = [scenario.parameters.get("friction", problem.friction) for scenario in selected]
    lowest = min([problem.friction, *frictions])
    stated = problem.replace(friction=lowest)
    if before is not None and lowest == before.motion.parameters["friction"]:
        return before
    guesses = [stated.guess] if before is None else [stated.guess, WarmStart(before)]
    candidates = []
    for guess in guesses:
        candidates.append(solve(stated.replace(guess=guess)))
        if candidates[-1].status is Status.INTERRUPTED:
            raise KeyboardInterrupt
    solved = [gait for gait in candidates if gait.status.ok]
    if not solved:
        raise NoGaitError(f"No gait was found at friction {lowest:g}. {_reason(candidates[0])}", candidates[0])
    return verify(min(solved, key=lambda gait: gait.solver.objective)).require()


def _reason(gait: Gait) -> str:
    """Return the limits that conflict, or, if none are known, why a solve found no gait."""
    conflicts = "; ".join(map(str, gait.solver.conflicts))
    return f"Conflicts: {conflicts}." if conflicts else gait.status.hint


def _tune(
    gait: Gait, selected: list[Scenario], law: LawChoice, limit: TorqueLimit, search: GainSearchOptions
) -> tuple[Tuning | None, Law]:
    """Return the tuned gains, if any, and the law for the worst of some scenarios; InputError if none exists.

    An interrupt of the tuning, which keeps the best gains, is raised again: the design has no use for them.
    """
    family = make_family(law, gait, limit)
    if not family.gains:
        return None, family.law({})
    grounds = [scenario.parameters for scenario in selected if scenario.parameters]
    tuned = tune_feedback(gait, family, frictions=grounds, search=search, test=QUICK)
    if tuned.search_interrupted or tuned.verified.interrupted:
        raise KeyboardInterrupt
    if not isinstance(tuned.law, Law):
        raise InputError(
            f"No gains of the controller family {family.name!r} define a law for the gait; choose another law."
        )
    return replace(tuned, verified=UNTESTED), tuned.law
