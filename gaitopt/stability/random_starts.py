"""Walks from random starts: states after the touchdown of random motions."""

import functools
from collections.abc import Iterator

import casadi as ca
import numpy as np

from gaitopt.interrupts import defer_interrupt
from gaitopt.model.contacts.impact import TouchdownMap
from gaitopt.model.coordinate_entries import GAP, SLIDE
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.model.section_coordinate import dependent_coordinate, undo_exchange
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.section import Section, dependent_angle
from gaitopt.stability.section_walk import SectionWalk, natural_rate, take_walk

DRAWS_PER_START = 40
"""Largest number of random states drawn for each start."""
SMALLEST_ENERGY = 0.6
"""Kinetic energy of the centre of mass, relative to that of an inverted pendulum which just reaches the upright pose,
below which a passive walker is taken to fall backward.  It was at least 0.78 in 712 completed steps of seven walkers.
"""


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
        robot, p = walker.robot, walker.p
        self.size, self._sliding = 2 * len(robot.angles), section.sliding
        self._numbers = np.zeros(self.size + 1)
        self._before = FastCall(_state_before_touchdown(robot), natural_rate(robot, p), p, shared=self._numbers)
        self._touchdown, self._advance = TouchdownMap(robot, p), FastCall(_advance(robot), p)
        # A law may lift a walker that would fall backward without torques.
        self._passive = walker.law.control.call(walker.law.control.sx_in())[0].is_zero()

    def state_after(self, sample: Array, *, at_rest: bool) -> Array | None:
        """Return the state (q, v) after the touchdown and leg exchange, shape (2 n_q,).

        It is None if the impact is invalid, or if the centre of mass moves backward after the impact or, without
        torques, too slowly to move over the foot.

        Parameters
        ----------
        sample : (size,) array
        at_rest : bool
            Whether the trailing foot is at rest before the touchdown.
        """
        self._numbers[:-1], self._numbers[-1] = sample, self._sliding and not at_rest
        following = self._touchdown.solve(self._before.evaluate())[1]
        if following is None:
            return None
        momentum, energy = self._advance.evaluate_packed(following).tolist()
        return following if momentum > 0 and (energy > 0 or not self._passive) else None


@functools.lru_cache(maxsize=64)
def _state_before_touchdown(robot: Robot) -> ca.Function:
    """Return (sample and whether the foot slides, natural rate and height, p) -> state (q, v) before a touchdown.

    Small steps are slow: rates are up to three times the angle determined by the touchdown condition over the natural
    time sqrt(l / g), so that pendulum-like motions of every size are sampled equally.
    """
    count, numbers = len(robot.angles), ca.SX.sym("numbers", 2 * len(robot.angles) + 1)
    natural, p = ca.SX.sym("natural", 2), ca.SX.sym("p", len(robot.parameters))
    free, rates, speed, slides = ca.vertsplit(numbers, [0, count - 1, 2 * count - 1, 2 * count, 2 * count + 1])
    others = 0.24 * free - 0.26
    dependent = dependent_angle(robot)(others, p)
    angles = ca.vertsplit(others)
    angles.insert(dependent_coordinate(robot), dependent)
    size = 3 * natural[0] * ca.fabs(dependent)
    q = ca.vertcat(0, 0, undo_exchange(robot)(ca.vertcat(*angles), p))
    v = ca.vertcat(slides * size * natural[1] * speed, 0, size * rates)
    falling = ca.if_else(robot.landing(q, v, p)[1][GAP] > 0, -v, v)  # the front foot moves down
    return ca.Function("state_before_touchdown", [numbers, natural, p], [ca.vertcat(q, falling)])


@functools.lru_cache(maxsize=64)
def _advance(robot: Robot) -> ca.Function:
    """Return (q, v, p) -> (2) forward momentum [kg m/s], and kinetic energy in excess of the smallest one [J].

    A rigid body on a foot with a rim rotates about the centre of the rim, about which its centre of mass must rise.
    """
    q, v, p = ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q), ca.SX.sym("p", len(robot.parameters))
    slope, mass = robot.index("slope"), robot.mass(p)
    momentum, rim = robot.momentum(q, v, p)[0], robot.rims(q, p)[:2, 0]

    def offset(angle: ca.SX) -> ca.SX:
        """Return the weight times the height of the centre of mass over that of the rim, on ground with a slope."""
        inclined = ca.SX(p)
        inclined[slope] = angle
        potential = robot.energy(q, v, inclined)[1] - robot.force_powers(q, v, inclined)[0]
        height = rim[GAP] * ca.cos(angle) - rim[SLIDE] * ca.sin(angle)
        return potential - mass * p[robot.index("gravity")] * height

    above, ahead = offset(p[slope]), offset(p[slope] - ca.pi / 2)
    rise = ca.if_else(ahead < 0, ca.hypot(above, ahead) - above, 0)
    energy = ca.sumsqr(momentum) / (2 * mass) - SMALLEST_ENERGY * rise
    return ca.Function("advance", [q, v, p], [ca.vertcat(momentum[SLIDE], energy)])
