"""Accelerations and contact forces of the stance foot in each contact mode.

In coordinates relative to the foot, a sticking foot eliminates its two coordinates and a sliding foot the normal one,
so no system with multipliers is needed:

stick   M_aa a_a = (E u - h)_a, then f from the two foot rows
slip    f_t = -s mu f_n; eliminating f_n from the foot rows gives
        [row_x + s mu row_y; rows_a] (a_x, a_a) = 0, then f_n from row_y
free    the full system with f = 0
"""

import casadi as ca

from gaitopt.model.contacts.mode import Mode


def accelerations(mode: Mode, mass_matrix: ca.SX, drive: ca.SX, friction: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return acceleration and contact force of a mode.

    Parameters
    ----------
    mode : Mode
    mass_matrix : SX, shape (n_q, n_q)
    drive : SX, shape (n_q, 1)
        Generalised force without contact, E u - h.
    friction : SX
        Coulomb coefficient.

    Returns
    -------
    acceleration : SX, shape (n_q, 1)
    force : SX, shape (2, 1)
        (f_t, f_n) on the foot [N].
    """
    if mode is Mode.FREE:
        return solve_symmetric(mass_matrix, drive), ca.SX.zeros(2)
    if mode is Mode.STICK:
        inner = solve_symmetric(mass_matrix[2:, 2:], drive[2:])
        acceleration = ca.vertcat(ca.SX.zeros(2), inner)
        return acceleration, mass_matrix[:2, 2:] @ inner - drive[:2]
    # Angles first, as functions of the foot acceleration; then one scalar equation for the latter.
    both = solve_symmetric(mass_matrix[2:, 2:], ca.horzcat(drive[2:], mass_matrix[2:, 0]))
    at_rest, per_foot = both[:, 0], both[:, 1]
    slide = mode.sign * friction
    row = mass_matrix[0, :] + slide * mass_matrix[1, :]
    load = drive[0] + slide * drive[1] - row[2:] @ at_rest
    foot = load / (row[0] - row[2:] @ per_foot)
    acceleration = ca.vertcat(foot, 0, at_rest - per_foot * foot)
    normal = mass_matrix[1, :] @ acceleration - drive[1]
    return acceleration, ca.vertcat(-slide * normal, normal)


def sliding_inertia(mass_matrix: ca.SX, friction: ca.SX) -> ca.SX:
    """Return the effective mass of the foot in forward and in backward slip over the total mass, shape (2, 1).

    It is the tangential force per acceleration of the foot, with friction proportional to the normal force, over the
    total mass: with S the inverse of the foot's mobility W M^-1 W^T, (S_tt + s mu S_tn) / M_tt for s = +1 and -1.
    As S is positive definite, its sign is that of

        w_n M^-1 (w_n - s mu w_t)^T

    Slip is well posed while it is positive; otherwise Painleve's paradox occurs.
    """
    # The same expressions as in the acceleration of a slip, so that integrators evaluate them once.
    per_foot, fractions = solve_symmetric(mass_matrix[2:, 2:], mass_matrix[2:, 0]), []
    for slide in (friction, -friction):
        row = mass_matrix[0, :] + slide * mass_matrix[1, :]
        fractions.append((row[0] - row[2:] @ per_foot) / mass_matrix[0, 0])
    return ca.vertcat(*fractions)


def solve_symmetric(matrix: ca.SX, right: ca.SX) -> ca.SX:
    """Return matrix^-1 right for a symmetric positive definite matrix, by its LDL^T factors.

    Expansion by minors, CasADi's method for small systems, is inaccurate for light legs: its error grows with the
    square of the mass ratio.
    """
    return ca.ldl_solve(right, *ca.ldl(ca.densify(matrix)))
