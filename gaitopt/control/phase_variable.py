"""The stance angle as phase variable: a law whose clock is the planned time of the current stance angle."""

import functools
from dataclasses import replace

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.planned_time import replace_clock
from gaitopt.control.reference import Reference, reference
from gaitopt.errors import InputError, suggest
from gaitopt.locks import one_at_a_time
from gaitopt.model.coordinate_entries import angle_entry
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Motion


@check_arguments
def by_stance_angle(robot: Robot, motion: Motion, law: Law, *, angle: str | None = None) -> Law:
    """Return a law with an angle of the robot as phase variable instead of the time since touchdown.

    The law's clock is replaced by the planned time t(th) at which the plan reaches the current angle th.  Below the
    angle at the start of the planned step, t is 0; beyond the angle at its end, t is the duration of the step.
    Torques, reference angles, rates and gains are functions of t.

    Parameters
    ----------
    robot : Robot
    motion : Motion
        Motion whose first step is the reference of the law.
    law : Law
        Law that depends on the clock; its limits and gains are kept.
    angle : str, optional
        Angle that increases throughout the planned step; by default the first angle, that of the stance leg.

    Raises
    ------
    InputError
        If the angle does not increase throughout the planned step, the robot has no such angle, or the law has a phase
        variable already.

    Examples
    --------
    >>> from gaitopt import assess_stability, by_stance_angle, compass_biped, joint_pd, load
    >>> robot, gait = compass_biped(), load("docs/examples/compass_slip.h5")
    >>> law = by_stance_angle(robot, gait.motion, joint_pd(robot, gait.motion, stiffness=20, damping=5, torque_limit=8))
    >>> law.name, assess_stability(gait, law).stable
    ('joint_pd by th1', True)
    """
    name = angle or robot.angles[0]
    if name not in robot.angles:
        raise InputError(f"Robot {robot.name!r} has no angle {name!r}. {suggest(name, robot.angles)}")
    if law.index is not None:
        raise InputError(
            f"The law {law.name!r} has a phase variable already; by_stance_angle needs a law of the time since "
            "touchdown."
        )
    index, plan = robot.angles.index(name), reference(robot, motion)
    _check_increasing(plan, index, name)
    times = np.union1d(plan.breakpoints, law.breakpoints[law.breakpoints < plan.duration])
    curve, entry = functools.partial(_angle_at, plan, index), angle_entry(index)
    by_angle = replace_clock(law, curve, times, _entry_of(robot.n_q, entry), f"The planned angle {name!r}")
    return replace(by_angle, name=f"{law.name} by {name}", index=entry)


@functools.lru_cache(maxsize=64)
@one_at_a_time
def _entry_of(n_q: int, entry: int) -> ca.Function:
    """Return (q, v) -> an entry of q."""
    q, v = ca.SX.sym("q", n_q), ca.SX.sym("v", n_q)
    return ca.Function("entry", [q, v], [q[entry]])


def _angle_at(plan: Reference, index: int, times: Array, begins: Array) -> tuple[Array, Array, Array]:
    """Return the planned angle, its rate and its acceleration at times of the intervals that begin at others."""
    pieces = np.searchsorted(plan.breakpoints, begins, side="right") - 1
    first = 1 + 2 * plan.robot.n_u + 6 * index
    columns, since = plan.table[first : first + 6, pieces], times - plan.breakpoints[pieces]
    powers = np.arange(6)[:, None]
    value = np.sum(columns * since**powers, axis=0)
    rate = np.sum(columns[1:] * powers[1:] * since ** powers[:-1], axis=0)
    return value, rate, np.sum(columns[2:] * powers[2:] * powers[1:-1] * since ** powers[:-2], axis=0)


def _check_increasing(plan: Reference, index: int, name: str) -> None:
    count = plan.breakpoints.size - 1
    begins = np.repeat(plan.breakpoints[:-1], 9)
    times = begins + np.tile(np.linspace(0, 1, 9), count) * np.repeat(np.diff(plan.breakpoints), 9)
    rate = _angle_at(plan, index, times, begins)[1]
    if not np.min(rate) > 0:
        raise InputError(
            f"The planned angle {name!r} does not increase throughout the step: at {times[np.argmin(rate)]:.4f} s "
            f"its rate is {np.min(rate):.3g} rad/s. Use a law based on time since touchdown, or plan a gait in which "
            "this angle is monotone."
        )
