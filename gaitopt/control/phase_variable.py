"""The stance angle as phase variable: a law whose clock is the planned time of the current stance angle."""

import functools
from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.reference import Reference, quintic, reference
from gaitopt.control.signature import Memory, control_function, inputs_of, rewrite_memory
from gaitopt.errors import InputError, suggest
from gaitopt.locks import one_at_a_time
from gaitopt.model.coordinate_entries import angle_entry
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Motion

ANGLE_BOUND = 1e3
"""Bound [rad] of the first and of the last piece, which no angle reaches."""
ACCURACY = 1e-9
"""Accuracy of the planned time as a function of the angle [s]; also the shortest piece."""
MAX_BISECTIONS = 12
"""Maximum number of bisections of the pieces; an angle that needs more is nearly at rest."""
LEADING_ROWS = 9
"""Number of rows before those of the law: bounds of the piece, its start, and six coefficients of the time."""


@check_arguments
def by_stance_angle(robot: Robot, motion: Motion, law: Law, *, angle: str | None = None) -> Law:
    """Return a law with an angle of the robot as phase variable instead of the time since touchdown.

    The law's clock is replaced by the planned time t(th) at which the plan reaches the current angle th.  Below the
    angle at the start of the planned step t is 0, beyond the angle at its end t is the duration of the step; torques,
    reference angles, rates and gains are functions of t.

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
        If the angle does not increase throughout the planned step, the robot has no such angle, or the pieces of the
        law are not decided by the clock.

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
            f"The law must be divided into intervals of the clock; those of {law.name!r} depend on the state."
        )
    index, plan = robot.angles.index(name), reference(robot, motion)
    _check_increasing(plan, index, name)
    times = np.union1d(plan.breakpoints, law.breakpoints[law.breakpoints < plan.duration])
    times = _bisect(plan, index, times[np.append(np.diff(times) > ACCURACY, True)], name)
    begins, coefficients = _planned_times(plan, index, times)
    ends = np.zeros((6, 2))
    ends[0] = times[[0, -1]]
    bounds = np.concatenate([[-ANGLE_BOUND], begins, [ANGLE_BOUND]])
    front = np.vstack(
        [bounds[:-1], bounds[1:], np.append(begins[0], begins), np.hstack([ends[:, :1], coefficients, ends[:, 1:]])]
    )
    columns = [law.piece(time) for time in np.append(times[0], times)]
    control, memory = _replace_clock(law.control, law.memory, angle_entry(index))
    return replace(
        law,
        name=f"{law.name} by {name}",
        control=control,
        breakpoints=bounds[:-1],
        table=np.vstack([front, law.table[:, columns]]),
        gains={gain: LEADING_ROWS + row for gain, row in law.gains.items()},
        memory=memory,
        index=angle_entry(index),
        gain_matrices=tuple(matrix.shift_rows(LEADING_ROWS) for matrix in law.gain_matrices),
    )


@functools.lru_cache(maxsize=64)
@one_at_a_time
def _replace_clock(control: ca.Function, known: Memory, entry: int) -> tuple[ca.Function, Memory]:
    """Return a law's Function and memory with its clock replaced by a polynomial of an entry of q."""
    inputs = inputs_of(control, data=LEADING_ROWS)
    front, inner = inputs.data[:LEADING_ROWS], inputs.data[LEADING_ROWS:]
    since, time = inputs.q[entry] - front[2], ca.SX(0)
    for k in reversed(range(3, LEADING_ROWS)):
        time = time * since + front[k]
    inner_inputs = inputs._replace(clock=time, data=inner)
    torque, _, guards = control(*inner_inputs)
    bounds = ca.vertcat(inputs.q[entry] - front[0], front[1] - inputs.q[entry])
    return control_function(inputs, torque, bounds=bounds, guards=guards), rewrite_memory(known, inputs, inner_inputs)


def _angle_at(plan: Reference, index: int, pieces: NDArray[np.intp], times: Array) -> tuple[Array, Array, Array]:
    """Return the planned angle, its rate and its acceleration at times within pieces of the plan."""
    first = 1 + 2 * plan.robot.n_u + 6 * index
    columns, since = plan.table[first : first + 6, pieces], times - plan.breakpoints[pieces]
    powers = np.arange(6)[:, None]
    value = np.sum(columns * since**powers, axis=0)
    rate = np.sum(columns[1:] * powers[1:] * since ** powers[:-1], axis=0)
    return value, rate, np.sum(columns[2:] * powers[2:] * powers[1:-1] * since ** powers[:-2], axis=0)


def _check_increasing(plan: Reference, index: int, name: str) -> None:
    count = plan.breakpoints.size - 1
    pieces = np.repeat(np.arange(count), 9)
    shares = np.tile(np.linspace(0, 1, 9), count)
    times = plan.breakpoints[pieces] + shares * np.diff(plan.breakpoints)[pieces]
    rate = _angle_at(plan, index, pieces, times)[1]
    if not np.min(rate) > 0:
        raise InputError(
            f"The planned angle {name!r} does not increase throughout the step: at {times[np.argmin(rate)]:.4f} s "
            f"its rate is {np.min(rate):.3g} rad/s. Use a law based on time since touchdown, or plan a gait in which "
            "this angle is monotone."
        )


def _planned_times(plan: Reference, index: int, times: Array) -> tuple[Array, Array]:
    """Return the angles at the times, (K + 1,), and the coefficients of the time in each interval, (6, K).

    The polynomials match the time and its first two derivatives with respect to the angle, 1 / w and -a / w^3, at both
    ends.
    """
    pieces = np.searchsorted(plan.breakpoints, times[:-1], side="right") - 1
    ends = [_angle_at(plan, index, pieces, at) for at in (times[:-1], times[1:])]
    begins = np.append(ends[0][0], ends[1][0][-1])
    coefficients = [
        quintic(
            times[k : k + 2],
            np.array([1 / ends[side][1][k] for side in (0, 1)]),
            np.array([-ends[side][2][k] / ends[side][1][k] ** 3 for side in (0, 1)]),
            begins[k + 1 : k + 2] - begins[k],
        )[:, 0]
        for k in range(pieces.size)
    ]
    return begins, np.array(coefficients).T


def _bisect(plan: Reference, index: int, times: Array, name: str) -> Array:
    """Return the times bisected until the polynomials between them are accurate."""
    for _ in range(MAX_BISECTIONS):
        begins, coefficients = _planned_times(plan, index, times)
        pieces, steps = np.searchsorted(plan.breakpoints, times[:-1], side="right") - 1, np.diff(times)
        inaccurate = np.zeros(pieces.size, dtype=bool)
        for share in (0.2, 0.5, 0.8):
            exact = times[:-1] + share * steps
            since = _angle_at(plan, index, pieces, exact)[0] - begins[:-1]
            estimate = np.sum(coefficients * since ** np.arange(6)[:, None], axis=0)
            inaccurate |= ~(np.abs(estimate - exact) <= ACCURACY)
        if not np.any(inaccurate):
            return times
        time_at_rest, times = times[:-1][inaccurate][0], np.sort(np.append(times, (times[:-1] + steps / 2)[inaccurate]))
    raise InputError(
        f"The planned angle {name!r} is nearly at rest at {time_at_rest:.4f} s, so it does not determine the planned "
        "time. Use a law based on time since touchdown."
    )
