"""The return map of a gait on one ground as a function of the law, for the search for gains."""

from collections.abc import Callable, Mapping
from typing import Any, Protocol

import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import AnyGait, PlanarGait
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import choose_engine, choose_planar_engine
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton, accept_step
from gaitopt.simulation.planar_simulation.planar_engine import REFERENCE, PlanarEngine
from gaitopt.stability.fixed_point import find_fixed_point
from gaitopt.stability.one_sided import one_sided_derivatives
from gaitopt.stability.planar_gaits.planar_assessment import NEAR, PLANNED
from gaitopt.stability.planar_gaits.planar_cycle import find_cycle_from
from gaitopt.stability.return_map import ReturnMap
from gaitopt.stability.section import Section

FIXED_POINT_TOLERANCE = 1e-5
"""Distance between a point and its image below which the search accepts the point as a fixed point."""

ANGLE, RATE = 0.1, 0.5
"""Deviations that have equal weight [rad or m; rad/s or m/s]."""


class GroundMap(Protocol):
    """The return map of a gait on one ground."""

    @property
    def scale(self) -> Array:
        """Sizes of deviations of the coordinates that have equal weight, shape (n_z,), or (1,) if they are equal."""
        ...

    def derivatives(self, law: Any, check: Callable[[], None] = accept_step) -> tuple[Array, ...]:
        """Return the derivative of the return map under a law, one for each side of a boundary of impact modes.

        Empty if no periodic gait is found near the planned one.  `check` is called repeatedly, and may raise an error.
        """
        ...


class SingleGroundMap:
    """The return map of a gait with one foot on the ground."""

    def __init__(self, gait: Gait, ground: Mapping[str, float], engine: Engine | PlanarEngine | None) -> None:
        self._robot, self._ground, self._engine, self._period = gait.robot, ground, engine, gait.period
        first = gait.motion.segments[0]
        self._section = Section(gait.robot, gait.robot.vector(ground), sliding=True)
        self._point = self._section.project(np.concatenate([first.q[:, 0], first.v[:, 0]]))
        n_a = len(gait.robot.angles)
        self.scale: Array = np.array([ANGLE] * (n_a - 1) + [RATE] * n_a + [RATE])

    def derivatives(self, law: Law, check: Callable[[], None] = accept_step) -> tuple[Array, ...]:
        """Return the derivatives; Newton's method starts from the fixed point of the previous law."""
        engine = choose_engine(self._engine, law, self._robot)
        walker = make_walker(self._robot, law, self._ground, period=self._period, engine=engine)
        return_map = ReturnMap(walker, self._section)
        z = self._point
        passage = return_map(z)
        if passage.end is None or not np.max(np.abs(passage.end - z)) <= FIXED_POINT_TOLERANCE:
            point = find_fixed_point(return_map, z)
            if point is None:
                return ()
            z, passage = point.z, point.passage
            self._point = z
        check()
        sides = one_sided_derivatives(return_map.walker, passage.states[0], passage.walk_steps[0])
        return tuple(sides or (return_map.derivative(z, passage),))


class PlanarGroundMap:
    """The return map of a gait of a robot with several contacts, in coordinates of equal weight."""

    def __init__(self, gait: PlanarGait, ground: Mapping[str, float], engine: PlanarEngine = REFERENCE) -> None:
        self._engine = engine
        self._gait, self._ground, self._planned = gait, ground, dict(ground) == gait.motion.parameters
        first, n = gait.motion.segments[0], gait.robot.n_q
        self._start = first.q[:, 0].copy(), first.v[:, 0].copy()
        self._weights = np.repeat([1 / ANGLE, 1 / RATE], n)
        self.scale: Array = np.ones(1)

    def derivatives(self, law: PlanarLaw, check: Callable[[], None] = accept_step) -> tuple[Array, ...]:
        """Return the derivative, if there is a gait near the planned one."""
        automaton = PlanarAutomaton(self._gait.robot, self._ground, law, engine=self._engine)
        automaton.check = check
        try:
            cycle = find_cycle_from(automaton, *self._start, law.section, tolerance=PLANNED)
        except InputError:  # the robot falls in its first step
            return ()
        if cycle is None:
            return ()
        if self._planned and abs(cycle.period - self._gait.period) > NEAR * self._gait.period:
            return ()  # on another ground the period differs
        weight = np.linalg.qr(self._weights[:, None] * cycle.basis)[1]
        return (weight @ cycle.derivative @ np.linalg.inv(weight),)


def make_ground_map(gait: AnyGait, ground: Mapping[str, float], engine: Engine | PlanarEngine | None) -> GroundMap:
    """Return the return map of a gait on a ground, stated by all parameters of the robot and of the ground."""
    if isinstance(gait, PlanarGait):
        return PlanarGroundMap(gait, ground, choose_planar_engine(engine))
    return SingleGroundMap(gait, ground, engine)
