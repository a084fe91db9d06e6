"""Compass biped with motors on level ground: one gait and one law for a range of friction and for pushes.

The gait of lowest cost at friction 0.15 (nominal) and the robust gait are simulated under the laws tuned for them, on
floors of other friction and after pushes. The figure shows the distance from the planned state after 20 steps over
friction; distances below 1e-8 are drawn at 1e-8, and the dashed line is the tolerance within which a gait survives.
"""

import numpy as np
from drawing import STYLE

from gaitopt import Execution, GainSearchOptions, GaitProblem, Limits, Scenarios, compass_biped, solve
from gaitopt.design import Scenario, ScenarioSimulator, check_scenarios, solve_scenarios, walk_scenarios
from gaitopt.simulation import default_engine
from gaitopt.study import PublishedValue, Reproduction

SMALLEST = 1e-8
"""Smallest distance that is drawn; smaller ones are drawn at this value."""


def study(lower=0.1, upper=0.2, push=0.1, count=100, evaluations=30, workers=1):  # push in [rad/s]
    """Return the study; count is the number of unseen scenarios of each kind."""
    problem = GaitProblem(
        robot=compass_biped(),
        sequence="stick | stick",
        friction=(lower + upper) / 2,
        speed=0.6,
        step_length=0.45,
        limits=Limits(torque=6),
    )
    scenarios = Scenarios(ranges={"friction": (lower, upper)}, push=push)
    search, execution = GainSearchOptions(samples=2, starts=1, evaluations=evaluations), Execution(workers=workers)
    plan = solve_scenarios(problem, scenarios, search=search, execution=execution)
    laws = {"robust": (plan.gait, plan.law), "nominal": (plan.nominal, plan.nominal_law)}
    tests = {
        name: check_scenarios(gait, law, scenarios, count=count, execution=execution)
        for name, (gait, law) in laws.items()
    }
    remarks = [
        f"The {name} gait survives {test.survived} of {test.scenarios} unseen friction coefficients and "
        f"{test.recovered} of {test.pushed} pushes of up to {push:g} rad/s."
        for name, test in tests.items()
    ]
    remarks.append(f"The cost of transport of the robust gait is {100 * plan.additional_cost:.1f} % higher.")
    lowest = solve(problem.replace(friction=lower)).solver.objective
    number = PublishedValue(
        "cost of transport of the robust gait",
        plan.gait.solver.objective,
        lowest,
        1e-6,
        "optimum at the lowest friction",
    )
    return Reproduction(_figure(laws, scenarios, execution), (number,), tuple(remarks))


def _figure(laws, scenarios, execution):
    lower, upper = scenarios.ranges["friction"]
    frictions = np.linspace(lower, upper, 21)
    with STYLE.figure(3.0) as figure:
        axes = figure.subplots()
        looks = {
            "robust": {"color": "#0072B2", "linestyle": "-", "markersize": 6, "markerfacecolor": "white"},
            "nominal": {"color": "#D55E00", "linestyle": "--", "markersize": 3},
        }  # where distances are equal, the smaller marks are inside the larger ones
        for name, (gait, law) in laws.items():
            walker = ScenarioSimulator(gait, law, scenarios, default_engine(law, gait.robot), 0)
            walks = walk_scenarios(walker, [Scenario({"friction": float(mu)}) for mu in frictions], execution)
            distances = np.array([max(walk.distance, SMALLEST) for walk in walks])
            axes.semilogy(frictions, distances, marker="o", label=name, **looks[name])
        axes.axhline(scenarios.tolerance, label="tolerance", **STYLE.limit_line)
        axes.set(xlabel=r"friction $\mu$", ylabel=f"distance after {scenarios.steps} steps")
        figure.legend(loc="outside right center")
    return figure


if __name__ == "__main__":
    from gaitopt.cli.app import run_study

    run_study(__file__)
