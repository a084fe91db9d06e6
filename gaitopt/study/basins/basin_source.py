"""Walks of a basin from starts given by coordinates, of robots with one foot on the ground or with several contacts."""

import functools
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from gaitopt.control.law import Law, passive
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import choose_engine, choose_planar_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
from gaitopt.stability.section import Section
from gaitopt.study.basins.attractor import SettlingCriterion, WalkEnding, classify_walk

if TYPE_CHECKING:
    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine  # imports scipy

Classifier = Callable[[Mapping[str, float]], WalkEnding]
"""Function from the coordinates of a start to the ending of its walk."""


class BasinSource(Protocol):
    """A robot under a law, and the walks from starts given by coordinates."""

    @property
    def robot(self) -> Robot | PlanarRobot:
        """The robot."""
        ...

    @property
    def parameters(self) -> Mapping[str, float]:
        """Parameters that replace the defaults of the robot."""
        ...

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates of a start."""
        ...

    @property
    def units(self) -> dict[str, str]:
        """Units of coordinates that do not follow from their names."""
        ...

    def complete(self, fixed: Mapping[str, float]) -> dict[str, float]:
        """Return the coordinates of a start without those of the axes; `fixed` are the known ones."""
        ...

    def method(self) -> dict[str, Any]:
        """Return the law and the other data that determine the walks, as plain data."""
        ...

    def classifier(self, parameters: Mapping[str, float], criterion: SettlingCriterion) -> Classifier:
        """Return the function that walks from a start with all parameters of the robot and the ground."""
        ...


@dataclass(frozen=True, eq=False)
class SingleSource:
    """A robot with one foot on the ground."""

    robot: Robot
    law: Law
    engine: Engine

    @property
    def parameters(self) -> Mapping[str, float]:
        """Empty: the robot has its default parameters."""
        return {}

    @functools.cached_property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates of the section with foot speed."""
        return Section(self.robot, self.robot.vector(self.robot.resolve({})), sliding=True).names

    @property
    def units(self) -> dict[str, str]:
        """Empty: the units of all coordinates follow from their names."""
        return {}

    def complete(self, fixed: Mapping[str, float]) -> dict[str, float]:
        """Return the coordinates that are not known, with the value 0."""
        return {name: float(fixed.get(name, 0.0)) for name in self.coordinates}

    def method(self) -> dict[str, Any]:
        """Return the law."""
        return {"law": self.law.name, "law_digest": self.law.digest()}

    def classifier(self, parameters: Mapping[str, float], criterion: SettlingCriterion) -> Classifier:
        """Return the function that walks from a start."""
        p = self.robot.vector(parameters)
        walker, section = Walker(self.robot, self.law, p, self.engine), Section(self.robot, p, sliding=True)
        return lambda start: classify_walk(walker, np.array([start[name] for name in section.names]), criterion)


def make_source(
    robot: Robot | PlanarWalkProblem | PlanarGait,
    law: Law | PlanarLaw | None,
    engine: "Engine | PlanarEngine | None",
) -> BasinSource:
    """Return the source of walks of a robot under a law; for several contacts, its gait is found or assessed first.

    Raises
    ------
    InputError
        If the law is one of other robots, or a robot with several contacts has no periodic gait.
    """
    if isinstance(robot, Robot):
        if isinstance(law, PlanarLaw):
            raise InputError(f"A robot with one foot on the ground needs a Law, got the PlanarLaw {law.name!r}.")
        law = law or passive(robot)
        return SingleSource(robot, law, choose_engine(engine, law, robot))
    from gaitopt.study.basins.planar_source import PlanarSource  # imports scipy

    chosen = choose_planar_engine(engine)
    if isinstance(robot, PlanarWalkProblem):
        cycle = next(robot.search(engine=chosen), None)
        if law is not None or cycle is None:
            raise InputError(
                "A walking problem (PlanarWalkProblem) contains its torque; law must be omitted."
                if law is not None
                else "No periodic gait was found that defines the other coordinates of the starts; try another slope, "
                "friction or state."
            )
        return PlanarSource(robot.robot, robot.torque, cycle, chosen)
    from gaitopt.control.planar_laws.planar_feedback import planar_feedforward

    law = planar_feedforward(robot) if law is None else law
    if not isinstance(law, PlanarLaw):
        raise InputError(f"A gait of a robot with several contacts needs a PlanarLaw, got the Law {law.name!r}.")
    return PlanarSource(robot.robot, law, assess_stability(robot, law, engine=chosen), chosen)
