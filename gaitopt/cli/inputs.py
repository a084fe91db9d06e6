"""What a command on walks works on: a walking problem script or a saved gait."""

import itertools
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from gaitopt.cli.law import read_pairs
from gaitopt.cli.script import call_script, robot_of
from gaitopt.control.law import Law, feedforward, passive
from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import Robot
from gaitopt.motion.archive import load
from gaitopt.motion.gait import Gait
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import engine_named
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.cycle_search import search_cycles, sort_cycles
from gaitopt.stability.section import Section
from gaitopt.stability.walk_problem import WalkProblem
from gaitopt.study.basins.basin_file import Basin

AT_HOME = 1e-4
"""Largest difference of the state after touchdown from that of a gait in which a walk has ended."""


@dataclass(frozen=True, eq=False)
class CommandInput:
    """What a command works on: a walker, and a gait to start from if there is one."""

    robot: Robot
    parameters: dict[str, float]
    law: Law
    engine: Engine
    gaits: tuple[Cycle, ...]


def read_input(
    source: Path,
    settings: list[str],
    engine: str,
    starts: int,
    *,
    script: Path | None = None,
    first: bool = False,
    feedback: Callable[[Gait, Robot], Law] | None = None,
) -> CommandInput:
    """Return what a script or a saved gait describes, with its gaits if `starts` > 0: all, or the first one found.

    `engine` names the engine to walk with, as :func:`gaitopt.simulation.engine_choice.engine_named` takes it.
    `feedback` makes the law of a saved gait, whose torques are played back without it; `script` has its robot, where
    that is not in the catalogue.
    """
    if source.suffix != ".py":
        if settings:
            raise InputError("--set changes parameters of a script; a saved gait has none to change.")
        gait = load(source)
        robot = robot_of(gait, script)
        law = feedforward(robot, gait.motion) if feedback is None else feedback(gait, robot)
        chosen = engine_named(engine, law, robot)
        cycle = assess_stability(gait, law, robot=robot, engine=chosen)
        return CommandInput(robot, gait.motion.parameters, law, chosen, (cycle,))
    if script is not None:
        raise InputError("--problem names the robot of a saved gait; a script has its own.")
    if feedback is not None:
        raise InputError("--law is for a saved gait; the law of a walking problem is named in its script.")
    problem = call_script(source, settings)
    if not isinstance(problem, WalkProblem):
        kind = type(problem).__name__
        raise InputError(f"{source} returns a {kind}, not a WalkProblem; solve it first and name the gait file.")
    law = problem.law or passive(problem.robot)
    chosen = engine_named(engine, law, problem.robot)
    found: Iterator[Cycle] = iter(())
    if starts:
        wanted = None if problem.sequence is None else str(problem.sequence)
        search = search_cycles(problem.robot, problem.parameters, law=law, starts=starts, engine=chosen)
        found = (
            cycle for cycle in search if wanted is None or {str(sequence) for sequence in cycle.sequences} == {wanted}
        )
    gaits = tuple(itertools.islice(found, 1)) if first else sort_cycles(found)
    return CommandInput(problem.robot, dict(problem.parameters), law, chosen, gaits)


def share_at(found: Basin, names: Sequence[str], gait: Cycle) -> float | None:
    """Return the share of the walks computed that ended in a gait: another one may have the same contact sequence."""
    done = found.final[~found.pending()]
    home = np.array([gait.state.get(name, 0.0) for name in names])
    return float(np.mean(np.max(np.abs(done - home), axis=1) <= AT_HOME)) if done.size else None


def coordinates_missing(state: list[str] | None, axes: dict[str, Any]) -> bool:
    """Return whether a start leaves coordinates open that a gait must fill in: it does unless some are named."""
    return not state and len(axes) < 2


def read_start(subject: CommandInput, p: np.ndarray, settings: list[str]) -> np.ndarray:
    """Return the start on the section with foot speed: the first gait's, with some coordinates changed."""
    names = Section(subject.robot, p, sliding=True).names
    given = read_pairs(settings)
    for name in given:
        if name not in names:
            raise InputError(
                f"The section of {subject.robot.name!r} has no coordinate {name!r}. {suggest(name, names)}"
            )
    values = {"foot_speed": 0.0, **(subject.gaits[0].state if subject.gaits else {}), **given}
    missing = [name for name in names if name not in values]
    if missing:
        raise InputError(f"No gait was found to start from; give the start with --state {missing[0]}=VALUE and so on.")
    return np.array([values[name] for name in names])
