"""The reference engine: scipy's DOP853 with guards located on its dense output."""

import functools
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.integrate import DOP853
from scipy.optimize import brentq

from gaitopt.control.law import Law
from gaitopt.model.modes import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.closed_loop import Numeric, closed_loop, guard_names


@dataclass(frozen=True, eq=False)
class Arc:
    """A smooth stretch of simulated motion.

    Attributes
    ----------
    time : (K,) array [s]
        Clock since the start of the step.
    states : (2 n_q + n_u + 1, K) array
    torque : (n_u, K) array [N m]
    event : str or None
        Name of the guard that ended it; None at the time limit.
    """

    time: Array
    states: Array
    torque: Array
    event: str | None


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

    relative: float = 1e-11
    absolute: float = 1e-13
    samples: int = 4
    name = "scipy"

    def flow(self, robot: Robot, law: Law, mode: Mode, clock: float, state: Array, p: Array, *, until: float) -> Arc:
        """Integrate one contact mode until a guard falls through zero, or the clock reaches `until`.

        Parameters
        ----------
        clock : float [s]
            Time since the start of the step.
        state : (2 n_q + n_u + 1,) array
            q, v, works, friction loss.
        p : (n_p,) array
        """
        flow, guards = closed_loop(robot, mode, law.torque)
        times, states, torques = [clock], [state], [_torque(robot, law, clock, state)]
        hint = None
        while clock < until:
            piece = law.piece(clock)
            last = piece + 1 >= law.breakpoints.size
            end = until if last else min(until, law.breakpoints[piece + 1])
            data = law.table[:, piece]
            rhs, watch = Numeric(flow, p, data), Numeric(guards, p, data)
            integrator = DOP853(
                lambda t, y, rhs=rhs: rhs(t, y)[0].copy(),
                clock,
                state,
                end,
                rtol=self.relative,
                atol=self.absolute,
                first_step=min(hint, end - clock) if hint else None,
            )
            before = watch(clock, state)[0].copy()
            while integrator.status == "running":
                integrator.step()
                dense = integrator.dense_output()
                grid = np.linspace(integrator.t_old, integrator.t, self.samples + 1)[1:]
                for t in grid:
                    y = dense(t) if t < integrator.t else integrator.y
                    now = watch(t, y)[0].copy()
                    name, at = _first_event(mode, watch, dense, (times[-1], t), before, now)
                    if name is not None:
                        times.append(at)
                        states.append(dense(at) if at > integrator.t_old else states[-1])
                        torques.append(_torque(robot, law, at, states[-1], piece))
                        return Arc(np.array(times), np.array(states).T, np.array(torques).T, name)
                    before = now
                    times.append(t)
                    states.append(y.copy())
                    torques.append(_torque(robot, law, t, y, piece))
                hint = integrator.step_size
            clock, state = end, states[-1]
        return Arc(np.array(times), np.array(states).T, np.array(torques).T, None)


def _torque(robot: Robot, law: Law, clock: float, state: Array, piece: int | None = None) -> Array:
    n = robot.n_q
    data = law.table[:, law.piece(clock) if piece is None else piece]
    return np.asarray(law.torque(clock, state[:n], state[n : 2 * n], data)).ravel()


def _first_event(
    mode: Mode, watch: Numeric, dense: Callable[[float], Array], span: tuple[float, float], before: Array, now: Array
) -> tuple[str | None, float]:
    """Return the first guard that falls through zero in a time span, given its values at both ends, and when.

    A guard that starts at zero (a slide from rest, a force released exactly on the cone) is no event unless it is
    negative at the next sample: then the mode was left at once.
    """
    found: list[tuple[float, int, str]] = []
    for i, name in enumerate(guard_names(mode)):
        if now[i] > 0 or (before[i] <= 0 and now[i] == 0):
            continue
        if before[i] <= 0:
            # A touchdown guard starts at zero by definition (both feet on the ground) and counts only once armed.
            if name not in ("touchdown", "painleve"):
                found.append((span[0], i, name))
            continue
        at = _root(functools.partial(_value, watch, dense, i), span)
        if name == "touchdown" and watch(at, dense(at))[1][0] <= 0:
            continue
        found.append((at, i, name))
    if not found:
        return None, span[1]
    at, _, name = min(found)
    return name, at


def _value(watch: Numeric, dense: Callable[[float], Array], i: int, t: float) -> float:
    return float(watch(t, dense(t))[0][i])


def _root(guard: Callable[[float], float], span: tuple[float, float]) -> float:
    """Return where a guard falls through zero in a span; an end where rounding hides the change of sign is a root."""
    if guard(span[0]) <= 0:
        return span[0]
    if guard(span[1]) >= 0:
        return span[1]
    return float(brentq(guard, *span, xtol=1e-15, rtol=1e-15))
