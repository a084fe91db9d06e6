"""Walks from random starts: states after the touchdown of random motions."""

from collections.abc import Iterator

import numpy as np

from gaitopt.interrupts import defer_interrupt
from gaitopt.model.contacts.impact import TouchdownMap
from gaitopt.model.coordinate_entries import GAP, SLIDE
from gaitopt.model.fast_call import FastCall
from gaitopt.model.section_coordinate import undo_exchange
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.section import Section
from gaitopt.stability.section_walk import SectionWalk, natural_rate, take_walk

DRAWS_PER_START = 40
"""Largest number of random states drawn for each start."""


def random_walks(walker: Walker, section: Section, count: int, steps: int, seed: int) -> Iterator[SectionWalk]:
    """Yield walks of at least one step from random starts.

    A start is the state after a touchdown in a random pose with random rates, so that its angles, rates and foot speed
    are consistent with the impact, as in every gait.  Before every other touchdown the trailing foot slips.

    Parameters
    ----------
    walker : Walker
    section : Section
    count : int
        Number of walks; at most `DRAWS_PER_START` states are drawn for each.
    steps : int
        Largest number of steps.
    seed : int
    """
    sampler, rng = _TouchdownSampler(walker, section), np.random.default_rng(seed)
    samples = (rng.uniform(-1, 1, sampler.size) for _ in range(DRAWS_PER_START * count))
    states = (sampler.state_after(sample, at_rest=i % 2 == 0) for i, sample in enumerate(samples))
    walks = (take_walk(walker, section, section.project(state), steps) for state in states if state is not None)
    complete = (walk for walk in walks if len(walk.points) > 1)
    for _ in range(count):
        with defer_interrupt():
            walk = next(complete, None)
        if walk is None:
            return
        yield walk


class _TouchdownSampler:
    """States after a touchdown as a function of numbers between -1 and 1.

    Parameters
    ----------
    walker : Walker
    section : Section

    Attributes
    ----------
    size : int
        Length of a sample: one number for each angle but one, for each rate, and for the speed of the trailing foot.
    """

    def __init__(self, walker: Walker, section: Section) -> None:
        robot, p, self._section = walker.robot, walker.p, section
        entries, self.size = robot.state_entries, 2 * len(robot.angles)
        self._n_q, self._free, self._z = robot.n_q, len(robot.angles) - 1, np.zeros(len(section.names))
        self._angles, self._rates = list(entries.angles), list(entries.rates)
        self._slip_velocity = entries.slip_velocity
        self._before = FastCall(undo_exchange(robot), p)
        self._collision, self._momentum = FastCall(robot.collision, p), FastCall(robot.momentum, p)
        self._touchdown, self._natural = TouchdownMap(robot, p), natural_rate(robot, p)

    def state_after(self, sample: Array, *, at_rest: bool) -> Array | None:
        """Return the state (q, v) after the touchdown and leg exchange, shape (2 n_q,).

        It is None if the impact is invalid, or if the centre of mass moves backward after the impact.

        Small steps are slow: rates are up to three times the angle determined by the touchdown condition over the
        natural time sqrt(l / g), so that pendulum-like motions of every size are sampled equally.

        Parameters
        ----------
        sample : (size,) array
        at_rest : bool
            Whether the trailing foot is at rest before the touchdown.
        """
        section, (natural, height) = self._section, self._natural
        state, free = np.zeros(2 * self._n_q), self._free
        self._z[:free] = 0.24 * sample[:free] - 0.26
        pose = section.embed(self._z)
        size = 3 * natural * abs(pose[section.dependent_entry])
        state[self._angles] = self._before.evaluate_packed(pose[self._angles])
        state[self._rates] = size * sample[free:-1]
        if section.sliding and not at_rest:
            state[self._slip_velocity] = size * height * sample[-1]
        if self._collision.evaluate_packed(state)[GAP] > 0:
            state[self._n_q :] *= -1  # the front foot moves down
        following = self._touchdown.solve(state)[1]
        if following is None:
            return None
        return following if self._momentum.evaluate_packed(following)[SLIDE] > 0 else None
