"""Enumeration of the combinations of contact modes that are consistent with unilateral contact and Coulomb friction.

The choice of modes at given velocities (accelerations and forces) and the plastic impact (velocities and impulses) are
the same problem: with the rows W of the contacts, y = c + G f, G = W M^-1 W', find f with

    0 <= f_n  _|_  y_n >= 0        abs(f_t) <= mu f_n, opposite to y_t where the contact slips.

Rows and forces are scaled so that G has ones on its diagonal: tolerances are then relative and independent of units.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.contacts.closed_contact import ContactRows
from gaitopt.model.contacts.mode_table import ModeTable

TOLERANCE = 1e-10
"""Largest violation of an inequality, relative to the largest velocity or force."""
ROUNDING = 1e-13
"""Violations up to this value, relative to the largest velocity or force, are rounding errors."""
SAME = 1e-7
"""Largest difference of the contact velocities of two combinations with the same motion, relative to the largest."""
DEPENDENT = 1e-12
"""Smallest square of the distance of a row of length 1 from the span of the others; below, the rows are dependent."""


class ConsistentMotion(NamedTuple):
    """The consistent combinations of modes with the same motion.

    Attributes
    ----------
    numbers : tuple of int
        Their numbers in the table; the first one represents the motion.
    forces : tuple of (k + m,) arrays
        Normal forces or impulses of the contacts, then tangential ones of the groups, scaled.
    """

    numbers: tuple[int, ...]
    forces: tuple[np.ndarray, ...]

    def represent_without(self, refused: Sequence[bool]) -> "ConsistentMotion":
        """Return the motion represented by its first combination that is not refused, if there is one."""
        order = sorted(range(len(self.numbers)), key=lambda index: refused[self.numbers[index]])  # stable
        return ConsistentMotion(
            tuple(self.numbers[index] for index in order), tuple(self.forces[index] for index in order)
        )


class ContactSpace:
    """The mobility of contacts and their velocities, scaled to mobilities of 1.

    Parameters
    ----------
    mass_matrix : (n, n) array
    rows : ContactRows
    load : (n,) array
        Generalized force; its acceleration is :attr:`free`.

    Raises
    ------
    InputError
        If the mass matrix is not positive definite, or a row is zero.
    """

    def __init__(self, mass_matrix: np.ndarray, rows: ContactRows, load: np.ndarray) -> None:
        self.matrix = np.concatenate((rows.normals, rows.tangents))
        try:
            columns = np.linalg.solve(mass_matrix, np.concatenate((self.matrix, load[None])).T)
        except np.linalg.LinAlgError:
            raise InputError("The mass matrix is singular; every coordinate needs a mass or an inertia.") from None
        self.per_force, self.free = columns[:, :-1], columns[:, -1]
        mobility = self.matrix @ self.per_force
        diagonal = mobility.diagonal()
        if not (diagonal > 0).all():
            raise InputError(
                "The mobility W M^-1 W' of every contact row must be positive, got "
                f"{', '.join(f'{value:g}' for value in diagonal)}: "
                "the mass matrix must be positive definite and no row zero."
            )
        self.scale = 1 / np.sqrt(diagonal)
        self.mobility = mobility * np.outer(self.scale, self.scale)

    def state_problem(self, rows: ContactRows, constant: np.ndarray, fresh: np.ndarray) -> "CoulombProblem":
        """Return the complementarity problem with the contact velocities or accelerations `constant` without forces."""
        k = len(rows.normals)
        ratio = self.scale[:k] / self.scale[k:, None]
        kinetic = np.where(np.isinf(rows.kinetic), 0.0, rows.kinetic)
        return CoulombProblem(self.mobility, constant * self.scale, rows.static * ratio, kinetic * ratio, fresh)


class CoulombProblem(NamedTuple):
    """A complementarity problem of contacts, in scaled quantities.

    Attributes
    ----------
    mobility : (N, N) array
        G, with ones on its diagonal.
    constant : (N,) array
        c, the contact velocities without forces.
    static, kinetic : (m, k) arrays
        Coefficients of friction; an infinite kinetic one is replaced by 0, as its groups do not slip.
    fresh : (m,) bool array
        Groups at rest, whose direction of slip is to be determined; the others have theirs by their velocity.
    """

    mobility: np.ndarray
    constant: np.ndarray
    static: np.ndarray
    kinetic: np.ndarray
    fresh: np.ndarray


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
    force = _solve_all(problem, table, independent)
    velocity = problem.constant + force @ problem.mobility
    size = np.maximum(np.abs(problem.constant).max(initial=0.0), np.abs(force).max(axis=1, initial=0.0))
    margin = _margins(problem, table, force, velocity)
    residual = np.abs(velocity * table.fixed).max(axis=1, initial=0.0)
    accepted = np.flatnonzero((margin >= -TOLERANCE * size) & (residual <= 10 * TOLERANCE * size))
    motions: list[list[int]] = []
    for number in accepted.tolist():
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
    return [ConsistentMotion(tuple(motion), tuple(force[motion])) for motion in motions]


def _solve_all(problem: CoulombProblem, table: ModeTable, independent: bool) -> np.ndarray:
    """Return the forces of every combination, shape (C, N).

    If the rows are dependent, the forces have the least norm of all solutions: the least sum of f_i^2 G_ii.
    """
    mobility, size = problem.mobility, len(problem.constant)
    k = size - table.slip.shape[1]
    fixed = table.fixed[:, :, None]
    matrix = fixed * mobility + (1 - fixed) * np.eye(size)
    matrix[:, k:, :k] += table.slip[:, :, None] * problem.kinetic
    right = -table.fixed * problem.constant
    if independent:
        try:
            return np.linalg.solve(matrix, right[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError:  # at the limit of a jam
            pass
    return (np.linalg.pinv(matrix, rcond=DEPENDENT) @ right[:, :, None])[:, :, 0]


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
