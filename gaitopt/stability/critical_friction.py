"""The friction a sticking gait needs."""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize_scalar

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.return_map import Passage


@dataclass(frozen=True)
class CriticalFriction:
    """The largest ratio of tangential to normal force over a gait that never slips.

    Attributes
    ----------
    friction : float
        Largest abs(f_t) / f_n over the steps: with less friction the foot slips.
    time : float [s]
        When in its step.
    state : (2 n_q,) array
        (q, v) there.
    impact : float
        Largest abs(L_t) / L_n of the touchdowns: with less friction the impact slips.

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
    """Return the friction a gait that never slips needs.

    The maximum is found among samples of each step and refined by integrating to the instants a bounded search tries.

    Parameters
    ----------
    walker : Walker
    passage : Passage
        Steps that stick throughout.
    samples : int
        Instants per step among which the maximum is looked for.
    """
    n, force = walker.robot.n_q, walker.robot.acceleration[Mode.STICK]
    best: tuple[float, float, Array] = (-1.0, 0.0, passage.states[0])
    for state, stride in zip(passage.states, passage.strides, strict=True):
        end = stride.duration

        def at(t: float, state: Array = state) -> tuple[float, Array]:
            y = walker.begin(state)
            if t > 0:
                arc = walker.engine.flow(walker.robot, walker.law, Mode.STICK, 0.0, y, walker.p, until=t)
                y = arc.states[:, -1]
            torque = walker.torque(Mode.STICK, t, y)
            tangential, normal = np.asarray(force(y[:n], y[n : 2 * n], torque, walker.p)[1]).ravel()
            return float(abs(tangential) / normal), y[: 2 * n]

        times = np.linspace(0, end, samples + 1)
        ratios = [at(t)[0] for t in times]
        k = int(np.argmax(ratios))
        found = minimize_scalar(
            lambda t, at=at: -at(t)[0],
            bounds=(times[max(k - 1, 0)], times[min(k + 1, samples)]),
            method="bounded",
            options={"xatol": 1e-12},
        )
        for t in (times[k], float(found.x)):
            ratio, y = at(t)
            if ratio > best[0]:
                best = (ratio, float(t), y)
    impacts = [abs(s.impact.impulse[0] / s.impact.impulse[1]) for s in passage.strides if s.impact is not None]
    return CriticalFriction(best[0], best[1], best[2], float(max(impacts)))
