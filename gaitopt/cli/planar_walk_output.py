"""Simulated walks of robots with several contacts: start at a periodic gait, and output."""

from collections import Counter
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rich import box
from rich.table import Table

from gaitopt.cli.output import out, print_json, report_file
from gaitopt.cli.planar_gait_walk import follow_steps
from gaitopt.errors import InputError, NoGaitError, suggest
from gaitopt.motion.planar_motion import PlanarMotion
from gaitopt.motion.planar_steps import number_steps

if TYPE_CHECKING:
    from gaitopt.model.terrain import Terrain
    from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout, StepObserver
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem

STARTS = 8
"""Starts of the search for the gait in which a simulation begins."""


def simulate_planar_walk(
    problem: "PlanarWalkProblem",
    changes: dict[str, float],
    *,
    steps: int,
    engine: str,
    terrain: "Terrain | None" = None,
    observer: "StepObserver" = lambda done, total: None,
) -> "PlanarRollout":
    """Return the simulation of some periods from the first periodic gait, with some coordinates or rates changed.

    Parameters
    ----------
    problem : PlanarWalkProblem
    changes : dict of str to float
        New values by the names of the state [m, rad; m/s, rad/s].
    steps : int
        Number of periods; the simulation ends right after the last one.
    engine : str
    terrain : Terrain, optional
        The ground on which the walk is simulated; the gait is that on a plane.
    observer : callable
        Called with (steps done, steps in all).

    Raises
    ------
    InputError
        If no periodic gait is found, a name is unknown, or the engine is unknown or not installed.
    """
    from gaitopt.model.contacts.mode import Mode
    from gaitopt.simulation.engine_choice import planar_engine_named
    from gaitopt.simulation.planar_simulation.placement import place_planar
    from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton

    chosen, robot = planar_engine_named(engine), problem.robot
    for name in changes:
        if name not in robot.state_names:
            raise InputError(f"--state: there is no coordinate {name!r}. {suggest(name, robot.state_names)}")
    ground = {**problem.parameters, "terrain": terrain}
    cycle = next(problem.search(STARTS, engine=chosen), None)
    if cycle is None:
        raise NoGaitError("No periodic gait was found as the start of the walk; try another slope, friction or state.")
    first = cycle.motion.segments[0]
    q, v, modes = first.q[:, 0], first.v[:, 0], first.state.modes
    if changes:
        known = dict(zip(robot.state_names, [*q.tolist(), *v.tolist()], strict=True)) | changes
        coordinates = {name: known[name] for name in robot.coordinates if {name} & {*problem.coordinates, *changes}}
        rates = {name: known[f"{name}_rate"] for name in robot.coordinates if _is_stated(problem, changes, name)}
        feet = [name for name, mode in modes if mode not in (Mode.FREE, Mode.LATCHED)]
        q, v = place_planar(robot, coordinates, rates, ground, on=feet)
    latched = tuple(name for name, mode in modes if mode is Mode.LATCHED)
    automaton = PlanarAutomaton(robot, problem.parameters, problem.torque, terrain, engine=chosen)
    start, gait = automaton.begin(q, v, latched=latched), (problem.section, cycle.period)
    return follow_steps(automaton, start, gait, steps, observer)


def _is_stated(problem: "PlanarWalkProblem", changes: dict[str, float], name: str) -> bool:
    return name in problem.rates or f"{name}_rate" in changes


def report_planar_walk(
    walk: "PlanarRollout", section: tuple[str, ...], written: Path | None, *, engine: str, json: bool
) -> None:
    """Print the events of a walk and its engine as JSON or as a table; `section` as in :func:`split_steps`."""
    from gaitopt.motion.planar_gait_summary import event_facts
    from gaitopt.motion.summary import ledger_facts

    if json:
        parts, complete = split_steps(walk.motion, section)
        facts: dict[str, Any] = {
            "engine": engine,
            "stop": walk.stop.key,
            "hint": walk.stop.hint,
            "steps": complete,
        }
        facts |= {
            "sequences": [part.sequence for part in parts],
            "events": [event_facts(walk.motion, event) for event in walk.motion.events],
        }
        facts |= {"energy": ledger_facts(walk.motion.ledger()), "file": None if written is None else str(written)}
        print_json(facts)
        return
    print_planar_walk(walk, engine)
    if written is not None:
        report_file(written)


def split_steps(motion: PlanarMotion, section: tuple[str, ...]) -> tuple[list[PlanarMotion], int]:
    """Return the motion of each step of a walk, and the number of complete steps: the last one may be incomplete.

    Parameters
    ----------
    motion : PlanarMotion
    section : tuple of str
        Events that end the steps in turn, as returned by :func:`list_section_events` of the simulation.
    """
    numbers, parts, begin = number_steps(motion, section), list[PlanarMotion](), 0
    for count in Counter(numbers).values():
        kept = slice(begin, begin + count)
        parts.append(replace(motion, segments=motion.segments[kept], events=motion.events[kept]))
        begin += count
    ends = motion.events[len(motion.segments) - 1 :]
    unfinished = numbers and not (ends and ends[0].includes(section[numbers[-1] % len(section)]))
    return parts, len(parts) - bool(unfinished)


def print_planar_walk(walk: "PlanarRollout", engine: str) -> None:
    """Print the events of a walk and its engine as a table, and the reason of its end."""
    table = Table(box=box.SIMPLE, pad_edge=False, title=f"events (engine {engine})", title_justify="left")
    for column in ("time [s]", "event", "contacts afterwards", "energy lost [J]"):
        table.add_column(column)
    for event in walk.motion.events:
        closed = ", ".join(f"{name} {mode.value}" for name, mode in event.after.modes if name in event.after.closed)
        lost = f"{event.energy_lost:.6g}" if event.is_impact else ""
        table.add_row(f"{event.time:.6f}", " & ".join(event.names), closed or "flight", lost)
    out.print(table)
    out.print(walk.stop.hint)
