"""Least kinetic energy along the steps of a walker."""

from collections.abc import Iterable

import numpy as np
import scipy  # which imports its parts when they are used

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.simulation.engine import Arc
from gaitopt.simulation.hybrid_automaton import Walker

TIME_TOLERANCE = 1e-9
"""Accuracy of the time of the apex relative to its bracket; the error of the energy is proportional to its square."""


def least_kinetic_energy(walker: Walker, states: Iterable[Array]) -> float:
    """Return the least kinetic energy of the joint rates, with the stance foot at rest, along some steps [J].

    Parameters
    ----------
    walker : Walker
    states : iterable of (2 n_q,) arrays
        State at the start of each step.
    """
    arcs = [pair for state in states for pair in walker.walk_step(state, record=True).arcs]
    return min(_least_along(walker, mode, arc) for mode, arc in arcs)


def _least_along(walker: Walker, mode: Mode, arc: Arc) -> float:
    """Return the least kinetic energy along a recorded arc [J]."""
    sampled = [_kinetic_energy(walker, y) for y in arc.states.T]
    k = int(np.argmin(sampled))
    first, last = max(k - 1, 0), min(k + 1, arc.time.size - 1)
    begin, until = float(arc.time[first]), float(arc.time[last])
    if not until > begin:
        return sampled[k]

    def energy_at(time: float) -> float:
        flow = walker.engine.flow(walker.loop, mode, begin, arc.states[:, first], until=time)
        return _kinetic_energy(walker, flow.states[:, -1])

    options = {"xatol": TIME_TOLERANCE * (until - begin)}
    least = scipy.optimize.minimize_scalar(energy_at, bounds=(begin, until), method="bounded", options=options)
    return min(sampled[k], float(least.fun))


def _kinetic_energy(walker: Walker, y: Array) -> float:
    n, rates = walker.robot.n_q, np.zeros(walker.robot.n_q)
    entries = [entry - n for entry in walker.robot.state_entries.rates]
    rates[entries] = y[n : 2 * n][entries]
    return float(walker.robot.energy(y[:n], rates, walker.p)[0])
