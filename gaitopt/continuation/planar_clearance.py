"""Clearance of the swinging feet of a planar robot: the lowest point of their path in the middle of a swing."""

from collections.abc import Iterator, Sequence

import numpy as np
from scipy.optimize import brentq

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.motion.motion import Array
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout
from gaitopt.simulation.planar_simulation.planar_state import PlanarArc


def lowest_clearance(automaton: PlanarAutomaton, rollouts: Sequence[PlanarRollout]) -> float | None:
    """Return the lowest gap at which a free contact with the ground turns from falling to rising, or None [m].

    It is positive if the foot clears the ground, negative if it swings through it, and zero where it scuffs.

    Parameters
    ----------
    automaton : PlanarAutomaton
    rollouts : sequence of PlanarRollout
        Periods of a gait.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> from gaitopt.simulation import simulate_planar
    >>> robot = monopod()
    >>> rollout = simulate_planar(robot, [0, 0.7, 0, 0, 0.6], [0, 0, 0, 0, 0], {}, until="foot closes")
    >>> lowest_clearance(PlanarAutomaton(robot, robot.resolve({})), [rollout]) is None
    True
    """
    ground = [i for i, contact in enumerate(automaton.robot.contacts) if not contact.is_stop and not contact.falls]
    gaps = [gap for rollout in rollouts for i in ground for gap in _lowest_gaps(automaton, rollout.arcs, i)]
    return min(gaps, default=None)


def _lowest_gaps(automaton: PlanarAutomaton, arcs: Sequence[PlanarArc], contact: int) -> Iterator[float]:
    """Yield the gaps at which a contact turns from falling to rising while it is free."""
    falling = False
    for arc in arcs:
        if arc.start.modes[contact] is not Mode.FREE:
            falling = False
            continue
        path = _GapPath(automaton, arc, contact)
        rates = [path.rate(y) for y in arc.states.T]
        if falling and rates[0] > 0:
            yield path.gap(arc.states[:, 0])  # an impact elsewhere turns the foot
        for k in range(len(rates) - 1):
            if rates[k] < 0 <= rates[k + 1]:
                yield path.lowest(k)
        falling = rates[-1] < 0


class _GapPath:
    """Gap of a contact during a phase."""

    def __init__(self, automaton: PlanarAutomaton, arc: PlanarArc, contact: int) -> None:
        p = automaton.p(arc.start.extended)
        self._arc, self._contact, self._n = arc, contact, automaton.robot.n_q
        self._phase = automaton.phase(arc.start)
        self._gaps, self._rows = FastCall(automaton.robot.gaps, p), FastCall(automaton.robot.rows, p)

    def gap(self, y: Array) -> float:
        """Return the gap in a state."""
        return float(self._gaps(y[: self._n])[0][self._contact])

    def rate(self, y: Array) -> float:
        """Return the rate of the gap in a state."""
        q, v = y[: self._n], y[self._n : 2 * self._n]
        return float(self._rows(q, v)[0].reshape(self._n, -1)[:, self._contact] @ v)

    def lowest(self, k: int) -> float:
        """Return the lowest gap between samples k and k + 1, of which the first falls and the second rises."""
        begin, end = (float(time) for time in self._arc.time[k : k + 2])
        y = np.array(self._arc.states[: 2 * self._n, k])
        time = brentq(lambda t: self.rate(self._phase.integrate(begin, y, t)), begin, end, xtol=1e-12)
        return self.gap(self._phase.integrate(begin, y, float(time)))
