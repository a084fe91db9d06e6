"""Walks from a periodic gait after a push, of robots with one foot on the ground or with several contacts."""

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.reductions import worst
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.section import Section
from gaitopt.stability.section_walk import natural_rate
from gaitopt.status import Stop

if TYPE_CHECKING:  # the simulation of robots with several contacts imports scipy
    from gaitopt.simulation.planar_simulation.planar_walker import PlanarWalker
    from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle


class PushedWalk(Protocol):
    """The walks of a robot from a periodic gait after a push.

    Attributes
    ----------
    spread : (m, n_z) array
        Changes of the state on the section by pushes of size 1 rad/s: a point of the unit ball in n_z dimensions
        becomes a push by this matrix.
    """

    @property
    def spread(self) -> Array:
        """Matrix from the unit ball to pushes."""
        ...

    def begin(self, push: Array) -> Any:
        """Return the state of the gait after a push, shape (m,)."""
        ...

    def take_step(self, state: Any) -> Any | None:
        """Return the state after the next step, or None if the walk ends."""
        ...

    def find_stop(self, state: Any) -> Stop | None:
        """Return the reason why the next step is not completed; None if it is."""
        ...

    def distance(self, state: Any) -> float:
        """Return the largest difference of a state from that of the gait."""
        ...


class SinglePushedWalk:
    """Walks of a robot with one foot on the ground; a push changes the coordinates of its section."""

    def __init__(self, walker: Walker, cycle: Cycle) -> None:
        self._walker, self._cycle = walker, cycle
        self._section = Section(walker.robot, walker.p, sliding=True)
        self._fixed_point = self._section.project(cycle.section.embed(cycle.z))
        self.spread = np.diag(push_scale(walker.robot, walker.p, cycle.section))

    def begin(self, push: Array) -> Array:
        """Return the state after a push."""
        return self._cycle.section.embed(self._cycle.z + push)

    def take_step(self, state: Array) -> Array | None:
        """Return the state after the next step, or None."""
        return self._walker.walk_step(state).following

    def find_stop(self, state: Array) -> Stop | None:
        """Return the reason why the next step is not completed, or None."""
        return self._walker.walk_step(state).stop

    def distance(self, state: Array) -> float:
        """Return the largest difference from the gait."""
        return worst(np.abs(self._section.project(state) - self._fixed_point))


def make_pushed_walk(walker: "Walker | PlanarWalker", cycle: "Cycle | PlanarCycle") -> PushedWalk:
    """Return the walks of a walker from its gait after a push.

    Raises
    ------
    InputError
        If walker and gait are not of the same kind of robot.
    """
    if isinstance(cycle, Cycle) and isinstance(walker, Walker):
        return SinglePushedWalk(walker, cycle)
    from gaitopt.simulation.planar_simulation.planar_walker import PlanarWalker
    from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
    from gaitopt.stability.planar_gaits.planar_pushed_walk import PlanarPushedWalk

    if isinstance(cycle, PlanarCycle) and isinstance(walker, PlanarWalker):
        return PlanarPushedWalk(walker, cycle)
    raise InputError(
        "A push test needs a Walker with a Cycle (one foot on the ground), or a PlanarWalker with a PlanarCycle "
        f"(several contacts), got {type(walker).__name__} and {type(cycle).__name__}."
    )


def push_scale(robot: Robot, p: Array, section: Section) -> Array:
    """Return the change of each coordinate of a section by a push of size 1 rad/s, shape (n_z,)."""
    (natural, height), n_a = natural_rate(robot, p), len(robot.angles)
    return np.array([1 / natural] * (n_a - 1) + [1.0] * n_a + ([height] if section.sliding else []))
