"""Integration of smooth pieces of a motion by SciPy, with location of the first event on the dense output."""

from collections.abc import Callable, Hashable, Mapping
from dataclasses import field
from itertools import pairwise
from typing import Any

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import GaitoptError
from gaitopt.motion.motion import Array

RELATIVE, ABSOLUTE = 1e-11, 1e-13
"""Tolerances of the integrator."""

VIOLATION = 1e-9
"""A guard below minus this value at the start of a piece is an event at the start."""

Guards = Mapping[Any, Callable[[float, Array, float], float]]
"""Guards (t, y, middle) by sortable keys: an event occurs when one falls through zero."""


@dataclass(frozen=True, eq=False)
class Crossing:
    """The first event of a motion.

    Attributes
    ----------
    key : hashable or None
        Key of the guard; None if the integration reached the last time.
    time : float [s]
    state : (n,) array
    """

    key: Any
    time: float
    state: Array


@dataclass(frozen=True, eq=False)
class SmoothPiece:
    """A smooth motion until its first event.

    Attributes
    ----------
    rate : callable
        (t, y, middle) -> time derivative of the state; `middle` is a time inside the present interval between corners.
    guards : mapping to callable
    accepts : callable
        (key, t, y) -> whether an event counts.
    checked : tuple
        Guards that may be negative at the start of the motion or after a jump of the torques, which is an event, too.
    slopes : mapping to callable
        Rates (t, y, middle) of some guards.  Between two zeros of its rate a guard is monotonic, so that it is also
        located where it is negative for a part of a step of the integrator only, as at a touchdown that grazes the
        ground.
    """

    rate: Callable[[float, Array, float], Array]
    guards: Guards
    accepts: Callable[[Any, float, Array], bool]
    checked: tuple[Hashable, ...] = ()
    slopes: Guards = field(default_factory=dict)


def integrate_piece(piece: SmoothPiece, state: Array, times: Array) -> Crossing:
    """Return the first event of a motion that starts at the first time; the integrator is restarted at the others.

    Parameters
    ----------
    piece : SmoothPiece
    state : (n,) array
    times : (k,) array [s]
        Start, times at which the rate has corners, and the last time.

    Returns
    -------
    Crossing

    Raises
    ------
    GaitoptError
        If the integrator does not reach the end.

    Examples
    --------
    A body that falls from a height of 1 m at 2 m/s^2 reaches the ground after 1 s:

    >>> fall = SmoothPiece(lambda t, y, middle: np.array([y[1], -2.0]), {"ground": lambda t, y, middle: y[0]},
    ...              lambda key, t, y: True)
    >>> crossing = integrate_piece(fall, np.array([1.0, 0.0]), np.array([0.0, 0.7, 3.0]))
    >>> crossing.key, round(crossing.time, 9)
    ('ground', 1.0)
    """
    from scipy.integrate import solve_ivp

    keys, slopes, now = list(piece.guards), list(piece.slopes), float(times[0])
    for end in map(float, times[1:]):
        middle = (now + end) / 2
        for key in piece.checked:
            if piece.guards[key](now, state, middle) < -VIOLATION and piece.accepts(key, now, state):
                return Crossing(key, now, state)
        run = solve_ivp(
            piece.rate,
            (now, end),
            state,
            "DOP853",
            events=[_falling(piece.guards[key]) for key in keys] + [piece.slopes[key] for key in slopes],
            args=(middle,),
            dense_output=True,
            rtol=RELATIVE,
            atol=ABSOLUTE,
        )
        crossings = [(time, key) for key, at in zip(keys, run.t_events, strict=False) for time in at]
        for key, turns in zip(slopes, run.t_events[len(keys) :], strict=True):
            crossings += [(time, key) for time in _locate_falls(piece.guards[key], run, turns, middle)]
        for time, key in sorted(crossings):
            at = np.asarray(run.sol(time), dtype=float)
            if piece.accepts(key, float(time), at):
                return Crossing(key, float(time), at)
        if run.status < 0:
            raise GaitoptError(f"The second integrator stops at {run.t[-1]:.6g} s: {run.message}")
        now, state = end, np.asarray(run.y[:, -1], dtype=float)
    return Crossing(None, now, state)


def _locate_falls(guard: Callable[[float, Array, float], float], run: Any, turns: Array, middle: float) -> list[float]:
    """Return the times at which a guard falls through zero in a run of an integrator, from those of its extrema."""
    from scipy.optimize import brentq

    def value(time: float) -> float:
        return guard(time, run.sol(time), middle)

    stretches = pairwise([float(run.t[0]), *map(float, turns), float(run.t[-1])])
    return [
        float(brentq(value, begin, end, xtol=1e-15, rtol=8.9e-16))
        for begin, end in stretches
        if value(begin) > 0 > value(end)
    ]


def _falling(guard: Callable[[float, Array, float], float]) -> Callable[[float, Array, float], float]:
    """Return a guard as an event function of SciPy, which is located where it falls."""

    def event(time: float, state: Array, middle: float) -> float:
        return guard(time, state, middle)

    event.direction = -1  # type: ignore[attr-defined]
    return event


@dataclass(frozen=True, eq=False)
class TorqueTable:
    """Torques that are linear between samples and constant or linear beyond them.

    Attributes
    ----------
    time : (K,) array [s]
        Not decreasing; the torques may jump where two times are equal.
    torque : (n_u, K) array [N m or N]
    continued : bool
        Whether the last line is continued beyond the last sample.

    Examples
    --------
    >>> table = TorqueTable(np.array([0.0, 1.0, 1.0, 2.0]), np.array([[0.0, 3.0, 5.0, 5.0]]))
    >>> table.evaluate(1.0, 0.5), table.evaluate(1.0, 1.5), table.corners(0.2, 3.0)
    (array([3.]), array([5.]), array([1., 2.]))
    """

    time: Array
    torque: Array
    continued: bool = False

    def evaluate(self, t: float, middle: float) -> Array:
        """Return the torques (n_u,) at a time, on the line of the interval that contains `middle`."""
        last = self.time.size - 1
        after = int(np.searchsorted(self.time, middle))
        if after > last and not self.continued:
            return self.torque[:, -1]
        after = min(max(after, 1), last)
        begin, end = self.time[after - 1], self.time[after]
        share = (t - begin) / (end - begin)
        return np.asarray((1 - share) * self.torque[:, after - 1] + share * self.torque[:, after])

    def corners(self, begin: float, end: float) -> Array:
        """Return the different times of samples between two times."""
        return np.unique(self.time[(self.time > begin) & (self.time < end)])
