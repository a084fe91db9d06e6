"""Critical friction of gaits that do not slip."""

import functools
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Stride, Walker
from gaitopt.stability.return_map import Passage


@dataclass(frozen=True)
class CriticalFriction:
    """The largest ratio of tangential to normal force over a gait that never slips.

    Attributes
    ----------
    friction : float
        Largest abs(f_t) / f_n over the steps: with lower friction the foot slips.
    time : float [s]
        Time of the maximum in its step.
    state : (2 n_q,) array
        State (q, v) at the maximum.
    impact : float
        Largest abs(L_t) / L_n of the touchdowns: with lower friction the impact slips.

    Examples
    --------
    >>> import math
    >>> from gaitopt import find_cycles, rimless_wheel
    >>> gait = find_cycles(rimless_wheel(), {"slope": math.radians(13)}, starts=10)[0]
    >>> round(gait.critical_friction.friction, 3)
    0.914
    """

    friction: float
    time: float
    state: Array
    impact: float


def critical_friction(walker: Walker, passage: Passage, *, samples: int = 60) -> CriticalFriction:
    """Return the critical friction of a gait that never slips.

    The maximum is located among samples of each step and refined by a bounded scalar minimisation.

    Parameters
    ----------
    walker : Walker
    passage : Passage
        Steps that stick throughout.
    samples : int
        Number of samples per step.
    """
    best: tuple[float, float, Array] = (-1.0, 0.0, passage.states[0])
    for stride in passage.strides:
        ratio_at = functools.partial(_force_ratio, walker, stride)
        times = np.linspace(0, stride.duration, samples + 1)
        k = int(np.argmax([ratio_at(t)[0] for t in times]))
        refined = minimize_scalar(
            lambda t, ratio_at=ratio_at: -ratio_at(t)[0],
            bounds=(times[max(k - 1, 0)], times[min(k + 1, samples)]),
            method="bounded",
            options={"xatol": 1e-12},
        )
        for t in (times[k], float(refined.x)):
            ratio, state = ratio_at(t)
            if ratio > best[0]:
                best = (ratio, float(t), state)
    impacts = [abs(s.impact.impulse[0] / s.impact.impulse[1]) for s in passage.strides if s.impact is not None]
    return CriticalFriction(best[0], best[1], best[2], float(max(impacts)))


def _force_ratio(walker: Walker, stride: Stride, t: float) -> tuple[float, Array]:
    """Return the force ratio abs(f_t) / f_n and the state (q, v) at a time of a step that sticks."""
    n = walker.robot.n_q
    started = [arc for _, arc in stride.arcs if arc.time[0] < t] or [
        stride.arcs[0][1]
    ]  # events of the law divide a step into arcs
    clock, y = started[-1].time.item(0), started[-1].states[:, 0]
    if t > clock:
        y = walker.engine.flow(walker.loop, Mode.STICK, clock, y, until=t).states[:, -1]
    force = walker.robot.acceleration[Mode.STICK](y[:n], y[n : 2 * n], walker.torque(Mode.STICK, t, y), walker.p)[1]
    tangential, normal = np.asarray(force).ravel()
    return float(abs(tangential) / normal), y[: 2 * n]
