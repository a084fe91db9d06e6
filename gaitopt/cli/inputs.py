"""Inputs of a command on walks: a walking problem script or a saved gait."""

import functools
import itertools
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any, cast

from gaitopt.cli.script import (
    ROBOT_OF_SCRIPT,
    load_any_gait,
    read_script,
    require_single_support,
    require_walk_problem,
)
from gaitopt.control.law import Law, feedforward, passive
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.gait import Gait
from gaitopt.motion.planar_gait import AnyGait, PlanarGait
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import engine_named, planar_engine_named
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.cycle_search import search_cycles, sort_cycles
from gaitopt.stability.planar_gaits.planar_assessment import assess_planar
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem
from gaitopt.stability.walk_problem import WalkProblem


@dataclass(frozen=True, eq=False)
class CommandInput:
    """A walker under a law, and the periodic gaits that are known."""

    robot: Robot
    parameters: dict[str, float]
    law: Law
    engine: Engine
    gaits: tuple[Cycle, ...]

    @property
    def cycle(self) -> Cycle | None:
        """The first periodic gait, if there is one."""
        return self.gaits[0] if self.gaits else None


@dataclass(frozen=True, kw_only=True)
class Request:
    """The options that select the input of a command.

    Attributes
    ----------
    source : Path
        Walking problem script or gait file.
    settings : list of str
        ``NAME=VALUE`` for a script.
    script : Path or None
        Problem script with the robot of a saved gait, where its file does not contain the robot.
    engine : str
        As :func:`gaitopt.simulation.engine_choice.engine_named` takes it.
    feedback : callable or None
        Makes the law of a saved gait; without it the torques are replayed.
    """

    source: Path
    settings: list[str]
    script: Path | None = None
    engine: str = "auto"
    feedback: Callable[[AnyGait, Any], Any] | None = None

    @property
    def is_script(self) -> bool:
        """Whether the source is a script."""
        return self.source.suffix == ".py"

    @functools.cached_property
    def stated(self) -> object:
        """The problem that the script states.

        Raises
        ------
        InputError
            If an option does not apply to a script, or the script is invalid.
        """
        if self.script is not None:
            raise InputError(ROBOT_OF_SCRIPT)
        return read_script(self.source, self.settings)()

    @functools.cached_property
    def gait(self) -> AnyGait:
        """The saved gait.

        Raises
        ------
        InputError
            If an option does not apply to a saved gait, or the file or the script of its robot is invalid.
        """
        if self.settings:
            raise InputError("--set changes the parameters of a script; it is not accepted for a saved gait.")
        return load_any_gait(self.source, self.script)

    @functools.cached_property
    def problem(self) -> WalkProblem | PlanarWalkProblem:
        """The walking problem of a script.

        Raises
        ------
        InputError
            If an option does not apply to a script, or the script is invalid.
        """
        stated = self.stated
        if self.feedback is not None and isinstance(stated, WalkProblem | PlanarWalkProblem):
            raise InputError(
                "--law is accepted for a saved gait only; the law of a walking problem without optimisation "
                f"({type(stated).__name__}) is defined in its script."
            )
        return require_walk_problem(stated, read_script(self.source, self.settings))


def read_input(request: Request, starts: int, *, steps: int = 1, first: bool = False) -> CommandInput:
    """Return the walker of a script or a saved gait, with its periodic gaits.

    Parameters
    ----------
    request : Request
    starts : int
        Random starts of the search for the gaits of a script; 0 for no search.
    steps : int
        Longest period of the gaits of a script.
    first : bool
        Whether the first gait is enough.

    Raises
    ------
    InputError
        If an option does not apply to the source, or the source is invalid.
    """
    return _of_script(request, starts, steps, first) if request.is_script else _of_gait(request)


def read_walk(request: Request) -> tuple[WalkProblem | PlanarWalkProblem, Cycle | PlanarCycle]:
    """Return the walk of a saved gait under the law of the request, and its periodic gait.

    Parameters
    ----------
    request : Request
        With a gait file as its source.

    Raises
    ------
    InputError
        If an option does not apply to a saved gait, or the gait or its law is invalid.
    """
    gait = request.gait
    if not isinstance(gait, PlanarGait):
        subject = read_input(request, 0)
        return WalkProblem(robot=subject.robot, parameters=subject.parameters, law=subject.law), subject.gaits[0]
    law = None if request.feedback is None else request.feedback(gait, gait.robot)
    problem = PlanarWalkProblem.from_gait(gait, law)
    return problem, assess_planar(gait, law, engine=planar_engine_named(request.engine))


def _of_gait(request: Request) -> CommandInput:
    gait = cast(Gait, request.gait)  # commands read gaits of robots with several contacts otherwise
    robot = gait.robot
    law = feedforward(robot, gait.motion) if request.feedback is None else request.feedback(gait, robot)
    engine = engine_named(request.engine, law, robot)
    cycle = assess_stability(gait, law, engine=engine)
    return CommandInput(robot, gait.motion.parameters, law, engine, (cycle,))


def _of_script(request: Request, starts: int, steps: int, first: bool) -> CommandInput:
    problem = require_single_support(request.problem, request.source)
    law = problem.law or passive(problem.robot)
    engine = engine_named(request.engine, law, problem.robot)
    cycles: Iterator[Cycle] = iter(())
    if starts:
        sequence = None if problem.sequence is None else str(problem.sequence)
        cycles = search_cycles(problem.robot, problem.parameters, law=law, steps=steps, starts=starts, engine=engine)
        cycles = (
            cycle for cycle in cycles if sequence is None or {str(each) for each in cycle.sequences} == {sequence}
        )
    gaits = tuple(itertools.islice(cycles, 1)) if first else sort_cycles(cycles)
    return CommandInput(problem.robot, dict(problem.parameters), law, engine, gaits)
