"""Robust problems and families of gaits as mathematics."""

from typing import TYPE_CHECKING

from gaitopt.control.law import Law
from gaitopt.design.law_choice import LawChoice
from gaitopt.design.scenarios import Scenarios
from gaitopt.model.formulation import Formula, Formulation, bound, collect, latex_number
from gaitopt.motion.printable import format_count
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.statement.member_formulation import OBJECTIVE, formulate_members, state_in_words
from gaitopt.ocp.statement.problem_formulation import formulate_gait_problem

if TYPE_CHECKING:
    from gaitopt.design.family import Family
    from gaitopt.design.robust_problem import RobustProblem

FREE = "also over"
"""Label of the free parameters in the formulation of a gait problem."""


def name_law(law: LawChoice) -> str:
    """Return the name of the law of a robust problem.

    Examples
    --------
    >>> name_law("lqr"), name_law(print)
    ('lqr', 'print')
    """
    if isinstance(law, str):
        return law
    return law.name if isinstance(law, Law) else getattr(law, "__name__", "custom law")


def formulate_robust_problem(stated: "RobustProblem") -> Formulation:
    """Return the nominal problem of a robust gait, the law, and the scenarios in which the walk remains close to it.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> from gaitopt.design import RobustProblem
    >>> problem = GaitProblem(robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=0.6)
    >>> scenarios = Scenarios(ranges={"friction": (0.15, 0.25)}, push=0.05)
    >>> formulas = formulate_robust_problem(RobustProblem(problem, scenarios, law="lqr")).formulas
    >>> print(Formulation("Scenarios", formulas[-6:]))
    Scenarios
      shared     the gait, its torques and the law lqr in all scenarios
      plan       the gait is planned for the lowest friction of the scenarios that are selected
      scenarios  0.15 ≤ friction ≤ 0.25, 5 values
                 |δ| ≤ 0.05 rad/s, 2 pushes δ and none
      number     15 candidate scenarios
      robust     max |y(20 steps) - y*| ≤ 0.0001 from y* + δ in each of them, y* is the planned state after touchdown
    """
    nominal = formulate_gait_problem(stated.problem)
    return Formulation(
        f"Robust gait of {stated.problem.robot.name}: {stated.problem.sequence}",
        (*nominal.formulas, *_formulate_scenarios(stated.scenarios, stated.problem, name_law(stated.law))),
    )


def _formulate_scenarios(scenarios: Scenarios, problem: GaitProblem, law: str) -> tuple[Formula, ...]:
    """Return what all scenarios share, the ranges and pushes, their number and the condition on the walks."""
    units = {each.name: each.unit for each in problem.robot.parameters}
    ranges = [bound(name, *pair, units[name]) for name, pair in scenarios.ranges.items()]
    values = format_count(scenarios.values, "value")
    lines = [(f"{text}, {values}", rf"{latex},\ \text{{{values}}}") for text, latex in filter(None, ranges)]
    start = "y*"
    if scenarios.push:
        pushes, start = format_count(scenarios.pushes, "push", "pushes"), "y* + δ"
        size = rf"|\delta| \le {latex_number(scenarios.push)}\ \mathrm{{rad/s}},\ \text{{{pushes} and none}}"
        lines.append((f"|δ| ≤ {scenarios.push:g} rad/s, {pushes} δ and none", size))
    plan = "the gait is planned for the lowest friction of the scenarios that are selected"
    steps, number = format_count(scenarios.steps, "step"), len(scenarios.candidates())
    return (
        state_in_words("shared", f"the gait, its torques and the law {law} in all scenarios"),
        *([state_in_words("plan", plan)] if "friction" in scenarios.ranges else []),
        *(Formula("" if place else "scenarios", *line) for place, line in enumerate(lines)),
        state_in_words("number", format_count(number, "candidate scenario")),
        Formula(
            "robust",
            f"max |y({steps}) - y*| ≤ {scenarios.tolerance:g} from {start} in each of them, y* is the planned state "
            "after touchdown",
            rf"\max |y(\text{{{steps}}}) - y^*| \le {latex_number(scenarios.tolerance)}\ \text{{in each of them}}",
        ),
    )


def formulate_family(family: "Family") -> Formulation:
    """Return the objective and the shared quantities of a family, its first gait, and what differs in the others.

    Examples
    --------
    >>> from gaitopt import Family, compass_biped
    >>> problem = GaitProblem(robot=compass_biped(), sequence="stick | stick", speed=0.6, free={"hip_mass": (1, 3)})
    >>> text = str(formulate_family(Family([problem, problem.replace(speed=0.7)], weights=(1, 3))))
    >>> print(text)  # doctest: +ELLIPSIS, +NORMALIZE_WHITESPACE
    Family of 2 gaits of compass_biped
      minimise     0.25 J1 + 0.75 J2
      shared       1 ≤ hip_mass ≤ 3 kg
      gait 1       stick | stick
      J1           cost_of_transport = 1/(m g L) ∫ Σ |u_i ṡ_i| dt
      ...
      gait 2       stick | stick, otherwise as gait 1 with
      J2           cost_of_transport = 1/(m g L) ∫ Σ |u_i ṡ_i| dt
      targets      speed L/T = 0.7 m/s
    """
    lines = [_formulate_costs(family), *_formulate_shared_quantities(family)]
    lines += formulate_members(family.problems, "gait", omit=(FREE,))
    robot = family.problems[0].robot.name
    name = "Family" if family.name == "family" else f"Family {family.name!r}"
    return Formulation(f"{name} of {len(family.problems)} gaits of {robot}", tuple(lines))


def _formulate_costs(family: "Family") -> Formula:
    """Return the weighted sum, or the largest, of the objectives of a family."""
    weights = [f"{weight:.4g}" for weight in family.weights or ()]
    texts = [f"{weight} J{number}" for number, weight in enumerate(weights, start=1)]
    symbols = [rf"{weight}\, J_{{{number}}}" for number, weight in enumerate(weights, start=1)]
    if family.worst_case:
        return Formula(OBJECTIVE, f"max({', '.join(texts)})", rf"\max({', '.join(symbols)})")
    return Formula(OBJECTIVE, " + ".join(texts), " + ".join(symbols))


def _formulate_shared_quantities(family: "Family") -> tuple[Formula, ...]:
    """Return the free parameters with their bounds and the other quantities that all gaits of a family share."""
    problem = family.problems[0]
    units = {each.name: each.unit for each in problem.robot.parameters}
    shared = [bound(name, *ends, units[name]) for name, ends in problem.free.items()]
    shared += [(name, rf"\text{{{name}}}") for name in family.shared]
    return collect("shared", shared)
