"""Exact derivative of a simulated motion of a planar robot: variational flow and the jump at every event.

If a guard g falls through zero and the flow f changes to f' after a reset R of the state,

    dy+ = R' (dy + f dt) - f' dt,    dt = -(grad g . dy) / (grad g . f + g_t).

The motion ends on the section, where the clock is reset: dy+ = R' (dy + f dt).
"""

import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.contacts.transition import saltation
from gaitopt.model.planar.impact_system import impact_slope
from gaitopt.model.planar.phase_system import GuardKind
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_motion import PlanarEvent
from gaitopt.motion.stated_changes import CLOSES, find_closing
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_phase import PlanarPhase
from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout
from gaitopt.simulation.planar_simulation.planar_state import PlanarArc, PlanarState


def planar_derivative(automaton: PlanarAutomaton, rollout: PlanarRollout) -> Array:
    """Return d (state after the last event) / d (state, latched values at the beginning), shape (2 n_q, 2 n_q + n_l).

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
    n = 2 * automaton.robot.n_q
    matrix = np.eye(n + automaton.torque.n_latched)
    for k, (arc, event) in enumerate(zip(arcs, events, strict=True)):
        following = arcs[k + 1].start if k + 1 < len(arcs) else None
        matrix = _flow_derivative(automaton, arc) @ matrix
        matrix = event_derivative(automaton, arc, event, following) @ matrix
    return matrix[:n]


def _flow_derivative(automaton: PlanarAutomaton, arc: PlanarArc) -> Array:
    """Return the derivative of the flow of an arc at fixed times, with the changes of the law's piece."""
    phase, n = automaton.phase(arc.start), 2 * automaton.robot.n_q
    engine, last = automaton.engine, arc.time.size - 1
    if not arc.law_pieces:
        return engine.derivative(phase, (float(arc.time[0]), float(arc.time[last])), arc.states[:n, 0])
    matrix = np.eye(n + automaton.torque.n_latched)
    ends = [first for first, _ in arc.law_pieces[1:]]
    for k, ((first, piece), end) in enumerate(zip(arc.law_pieces, [*ends, last], strict=True)):
        if k:
            change = arc.law_pieces[k - 1][1], piece
            matrix = _piece_derivative(phase, float(arc.time[first]), arc.states[:, first], change) @ matrix
        phase.source.hold_number(piece)
        span = float(arc.time[first]), float(arc.time[end])
        if span[1] > span[0]:
            matrix = engine.derivative(phase, span, arc.states[:n, first]) @ matrix
    phase.source.hold_piece(None)
    return matrix


def _piece_derivative(phase: PlanarPhase, t: float, y: Array, pieces: tuple[int, int]) -> Array:
    """Return the jump of a deviation (q, v, latched) at a change of the law's piece, where the torque may jump."""
    n, rates = 2 * phase.n_q, list[Array]()
    rest = np.zeros(len(phase.source.latched))
    for piece in pieces:
        phase.source.hold_number(piece)
        rates.append(np.append(phase.rates(t, y)[:n], rest))
    before, after = rates
    identity, gradient = np.eye(n + rest.size), np.append(phase.source.phase_slope(*np.split(y[:n], 2)), rest)
    if np.array_equal(before, after):
        return identity
    return saltation(identity, before, after, -gradient / (gradient @ before))


def event_derivative(
    automaton: PlanarAutomaton, arc: PlanarArc, event: PlanarEvent, following: PlanarState | None
) -> Array:
    """Return the jump of a deviation (q, v, latched) at the event that ends an arc, shape (2 n_q + n_l, 2 n_q + n_l).

    Parameters
    ----------
    automaton : PlanarAutomaton
    arc : PlanarArc
    event : PlanarEvent
    following : PlanarState or None
        State after the event; None if the motion ends on the section.
    """
    n, n_l, phase = automaton.robot.n_q, automaton.torque.n_latched, automaton.phase(arc.start)
    t, y = float(arc.time[-1]), arc.states[: 2 * n, -1]
    before = np.append(phase.rates(t, arc.states[:, -1])[: 2 * n], np.zeros(n_l))
    if arc.ended_by is None:
        raise ValueError("an arc that ended at the time limit has no saltation")
    gradient, drift = phase.guard_slope(t, y, phase.equations.guards.index(_find_guard(phase, arc.ended_by, event)))
    reset = np.eye(2 * n + n_l)
    if event.outcome is not None:
        reset[n : 2 * n, : 2 * n] = _velocity_slope(automaton.robot, event, phase.p)
    shift = -gradient / (gradient @ before + drift)
    if following is None:
        return saltation(reset, before, np.zeros(2 * n + n_l), shift)
    after = automaton.phase(following)
    rates = after.rates(t, np.concatenate([following.y, np.zeros(after.n_works)]))[: 2 * n]
    return saltation(reset, before, np.append(rates, np.zeros(n_l)), shift)


def _velocity_slope(robot: PlanarRobot, event: PlanarEvent, p: Array) -> Array:
    """Return the derivative of the velocity after an impact with respect to (q, v) before it, shape (n_q, 2 n_q).

    It is the product of those of the impulses of actuators before the impact, of the impact, and of those after it.
    """
    stages, none = {stage.moment: stage for stage in event.actuator_impulses}, np.zeros(robot.n_u)
    before, after, v = stages.get("before"), stages.get("after"), event.v_minus
    instants = [] if before is None else [(before.outcome, before.impulse)]
    instants += [] if event.outcome is None else [(event.outcome, none)]
    instants += [] if after is None else [(after.outcome, after.impulse)]
    slope = np.eye(robot.n_q, 2 * robot.n_q, robot.n_q)
    for outcome, impulse in instants:
        v_plus, by_q, by_v = (np.array(part) for part in impact_slope(robot, outcome)(event.q, v, impulse, p))
        slope, v = by_v @ slope + np.hstack([by_q, np.zeros_like(by_v)]), v_plus.ravel()
    return slope


def _find_guard(phase: PlanarPhase, ended_by: GuardKind, event: PlanarEvent) -> GuardKind:
    """Return the guard that determines the time of an event: that of a closing contact if there is an impact.

    Another guard may reach zero at the same instant.
    """
    if event.outcome is None or ended_by.name == CLOSES:
        return ended_by
    names, closing = phase.robot.contact_names, find_closing(event.names)
    gaps = [kind for kind in phase.equations.guards if kind.name == CLOSES]
    return next((kind for kind in gaps if names[kind.number] in closing), ended_by)
