"""The momentum balance of a periodic gait along the ground, which excludes one-way slip and steep slopes."""

from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.solution.impossible_sequences import (
    describe_one_way_slip,
    describe_steep_slope,
    is_free_along_ground,
)


def explain_imbalance(problem: PlanarProblem) -> str | None:
    """Return why no periodic gait of a problem exists: friction does not balance gravity along the ground.

    In a period the momentum along the ground does not change.  Friction is at most mu times the normal force, so that
    tan(slope) is at most mu.  If all contacts on the ground slip forward in all phases and impacts, friction is -mu
    times the normal force at all times, and the balance mu cos(slope) = sin(slope) does not depend on the motion.

    Returns
    -------
    str or None
        None if the balance is possible, if friction or slope are free, or if other forces act along the ground.

    Examples
    --------
    >>> from gaitopt.model.robots.monopod import monopod
    >>> problem = PlanarProblem(robot=monopod(), sequence="foot slip+ > flight |", friction=0.3, speed=1.5)
    >>> print(explain_imbalance(problem))
    all contacts slip forward all the time: friction 0.3 then changes the momentum along the ground in every step, and \
no periodic gait exists unless friction is tan(slope) = 0
    >>> explain_imbalance(problem.replace(sequence="foot stick > flight |")) is None
    True
    """
    robot, sequence = problem.robot, problem.sequence
    if robot.travel is None or {"friction", "slope"} & set(problem.free):
        return None
    steep = describe_steep_slope(problem.values)
    sign = 0 if sequence.is_open else _find_only_slip(problem)
    place = robot.coordinates.index(robot.travel)
    if not (steep or sign) or not is_free_along_ground(robot, problem.values, place):
        return None
    return steep or describe_one_way_slip(sign, problem.friction, problem.slope) or None


def _find_only_slip(problem: PlanarProblem) -> int:
    """Return the direction in which all contacts on the ground slip at all times; 0 if there is none."""
    robot, sequence = problem.robot, problem.sequence
    states = list(sequence.states(robot))
    states += [sequence.outcome(robot, number) for number, event in enumerate(sequence.events) if event.impact]
    signs = {sign for state in states for sign in _slip_signs(problem, state)}
    return signs.pop() if len(signs) == 1 else 0


def _slip_signs(problem: PlanarProblem, state: ContactState) -> set[int]:
    """Return the directions in which the closed contacts on the ground slip; 0 stands for stick."""
    modes = zip(state.modes, problem.robot.contacts, strict=True)
    return {mode.sign for (_, mode), contact in modes if contact.slides and mode is not Mode.FREE}
