"""Derivatives of return maps by central differences, for comparison with exact ones."""

from dataclasses import replace

import numpy as np

from gaitopt.simulation.planar_simulation.planar_automaton import PlanarAutomaton
from gaitopt.simulation.planar_simulation.planar_simulator import follow
from gaitopt.stability.planar_gaits.planar_section import PlanarSection


def planar_differences(robot, cycle, torque=None, step=1e-6):
    """Return the difference quotient of a planar robot's return map on its section, in the basis of a cycle."""
    automaton = PlanarAutomaton(robot, cycle.parameters, torque)
    y, n = np.array([*cycle.state.values()]), robot.n_q
    first = follow(automaton, automaton.begin(y[:n], y[n:]), duration=20.0, until=cycle.section)
    section = PlanarSection(automaton, first.arcs[-1], first.motion.events[-1], robot.mirror)
    start, columns = section.exchange(first.end), []
    for direction in cycle.basis.T:
        ends = []
        for sign in (1, -1):
            near = section.correct(y + sign * step * direction)
            state = automaton.restart(replace(start, q=near[:n], v=near[n:]))
            state = automaton.events.choose(state, start.closed, start.latched, {})
            rollout = follow(automaton, state, duration=20.0, until=cycle.section)
            ends.append(section.project(section.exchange(rollout.end).y))
        columns.append(cycle.basis.T @ (ends[0] - ends[1]) / (2 * step))
    return np.column_stack(columns)


def map_differences(return_map, z, step=1e-6):
    """Return the difference quotient of a return map at a point of its section."""
    units = np.eye(len(z))
    return np.column_stack(
        [(return_map(z + step * unit).end - return_map(z - step * unit).end) / (2 * step) for unit in units]
    )
