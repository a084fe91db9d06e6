"""The exact choice of the contact mode of a foot on the ground."""

import functools
import math
from bisect import bisect_right

import casadi as ca
import numpy as np

from gaitopt.errors import InputError
from gaitopt.locks import one_at_a_time
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.closed_loop import ClosedLoop, torque_of

REST_SPEED = 1e-12
"""Foot speeds below this value [m/s] count as rest; impacts and located events produce exact zeros."""
_STICK, _SLIP_FORWARD, _SLIP_BACKWARD = Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD


class ContactChoice:
    """Chooses the contact mode of a foot on the ground after an event.

    A moving foot slides.  A foot at rest sticks if the sticking force lies in the static friction
    cone; otherwise it slides against the excess of that force.

    Parameters
    ----------
    loop : ClosedLoop
    """

    def __init__(self, loop: ClosedLoop) -> None:
        robot, law = loop.robot, loop.law
        self.friction = float(robot.static_friction(loop.p))
        self._unlimited = math.isinf(self.friction)
        self._loop, self._speed = loop, 1 + robot.state_entries.slip_velocity
        self._breaks, self._index = law.breakpoints.tolist(), law.index
        self._forces: dict[int, FastCall] = {}
        self._current = np.zeros(1 + loop.size)

    def choose(self, clock: float, y: Array, *, leaving: Mode | None = None) -> Mode:
        """Return the next contact mode of the foot.

        Parameters
        ----------
        clock : float [s]
        y : (n_y,) array
            y = (q, v, latched values of the law).
        leaving : Mode, optional
            Slip mode that has just ended at rest; it is not chosen again.

        Raises
        ------
        InputError
            If the foot moves despite infinite friction.
        """
        current = self._current
        current[0], current[1:] = clock, y
        speed = current.item(self._speed)
        if abs(speed) > REST_SPEED:
            if self._unlimited:
                raise InputError(
                    "A foot with infinite friction cannot slide: its velocity (v[0], or foot_speed on the section) "
                    f"must be 0, got {speed:g} m/s."
                )
            return _SLIP_FORWARD if speed > 0 else _SLIP_BACKWARD
        if self._unlimited:
            return _STICK
        measure = clock if self._index is None else current.item(1 + self._index)
        piece = max(bisect_right(self._breaks, measure) - 1, 0)  # equivalent to Law.piece, ten times faster
        tangential, normal = (self._forces.get(piece) or self._force(piece)).evaluate().tolist()
        if abs(tangential) <= self.friction * normal:
            return _STICK
        chosen = _SLIP_FORWARD if tangential < 0 else _SLIP_BACKWARD
        return _STICK if chosen is leaving else chosen

    def _force(self, piece: int) -> FastCall:
        """Return the Function of the sticking force (f_t, f_n) [N] in a piece of the law."""
        loop = self._loop
        force, data = _sticking_force(loop.robot, loop.law.torque), loop.law.table[:, piece]
        self._forces[piece] = FastCall(force, loop.p, data, shared=self._current)
        return self._forces[piece]


@functools.lru_cache(maxsize=128)
@one_at_a_time
def _sticking_force(robot: Robot, control: ca.Function) -> ca.Function:
    """Return (clock, y, p, data) -> sticking force of the foot under a law."""
    torque, n, p = torque_of(control, Mode.STICK), robot.n_q, ca.SX.sym("p", len(robot.parameters))
    clock, y, data = torque.sx_in()
    _, force = robot.acceleration[Mode.STICK](y[:n], y[n : 2 * n], torque(clock, y, data), p)
    return ca.Function("sticking_force", [clock, y, p, data], ca.cse([force]))
