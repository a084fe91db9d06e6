"""Simulated walks of optimised gaits of robots with several contacts, under their torques or a feedback law."""

from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, TypeGuard

import numpy as np

from gaitopt.errors import InputError

if TYPE_CHECKING:
    from gaitopt.control.planar_laws.planar_law import PlanarLaw
    from gaitopt.model.terrain import Terrain
    from gaitopt.motion.motion import Array
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
    from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine
    from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout, StepObserver
    from gaitopt.simulation.planar_simulation.planar_state import PlanarState
    from gaitopt.status import Stop


def is_planar_gait(stated: object) -> "TypeGuard[PlanarProblem | PlanarGait]":
    """Return whether a script or file states an optimal gait of a robot with several contacts."""
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem

    return isinstance(stated, PlanarProblem | PlanarGait)


def find_planar_gait(stated: "PlanarProblem | PlanarGait") -> "PlanarGait":
    """Return a gait, or the solved gait of a problem; raise InputError if it is not a solution.

    An interrupt of the solve raises KeyboardInterrupt.
    """
    from gaitopt.motion.planar_gait import PlanarGait
    from gaitopt.ocp.multicontact.planar_solver import solve_planar
    from gaitopt.status import Status

    gait = stated if isinstance(stated, PlanarGait) else solve_planar(stated)
    if gait is not stated and gait.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    return gait.require()


def simulate_planar_gait(
    gait: "PlanarGait",
    law: "PlanarLaw",
    changes: Mapping[str, float],
    values: Mapping[str, float],
    *,
    steps: int,
    terrain: "Terrain | None" = None,
    engine: "PlanarEngine",
    observer: "StepObserver",
) -> "PlanarRollout":
    """Return the simulation of some steps from the planned state under a law.

    Parameters
    ----------
    gait : PlanarGait
    law : PlanarLaw
    changes : mapping of str to float
        New values of coordinates and rates at the start; the others change as little as possible, such that the feet on
        the ground stay there.
    values : mapping of str to float
        Parameters of robot and ground in the walk, which the law does not know.
    steps : int
        Number of periods; the simulation ends right after the last one.
    terrain : Terrain, optional
        The ground on which the walk is simulated; the gait is that on plane ground.
    engine : PlanarEngine
    observer : callable
        Called with (steps done, steps in all).

    Raises
    ------
    InputError
        If a name is unknown, or the feet of the gait cannot stand on the ground in any state with the changed values.
    """
    from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton

    first = gait.motion.segments[0]
    y, n = np.concatenate([first.q[:, 0], first.v[:, 0]]), gait.robot.n_q
    if changes:
        y = _change_start(gait, law, y, changes)
    automaton = PlanarAutomaton(gait.robot, values, law, terrain, engine=engine)
    return follow_steps(automaton, automaton.begin(y[:n], y[n:]), (law.section, gait.period), steps, observer)


def follow_steps(
    automaton: "PlanarAutomaton",
    state: "PlanarState | Stop",
    gait: tuple[str, float],
    steps: int,
    observer: "StepObserver",
) -> "PlanarRollout":
    """Return the simulation of some steps from a state, which ends right after the last one or if they take too long.

    At Ctrl-C it ends with the last event.

    Parameters
    ----------
    automaton : PlanarAutomaton
    state : PlanarState or Stop
    gait : (str, float)
        Event that ends the first step (the event of the other leg ends the second one, and so on), and the period of
        the gait near which the robot walks [s].
    steps : int
    observer : callable
        Called with (steps done, steps in all).
    """
    from gaitopt.simulation.planar_simulation.planar_simulator import follow
    from gaitopt.simulation.planar_simulation.planar_walker import LONGEST, MOST_EVENTS
    from gaitopt.status import Stop

    section, period = gait
    most: dict[str, Any] = {"duration": steps * LONGEST * period, "most_events": steps * MOST_EVENTS}
    walk = follow(automaton, state, until=section, steps=steps, observer=observer, **most)
    ends = {Stop.EVENT_REACHED: Stop.STEPS_DONE, Stop.DURATION_DONE: Stop.NO_TOUCHDOWN}
    return replace(walk, stop=ends.get(walk.stop, walk.stop))


def _change_start(gait: "PlanarGait", law: "PlanarLaw", y: "Array", changes: Mapping[str, float]) -> "Array":
    """Return the planned state right after the section with some values changed."""
    from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
    from gaitopt.simulation.planar_simulation.planar_simulator import follow
    from gaitopt.stability.planar_gaits.planar_section import section_of
    from gaitopt.stability.planar_gaits.state_change import change_state, check_state_changes
    from gaitopt.status import Stop

    check_state_changes(gait.robot, changes)
    automaton, n = PlanarAutomaton(gait.robot, gait.motion.parameters, law), gait.robot.n_q
    period = follow(automaton, automaton.begin(y[:n], y[n:]), duration=2 * gait.period, until=law.section)
    if period.stop is not Stop.EVENT_REACHED:
        raise InputError(f"The state cannot be changed: the gait does not complete its first step. {period.stop.hint}")
    changed = change_state(section_of(automaton, period), y, changes)
    if changed is None:
        listed = ", ".join(f"{name} = {value:g}" for name, value in changes.items())
        raise InputError(
            f"No state near the gait with {listed} keeps its feet on the ground; choose values closer to the gait."
        )
    return changed
