"""The linearised dynamics of a planar gait between its events, with the jumps of a deviation at each of them."""

import functools
from typing import NamedTuple

import numpy as np

from gaitopt.control.planar_laws.planar_feedback import planar_feedforward
from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.impact_system import contact_slopes
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_simulator import follow
from gaitopt.simulation.planar_simulation.planar_state import PlanarArc, PlanarState
from gaitopt.stability.planar_gaits.planar_assessment import assess_planar
from gaitopt.stability.planar_gaits.planar_linearisation import event_derivative
from gaitopt.stability.planar_gaits.planar_section import PlanarSection
from gaitopt.status import Stop
from gaitopt.tuning.riccati import LinearInterval

PERIODS = 1.5
"""Longest simulation of a period, in planned periods."""


class LinearPhase(NamedTuple):
    """A smooth phase of a gait in open loop.

    Attributes
    ----------
    part : int
        Number of impacts since the section.
    time : (K,) array [s]
        Samples; only one if the phase has no duration.
    intervals : list of K - 1 LinearInterval
        The jump of the last one contains the event that ends the phase.
    """

    part: int
    time: Array
    intervals: list[LinearInterval]


@functools.lru_cache(maxsize=4)
def linearise_planar(gait: PlanarGait) -> tuple[LinearPhase, ...]:
    """Return the linearised dynamics of a gait's period under its torques in open loop.

    A deviation is one of (q, v) that the closed contacts allow, without travel: each jump ends with its projection.

    Raises
    ------
    InputError
        If no periodic gait is found near the planned one in open loop.
    """
    law, n = planar_feedforward(gait), gait.robot.n_q
    cycle, automaton = assess_planar(gait, law), PlanarAutomaton(gait.robot, gait.motion.parameters, law)
    y = np.array([*cycle.state.values()])
    rollout = follow(automaton, automaton.begin(y[:n], y[n:]), duration=PERIODS * gait.period, until=law.section)
    if rollout.stop is not Stop.EVENT_REACHED or rollout.start is None:
        raise InputError(f"The period of the gait '{gait.sequence}' is not simulated in open loop: {rollout.stop.hint}")
    events, arcs = rollout.motion.events, rollout.arcs
    section = PlanarSection(automaton, arcs[-1], events[-1], gait.robot.mirror)
    phases, part, pending = list[LinearPhase](), 0, np.eye(2 * n)
    for k, (arc, event) in enumerate(zip(arcs, events, strict=True)):
        following = arcs[k + 1].start if k + 1 < len(arcs) else None
        jump = event_derivative(automaton, arc, event, following)[: 2 * n, : 2 * n]
        jump = section.matrix() @ jump if following is None else jump
        after = _projection(automaton, rollout.start if following is None else following, section.travel)
        intervals = _intervals(automaton, arc, section.travel)
        if intervals:
            intervals[-1] = _with_jump(intervals[-1], after @ jump @ intervals[-1].jump)
        elif phases:
            before = phases[-1].intervals[-1]
            phases[-1].intervals[-1] = _with_jump(before, after @ jump @ before.jump)
        else:
            pending = after @ jump @ pending
        if intervals:
            phases.append(LinearPhase(part, arc.time, intervals))
        part += event.is_impact
    last = phases[-1].intervals[-1]
    phases[-1].intervals[-1] = _with_jump(last, pending @ last.jump)
    return tuple(phases)


def _with_jump(interval: LinearInterval, jump: Array) -> LinearInterval:
    return LinearInterval(interval.duration, interval.a, interval.b, jump)


def _intervals(automaton: PlanarAutomaton, arc: PlanarArc, travel: int | None) -> list[LinearInterval]:
    """Return the linearised dynamics between the samples of an arc, evaluated at the midpoints."""
    phase, n, intervals = automaton.phase(arc.start), 2 * automaton.robot.n_q, []
    for k in np.flatnonzero(np.diff(arc.time) > 0):
        t, y = arc.time[k : k + 2].mean(), arc.states[:, k : k + 2].mean(axis=1)
        a, b = phase.slope(t, y)[0][:, :n], phase.torque_effect(t, y)
        end = PlanarState(t, arc.states[: n // 2, k + 1], arc.states[n // 2 : n, k + 1], arc.start.contacts)
        intervals.append(LinearInterval(float(np.diff(arc.time)[k]), a, b, _projection(automaton, end, travel)))
    return intervals


def _projection(automaton: PlanarAutomaton, state: PlanarState, travel: int | None) -> Array:
    """Return the projection of a deviation on those that the closed contacts of a state allow, without travel."""
    robot, p = automaton.robot, automaton.p(state.extended)
    gaps, normal, tangential = (np.array(part) for part in contact_slopes(robot)(state.q, state.v, p))
    sticking = [i for i, mode in enumerate(state.modes) if mode is Mode.STICK]
    rows = np.vstack([gaps[state.closed], normal[state.closed], tangential[sticking]])
    projection = np.eye(2 * robot.n_q)
    if rows.size:
        projection -= np.linalg.pinv(rows, rcond=1e-9) @ rows
    if travel is not None:
        projection[travel] = 0.0
    return projection
