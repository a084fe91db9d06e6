"""Control laws: a symbolic torque with a table of numbers, one column per piece of the step.

A law is a CasADi Function (clock, q, v, data) -> torque and, for each stretch of the clock between breakpoints, the
column of data it uses there.  Simulators, variational equations and exported code all run this one Function.  It may
have two more inputs: values *held* over a step, which another Function computes from the state after the touchdown,
and the sign of the foot's *slide*.  The pieces may also be stretches of an angle instead of the clock.
"""

import functools
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace

import casadi as ca
import numpy as np

from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Motion
from gaitopt.parameters import Parameter

ROUNDING = 1e-13
"""A sample this near to a straight line, relative to the largest torque, is on it."""


@dataclass(frozen=True, eq=False)
class Law:
    """A control law.

    Attributes
    ----------
    name : str
    torque : (clock, q (n_q), v (n_q), data (n_d)[, held (n_h), slide]) -> (n_u) Function [N m]
        The clock is the time since the last touchdown [s], `slide` is 1, -1 or 0 by the contact mode.  Laws that
        compute alike hold the same Function, whatever their numbers, so that what is derived or compiled from it is
        made once.
    breakpoints : (K,) array [s, or rad]
        Where each piece begins, of the clock or of what `index` names; the last piece never ends.
    table : (n_d, K) array
        Data of each piece.
    gains : mapping of str to int
        Rows of the table that hold a gain, the same in every piece.
    hold : (q, v, data (n_d)) -> (n_h) Function or None
        Values held over a step, from the state after the touchdown and the first column of the table.
    demand : Function or None
        What `torque` would be without its limits, which are the last rows of the table.
    index : int or None
        Entry of the state (q, v, held) that tells the piece; None for the clock.  The first two rows of the table are
        then the bounds of each piece, and what is left to both is a second output of `torque` and of `demand`, so that
        engines stop there.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> law = passive(compass_biped())
    >>> law.piece(0.3), law.torque(0.3, [0] * 4, [0] * 4, []).shape
    (0, (2, 1))
    """

    name: str
    torque: ca.Function = field(repr=False)
    breakpoints: Array = field(repr=False)
    table: Array = field(repr=False)
    gains: Mapping[str, int] = field(default_factory=dict, repr=False)
    hold: ca.Function | None = field(default=None, repr=False)
    demand: ca.Function | None = field(default=None, repr=False)
    index: int | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "torque", _shared(self.torque.serialize()))
        for name in ("hold", "demand"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _shared(getattr(self, name).serialize()))

    def measure(self, clock: float, y: Array) -> float:
        """Return what tells the piece in a state y = (q, v, held): the clock, or an entry of the state."""
        return clock if self.index is None else float(y[self.index])

    def piece(self, measure: float) -> int:
        """Return the number of the piece that a clock time, or a value of what `index` names, lies in."""
        return max(int(np.searchsorted(self.breakpoints, measure, side="right")) - 1, 0)

    def split(self, points: Array) -> "Law":
        """Return the same law with pieces that begin at further points, too."""
        begins = np.union1d(self.breakpoints, points)
        table = self.table[:, [self.piece(begin) for begin in begins]]
        if self.index is not None:
            table[0], table[1, :-1] = begins, begins[1:]
        return replace(self, breakpoints=begins, table=table)

    @property
    def gain_values(self) -> dict[str, float]:
        """Gains by name."""
        return {name: float(self.table[row, 0]) for name, row in self.gains.items()}

    def with_gains(self, values: Mapping[str, float]) -> "Law":
        """Return the law with other gains; those not named stay.

        Raises
        ------
        InputError
            If the law has no such gain.

        Examples
        --------
        >>> from gaitopt import compass_biped, joint_pd, load
        >>> law = joint_pd(compass_biped(), load("docs/examples/compass_slip.h5").motion, torque_limit=6)
        >>> law.with_gains({"hip_stiffness": 4.0}).gain_values["hip_stiffness"]
        4.0
        """
        table = self.table.copy()
        for name, value in values.items():
            if name not in self.gains:
                raise InputError(f"The law {self.name!r} has no gain {name!r}. {suggest(name, self.gains)}")
            table[self.gains[name]] = Parameter(name, 0.0, "1", "").check(value)
        return replace(self, table=table)


def passive(robot: Robot) -> Law:
    """Return the law without torque.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> passive(compass_biped()).name
    'passive'
    """
    data = ca.SX.sym("data", 0)
    function = torque_function(robot, data, lambda clock, q, v: ca.SX.zeros(robot.n_u))
    return Law("passive", function, np.zeros(1), np.zeros((0, 1)))


def feedforward(robot: Robot, motion: Motion) -> Law:
    """Return the law that plays back the torques of a motion's first step, with a clock reset at touchdown.

    Torques are linear between the samples of the motion; after its last sample the last torque is held.

    Parameters
    ----------
    robot : Robot
    motion : Motion
        Its torque samples must lie on straight lines between samples, as those of an optimised gait do.

    Raises
    ------
    InputError
        If the motion has other actuators or angles than the robot.

    Examples
    --------
    >>> from gaitopt import compass_biped, load
    >>> feedforward(compass_biped(), load("docs/examples/compass_slip.h5").motion).name
    'feedforward'
    """
    check_names(robot, motion)
    first = [segment for segment in motion.segments if segment.step == motion.segments[0].step]
    time = np.concatenate([segment.time for segment in first]) - first[0].time[0]
    torque = np.concatenate([segment.torque for segment in first], axis=1)
    corner = _corners(time, torque)
    time, torque = time[corner], torque[:, corner]
    begins = np.diff(time) > 0  # a piece begins at the last of equal times, so the torque may jump between segments
    slope = np.hstack([np.diff(torque, axis=1)[:, begins] / np.diff(time)[begins], np.zeros((robot.n_u, 1))])
    keep = np.append(begins, True)
    time, torque = time[keep], torque[:, keep]
    data = ca.SX.sym("data", 1 + 2 * robot.n_u)
    value, rate = data[1 : 1 + robot.n_u], data[1 + robot.n_u :]
    function = torque_function(robot, data, lambda clock, q, v: value + rate * (clock - data[0]))
    return Law("feedforward", function, time, np.vstack([time, torque, slope]))


def check_names(robot: Robot, motion: Motion) -> None:
    """Raise InputError unless a motion has the actuators and the angles of a robot, in their order."""
    if (motion.actuators, motion.angles) != (robot.actuators, robot.angles):
        raise InputError(
            f"The motion has actuators {motion.actuators} and angles {motion.angles}, "
            f"but the robot has {robot.actuators} and {robot.angles}."
        )


def _corners(time: Array, torque: Array) -> Array:
    """Return which samples do not lie on the straight line between their neighbours, shape (K,) of bool."""
    before, after = np.diff(time)[:-1], np.diff(time)[1:]
    share = before / np.maximum(before + after, np.finfo(float).tiny)
    off = np.abs(torque[:, :-2] + share * (torque[:, 2:] - torque[:, :-2]) - torque[:, 1:-1])
    straight = np.all(off <= ROUNDING * np.max(np.abs(torque), initial=0.0), axis=0) & (before > 0) & (after > 0)
    return np.concatenate([[True], ~straight, [True]])


def demand_torque(torque: ca.Function, clock: ca.SX, y: ca.SX, data: ca.SX, slide: int) -> tuple[ca.SX, ca.SX]:
    """Return the torque of a law's Function in a state y = (q, v, held), and the switches some have besides."""
    n = torque.size1_in(1)
    extra = [y[2 * n :], slide] if torque.n_in() > 4 else []
    outputs = torque.call([clock, y[:n], y[n : 2 * n], data, *extra])
    return outputs[0], outputs[1] if len(outputs) > 1 else ca.SX(0, 1)


def demand_slope(law: Law, n_q: int, slide: int) -> ca.Function:
    """Return (clock, y, data) -> (n_u, n_y) Function: how the torque of a law, without its limits, changes with y."""
    clock, y = ca.SX.sym("clock"), ca.SX.sym("y", 2 * n_q + latched_size(law.torque))
    data = ca.SX.sym("data", law.table.shape[0])
    torque, _ = demand_torque(law.torque if law.demand is None else law.demand, clock, y, data, slide)
    return ca.Function("slope", [clock, y, data], [ca.jacobian(torque, y)])


def latched_size(torque: ca.Function) -> int:
    """Return how many values a law's Function wants held over a step."""
    return int(torque.size1_in(4)) if torque.n_in() > 4 else 0


@functools.lru_cache(maxsize=128)
def _shared(serialized: str) -> ca.Function:
    """Return one Function for all that compute alike."""
    return ca.Function.deserialize(serialized)


def torque_function(robot: Robot, data: ca.SX, torque: Callable[[ca.SX, ca.SX, ca.SX], ca.SX]) -> ca.Function:
    """Return the Function of a law from its expression in terms of clock, q and v."""
    clock, q, v = ca.SX.sym("clock"), ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q)
    return ca.Function("torque", [clock, q, v, data], [torque(clock, q, v)], ["clock", "q", "v", "data"], ["torque"])
