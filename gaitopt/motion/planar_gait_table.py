"""Table of the facts of a gait of a robot with several contacts, the same in terminal, report and notebook."""

import math

from gaitopt.errors import GaitoptError, join_reasons
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.gait_table import (
    describe_certificate,
    describe_design,
    describe_energy,
    describe_objective,
    describe_script,
    describe_status,
    format_objective,
    name_objective,
    round_margin,
)
from gaitopt.motion.ground_penetration import LEAST_DEPTH, Penetration, continue_swing, find_penetrations
from gaitopt.motion.impact_edge import find_impact_edges
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.planar_gait_summary import find_depths, find_slides, find_support, friction_margin
from gaitopt.motion.planar_motion import PlanarEvent
from gaitopt.motion.solve_table import Facts, describe_solve, list_remarks
from gaitopt.motion.stated_changes import find_closing
from gaitopt.status import Status

LEAST_IMPULSE = 1e-6
"""Impulse below which a contact is not listed [N s]."""


def tabulate_planar_gait(gait: PlanarGait) -> Facts:
    """Return the facts of a gait as pairs of a name and a text, as :func:`gaitopt.motion.gait_table.tabulate_gait`.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> from gaitopt.ocp import Collocation, PlanarProblem, solve_planar
    >>> gait = solve_planar(PlanarProblem(
    ...     robot=monopod(), sequence="foot stick > flight |", friction=1.0, speed=1.5, step_length=0.6,
    ...     objective="torque_squared", transcription=Collocation(intervals=(8, 12))))
    >>> [text for name, text in tabulate_planar_gait(gait) if name == "sequence"]
    ['foot stick > flight |']
    """
    solver, friction = gait.solver, gait.motion.parameters["friction"]
    facts = [
        ("status", describe_status(gait)),
        ("sequence", str(gait.sequence)),
        ("robot", f"{gait.robot_name}, friction {friction:g}, objective {describe_objective(gait.problem)}"),
        *describe_script(gait.problem),
    ]
    if gait.status in (Status.SOLVED, Status.ACCEPTABLE, Status.NOT_VERIFIED, Status.PLAN_INACCURATE):
        facts += _numbers(gait)
    facts.append(("solver", describe_solve(gait)))
    return [*facts, *list_remarks(solver), *(("warning", str(edge)) for edge in find_impact_edges(gait))]


def _numbers(gait: PlanarGait) -> Facts:
    objective, margin = gait.problem["objective"], friction_margin(gait)
    unit = str(gait.problem.get("objective_unit") or "")
    value = format_objective(gait.solver.objective, unit)
    if " + " in unit:
        value += " (adds squares of N m and of N; a custom objective may weight the actuators)"
    facts = [(name_objective(objective), value)]
    if objective != "cost_of_transport" and math.isfinite(gait.cost_of_transport):
        facts.append(("cost of transport", f"{gait.cost_of_transport:.6f}"))
    facts += [
        *describe_design(gait),
        *_grid(gait),
        ("speed", f"{gait.speed:.6g} m/s"),
        ("step length", f"{gait.step_length:.6g} m"),
        ("period", f"{gait.period:.6g} s"),
        *_phases(gait),
        *_events(gait),
    ]
    if math.isfinite(margin):
        facts.append(
            ("friction margin", f"{round_margin(margin):.2e}, the smallest 1 - |f_t| / (mu f_n) while sticking")
        )
    facts += [("foot slide", f"{name} {1e3 * slide:.3f} mm") for name, slide in find_slides(gait).items()]
    facts += _depths(gait)
    return [*facts, ("energy", describe_energy(gait.energy)), ("replay", _replay(gait)), *describe_certificate(gait)]


def _depths(gait: PlanarGait) -> Facts:
    """Return the depths of the swinging contacts below the ground, and the rise of those that are armed there."""
    depths = {name: depth for name, depth in find_depths(gait).items() if depth > LEAST_DEPTH}
    if not depths:
        return []
    conditional = {entry.name for entry in gait.motion.contact_entries if entry.conditional}
    try:
        penetrations = sorted(find_penetrations(gait.robot, gait.motion), key=lambda each: each.depth)
        armed = {each.contact: each for each in penetrations}  # the deepest one of each contact
    except GaitoptError:  # the file contains no robot that can be restored
        armed, conditional = {}, set()
    facts = Facts()
    for name, depth in depths.items():
        deepest = armed.get(name)
        text = f"{name} by up to {1e3 * max(depth, deepest.depth if deepest else 0.0):.3g} mm "
        support = find_support(gait, name)
        text += f"while {support} of the same body is on the ground" if support else "in swing"
        if deepest:
            text += f", and by up to {1e3 * deepest.depth:.3g} mm while it is armed"
            if not deepest.is_touchdown_from_below:
                text += _describe_rise(continue_swing(gait.robot, gait.motion, deepest))
        elif name in conditional and gait.status is not Status.PLAN_INACCURATE:
            text += ", and is not armed there" if support else ", while it is not armed"
        facts.append(("below ground", text))
    return facts


def _describe_rise(swing: Penetration) -> str:
    """Return how high a contact rises after it is below the ground, until its touchdown."""
    rise = f"{swing.rise:.3g} m" if swing.rise >= 1 else f"{1e3 * swing.rise:.3g} mm"
    text = f"; it then rises to {rise} above the ground"
    if not swing.lands:
        return f"{text} by the end of the motion"
    if swing.is_touchdown_from_below:
        return f"{text}, a height not greater than this depth"
    return f"{text}, a height greater than this depth, so that its touchdown is valid"


def _grid(gait: PlanarGait) -> Facts:
    """Return the numbers of intervals of the phases, and the errors of the plan and of its objective."""
    counts, solver = gait.problem.get("intervals") or [], gait.solver
    stated = gait.problem.get("stated_intervals")
    refined = f" (refined from {' + '.join(map(str, stated))})" if stated else ""
    text = f"{' + '.join(map(str, counts))} intervals{refined}, error between nodes {solver.error_between_nodes:.1e}"
    if math.isfinite(solver.cost_error):
        text += f"; doubling the intervals changes the objective by {100 * solver.cost_error:.1g} %"
    elif gait.status.ok:
        text += "; the effect of the grid on the objective is not estimated (Collocation(cost_tolerance=0.01) does)"
    return [("grid", text)] if counts else []


def _phases(gait: PlanarGait) -> Facts:
    facts = []
    for segment in gait.motion.segments:
        closed = [f"{name} {mode.value}" for name, mode in segment.state.modes if mode is not Mode.FREE]
        duration = segment.time[-1] - segment.time[0]
        facts.append(("phase", f"{', '.join(closed) or 'flight'} for {duration:.4g} s"))
    return facts


def _events(gait: PlanarGait) -> Facts:
    facts = []
    for event in gait.motion.events:
        impulses = [
            f"{entry.name} ({t:.4g}, {n:.4g}) {'N s' if entry.unit == 'm' else 'N m s'}"
            for entry, (t, n) in zip(gait.motion.contact_entries, event.impulse, strict=True)
            if max(abs(t), abs(n)) > LEAST_IMPULSE
        ]
        received = f"; impulse {', '.join(impulses)}" if impulses else ""
        received += "".join(f"; {landing}" for landing in _describe_landings(gait, event))
        if not event.is_impact and find_closing(event.names):
            received = "; without impulse"
        facts.append(("event", f"{' & '.join(event.names)} at {event.time:.4g} s{received}"))
        facts += _actuator_impulses(gait, event)
    return facts


def _actuator_impulses(gait: PlanarGait, event: PlanarEvent) -> Facts:
    """Return the impulse of each actuator at an event, and its work."""
    units = dict(zip(gait.motion.actuators, gait.motion.actuator_units, strict=True))
    return [
        (
            "impulse",
            f"{name} {value:.4g} {units[name]} s just {stage.moment} the impact: "
            f"generates {generated:z.6f} J, absorbs {absorbed:z.6f} J",
        )
        for stage in event.actuator_impulses
        for name, value, generated, absorbed in zip(
            gait.motion.actuators, stage.impulse, stage.generated, stage.absorbed, strict=True
        )
        if value
    ]


def _describe_landings(gait: PlanarGait, event: PlanarEvent) -> list[str]:
    """Return mode and ratio Lambda_t / Lambda_n of the impulses at an impact; the contacts of a body share one."""
    entries, bodies = gait.motion.contact_entries, dict[str, list[int]]()
    for i, entry in enumerate(entries):
        if entry.slides and event.impulse[i, 1] > LEAST_IMPULSE:
            bodies.setdefault(entry.body, []).append(i)
    texts, modes = [], (event.outcome or event.after).modes
    for members in bodies.values():
        tangential, normal = event.impulse[members].sum(axis=0)
        names = " + ".join(entries[i].name for i in members)
        texts.append(f"{names} {modes[members[0]][1].value}, impulse ratio {tangential / normal:+.4f}")
    return texts


def _replay(gait: PlanarGait) -> str:
    replay = gait.verification
    if replay is None:
        return "not replayed"
    if not replay.passed:
        return f"failed: {join_reasons(replay.reasons)}"
    return f"passed: contact sequence '{replay.sequence}', state within {replay.state_error:.1e}"
