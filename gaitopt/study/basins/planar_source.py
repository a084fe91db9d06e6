"""Walks of a basin of a robot with several contacts, near its periodic gait."""

import functools
import hashlib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np

from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.planar_motion import PlanarEvent
from gaitopt.simulation.planar_simulation.planar_engine import REFERENCE, PlanarEngine
from gaitopt.simulation.planar_simulation.planar_state import PlanarArc
from gaitopt.simulation.planar_simulation.planar_walker import PlanarWalker
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
from gaitopt.stability.planar_gaits.planar_section import PlanarSection
from gaitopt.stability.planar_gaits.state_change import change_state, check_state_changes
from gaitopt.study.basins.attractor import SettlingCriterion, WalkEnding, classify_planar_walk
from gaitopt.study.basins.basin_source import Classifier

NO_START = "no_start"
"""Ending of a start near which no state has the feet of the gait on the ground."""

PLACES = 6
"""Decimal places of the gait's state in the key of a basin."""


@dataclass(frozen=True, eq=False)
class PlanarSource:
    """A robot with several contacts; its periodic gait provides the coordinates that are not given.

    They change as little as possible, such that the contacts that are closed at the start of the gait are closed.
    """

    robot: PlanarRobot
    torque: ca.Function | PlanarLaw | None
    cycle: PlanarCycle
    engine: PlanarEngine = REFERENCE

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
        known = {name: float(fixed[name]) for name in self.coordinates if name in fixed}
        check_state_changes(self.robot, known)
        return known

    def method(self) -> dict[str, Any]:
        """Return the torque, the section and the gait."""
        parts = [self.torque.serialize()] if isinstance(self.torque, ca.Function) else []
        parts += [part.digest() for part in self.torque.parts] if isinstance(self.torque, PlanarLaw) else []
        name = "passive" if self.torque is None else getattr(self.torque, "name", "torque")
        digest = hashlib.sha256("".join(parts).encode()).hexdigest()
        gait = {name: round(value, PLACES) for name, value in self.cycle.state.items()}
        name = name if isinstance(name, str) else "torque"
        return {"law": name, "law_digest": digest, "section": self.cycle.section, "gait": gait}

    def classifier(self, parameters: Mapping[str, float], criterion: SettlingCriterion) -> Classifier:
        """Return the function that walks from a start."""
        walker, gait = self._walker(parameters), self.cycle.start
        section, n = PlanarSection(walker.automaton, *self._end, self.robot.mirror), self.robot.n_q
        kept = [place for place, name in enumerate(self.robot.state_names) if name != self.robot.travel]

        def classify(start: Mapping[str, float]) -> WalkEnding:
            y = change_state(section, gait.y, start)
            if y is None:
                return WalkEnding(NO_START, np.full(len(kept), np.nan), 0)
            return classify_planar_walk(walker, replace(gait, q=y[:n], v=y[n:]), kept, criterion)

        return classify

    def _walker(self, parameters: Mapping[str, float]) -> PlanarWalker:
        cycle = self.cycle
        options: dict[str, Any] = {"section": cycle.section, "period": cycle.period, "engine": self.engine}
        return PlanarWalker(self.robot, self.torque, parameters, **options)

    @functools.cached_property
    def _end(self) -> tuple[PlanarArc, PlanarEvent]:
        """The last phase of the gait, and the event that ends it."""
        walk_step = self._walker(self.cycle.parameters).walk_step(self.cycle.start)
        if walk_step.stop is not None:
            raise InputError(f"The robot does not complete a step of its gait: {walk_step.stop.hint}")
        return walk_step.rollout.arcs[-1], walk_step.rollout.motion.events[-1]
