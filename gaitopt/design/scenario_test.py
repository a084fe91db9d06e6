"""Walks of a gait under a law in scenarios that differ from its plan."""

import math
from collections.abc import Sequence
from dataclasses import field

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.dataclass import dataclass
from gaitopt.design.scenarios import Scenario, Scenarios
from gaitopt.errors import GaitoptError
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.motion.printable import format_count
from gaitopt.parallel.execution import Execution
from gaitopt.parallel.runner import run_tasks
from gaitopt.parallel.task_graph import Task
from gaitopt.reductions import worst
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.hybrid_automaton import make_walker
from gaitopt.stability.recovery import PushTest, draw_pushes
from gaitopt.stability.section import Section

SETTLED = 1e-3
"""Fraction of the tolerance below which a walk counts as returned before its last step."""


@check_arguments
@dataclass(frozen=True)
class Walk:
    """A walk in a scenario.

    Attributes
    ----------
    scenario : Scenario
    steps : int
        Number of steps completed.
    distance : float
        Largest difference of the last state from the planned one; inf if the walk ended early.
    cause : str
        The quantity with this difference, or the reason why the walk ended early.

    Examples
    --------
    >>> print(Walk(Scenario({"friction": 0.1}), 3, float("inf"), "The walker fell."))
    friction 0.1: ended after 3 steps: The walker fell.
    """

    scenario: Scenario
    steps: int
    distance: float
    cause: str = ""

    def __str__(self) -> str:
        steps = format_count(self.steps, "step")
        if math.isinf(self.distance):
            return f"{self.scenario}: ended after {steps}: {self.cause}"
        return f"{self.scenario}: {self.cause} differs by {self.distance:.2g} from the plan after {steps}"


@check_arguments
@dataclass(frozen=True)
class ScenarioTest:
    """Result of a test of a gait in random scenarios.

    Attributes
    ----------
    scenarios, survived : int
        Number of scenarios without a push, and of those that the gait survives.
    pushed, recovered : int
        Number of scenarios with a push, and of those that the gait survives.
    failures : tuple of Walk
        Walks that did not survive.
    varied : tuple of str
        Names of the parameters that differ from the plan.

    Examples
    --------
    >>> print(ScenarioTest(20, 8, 20, 9, (), ("friction",)))
    maintained at 8 of 20 friction coefficients and after 9 of 20 pushes
    """

    scenarios: int
    survived: int
    pushed: int
    recovered: int
    failures: tuple[Walk, ...] = field(repr=False)
    varied: tuple[str, ...] = field(default=(), repr=False)

    @property
    def total(self) -> int:
        """Number of scenarios with and without a push."""
        return self.scenarios + self.pushed

    @property
    def total_survived(self) -> int:
        """Number of scenarios with and without a push that the gait survives."""
        return self.survived + self.recovered

    @property
    def passed(self) -> bool:
        """Whether the gait survives all scenarios."""
        return self.total_survived == self.total

    def __str__(self) -> str:
        place, noun = ("at", "friction coefficients") if self.varied == ("friction",) else ("in", "scenarios")
        pushes = f" and after {self.recovered} of {self.pushed} pushes" if self.pushed else ""
        return f"maintained {place} {self.survived} of {self.scenarios} {noun}{pushes}"


@check_arguments
@dataclass(frozen=True, eq=False)
class ScenarioSimulator:
    """A gait under a law, and its walks in scenarios.

    Attributes
    ----------
    gait : Gait
    law : Law
    scenarios : Scenarios
    engine : Engine
    seed : int
        Seed of the pushes.

    Examples
    --------
    >>> from gaitopt import ScipyEngine, feedforward, load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> law = feedforward(gait.robot, gait.motion)
    >>> walker = ScenarioSimulator(gait, law, Scenarios(steps=2), ScipyEngine(), 0)
    >>> walker.walk(Scenario()).distance < 1e-4
    True
    """

    gait: Gait
    law: Law
    scenarios: Scenarios
    engine: Engine
    seed: int

    def walk(self, scenario: Scenario) -> Walk:
        """Return the walk in a scenario from the planned state after touchdown."""
        gait, options = self.gait, self.scenarios
        parameters = gait.robot.resolve({**gait.motion.parameters, **scenario.parameters})
        walker = make_walker(gait.robot, self.law, parameters, period=gait.period, engine=self.engine)
        first, entries = gait.motion.segments[0], gait.robot.state_entries.without_position
        planned = np.concatenate([first.q[:, 0], first.v[:, 0]])
        state = self._push(planned, scenario)
        for step in range(1, options.steps + 1):
            walk_step = walker.walk_step(state)
            if walk_step.following is None:
                return Walk(scenario, step - 1, math.inf, "" if walk_step.stop is None else walk_step.stop.value)
            state = walk_step.following
            difference = np.abs((state - planned)[entries])
            distance = worst(difference)
            if distance <= SETTLED * options.tolerance:
                break
        rates = ("slip velocity", "velocity of the gap", *(f"rate of {name}" for name in gait.robot.angles))
        return Walk(scenario, options.steps, distance, (*gait.robot.angles, *rates)[int(np.argmax(difference))])

    def _push(self, planned: Array, scenario: Scenario) -> Array:
        if scenario.push is None:
            return planned
        robot, p = self.gait.robot, self.gait.robot.vector(self.gait.motion.parameters)
        section = Section(robot, p, sliding=self.gait.motion.segments[0].mode.slips)
        push = list(draw_pushes(robot, p, section, PushTest(starts=scenario.push + 1, seed=self.seed)))[-1]
        return section.embed(section.project(planned) + self.scenarios.push * push)


@check_arguments
def walk_scenarios(walker: ScenarioSimulator, scenarios: Sequence[Scenario], execution: Execution) -> list[Walk]:
    """Return the walks in some scenarios, in order.

    Raises
    ------
    GaitoptError
        If worker processes repeatedly terminate.

    Examples
    --------
    >>> from gaitopt import ScipyEngine, feedforward, load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> law = feedforward(gait.robot, gait.motion)
    >>> walker = ScenarioSimulator(gait, law, Scenarios(steps=2), ScipyEngine(), 0)
    >>> [walk.steps for walk in walk_scenarios(walker, [Scenario({"friction": 0.01})], Execution())]
    [0]
    """
    tasks = [Task(f"{number:06d}", scenario) for number, scenario in enumerate(scenarios)]
    walks: dict[str, Walk] = {}
    for done in run_tasks(ScenarioSimulator.walk, tasks, walker, execution=execution):
        if done.failure:
            raise GaitoptError(f"A scenario was not computed: {done.failure}.")
        walks[done.task.key] = done.result
        if execution.observer is not None:
            execution.observer(len(walks), len(tasks))
    return [walks[task.key] for task in tasks]


@check_arguments
def check_scenarios(
    gait: Gait,
    law: Law,
    scenarios: Scenarios,
    *,
    count: int = 100,
    seed: int = 1,
    engine: Engine | None = None,
    execution: Execution | None = None,
) -> ScenarioTest:
    """Test a gait under a law in random scenarios without a push, and as many with a push.

    Parameters
    ----------
    gait : Gait
    law : Law
    scenarios : Scenarios
    count : int
        Number of scenarios without a push and, if `scenarios` has pushes, of scenarios with a push.
    seed : int
        Seed of parameters and pushes; choose one that differs from that of the scenarios.
    engine : Engine, optional
    execution : Execution, optional
        Workers, and the observer of (walks done, walks in all).

    Examples
    --------
    >>> from gaitopt import feedforward, load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> scenarios = Scenarios(ranges={"friction": (0.13999, 0.14001)}, steps=2, tolerance=1e-2)
    >>> check_scenarios(gait, feedforward(gait.robot, gait.motion), scenarios, count=2).survived
    2
    """
    engine, execution = engine or default_engine(law, gait.robot), execution or Execution()
    walker = ScenarioSimulator(gait, law, scenarios, engine, seed)
    plain = walk_scenarios(walker, scenarios.draw(count, seed, pushed=False), execution)
    pushed = []
    if scenarios.push:
        pushed = walk_scenarios(walker, scenarios.draw(count, seed + 1, pushed=True), execution)
    failures = tuple(walk for walk in (*plain, *pushed) if not walk.distance <= scenarios.tolerance)
    lost = sum(walk.scenario.push is None for walk in failures)
    survived, recovered = len(plain) - lost, len(pushed) - (len(failures) - lost)
    return ScenarioTest(len(plain), survived, len(pushed), recovered, failures, tuple(scenarios.ranges))


def worst_walk(walks: Sequence[Walk], tolerance: float) -> Walk | None:
    """Return the shortest walk that ends early, otherwise the one that violates the tolerance most, or None.

    Examples
    --------
    >>> walks = [Walk(Scenario({"friction": mu}), 20, size) for mu, size in ((0.1, 0.2), (0.2, 0.0))]
    >>> worst_walk(walks, 1e-3).scenario.parameters
    {'friction': 0.1}
    """
    failed = [walk for walk in walks if not walk.distance <= tolerance]
    return min(failed, key=lambda walk: (walk.steps, -walk.distance), default=None)
