"""Laws of robots with several contacts as functions of a phase variable instead of the time since the section.

A period is divided into stretches with one phase variable each: the phases between two impacts that share a stance
contact, and the flights.  In flight no stance contact exists; the phase variable is the velocity of the centre of mass
towards the ground there, which grows at the constant rate g cos(slope) in every flight.
"""

import functools
import re
from collections.abc import Callable
from dataclasses import replace
from typing import TypeAlias

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_feedback import find_section
from gaitopt.control.planar_laws.planar_law import PlanarLaw, PlannedImpulses
from gaitopt.control.planar_laws.planar_reference import PlanarReference, planar_references
from gaitopt.control.planar_laws.stretches import Stretch, find_stretches
from gaitopt.control.planned_time import Curve, replace_clock
from gaitopt.control.reference import polynomial
from gaitopt.errors import InputError, suggest
from gaitopt.locks import one_at_a_time
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.printable import format_count

BODY_POINTS = ("hip", "body", "trunk", "torso")
"""Points of figures to which the line from the stance contact leads, in the order of preference."""

SAMPLES = 9
"""Samples of the rate of a phase variable in each interval of the plan."""

PhaseVariable: TypeAlias = str | ca.Function
"""A coordinate by name, or a Function q -> number."""


@check_arguments
def by_phase_variable(gait: PlanarGait, law: PlanarLaw, *, variable: PhaseVariable | None = None) -> PlanarLaw:
    """Return a law with a phase variable of the motion in place of the time since the section.

    The clock of the law is replaced by the planned time t(s) at which the plan reaches the current value s of the phase
    variable.  Before the value at the start of a phase, t is the planned time of its start; beyond the value at its
    end, t is the planned time of its end.  If the stance contact opens there, t first continues by one interval of the
    plan at its last rate, so that the contact opens.  Torques, reference states and gains are functions of t.

    Parameters
    ----------
    gait : PlanarGait
        Gait that is the reference of the law.
    law : PlanarLaw
        Law that depends on the clock; its limits and gains are kept.
    variable : str or Function, optional
        A coordinate, or a Function q -> number, that is strictly monotone in every phase with a foot on the ground.  By
        default, the angle of the line from the stance contact to the hip against the normal of the ground.  In flight
        the phase variable is always the velocity of the centre of mass towards the ground.

    Raises
    ------
    InputError
        If the phase variable is not strictly monotone in a phase or depends on the position along the ground, the robot
        has no such coordinate or no hip, the gait is not a solution, or the law is that of another gait or has a phase
        variable already.

    Examples
    --------
    >>> from gaitopt.control import planar_feedforward
    >>> from gaitopt.model import monopod
    >>> from gaitopt.ocp import Collocation, PlanarProblem, solve_planar
    >>> gait = solve_planar(PlanarProblem(
    ...     robot=monopod(), sequence="foot stick > flight |", friction=1.0, speed=1.5, step_length=0.6,
    ...     objective="torque_squared", transcription=Collocation(intervals=(8, 12))))
    >>> law = by_phase_variable(gait, planar_feedforward(gait))
    >>> law, law.endings
    (PlanarLaw('feedforward by stance angle', section 'foot closes', 2 parts), ('foot opens', None))
    """
    section, title = find_section(gait), _check_variable(gait.robot, variable)
    if law.section != section:
        raise InputError(f"The law {law.name!r} has the section {law.section!r}, but the gait has {section!r}.")
    if any(part.phase_variable is not None for part in law.parts):
        raise InputError(f"The law {law.name!r} has a phase variable already.")
    plans, stretches = planar_references(gait), find_stretches(gait, shared=variable is not None)
    if len(plans) != len(law.parts):
        raise InputError(
            f"The law {law.name!r} has {format_count(len(law.parts), 'part')}, but the gait has {len(plans)}."
        )
    parts, impulses = list[Law](), list[PlannedImpulses | None]()
    for number, stretch in enumerate(stretches):
        parts.append(_replace_part(gait, law.parts[stretch.part], plans[stretch.part], stretch, variable))
        last = number + 1 == len(stretches) or stretches[number + 1].part != stretch.part
        impulses.append(law.impulses[stretch.part] if law.impulses and last else None)
    return PlanarLaw(
        f"{law.name} by {title}",
        law.section,
        tuple(parts),
        tuple(impulses) if any(impulses) else (),
        tuple(stretch.ending for stretch in stretches),
    )


def _check_variable(robot: PlanarRobot, variable: PhaseVariable | None) -> str:
    """Return the name of a phase variable; raise InputError for an unknown coordinate or another Function."""
    if variable is None:
        return "stance angle"
    if isinstance(variable, str):
        if variable not in robot.coordinates:
            raise InputError(
                f"Robot {robot.name!r} has no coordinate {variable!r}. {suggest(variable, robot.coordinates)}"
            )
        _check_travel(robot, variable, depends=variable == robot.travel)
        return variable
    if (variable.n_in(), variable.n_out()) != (1, 1) or (variable.size1_in(0), variable.numel_out(0)) != (robot.n_q, 1):
        raise InputError(
            f"variable must be a Function q -> number of the {robot.n_q} coordinates of {robot.name!r}, got {variable}."
        )
    place = None if robot.travel is None else robot.coordinates.index(robot.travel)
    _check_travel(robot, variable.name(), depends=place is not None and variable.jac_sparsity(0, 0).has_nz(0, place))
    return str(variable.name())


def _check_travel(robot: PlanarRobot, name: str, *, depends: bool) -> None:
    """Raise InputError if a phase variable depends on the position along the ground."""
    if depends:
        raise InputError(
            f"The phase variable {name!r} must not depend on {robot.travel!r}, the position along the ground, which a "
            "periodic gait does not repeat."
        )


def _replace_part(
    gait: PlanarGait, law: Law, plan: PlanarReference, stretch: Stretch, variable: PhaseVariable | None
) -> Law:
    """Return the law of a stretch with its phase variable, which increases, in place of the clock."""
    robot, p = gait.robot, gait.robot.vector(gait.motion.parameters)
    begin, end = stretch.span
    inner = plan.breakpoints[(plan.breakpoints > begin) & (plan.breakpoints < end)]
    times = np.union1d([begin, *inner, end], law.breakpoints[(law.breakpoints > begin) & (law.breakpoints < end)])
    measure = _make_measure(robot, p, stretch, variable)
    sign = _check_monotone(_curve(plan, measure), times, functools.partial(_name_place, gait, stretch, variable))
    increasing = measure if sign > 0 else _negate(measure)
    later = plan.breakpoints[plan.breakpoints > end]
    beyond = float(later[0] - end) if stretch.ending is not None and later.size else 0.0
    what = f"The phase variable {_title_of(gait.robot, stretch, variable)!r}"
    by_phase = replace_clock(law, _curve(plan, increasing), times, increasing, what, beyond=beyond)
    return replace(by_phase, phase_variable=increasing)


@one_at_a_time
def _make_measure(robot: PlanarRobot, p: Array, stretch: Stretch, variable: PhaseVariable | None) -> ca.Function:
    """Return (q, v) -> phase variable of a stretch."""
    q, v = ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q)
    if stretch.contact is None:
        value = -robot.momentum(q, v, p)[0][1] / float(robot.mass(p))
    elif variable is None:
        body = next((name for name in BODY_POINTS if name in robot.points), None)
        if body is None:
            raise InputError(
                f"Robot {robot.name!r} has no point {' or '.join(map(repr, BODY_POINTS))} in its drawing, to which the "
                "line from the stance contact leads; state a coordinate or a Function as the phase variable."
            )
        line = robot.figure(q, p)[:, robot.points.index(body)]
        line -= robot.rims(q, p)[:2, robot.contact_index(stretch.contact)]
        value = ca.atan2(line[0], line[1])
    else:
        value = q[robot.coordinates.index(variable)] if isinstance(variable, str) else variable(q)
    return ca.Function("phase_variable", [q, v], [ca.cse(ca.densify(value))])


@one_at_a_time
def _negate(measure: ca.Function) -> ca.Function:
    q, v = measure.sx_in()
    return ca.Function("phase_variable", [q, v], [-measure(q, v)])


def _curve(plan: PlanarReference, measure: ca.Function) -> Curve:
    """Return the planned phase variable as a function of time."""
    function, first = _planned_value(measure), 1 + 2 * plan.robot.n_u

    def evaluate(times: Array, begins: Array) -> tuple[Array, Array, Array]:
        pieces = np.searchsorted(plan.breakpoints, begins, side="right") - 1
        since = times - plan.breakpoints[pieces]
        value, rate, second = (np.array(part).ravel() for part in function(since[None], plan.table[first:, pieces]))
        return value, rate, second

    return evaluate


@functools.lru_cache(maxsize=64)
@one_at_a_time
def _planned_value(measure: ca.Function) -> ca.Function:
    """Return (time since the start of an interval, its coefficients) -> phase variable and two derivatives of it."""
    n = measure.size1_in(0)
    since, coefficients = ca.SX.sym("since"), ca.SX.sym("coefficients", 6 * n)
    curves = [polynomial(coefficients[6 * i : 6 * i + 6], since) for i in range(n)]
    value = measure(*(ca.vertcat(*[curve[k] for curve in curves]) for k in (0, 1)))
    rate = ca.jacobian(value, since)
    return ca.Function("planned_value", [since, coefficients], [value, rate, ca.jacobian(rate, since)])


def _check_monotone(curve: Curve, times: Array, name_place: Callable[[float], str]) -> int:
    """Return 1 or -1 as the planned phase variable increases or decreases; raise InputError if it does neither."""
    begins = np.repeat(times[:-1], SAMPLES)
    samples = begins + np.tile(np.linspace(0, 1, SAMPLES), times.size - 1) * np.repeat(np.diff(times), SAMPLES)
    rate = curve(samples, begins)[1]
    if np.all(rate > 0) or np.all(rate < 0):
        return 1 if rate[0] > 0 else -1
    k = int(np.flatnonzero(~(rate[:-1] * rate[1:] > 0))[0])
    share = rate[k] / (rate[k] - rate[k + 1]) if rate[k] != rate[k + 1] else 0.0
    at = samples[k] + share * (samples[k + 1] - samples[k])
    raise InputError(
        f"{name_place(float(at))}: its rate is zero at {at:.4f} s. Use a law based on time since touchdown, another "
        "phase variable, or plan a gait in which it is monotone."
    )


def _name_place(gait: PlanarGait, stretch: Stretch, variable: PhaseVariable | None, at: float) -> str:
    """Return the statement that a phase variable is not monotone in the phase of a stretch at a time."""
    names = [name.strip() for name in re.split(r"[>|]", gait.motion.sequence)]
    number = next(k for k in stretch.phases if at <= gait.motion.segments[k].time[-1] or k == stretch.phases[-1])
    title = _title_of(gait.robot, stretch, variable)
    return f"The phase variable {title!r} is not strictly monotone in phase {number + 1} ({names[number]})"


def _title_of(robot: PlanarRobot, stretch: Stretch, variable: PhaseVariable | None) -> str:
    """Return the name of the phase variable of a stretch in messages."""
    if stretch.contact is None:
        return "velocity of the centre of mass"
    return f"angle of the line from {stretch.contact}" if variable is None else _check_variable(robot, variable)
