"""Control laws: a symbolic torque with a table of numbers, one column per piece of the step.

A law consists of a Function with a fixed signature (:mod:`gaitopt.control.signature`) and a table with one column of
data for each piece of the clock between breakpoints.  Simulators, variational equations and exported code all evaluate
this Function.  The pieces may also be intervals of an entry of the state instead of the clock.
"""

import functools
import hashlib
from collections.abc import Mapping
from dataclasses import field, replace

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.gain_matrix import GainMatrix
from gaitopt.control.signature import INPUTS, OUTPUTS, Memory, no_memory, saturate_control, torque_function
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.locks import one_at_a_time
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Motion, check_motion
from gaitopt.motion.printable import format_count
from gaitopt.parameters import Parameter, check_type

COLLINEARITY_TOLERANCE = 1e-13
"""Distance from a straight line, relative to the largest torque, below which a sample lies on it."""


@dataclass(frozen=True, eq=False)
class Law:
    """A control law.

    Attributes
    ----------
    name : str
    control : (clock, q, v, latched, slide, data) -> (torque, bounds, guards) Function
        Torque before its limits [N m], built by :func:`gaitopt.control.control_function`.  Laws with the same
        expressions share one Function whatever their numbers, so derivatives and compiled code are created once.
    breakpoints : (K,) array [s, or rad]
        Start of each interval, in the clock or in the entry `index` of the state; the last one has no end.
    table : (n_d, K) array
        Data of each interval.
    gains : mapping of str to int
        Rows of the table that contain a gain, equal in every interval.
    memory : Memory
        Latched values and events; by default there are none.
    limited : bool
        Whether the torque is limited; the limits are the last n_u rows of the table.
    index : int or None
        Entry of the state (q, v, latched) that determines the interval; None for the clock.  With an entry, the first
        two rows of the table are the bounds of each interval, and the output `bounds` of `control` is the distance to
        both, at whose zeros engines stop.
    gain_matrices : tuple of GainMatrix
        Positions of the matrices of a linear feedback in the table.
    phase_variable : (q, v) -> number Function or None
        Quantity that determines the interval instead of an entry of the state, with bounds as for `index`; for a part
        of a PlanarLaw only.

    Raises
    ------
    InputError
        If the Function has another signature, or its data are not a column of the table.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> law = passive(compass_biped())
    >>> law.piece(0.3), law.torque_at(0.3, [0] * 4, [0] * 4)
    (0, array([0., 0.]))
    """

    name: str
    control: ca.Function = field(repr=False)
    breakpoints: Array = field(repr=False)
    table: Array = field(repr=False)
    gains: Mapping[str, int] = field(default_factory=dict, repr=False)
    memory: Memory = field(default=None, repr=False)  # type: ignore[assignment]
    limited: bool = field(default=False, repr=False)
    index: int | None = field(default=None, repr=False)
    gain_matrices: tuple[GainMatrix, ...] = field(default=(), repr=False)
    phase_variable: ca.Function | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        _check_signature(self.name, self.control, self.table.shape[0])
        object.__setattr__(self, "control", _deserialise(self.control.serialize()))
        if self.memory is None:
            object.__setattr__(self, "memory", no_memory(self.control.size1_in(1), self.table.shape[0]))
        latch, reset = (_deserialise(each.serialize()) for each in (self.memory.latch, self.memory.reset))
        object.__setattr__(self, "memory", replace(self.memory, latch=latch, reset=reset))
        if self.phase_variable is not None:
            object.__setattr__(self, "phase_variable", _deserialise(self.phase_variable.serialize()))
        sizes = len(self.memory.values), len(self.memory.events)
        if sizes != (self.control.size1_in(3), self.control.size1_out(2)):
            values = format_count(self.control.size1_in(3), "latched value")
            guards = format_count(self.control.size1_out(2), "guard")
            raise InputError(
                f"The law {self.name!r} has {values} and {guards}, but its memory names "
                f"{format_count(sizes[0], 'value')} and {format_count(sizes[1], 'event')}."
            )

    @property
    def torque(self) -> ca.Function:
        """The Function of the law with limited torque, with the inputs and outputs of `control`."""
        return saturate_control(self.control) if self.limited else self.control

    def torque_at(self, clock: float, q: Array, v: Array, *, latched: Array = (), slide: int = 0) -> Array:  # type: ignore[assignment]
        """Return the torque at a clock time in a state, shape (n_u,) [N m].

        Parameters
        ----------
        clock : float [s]
        q, v : (n_q,) arrays
        latched : (n_l,) array
        slide : int
            Sign of the stance foot's velocity, 0 while it sticks.
        """
        data = self.data(clock, np.concatenate([q, v, latched]))
        return np.asarray(self.torque(clock, q, v, latched, slide, data)[0], dtype=float).ravel()

    @property
    def is_passive(self) -> bool:
        """Whether the torque is zero at every time in every state."""
        return bool(self.control.call(self.control.sx_in())[0].is_zero())

    def measure(self, clock: float, y: Array) -> float:
        """Return the quantity that determines the piece in a state y = (q, v, latched)."""
        if self.phase_variable is not None:
            n = self.control.size1_in(1)
            return float(self.phase_variable(y[:n], y[n : 2 * n]))
        return clock if self.index is None else float(y[self.index])

    @property
    def by_state(self) -> bool:
        """Whether the state determines the piece, not the clock."""
        return self.index is not None or self.phase_variable is not None

    def piece(self, measure: float) -> int:
        """Return the number of the piece that contains a clock time, or a value of the entry `index`."""
        return max(int(np.searchsorted(self.breakpoints, measure, side="right")) - 1, 0)

    def data(self, clock: float, y: Array) -> Array:
        """Return the active column of the table at a clock time in a state y, shape (n_d,)."""
        return self.table[:, 0 if self.breakpoints.size == 1 else self.piece(self.measure(clock, y))]

    def split(self, points: Array) -> "Law":
        """Return the same law with its pieces split at further points."""
        begins = np.union1d(self.breakpoints, points)
        table = self.table[:, [self.piece(begin) for begin in begins]]
        if self.by_state:
            table[0], table[1, :-1] = begins, begins[1:]
        return replace(self, breakpoints=begins, table=table)

    def digest(self) -> str:
        """Return a hash of the expressions and numbers of the law."""
        parts = [self.torque, self.memory.latch, self.memory.reset]
        whole = hashlib.sha256("".join(part.serialize() for part in parts).encode())
        if self.phase_variable is not None:
            whole.update(self.phase_variable.serialize().encode())
        whole.update(self.breakpoints.tobytes() + self.table.tobytes() + repr(self.index).encode())
        return whole.hexdigest()

    @property
    def gain_values(self) -> dict[str, float]:
        """Gains by name."""
        return {name: float(self.table[row, 0]) for name, row in self.gains.items()}

    def with_gains(self, values: Mapping[str, float]) -> "Law":
        """Return the law with other gains; gains that are not named keep their values.

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


@check_arguments
@one_at_a_time
def passive(robot: Robot | PlanarRobot) -> Law:
    """Return the law with zero torque.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> passive(compass_biped()).name
    'passive'
    """
    data = ca.SX.sym("data", 0)
    function = torque_function(robot, data, lambda clock, q, v: ca.SX.zeros(robot.n_u))
    return Law("passive", function, np.zeros(1), np.zeros((0, 1)))


@check_arguments
def feedforward(robot: Robot, motion: Motion) -> Law:
    """Return the law that replays the torques of a motion's first step, with a clock reset at touchdown.

    Torques are linear between the samples of the motion and constant after its last sample.

    Parameters
    ----------
    robot : Robot
    motion : Motion
        Motion with torques that are linear between samples, like those of an optimised gait.

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
    return feedforward_samples(robot, time[corner], torque[:, corner])


def feedforward_samples(robot: Robot, time: Array, torque: Array) -> Law:
    """Return the law of torques that are linear between samples, with a clock reset at touchdown.

    Parameters
    ----------
    robot : Robot
    time : (n,) array [s]
        From 0 on; of two equal times the second begins a piece.
    torque : (n_u, n) array [N m]

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> law = feedforward_samples(compass_biped(), np.array([0.0, 0.5]), np.array([[0.0, 1.0], [2.0, 2.0]]))
    >>> law.torque_at(0.25, np.zeros(4), np.zeros(4)).tolist()
    [0.5, 2.0]
    """
    begins = np.diff(time) > 0  # of equal times the last begins a piece, so torques may jump
    slope = np.hstack([np.diff(torque, axis=1)[:, begins] / np.diff(time)[begins], np.zeros((robot.n_u, 1))])
    keep = np.append(begins, True)
    time, torque = time[keep], torque[:, keep]
    table = np.vstack([time, torque, slope])
    return Law("feedforward", _linear_torque(robot), time, table)


@functools.lru_cache(maxsize=8)
@one_at_a_time
def _linear_torque(robot: Robot) -> ca.Function:
    """Return the torque that is linear in the clock from the start of its piece."""
    data = ca.SX.sym("data", 1 + 2 * robot.n_u)
    value, rate = data[1 : 1 + robot.n_u], data[1 + robot.n_u :]
    return torque_function(robot, data, lambda clock, q, v: value + rate * (clock - data[0]))


def check_names(robot: Robot, motion: Motion) -> None:
    """Raise InputError unless a motion has the actuators and the angles of a robot, in their order."""
    check_motion(motion)
    if (motion.actuators, motion.angles) != (robot.actuators, robot.angles):
        raise InputError(
            f"The motion has actuators {motion.actuators} and angles {motion.angles}, "
            f"but the robot has {robot.actuators} and {robot.angles}."
        )


def check_law(law: object) -> None:
    """Raise InputError unless an argument is a law; the name of a law is not."""
    check_type("law", law, Law, "a Law such as lqr(robot, gait.motion)")


def _corners(time: Array, torque: Array) -> Array:
    """Return whether each sample deviates from the straight line between its neighbours, shape (K,)."""
    before, after = np.diff(time)[:-1], np.diff(time)[1:]
    share = before / np.maximum(before + after, np.finfo(float).tiny)
    off = np.abs(torque[:, :-2] + share * (torque[:, 2:] - torque[:, :-2]) - torque[:, 1:-1])
    straight = (
        np.all(off <= COLLINEARITY_TOLERANCE * np.max(np.abs(torque), initial=0.0), axis=0) & (before > 0) & (after > 0)
    )
    return np.concatenate([[True], ~straight, [True]])


def _check_signature(name: str, control: ca.Function, rows: int) -> None:
    """Raise InputError unless a Function has the signature of a law, for a table with a number of rows."""
    signature = control.n_in(), control.n_out()
    if signature != (len(INPUTS), len(OUTPUTS)):
        raise InputError(
            f"The law {name!r} needs a Function ({', '.join(INPUTS)}) -> ({', '.join(OUTPUTS)}), got one with "
            f"{signature[0]} inputs and {signature[1]} outputs; build it with control_function."
        )
    if control.size1_in(5) != rows:
        read = format_count(control.size1_in(5), "row")
        raise InputError(f"The law {name!r} reads {read} of data, but its table has {rows}.")


@functools.lru_cache(maxsize=128)
@one_at_a_time
def _deserialise(serialized: str) -> ca.Function:
    """Return a Function from its serialised form; equal expressions give the same Function."""
    return ca.Function.deserialize(serialized)
