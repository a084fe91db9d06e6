"""Table of the facts of a gait, the same in terminal, report and notebook."""

import math
from collections.abc import Mapping
from typing import Any

from gaitopt.errors import join_reasons
from gaitopt.motion.energy import Ledger
from gaitopt.motion.gait import IMPLAUSIBLE, NONEXISTENT, Gait
from gaitopt.motion.impact_edge import find_impact_edges
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.printable import format_count
from gaitopt.motion.solve_table import Facts, describe_solve, list_remarks
from gaitopt.status import Status

ROUNDING = 1e-9
"""Margins smaller than this are rounding errors and are printed as 0."""

MOST_SENSITIVITIES = 6
"""Number of sensitivities in the table."""

RELAXATIONS = {"l1_penalty": "exact penalty", "scholtes": "Scholtes", "fischer_burmeister": "Fischer-Burmeister"}
"""Names of relaxations in tables."""


def tabulate_gait(gait: Gait | PlanarGait) -> Facts:
    """Return the facts of a gait as pairs of a name and a text, most important first; names may repeat.

    Parameters
    ----------
    gait : Gait or PlanarGait

    Examples
    --------
    >>> from gaitopt import load
    >>> facts = dict(tabulate_gait(load("docs/examples/compass_slip.h5")))
    >>> facts["sequence"], facts["speed"]
    ('slip+ stick | slip+', '0.633 m/s')
    """
    if isinstance(gait, PlanarGait):
        from gaitopt.motion.planar_gait_table import tabulate_planar_gait

        return tabulate_planar_gait(gait)
    solver, friction = gait.solver, _describe_friction(gait)
    facts = [
        ("status", describe_status(gait)),
        ("sequence", str(gait.sequence)),
        *_origin(gait),
        ("robot", f"{gait.robot_name}, friction {friction}, objective {describe_objective(gait.problem)}"),
        *describe_script(gait.problem),
        *describe_robust_plan(gait.problem),
    ]
    if gait.status in (Status.SOLVED, Status.ACCEPTABLE, Status.NOT_VERIFIED, Status.PLAN_INACCURATE):
        facts += _numbers(gait)
    facts.append(("solver", describe_solve(gait)))
    return [*facts, *list_remarks(solver), *(("warning", str(edge)) for edge in find_impact_edges(gait))]


def _numbers(gait: Gait) -> Facts:
    jump = gait.motion.jumps[0]
    return [
        *_objective_value(gait),
        ("cost of transport", f"{gait.cost_of_transport:.6f}"),
        *describe_design(gait),
        *_grid(gait),
        ("speed", f"{gait.speed:.6g} m/s"),
        ("step length", f"{gait.step_length:.6g} m"),
        ("period", f"{gait.period:.6g} s"),
        ("phases", ", ".join(f"{phase.mode.value} {phase.duration:.4g} s" for phase in gait.motion.segments)),
        (
            "friction margin",
            f"{round_margin(gait.friction_margin):.2e}, the smallest 1 - |f_t| / (mu f_n) while sticking",
        ),
        ("foot slide", f"{1e3 * gait.motion.foot_slide:.3f} mm"),
        ("impact", f"{jump.mode.value}, impulse ratio {jump.ratio:+.4f}"),
        ("energy", describe_energy(gait.energy)),
        ("replay", _replay(gait)),
        *describe_certificate(gait),
    ]


def describe_certificate(gait: Gait | PlanarGait) -> Facts:
    """Return the verdict on the optimum and its largest relative sensitivities; empty without a certificate.

    Examples
    --------
    >>> from gaitopt import load
    >>> describe_certificate(load("docs/examples/compass_slip.h5"))  # its file has none
    []
    """
    certificate = gait.certificate
    if certificate is None:
        return []
    facts, cost = [("optimum", certificate.sentence)], abs(gait.solver.objective)
    effects = [
        f"{one.name} {float(f'{100 * one.change(0.01) / cost:.2g}'):+g} %"
        for one in certificate.sensitivities[:MOST_SENSITIVITIES]
        if cost > 0
    ]
    return [*facts, ("sensitivity", ", ".join(effects) + " of the objective per 1 % increase")] if effects else facts


def describe_status(gait: Gait | PlanarGait) -> str:
    """Return the status and the remedy as a text.

    If the replay of an inaccurate plan passes, the text states that it does, and the tolerance with which the plan
    would be accepted.

    Examples
    --------
    >>> from gaitopt import load
    >>> describe_status(load("docs/examples/compass_slip.h5"))
    'solved: Solved to the requested tolerance.'
    """
    replay, error = gait.verification, gait.solver.error_between_nodes
    if gait.solver.message == IMPLAUSIBLE:  # the remedies of the status concern limits and the solver
        return f"{gait.status.key}: No gait was found: {IMPLAUSIBLE}."
    if NONEXISTENT in gait.solver.message:
        return f"{gait.status.key}: The problem was not solved, since {NONEXISTENT}; the reason is stated below."
    if gait.status is not Status.PLAN_INACCURATE or replay is None or not replay.passed:
        return f"{gait.status.key}: {gait.status.hint}"
    followed = f"{gait.status.key}: The optimiser converged and the replay follows the plan, but"
    tolerance = gait.problem.get("tolerance")
    if tolerance is None:
        tolerance = gait.problem.get("definition", {}).get("transcription", {}).get("tolerance", math.inf)
    if not tolerance < error < math.inf:
        return f"{followed} the plan violates a condition between the nodes (see the warnings)."
    accepted = 10.0 ** math.ceil(math.log10(error))
    return (
        f"{followed} its error between nodes, {error:.1e}, exceeds the tolerance, {tolerance:.1e}. Set tolerance="
        f"{accepted:.0e} in the transcription to accept this accuracy, or see the warnings."
    )


def describe_energy(energy: Ledger) -> str:
    """Return sources and losses of the energy as a text.

    Examples
    --------
    >>> describe_energy(Ledger(actuator=1.0, gravity=0.0, impact_loss=1.0, friction_loss=0.0, kinetic_change=0.0))
    'actuators 1.000000 J + gravity 0.000000 J = impact 1.000000 J + friction 0.000000 J, balance error 0.0e+00'
    """
    return (
        f"actuators {energy.actuator:z.6f} J{_impulses(energy)} + gravity {energy.gravity:z.6f} J = "
        f"impact {energy.impact_loss:z.6f} J + friction {energy.friction_loss:z.6f} J{_forces(energy)}, "
        f"balance error {energy.relative_residual:.1e}"
    )


def _impulses(energy: Ledger) -> str:
    """Return the work of impulses of the actuators, if there are any."""
    if not (energy.impulse_generated or energy.impulse_absorbed):
        return ""
    return f" + impulses ({energy.impulse_generated:z.6f} - {energy.impulse_absorbed:z.6f}) J"


def _forces(energy: Ledger) -> str:
    """Return the entries of dampers, transitions and springs, where they are not zero."""
    dampers = f" + dampers {energy.damping_loss:z.6f} J" if energy.damping_loss else ""
    dampers += f" + transitions {energy.transition_loss:z.6f} J" if energy.transition_loss else ""
    return dampers + (f" + elastic change {energy.elastic_change:z.6f} J" if energy.elastic_change else "")


def _origin(gait: Gait) -> Facts:
    """Return how the contact sequence was determined, if it was open."""
    proposal = gait.proposal
    if proposal is None:
        return []
    steps, relaxation = len(proposal.steps), RELAXATIONS.get(proposal.relaxation, proposal.relaxation)
    origin = (
        f"from '{proposal.sequence}' ({relaxation}, {steps} step{'s' * (steps != 1)}, complementarity "
        f"{proposal.complementarity:.1e}); costs on coarse grids: relaxed problem {proposal.cost_before:.6g}, "
        f"this sequence {proposal.cost_after:.6g}"
    )
    facts = [("contact sequence found", origin), ("stationarity", proposal.stationarity)]
    return [*facts, ("doubt", proposal.reason)] if proposal.reason else facts


def describe_objective(problem: Mapping[str, Any]) -> str:
    """Return the name of the objective of a resolved problem with its parameters.

    Examples
    --------
    >>> describe_objective({"objective": "cost_of_transport"})
    'cost_of_transport'
    """
    parameters = problem.get("objective_parameters")
    values = ", ".join(f"{name} {value}" for name, value in (parameters or {}).items())
    return f"{problem['objective']} ({values})" if values else str(problem["objective"])


def _objective_value(gait: Gait) -> Facts:
    """Return the value of an objective other than the cost of transport, as the solver reports it, with its unit."""
    if gait.problem["objective"] == "cost_of_transport":
        return []
    value = format_objective(gait.solver.objective, gait.problem.get("objective_unit"))
    return [(name_objective(gait.problem["objective"]), value)]


def name_objective(*names: str) -> str:
    """Return the name of an objective in words; of several gaits with different ones, "objective".

    Examples
    --------
    >>> name_objective("torque_squared"), name_objective("torque_squared", "torque_rate")
    ('torque squared', 'objective')
    """
    return names[0].replace("_", " ") if len(set(names)) == 1 else "objective"


def format_objective(value: float, unit: str | None) -> str:
    """Return the value of an objective as text, with its unit if it has one.

    Examples
    --------
    >>> format_objective(84.7150015, "N^2 m^2 s"), format_objective(0.0160193, "1")
    ('84.715 N^2 m^2 s', '0.0160193')
    """
    return f"{value:.6g} {'' if unit in (None, '1') else unit}".strip()


def describe_design(gait: Gait | PlanarGait) -> Facts:
    """Return the optimised parameters with their bounds; empty if there are none.

    Examples
    --------
    >>> from gaitopt import load
    >>> describe_design(load("docs/examples/compass_slip.h5"))
    []
    """
    bounds = gait.problem.get("free") or {}
    values = gait.design.items()
    texts = [f"{name} {value:.6g} ({bounds[name][0]:g} to {bounds[name][1]:g})" for name, value in values]
    return [("design", f"{', '.join(texts)} [SI units, rad]")] if texts else []


def _grid(gait: Gait) -> Facts:
    """Return the number of intervals and the estimated error of the objective on them, if it is known."""
    error = gait.solver.cost_error
    if not math.isfinite(error):
        return []
    accuracy = f"objective within {100 * error:.1g} % of its value on an infinitely fine grid (estimate)"
    count, script = sum(gait.problem["intervals"]), gait.problem.get("script") or {}
    stated = (script.get("parameters") or {}).get("intervals")
    refined = f" (refined from {stated})" if isinstance(stated, int) and stated < count else ""
    return [("grid", f"{count} intervals{refined}, {accuracy}")]


def describe_script(problem: Mapping[str, Any]) -> Facts:
    """Return the script a problem comes from: file, digest, the parameters that were set and the other ones.

    Examples
    --------
    >>> describe_script({})
    []
    """
    script = problem.get("script")
    if not script:
        return []
    parts: Facts = [("script", f"{script['file']}, SHA-256 {script['sha256']}")]
    values = {name: f"{name}={value}" for name, value in script["parameters"].items()}
    for label, names in (
        ("set", script["set"]),
        ("script defaults", [name for name in values if name not in script["set"]]),
    ):
        if names:
            parts.append((label, ", ".join(values[name] for name in names)))
    return parts


def _describe_friction(gait: Gait) -> str:
    """Return the friction of the plan; for a robust gait, also the nominal one if it differs."""
    friction, nominal = gait.motion.parameters["friction"], find_nominal_friction(gait)
    if nominal == friction:
        return f"{friction:g}"
    return f"{friction:g} (the lowest of the added scenarios, for which the gait is planned; nominal {nominal:g})"


def find_nominal_friction(gait: Gait | PlanarGait) -> float:
    """Return the friction of the problem; a robust gait is planned for the lowest friction of its scenarios instead.

    Examples
    --------
    >>> from gaitopt import load
    >>> find_nominal_friction(load("docs/examples/compass_slip.h5"))
    0.14
    """
    plan = gait.problem.get("robust") or {}
    return float(plan.get("nominal_friction", gait.motion.parameters["friction"]))


def describe_robust_plan(problem: Mapping[str, Any]) -> Facts:
    """Return the scenarios of a robust plan, how many it survives at which additional cost, and the worst one.

    Examples
    --------
    >>> describe_robust_plan({})
    []
    """
    plan = problem.get("robust")
    if not plan:
        return []
    scenarios = [f"{name} {lower:g} to {upper:g}" for name, (lower, upper) in plan["ranges"].items()]
    scenarios += [f"pushes up to {plan['push']:g} rad/s"] if plan["push"] else []
    reached = f"{plan['survived']} of {plan['candidates']} candidate scenarios survived under {plan['law']}"
    if verdict := judge_robust_plan(problem):
        tested = plan["unseen"]
        reached = f"{verdict}: {reached}, {tested['survived']} of {tested['scenarios']} unseen ones"
    facts: Facts = [
        (
            "scenarios",
            f"{', '.join(scenarios)}; {format_count(plan['steps'], 'step')}, tolerance {plan['tolerance']:g}",
        ),
        ("robustness", f"{reached}, additional cost {100 * plan['additional_cost']:+.1f} %"),
    ]
    if plan["selected"]:
        facts.append(("added scenarios", "; ".join(plan["selected"])))
    return [*facts, ("worst scenario", plan["worst"])] if plan["worst"] else facts


def judge_robust_plan(problem: Mapping[str, Any]) -> str:
    """Return whether a robust plan survives all scenarios, in words; empty for other gaits and without a test.

    Examples
    --------
    >>> tested = {"survived": 8, "candidates": 8, "unseen": {"survived": 19, "scenarios": 20}}
    >>> judge_robust_plan({"robust": tested}), judge_robust_plan({})
    ('not fully robust', '')
    """
    plan = problem.get("robust") or {}
    if not (tested := plan.get("unseen")):  # a file of an earlier version has no test
        return ""
    survived = plan["survived"] == plan["candidates"], tested["survived"] == tested["scenarios"]
    return "robust" if all(survived) else "not fully robust" if survived[0] else "not robust"


def round_margin(value: float) -> float:
    """Return a value, or 0 if it is smaller than `ROUNDING`.

    Examples
    --------
    >>> round_margin(1e-12)
    0.0
    """
    return 0.0 if abs(value) < ROUNDING else value


def _replay(gait: Gait) -> str:
    replay = gait.verification
    if replay is None:
        return "not replayed"
    if not replay.passed:
        return f"failed: {join_reasons(replay.reasons)}"
    return (
        f"passed: contact sequence '{replay.sequence}', state within {replay.state_error:.1e}, "
        f"cost of transport {replay.cost_of_transport:.6f}"
    )
