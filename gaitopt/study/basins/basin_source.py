"""Walks of a basin from starts given by coordinates, of robots with one foot on the ground or with several contacts."""

import functools
import hashlib
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, Protocol

import casadi as ca
import numpy as np

from gaitopt.control.law import Law, passive
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.planar_motion import PlanarEvent
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.planar_simulation.planar_state import PlanarArc
from gaitopt.simulation.planar_simulation.planar_walker import PlanarWalker
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
from gaitopt.stability.planar_gaits.planar_section import PlanarSection
from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
from gaitopt.stability.planar_gaits.state_change import change_state
from gaitopt.stability.section import Section
from gaitopt.study.basins.attractor import SettlingCriterion, WalkEnding, classify_planar_walk, classify_walk

Classifier = Callable[[Mapping[str, float]], WalkEnding]
"""Function from the coordinates of a start to the ending of its walk."""

NO_START = "no_start"
"""Ending of a start at which the closed contacts cannot be on the ground."""

PLACES = 6
"""Decimal places of the gait's state in the key of a basin."""


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
        """Units of coordinates that their names do not tell."""
        ...

    def complete(self, fixed: Mapping[str, float]) -> dict[str, float]:
        """Return the coordinates of a start without those of the axes; `fixed` are the known ones."""
        ...

    def method(self) -> dict[str, Any]:
        """Return the law, as plain data, and what else determines the walks."""
        ...

    def classifier(self, parameters: Mapping[str, float], patience: SettlingCriterion) -> Classifier:
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
        """None: the defaults of the robot."""
        return {}

    @functools.cached_property
    def coordinates(self) -> tuple[str, ...]:
        """Names of the coordinates of the section with foot speed."""
        return Section(self.robot, self.robot.vector(self.robot.resolve({})), sliding=True).names

    @property
    def units(self) -> dict[str, str]:
        """None."""
        return {}

    def complete(self, fixed: Mapping[str, float]) -> dict[str, float]:
        """Return the coordinates that are not known as 0."""
        return {name: float(fixed.get(name, 0.0)) for name in self.coordinates}

    def method(self) -> dict[str, Any]:
        """Return the law."""
        return {"law": self.law.name, "law_digest": self.law.digest()}

    def classifier(self, parameters: Mapping[str, float], patience: SettlingCriterion) -> Classifier:
        """Return the function that walks from a start."""
        p = self.robot.vector(parameters)
        walker, section = Walker(self.robot, self.law, p, self.engine), Section(self.robot, p, sliding=True)
        return lambda start: classify_walk(walker, np.array([start[name] for name in section.names]), patience)


@dataclass(frozen=True, eq=False)
class PlanarSource:
    """A robot with several contacts; its periodic gait provides the coordinates that are not given.

    They change as little as possible, such that the contacts that are closed at the start of the gait are closed.
    """

    robot: PlanarRobot
    torque: ca.Function | PlanarLaw | None
    cycle: PlanarCycle

    @property
    def parameters(self) -> Mapping[str, float]:
        """Parameters of the gait."""
        return self.cycle.parameters

    @property
    def coordinates(self) -> tuple[str, ...]:
        """Names of coordinates and rates, without the coordinate along the ground."""
        return tuple(name for name in self.robot.state_names if name != self.robot.travel)

    @property
    def units(self) -> dict[str, str]:
        """Units of lengths and their rates."""
        units = dict(zip(self.robot.coordinates, self.robot.units, strict=True))
        return units | {f"{name}_rate": f"{unit}/s" for name, unit in units.items()}

    def complete(self, fixed: Mapping[str, float]) -> dict[str, float]:
        """Return the known coordinates; the gait provides the others."""
        return {name: float(fixed[name]) for name in self.coordinates if name in fixed}

    def method(self) -> dict[str, Any]:
        """Return the torque, the section and the gait."""
        parts = [self.torque.serialize()] if isinstance(self.torque, ca.Function) else []
        parts += [part.digest() for part in self.torque.parts] if isinstance(self.torque, PlanarLaw) else []
        name = "passive" if self.torque is None else getattr(self.torque, "name", "torque")
        digest = hashlib.sha256("".join(parts).encode()).hexdigest()
        gait = {name: round(value, PLACES) for name, value in self.cycle.state.items()}
        name = name if isinstance(name, str) else "torque"
        return {"law": name, "law_digest": digest, "section": self.cycle.section, "gait": gait}

    def classifier(self, parameters: Mapping[str, float], patience: SettlingCriterion) -> Classifier:
        """Return the function that walks from a start."""
        options: dict[str, Any] = {"section": self.cycle.section, "period": self.cycle.period}
        walker, gait = PlanarWalker(self.robot, self.torque, parameters, **options), self.cycle.start
        section, n = PlanarSection(walker.automaton, *self._end, self.robot.mirror), self.robot.n_q
        kept = [place for place, name in enumerate(self.robot.state_names) if name != self.robot.travel]

        def classify(start: Mapping[str, float]) -> WalkEnding:
            y = change_state(section, gait.y, start)
            if y is None:
                return WalkEnding(NO_START, np.full(len(kept), np.nan), 0)
            return classify_planar_walk(walker, replace(gait, q=y[:n], v=y[n:]), kept, patience)

        return classify

    @functools.cached_property
    def _end(self) -> tuple[PlanarArc, PlanarEvent]:
        """The last phase of the gait, and the event that ends it."""
        options: dict[str, Any] = {"section": self.cycle.section, "period": self.cycle.period}
        stride = PlanarWalker(self.robot, self.torque, self.cycle.parameters, **options).stride(self.cycle.start)
        if stride.stop is not None:
            raise InputError(f"The robot does not complete a step of its gait: {stride.stop.hint}")
        return stride.rollout.arcs[-1], stride.rollout.motion.events[-1]


def make_source(
    robot: Robot | PlanarWalkProblem | PlanarGait, law: Law | PlanarLaw | None, engine: Engine | None
) -> BasinSource:
    """Return the walks of a robot under a law; the gait of a robot with several contacts is searched or assessed.

    Raises
    ------
    InputError
        If the law is one of other robots, or a robot with several contacts has no periodic gait.
    """
    if isinstance(robot, PlanarWalkProblem):
        cycle = next(robot.search(), None)
        if law is not None or cycle is None:
            raise InputError(
                "A walking problem states its torque itself: omit law."
                if law is not None
                else "No periodic gait was found that completes the starts; try another slope, friction or state."
            )
        return PlanarSource(robot.robot, robot.torque, cycle)
    if isinstance(robot, PlanarGait):
        from gaitopt.control.planar_laws.planar_feedback import planar_feedforward

        law = planar_feedforward(robot) if law is None else law
        if not isinstance(law, PlanarLaw):
            raise InputError(f"A gait of a robot with several contacts needs a PlanarLaw, got the Law {law.name!r}.")
        return PlanarSource(robot.robot, law, assess_stability(robot, law))
    if isinstance(law, PlanarLaw):
        raise InputError(f"A robot with one foot on the ground needs a Law, got the PlanarLaw {law.name!r}.")
    law = law or passive(robot)
    return SingleSource(robot, law, engine or default_engine(law, robot))
