"""Remarks on a plan of a robot with several contacts: why it is inaccurate, and phases of minimum duration."""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from gaitopt.model.planar.plausible_geometry import is_armed_behind, report_implausible_geometry
from gaitopt.model.planar.undeclared_travel import state_undeclared_travel
from gaitopt.model.plausible_sizes import report_implausible_sizes
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.ground_penetration import Penetration
from gaitopt.motion.motion import Array
from gaitopt.motion.quantity_labels import state_value
from gaitopt.ocp.multicontact.accuracy_advice import advise_on_accuracy, advise_on_magnification
from gaitopt.ocp.multicontact.phase_grid import GridPhase
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.keys import Place, Unknown
from gaitopt.ocp.statement.limits import report_implausible_angles

ACTIVE = 1e-4
"""Relative distance from its lower bound within which a normal force is at this bound."""

FALLING = 4.0
"""Least ratio of the error on a coarser grid to that on a finer one at which further intervals are advised."""

REPLAYABLE = 1e-6
"""Error between nodes up to which a replay may pass: the tolerance of its final state."""


def report_implausible_robot(problem: PlanarProblem, values: Mapping[str, float]) -> tuple[str, ...]:
    """Return a sentence for each implausible size or direction of the robot of a problem, and for undeclared travel.

    Parameters
    ----------
    problem : PlanarProblem
    values : mapping of str to float
        Values of all parameters.
    """
    undeclared = state_undeclared_travel(problem.robot, values)
    return (
        *((f"{undeclared}.",) if undeclared else ()),
        *report_implausible_sizes(problem.robot, values, problem.step_length_range.lower),
        *report_implausible_geometry(problem.robot, values),
    )


def report_implausible_limits(problem: PlanarProblem) -> tuple[str, ...]:
    """Return a sentence for each range of an angle that was probably stated in degrees."""
    units, ranges = dict(zip(problem.robot.coordinates, problem.robot.units, strict=True)), problem.limits.coordinate
    angles = {name: ranges[name] for name in ranges if units[name] == "rad"}
    return report_implausible_angles("PlanarLimits.coordinate", angles)


def report_inaccuracy(
    transcription: PlanarTranscription,
    problem: PlanarProblem,
    errors: Array,
    ending: str,
    contacts: Sequence[str] = (),
    coarser: Array | None = None,
) -> str:
    """Return a sentence that states in which phase a plan is inaccurate, how its refinement ended, and a remedy.

    Parameters
    ----------
    transcription : PlanarTranscription
    problem : PlanarProblem
    errors : (n_phases,) array
        Error between nodes of each phase.
    ending : str
        How the solve on a finer grid ended; empty if there was none.
    contacts : sequence of str
        Contacts whose normal force is at its lower bound in the least accurate phase.
    coarser : (n_phases,) array, optional
        Errors between nodes of the next coarser grid, if it was solved: more intervals are a remedy only if they
        decrease the error.
    """
    worst = find_worst_phase(transcription, errors)
    error = float(errors[worst.number])
    before = math.nan if coarser is None else float(coarser[worst.number])
    reason = f"a finer grid has no solution ({ending})" if ending else "the grid is not refined further"
    is_converging = not ending and error <= before / FALLING
    if is_converging:
        reason += f", although this decreased the error from {before:.1e}"
    elif not ending and math.isfinite(before):
        reason = (
            f"a finer grid does not decrease it sufficiently (from {before:.1e}), so that more intervals do not help"
        )
    is_replayable = error <= REPLAYABLE
    remedy = advise_on_accuracy(problem, worst, contacts, is_replayable=is_replayable, is_converging=is_converging)
    if contacts:
        remedy = (
            f"the normal force of {' and '.join(contacts)} is at its lower bound in this phase, where torques and "
            f"forces may change abruptly, however fine the grid: {remedy}"
        )
    return (
        f"the error between nodes of {worst.place().label} is {error:.1e} on {worst.count} intervals, "
        f"but the tolerance is {problem.transcription.tolerance:.1e}, and {reason}: {remedy}"
    )


def report_magnification(problem: PlanarProblem, error: float, replay_error: float) -> str:
    """Return a sentence on a plan whose replay is predicted to fail, and a remedy.

    Parameters
    ----------
    problem : PlanarProblem
    error : float
        Error between nodes.
    replay_error : float
        Predicted error of the state at the end of the replay.
    """
    return (
        f"the motion magnifies the error between nodes of {error:.1e} by a factor of {replay_error / error:.1g} to "
        f"{replay_error:.1e} at the end of the replay, more than {REPLAYABLE:g}: "
        f"{advise_on_magnification(problem)}"
    )


def report_cost_of_grid(problem: PlanarProblem, error: float, ending: str) -> str:
    """Return a sentence on an objective that depends on the grid by more than `cost_tolerance`.

    Parameters
    ----------
    problem : PlanarProblem
    error : float
        Relative difference of the objective from that on half or twice the intervals; nan if it is not known.
    ending : str
        Why no finer grid was solved.
    """
    amount = (
        "is not compared with a finer grid" if math.isnan(error) else f"differs by {100 * error:.2g} % between grids"
    )
    return (
        f"the objective on {sum(problem.counts)} intervals {amount} "
        f"(cost_tolerance {100 * (problem.transcription.cost_tolerance or math.inf):g} %): {ending}."
    )


def find_worst_phase(transcription: PlanarTranscription, errors: Array) -> GridPhase:
    """Return the phase with the largest error between nodes, from the errors of all phases, shape (n_phases,)."""
    return transcription.phases[int(np.argmax(np.where(np.isnan(errors), np.inf, errors)))]


def find_least_forces(transcription: PlanarTranscription, phase: GridPhase, bounds: Bounds, x: Array) -> list[str]:
    """Return the contacts with the ground whose normal force is at its lower bound at a node or inner point of a phase.

    Values with equal bounds, such as the force at lift-off, do not count.

    Parameters
    ----------
    transcription : PlanarTranscription
    phase : GridPhase
    bounds : Bounds
    x : (n_variables,) array
        Decision vector.
    """
    robot, layout, closed = transcription.structure.robot, transcription.variables, phase.system.closed
    nodes, inner = layout[Unknown.ACCELERATION, phase.number], layout[Unknown.INNER_ACCELERATION, phase.number]
    scale, contacts = np.abs(x[nodes[robot.n_q : robot.n_q + len(closed)]]).max(initial=0.0), list[str]()
    for k, i in enumerate(closed, start=robot.n_q):
        if robot.contacts[i].kind == "stop":
            continue
        places = np.concatenate([nodes[k], inner[k :: nodes.shape[0]].ravel()])
        lower = bounds.x_lower[places]
        free = lower < bounds.x_upper[places]
        if np.any(x[places][free] - lower[free] <= ACTIVE * scale):
            contacts.append(robot.contact_names[i])
    return contacts


def report_early_touchdowns(
    transcription: PlanarTranscription, rows: Mapping[int, float], x: Array, g: Array
) -> tuple[str, ...]:
    """Return a sentence for each contact that touches the ground before its planned touchdown.

    Parameters
    ----------
    transcription : PlanarTranscription
    rows : mapping of int to float
        As :func:`~gaitopt.ocp.multicontact.early_touchdown.find_early_touchdowns` returns them, in order of time.
    x, g : (n_variables,), (n_constraints,) arrays
        Unknowns and rows of the plan.
    """
    sections: dict[tuple[str, Place], list[int]] = {}
    for row in rows:
        place, key = transcription.constraints.entries[row]
        sections.setdefault((key.of, place._replace(node=None, between=False)), []).append(row)
    return tuple(
        f"contact {contact!r} touches the ground in {place.label}, at {_time_of(transcription, members[0], x):.4g} s, "
        f"before its planned touchdown, with a least gap of {float(g[members].min()):.2g} m; a replay ends the step "
        "there. Use a larger threshold in `armed` of the contact, or change PlanarLimits.clearance, step length or "
        "speed."
        for (contact, place), members in sections.items()
    )


def report_penetrations(penetrations: Sequence[Penetration]) -> tuple[str, ...]:
    """Return a sentence for each touchdown from below; the table of a gait states the depths of other swings.

    Parameters
    ----------
    penetrations : sequence of Penetration
    """
    return tuple(
        f"{penetration.describe_touchdown()}." for penetration in penetrations if penetration.is_touchdown_from_below
    )


def _time_of(transcription: PlanarTranscription, row: int, x: Array) -> float:
    """Return the time of a row of an interval, from the start of the period [s]."""
    place, key = transcription.constraints.entries[row]
    durations, number = x[transcription.variables[Unknown.DURATION][0]], place.phase or 0
    part = (place.node or 0) + float(transcription.structure.scheme.fractions[key.inner])
    return float(durations[:number].sum() + durations[number] * part / transcription.phases[number].count)


def report_unmet_arming(problem: PlanarProblem, conflicts: Sequence[Conflict]) -> tuple[str, ...]:
    """Return a remark if the arming condition of a contact that lands conflicts with the other limits.

    Its sign is suspected only if it seems reversed: a motion that violates a correct expression lands the foot beside
    or behind the other foot.  Whether its threshold is too high is determined by a trial with a lower one.
    """
    if not any(conflict.setting == "Margins.touchdown_armed" for conflict in conflicts):
        return ()
    rule = (
        "A contact may close only where the expression `armed` of its definition is positive, for a foot where its leg "
        "is ahead of the other one"
    )
    robot = problem.robot
    names = [contact.name for contact in robot.contacts if contact.conditional]
    if any(is_armed_behind(robot, name, problem.values) for name in names):
        return (f"{rule}: check the sign of the expression.",)
    return (
        f"{rule}. The sign of the expression seems correct; if a threshold is subtracted in it, as in "
        "`armed=ahead - 0.1`, use a smaller one.",
    )


def report_suspects(problem: PlanarProblem, conflicts: Sequence[Conflict]) -> tuple[str, ...]:
    """Return a remark on the contact sequence and the slope if no change of a single limit is known to suffice."""
    sufficient = (each for each in conflicts if each.separable and math.isfinite(each.sufficient))
    if any(each.verified is not False for each in sufficient):
        return ()
    slope = f" The slope of {state_value(problem.slope, 'rad')} is uphill; a positive slope is downhill."
    uphill = slope if problem.slope < 0 else ""
    return (
        f"No change of a single limit is known to suffice: the contact sequence '{problem.sequence}' itself may be "
        "impossible for this robot. Check the order in which the contacts close, such as heel before toe, and try "
        f"other sequences, for example with gaitopt search.{uphill}",
    )


def report_shortest_phases(transcription: PlanarTranscription, problem: PlanarProblem, x: Array) -> tuple[str, ...]:
    """Return a sentence for each phase of minimum duration."""
    shortest = problem.limits.shortest_phase
    durations = x[transcription.variables[Unknown.DURATION][0]]
    return tuple(
        f"{phase.place().label} lasts {shortest:g} s, the minimum (PlanarLimits.shortest_phase): a sequence without "
        "this phase may have a lower cost, and so may another guess."
        for phase, duration in zip(transcription.phases, durations, strict=True)
        if duration < 1.01 * shortest
    )


def report_overhead_angles(transcription: PlanarTranscription, problem: PlanarProblem, x: Array) -> tuple[str, ...]:
    """Return a sentence for each angle without a range that deviates by half a revolution or more from zero."""
    robot, ranges = problem.robot, problem.limits.coordinate
    values = x[transcription.variables[Unknown.COORDINATES]]
    largest = {name: float(row[np.argmax(np.abs(row))]) for name, row in zip(robot.coordinates, values, strict=True)}
    turned = [name for name, unit in zip(robot.coordinates, robot.units, strict=True) if unit == "rad"]
    return tuple(
        f"angle {name} reaches {np.rad2deg(largest[name]):.0f} deg: if this is not intended, state its range, such as "
        f"PlanarLimits(coordinate={{{name!r}: (-1.5, 1.5)}}) [rad]."
        for name in turned
        if abs(largest[name]) >= np.pi and name not in ranges
    )
