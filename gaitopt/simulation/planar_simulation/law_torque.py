"""The torque of one part of a law: its pieces by the clock or by a phase variable, with or without exchanged legs."""

from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.law_slopes import phase_slope
from gaitopt.control.planar_laws.torque_formula import law_formula
from gaitopt.model.fast_call import FastCall
from gaitopt.model.planar.mirror import Mirror
from gaitopt.motion.motion import Array
from gaitopt.simulation.planar_simulation.phase_torque import LawState, PhaseTorque, TorqueSlope

INSTANT = 1e-11
"""Least duration of a piece of the integration [s]."""


class Measure:
    """The phase variable of a part of a law, and its derivative with respect to (q, v)."""

    def __init__(self, part: Law) -> None:
        variable = part.phase_variable
        if variable is None:
            raise ValueError("a part without phase variable has no measure")
        self.value, self.slope = FastCall(variable), FastCall(phase_slope(variable))


class PartEquations(NamedTuple):
    """A part of a law: torque and slope with preallocated arrays, and the columns of its table as rows."""

    law: Law
    function: ca.Function
    value: FastCall
    slope: FastCall
    columns: Array
    measure: Measure | None


class LawTorque(PhaseTorque):
    """The torque of one part of a law, with exchanged legs in every second period."""

    def __init__(self, equations: PartEquations, memory: LawState, mirror: Mirror | None) -> None:
        self._law, self._function, self._value, self._slope, self._columns, self._measure = equations
        self.latched, self._mirror = memory.latched, mirror
        matrices = None if mirror is None else (mirror.coordinates, mirror.actuators)
        self._memory, self._matrices, self._piece = memory, matrices, -1

    def value(self, t: float, q: Array, v: Array) -> Array:
        """See :class:`PhaseTorque`."""
        inputs = self._inputs(t, q, v)
        torque = self._value(*inputs)[0]
        return torque if self._matrices is None else self._matrices[1].T @ torque

    def slope(self, t: float, q: Array, v: Array) -> TorqueSlope:
        """See :class:`PhaseTorque`."""
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
        """The torque within its limits as an expression."""
        return law_formula(self._law.control if self._law.limited else self._function, self._mirror)

    @property
    def limits(self) -> Array | None:
        """Limits of the formula; None if it has none."""
        if not self._law.limited:
            return None
        limits = self._columns[max(self._piece, 0), -self._law.control.size1_out(0) :]
        return limits if self._matrices is None else np.abs(self._matrices[1]).T @ limits

    @property
    def data(self) -> Array:
        """Data of the formula: the time at which the clock is zero, and the column of the piece that is held."""
        return np.append(self._memory.begin, self._columns[max(self._piece, 0)])

    def next_corner(self, t: float) -> float:
        """See :class:`PhaseTorque`."""
        if self._measure is not None:
            return np.inf
        corners = self._law.breakpoints + self._memory.begin
        place = int(np.searchsorted(corners, t + INSTANT, side="right"))
        return float(corners[place]) if place < corners.size else np.inf

    def hold_piece(self, span: tuple[float, float] | None) -> None:
        """See :class:`PhaseTorque`."""
        if span is None:
            self._piece = -1
        elif self._measure is None:
            end = span[1] if np.isfinite(span[1]) else span[0] + 1
            self._piece = self._law.piece((span[0] + end) / 2 - self._memory.begin)

    def find_piece(self, q: Array, v: Array) -> int | None:
        """See :class:`PhaseTorque`."""
        return None if self._measure is None else self._law.piece(self._phase(q, v))

    def hold_number(self, piece: int) -> None:
        """See :class:`PhaseTorque`."""
        self._piece = piece

    def distance(self, q: Array, v: Array) -> tuple[float, float]:
        """See :class:`PhaseTorque`."""
        if self._measure is None:
            return np.inf, np.inf
        value, (lower, upper) = self._phase(q, v), self._columns[self._piece, :2].tolist()
        return value - lower, upper - value

    def phase_slope(self, q: Array, v: Array) -> Array:
        """See :class:`PhaseTorque`."""
        if self._measure is None:
            return np.zeros(2 * len(q))
        if self._matrices is None:
            return self._measure.slope(q, v)[0].copy()
        matrix = self._matrices[0]
        slope: Array = self._measure.slope(matrix @ q, matrix @ v)[0] @ np.kron(np.eye(2), matrix)
        return slope

    def _phase(self, q: Array, v: Array) -> float:
        """Return the phase variable."""
        if self._measure is None:
            raise ValueError("the clock has no phase variable")
        if self._matrices is not None:
            q, v = self._matrices[0] @ q, self._matrices[0] @ v
        return float(self._measure.value(q, v)[0][0])

    def _inputs(self, t: float, q: Array, v: Array) -> tuple[float, Array, Array, tuple[float, ...], int, Array]:
        clock, piece = t - self._memory.begin, self._piece
        if piece < 0:
            piece = self._law.piece(clock if self._measure is None else self._phase(q, v))
        if self._matrices is not None:
            q, v = self._matrices[0] @ q, self._matrices[0] @ v
        return clock, q, v, self._memory.latched, 0, self._columns[piece]
