"""Disturbed walks of a gait under a law, of robots with one foot on the ground or with several contacts."""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple, Protocol

import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.control.planar_laws.planar_reference import IDLE
from gaitopt.control.torque_noise import add_torque_noise
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.simulation.delay import DelayedWalker
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import choose_engine, choose_planar_engine
from gaitopt.simulation.hybrid_automaton import Walker, make_walker
from gaitopt.simulation.planar_simulation.planar_delay import DelayedPlanarWalker
from gaitopt.simulation.planar_simulation.planar_engine import REFERENCE, PlanarEngine
from gaitopt.simulation.planar_simulation.planar_state import PlanarState
from gaitopt.simulation.planar_simulation.planar_walker import PlanarWalker
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle

NOISE, PARTS = 10.0, 10
"""Largest standard deviation of the torque noise [N m], and number of intervals of a step with constant noise."""


class NoiseRange(NamedTuple):
    """Largest standard deviation of the torque noise that is tried, and its unit."""

    largest: float
    unit: str


class StepWalker(Protocol):
    """A walker that takes steps: the attribute `following` of a step is the state after it, or None."""

    def walk_step(self, state: Any) -> Any:
        """Simulate one step."""
        ...


class DisturbedGait(Protocol):
    """A periodic gait under a law, and its disturbed walkers."""

    @property
    def start(self) -> Any:
        """State of the gait right after the section."""
        ...

    @property
    def noise_range(self) -> NoiseRange:
        """Range of the torque noise."""
        ...

    def walker(self, changes: Mapping[str, float]) -> Any:
        """Return the walker with some parameters changed."""
        ...

    def noisy_walker(self, deviation: float, rng: np.random.Generator) -> StepWalker:
        """Return the walker for one step with torque noise of a standard deviation."""
        ...

    def delayed_walker(self, delay: float) -> StepWalker:
        """Return the walker whose law reads the state with a delay [s]."""
        ...


@dataclass(frozen=True, eq=False)
class SingleDisturbedGait:
    """A gait with one foot on the ground."""

    robot: Robot
    law: Law
    cycle: Cycle
    engine: Engine

    @property
    def start(self) -> Array:
        """State after touchdown."""
        return self.cycle.section.embed(self.cycle.z)

    @property
    def noise_range(self) -> NoiseRange:
        """The same range for all robots."""
        return NoiseRange(NOISE, "N m")

    def walker(self, changes: Mapping[str, float]) -> Walker:
        """Return the walker with some parameters changed."""
        return self._walker({**self.cycle.parameters, **changes}, self.law)

    def noisy_walker(self, deviation: float, rng: np.random.Generator) -> Walker:
        """Return the walker for one step with torque noise."""
        noise = deviation * rng.normal(size=(self.robot.n_u, PARTS))
        return self._walker(self.cycle.parameters, add_torque_noise(self.law, noise, self.cycle.period))

    def delayed_walker(self, delay: float) -> DelayedWalker:
        """Return the walker with a delay."""
        p, limits = self.robot.vector(self.cycle.parameters), StepLimits(duration=3 * self.cycle.period)
        return DelayedWalker(self.robot, self.law, p, self.engine, delay=delay, step_limits=limits)

    def _walker(self, parameters: Mapping[str, float], law: Law) -> Walker:
        return make_walker(self.robot, law, parameters, period=self.cycle.period, engine=self.engine)


@dataclass(frozen=True, eq=False)
class PlanarDisturbedGait:
    """A gait of a robot with several contacts; noise acts on the actuators with a torque in the gait."""

    robot: PlanarRobot
    law: PlanarLaw
    cycle: PlanarCycle
    engine: PlanarEngine = REFERENCE

    @property
    def start(self) -> PlanarState:
        """State right after the section."""
        return self.cycle.start

    @property
    def noise_range(self) -> NoiseRange:
        """Range of the torque noise, at most the largest torque of the gait."""
        return NoiseRange(
            float(np.max(self._largest, initial=0.0)), " or ".join(dict.fromkeys(self.robot.actuator_units))
        )

    def walker(self, changes: Mapping[str, float]) -> PlanarWalker:
        """Return the walker with some parameters changed."""
        parameters = {**self.cycle.parameters, **changes}
        return PlanarWalker(self.robot, self.law, parameters, engine=self.engine, **self._step)

    def noisy_walker(self, deviation: float, rng: np.random.Generator) -> PlanarWalker:
        """Return the walker for one step with torque noise, whose law is new and thus not worth a compilation."""
        noise = deviation * rng.normal(size=(self.robot.n_u, PARTS)) * (self._largest > IDLE)[:, None]
        parts = tuple(add_torque_noise(part, noise, self.cycle.period) for part in self.law.parts)
        return PlanarWalker(self.robot, replace(self.law, parts=parts), self.cycle.parameters, **self._step)

    def delayed_walker(self, delay: float) -> DelayedPlanarWalker:
        """Return the walker with a delay."""
        return DelayedPlanarWalker(self.robot, self.law, self.cycle.parameters, delay=delay, **self._step)

    @property
    def _step(self) -> dict[str, Any]:
        return {"section": self.cycle.section, "period": self.cycle.period}

    @property
    def _largest(self) -> Array:
        """Largest torque of each actuator in the gait, shape (n_u,)."""
        return np.asarray(np.max(np.abs(self.cycle.motion.channel("torque")), axis=1, initial=0.0))


def disturb_gait(
    robot: Robot | PlanarRobot,
    law: Law | PlanarLaw,
    cycle: Cycle | PlanarCycle,
    engine: Engine | PlanarEngine | None = None,
) -> SingleDisturbedGait | PlanarDisturbedGait:
    """Return the disturbed walks of a gait.

    Raises
    ------
    InputError
        If robot, law and gait are not of the same kind.
    """
    if isinstance(robot, PlanarRobot) and isinstance(law, PlanarLaw) and isinstance(cycle, PlanarCycle):
        return PlanarDisturbedGait(robot, law, cycle, choose_planar_engine(engine))
    if isinstance(robot, Robot) and isinstance(law, Law) and isinstance(cycle, Cycle):
        return SingleDisturbedGait(robot, law, cycle, choose_engine(engine, law, robot))
    kinds = ", ".join(type(each).__name__ for each in (robot, law, cycle))
    raise InputError(
        "A push test needs a Robot, a Law and a Cycle (one foot on the ground), or a PlanarRobot, a PlanarLaw and a "
        f"PlanarCycle (several contacts), got {kinds}."
    )


def reads_state(law: Law | PlanarLaw) -> bool:
    """Return whether the torques of a law depend on the state; those of the planned torques depend on the clock only.

    Examples
    --------
    >>> from gaitopt import compass_biped, computed_torque, feedforward, load
    >>> robot, motion = compass_biped(), load("docs/examples/compass_slip.h5").motion
    >>> reads_state(feedforward(robot, motion)), reads_state(computed_torque(robot, motion, stiffness=25, damping=10))
    (False, True)
    """
    state = (1, 2, 3, 4)  # inputs of a law's Function, whose outputs 0 and 2 are torques and guards
    return any(
        part.index is not None or any(part.control.jac_sparsity(output, i).nnz() for output in (0, 2) for i in state)
        for part in (law.parts if isinstance(law, PlanarLaw) else (law,))
    )
