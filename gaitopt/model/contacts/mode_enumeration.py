"""Enumeration of the combinations of contact modes that are consistent with unilateral contact and Coulomb friction.

The choice of modes at given velocities (accelerations and forces) and the plastic impact (velocities and impulses) are
the same problem: with the rows W of the contacts, y = c + G f, G = W M^-1 W', find f with

    0 <= f_n  _|_  y_n >= 0        abs(f_t) <= mu f_n, opposite to y_t where the contact slips.

Rows and forces are scaled so that G has ones on its diagonal: tolerances are then relative and independent of units.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gaitopt.model.contacts.closed_contact import ContactRows
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.mode_table import ModeTable

TOLERANCE = 1e-10
"""Largest violation of an inequality, relative to the size of the motion or the largest force."""
ROUNDING = 1e-13
"""Violations up to this value, relative to the size of the motion or the largest force, are rounding errors."""
SAME = 1e-7
"""Largest difference of the contact velocities of two combinations with the same motion, relative to its size."""
DEPENDENT = 1e-12
"""Smallest square of the distance of a row of length 1 from the span of the others; below, the rows are dependent."""


class ConsistentMotion(NamedTuple):
    """The consistent combinations of modes with the same motion; the first one represents it.

    Attributes
    ----------
    combinations : tuple of tuples of Mode
    forces : tuple of (k + m,) arrays
        Normal forces or impulses of the contacts, then tangential ones of the groups.
    """

    combinations: tuple[tuple[Mode, ...], ...]
    forces: tuple[Sequence[float] | np.ndarray, ...]


class CoulombProblem(NamedTuple):
    """A complementarity problem of contacts, in scaled quantities.

    Attributes
    ----------
    mobility : (N, N) array
        G, with ones on its diagonal.
    constant : (N,) array
        c, the contact velocities without forces.
    scale : (N,) array
        Forces per scaled force.
    static, kinetic : (m, k) arrays
        Coefficients of friction; an infinite kinetic one is replaced by 0, as its groups do not slip.
    fresh : (m,) bool array
        Groups at rest, whose direction of slip is to be determined; the others have theirs by their velocity.
    size : float
        Norm of the acceleration or velocity without contact forces, sqrt(a' M a), at least as large as its parts at
        the contacts.
    """

    mobility: np.ndarray
    constant: np.ndarray
    scale: np.ndarray
    static: np.ndarray
    kinetic: np.ndarray
    fresh: np.ndarray
    size: float


def scale_problem(
    rows: ContactRows, mobility: np.ndarray, constant: np.ndarray, fresh: np.ndarray, size: float
) -> CoulombProblem:
    """Return the problem with mobilities of 1.

    Parameters
    ----------
    rows : ContactRows
    mobility : (N, N) array
    constant : (N,) array
    fresh : (m,) bool array
    size : float
        Norm of the acceleration or velocity without contact forces, sqrt(a' M a).
    """
    scale = 1 / np.sqrt(mobility.diagonal())
    ratio = scale[: len(rows.normals)] / scale[len(rows.normals) :, None]
    kinetic = np.where(np.isinf(rows.kinetic), 0.0, rows.kinetic)
    scaled = mobility * np.outer(scale, scale)
    return CoulombProblem(scaled, constant * scale, scale, rows.static * ratio, kinetic * ratio, fresh, size)


def enumerate_modes(problem: CoulombProblem, table: ModeTable) -> list[ConsistentMotion]:
    """Return the consistent combinations of a table, one for each motion.

    Combinations with the same contact velocities are one motion; its first combination satisfies the inequalities
    strictly, if there is one, has the most closed, then the most sticking contacts, then the least norm of the forces.

    Parameters
    ----------
    problem : CoulombProblem
    table : ModeTable
    """
    independent = _are_independent(problem.mobility)
    try:
        force = _solve_all(problem, table, independent)
    except np.linalg.LinAlgError:  # at the limit of a jam
        independent = False
        force = _solve_all(problem, table, independent)
    velocity = problem.constant + force @ problem.mobility
    size = np.maximum(np.abs(problem.constant).max(initial=problem.size), np.abs(force).max(axis=1, initial=0.0))
    margin = _margins(problem, table, force, velocity)
    motions: list[list[int]] = []
    for number in np.flatnonzero(margin >= -TOLERANCE * size).tolist():
        for motion in motions:
            if np.abs(velocity[number] - velocity[motion[0]]).max() <= SAME * size[number]:
                motion.append(number)
                break
        else:
            motions.append([number])
    norm = np.zeros(len(force)) if independent else np.linalg.norm(force, axis=1)
    violated = (margin < -ROUNDING * size).tolist()
    for motion in motions:
        motion.sort(key=lambda number: (violated[number], table.rank[number], norm.item(number)))
    return [
        ConsistentMotion(tuple(table.modes[number] for number in motion), tuple(force[motion] * problem.scale))
        for motion in motions
    ]


def _solve_all(problem: CoulombProblem, table: ModeTable, independent: bool) -> np.ndarray:
    """Return the forces of every combination, shape (C, N).

    If the rows are dependent, the forces have the least norm of all solutions, the least sum of f_i^2 G_ii; without a
    solution they are nan.
    """
    k = table.closed.shape[1]
    matrix = table.fixed[:, :, None] * problem.mobility + table.free
    matrix[:, k:, :k] += table.slip[:, :, None] * problem.kinetic
    right = -table.fixed * problem.constant
    if independent:
        return np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
    force = (np.linalg.pinv(matrix, rcond=DEPENDENT) @ right[:, :, None])[:, :, 0]
    residual = np.abs((matrix @ force[:, :, None])[:, :, 0] - right).max(axis=1)
    force[residual > 10 * TOLERANCE * np.maximum(problem.size, np.abs(force).max(axis=1))] = np.nan
    return force


def _are_independent(mobility: np.ndarray) -> bool:
    """Return whether the rows of the contacts are linearly independent."""
    try:
        return bool((np.linalg.cholesky(mobility).diagonal() ** 2 > DEPENDENT).all())
    except np.linalg.LinAlgError:
        return False


def _margins(problem: CoulombProblem, table: ModeTable, force: np.ndarray, velocity: np.ndarray) -> np.ndarray:
    """Return the smallest margin of the inequalities of every combination, shape (C,)."""
    k = table.closed.shape[1]
    normal = np.where(table.closed, force[:, :k], velocity[:, :k])
    normal = np.where(table.latched, np.inf, normal)
    infinite = np.isinf(problem.static).any(axis=1)
    finite = np.where(np.isinf(problem.static), 0.0, problem.static)
    cone = np.where(infinite, np.inf, force[:, :k] @ finite.T) - np.abs(force[:, k:])
    direction = np.where(problem.fresh, table.slip * velocity[:, k:], np.inf)
    tangential = np.where(table.sticks, cone, np.where(table.slip != 0, direction, np.inf))
    return np.minimum(normal.min(axis=1, initial=np.inf), tangential.min(axis=1, initial=np.inf))
