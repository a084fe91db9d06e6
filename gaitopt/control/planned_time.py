"""The planned time as a function of a phase variable: its piecewise polynomials replace the clock of a law."""

import functools
from collections.abc import Callable
from dataclasses import replace

import casadi as ca
import numpy as np
from numpy.typing import NDArray

from gaitopt.control.law import Law
from gaitopt.control.reference import quintic
from gaitopt.control.signature import Memory, control_function, inputs_of, rewrite_memory
from gaitopt.errors import InputError
from gaitopt.locks import one_at_a_time
from gaitopt.motion.motion import Array

VALUE_BOUND = 1e3
"""Bound [rad, m or m/s] of the first and of the last piece, which no phase variable reaches."""
ACCURACY = 1e-9
"""Accuracy of the planned time as a function of the phase variable [s]; also the shortest piece."""
MAX_BISECTIONS = 12
"""Maximum number of bisections of the pieces; a phase variable that needs more is nearly at rest."""
LEADING_ROWS = 9
"""Number of rows before those of the law: bounds of the piece, its start, and six coefficients of the time."""

Curve = Callable[[Array, Array], tuple[Array, Array, Array]]
"""The planned phase variable, its rate and its acceleration at times (K,) within the intervals that begin at (K,)."""


def replace_clock(
    law: Law, curve: Curve, times: Array, variable: ca.Function, what: str, *, beyond: float = 0.0
) -> Law:
    """Return a law whose clock is the planned time of the current value of a phase variable.

    Parameters
    ----------
    law : Law
        Law that depends on the clock.
    curve : callable
        The planned phase variable, which increases.
    times : (K,) array [s]
        Times between which the curve is smooth, and at which the law changes its piece.
    variable : (q, v) -> phase variable Function
    what : str
        The phase variable in messages, such as ``"The planned angle 'th1'"``.
    beyond : float [s]
        Duration for which the planned time continues beyond the last value at its last rate, before it is constant.

    Raises
    ------
    InputError
        If the phase variable is nearly at rest.
    """
    times = _bisect(curve, times[np.append(np.diff(times) > ACCURACY, True)], what)
    begins, coefficients = _planned_times(curve, times)
    if beyond:
        rate = curve(times[-1:], times[-2:-1])[1][0]
        coefficients = np.column_stack([coefficients, [times[-1], 1 / rate, 0, 0, 0, 0]])
        begins, times = np.append(begins, begins[-1] + rate * beyond), np.append(times, times[-1] + beyond)
    ends = np.zeros((6, 2))
    ends[0] = times[[0, -1]]
    bounds = np.concatenate([[-VALUE_BOUND], begins, [VALUE_BOUND]])
    front = np.vstack(
        [bounds[:-1], bounds[1:], np.append(begins[0], begins), np.hstack([ends[:, :1], coefficients, ends[:, 1:]])]
    )
    middles = (times[:-1] + times[1:]) / 2
    columns = [law.piece(time) for time in (times[0], *middles, times[-1] if not beyond else middles[-1])]
    control, memory = _rewrite(law.control, law.memory, variable)
    return replace(
        law,
        control=control,
        breakpoints=bounds[:-1],
        table=np.vstack([front, law.table[:, columns]]),
        gains={gain: LEADING_ROWS + row for gain, row in law.gains.items()},
        memory=memory,
        gain_matrices=tuple(matrix.shift_rows(LEADING_ROWS) for matrix in law.gain_matrices),
    )


@functools.lru_cache(maxsize=64)
@one_at_a_time
def _rewrite(control: ca.Function, known: Memory, variable: ca.Function) -> tuple[ca.Function, Memory]:
    """Return a law's Function and memory with its clock replaced by a polynomial of a phase variable."""
    inputs = inputs_of(control, data=LEADING_ROWS)
    front, inner = inputs.data[:LEADING_ROWS], inputs.data[LEADING_ROWS:]
    value = variable(inputs.q, inputs.v)
    since, time = value - front[2], ca.SX(0)
    for k in reversed(range(3, LEADING_ROWS)):
        time = time * since + front[k]
    inner_inputs = inputs._replace(clock=time, data=inner)
    torque, _, guards = control(*inner_inputs)
    bounds = ca.vertcat(value - front[0], front[1] - value)
    return control_function(inputs, torque, bounds=bounds, guards=guards), rewrite_memory(known, inputs, inner_inputs)


def _planned_times(curve: Curve, times: Array) -> tuple[Array, Array]:
    """Return the phase variable at the times, (K + 1,), and the coefficients of the time in each interval, (6, K).

    The polynomials match the time and its first two derivatives with respect to the phase variable, 1 / w and
    -a / w^3, at both ends.
    """
    ends = [curve(at, times[:-1]) for at in (times[:-1], times[1:])]
    begins = np.append(ends[0][0], ends[1][0][-1])
    coefficients = [
        quintic(
            times[k : k + 2],
            np.array([1 / ends[side][1][k] for side in (0, 1)]),
            np.array([-ends[side][2][k] / ends[side][1][k] ** 3 for side in (0, 1)]),
            begins[k + 1 : k + 2] - begins[k],
        )[:, 0]
        for k in range(times.size - 1)
    ]
    return begins, np.array(coefficients).T


def _bisect(curve: Curve, times: Array, what: str) -> Array:
    """Return the times bisected until the polynomials between them are accurate."""
    for _ in range(MAX_BISECTIONS):
        begins, coefficients = _planned_times(curve, times)
        steps = np.diff(times)
        inaccurate: NDArray[np.bool_] = np.zeros(steps.size, dtype=bool)
        for share in (0.2, 0.5, 0.8):
            exact = times[:-1] + share * steps
            since = curve(exact, times[:-1])[0] - begins[:-1]
            estimate = np.sum(coefficients * since ** np.arange(6)[:, None], axis=0)
            inaccurate |= ~(np.abs(estimate - exact) <= ACCURACY)
        if not np.any(inaccurate):
            return times
        time_at_rest, times = times[:-1][inaccurate][0], np.sort(np.append(times, (times[:-1] + steps / 2)[inaccurate]))
    raise InputError(
        f"{what} is nearly at rest at {time_at_rest:.4f} s, so it does not determine the planned time. Use a law based "
        "on time since touchdown."
    )
