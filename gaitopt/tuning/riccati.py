"""Riccati equations of a step with its events, and of a return map."""

from collections.abc import Sequence

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array

PERIODICITY_TOLERANCE = 1e-10
"""Relative change of the cost-to-go over a step below which it counts as periodic."""
MAX_STEPS = 500
"""Maximum number of steps of the backward iteration of the cost-to-go."""


@dataclass(frozen=True, eq=False)
class LinearInterval:
    """An interval of a step with constant linear dynamics x' = A x + B u, and the jump of x at its end.

    Attributes
    ----------
    duration : float [s]
    a : (n_x, n_x) array
    b : (n_x, n_u) array
    jump : (n_x, n_x) array
        Saltation matrix of the event at the end; the identity if there is no event.
    """

    duration: float
    a: Array
    b: Array
    jump: Array


def periodic_gains(intervals: Sequence[LinearInterval], q: Array, r: Array) -> tuple[Array, Array] | None:
    """Return the optimal feedback gains of a periodic hybrid motion at the start and end of each interval.

    The cost is the integral of x' Q x + u' R u.  The cost-to-go S obeys the Riccati equation in each interval, solved
    by the exponential of its Hamiltonian matrix, and S- = J' S+ J at a jump J.  It is iterated backwards step by step
    until it is periodic; the result is None if it does not converge, for example because no feedback stabilises the
    motion.

    Parameters
    ----------
    intervals : sequence of LinearInterval
        Intervals of one step, in order.
    q : (n_x, n_x) array
    r : (n_u, n_u) array

    Returns
    -------
    (n_intervals, 2, n_u, n_x) array, and the cost-to-go at the start, (n_x, n_x)
    """
    with np.errstate(over="ignore", invalid="ignore"):  # for very low torque costs the cost-to-go overflows
        flows = _exponentials(np.array([-_hamiltonian(interval, q, r) * interval.duration for interval in intervals]))
    if not np.all(np.isfinite(flows)):
        return None
    n_x, inverse = q.shape[0], np.linalg.inv(r)
    cost = np.array(q, dtype=float)
    for _ in range(MAX_STEPS):
        last, gains = cost, []
        for interval, flow in zip(reversed(intervals), flows[::-1], strict=True):
            after = interval.jump.T @ cost @ interval.jump
            whole = flow @ np.vstack([np.eye(n_x), after])
            if not np.linalg.cond(whole[:n_x]) < 1 / np.finfo(float).eps:
                return None  # the cost-to-go is infinite
            cost = whole[n_x:] @ np.linalg.inv(whole[:n_x])
            cost = (cost + cost.T) / 2
            gains.append([inverse @ interval.b.T @ each for each in (cost, after)])
        if not np.all(np.isfinite(cost)):
            return None
        if np.max(np.abs(cost - last)) <= PERIODICITY_TOLERANCE * np.max(np.abs(cost)):
            return np.array(gains[::-1]), cost
    return None


def _hamiltonian(interval: LinearInterval, q: Array, r: Array) -> Array:
    a, b = interval.a, interval.b
    return np.block([[a, -b @ np.linalg.solve(r, b.T)], [-q, -a.T]])


def _exponentials(matrices: Array) -> Array:
    """Return the exponentials of small matrices, (k, n, n), by scaling, Taylor series and squaring."""
    size = np.max(np.sum(np.abs(matrices), axis=-1))
    halvings = max(int(np.ceil(np.log2(max(size, 1e-300)))) + 2, 0)
    scaled, term = matrices / 2**halvings, np.broadcast_to(np.eye(matrices.shape[-1]), matrices.shape)
    total = term.copy()
    for order in range(1, 13):
        term = term @ scaled / order
        total += term
    for _ in range(halvings):
        total = total @ total
    return total


def discrete_gains(a: Array, b: Array, q: Array, r: Array) -> Array | None:
    """Return the optimal feedback gain K of z+ = A z + B w, w = -K z, shape (n_w, n_z), or None.

    The cost is the sum of z' Q z + w' R w.  The cost-to-go is iterated until it converges; the result is None if it
    does not converge.
    """
    cost = np.array(q, dtype=float)
    for _ in range(MAX_STEPS):
        last = cost
        gain = np.linalg.solve(r + b.T @ cost @ b, b.T @ cost @ a)
        cost = q + a.T @ cost @ (a - b @ gain)
        cost = (cost + cost.T) / 2
        if not np.all(np.isfinite(cost)):
            return None
        if np.max(np.abs(cost - last)) <= PERIODICITY_TOLERANCE * np.max(np.abs(cost)):
            return gain
    return None
