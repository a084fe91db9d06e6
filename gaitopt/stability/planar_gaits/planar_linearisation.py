"""Exact derivative of a simulated motion of a planar robot: variational flow and the jump at every event.

If a guard g falls through zero and the flow f changes to f' after a reset R of the state,

    dy+ = R' (dy + f dt) - f' dt,    dt = -(grad g . dy) / (grad g . f + g_t).

The motion ends on the section, where the clock is reset: dy+ = R' (dy + f dt).
"""

import numpy as np
from scipy.integrate import DOP853

from gaitopt.errors import InputError
from gaitopt.model.contacts.transition import saltation
from gaitopt.model.planar.impact_system import impact_slope
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_motion import PlanarEvent
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_phase import PlanarPhase
from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout
from gaitopt.simulation.planar_simulation.planar_state import PlanarArc, PlanarState

RELATIVE, ABSOLUTE = 1e-11, 1e-12
"""Tolerances of the integration of the variational equations."""


def planar_derivative(automaton: PlanarAutomaton, rollout: PlanarRollout) -> Array:
    """Return d (state after the last event) / d (state at the beginning), shape (2 n_q, 2 n_q).

    Parameters
    ----------
    automaton : PlanarAutomaton
    rollout : PlanarRollout
        A motion of this automaton that ends with an event.

    Raises
    ------
    InputError
        If the motion does not end with an event.
    """
    events, arcs = rollout.motion.events, rollout.arcs
    if not events or len(events) != len(arcs) or rollout.end is None:
        raise InputError(
            f"A motion has a derivative if it ends with an event; this one ended otherwise: {rollout.stop.hint}"
        )
    matrix = np.eye(2 * automaton.robot.n_q)
    for k, (arc, event) in enumerate(zip(arcs, events, strict=True)):
        following = arcs[k + 1].start if k + 1 < len(arcs) else None
        matrix = _flow_derivative(automaton.phase(arc.start), arc) @ matrix
        matrix = event_derivative(automaton, arc, event, following) @ matrix
    return matrix


def event_derivative(
    automaton: PlanarAutomaton, arc: PlanarArc, event: PlanarEvent, following: PlanarState | None
) -> Array:
    """Return the jump of a deviation at the event that ends an arc, shape (2 n_q, 2 n_q).

    Parameters
    ----------
    automaton : PlanarAutomaton
    arc : PlanarArc
    event : PlanarEvent
    following : PlanarState or None
        State after the event; None if the motion ends on the section.
    """
    n, phase = automaton.robot.n_q, automaton.phase(arc.start)
    t, y = float(arc.time[-1]), arc.states[: 2 * n, -1]
    before = phase.rates(t, arc.states[:, -1])[: 2 * n]
    if arc.ended_by is None:
        raise ValueError("an arc that ended at the time limit has no saltation")
    gradient, drift = phase.guard_slope(t, y, phase.equations.guards.index(arc.ended_by))
    reset = np.eye(2 * n)
    if event.outcome is not None:
        by_q, by_v = impact_slope(automaton.robot, event.outcome)(event.q, event.v_minus, phase.p)[1:]
        reset[n:] = np.hstack([np.array(by_q), np.array(by_v)])
    shift = -gradient / (gradient @ before + drift)
    if following is None:
        return saltation(reset, before, np.zeros(2 * n), shift)
    after = automaton.phase(following)
    rates = after.rates(t, np.concatenate([following.y, np.zeros(after.n_works)]))[: 2 * n]
    return saltation(reset, before, rates, shift)


def _flow_derivative(phase: PlanarPhase, arc: PlanarArc) -> Array:
    """Return d (state at the end of an arc) / d (state at its beginning) at fixed times."""
    n = 2 * phase.n_q
    if arc.time[-1] <= arc.time[0]:
        return np.eye(n)

    def rate(t: float, y: Array) -> Array:
        slope, _ = phase.slope(t, y[:n])
        return np.concatenate([phase.rates(t, y[:n])[:n], (slope @ y[n:].reshape(n, n)).ravel()])

    start = np.concatenate([arc.states[:n, 0], np.eye(n).ravel()])
    integrator = DOP853(rate, arc.time[0], start, arc.time[-1], rtol=RELATIVE, atol=ABSOLUTE)
    while integrator.status == "running":
        integrator.step()
    if integrator.status == "failed":
        return np.full((n, n), np.nan)
    derivative: Array = integrator.y[n:].reshape(n, n)
    return derivative
