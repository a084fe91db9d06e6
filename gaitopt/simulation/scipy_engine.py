"""The reference engine: scipy's DOP853 with guards located on its dense output."""

import functools
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import casadi as ca
import numpy as np
from scipy.integrate import DOP853, DenseOutput
from scipy.optimize import brentq, minimize_scalar

from gaitopt.control.law import Law
from gaitopt.model.buffered import Buffered
from gaitopt.model.modes import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.arc import Arc
from gaitopt.simulation.closed_loop import ClosedLoop, closed_loop

AT_ONCE = 1e-4
"""Part of a span after which the sign of a guard that starts at zero is looked at."""

ROUNDING = 1e-9
"""Guards that start below zero by less than this (N, m/s, rad) are on the edge, not beyond it."""


@dataclass(frozen=True, kw_only=True)
class ScipyEngine:
    """Event-driven integration by DOP853 (order 8), guards watched inside every integrator step.

    Attributes
    ----------
    relative, absolute : float
        Integration tolerances.
    samples : int
        Points per integrator step at which guards are checked and the motion is sampled.

    Examples
    --------
    >>> ScipyEngine().name
    'scipy'
    """

    relative: float = 1e-12
    absolute: float = 1e-14
    samples: int = 4
    name = "scipy"

    def flow(
        self,
        robot: Robot,
        law: Law,
        mode: Mode,
        clock: float,
        state: Array,
        p: Array,
        *,
        until: float,
        record: bool = False,
    ) -> Arc:
        """Integrate one contact mode; see :class:`gaitopt.simulation.arc.Engine`."""
        loop = closed_loop(robot, mode, law.torque)
        n_y = loop.size
        start = np.concatenate([state, np.zeros(robot.n_u + 1)]) if record else np.array(state, dtype=float)
        times, states, event = [clock], [start], None
        for piece, begin, end in pieces(law, clock, until):
            data = law.table[:, piece]
            watch = Buffered(loop.guards, p, data)
            rates = [Buffered(f, p, data) for f in ((loop.flow, loop.energy) if record else (loop.flow,))]
            before = watch(begin, states[-1][:n_y])[0].copy()
            for dense, span in self._spans(rates, n_y, begin, end, states[-1]):
                y = dense(span[1])
                now = watch(span[1], y[:n_y])[0].copy()
                event, at = _first_event(loop, watch, dense, n_y, span, before, now)
                times.append(at)
                states.append(y if at == span[1] else dense(at) if at > span[0] else states[-1])
                before = now
                if event is not None:
                    break
            if event is None and times[-1] < end:
                event = "singular"  # the integrator gave up
            if event is not None:
                break
        time, path = np.array(times), np.array(states).T
        if not record:
            return Arc(time[[0, -1]], path[:, [0, -1]], event)
        return Arc(time, path[:n_y], event, path[n_y:])

    def sensitivity(
        self, robot: Robot, law: Law, mode: Mode, clock: float, state: Array, p: Array, *, until: float
    ) -> Array:
        """Integrate the variational equations along the very path that :meth:`flow` follows.

        Where a motion creeps, its derivative grows so large that a path of other steps, within the tolerance of this
        one, would not do.  See :class:`gaitopt.simulation.arc.Engine`.
        """
        loop = closed_loop(robot, mode, law.torque)
        n_y, y, matrix = loop.size, np.array(state, dtype=float), np.eye(loop.size)
        for piece, begin, end in pieces(law, clock, until):
            data, reached = law.table[:, piece], begin
            slope = Buffered(_slope(loop.flow), p, data)
            for dense in self._steps([Buffered(loop.flow, p, data)], n_y, begin, end, y):
                matrix = self._varied(slope, dense, matrix)
                reached, y = dense.t, dense(dense.t)
                if not np.all(np.isfinite(matrix)):
                    return matrix
            if reached < end:
                return np.full((n_y, n_y), np.nan)
        return matrix

    def _varied(self, slope: Buffered, dense: DenseOutput, matrix: Array) -> Array:
        """Return a solution of the variational equations at the end of a step of the path; nan if there is none."""
        shape = matrix.shape

        def rate(t: float, flat: Array) -> Array:
            return (slope(t, dense(t))[0].reshape(shape).T @ flat.reshape(shape)).ravel()  # CasADi stores by column

        begin, end, options = dense.t_old, dense.t, {"rtol": self.relative, "atol": self.absolute}
        integrator = DOP853(rate, begin, matrix.ravel(), end, first_step=end - begin, **options)
        while integrator.status == "running":
            integrator.step()
        return integrator.y.reshape(shape) if integrator.status == "finished" else np.full(shape, np.nan)

    def _spans(
        self, rates: list[Buffered], n_y: int, begin: float, end: float, start: Array
    ) -> Iterator[tuple[DenseOutput, tuple[float, float]]]:
        """Yield the dense output of the integrator with each of the short spans its steps are divided into."""
        for dense in self._steps(rates, n_y, begin, end, start):
            for span in itertools.pairwise(np.linspace(dense.t_old, dense.t, self.samples + 1)):
                yield dense, span

    def _steps(self, rates: list[Buffered], n_y: int, begin: float, end: float, start: Array) -> Iterator[DenseOutput]:
        """Yield the dense output of each step of the integrator; it ends early where the integrator cannot go on."""

        def rate(t: float, y: Array) -> Array:
            return np.concatenate([function(t, y[:n_y])[0] for function in rates])

        if not np.all(np.isfinite(rate(begin, start))):
            return
        integrator = DOP853(rate, begin, start, end, rtol=self.relative, atol=self.absolute)
        while integrator.status == "running":
            integrator.step()
            if integrator.status == "failed":
                return
            yield integrator.dense_output()


@functools.lru_cache(maxsize=128)
def _slope(flow: ca.Function) -> ca.Function:
    """Return (t, y, p, data) -> derivative of a flow by y."""
    t, y, p, data = flow.sx_in()
    return ca.Function("slope", [t, y, p, data], [ca.densify(ca.jacobian(flow(t, y, p, data), y))])


def pieces(law: Law, clock: float, until: float) -> Iterator[tuple[int, float, float]]:
    """Yield (piece, begin, end) of the stretches of a law between two clock times."""
    while clock < until:
        piece = law.piece(clock)
        end = until if piece + 1 >= law.breakpoints.size else min(until, law.breakpoints[piece + 1])
        yield piece, clock, end
        clock = end


def _first_event(
    loop: ClosedLoop,
    watch: Buffered,
    dense: DenseOutput,
    n_y: int,
    span: tuple[float, float],
    before: Array,
    now: Array,
) -> tuple[str | None, float]:
    """Return the first guard that falls through zero in a time span, given its values at both ends, and when.

    A guard that starts at zero (a slide from rest, a force released exactly on the cone) is no event there unless it
    falls at once: then the mode was left at once.  One that starts below zero is an event at the start.
    """
    found: list[tuple[float, int, str]] = []
    middle = watch((span[0] + span[1]) / 2, dense((span[0] + span[1]) / 2)[:n_y])[0].copy()
    for i, name in enumerate(loop.guard_names):
        guard = functools.partial(_value, watch, dense, n_y, i)
        begin, end = span[0], span[1] if now[i] <= 0 else _dip(guard, span, (before[i], middle[i], now[i]))
        if before[i] <= 0:
            if name == "touchdown":
                # A touchdown guard starts at zero by definition (both feet on the ground) and counts only once armed.
                continue
            begin += AT_ONCE * (span[1] - span[0])
            if before[i] < -ROUNDING or (now[i] < 0 and guard(begin) <= 0):
                found.append((span[0], i, name))
                continue
            end = span[1] if now[i] < 0 else None
        if end is None:
            continue
        at = _root(guard, (begin, end))
        if name == "touchdown" and watch(at, dense(at)[:n_y])[1][0] <= 0:
            continue
        found.append((at, i, name))
    if not found:
        return None, span[1]
    at, _, name = min(found)
    return name, at


def _dip(
    guard: Callable[[float], float], span: tuple[float, float], values: tuple[float, float, float]
) -> float | None:
    """Return a time in a span at which a guard that is positive at both ends is negative, or None.

    The minimum is looked for only where the parabola through the ends and the middle comes near to zero inside.
    """
    left, middle, right = values
    bend, lean = 2 * (left - 2 * middle + right), right - left
    if bend <= abs(lean) or middle - lean**2 / (4 * bend) > 0.1 * max(left, right):
        return None
    found = minimize_scalar(guard, bounds=span, method="bounded", options={"xatol": 1e-9 * (span[1] - span[0])})
    return float(found.x) if found.fun < 0 else None


def _value(watch: Buffered, dense: DenseOutput, n_y: int, i: int, t: float) -> float:
    return float(watch(t, dense(t)[:n_y])[0][i])


def _root(guard: Callable[[float], float], span: tuple[float, float]) -> float:
    """Return where a guard falls through zero in a span; an end where rounding hides the change of sign is a root."""
    if guard(span[0]) <= 0:
        return span[0]
    if guard(span[1]) >= 0:
        return span[1]
    return float(brentq(guard, *span, xtol=1e-15, rtol=1e-15))
