"""Random starts of walks: states after the touchdown of random motions, from which the walker completes a step."""

import functools
import threading
from collections.abc import Iterator

import casadi as ca
import numpy as np

from gaitopt.interrupts import defer_interrupt
from gaitopt.model.contacts.impact import TouchdownMap
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot
from gaitopt.model.section_coordinate import angles_before_swap
from gaitopt.motion.motion import Array
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.section import Section

DRAWS_PER_START = 40
"""Largest number of random states drawn for each start."""


def random_starts(walker: Walker, section: Section, count: int, seed: int) -> Iterator[Array]:
    """Yield random points of a section from which the walker completes at least one step, shape (n_z,).

    A start is the state after the touchdown of a random pose at random rates, so that its angles, rates and foot speed
    agree with the impact, as those of every gait do.  The trailing foot moves before one touchdown of four.  At most `DRAWS_PER_START` states are drawn for each start.

    Parameters
    ----------
    walker : Walker
    section : Section
    count : int
    seed : int
    """
    sampler, rng, completed = _TouchdownSampler(walker, section), np.random.default_rng(seed), 0
    for i in range(DRAWS_PER_START * count):
        with defer_interrupt():
            following = sampler.state_after(rng.uniform(-1, 1, sampler.size), at_rest=i % 4 != 0)
            if following is None or walker.stride(following).following is None:
                continue
        yield section.project(following)
        completed += 1
        if completed == count:
            return


class _TouchdownSampler:
    """States after a touchdown as a function of numbers between -1 and 1.

    Parameters
    ----------
    walker : Walker
    section : Section

    Attributes
    ----------
    size : int
        Number of numbers: one for each angle but one, each rate, and the speed of the trailing foot.
    """

    def __init__(self, walker: Walker, section: Section) -> None:
        robot, p, self._section = walker.robot, walker.p, section
        self._n, self.size = robot.n_q, 2 * robot.n_q - 4
        self._before, self._collision = (
            _inverse_exchange(robot, p.tobytes(), threading.get_ident()),
            FastCall(robot.collision, p),
        )
        self._touchdown, self._natural = TouchdownMap(robot, p), natural_rate(robot, p)
        self._momentum = FastCall(robot.momentum, p)

    def state_after(self, sample: Array, *, at_rest: bool) -> Array | None:
        """Return the state (q, v) after the touchdown and leg exchange, shape (2 n_q,).

        None if the impact is invalid, or if the centre of mass moves backward after it.

        Small steps are slow: rates are up to three times the angle determined by the touchdown condition over the
        natural time sqrt(l / g), so that pendulum-like motions of every size are sampled equally.

        Parameters
        ----------
        sample : (size,) array
        at_rest : bool
            Whether the trailing foot is at rest before the touchdown.
        """
        n, section, (natural, height) = self._n, self._section, self._natural
        z = np.zeros(len(section.names))
        z[: n - 3] = 0.24 * sample[: n - 3] - 0.26
        pose, state = section.embed(z), np.zeros(2 * n)
        size = 3 * natural * abs(pose[section.dependent_entry])
        state[2:n] = self._before.evaluate_packed(pose[2:n])
        state[n + 2 :] = size * sample[n - 3 : 2 * n - 5]
        if section.sliding and not at_rest:
            state[n] = size * height * sample[-1]
        if self._collision(state[:n], state[n:])[0][1] > 0:
            state[n:] *= -1  # the front foot moves down
        following = self._touchdown.solve(state)[1]
        return following if following is not None and self._momentum(following[:n], following[n:])[0][0] > 0 else None


@functools.lru_cache(maxsize=64)
def _inverse_exchange(robot: Robot, p: bytes, thread: int) -> FastCall:
    """Return angles after the leg exchange -> angles before it, for parameters as bytes and one thread."""
    angles, parameters = ca.SX.sym("angles", len(robot.angles)), ca.SX.sym("p", len(robot.parameters))
    before = ca.densify(angles_before_swap(robot, angles, parameters))
    return FastCall(ca.Function("inverse_exchange", [angles, parameters], [before]), np.frombuffer(p))


def natural_rate(robot: Robot, p: Array) -> tuple[float, float]:
    """Return sqrt(g / l) [rad/s] and l [m], the height of the highest point drawn in the upright pose."""
    values = dict(zip([parameter.name for parameter in robot.parameters], p, strict=True))
    height = float(np.max(np.asarray(robot.figure(np.zeros(robot.n_q), p))[1]))
    return float(np.sqrt(values["gravity"] / height)), height


def natural_scale(walker: Walker, section: Section, z: Array) -> Array:
    """Return the size of each coordinate in a pendulum-like motion with the step size of a point, shape (n_z,)."""
    n, state = walker.robot.n_q, section.embed(z)
    natural, height = natural_rate(walker.robot, walker.p)
    angle = abs(state[section.dependent_entry])
    units = [1.0] * (n - 3) + [natural] * (n - 2) + [natural * height] * section.sliding
    return angle * np.array(units)
