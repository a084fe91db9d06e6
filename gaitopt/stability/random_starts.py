"""Walks from random starts: states after the touchdown of random motions."""

from collections.abc import Iterator

import numpy as np

from gaitopt.interrupts import defer_interrupt
from gaitopt.model.contacts.impact import TouchdownMap
from gaitopt.model.coordinate_entries import SLIDE
from gaitopt.model.fast_call import FastCall
from gaitopt.model.touchdown_state import state_before_touchdown
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.fall_prediction import FallPrediction
from gaitopt.stability.section import Section
from gaitopt.stability.section_walk import SectionWalk, natural_rate, take_walk

DRAWS_PER_START = 40
"""Largest number of random states drawn for each start."""


def random_walks(
    walker: Walker, section: Section, count: int, steps: int, seed: int, prediction: FallPrediction | None = None
) -> Iterator[SectionWalk]:
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
    prediction : FallPrediction, optional
        If given, the states it excludes are not simulated.
    """
    sampler, rng = _TouchdownSampler(walker, section), np.random.default_rng(seed)
    # One call of the generator for all samples of a start is several times faster than one for each.
    samples = (sample for _ in range(count) for sample in rng.uniform(-1, 1, (DRAWS_PER_START, sampler.size)))
    states = (sampler.state_after(sample, at_rest=i % 2 == 0) for i, sample in enumerate(samples))
    promising = (
        state for state in states if state is not None and not (prediction is not None and prediction.excludes(state))
    )
    walks = (take_walk(walker, section, section.project(state), steps) for state in promising)
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
        robot, p, (natural, height) = walker.robot, walker.p, natural_rate(walker.robot, walker.p)
        self.size, self._sliding, self._free = 2 * len(robot.angles), section.sliding, len(robot.angles) - 1
        self._numbers = np.zeros(self.size)
        scales = 3 * natural * np.array([1.0, height])
        self._before = FastCall(state_before_touchdown(robot), scales, p, shared=self._numbers)
        self._touchdown, self._momentum = TouchdownMap(robot, p), FastCall(robot.momentum, p)

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
        self._numbers[:] = sample
        self._numbers[: self._free] = 0.24 * sample[: self._free] - 0.26
        if at_rest or not self._sliding:
            self._numbers[-1] = 0.0
        following = self._touchdown.solve(self._before.evaluate())[1]
        if following is None:
            return None
        return following if self._momentum.evaluate_packed(following)[SLIDE] > 0 else None
