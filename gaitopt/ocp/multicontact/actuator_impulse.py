"""ActuatorImpulse: an impulse of an actuator at an impact of a planar robot, such as a push-off, as an unknown."""

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

from gaitopt.arguments import check_record
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.actuator_impulses import MOMENTS, Moment
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.parameters import as_float


@check_record
@dataclass(frozen=True)
class ActuatorImpulse:
    """An impulse of an actuator at an impact, an unknown of the optimal-control problem.

    An actuator with the generalised direction E_j and the impulse P changes the velocity by M (v' - v) = E_j P + W^T L.
    Just before the impact, the contacts W are those that are closed until then; just after it, those that stay closed.
    These contacts satisfy the laws of an impact: L_n >= 0, friction cone, no penetration.

    Attributes
    ----------
    actuator : str
    event : str
        An event with an impact, such as ``"foot B closes"``; the impulse acts at every impact with this event.
    limits : (float, float)
        Bounds of the impulse [N s or N m s].
    moment : {"before", "after"}
        ``"before"`` for the push-off of the trailing leg, ``"after"`` for an impulse of the leading leg.

    Raises
    ------
    InputError
        If the bounds are not two increasing numbers, or the moment is unknown.

    Examples
    --------
    >>> ActuatorImpulse("leg A", "foot B closes", limits=(0, 0.5)).describe()
    {'actuator': 'leg A', 'event': 'foot B closes', 'limits': [0.0, 0.5], 'moment': 'before'}
    """

    actuator: str
    event: str
    limits: tuple[float, float] = (0.0, math.inf)
    moment: Moment = "before"

    def __post_init__(self) -> None:
        ends = tuple(self.limits) if isinstance(self.limits, Sequence) else ()
        low, high = (as_float(end) for end in ends) if len(ends) == 2 else (None, None)
        if low is None or high is None or not low < high:
            raise InputError(
                f"ActuatorImpulse: the limits of {self.actuator!r} must be two increasing numbers [N s or N m s], "
                f"got {self.limits!r}."
            )
        if self.moment not in MOMENTS:
            raise InputError(
                f"ActuatorImpulse: moment must be one of {', '.join(map(repr, MOMENTS))}, got {self.moment!r}."
            )
        object.__setattr__(self, "limits", (low, high))

    def describe(self) -> dict[str, Any]:
        """Return the impulse as plain data."""
        return {
            "actuator": self.actuator,
            "event": self.event,
            "limits": list(self.limits),
            "moment": self.moment,
        }


class ImpulseEntry(NamedTuple):
    """An impulse among the unknowns of an NLP.

    Attributes
    ----------
    phase : int
        Number of the phase that the impact ends.
    moment : {"before", "after"}
    actuator : int
    sign : int
        1 if the impulse is not negative, -1 if it is not positive, 0 if it may have both signs.
    """

    phase: int
    moment: Moment
    actuator: int
    sign: int


def list_impulse_entries(
    impulses: Sequence[ActuatorImpulse], robot: PlanarRobot, sequence: PhaseSequence
) -> dict[ImpulseEntry, tuple[float, float]]:
    """Return the impulses of each impact of a sequence, and their bounds.

    Examples
    --------
    >>> from gaitopt.model import telescoping_biped
    >>> robot = telescoping_biped()
    >>> push = ActuatorImpulse("leg A", "foot B closes")
    >>> list_impulse_entries([push], robot, PhaseSequence.parse("foot A stick |", robot))
    {ImpulseEntry(phase=0, moment='before', actuator=0, sign=1): (0.0, inf)}
    """
    entries = {}
    for impulse in impulses:
        low, high = impulse.limits
        sign = 1 if low >= 0 else -1 if high <= 0 else 0
        for number, event in enumerate(sequence.events):
            if event.impact and impulse.event in sequence.describe_event(robot, number):
                place = robot.actuators.index(impulse.actuator)
                entries[ImpulseEntry(number, impulse.moment, place, sign)] = impulse.limits
    return entries


def check_impulses(impulses: Sequence[ActuatorImpulse], robot: PlanarRobot, sequence: PhaseSequence) -> None:
    """Raise InputError unless the impulses name actuators of the robot and impacts of the sequence, each once."""
    events = [
        name
        for number, event in enumerate(sequence.events)
        if event.impact
        for name in sequence.describe_event(robot, number)
    ]
    seen = set[tuple[int, str, str]]()
    for impulse in impulses:
        if impulse.actuator not in robot.actuators:
            raise InputError(
                f"ActuatorImpulse: robot {robot.name!r} has no actuator {impulse.actuator!r}. "
                f"{suggest(impulse.actuator, robot.actuators)}"
            )
        if sequence.phases and impulse.event not in events:
            raise InputError(
                f"ActuatorImpulse: the sequence '{sequence}' has no impact with the event {impulse.event!r}; impulses "
                f"act at {', '.join(map(repr, events)) or 'impacts, which it does not contain'}."
            )
        places = {
            (number, impulse.actuator, impulse.moment)
            for number in range(len(sequence.phases))
            if impulse.event in sequence.describe_event(robot, number)
        }
        if places & seen:
            raise InputError(
                f"ActuatorImpulse: {impulse.actuator!r} has two impulses {impulse.moment} the impact "
                f"{impulse.event!r}; give one."
            )
        seen |= places
