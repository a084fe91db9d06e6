"""Push-off: a torque of given size and duration, released by an event of the step."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import casadi as ca
import numpy as np

from gaitopt.control.law import Law, passive
from gaitopt.control.limits import limit_torque, torque_limits, unlimited
from gaitopt.control.signature import LawInputs, Memory, control_function, inputs_of, make_memory
from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.parameters import Parameter

Trigger = Literal["retraction", "touchdown"]
TRIGGERS = ("retraction", "touchdown")
STATES = ("waiting", "ready", "pushing", "done")
"""Discrete states of the push-off, latched as 1 in the present one and 0 in the others."""
VALUES = (*STATES, "release time")
EVENTS = ("swing leg goes forward", "push-off begins", "push-off ends")
GAINS = ("push_off_torque", "push_off_duration")


def push_off(
    robot: Robot,
    law: Law | None = None,
    *,
    torque: float,
    duration: float,
    actuator: str | None = None,
    trigger: Trigger = "retraction",
    angle: str | None = None,
    torque_limit: float | Mapping[str, float] = np.inf,
) -> Law:
    """Return a law with a push-off added: a constant torque of one actuator for some time in each step.

    The push-off has four discrete states.  After the touchdown it waits until the swing leg goes forward; from then on
    it is ready; it pushes from the instant at which the swing leg's rate changes its sign, the retraction, until the
    duration has passed or the foot touches down.  Released by the touchdown, it pushes from the start of the step.

    Parameters
    ----------
    robot : Robot
    law : Law, optional
        Any law the torque is added to, passive by default.  Its limits apply to the sum.
    torque : float [N m]
    duration : float [s]
        The gains ``"push_off_torque"`` and ``"push_off_duration"`` of the law.
    actuator : str, optional
        By default the first actuator, the stance ankle of the compass biped.
    trigger : {"retraction", "touchdown"}
    angle : str, optional
        Absolute angle of the swing leg, positive ahead of the stance leg; by default the last angle.
    torque_limit : float or mapping of actuator to float [N m]
        Limits of the sum, for a law without limits.

    Raises
    ------
    InputError
        If there is no such actuator, angle or trigger, the duration is not positive, or the law has a push-off already.

    Examples
    --------
    >>> import numpy as np
    >>> from gaitopt import compass_biped, simulate
    >>> law = push_off(compass_biped(), torque=2.0, duration=0.1)
    >>> walk = simulate(compass_biped(), [0, 0, -0.15, -0.15], [0, 0, 0.75, -0.5], {"slope": 0.017}, law=law)
    >>> [event.name for event in walk.events]
    ['swing leg goes forward', 'push-off begins', 'push-off ends', 'touchdown']
    """
    actuator, angle = actuator or _first(robot.actuators), angle or robot.angles[-1]
    _check(robot, actuator, angle, trigger)
    base, limits = unlimited(law or passive(robot))
    if set(GAINS) & set(base.gains):
        raise InputError(f"The law {base.name!r} has a push-off already.")
    values = [
        Parameter(GAINS[0], 0.0, "N m", "").check(torque),
        Parameter(GAINS[1], 0.1, "s", "", lower=0.0, lower_open=True).check(duration),
    ]
    added = _added(robot, base, robot.actuators.index(actuator), robot.angles.index(angle), trigger)
    rows = base.table.shape[0]
    whole = replace(
        added,
        table=np.vstack([base.table, np.tile(np.array(values)[:, None], base.breakpoints.size)]),
        gains={**base.gains, GAINS[0]: rows, GAINS[1]: rows + 1},
    )
    return limit_torque(whole, limits if limits.size else torque_limits(robot, torque_limit))


def _first(actuators: tuple[str, ...]) -> str:
    if not actuators:
        raise InputError("A push-off needs an actuator; the robot has none.")
    return actuators[0]


def _check(robot: Robot, actuator: str, angle: str, trigger: str) -> None:
    for kind, name, known in (
        ("actuator", actuator, robot.actuators),
        ("angle", angle, robot.angles),
        ("trigger of a push-off", trigger, TRIGGERS),
    ):
        if name not in known:
            raise InputError(f"There is no {kind} {name!r}. {suggest(name, known)}")


def _added(robot: Robot, base: Law, actuator: int, angle: int, trigger: str) -> Law:
    """Return a law with the torque, guards and memory of a push-off; its table still lacks the two gains."""
    inputs = inputs_of(base.control, data=len(GAINS), latched=len(VALUES))
    seen = inputs._replace(
        latched=inputs.latched[: -len(VALUES)],
        data=inputs.data[: -len(GAINS)],
    )
    size, duration = ca.vertsplit(inputs.data[-len(GAINS) :])
    waiting, ready, pushing, _, release = ca.vertsplit(inputs.latched[-len(VALUES) :])
    rate = inputs.v[2 + angle]
    conditions = ((waiting, -rate), (ready, rate), (pushing, release + duration - inputs.clock))
    guards = [state * value + (1 - state) for state, value in conditions]
    unit = ca.DM.zeros(robot.n_u)
    unit[actuator] = 1
    torque, bounds, others = base.control(*seen)
    control = control_function(
        inputs, torque + unit * (pushing * size), bounds=bounds, guards=ca.vertcat(others, *guards)
    )
    blank = np.zeros((inputs.data.numel(), base.breakpoints.size))
    changed = _memory(base, inputs, seen, trigger)
    return replace(base, name=f"{base.name} with push-off", control=control, table=blank, memory=changed)


def _memory(base: Law, inputs: LawInputs, seen: LawInputs, trigger: str) -> Memory:
    """Return the memory of a law with a push-off: that of the law itself, then the states and the release time."""
    known, own = base.memory, inputs.latched[-len(VALUES) :]
    release, states = own[-1], ca.SX.eye(len(STATES))
    start = STATES.index("pushing" if trigger == "touchdown" else "waiting")
    entered = [ca.vertcat(states[:, k], time) for k, time in ((1, release), (2, inputs.clock), (3, release))]
    others = len(known.events)
    return make_memory(
        inputs,
        ca.vertcat(known.latch(inputs.q, inputs.v, seen.data), states[:, start], 0),
        values=[*known.values, *VALUES],
        events=[*known.events, *EVENTS],
        reset=ca.horzcat(
            ca.vertcat(known.reset(*seen[:4], seen.data), ca.repmat(own, 1, others)),
            ca.vertcat(ca.repmat(seen.latched, 1, len(EVENTS)), ca.horzcat(*entered)),
        ),
    )
