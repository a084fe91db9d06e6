"""Push-off: a torque of fixed size and duration, triggered by an event of the step."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law, passive
from gaitopt.control.signature import LawInputs, Memory, control_function, inputs_of, make_memory
from gaitopt.control.torque_saturation import limit_torque, remove_limits, torque_limits
from gaitopt.errors import InputError, suggest
from gaitopt.model.coordinate_entries import angle_entry
from gaitopt.model.robot import Robot
from gaitopt.parameters import Parameter

Trigger = Literal["retraction", "touchdown"]
TRIGGERS = ("retraction", "touchdown")
STATES = ("waiting", "ready", "pushing", "done")
"""Discrete states of the push-off; the latched value is 1 for the current state and 0 for the others."""
VALUES = (*STATES, "release time")
EVENTS = ("swing leg goes forward", "push-off begins", "push-off ends")
GAINS = ("push_off_torque", "push_off_duration")


@check_arguments
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
    """Return a law with a push-off added: a constant torque of one actuator for a fixed time in each step.

    The push-off has four discrete states.  It is *waiting* after the touchdown, *ready* once the swing leg moves
    forward, and *pushing* from the instant of retraction, at which the rate of the swing leg changes its sign, until
    the duration has passed or the foot touches down; then it is *done* until the next touchdown.  With the trigger
    ``"touchdown"`` it pushes from the start of the step.

    Parameters
    ----------
    robot : Robot
    law : Law, optional
        Law to which the torque is added, passive by default.  Its limits apply to the sum.
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
        If there is no such actuator, angle or trigger, the duration is not positive, or the law already has a push-off.

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
    base, limits = remove_limits(law or passive(robot))
    if set(GAINS) & set(base.gains):
        raise InputError(f"The law {base.name!r} already has a push-off; use a law without one.")
    values = [
        Parameter(GAINS[0], 0.0, "N m", "").check(torque),
        Parameter(GAINS[1], 0.1, "s", "", lower=0.0, lower_open=True).check(duration),
    ]
    added = _add_push_off(robot, base, robot.actuators.index(actuator), robot.angles.index(angle), trigger)
    rows = base.table.shape[0]
    complete = replace(
        added,
        table=np.vstack([base.table, np.tile(np.array(values)[:, None], base.breakpoints.size)]),
        gains={**base.gains, GAINS[0]: rows, GAINS[1]: rows + 1},
    )
    return limit_torque(complete, limits if limits.size else torque_limits(robot, torque_limit))


def _first(actuators: tuple[str, ...]) -> str:
    if not actuators:
        raise InputError("A push-off requires an actuator, but the robot has no actuators.")
    return actuators[0]


def _check(robot: Robot, actuator: str, angle: str, trigger: str) -> None:
    for kind, name, known in (
        ("actuator", actuator, robot.actuators),
        ("angle", angle, robot.angles),
        ("trigger of a push-off", trigger, TRIGGERS),
    ):
        if name not in known:
            raise InputError(f"There is no {kind} {name!r}. {suggest(name, known)}")


def _add_push_off(robot: Robot, base: Law, actuator: int, angle: int, trigger: str) -> Law:
    """Return a law with the torque, guards and memory of a push-off; its table lacks the two gains."""
    inputs = inputs_of(base.control, data=len(GAINS), latched=len(VALUES))
    inner_inputs = inputs._replace(
        latched=inputs.latched[: -len(VALUES)],
        data=inputs.data[: -len(GAINS)],
    )
    push_off_torque, duration = ca.vertsplit(inputs.data[-len(GAINS) :])
    waiting, ready, pushing, _, release = ca.vertsplit(inputs.latched[-len(VALUES) :])
    rate = inputs.v[angle_entry(angle)]
    conditions = ((waiting, -rate), (ready, rate), (pushing, release + duration - inputs.clock))
    guards = [state * value + (1 - state) for state, value in conditions]
    unit = ca.DM.zeros(robot.n_u)
    unit[actuator] = 1
    torque, bounds, others = base.control(*inner_inputs)
    control = control_function(
        inputs, torque + unit * (pushing * push_off_torque), bounds=bounds, guards=ca.vertcat(others, *guards)
    )
    blank = np.zeros((inputs.data.numel(), base.breakpoints.size))
    memory = _memory(base, inputs, inner_inputs, trigger)
    return replace(base, name=f"{base.name} with push-off", control=control, table=blank, memory=memory)


def _memory(base: Law, inputs: LawInputs, inner_inputs: LawInputs, trigger: str) -> Memory:
    """Return the memory of a law with a push-off: that of the law, then the states and the release time."""
    known, push_off_values = base.memory, inputs.latched[-len(VALUES) :]
    release, states = push_off_values[-1], ca.SX.eye(len(STATES))
    start = STATES.index("pushing" if trigger == "touchdown" else "waiting")
    after_events = [ca.vertcat(states[:, k], time) for k, time in ((1, release), (2, inputs.clock), (3, release))]
    others = len(known.events)
    return make_memory(
        inputs,
        ca.vertcat(known.latch(inputs.q, inputs.v, inner_inputs.data), states[:, start], 0),
        values=[*known.values, *VALUES],
        events=[*known.events, *EVENTS],
        reset=ca.horzcat(
            ca.vertcat(known.reset(*inner_inputs[:4], inner_inputs.data), ca.repmat(push_off_values, 1, others)),
            ca.vertcat(ca.repmat(inner_inputs.latched, 1, len(EVENTS)), ca.horzcat(*after_events)),
        ),
    )
