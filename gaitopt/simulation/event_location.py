"""Event location on the dense output of an integrator: the first guard that falls through zero."""

import functools
import itertools
import math
from collections.abc import Callable
from typing import Protocol

import casadi as ca
import numpy as np

from gaitopt.locks import one_at_a_time
from gaitopt.model.contacts.event import EventKind, HybridEvent
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.simulation.closed_loop import ModeEquations

PROBE_FRACTION = 1e-4
"""Fraction of a span after which the sign of a guard that starts at zero is checked."""

MAX_HALVINGS = 40
"""Maximum number of bisections of an interval in which a guard rises and falls again."""

GUARD_TOLERANCE = 1e-9
"""Guards that start below zero by less than this (N, m/s, rad) count as zero."""

TIME_TOLERANCE = 1e-15
"""Absolute [s] and relative tolerance of the time of an event."""


class DenseOutput(Protocol):
    """The motion within a step of an integrator.

    Attributes
    ----------
    t_old, t : float [s]
        Times of the beginning and the end of the step.
    """

    t_old: float
    t: float

    def __call__(self, t: float) -> Array:
        """Return the state at a time, shape (n,)."""


class EventWatch:
    """Detects and locates zero crossings of the guards of a contact mode along a motion.

    Parameters
    ----------
    equations : ModeEquations
    p : (n_p,) array
    data : (n_d,) array
    clock : float [s]
    y : (n_y,) array
        State at the start of the motion.
    law_only : bool
        Whether to monitor only the guards at which the law changes its piece.
    """

    def __init__(
        self, equations: ModeEquations, p: Array, data: Array, clock: float, y: Array, *, law_only: bool = False
    ) -> None:
        self._guards, self._size = FastCall(equations.guards, p, data), equations.size
        self._equations, self._p = equations, p
        events = enumerate(equations.events)
        self._watched = [(i, event) for i, event in events if not law_only or event.kind is EventKind.LAW_SWITCH]
        self.restart(data, clock, y)

    def restart(self, data: Array, clock: float, y: Array) -> None:
        """Continue with another piece of the law, from a state."""
        self._data = data
        self._guards.fix(self._p, data)
        self._previous: list[float] = self._guards(clock, y[: self._size])[0].tolist()

    def first(self, dense: DenseOutput, span: tuple[float, float]) -> tuple[HybridEvent | None, float]:
        """Return the first event in the time span that follows the previous one, and its time.

        A guard that starts at zero (a slide from rest, a force exactly on the cone) is an event at the start only if it
        falls immediately: if its rate is positive, it rises first, even if it falls again soon.  A guard that starts
        below zero is an event at the start.
        """
        # As floats of Python, with which find_dip takes a third of the time.
        previous, self._previous = self._previous, self._values(dense, span[1]).tolist()
        values, middle = self._previous, self._values(dense, middle_of(span)).tolist()
        located: list[tuple[float, int, HybridEvent]] = []
        for i, event in self._watched:
            guard = functools.partial(self._value, dense, i)
            samples = previous[i], middle[i], values[i]
            begin, end = span[0], span[1] if values[i] <= 0 else find_dip(guard, span, samples)
            if previous[i] <= 0:
                if event.kind is EventKind.TOUCHDOWN:
                    # It starts at zero by definition (both feet on the ground) and is an event only while armed.
                    risen = find_peak(guard, span, samples)
                    if risen is not None:
                        located += self._locate(dense, i, event, (risen, span[1]))
                    continue
                begin += PROBE_FRACTION * (span[1] - span[0])
                end = span[1] if values[i] < 0 else None
                if previous[i] < -GUARD_TOLERANCE:
                    located.append((span[0], i, event))
                    continue
                if values[i] < 0 and guard(begin) <= 0:
                    risen = _find_rise(guard, (span[0], begin)) if self._rate(dense, i, span[0]) > 0 else None
                    if risen is None:
                        located.append((span[0], i, event))
                        continue
                    begin, end = risen, begin
            if end is not None:
                located += self._locate(dense, i, event, (begin, end))
        if not located:
            return None, span[1]
        at, _, first = min(located, key=lambda entry: entry[:2])
        return first, at

    def _locate(
        self, dense: DenseOutput, i: int, event: HybridEvent, span: tuple[float, float]
    ) -> list[tuple[float, int, HybridEvent]]:
        """Return the event in a span in which its guard falls through zero; none for a touchdown that is not armed."""
        at = find_root(functools.partial(self._value, dense, i), span)
        if event.kind is EventKind.TOUCHDOWN and self._guards(at, dense(at)[: self._size])[1][0] <= 0:
            return []
        return [(at, i, event)]

    def first_in_step(self, dense: DenseOutput, spans: int) -> tuple[HybridEvent | None, float]:
        """Return the first event in a whole step of the integrator, divided into spans, and its time."""
        if not self._watched:
            return None, dense.t
        for span in spans_of(dense, spans):
            event, at = self.first(dense, span)
            if event is not None:
                return event, at
        return None, dense.t

    def _values(self, dense: DenseOutput, t: float) -> Array:
        return self._guards(t, dense(t)[: self._size])[0]

    def _value(self, dense: DenseOutput, i: int, t: float) -> float:
        return float(self._values(dense, t)[i])

    def _rate(self, dense: DenseOutput, i: int, t: float) -> float:
        """Return the rate of a guard along the motion."""
        rates = _guard_rates(self._equations)(t, dense(t)[: self._size], self._p, self._data)
        return float(np.asarray(rates).ravel()[i])


def middle_of(span: tuple[float, float]) -> float:
    """Return the middle of a span."""
    return (span[0] + span[1]) / 2


def spans_of(dense: DenseOutput, count: int) -> list[tuple[float, float]]:
    """Return the spans of equal length into which a step of the integrator is divided."""
    begin, length = dense.t_old, (dense.t - dense.t_old) / count
    return list(itertools.pairwise([*(i * length + begin for i in range(count)), dense.t]))


@functools.lru_cache(maxsize=128)
@one_at_a_time
def _guard_rates(equations: ModeEquations) -> ca.Function:
    """Return (t, y, p, data) -> rates of the guards of a mode along its flow."""
    t, y, p, data = equations.flow.sx_in()
    guards = equations.guards(t, y, p, data)[0]
    rates = ca.jtimes(guards, y, equations.flow(t, y, p, data)) + ca.jacobian(guards, t)
    return ca.Function("guard_rates", [t, y, p, data], [ca.densify(rates)])


def _find_rise(guard: Callable[[float], float], span: tuple[float, float]) -> float | None:
    """Return a time in a span at which a guard that rises from zero and falls again is positive, or None."""
    begin, end = span
    for _ in range(MAX_HALVINGS):
        end = (begin + end) / 2
        if guard(end) > 0:
            return end
    return None


def find_dip(
    guard: Callable[[float], float], span: tuple[float, float], values: tuple[float, float, float]
) -> float | None:
    """Return a time in a span at which a guard that is positive at both ends is negative, or None.

    The minimum is located only if the parabola through the ends and the middle comes close to zero inside.
    """
    left, middle, right = values
    bend, lean = 2 * (left - 2 * middle + right), right - left
    if bend <= abs(lean) or middle - lean * lean / (4 * bend) > 0.1 * max(left, right):
        return None
    import scipy.optimize  # whose import takes longer than a step, and which a step seldom needs

    options = {"xatol": 1e-9 * (span[1] - span[0])}
    minimum = scipy.optimize.minimize_scalar(guard, bounds=span, method="bounded", options=options)
    return float(minimum.x) if minimum.fun < 0 else None


def find_peak(
    guard: Callable[[float], float], span: tuple[float, float], values: tuple[float, float, float]
) -> float | None:
    """Return a time in a span at which a guard that is negative at both ends is positive, or None.

    Examples
    --------
    >>> height = lambda t: 1e-6 - (t - 0.7) ** 2
    >>> round(find_peak(height, (0.6, 0.8), (height(0.6), height(0.7), height(0.8))), 6)
    0.7
    """
    if values[0] >= -GUARD_TOLERANCE or values[2] >= 0:
        return None
    left, middle, right = values
    return find_dip(lambda t: -guard(t), span, (-left, -middle, -right))


def find_root(guard: Callable[[float], float], span: tuple[float, float]) -> float:
    """Return the time at which a guard falls through zero in a span; if rounding hides the sign change, an end.

    The method of Brent (Algorithms for Minimization without Derivatives, chapter 4) takes the steps of
    :func:`scipy.optimize.brentq`.
    """
    values = guard(span[0]), guard(span[1])
    if values[0] <= 0:
        return span[0]
    if values[1] >= 0:
        return span[1]
    (old, new), (f_old, f_new) = span, values
    other, f_other, last, step = old, f_old, new - old, new - old  # the root lies between new and other
    while True:
        if f_old != 0 and f_new != 0 and (f_old < 0) != (f_new < 0):
            other, f_other, last, step = old, f_old, new - old, new - old
        if abs(f_other) < abs(f_new):
            old, new, other, f_old, f_new, f_other = new, other, new, f_new, f_other, f_new
        tolerance, half = (TIME_TOLERANCE + TIME_TOLERANCE * abs(new)) / 2, (other - new) / 2
        if f_new == 0 or abs(half) < tolerance:
            return new
        trial = _interpolate((old, new, other), (f_old, f_new, f_other)) if abs(f_new) < abs(f_old) else math.inf
        if abs(last) > tolerance and 2 * abs(trial) < min(abs(last), 3 * abs(half) - tolerance):
            last, step = step, trial
        else:
            last = step = half
        old, f_old = new, f_new
        new += step if abs(step) > tolerance else math.copysign(tolerance, half)
        f_new = guard(new)


def _interpolate(times: tuple[float, float, float], values: tuple[float, float, float]) -> float:
    """Return the step to the root of the secant, or of the inverse parabola if the three times differ."""
    (old, new, other), (f_old, f_new, f_other) = times, values
    if old == other:
        return -f_new * (new - old) / (f_new - f_old)
    slope, other_slope = (f_old - f_new) / (old - new), (f_other - f_new) / (other - new)
    below = other_slope * slope * (f_other - f_old)
    return -f_new * (f_other * other_slope - f_old * slope) / below if below else math.inf
