"""Riccati equations: of a step between its events, and of a return map."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from gaitopt.motion.motion import Array

REPEATS = 1e-10
"""Relative change of the cost-to-go over a step below which it is periodic."""
MOST_STEPS = 500


@dataclass(frozen=True, eq=False)
class Stretch:
    """A stretch of a step with constant linear dynamics x' = A x + B u, and the jump of x at its end.

    Attributes
    ----------
    duration : float [s]
    a : (n_x, n_x) array
    b : (n_x, n_u) array
    jump : (n_x, n_x) array
        Saltation matrix of the event at its end; the identity where there is none.
    """

    duration: float
    a: Array
    b: Array
    jump: Array


def periodic_gains(stretches: Sequence[Stretch], q: Array, r: Array) -> tuple[Array, Array] | None:
    """Return the optimal feedback gains of a periodic hybrid motion at the begin and end of each stretch.

    The cost is the integral of x' Q x + u' R u; its cost-to-go S obeys the Riccati equation in each stretch, by the
    exponential of its Hamiltonian matrix, and S- = J' S+ J at a jump J.  It is carried backwards step by step until it
    repeats; None if it does not, as when the motion cannot be stabilised.

    Parameters
    ----------
    stretches : sequence of Stretch
        Of one step, in order.
    q : (n_x, n_x) array
    r : (n_u, n_u) array

    Returns
    -------
    (n_stretches, 2, n_u, n_x) array, and the cost-to-go at the start, (n_x, n_x)
    """
    with np.errstate(over="ignore", invalid="ignore"):  # torques so cheap that the cost-to-go is infinite
        flows = _exponentials(np.array([-_hamiltonian(stretch, q, r) * stretch.duration for stretch in stretches]))
    if not np.all(np.isfinite(flows)):
        return None
    n_x, inverse = q.shape[0], np.linalg.inv(r)
    cost = np.array(q, dtype=float)
    for _ in range(MOST_STEPS):
        last, gains = cost, []
        for stretch, flow in zip(reversed(stretches), flows[::-1], strict=True):
            after = stretch.jump.T @ cost @ stretch.jump
            whole = flow @ np.vstack([np.eye(n_x), after])
            if not np.linalg.cond(whole[:n_x]) < 1 / np.finfo(float).eps:
                return None  # the cost-to-go is infinite
            cost = whole[n_x:] @ np.linalg.inv(whole[:n_x])
            cost = (cost + cost.T) / 2
            gains.append([inverse @ stretch.b.T @ each for each in (cost, after)])
        if not np.all(np.isfinite(cost)):
            return None
        if np.max(np.abs(cost - last)) <= REPEATS * np.max(np.abs(cost)):
            return np.array(gains[::-1]), cost
    return None


def _hamiltonian(stretch: Stretch, q: Array, r: Array) -> Array:
    a, b = stretch.a, stretch.b
    return np.block([[a, -b @ np.linalg.solve(r, b.T)], [-q, -a.T]])


def _exponentials(matrices: Array) -> Array:
    """Return the exponentials of many small matrices, (k, n, n), at once: scaling, Taylor series, squaring."""
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
    """Return the optimal feedback gain K of z+ = A z + B w, w = -K z, shape (n_w, n_z); None if there is none.

    The cost is the sum of z' Q z + w' R w; its cost-to-go is iterated until it repeats.
    """
    cost = np.array(q, dtype=float)
    for _ in range(MOST_STEPS):
        last = cost
        gain = np.linalg.solve(r + b.T @ cost @ b, b.T @ cost @ a)
        cost = q + a.T @ cost @ (a - b @ gain)
        cost = (cost + cost.T) / 2
        if not np.all(np.isfinite(cost)):
            return None
        if np.max(np.abs(cost - last)) <= REPEATS * np.max(np.abs(cost)):
            return gain
    return None
