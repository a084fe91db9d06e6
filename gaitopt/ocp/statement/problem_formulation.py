"""Optimal-control problems of gaits as mathematics: objective, phases, events, periodicity, targets and limits."""

import math
from collections.abc import Sequence
from typing import Any

from gaitopt.model.contacts.event import EventKind, HybridEvent
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.formulation import Formula, Formulation, bound, collect, escape_latex, latex_number
from gaitopt.model.robot_formulation import (
    FRICTION,
    list_actuators,
    list_parameters,
    motion_of_planar_robot,
    motion_of_walker,
)
from gaitopt.ocp.statement.limits import Margins, Range
from gaitopt.ocp.statement.objective import Objective

COMPLEMENTARITY = (
    "0 ≤ v_t ⟂ μ f_n + f_t ≥ 0 or 0 ≤ -v_t ⟂ μ f_n - f_t ≥ 0",
    r"0 \le v_t \perp \mu f_n + f_t \ge 0\ \text{or}\ 0 \le -v_t \perp \mu f_n - f_t \ge 0",
)
"""Coulomb's law of a contact whose mode is a result."""


def formulate_gait_problem(problem: Any) -> Formulation:
    """Return the optimal-control problem of a walker with one foot on the ground.

    Parameters
    ----------
    problem : GaitProblem

    Returns
    -------
    Formulation
        Printed as text, and displayed as LaTeX in a notebook.

    Examples
    --------
    >>> from gaitopt import GaitProblem, compass_biped
    >>> problem = GaitProblem(robot=compass_biped(), sequence="slip+ stick | slip+", friction=0.14, speed=0.6)
    >>> print(formulate_gait_problem(problem))  # doctest: +ELLIPSIS, +NORMALIZE_WHITESPACE
    Optimal gait of compass_biped: slip+ stick | slip+
      minimise     cost_of_transport = 1/(m g L) ∫ Σ |u_i ṡ_i| dt
      torques      u = (ankle, hip)
      motion       M(q) dv/dt + h(q, v) = E(q) u + (f_t, f_n, 0, ...)
      phase 1      slip+: v_n = 0, v_t > 0, f_t = -μ f_n, f_n ≥ 0.01 m g
      then         at rest: v_t = 0
      phase 2      stick: v_n = 0, v_t = 0, |f_t| ≤ 0.999 μ_s f_n, f_n ≥ 0.01 m g
      touchdown    the landing foot reaches the ground
      impact       M (v⁺ - v⁻) = Wᵀ Λ, v_n⁺ = 0, v_t⁺ ≥ 0, Λ_t = -μ Λ_n, Λ_n ≥ 0
      ...
    """
    robot, limits = problem.robot, problem.limits
    angles = zip(robot.angles, limits.angles(robot.angles), strict=True)
    return Formulation(
        f"Optimal gait of {robot.name}: {problem.sequence}",
        (
            formulate_objective(problem.objective),
            *_free_parameters(problem),
            *list_actuators(robot),
            motion_of_walker(robot),
            *(line for number in range(len(problem.sequence.phases)) for line in _phase(problem, number)),
            *_touchdown(problem),
            Formula("next step", "(q, v)(0) = S (q⁻, v⁺), S exchanges the legs", r"(q, v)(0) = S\, (q^-, v^+)"),
            *_targets(problem),
            *_stability(problem),
            *_torque_limits(limits.torques(robot.actuators), robot.actuators),
            *collect("torque rates", _rate_limits(problem)),
            *collect("angles", [bound(name, low, high, "rad") for name, (low, high) in angles]),
            *_durations_and_rates(limits, "each angular rate", "rad/s"),
            *_ground_and_parameters(problem),
        ),
    )


def formulate_planar_problem(problem: Any) -> Formulation:
    """Return the optimal-control problem of a robot with several contacts.

    Parameters
    ----------
    problem : PlanarProblem

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> from gaitopt.ocp import PlanarProblem
    >>> problem = PlanarProblem(robot=monopod(), sequence="foot stick > flight |", friction=1.0, speed=1.5)
    >>> [line.text for line in formulate_planar_problem(problem).formulas if line.label.startswith("phase")]
    ['foot stick', 'flight']
    """
    robot, limits, sequence = problem.robot, problem.limits, problem.sequence
    coordinates = zip(robot.coordinates, limits.coordinates(robot.coordinates), robot.units, strict=True)
    lines = []
    for number, modes in enumerate(sequence.describe_phases()):
        changes = " & ".join(sequence.describe_event(robot, number))
        kind = "impact" if sequence.events[number].impact else "then"
        lines += [_words(f"phase {number + 1}", modes), _words(kind, changes)]
    return Formulation(
        f"Optimal gait of {robot.name}: {sequence}",
        (
            formulate_objective(problem.objective),
            *_free_parameters(problem),
            *list_actuators(robot),
            *motion_of_planar_robot(robot),
            *(
                Formula(mode.value, *(_stick_in_cone(problem.margins) if mode is Mode.STICK else FRICTION[mode]))
                for mode in FRICTION
            ),
            *lines,
            *_actuator_impulses(problem),
            _formulate_periodicity(robot),
            *_targets(problem),
            *_torque_limits(limits.torques(robot.actuators), robot.actuators, robot.actuator_units),
            *collect("coordinates", [bound(name, low, high, unit) for name, (low, high), unit in coordinates]),
            *collect("heights", [bound(name, least, math.inf, "m") for name, least in limits.height.items()]),
            *_clearance(problem),
            *_planar_margins(problem),
            *_durations_and_rates(limits, "each rate", "m/s or rad/s"),
            *_ground_and_parameters(problem),
        ),
    )


def _formulate_periodicity(robot: Any) -> Formula:
    """Return the condition that a period repeats, with the leg exchange if the robot has one, apart from its travel."""
    matrix, latex = ("S ", r"S\, ") if robot.mirror else ("", "")
    remark = ", S exchanges the legs" if robot.mirror else ""
    remark += f"; {robot.travel} grows by L" if robot.travel else ""
    return Formula("next period", f"(q, v)(0) = {matrix}(q, v)(T⁺){remark}", rf"(q, v)(0) = {latex}(q, v)(T^+)")


def _actuator_impulses(problem: Any) -> tuple[Formula, ...]:
    """Return the impulses of actuators with their bounds, and the velocity jump that they cause."""
    if not problem.impulses:
        return ()
    units = dict(zip(problem.robot.actuators, problem.robot.actuator_units, strict=True))
    bounds = []
    for each in problem.impulses:
        name, (low, high) = f"{each.actuator} {each.moment} {each.event}", each.limits
        bounds.append(bound(name, low, high, f"{units[each.actuator]} s", rf"\text{{{escape_latex(name)}}}"))
    law = Formula("impulses", "M (v' - v) = E P + Wᵀ Λ", r"M (v' - v) = E P + W^\mathsf{T} \Lambda")
    return (law, *collect("", bounds))


def formulate_objective(objective: Objective) -> Formula:
    """Return the objective, a weighted sum term by term.

    Examples
    --------
    >>> from gaitopt import CostOfTransport, TorqueSquared
    >>> formulate_objective(CostOfTransport() + 0.1 * TorqueSquared()).text
    'cost_of_transport + 0.1 torque_squared = 1/(m g L) ∫ Σ |u_i ṡ_i| dt + 0.1 ∫ Σ u_i² dt'
    """
    texts, symbols = [], []
    for weight, term in objective.terms():
        text, latex = term.formula or (term.name, rf"\mathrm{{{escape_latex(term.name)}}}")
        texts.append(text if weight == 1 else f"{weight:g} {text}")
        symbols.append(latex if weight == 1 else rf"{latex_number(weight)}\, {latex}")
    text = " + ".join(texts)
    named = text if text == objective.name else f"{objective.name} = {text}"
    return Formula("minimise", named, " + ".join(symbols))


def _free_parameters(problem: Any) -> tuple[Formula, ...]:
    units = {each.name: each.unit for each in problem.robot.parameters}
    return collect("also over", [bound(name, low, high, units[name]) for name, (low, high) in problem.free.items()])


def _stability(problem: Any) -> tuple[Formula, ...]:
    if problem.stability is None:
        return ()
    text, latex = r"max |λ_i| of the return map", r"\max_i |\lambda_i|"
    return collect("stability", [bound(text, -math.inf, problem.stability.radius, "1", latex)])


def _phase(problem: Any, number: int) -> list[Formula]:
    """Return the contact law of a phase, and the event that ends it if it is not the touchdown."""
    phases, margins = problem.sequence.phases, problem.margins
    mode, least = phases[number], margins.normal_force
    laws = {Mode.STICK: _stick_in_cone(margins), Mode.ANY: COMPLEMENTARITY}
    text, latex = laws.get(mode) or FRICTION[mode]
    lines = [
        Formula(
            f"phase {number + 1}",
            f"{mode.value}: v_n = 0, {text}, f_n ≥ {least:g} m g",
            rf"\text{{{mode.value}:}}\ v_n = 0,\ {latex},\ f_n \ge {latex_number(least)}\, m g",
        )
    ]
    if number + 1 < len(phases) and Mode.ANY not in (mode, phases[number + 1]):
        event = problem.robot.contact_model.between(mode, phases[number + 1]).event
        lines.append(_event(event, phases[number + 1]))
    return lines


def _stick_in_cone(margins: Margins) -> tuple[str, str]:
    """Return the law of a sticking contact with the margin to its friction cone, as text and as LaTeX."""
    share = "" if margins.cone == 0 else f"{1 - margins.cone:g} "
    return f"v_t = 0, |f_t| ≤ {share}μ_s f_n", rf"v_t = 0,\ |f_t| \le {share}\mu_s f_n"


def _clearance(problem: Any) -> tuple[Formula, ...]:
    """Return the least gap of open contacts, and for which part of a swing it holds."""
    least, armed = problem.limits.clearance, any(contact.conditional for contact in problem.robot.contacts)
    remark = ", decreasing to 0 towards lift-off and touchdown" if least else ""
    remark += "; contacts with `armed`: only in the first interval after lift-off" if armed else ""
    return (_words("clearance", f"gap of open contacts ≥ {least:g} m{remark}"),)


def _planar_margins(problem: Any) -> tuple[Formula, ...]:
    """Return the margins to changes of the contact sequence, two lines: of forces, and of rates at events."""
    margins, impulse = problem.margins, problem.limits.impulse
    conditional = any(contact.conditional for contact in problem.robot.contacts)
    forces = [
        f"f_n ≥ {margins.normal_force:g} m g",
        f"|Λ_t| ≤ {1 - margins.impact_cone:g} μ Λ_n at sticking impacts" if math.isfinite(problem.friction) else "",
        f"Λ_n ≥ {impulse:g} N s" if impulse else "",
    ]
    rates = [
        f"approach speed of closing contacts ≥ {margins.touchdown_rate:g} m/s or rad/s",
        f"armed ≥ {margins.touchdown_armed:g} when they close" if conditional else "",
        f"speed of contacts that open at an impact ≥ {margins.separation:g} m/s or rad/s",
        f"slip speed ≥ {margins.slip_speed:g} m/s" if margins.slip_speed and math.isfinite(problem.friction) else "",
    ]
    lines = [", ".join(filter(None, each)) for each in (forces, rates)]
    return _words("margins", lines[0]), _words("", lines[1])


def _event(event: HybridEvent, following: Mode) -> Formula:
    if event.kind is EventKind.SLIP_ONSET:
        sign = "-" if following.sign > 0 else ""
        return Formula("then", f"slip onset: f_t = {sign}μ_s f_n", rf"\text{{slip onset:}}\ f_t = {sign}\mu_s f_n")
    if event.kind is EventKind.REST:
        return Formula("then", "at rest: v_t = 0", r"\text{at rest:}\ v_t = 0")
    return _words("then", event.label)


def _touchdown(problem: Any) -> tuple[Formula, ...]:
    impact, margins = problem.sequence.impact, problem.margins
    share = "" if margins.impact_cone == 0 else f"{1 - margins.impact_cone:g} "
    laws = {
        Mode.STICK: (f"v_t⁺ = 0, |Λ_t| ≤ {share}μ Λ_n", rf"v_t^+ = 0,\ |\Lambda_t| \le {share}\mu \Lambda_n"),
        Mode.ANY: ("Coulomb's law for Λ and v_t⁺", r"\text{Coulomb's law for}\ \Lambda,\ v_t^+"),
        Mode.SLIP_FORWARD: ("v_t⁺ ≥ 0, Λ_t = -μ Λ_n", r"v_t^+ \ge 0,\ \Lambda_t = -\mu \Lambda_n"),
        Mode.SLIP_BACKWARD: ("v_t⁺ ≤ 0, Λ_t = μ Λ_n", r"v_t^+ \le 0,\ \Lambda_t = \mu \Lambda_n"),
    }
    law, latex = laws[impact]
    separation = bound("upward speed of the trailing foot", margins.separation, math.inf, "m/s")
    return (
        _words("touchdown", "the landing foot reaches the ground"),
        Formula(
            "impact",
            f"M (v⁺ - v⁻) = Wᵀ Λ, v_n⁺ = 0, {law}, Λ_n ≥ 0",
            rf"M (v^+ - v^-) = W^\mathsf{{T}} \Lambda,\ v_n^+ = 0,\ {latex},\ \Lambda_n \ge 0",
        ),
        *collect("", [separation]),
    )


def _targets(problem: Any) -> tuple[Formula, ...]:
    step, speed = problem.step_length_range, problem.speed_range
    return collect(
        "targets",
        [
            _positive_bound("step length L", step, "m", r"\text{step length}\ L"),
            _positive_bound("speed L/T", speed, "m/s", r"\text{speed}\ L / T"),
        ],
    )


def _positive_bound(name: str, target: Range, unit: str, symbol: str) -> tuple[str, str] | None:
    return bound(name, target.lower or -math.inf, target.upper, unit, symbol)


def _torque_limits(
    limits: Sequence[float], actuators: Sequence[str], units: Sequence[str] | None = None
) -> tuple[Formula, ...]:
    units = ["N m"] * len(actuators) if units is None else units
    table = zip(actuators, limits, units, strict=True)
    return collect("limits", [bound(name, -limit, limit, unit) for name, limit, unit in table])


def _rate_limits(problem: Any) -> list[tuple[str, str] | None]:
    limits = zip(problem.robot.actuators, problem.limits.torque_rates(problem.robot.actuators), strict=True)
    return [bound(name, -limit, limit, "N m/s") for name, limit in limits]


def _durations_and_rates(limits: Any, rate: str, unit: str) -> tuple[Formula, ...]:
    return (
        *collect("rates", [bound(rate, -limits.rate, limits.rate, unit, rf"\text{{{rate}}}")]),
        *collect(
            "durations",
            [
                bound("each phase", limits.shortest_phase, math.inf, "s", r"\text{each phase}"),
                bound("step T", -math.inf, limits.longest_step, "s", r"\text{step}\ T"),
            ],
        ),
    )


def _ground_and_parameters(problem: Any) -> tuple[Formula, ...]:
    low, high = problem.slope if isinstance(problem.slope, tuple) else (problem.slope, problem.slope)
    parameters = [
        each for each in problem.robot.parameters if each.name in problem.parameters and each.name not in problem.free
    ]
    friction = problem.friction
    ground = {"friction": bound("μ", friction, friction, "1", r"\mu"), "slope": bound("slope", low, high, "rad")}
    return (
        *collect("ground", [line for name, line in ground.items() if name not in problem.free]),
        *list_parameters("parameters", parameters, problem.values),
    )


def _words(label: str, text: str) -> Formula:
    return Formula(label, text, rf"\text{{{escape_latex(text)}}}")
