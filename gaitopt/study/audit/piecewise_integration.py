"""Integration of smooth pieces of a motion by SciPy, with location of the first event on the dense output."""

from collections.abc import Callable, Mapping
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

Guards = Mapping[str, Callable[[float, Array, float], float]]
"""Guards (t, y, middle) by name: an event occurs when one falls through zero."""


@dataclass(frozen=True, eq=False)
class Crossing:
    """The first event of a motion.

    Attributes
    ----------
    name : str or None
        Name of the guard; None if the integration reached the last time.
    time : float [s]
    state : (n,) array
    """

    name: str | None
    time: float
    state: Array


@dataclass(frozen=True, eq=False)
class SmoothPiece:
    """A smooth motion until its first event.

    Attributes
    ----------
    rate : callable
        (t, y, middle) -> time derivative of the state; `middle` is a time inside the present interval between corners.
    guards : mapping of str to callable
    accepts : callable
        (name, t, y) -> whether an event counts.
    checked : tuple of str
        Guards that may be negative at the start of the motion or after a jump of the torques, which is an event, too.
    slopes : mapping of str to callable
        Rates (t, y, middle) of some guards.  Between two zeros of its rate a guard is monotonic, so that it is also
        located where it is negative for a part of a step of the integrator only, as at a touchdown that grazes the
        ground.
    """

    rate: Callable[[float, Array, float], Array]
    guards: Guards
    accepts: Callable[[str, float, Array], bool]
    checked: tuple[str, ...] = ()
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
    ...              lambda name, t, y: True)
    >>> crossing = integrate_piece(fall, np.array([1.0, 0.0]), np.array([0.0, 0.7, 3.0]))
    >>> crossing.name, round(crossing.time, 9)
    ('ground', 1.0)
    """
    from scipy.integrate import solve_ivp

    names, slopes, now = list(piece.guards), list(piece.slopes), float(times[0])
    for end in map(float, times[1:]):
        middle = (now + end) / 2
        for name in piece.checked:
            if piece.guards[name](now, state, middle) < -VIOLATION and piece.accepts(name, now, state):
                return Crossing(name, now, state)
        run = solve_ivp(
            piece.rate,
            (now, end),
            state,
            "DOP853",
            events=[_falling(piece.guards[name]) for name in names] + [piece.slopes[name] for name in slopes],
            args=(middle,),
            dense_output=True,
            rtol=RELATIVE,
            atol=ABSOLUTE,
        )
        crossings = [(time, name) for name, at in zip(names, run.t_events, strict=False) for time in at]
        for name, turns in zip(slopes, run.t_events[len(names) :], strict=True):
            crossings += [(time, name) for time in _locate_falls(piece.guards[name], run, turns, middle)]
        for time, name in sorted(crossings):
            at = np.asarray(run.sol(time), dtype=float)
            if piece.accepts(name, float(time), at):
                return Crossing(name, float(time), at)
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
