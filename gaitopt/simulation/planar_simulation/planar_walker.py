"""Walks of a planar robot in steps, each from right after one section to right after the next one."""

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import casadi as ca

from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.model.planar.mirror import Mirror
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_engine import REFERENCE, PlanarEngine
from gaitopt.simulation.planar_simulation.planar_simulator import PlanarRollout, follow
from gaitopt.simulation.planar_simulation.planar_state import PlanarState
from gaitopt.status import Stop

LONGEST = 3.0
"""Longest duration of a step, in periods of the gait."""

TOLERANCE = 1e-8
"""Relative tolerance of the integration of a walk, which is simulated for many steps or from many states."""

MOST_EVENTS = 100
"""Number of events after which a step ends; a foot that chatters on the ground would otherwise take minutes."""

SAMPLES = 5000
"""Largest number of samples of a phase of a walk, about ten times that of a gait; a robot that exceeds it
spins or chatters."""


class PlanarWalkStep(NamedTuple):
    """One step: its motion, and the state after it or the reason why the step is incomplete.

    Attributes
    ----------
    rollout : PlanarRollout
    stop : Stop or None
        None if the step ended at the section.
    following : PlanarState or None
        State after the exchange of the legs, at time 0.
    """

    rollout: PlanarRollout
    stop: Stop | None
    following: PlanarState | None


class PlanarWalker:
    """A planar robot with given parameters under a torque, which takes steps.

    Parameters
    ----------
    robot : PlanarRobot
    torque : Function, PlanarLaw or None
        As for :func:`gaitopt.simulation.simulate_planar`.
    parameters : mapping of str to float
        All parameters of robot and ground.
    section : str
        Event that ends a step, such as ``"foot B closes"``.
    period : float [s]
        Period of the gait near which the robot walks: a step that takes three times as long ends the walk.
    engine : PlanarEngine
        By default the reference engine.
    """

    def __init__(
        self,
        robot: PlanarRobot,
        torque: ca.Function | PlanarLaw | None,
        parameters: Mapping[str, float],
        *,
        section: str,
        period: float,
        engine: PlanarEngine = REFERENCE,
    ) -> None:
        self.robot, self.section, self.duration = robot, section, LONGEST * period
        options: dict[str, Any] = {"tolerance": TOLERANCE, "samples": SAMPLES, "engine": engine}
        self.automaton = PlanarAutomaton(robot, parameters, torque, **options)

    def walk_step(self, state: PlanarState) -> PlanarWalkStep:
        """Simulate one step from a state right after the section and the exchange of the legs."""
        rollout = simulate_period(self.automaton, state, self.section, self.duration)
        if rollout.stop is not Stop.EVENT_REACHED or rollout.end is None:
            return PlanarWalkStep(rollout, NO_STEP.get(rollout.stop, rollout.stop), None)
        return PlanarWalkStep(rollout, None, exchange_legs(rollout.end, self.robot, self.robot.mirror))


NO_STEP = {Stop.DURATION_DONE: Stop.NO_TOUCHDOWN}
"""Reasons why a step does not reach its section, by the reasons of the simulation."""


def simulate_period(automaton: PlanarAutomaton, state: PlanarState, section: str, longest: float) -> PlanarRollout:
    """Return the motion until a section from a state with known closed contacts, whose modes follow from friction.

    It ends after twice as many samples as the automaton accepts in a phase.
    """
    state, most = automaton.restart(state), math.inf if automaton.samples is None else 2 * automaton.samples
    chosen = automaton.events.choose(state, state.closed, state.latched, {})
    return follow(automaton, chosen, duration=longest, until=section, most_events=MOST_EVENTS, most_samples=most)


def exchange_legs(state: PlanarState, robot: PlanarRobot, mirror: Mirror | None) -> PlanarState:
    """Return a state of a robot with legs exchanged by a mirror, at time 0."""
    if mirror is None:
        return PlanarState(0.0, state.q, state.v, state.contacts, state.extended)
    names = [name for name, _ in state.contacts.modes]
    modes = tuple((name, state.modes[place]) for name, place in zip(names, mirror.contacts, strict=True))
    q, v = mirror.coordinates @ state.q, mirror.coordinates @ state.v
    extended = tuple(state.extended[place] for place in _find_mirrored_springs(robot, mirror))
    return PlanarState(0.0, q, v, type(state.contacts)(modes), extended)


def _find_mirrored_springs(robot: PlanarRobot, mirror: Mirror) -> list[int]:
    """Return for each switched spring its counterpart: the spring that the mirrored contact turns off.

    Springs of one contact are exchanged with those of the other one in their order.
    """
    names, springs = robot.contact_names, list(enumerate(robot.switches))
    places = []
    for number, contact in springs:
        mirrored = names[mirror.contacts[names.index(contact)]]
        order = sum(name == contact for name in robot.switches[:number])
        counterparts = [place for place, name in springs if name == mirrored]
        places.append(counterparts[order] if order < len(counterparts) else number)
    return places
