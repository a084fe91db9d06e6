"""Walks of a robot with several contacts from a periodic gait after a push."""

from dataclasses import replace

import numpy as np

from gaitopt.errors import InputError
from gaitopt.motion.motion import Array
from gaitopt.reductions import worst
from gaitopt.simulation.planar_simulation.planar_state import PlanarState
from gaitopt.simulation.planar_simulation.planar_walker import PlanarWalker
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
from gaitopt.stability.planar_gaits.planar_section import section_of
from gaitopt.status import Stop


class PlanarPushedWalk:
    """Walks from a gait after a push, which changes the coordinates and rates on the section.

    The contacts that are closed at the beginning of the gait stay closed: a push moves no foot off the ground.

    Parameters
    ----------
    walker : PlanarWalker
    cycle : PlanarCycle

    Attributes
    ----------
    spread : (2 n_q, n_z) array
        See :class:`gaitopt.stability.pushed_walk.PushedWalk`.

    Raises
    ------
    InputError
        If the walker does not complete a step of the gait.
    """

    def __init__(self, walker: PlanarWalker, cycle: PlanarCycle) -> None:
        self._walker, self._start = walker, cycle.start
        walk_step = walker.walk_step(cycle.start)
        if walk_step.stop is not None:
            raise InputError(f"The walker does not complete a step of the gait: {walk_step.stop.hint}")
        self._section = section_of(walker.automaton, walk_step.rollout)
        weighted = compute_push_weights(walker, cycle)[:, None] * cycle.basis
        self.spread = cycle.basis @ np.linalg.inv(np.linalg.qr(weighted)[1])

    def begin(self, push: Array) -> PlanarState:
        """Return the state after a push, on the section."""
        y, n = self._section.correct(self._start.y + push), self._start.q.size
        return replace(self._start, q=y[:n], v=y[n:])

    def take_step(self, state: PlanarState) -> PlanarState | None:
        """Return the state after the next step and the exchange of the legs, or None."""
        return self._walker.walk_step(state).following

    def find_stop(self, state: PlanarState) -> Stop | None:
        """Return the reason why the next step is not completed, or None."""
        return self._walker.walk_step(state).stop

    def distance(self, state: PlanarState) -> float:
        """Return the largest difference from the gait, travel excluded."""
        return worst(np.abs(self._section.project(state.y - self._start.y)))


def compute_push_weights(walker: PlanarWalker, cycle: PlanarCycle) -> Array:
    """Return the weight of each coordinate and rate in the size of a push [rad/s], shape (2 n_q,).

    With w = sqrt(g / l), where l is the height of the highest drawn point at the start of the gait, the weights are w
    for an angle, 1 for its rate, w / l for a length, and 1 / l for its rate.
    """
    robot, p = walker.robot, walker.automaton.p(cycle.start.extended)
    height = float(np.max(np.asarray(robot.figure(cycle.start.q, p))[1]))
    natural = np.sqrt(walker.automaton.values["gravity"] / height)
    units = np.array([1.0 if unit == "rad" else 1 / height for unit in robot.units])
    return np.concatenate([natural * units, units])
