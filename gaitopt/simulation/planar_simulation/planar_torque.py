"""The torque of a planar robot's simulation: a Function of time and state, or a law with a clock and latched values."""

from abc import ABC, abstractmethod
from collections.abc import Iterable
from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.law_slopes import latch_slope, law_slope
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.control.planar_laws.torque_formula import function_formula, law_formula
from gaitopt.errors import InputError
from gaitopt.model.fast_call import FastCall
from gaitopt.model.planar.mirror import Mirror
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.planar.torque_function import check_torque, passive_torque, torque_slope
from gaitopt.motion.actuator_impulses import EventImpulses
from gaitopt.motion.motion import Array

INSTANT = 1e-11
"""Least duration of a piece of the integration [s]."""


class LawState(NamedTuple):
    """Memory of a law between events.

    Attributes
    ----------
    part : int
        Number of impacts since the section.
    begin : float [s]
        Time of the section.
    latched : tuple of float
        Values latched there.
    mirrored : bool
        Whether the legs have been exchanged an odd number of times.
    """

    part: int
    begin: float
    latched: tuple[float, ...]
    mirrored: bool


class TorqueSlope(NamedTuple):
    """Derivatives of a torque with respect to state, (n_u, 2 n_q), time, (n_u,), and latched values, (n_u, n_l)."""

    by_state: Array
    by_time: Array
    by_latched: Array


class PhaseTorque(ABC):
    """The torque of a phase: that between two events.

    Attributes
    ----------
    latched : tuple of float
        Latched values.
    """

    latched: tuple[float, ...] = ()

    @property
    def formula(self) -> ca.Function | None:
        """The torque as an expression (t, q, v, latched, data) -> u; None if it is not one."""
        return None

    @property
    def data(self) -> Array:
        """Data of the formula, of the piece that is held."""
        return np.zeros(0)

    @abstractmethod
    def value(self, t: float, q: Array, v: Array) -> Array:
        """Return the torque, shape (n_u,); the array may be overwritten by the next call."""

    @abstractmethod
    def slope(self, t: float, q: Array, v: Array) -> TorqueSlope:
        """Return the derivatives of the torque."""

    def next_corner(self, t: float) -> float:
        """Return the next time at which the integration restarts [s]."""
        return np.inf

    def hold_piece(self, span: tuple[float, float] | None) -> None:  # noqa: B027 - a torque may have no pieces
        """Use the piece of a time span until the next call; with None, that of the time of each evaluation."""


class TorqueSource(ABC):
    """The torque of a simulation, with the memory that changes at events.

    Attributes
    ----------
    n_latched : int
        Number of latched values.
    """

    n_latched: int = 0

    @abstractmethod
    def start(self, time: float, q: Array, v: Array) -> LawState | None:
        """Return the memory at the beginning of a period."""

    @abstractmethod
    def pass_impact(
        self, memory: LawState | None, closing: Iterable[str], time: float, q: Array, v: Array
    ) -> LawState | None:
        """Return the memory after an impact of some closing contacts, from the state after it."""

    @abstractmethod
    def phase_torque(self, memory: LawState | None) -> PhaseTorque:
        """Return the torque until the next event."""

    def impulses(self, memory: LawState | None, closing: Iterable[str]) -> EventImpulses | None:
        """Return the impulses of the actuators at an impact of some closing contacts, from the memory before it."""
        return None

    def latched_slope(self, q: Array, v: Array) -> Array:
        """Return the derivative of the latched values at a section with respect to the state (q, v), (n_l, 2 n_q)."""
        return np.zeros((0, 2 * len(q)))


def make_torque(robot: PlanarRobot, torque: ca.Function | PlanarLaw | TorqueSource | None) -> TorqueSource:
    """Return the torque of a simulation from a Function (t, q, v) -> u, a law or a source; zero by default.

    Raises
    ------
    InputError
        If the Function or the law belongs to another robot.
    """
    if isinstance(torque, TorqueSource):
        return torque
    return _LawSource(robot, torque) if isinstance(torque, PlanarLaw) else _FunctionSource(robot, torque)


class _FunctionSource(TorqueSource):
    """A torque that depends on time and state only."""

    def __init__(self, robot: PlanarRobot, torque: ca.Function | None) -> None:
        function = torque or passive_torque(robot)
        check_torque(robot, function)
        self._torque = _FunctionTorque(function)

    def start(self, time: float, q: Array, v: Array) -> None:
        return None

    def pass_impact(self, memory: LawState | None, closing: Iterable[str], time: float, q: Array, v: Array) -> None:
        return None

    def phase_torque(self, memory: LawState | None) -> PhaseTorque:
        return self._torque


class _FunctionTorque(PhaseTorque):
    def __init__(self, function: ca.Function) -> None:
        self._function = function
        self._value, slope = FastCall(function), torque_slope(function)
        self._slope = None if slope is None else FastCall(slope)
        n, n_u = function.size1_in(1), function.size1_out(0)
        self._zero = TorqueSlope(np.zeros((n_u, 2 * n)), np.zeros(n_u), np.zeros((n_u, 0)))

    @property
    def formula(self) -> ca.Function | None:
        """The torque as an expression."""
        return function_formula(self._function)

    def value(self, t: float, q: Array, v: Array) -> Array:
        return self._value(t, q, v)[0]

    def slope(self, t: float, q: Array, v: Array) -> TorqueSlope:
        if self._slope is None:
            return self._zero
        by_t, by_q, by_v = self._slope(t, q, v)
        n = len(q)
        by_state = np.vstack([by_q.reshape(n, -1), by_v.reshape(n, -1)]).T
        return TorqueSlope(by_state, by_t.copy(), self._zero.by_latched)


class _LawSource(TorqueSource):
    """The torque of a law."""

    def __init__(self, robot: PlanarRobot, law: PlanarLaw) -> None:
        sizes = {(part.control.size1_in(1), part.control.size1_out(0)) for part in law.parts}
        contact = law.section.removesuffix(" closes")
        if sizes != {(robot.n_q, robot.n_u)} or contact not in robot.contact_names:
            raise InputError(
                f"The law {law.name!r} with section {law.section!r} does not belong to robot {robot.name!r}, which has "
                f"{robot.n_q} coordinates, {robot.n_u} actuators and the contacts {robot.contact_names}."
            )
        self._robot, self._law, self.n_latched = robot, law, len(law.latched)
        place = robot.contact_names.index(contact)
        partner = place if robot.mirror is None else robot.mirror.contacts[place]
        self._ends = {False: robot.contact_names[place], True: robot.contact_names[partner]}
        self._functions = [part.torque for part in law.parts]
        self._calls = [(FastCall(torque), FastCall(law_slope(torque))) for torque in self._functions]
        self._columns = [np.ascontiguousarray(part.table.T) for part in law.parts]
        self._latch = FastCall(law.parts[0].memory.latch)

    def start(self, time: float, q: Array, v: Array) -> LawState:
        return self._restart(time, q, v, mirrored=False)

    def pass_impact(self, memory: LawState | None, closing: Iterable[str], time: float, q: Array, v: Array) -> LawState:
        if memory is None:
            return self.start(time, q, v)
        if self._ends[memory.mirrored] in closing:
            mirrored = memory.mirrored ^ (self._robot.mirror is not None)
            return self._restart(time, q, v, mirrored=mirrored)
        return memory._replace(part=min(memory.part + 1, len(self._law.parts) - 1))

    def impulses(self, memory: LawState | None, closing: Iterable[str]) -> EventImpulses | None:
        if memory is None or memory.part >= len(self._law.impulses):
            return None
        planned = self._law.impulses[memory.part]
        if planned is None:
            return None
        mirror = self._robot.mirror if memory.mirrored else None
        names, contact = self._robot.contact_names, planned.contact
        if mirror is not None:
            contact = names[mirror.contacts[names.index(contact)]]
        if contact not in closing:
            return None
        matrix = np.eye(self._robot.n_u) if mirror is None else mirror.actuators.T
        return EventImpulses(*(matrix @ values for values in planned.values))

    def phase_torque(self, memory: LawState | None) -> PhaseTorque:
        if memory is None:
            raise ValueError("the torque of a law depends on its memory")
        part = memory.part
        equations = _PartEquations(
            self._law.parts[part], self._functions[part], *self._calls[part], self._columns[part]
        )
        return _LawTorque(equations, memory, self._robot.mirror if memory.mirrored else None)

    def latched_slope(self, q: Array, v: Array) -> Array:
        memory, n = self._law.parts[0].memory, len(q)
        slope = latch_slope(memory.latch)(q, v, self._law.parts[0].table[:, 0])
        return np.array(slope).reshape(self.n_latched, 2 * n)

    def _restart(self, time: float, q: Array, v: Array, *, mirrored: bool) -> LawState:
        mirror = self._robot.mirror
        if mirrored and mirror is not None:
            q, v = mirror.coordinates @ q, mirror.coordinates @ v
        latched = self._latch(q, v, self._law.parts[0].table[:, 0])[0] if self.n_latched else ()
        return LawState(0, time, tuple(float(value) for value in latched), mirrored)


class _PartEquations(NamedTuple):
    """A part of a law: torque and slope with preallocated arrays, and the columns of its table as rows."""

    law: Law
    function: ca.Function
    value: FastCall
    slope: FastCall
    columns: Array


class _LawTorque(PhaseTorque):
    """The torque of one part of a law, with exchanged legs in every second period."""

    def __init__(self, equations: _PartEquations, memory: LawState, mirror: Mirror | None) -> None:
        self._law, self._function, self._value, self._slope, self._columns = equations
        self.latched, self._mirror = memory.latched, mirror
        matrices = None if mirror is None else (mirror.coordinates, mirror.actuators)
        self._memory, self._matrices, self._piece = memory, matrices, -1

    def value(self, t: float, q: Array, v: Array) -> Array:
        inputs = self._inputs(t, q, v)
        torque = self._value(*inputs)[0]
        return torque if self._matrices is None else self._matrices[1].T @ torque

    def slope(self, t: float, q: Array, v: Array) -> TorqueSlope:
        by_clock, by_state, by_latched = self._slope(*self._inputs(t, q, v))
        n, n_u = len(q), by_clock.size
        state, latched = (
            by_state.reshape(2 * n, n_u).T.copy(),
            by_latched.reshape(len(self._memory.latched), n_u).T.copy(),
        )
        if self._matrices is None:
            return TorqueSlope(state, by_clock.copy(), latched)
        coordinates, actuators = self._matrices
        return TorqueSlope(
            actuators.T @ state @ np.kron(np.eye(2), coordinates), actuators.T @ by_clock, actuators.T @ latched
        )

    @property
    def formula(self) -> ca.Function | None:
        """The torque as an expression."""
        return law_formula(self._function, self._mirror)

    @property
    def data(self) -> Array:
        """Data of the formula: the time at which the clock is zero, and the column of the piece that is held."""
        return np.append(self._memory.begin, self._columns[max(self._piece, 0)])

    def next_corner(self, t: float) -> float:
        corners = self._law.breakpoints + self._memory.begin
        place = int(np.searchsorted(corners, t + INSTANT, side="right"))
        return float(corners[place]) if place < corners.size else np.inf

    def hold_piece(self, span: tuple[float, float] | None) -> None:
        if span is None:
            self._piece = -1
        else:
            end = span[1] if np.isfinite(span[1]) else span[0] + 1
            self._piece = self._law.piece((span[0] + end) / 2 - self._memory.begin)

    def _inputs(self, t: float, q: Array, v: Array) -> tuple[float, Array, Array, tuple[float, ...], int, Array]:
        clock = t - self._memory.begin
        piece = self._law.piece(clock) if self._piece < 0 else self._piece
        if self._matrices is not None:
            q, v = self._matrices[0] @ q, self._matrices[0] @ v
        return clock, q, v, self._memory.latched, 0, self._columns[piece]
