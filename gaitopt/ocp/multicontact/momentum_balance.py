"""The momentum balance of a periodic gait along the ground, which excludes slip in one direction only."""

import math

import numpy as np

from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.solution.impossible_sequences import describe_one_way_slip


def explain_one_way_slip(problem: PlanarProblem) -> str | None:
    """Return why no periodic gait has the contact sequence of a problem: its feet slip in one direction only.

    In a period the momentum along the ground does not change.  If all contacts on the ground slip forward in all
    phases and impacts, friction is -mu times the normal force at all times, so that the balance
    mu cos(slope) = sin(slope) does not depend on the motion.

    Returns
    -------
    str or None
        None if the sequence contains stick, slip in both directions or no contact with the ground, if friction or
        slope are free, or if the balance is satisfied.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> problem = PlanarProblem(robot=monopod(), sequence="foot slip+ > flight |", friction=0.3, speed=1.5)
    >>> print(explain_one_way_slip(problem))
    all contacts slip forward all the time: friction 0.3 then changes the momentum along the ground in every step, and \
no periodic gait exists unless friction is tan(slope) = 0
    >>> explain_one_way_slip(problem.replace(sequence="foot stick > flight |")) is None
    True
    """
    robot, sequence = problem.robot, problem.sequence
    if robot.travel is None or sequence.is_open or {"friction", "slope"} & set(problem.free):
        return None
    states = list(sequence.states(robot))
    states += [sequence.outcome(robot, number) for number, event in enumerate(sequence.events) if event.impact]
    signs = {sign for state in states for sign in _slip_signs(problem, state)}
    if len(signs) != 1 or 0 in signs or not _is_free_along_ground(problem):
        return None
    return describe_one_way_slip(signs.pop(), problem.friction, problem.slope) or None


def _slip_signs(problem: PlanarProblem, state: ContactState) -> set[int]:
    """Return the directions in which the closed contacts on the ground slip; 0 stands for stick."""
    modes = zip(state.modes, problem.robot.contacts, strict=True)
    return {mode.sign for (_, mode), contact in modes if contact.slides and mode is not Mode.FREE}


def _is_free_along_ground(problem: PlanarProblem) -> bool:
    """Return whether only gravity and contacts act on the robot along the ground: no spring, drag or actuator."""
    robot = problem.robot
    p, place = robot.vector(problem.values), robot.coordinates.index(robot.travel or "")
    poses = np.random.default_rng(0).uniform(-0.3, 0.3, (2, robot.n_q))
    forward, still = np.eye(robot.n_q)[place], np.zeros(robot.n_q)
    moved = poses + forward
    potential = [[float(robot.energy(q, still, p)[1]) for q in group] for group in (poses, moved)]
    change = np.diff(potential, axis=0)
    weight = float(robot.mass(p)) * problem.values["gravity"]
    actuation = [np.asarray(robot.dynamics(q, still, p)[2])[place] for q in poses]
    drag = [np.asarray(robot.dynamics(q, q + forward, p)[1] - robot.dynamics(q, q, p)[1]) for q in poses]
    is_free = np.allclose(change, -weight * math.sin(problem.slope), atol=1e-9 * weight)
    return is_free and np.allclose(drag, 0.0, atol=1e-9 * weight) and np.allclose(actuation, 0.0, atol=1e-9)
