"""Possible causes of a failed solve: contacts without arming condition, and touchdowns without impulse."""

from collections.abc import Sequence
from dataclasses import replace

from gaitopt.errors import SequenceError
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.contact_entry import ContactEntry
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.gait import IMPLAUSIBLE, WITHOUT_IMPULSE
from gaitopt.motion.phase_sequence import PhaseEvent, PhaseSequence
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.stated_changes import find_closing
from gaitopt.ocp.multicontact.planar_infeasibility import RETRY
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.status import Status


def remark_on_failure(problem: PlanarProblem, gait: PlanarGait) -> PlanarGait:
    """Return a gait with the possible causes in robot and sequence if no gait was found, whatever was concluded.

    Parameters
    ----------
    problem : PlanarProblem
        A problem with a closed contact sequence.
    gait : PlanarGait
    """
    if gait.status not in (*RETRY, Status.PLAN_INACCURATE) or gait.solver.message == IMPLAUSIBLE:
        return gait
    causes = report_unarmed_contacts(problem, gait.solver.conflicts)
    warnings = (*report_soft_touchdowns(problem), *gait.solver.warnings, *causes)
    return gait.replace_fields(solver=gait.solver.replace_fields(warnings=warnings))


def report_unarmed_contacts(problem: PlanarProblem, conflicts: Sequence[Conflict]) -> tuple[str, ...]:
    """Return a remedy if no gait keeps the clearance of contacts without arming condition; straight legs cannot.

    Without known conflicts the missing condition is a possible cause if another body is on the ground in the swing.
    """
    if conflicts and not any(conflict.setting == "PlanarLimits.clearance" for conflict in conflicts):
        return ()
    states, feet = problem.sequence.states(problem.robot), _list_feet(problem)
    names = [
        foot.name
        for foot in feet
        if not foot.conditional
        for swings in [[state for state in states if state.mode(foot.name) is Mode.FREE]]
        if any(conflicts or _is_on_another_body(feet, state, foot.body) for state in swings)
    ]
    if not names:
        return ()
    return (
        f"{'' if conflicts else 'possible cause: '}{', '.join(names)} must stay above the ground while free: a foot of "
        "a straight leg, which swings through the ground, needs a condition under which it may close, such as "
        "PointContact(..., armed=angle ahead of the other leg).",
    )


def _list_feet(problem: PlanarProblem) -> list[ContactEntry]:
    """Return the contacts with the ground of the robot of a problem, without those that end a walk."""
    return [contact for contact in problem.robot.contacts if contact.kind != "stop" and not contact.falls]


def _is_on_another_body(feet: Sequence[ContactEntry], state: ContactState, body: str) -> bool:
    """Return whether a contact of another body is on the ground."""
    return any(foot.body != body and state.mode(foot.name) is not Mode.FREE for foot in feet)


def report_soft_touchdowns(problem: PlanarProblem) -> tuple[str, ...]:
    """Return a remark if a contact with the ground closes at an event without impulse, with the sequence of impacts."""
    soft, names = _find_soft_touchdowns(problem), list[str]()
    for closing in soft.values():
        names += [name for name in closing if name not in names]
    if not names:
        return ()
    impacts = find_sequence_of_impacts(problem)
    spelling = "" if impacts is None else f": '{impacts}'"
    closes = "closes" if len(names) == 1 else "close"
    return (
        f"{' and '.join(names)} {closes} at '>', {WITHOUT_IMPULSE}: speed, acceleration and force vanish at such "
        f"a touchdown. For a touchdown with an impact, write '|'{spelling}.",
    )


def find_sequence_of_impacts(problem: PlanarProblem) -> PhaseSequence | None:
    """Return the sequence with an impact at each touchdown without impulse; None if there is none, or it is invalid."""
    soft, sequence = _find_soft_touchdowns(problem), problem.sequence
    events = tuple(PhaseEvent(True) if number in soft else event for number, event in enumerate(sequence.events))
    try:
        return replace(sequence, events=events).check(problem.robot) if soft else None
    except SequenceError:
        return None


def _find_soft_touchdowns(problem: PlanarProblem) -> dict[int, list[str]]:
    """Return the contacts with the ground that close at each event without impulse."""
    robot, sequence = problem.robot, problem.sequence
    feet = {foot.name for foot in _list_feet(problem)}
    closing = {
        number: sorted(feet.intersection(find_closing(sequence.describe_event(robot, number))))
        for number, event in enumerate(sequence.events)
        if not event.impact
    }
    return {number: names for number, names in closing.items() if names}
