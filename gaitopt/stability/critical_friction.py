"""Critical friction of gaits that do not slip."""

import math

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.reductions import worst
from gaitopt.simulation.engine import Arc
from gaitopt.simulation.hybrid_automaton import Walker
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
        Largest abs(Lambda_t) / Lambda_n of the touchdowns: with lower friction the impact slips.

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


def describe_critical_friction(critical: CriticalFriction | None, sequence: str) -> str:
    """Return the lowest friction without slipping of a gait as text for a table.

    Examples
    --------
    >>> describe_critical_friction(None, "slip+ stick | slip+"), describe_critical_friction(None, "sole closed |")
    ('none (the gait slips)', 'no friction')
    >>> describe_critical_friction(CriticalFriction(0.236, 0.1, np.zeros(4), 0.8), "stick | stick")
    '0.8 (impact)'
    """
    if critical is None:
        return "none (the gait slips)" if "slip+" in sequence or "slip-" in sequence else "no friction"
    return f"{critical.impact:.6g} (impact)" if critical.impact > critical.friction else f"{critical.friction:.6g}"


def critical_friction(walker: Walker, passage: Passage) -> CriticalFriction:
    """Return the critical friction of a gait that never slips.

    The maximum is found among the samples of one recorded arc per step, and refined by integrating from the sample
    before it to the instants a bounded search tries.

    Parameters
    ----------
    walker : Walker
    passage : Passage
        Steps that stick throughout.
    """
    n = walker.robot.n_q
    peaks = [_find_peak(walker, arc) for walk_step in passage.walk_steps for _, arc in walk_step.arcs]
    ratio, time, y = max(peaks, key=lambda peak: peak[0])
    impacts = [abs(s.impact.impulse[0] / s.impact.impulse[1]) for s in passage.walk_steps if s.impact is not None]
    return CriticalFriction(ratio, time, y[: 2 * n], worst(*impacts))


def _find_peak(walker: Walker, arc: Arc) -> tuple[float, float, Array]:
    """Return the largest force ratio of an arc, its time [s] and the state there; it is infinite without contact."""
    n, force = walker.robot.n_q, FastCall(walker.robot.acceleration[Mode.STICK], walker.p)

    def flow(clock: float, y: Array, until: float, record: bool = False) -> Arc:
        return walker.engine.flow(walker.loop, Mode.STICK, clock, y, until=until, record=record)

    def ratio(t: float, y: Array) -> float:
        torque = walker.torque(Mode.STICK, t, y)
        tangential, normal = force(y[:n], y[n : 2 * n], torque)[1]
        return float(abs(tangential) / normal) if normal > 0 else math.inf

    sampled = flow(arc.time.item(0), arc.states[:, 0], arc.time.item(-1), record=True)
    times, states = sampled.time, sampled.states.T
    ratios = np.array([ratio(t, y) for t, y in zip(times, states, strict=True)])
    k, last = int(np.argmax(ratios)), times.size - 1
    before, after = max(k - 1, 0), min(k + 1, last)
    best = float(ratios[k]), float(times[k]), states[k]
    if not math.isfinite(best[0]) or times[after] <= times[before]:
        return best

    def state_at(t: float) -> Array:
        return states[before] if t <= times[before] else flow(times[before], states[before], t).states[:, -1]

    from scipy.optimize import minimize_scalar  # whose import takes longer than a search for gaits

    span = {"bounds": (times[before], times[after]), "method": "bounded", "options": {"xatol": 1e-12}}
    t = float(minimize_scalar(lambda t: -ratio(t, state_at(t)), **span).x)
    y = state_at(t)
    return max(best, (ratio(t, y), t, y), key=lambda peak: peak[0])
