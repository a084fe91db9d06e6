"""Location of the first event of a contact state on the dense output of an integrator."""

import functools
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from gaitopt.model.fast_call import FastCall
from gaitopt.model.planar.phase_system import GuardKind
from gaitopt.motion.motion import Array
from gaitopt.simulation.event_location import MAX_HALVINGS, DenseOutput, find_dip, find_root
from gaitopt.simulation.planar_simulation.planar_phase import PlanarPhase

ZERO = 1e-9
"""Gaps of a given state [m or rad], slip speeds [m/s] and forces relative to the weight below this value are zero."""

OPENING_GAP = 1e-12
"""Gap [m or rad] above which a contact that has opened can close again."""

LARGEST_SHIFT = 1e-9
"""Largest correction of the time of an event [s]; a larger one belongs to a jump of the torque."""

RESOLUTION = 1e-14
"""Accuracy of the time at which the forces of sliding contacts stop being determined [s]."""

JAMS = GuardKind("jams", -1)
"""End of a phase in which the forces of the sliding contacts are no longer determined."""


class LocatedGuard(NamedTuple):
    """A guard that falls through zero, and the time [s]."""

    kind: GuardKind
    time: float


class GuardWatch:
    """Detects and locates the zero crossings of the guards of a contact state.

    A guard that starts at zero is watched from the time at which it is positive; if it becomes negative instead, the
    event is at the start.  A gap that starts negative belongs to a foot that swings through the ground.

    Parameters
    ----------
    phase : PlanarPhase
    weight : float [N]
    t : float [s]
    y : (n_y,) array
        State at the start of the phase.
    is_well_posed : callable, optional
        Test of whether the forces in a state y are determined; the phase ends where they are not.
    short_slip : float
        Duration [s] below which the slip of a foot before its lift-off is omitted.
    """

    def __init__(
        self,
        phase: PlanarPhase,
        weight: float,
        t: float,
        y: Array,
        is_well_posed: Callable[[Array], bool] | None = None,
        short_slip: float = 0.0,
    ) -> None:
        self._is_well_posed, self._short_slip = is_well_posed, short_slip
        self._phase, self._arming = phase, FastCall(phase.robot.arming, phase.p)
        kinds = phase.equations.guards
        self._zero = np.array([_tolerance(kind, weight) for kind in kinds])
        self._previous = phase.guards(t, y)
        self._armed = self._previous > self._zero
        self._passed = np.array([kind.name == "closes" for kind in kinds], dtype=bool)
        self._passed &= self._previous < -self._zero

    def first(self, dense: DenseOutput, span: tuple[float, float], values: tuple[Array, Array]) -> LocatedGuard | None:
        """Return the first event in a time span that follows the previous one, or None.

        Parameters
        ----------
        dense : DenseOutput
        span : (float, float)
        values : two (n_g,) arrays
            Guards in the middle and at the end of the span.
        """
        middle, end = values
        previous, self._previous = self._previous, end
        located: list[LocatedGuard] = []
        for i, kind in enumerate(self._phase.equations.guards):
            guard = functools.partial(self._value, dense, i)
            at = self._locate(i, guard, span, (previous[i], middle[i], end[i]))
            if at is None:
                continue
            if kind.name == "closes" and not self._is_armed(kind.number, dense(at)):
                self._armed[i], self._passed[i] = False, True
                continue
            located.append(LocatedGuard(kind, at))
        if located:
            return self._prefer_opening(min(located, key=lambda event: event.time), located, dense)
        return None if self._is_well_posed is None else self._find_jam(self._is_well_posed, dense, span)

    def _prefer_opening(self, event: LocatedGuard, located: list[LocatedGuard], dense: DenseOutput) -> LocatedGuard:
        """Return the opening of a body instead of its slip if its forces vanish there or soon after: the cone ends."""
        if event.kind.name not in ("slips+", "slips-"):
            return event
        members = next(group for group in self._phase.equations.sticking if event.kind.number in group)
        kinds, later = self._phase.equations.guards, event.time + self._short_slip
        opening = [i for i, kind in enumerate(kinds) if kind.name == "opens" and kind.number in members]
        guards, following = (self._phase.guards(t, dense(t)) for t in (event.time, later))
        if all(abs(guards[i]) <= self._zero[i] for i in opening):
            return LocatedGuard(kinds[opening[0]], event.time)
        if self._short_slip == 0 or not all(guards[i] >= 0 >= following[i] for i in opening):
            return event
        roots = {i: find_root(functools.partial(self._value, dense, i), (event.time, later)) for i in opening}
        first = min(roots, key=lambda i: roots[i])
        others = [other.time for other in located if other.kind.number not in members]
        return event if min(others, default=np.inf) <= roots[first] else LocatedGuard(kinds[first], roots[first])

    def refine(self, event: LocatedGuard, y: Array) -> tuple[float, Array]:
        """Return the time of an event, corrected by one Newton step, and the state there.

        Parameters
        ----------
        event : LocatedGuard
        y : (n_y,) array
            State at the time of the event, to the accuracy of the integrator.
        """
        phase, t = self._phase, event.time
        if event.kind == JAMS:
            return t, y
        number, rates = phase.equations.guards.index(event.kind), phase.rates(t, y)
        gradient, drift = phase.guard_slope(t, y, number)
        n = 2 * phase.n_q
        rate = gradient[:n] @ rates[:n] + drift
        shift = -phase.guards(t, y)[number] / rate if rate else 0.0
        return (t + shift, y + shift * rates) if abs(shift) <= LARGEST_SHIFT * (1 + t) else (t, y)

    def _find_jam(
        self, is_well_posed: Callable[[Array], bool], dense: DenseOutput, span: tuple[float, float]
    ) -> LocatedGuard | None:
        """Return the time in a span from which the forces are not determined, by bisection, or None."""
        begin, end = span
        if is_well_posed(dense(end)):
            return None
        while end - begin > RESOLUTION * max(1.0, abs(end)):
            middle = (begin + end) / 2
            begin, end = (middle, end) if is_well_posed(dense(middle)) else (begin, middle)
        return LocatedGuard(JAMS, end)

    def _locate(
        self, i: int, guard: functools.partial[float], span: tuple[float, float], values: tuple[float, float, float]
    ) -> float | None:
        """Return the time at which a guard falls through zero in a span, or None."""
        begin, zero, middle_time = span[0], self._zero[i], (span[0] + span[1]) / 2
        _, middle, end = values
        if not self._armed[i]:
            if middle <= zero and end <= zero:
                return None if self._passed[i] or min(middle, end) >= -zero else _find_fall(guard, span, zero)
            self._armed[i], self._passed[i] = True, False
            if middle > zero >= end:
                begin = middle_time
            elif end > zero:
                return None
        until = span[1] if end <= 0 else find_dip(guard, span, values)
        return None if until is None else find_root(guard, (begin, until))

    def _value(self, dense: DenseOutput, i: int, t: float) -> float:
        return float(self._phase.guards(t, dense(t))[i])

    def _is_armed(self, contact: int, y: Array) -> bool:
        n = self._phase.n_q
        return bool(self._arming(y[:n], y[n : 2 * n])[0][contact] > 0)


def _find_fall(guard: Callable[[float], float], span: tuple[float, float], zero: float) -> float:
    """Return the time at which a guard that starts at zero and ends negative falls through zero.

    It is the start of the span unless the guard rises above zero first: a contact opens and closes again soon.
    """
    negative = positive = span[1]
    for _ in range(MAX_HALVINGS):
        positive = (span[0] + positive) / 2
        value = guard(positive)
        if value > 0:
            return find_root(guard, (positive, negative))
        if value < 0:
            negative = positive
    return span[0]


def _tolerance(kind: GuardKind, weight: float) -> float:
    """Return the value below which a guard counts as zero."""
    if kind.name == "closes":
        return OPENING_GAP
    return ZERO * weight if kind.name in ("opens", "slips+", "slips-") else ZERO
