"""The largest value of the condition that arms a contact within the limits of the coordinates."""

import math
from collections.abc import Iterator, Mapping

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem

TOLERANCE = 1e-6
"""Value by which `armed` may exceed its range: that of the constraints of a solution."""

IN_DEGREES = 1.0
"""Least threshold that may have been stated in degrees [rad]."""

_ARITHMETIC = frozenset(
    {ca.OP_INPUT, ca.OP_OUTPUT, ca.OP_CONST, ca.OP_ADD, ca.OP_SUB, ca.OP_MUL, ca.OP_DIV, ca.OP_NEG, ca.OP_TWICE}
)
"""Operations whose expressions are smooth: those with constant derivatives are affine."""


@dataclass(frozen=True)
class ArmingRange:
    """The range of the condition that arms a contact.

    Attributes
    ----------
    largest : float
        Largest value of `armed` within the limits; infinite if it is not known.
    coordinates : tuple of str
        Coordinates on which it depends.
    """

    largest: float
    coordinates: tuple[str, ...] = ()


UNKNOWN = ArmingRange(math.inf)


def explain_unreachable_arming(problem: PlanarProblem) -> str | None:
    """Return the contacts that must close although `armed` is too small everywhere within the limits, or None.

    Parameters
    ----------
    problem : PlanarProblem
        A problem with a closed contact sequence.

    Examples
    --------
    >>> from gaitopt.model.robots.flat_foot_walker import flat_foot_walker
    >>> from gaitopt.ocp import PlanarLimits
    >>> problem = PlanarProblem(
    ...     robot=flat_foot_walker(), sequence="heel A stick |", speed=0.5, parameters={"clearance_angle": 5},
    ...     limits=PlanarLimits(coordinate={"a": (-0.6, 0.6), "b": (-0.6, 0.6)}))
    >>> print(explain_unreachable_arming(problem))
    heel B must close, which requires that `armed` is at least 0.001 (Margins.touchdown_armed), but within \
PlanarLimits.coordinate, a in (-0.6, 0.6) rad and b in (-0.6, 0.6) rad, it is at most -3.8: decrease the threshold in \
`armed`, or extend the limits. If clearance_angle = 5 rad is in degrees, state 0.08727 rad
    """
    least = problem.margins.touchdown_armed
    ranges = {name: find_arming_range(problem, name, problem.values) for name in _list_conditional_touchdowns(problem)}
    worst = min(ranges.values(), key=lambda each: each.largest, default=UNKNOWN)
    if worst.largest >= least - TOLERANCE:
        return None
    names = [name for name, each in ranges.items() if each == worst]
    bounds = problem.limits.coordinate
    units = dict(zip(problem.robot.coordinates, problem.robot.units, strict=True))
    limits = [f"{name} in ({bounds[name][0]:g}, {bounds[name][1]:g}) {units[name]}" for name in worst.coordinates]
    return (
        f"{' and '.join(names)} must close, which requires that `armed` is at least {least:g} "
        f"(Margins.touchdown_armed), but within PlanarLimits.coordinate, {' and '.join(limits)}, it is at most "
        f"{worst.largest:.4g}: decrease the threshold in `armed`, or extend the limits"
        f"{''.join(_suggest_radians(problem, names[0]))}"
    )


def find_arming_range(problem: PlanarProblem, contact: str, values: Mapping[str, float]) -> ArmingRange:
    """Return the range of the condition of a contact if it is affine in the coordinates; otherwise it is not known.

    Parameters
    ----------
    problem : PlanarProblem
    contact : str
    values : mapping of str to float
        Values of all parameters; a condition that depends on free ones has no known range.
    """
    robot = problem.robot
    q, v, p = ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q), ca.SX(robot.vector(values))
    free = ca.SX.sym("free", len(problem.free))
    for number, name in enumerate(problem.free):
        p[robot.index(name)] = free[number]
    armed = robot.arming(q, v, p)[robot.contact_index(contact)]
    slopes, function = ca.jacobian(armed, q), ca.Function("armed", [q, v, free], [armed])
    operations = {function.instruction_id(step) for step in range(function.n_instructions())}
    if not operations <= _ARITHMETIC or not slopes.is_constant() or ca.depends_on(armed, ca.vertcat(v, free)):
        return UNKNOWN
    slope = np.array(ca.DM(slopes)).ravel()
    places = np.flatnonzero(slope)
    if not places.size:
        return UNKNOWN
    ends = slope[places, None] * np.array(problem.limits.coordinates(robot.coordinates))[places]
    largest = float(function(0, 0, 0)) + float(ends.max(axis=1).sum())
    return ArmingRange(largest, tuple(robot.coordinates[place] for place in places))


def _list_conditional_touchdowns(problem: PlanarProblem) -> Iterator[str]:
    """Yield the contacts with a condition under which they close, at each event at which they do."""
    robot, sequence = problem.robot, problem.sequence
    for number, before in enumerate(sequence.states(robot)):
        is_impact = sequence.events[number].impact
        after = sequence.outcome(robot, number) if is_impact else sequence.state_after(robot, number)
        for contact in robot.contacts:
            closes = before.mode(contact.name) is Mode.FREE and after.mode(contact.name) is not Mode.FREE
            if contact.conditional and closes:
                yield contact.name


def _suggest_radians(problem: PlanarProblem, contact: str) -> Iterator[str]:
    """Yield the value in rad of each angle with which the contact can close if the present value is in degrees."""
    values, least = problem.values, problem.margins.touchdown_armed
    for parameter in problem.robot.parameters:
        name, value = parameter.name, values[parameter.name]
        if parameter.unit == "rad" and IN_DEGREES <= abs(value) < math.inf:
            meant = math.radians(value)
            if least <= find_arming_range(problem, contact, {**values, name: meant}).largest < math.inf:
                yield f". If {name} = {value:g} rad is in degrees, state {meant:.4g} rad"
