"""Trials of the remedies for a failed solve of a robot with several contacts: solves that end in a verified gait.

A limit that suffices at the nodes of a coarse grid need not lead to a gait, and the cause of a failure may be the
contact sequence, the sign of the slope or a threshold in `armed` of a contact, which are no limits.
"""

import functools
import math
from collections.abc import Callable, Iterator
from dataclasses import replace

from attrs import evolve

from gaitopt.errors import InputError
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.ground_penetration import find_penetrations
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.quantity_labels import state_value
from gaitopt.ocp.multicontact.arming_threshold import find_least_arming, find_missing_arming, lower_arming_thresholds
from gaitopt.ocp.multicontact.planar_impossibility import explain_planar_impossibility
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.multicontact.planar_relaxable import PlanarUnits, replace_limit
from gaitopt.ocp.multicontact.planar_remarks import report_implausible_robot, report_suspects, report_unmet_arming
from gaitopt.ocp.multicontact.planar_solver import solve_from_guess
from gaitopt.ocp.multicontact.possible_causes import find_sequence_of_impacts, report_soft_touchdowns
from gaitopt.ocp.nlp.ipopt import Ipopt
from gaitopt.progress import Observer, silent
from gaitopt.simulation.planar_verification import verify_planar
from gaitopt.status import Status

Trial = Callable[[PlanarProblem], bool]
"""Solve and replay of a problem: whether it has a verified gait."""

Keep = Callable[[PlanarProblem, PlanarGait], None]
"""Receives each verified gait with its problem, which differs from the stated one."""

CHANGES = (1.0, 1.3)
"""Changes of a limit that are tried, relative to the one that suffices at the nodes of a coarse grid."""

MARGIN_OF_ARMING = 0.01
"""Value of `armed` by which contacts are armed at their touchdowns in a trial, in the unit of its expression."""

HIGHER_THRESHOLDS = (0.25, 0.5)
"""Increases of the thresholds in `armed` that are tried, relative to the least value of `armed` at a touchdown."""

FASTER = 1.1
"""Ratio of a speed that is tried to the stated one."""

MOST_ITERATIONS = 300
"""Largest number of iterations of a solve in a trial: those that led to a verified gait took up to 208."""

LONGEST_SHARE, LEAST_TIME = 2.0, 10.0
"""Largest duration of a trial, relative to that of the failed solve, and the least value of this limit [s]: far from a
gait, restoration phases and refinements of a grid may take minutes."""

STEEPEST = 0.35
"""Largest slope that is tried if it may have been stated in rad instead of deg [rad]."""

STRONG = 5.0
"""Limit of stronger actuators that are tried, relative to the typical size of a torque or force."""

MOST_LIMITS = 3
"""Largest number of limits that are tried: each trial takes as long as a solve that does not fail."""


def discard_gait(problem: PlanarProblem, gait: PlanarGait) -> None:
    """Keep no gait."""


def try_remedies(
    problem: PlanarProblem, failure: PlanarGait, observer: Observer = silent, *, keep: Keep = discard_gait
) -> PlanarGait:
    """Return a failed solve with the limits, thresholds, sequence and slope that lead to a verified gait.

    Each of the first conflicting limits that suffice alone is relaxed, the thresholds in `armed` are lowered if they
    are too high for touchdowns that are possible without them, and the problem is solved and replayed.  If no such gait
    passes its replay, the same is done with stronger actuators, and otherwise with the contacts of each foot exchanged
    and, uphill, with the opposite slope.
    If the plan is inaccurate because a contact touches down too early, a higher threshold and other speeds are tried.
    If the sequence has touchdowns without impulse, it is tried with impacts first.

    Parameters
    ----------
    problem : PlanarProblem
        With an open sequence, nothing is tried: the conflicts are those of one of its sequences.  Nothing is tried
        either if sizes or directions of the robot are implausible, which are then the probable cause, or if the problem
        is known to have no solution.
    failure : PlanarGait
        Result of its solve.
    observer : Observer, optional
    keep : callable, optional
        Receives each verified gait with its problem.

    Raises
    ------
    KeyboardInterrupt
        If a solve is interrupted.

    Examples
    --------
    >>> try_remedies.__name__
    'try_remedies'
    """
    if problem.sequence.is_open or report_implausible_robot(problem, problem.values):
        return failure
    if explain_planar_impossibility(problem) is not None:
        return failure
    longest = max(LONGEST_SHARE * failure.solver.solve_seconds, LEAST_TIME)
    solver = Ipopt(max_iterations=MOST_ITERATIONS, time_limit=longest)
    impacts = find_sequence_of_impacts(problem)
    if impacts is not None and _is_solved(problem.replace(sequence=impacts), solver, observer, keep):
        found = f"A verified gait was found with impacts, sequence='{impacts}', and no other change."
        tried = _put_first((found,), failure, but=report_suspects(problem, ()))
    else:
        tried = _try_changes(problem, failure, solver, observer, keep)
    return _put_first(report_soft_touchdowns(problem), tried)


def _put_first(warnings: tuple[str, ...], gait: PlanarGait, *, but: tuple[str, ...] = ()) -> PlanarGait:
    """Return a failed solve whose first warnings are the given ones, without some others."""
    others = (each for each in gait.solver.warnings if each not in (*warnings, *but))
    return gait.replace_fields(solver=gait.solver.replace_fields(warnings=(*warnings, *others)))


def _try_changes(
    problem: PlanarProblem, failure: PlanarGait, solver: Ipopt, observer: Observer, keep: Keep
) -> PlanarGait:
    """Return a failed solve with the changes of limits, thresholds, sequence or slope that lead to a verified gait."""
    report = failure.solver
    is_solved = functools.partial(_is_solved, solver=solver, observer=observer, keep=keep)
    if failure.status is Status.PLAN_INACCURATE:
        return _put_first(tuple(_try_later_touchdown(problem, failure, is_solved)), failure)
    lower = tuple(_try_lower_threshold(problem, solver, observer, is_solved))
    numbers = [i for i, each in enumerate(report.conflicts) if each.separable and math.isfinite(each.sufficient)]
    tried = {i: _try_limit(problem, report.conflicts[i], is_solved) for i in numbers[:MOST_LIMITS]}
    conflicts = [tried.get(i, conflict) for i, conflict in enumerate(report.conflicts)]
    conflicts.sort(key=lambda conflict: not conflict.verified)
    warnings = list(report.warnings)
    if lower:  # remarks that no change suffices are then wrong
        wrong = {*report_unmet_arming(problem, report.conflicts), *report_suspects(problem, ())}
        warnings = [*lower, *(each for each in warnings if each not in wrong)]
    elif not any(conflict.verified for conflict in conflicts):
        suspects = report_suspects(problem, [each for each in conflicts if each.verified is not None])
        stronger = tuple(_try_stronger_actuators(problem, solver, observer, keep))
        if variants := stronger or tuple(_try_variants(problem, is_solved)):  # the sequence is then possible
            warnings = [*variants, *(each for each in warnings if each not in suspects)]
        else:
            warnings += [each for each in suspects if each not in warnings]
    return failure.replace_fields(solver=report.replace_fields(conflicts=tuple(conflicts), warnings=tuple(warnings)))


def _try_lower_threshold(problem: PlanarProblem, solver: Ipopt, observer: Observer, is_solved: Trial) -> Iterator[str]:
    """Yield a sentence if a gait is verified with lower thresholds in `armed` of the contacts.

    They are lowered such that the touchdowns of a motion without these conditions are armed.
    """
    missing = find_missing_arming(problem, evolve(solver, permute=True), observer)
    if not missing:
        return
    name = max(missing, key=missing.__getitem__)
    for change in CHANGES:
        shift = _round_up(change * missing[name] + MARGIN_OF_ARMING)
        if is_solved(problem.replace(robot=lower_arming_thresholds(problem.robot, shift))):
            yield (
                f"A verified gait was found with thresholds in `armed` of the contacts that are lower by {shift:.2g} "
                f"and no other change: to obtain it, write `armed=... + {shift:.2g}` with the present expression in "
                "place of ..., and solve again. In a motion that may violate these conditions, "
                f"{name!r} lands while its expression `armed` is {-missing[name]:.4g}."
            )
            return


def _try_later_touchdown(problem: PlanarProblem, failure: PlanarGait, is_solved: Trial) -> Iterator[str]:
    """Yield the first change with which a contact that touches down too early no longer does so in a verified gait."""
    if not find_penetrations(problem.robot, failure.motion):
        return
    least = find_least_arming(problem.robot, failure.motion)
    for shift in (_round_up(share * least) for share in HIGHER_THRESHOLDS if 0 < least < math.inf):
        if is_solved(problem.replace(robot=lower_arming_thresholds(problem.robot, -shift))):
            yield (
                f"A verified gait was found with thresholds in `armed` of the contacts that are higher by {shift:.2g} "
                f"and no other change: to obtain it, write `armed=... - {shift:.2g}` with the present expression in "
                "place of ..., and solve again."
            )
            return
    if not isinstance(problem.speed, float):
        return
    for speed in (FASTER * problem.speed, problem.speed / FASTER):
        try:
            is_found = is_solved(problem.replace(speed=speed))
        except InputError:
            continue
        if is_found:
            yield f"A verified gait was found with speed = {speed:.4g} m/s and no other change."
            return


def _round_up(value: float) -> float:
    """Return a value rounded up to two significant digits, so that the tested value is the stated one.

    Examples
    --------
    >>> _round_up(0.09029), _round_up(0.36)
    (0.091, 0.36)
    """
    digits = 1 - math.floor(math.log10(value))
    return round(math.ceil(round(value * 10**digits, 6)) / 10**digits, digits)


def _try_limit(problem: PlanarProblem, conflict: Conflict, is_solved: Trial) -> Conflict:
    """Return a conflict with the first of some values with which a gait is verified, or marked otherwise."""
    for change in CHANGES:
        value = conflict.limit + change * (conflict.sufficient - conflict.limit)
        try:
            relaxed = replace_limit(problem, conflict, value)
        except InputError:
            break
        if relaxed is None:
            return conflict
        if is_solved(relaxed):
            return replace(conflict, sufficient=value, verified=True)
    return replace(conflict, verified=False)


def _try_stronger_actuators(problem: PlanarProblem, solver: Ipopt, observer: Observer, keep: Keep) -> Iterator[str]:
    """Yield a sentence if a gait is verified with larger limits of the actuators, except of idle ones.

    The actuators may be too weak together, or a motion on a coarse grid far from a gait may hide that they are.
    """
    actuators, units = problem.robot.actuators, PlanarUnits.of(problem)
    limits = dict(zip(actuators, problem.limits.torques(actuators), strict=True))
    strong = {
        name: max(limit, STRONG * units.torque(unit)) if limit > 0 else limit
        for (name, limit), unit in zip(limits.items(), problem.robot.actuator_units, strict=True)
    }
    if strong == limits:
        return
    patient = evolve(solver, max_iterations=2 * MOST_ITERATIONS)  # the first guess of torques is far from the optimum
    gait = _solve_trial(problem.replace(limits=evolve(problem.limits, torque=strong)), patient, observer, keep)
    if gait is None:
        return
    peaks = dict(zip(actuators, abs(gait.motion.channel("torque")).max(axis=1), strict=True))
    exceeded = [
        f"{peaks[name]:.4g} {unit} at {name}"
        for name, unit in zip(actuators, problem.robot.actuator_units, strict=True)
        if peaks[name] > limits[name]
    ]
    yield (
        "A verified gait was found with larger limits in PlanarLimits.torque and no other change; its largest values "
        f"above the stated limits are {', '.join(exceeded)}."
    )


def _try_variants(problem: PlanarProblem, is_solved: Trial) -> Iterator[str]:
    """Yield a sentence for each other sequence or slope with which a gait is verified."""
    sequence = _exchange_contacts(problem)
    if sequence is not None and is_solved(problem.replace(sequence=sequence)):
        yield (
            f"A verified gait was found with the contacts of each foot exchanged, sequence='{sequence}': state this "
            "sequence if it is the intended one; otherwise check the positions of the contacts."
        )
    if problem.slope == 0 or "slope" in problem.free:
        return
    if problem.slope < 0:
        opposite = problem.replace(slope=-problem.slope)
        if is_solved(opposite):
            yield f"A verified gait was found on the opposite slope, downhill by {state_value(opposite.slope, 'rad')}."
    elif (larger := math.degrees(problem.slope)) < STEEPEST and is_solved(problem.replace(slope=larger)):
        yield (
            f"A verified gait was found on the slope of {state_value(larger, 'rad')}, whose value in rad is the "
            "present one in deg: check whether the script expects the slope in deg or in rad."
        )


def _exchange_contacts(problem: PlanarProblem) -> PhaseSequence | None:
    """Return the sequence with the two contacts of each foot exchanged; None if this is no other possible sequence."""
    feet: dict[str, list[str]] = {}
    for contact in problem.robot.contacts:
        if contact.body and not (contact.is_stop or contact.falls):
            feet.setdefault(contact.body, []).append(contact.name)
    partner = {a: b for pair in feet.values() if len(pair) == 2 for a, b in (pair, reversed(pair))}
    sequence = problem.sequence
    phases = tuple(tuple((partner.get(name, name), mode) for name, mode in modes) for modes in sequence.phases)
    is_same = [set(modes) for modes in phases] == [set(modes) for modes in sequence.phases]
    if is_same or any(event.outcome is not None for event in sequence.events):
        return None
    try:
        return PhaseSequence.parse(str(replace(sequence, phases=phases)), problem.robot)
    except InputError:
        return None


def _is_solved(problem: PlanarProblem, solver: Ipopt, observer: Observer, keep: Keep) -> bool:
    """Return whether a problem has a gait that passes its replay."""
    return _solve_trial(problem, solver, observer, keep) is not None


def _solve_trial(problem: PlanarProblem, solver: Ipopt, observer: Observer, keep: Keep) -> PlanarGait | None:
    """Return a gait that passes its replay and is kept, or None; a guess for another sequence is not accepted."""
    try:
        gait = solve_from_guess(problem, solver, observer)
    except InputError:
        return None
    if gait.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    if not (gait.status.ok and (verified := verify_planar(gait)).status.ok):
        return None
    keep(problem, verified)
    return verified
