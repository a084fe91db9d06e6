"""Gaits of a walking problem at values of a parameter, as starts of branches."""

import itertools
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from gaitopt.continuation.gait_family import GaitFamily, make_gait_family, make_patient_walker
from gaitopt.continuation.parameter_values import check_range, gains_of, set_gains, unit_of
from gaitopt.continuation.planar_family import PlanarFamily, make_planar_family
from gaitopt.control.law import Law, passive
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.motion.motion import Array
from gaitopt.motion.view_motion import AnyMotion
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import choose_engine, choose_planar_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine
from gaitopt.simulation.simulator import record_walk
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.cycle_iteration import find_cycle
from gaitopt.stability.cycle_search import search_cycles, sort_cycles
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
from gaitopt.stability.section import Section
from gaitopt.stability.walk_problem import WalkProblem

AnyFamily = GaitFamily | PlanarFamily
AnyCycle = Cycle | PlanarCycle
AnyWalkProblem = WalkProblem | PlanarWalkProblem


class GaitStart(NamedTuple):
    """A gait as a point of its family."""

    family: AnyFamily
    z: Array
    value: float


@dataclass(frozen=True, eq=False)
class GaitSource(ABC):
    """Gaits of a walking problem over a parameter.

    Attributes
    ----------
    problem : WalkProblem or PlanarWalkProblem
    parameter : str
    ends : (float, float)
    engine : Engine, PlanarEngine or None
    """

    problem: Any
    parameter: str
    ends: tuple[float, float]
    engine: Engine | PlanarEngine | None = None

    def __post_init__(self) -> None:
        check_range(self.problem, self.parameter, self.ends)

    @property
    @abstractmethod
    def law(self) -> Any:
        """The law, or None."""

    @property
    def unit(self) -> str:
        """Unit of the parameter."""
        return unit_of(self.problem.robot, self.parameter)

    @property
    def values(self) -> dict[str, float]:
        """All parameters and gains of the problem."""
        return gains_of(self.law) | dict(self.problem.parameters)

    @abstractmethod
    def search(self, value: float, starts: int) -> tuple[AnyCycle, ...]:
        """Return the gaits that are found at a value, stable ones first."""

    def explain_failure(self, value: float) -> str:
        """Return a sentence that states why no gait is found at a value; empty if this is not known."""
        return ""

    @abstractmethod
    def gait_near(self, value: float, state: Mapping[str, float], steps: int) -> AnyCycle | None:
        """Return the gait to which Newton's method converges from a state on the section, or None.

        Parameters
        ----------
        value : float
        state : mapping of str to float
            Coordinates of a branch by name.
        steps : int
        """

    @abstractmethod
    def motions(self, value: float, state: Mapping[str, float], steps: int) -> tuple[AnyMotion, ...]:
        """Return the motion of each step of a gait of a branch; none if it is not found.

        Parameters
        ----------
        value : float
        state : mapping of str to float
            Coordinates of the gait by name.
        steps : int
        """

    @abstractmethod
    def start(self, cycle: Any, value: float | None = None) -> GaitStart:
        """Return a gait as a point of its family; its value is that of the problem unless it is stated."""

    def _is_gain(self) -> bool:
        return all(each.name != self.parameter for each in self.problem.robot.parameters)

    def _value_of(self, cycle: Any, value: float | None) -> float:
        if value is not None:
            return value
        return float(self.values[self.parameter] if self._is_gain() else cycle.parameters[self.parameter])


class WalkGaits(GaitSource):
    """Gaits of a walker with one foot on the ground at a time."""

    problem: WalkProblem

    @property
    def law(self) -> Any:
        """The law, or None."""
        return self.problem.law

    def search(self, value: float, starts: int) -> tuple[AnyCycle, ...]:
        """Return the gaits that are found at a value, stable ones first."""
        problem, sequence = self.problem, self.problem.sequence
        law, parameters = problem.law, dict(problem.parameters)
        if self._is_gain() and law is not None:
            law = set_gains(problem.robot, law, {self.parameter: value})
        else:
            parameters[self.parameter] = value
        engine = self._engine(law or passive(problem.robot))
        cycles = search_cycles(problem.robot, parameters, law=law, starts=starts, engine=engine)
        return sort_cycles(cycle for cycle in cycles if sequence is None or set(cycle.sequences) == {sequence})

    def gait_near(self, value: float, state: Mapping[str, float], steps: int) -> AnyCycle | None:
        """Return the gait to which Newton's method converges from a state on the section, or None."""
        walker, section = self._walker_at(value)
        # A foot that cannot slip has no foot speed.
        return find_cycle(walker, np.array([state.get(name, 0.0) for name in section.names]), steps)

    def motions(self, value: float, state: Mapping[str, float], steps: int) -> tuple[AnyMotion, ...]:
        """Return the motion of each step of a gait of a branch."""
        walker, section = self._walker_at(value)
        y, motions = section.embed(np.array([state.get(name, 0.0) for name in section.names])), list[AnyMotion]()
        for _ in range(steps):
            following = walker.walk_step(y).following
            if following is None:
                break
            motions.append(record_walk(walker, y, 1).motion)
            y = following
        return tuple(motions)

    def _walker_at(self, value: float) -> tuple[Walker, Section]:
        """Return the walker at a value, and its section with foot speed."""
        robot, values = self.problem.robot, self.values | {self.parameter: value}
        known = {each.name for each in robot.parameters}
        p = robot.vector(robot.resolve({name: number for name, number in values.items() if name in known}))
        law = set_gains(robot, self.law or passive(robot), {self.parameter: value})
        walker = make_patient_walker(robot, law, p, self._engine(law))
        return walker, Section(robot, p, sliding=True)

    def start(self, cycle: Any, value: float | None = None) -> GaitStart:
        """Return a gait as a point of its family."""
        value = self._value_of(cycle, value)
        law = set_gains(self.problem.robot, self.law or passive(self.problem.robot), {self.parameter: value})
        options: dict[str, Any] = {"law": law, "engine": self._engine(law)}
        family = make_gait_family(self.problem.robot, cycle, self.parameter, self.ends, **options)
        return GaitStart(family, family.start(cycle), value)

    def _engine(self, law: Law) -> Engine:
        return choose_engine(self.engine, law, self.problem.robot)


class PlanarGaits(GaitSource):
    """Gaits of a robot with several contacts."""

    problem: PlanarWalkProblem

    @property
    def law(self) -> Any:
        """The law, or None."""
        return self.problem.torque

    def search(self, value: float, starts: int) -> tuple[AnyCycle, ...]:
        """Return the gaits that are found at a value, stable ones first."""
        cycles = itertools.islice(self._problem_at(value).search(starts, engine=self._engine), starts)
        return tuple(sorted(cycles, key=lambda cycle: cycle.radius))

    def explain_failure(self, value: float) -> str:
        """Return a sentence that states why no gait is found from the state of the problem."""
        return self._problem_at(value).explain_failure(self._engine)

    def start(self, cycle: Any, value: float | None = None) -> GaitStart:
        """Return a gait as a point of its family."""
        value = self._value_of(cycle, value)
        values = self.values | dict(cycle.parameters) | {self.parameter: value}
        problem = self.problem
        options: dict[str, Any] = {"torque": problem.torque, "values": values, "engine": self._engine}
        family = make_planar_family(problem.robot, cycle, self.parameter, self.ends, **options)
        return GaitStart(family, family.start(cycle), value)

    def gait_near(self, value: float, state: Mapping[str, float], steps: int) -> PlanarCycle | None:
        """Return the gait to which Newton's method converges from a state on the section, or None."""
        if steps > 1:
            return None
        problem = self._problem_at(value)
        known = problem.robot.state_names
        angles = {name: state[name] for name in problem.robot.coordinates if name in state}
        rates = {name.removesuffix("_rate"): state[name] for name in known if name in state and name not in angles}
        moved = replace(
            problem, coordinates={**problem.coordinates, **angles}, rates={**problem.rates, **rates}, sequence=None
        )
        return next(moved.search(1, engine=self._engine), None)

    def motions(self, value: float, state: Mapping[str, float], steps: int) -> tuple[AnyMotion, ...]:
        """Return the motion of a gait of a branch; none if it is not found, or its period is longer."""
        cycle = self.gait_near(value, state, steps)
        return () if cycle is None else (cycle.motion,)

    @property
    def _engine(self) -> PlanarEngine:
        return choose_planar_engine(self.engine)

    def _problem_at(self, value: float) -> PlanarWalkProblem:
        """Return the problem with another value of the parameter."""
        if not self._is_gain():
            return replace(self.problem, parameters={**self.problem.parameters, self.parameter: value})
        torque = self.problem.torque
        if not isinstance(torque, PlanarLaw):
            raise InputError(f"The torque of {self.problem.name!r} has no gain {self.parameter!r}.")
        return replace(self.problem, torque=set_gains(self.problem.robot, torque, {self.parameter: value}))


def make_gait_source(
    problem: AnyWalkProblem, over: Mapping[str, tuple[float, float]], engine: Engine | PlanarEngine | None = None
) -> GaitSource:
    """Return the gaits of a walking problem over one parameter.

    Raises
    ------
    InputError
        If `over` is not one parameter of robot, ground or law with a finite range.

    Examples
    --------
    >>> from gaitopt import WalkProblem, compass_biped
    >>> make_gait_source(WalkProblem(robot=compass_biped()), {"slope": (0.01, 0.02)}).unit
    'rad'
    """
    parameter, ends = read_range(over)
    if isinstance(problem, PlanarWalkProblem):
        return PlanarGaits(problem, parameter, ends, engine)
    if not isinstance(problem, WalkProblem):
        raise InputError(
            f"The problem must be a WalkProblem or a PlanarWalkProblem, got {problem!r}. trace_optimum follows the "
            "optimal gaits of a GaitProblem."
        )
    return WalkGaits(problem, parameter, ends, engine)


def read_range(over: Mapping[str, tuple[float, float]]) -> tuple[str, tuple[float, float]]:
    """Return the parameter and the ends of its range.

    Examples
    --------
    >>> read_range({"friction": (1, 0)})
    ('friction', (1.0, 0.0))
    """
    if not isinstance(over, Mapping) or len(over) != 1:
        raise InputError(
            f"over must be one parameter with its range, such as {{'friction': (0.3, 0.1)}}, got {over!r}."
        )
    ((parameter, ends),) = over.items()
    try:
        low, high = (float(end) for end in ends)
    except (TypeError, ValueError):
        raise InputError(f"The range of {parameter} must be two numbers, got {ends!r}.") from None
    return parameter, (low, high)
