"""Differences between the replay of a gait with several contacts and its plan, as texts."""

from scipy.interpolate import CubicHermiteSpline

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.planar_motion import PlanarEvent, PlanarMotion
from gaitopt.motion.stated_changes import CLOSES, find_closing, spell_release


def describe_differences(robot: PlanarRobot, planned: PlanarMotion, walked: PlanarMotion) -> list[str]:
    """Return a text on the contact sequence of a replay, and one on its first event, if they differ from the plan.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> from gaitopt.simulation import simulate_planar
    >>> fall = simulate_planar(monopod(), [0, 0.7, 0, 0, 0.6], [0, 0, 0, 0, 0], {}, until="foot closes").motion
    >>> describe_differences(monopod(), fall, fall)
    []
    """
    texts = []
    if walked.segments and walked.sequence != planned.sequence:
        real, expected = _write_sequence(walked), _write_sequence(planned)
        texts.append(f"the replay has the contact sequence '{real}' instead of '{expected}'")
    difference = describe_first_difference(robot, planned, walked)
    return texts if difference is None else [*texts, difference]


def describe_first_difference(robot: PlanarRobot, planned: PlanarMotion, walked: PlanarMotion) -> str | None:
    """Return a text on the first event of a replay that differs from the plan, with the gap of an early contact.

    Parameters
    ----------
    robot : PlanarRobot
    planned, walked : PlanarMotion
        The plan, and its replay.

    Returns
    -------
    str or None
        None if all events of the replay are those of the plan, in the same order.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> from gaitopt.simulation import simulate_planar
    >>> fall = simulate_planar(monopod(), [0, 0.7, 0, 0, 0.6], [0, 0, 0, 0, 0], {}, until="foot closes").motion
    >>> describe_first_difference(monopod(), fall, fall) is None
    True
    """
    for number, event in enumerate(walked.events):
        if number >= len(planned.events):
            return None
        expected = planned.events[number]
        real, planned_names = (
            {spell_release(name, dict(each.before.modes)) for name in each.names} for each in (event, expected)
        )
        if real == planned_names:
            continue
        closing = [name for name in robot.contact_names if name in find_closing(real - planned_names)]
        gaps = [_describe_gap(robot, planned, name, event.time) for name in closing]
        gaps += ["use a larger Margins.cone"] if _has_slip_onset(event, real - planned_names) else []
        return (
            f"the first event that differs is '{' & '.join(event.names)}' at {event.time:.4g} s of the replay, instead "
            f"of '{' & '.join(expected.names)}' at {expected.time:.4g} s of the plan"
            + "".join(f"; {text}" for text in gaps if text)
        )
    return None


def describe_soft_touchdowns(planned: PlanarMotion) -> list[str]:
    """Return a text on each touchdown without impulse of a plan: why its replay fails, and the remedy.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> from gaitopt.simulation import simulate_planar
    >>> fall = simulate_planar(monopod(), [0, 0.7, 0, 0, 0.6], [0, 0, 0, 0, 0], {}, until="foot closes").motion
    >>> describe_soft_touchdowns(fall)
    []
    """
    return [
        f"the touchdown '{name} {CLOSES}' at {event.time:.4g} s of the plan is soft ('>'): its gap decreases with the "
        "third power of time, so rounding errors change its time by milliseconds and the replay fails on any grid; use "
        "an impact ('|') with an approach speed, such as Margins(touchdown_rate=0.1)"
        for event in planned.events
        if not event.is_impact
        for name in find_closing(event.names)
    ]


def _has_slip_onset(event: PlanarEvent, changes: set[str]) -> bool:
    """Return whether a sticking contact begins to slip without impact in some changes of an event."""
    slips = (Mode.SLIP_FORWARD.value, Mode.SLIP_BACKWARD.value)
    sticking = [name for name, mode in event.before.modes if mode is Mode.STICK and not event.is_impact]
    return any(f"{name} {slip}" in changes for name in sticking for slip in slips)


def _write_sequence(motion: PlanarMotion) -> str:
    """Return the contact sequence of a motion with its last event."""
    ends_softly = 0 < len(motion.segments) == len(motion.events) and not motion.events[-1].is_impact
    return f"{motion.sequence} >" if ends_softly else motion.sequence


def _describe_gap(robot: PlanarRobot, planned: PlanarMotion, name: str, time: float) -> str:
    """Return a text on the gap of a contact at a time of the plan and on its arming; empty if it is closed."""
    segment = next((each for each in planned.segments if each.time[0] <= time <= each.time[-1]), planned.segments[-1])
    if segment.state.mode(name) is not Mode.FREE:
        return ""
    curve, number = CubicHermiteSpline(segment.time, segment.q, segment.v, axis=1), robot.contact_names.index(name)
    q, v, p = curve(time), curve(time, 1), robot.vector(planned.parameters)
    gap, entry = float(robot.gaps(q, p)[0][number]), robot.contacts[number]
    if entry.is_stop:
        return f"{name} is then {abs(gap):.2g} {entry.unit} {'before' if gap >= 0 else 'beyond'} its limit in the plan"
    side = "above" if gap >= 0 else "below"
    place = f"{name} is then {1000 * abs(gap):.2g} mm {side} the ground in the plan"
    if not entry.conditional:
        return place
    if float(robot.arming(q, v, p)[number]) <= 0:
        return f"{place}, and not armed"
    return f"{place}, and armed: use a larger PlanarLimits.clearance, or a larger threshold in `armed` of the contact"
