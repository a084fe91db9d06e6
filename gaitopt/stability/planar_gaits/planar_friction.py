"""Critical friction of a planar robot's motion that does not slip."""

import math

import numpy as np
from scipy.optimize import minimize_scalar

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_motion import PlanarEvent
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_phase import PlanarPhase
from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout
from gaitopt.simulation.planar_simulation.planar_state import PlanarArc
from gaitopt.stability.critical_friction import CriticalFriction

LEAST_LOAD = 1e-6
"""Share of the weight below which a force counts as zero: at lift-off, rounding errors decide the ratio of forces."""


def planar_critical_friction(automaton: PlanarAutomaton, rollout: PlanarRollout) -> CriticalFriction | None:
    """Return the critical friction of a motion, or None if a contact slips or none sticks.

    The ratio is that of a body: the tangential over the normal force of its sticking contacts together.  Its maximum is
    found among the samples, and refined by integrating from the sample before it.  Where both forces vanish, as at
    lift-off, the ratio is left out.

    Parameters
    ----------
    automaton : PlanarAutomaton
    rollout : PlanarRollout
        A motion of this automaton.
    """
    modes = {mode for arc in rollout.arcs for mode in arc.start.modes}
    if Mode.STICK not in modes or any(mode.slips for mode in modes):
        return None
    sticking = [arc for arc in rollout.arcs if Mode.STICK in arc.start.modes]
    least = LEAST_LOAD * rollout.motion.total_mass * rollout.motion.parameters["gravity"]
    ratio, time, y = max((_find_peak(automaton, arc, least) for arc in sticking), key=lambda peak: peak[0])
    impacts = [impact_ratios(event) for event in rollout.motion.events if event.is_impact]
    impact = max((abs(value) for ratios in impacts for value in ratios.values()), default=0.0)
    return CriticalFriction(ratio, time, y[: 2 * automaton.robot.n_q], impact)


def impact_ratios(event: PlanarEvent) -> dict[str, float]:
    """Return the largest impulse ratio Lambda_t / Lambda_n of each contact with a normal impulse in any instant."""
    names = [name for name, _ in event.before.modes]
    ratios: dict[str, float] = {}
    for impulses in (event.impulse, *(stage.reaction for stage in event.actuator_impulses)):
        for name, (tangential, normal) in zip(names, impulses.tolist(), strict=True):
            if normal > 0:
                ratios[name] = max(tangential / normal, ratios.get(name, 0.0), key=abs)
    return ratios


def _find_peak(automaton: PlanarAutomaton, arc: PlanarArc, least: float) -> tuple[float, float, Array]:
    """Return the largest force ratio of an arc, its time [s] and the state there."""
    phase = automaton.phase(arc.start)
    ratios = [_ratio(phase, t, y, least) for t, y in zip(arc.time, arc.states.T, strict=True)]
    k, last, n = int(np.argmax(ratios)), arc.time.size - 1, 2 * automaton.robot.n_q
    before, after = max(k - 1, 0), min(k + 1, last)
    best = ratios[k], float(arc.time[k]), arc.states[:, k]
    if not math.isfinite(best[0]) or arc.time[after] <= arc.time[before]:
        return best
    start = arc.states[:n, before]

    def state_at(t: float) -> Array:
        return phase.integrate(float(arc.time[before]), start, t)

    span = {"bounds": (arc.time[before], arc.time[after]), "method": "bounded", "options": {"xatol": 1e-12}}
    t = float(minimize_scalar(lambda t: -_ratio(phase, t, state_at(t), least), **span).x)
    y = state_at(t)
    return max(best, (_ratio(phase, t, y, least), t, y), key=lambda peak: peak[0])


def _ratio(phase: PlanarPhase, t: float, y: Array, least: float) -> float:
    """Return the largest ratio of tangential to normal force of a sticking body.

    It is 0 for a body both forces of which are at most `least` [N], and infinite if only its normal force vanishes.
    """
    forces = phase.forces(t, y)
    totals = [forces[list(members)].sum(axis=0).tolist() for members in phase.equations.sticking]
    loaded = [(abs(tangential), normal) for tangential, normal in totals if max(abs(tangential), normal) > least]
    return max((tangential / normal if normal > 0 else math.inf for tangential, normal in loaded), default=0.0)
