"""Motions of a robot that are consistent with its closed contacts: accelerations, or velocities after an impact."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.contacts.closed_contact import (
    ClosedContact,
    ContactRows,
    Friction,
    coefficients_of,
    share_forces,
    stack_rows,
)
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.mode_enumeration import ConsistentMotion, enumerate_modes, scale_problem
from gaitopt.model.contacts.mode_table import AT_REST, INSEPARABLE, GroupOptions, tabulate_modes
from gaitopt.model.contacts.single_contact import SingleContact, solve_foot, solve_stop


class Response(NamedTuple):
    """The response of a robot to contact forces: x = free + per_force f, and y = constant + mobility f at the contacts.

    Attributes
    ----------
    free : (n,) array
        Acceleration without contact forces, or velocity before an impact.
    per_force : (n, N) array
        M^-1 W'.
    mobility : (N, N) array
        W M^-1 W'.
    constant : (N,) array
        W free.
    size : float
        Norm of `free`, sqrt(free' M free): the scale of rounding errors.
    """

    free: np.ndarray
    per_force: np.ndarray
    mobility: np.ndarray
    constant: np.ndarray
    size: float


class ContactMotions(NamedTuple):
    """The consistent motions of a robot, with the forces or impulses of each.

    Attributes
    ----------
    names : list of str
    response : Response
    motions : list of ConsistentMotion
    rows : ContactRows or None
        None for a contact alone.
    """

    names: list[str]
    response: Response
    motions: list[ConsistentMotion]
    rows: ContactRows | None

    def evaluate(self, motion: ConsistentMotion) -> np.ndarray:
        """Return the acceleration, or the velocity after the impact, shape (n,)."""
        return self.response.free + self.response.per_force @ motion.forces[0]

    def share_forces(self, motion: ConsistentMotion) -> dict[str, tuple[float, float]]:
        """Return the force or impulse (t, n) of each contact."""
        forces = motion.forces[0]
        if self.rows is not None:
            return share_forces(self.names, self.rows, np.asarray(forces))
        return {self.names[0]: (forces[1] if len(forces) > 1 else 0.0, forces[0])}

    def name_modes(self, motion: ConsistentMotion) -> tuple[dict[str, Mode], ...]:
        """Return the combinations of modes of a motion, by the names of the contacts."""
        return tuple(dict(zip(self.names, modes, strict=True)) for modes in motion.combinations)


def find_motions(
    mass_matrix: np.ndarray,
    contacts: Sequence[ClosedContact],
    friction: Friction,
    *,
    force: np.ndarray | None = None,
    velocity: np.ndarray | None = None,
) -> ContactMotions:
    """Return the consistent motions of a robot: accelerations under a force, or velocities after an impact.

    Parameters
    ----------
    mass_matrix : (n, n) array
    contacts : sequence of ClosedContact
        Their biases and slip speeds are used for accelerations only.
    friction : (static, kinetic), or mapping of contact to (static, kinetic)
        For an impact the kinetic one is used.
    force : (n,) array, optional
        h - E u of M a + h - E u = sum(W' f).
    velocity : (n,) array, optional
        Velocity before the impact.

    Raises
    ------
    InputError
        If contacts, friction or mass matrix are invalid.
    """
    load = None if force is None else np.asarray(force, dtype=float)
    before = None if velocity is None else np.asarray(velocity, dtype=float)
    if len(contacts) == 1:
        motions = _find_single(mass_matrix, contacts[0], friction, load, before)
        if motions is not None:
            return motions
    return _find_several(mass_matrix, contacts, friction, load, before)


def respond(
    mass_matrix: np.ndarray, matrix: np.ndarray, *, force: np.ndarray | None = None, velocity: np.ndarray | None = None
) -> Response:
    """Return the response to forces at contacts with the rows `matrix`, shape (N, n), under a force or at a velocity.

    Raises
    ------
    InputError
        If the mass matrix is not positive definite, or a row is zero.
    """
    right = matrix if force is None else np.concatenate((matrix, -force[None]))
    try:
        columns = np.linalg.solve(mass_matrix, right.T)
    except np.linalg.LinAlgError:
        raise InputError("The mass matrix is singular; every coordinate needs a mass or an inertia.") from None
    size = len(matrix)
    free = columns[:, size] if velocity is None else velocity
    per_force = columns[:, :size]
    mobility = matrix @ per_force
    diagonal = mobility.diagonal().tolist()
    if not all(value > 0 for value in diagonal):
        values = ", ".join(f"{value:g}" for value in diagonal)
        raise InputError(
            f"The mobility W M^-1 W' of every contact row must be positive, got {values}: "
            "the mass matrix must be positive definite and no row zero."
        )
    square = velocity @ mass_matrix @ velocity if force is None else -force @ free
    return Response(free, per_force, mobility, matrix @ free, math.sqrt(max(square, 0.0)))


def _find_single(
    mass_matrix: np.ndarray,
    contact: ClosedContact,
    friction: Friction,
    force: np.ndarray | None,
    velocity: np.ndarray | None,
) -> ContactMotions | None:
    """Return the consistent motions of a robot with one contact, or None if the closed form does not apply."""
    vectors = (contact.normal_row,) if contact.is_stop else (contact.normal_row, contact.tangent_row)
    response = respond(mass_matrix, np.array(vectors, dtype=float), force=force, velocity=velocity)
    mobility, constant = response.mobility.tolist(), response.constant.tolist()
    impact = velocity is not None
    if not impact:
        constant[0] += contact.normal_bias
    if contact.is_stop:
        motions = solve_stop(constant[0], mobility[0][0], contact.latched, response.size)
        return ContactMotions([contact.name], response, motions, None)
    static, kinetic = coefficients_of(friction, contact.name)
    if impact:
        static, sign = kinetic, 0
    else:
        constant[1] += contact.tangent_bias
        sign = slip_sign((contact,), kinetic)
    (nn, nt), (_, tt) = mobility
    problem = SingleContact((constant[0], constant[1]), (nn, nt, tt), static, kinetic, sign, response.size)
    feet = solve_foot(problem)
    return None if feet is None else ContactMotions([contact.name], response, feet, None)


def _find_several(
    mass_matrix: np.ndarray,
    contacts: Sequence[ClosedContact],
    friction: Friction,
    force: np.ndarray | None,
    velocity: np.ndarray | None,
) -> ContactMotions:
    """Return the consistent motions of a robot with any contacts."""
    rows = stack_rows(contacts, friction, len(mass_matrix))
    response = respond(mass_matrix, np.concatenate((rows.normals, rows.tangents)), force=force, velocity=velocity)
    signs, constant = [0] * len(rows.members), response.constant
    if velocity is None:
        signs = [
            slip_sign([contacts[number] for number in members], max(kinetic))
            for members, kinetic in zip(rows.members, rows.kinetic.tolist(), strict=True)
        ]
        constant = constant + np.concatenate((rows.normal_bias, rows.tangent_bias))
    else:
        rows = rows._replace(static=rows.kinetic)
    infinite = np.isinf(rows.kinetic).any(axis=1).tolist()
    groups = tuple(
        GroupOptions(members, (sign,) if sign else INSEPARABLE if rough else AT_REST)
        for members, sign, rough in zip(rows.members, signs, infinite, strict=True)
    )
    stops = tuple((number, contact.latched) for number, contact in enumerate(contacts) if contact.is_stop)
    problem = scale_problem(
        rows, response.mobility, constant, np.array([not sign for sign in signs], dtype=bool), response.size
    )
    motions = enumerate_modes(problem, tabulate_modes(groups, stops))
    return ContactMotions([contact.name for contact in contacts], response, motions, rows)


def slip_sign(members: Sequence[ClosedContact], kinetic: float) -> int:
    """Return the direction of slip of the contacts of a group, 0 at rest.

    Raises
    ------
    InputError
        If they move in different directions, or have infinite friction and move.
    """
    signs = {1 if contact.slip_speed > 0 else -1 for contact in members if contact.moves}
    if not signs:
        return 0
    if len(signs) > 1 or math.isinf(kinetic):
        speeds = ", ".join(f"{contact.name!r}: {contact.slip_speed:g}" for contact in members)
        if len(signs) > 1:
            raise InputError(f"The contacts of a group must slip in the same direction, got {speeds} [m/s].")
        raise InputError(f"Contacts with infinite friction must have slip speeds of 0, got {speeds} [m/s].")
    return signs.pop()
