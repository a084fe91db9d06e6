"""Accelerations and contact forces of the stance foot in each contact mode.

In foot-anchored coordinates a stuck foot simply drops its two coordinates and a sliding one drops the normal
coordinate, so no multiplier system has to be solved:

stick   M_aa a_a = (E u - h)_a, then f from the two foot rows
slip    f_t = -s mu f_n; eliminating f_n from the foot rows gives
        [row_x + s mu row_y; rows_a] (a_x, a_a) = 0, then f_n from row_y
free    the full system with f = 0
"""

import casadi as ca

from gaitopt.model.modes import Mode


def accelerations(mode: Mode, mass_matrix: ca.SX, drive: ca.SX, friction: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Return acceleration and contact force of a mode.

    Parameters
    ----------
    mode : Mode
    mass_matrix : SX, shape (n_q, n_q)
    drive : SX, shape (n_q, 1)
        Generalized force without contact, E u - h.
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
    slide = mode.sign * friction
    # Angles first, as functions of the foot's acceleration a_x; then one scalar equation for a_x.
    row = mass_matrix[0, :] + slide * mass_matrix[1, :]
    both = solve_symmetric(mass_matrix[2:, 2:], ca.horzcat(drive[2:], mass_matrix[2:, 0]))
    at_rest, per_foot = both[:, 0], both[:, 1]
    load = drive[0] + slide * drive[1] - row[2:] @ at_rest
    foot = load / (row[0] - row[2:] @ per_foot)
    acceleration = ca.vertcat(foot, 0, at_rest - per_foot * foot)
    normal = mass_matrix[1, :] @ acceleration - drive[1]
    return acceleration, ca.vertcat(-slide * normal, normal)


def foot_mobility(mass_matrix: ca.SX, jacobian: ca.SX) -> ca.SX:
    """Return J M^-1 J^T, shape (2, 2): foot velocity change per unit impulse [1/kg]."""
    return jacobian @ solve_symmetric(mass_matrix, jacobian.T)


def solve_symmetric(matrix: ca.SX, right: ca.SX) -> ca.SX:
    """Return matrix^-1 right for a symmetric positive definite matrix, by its LDL^T factors.

    Expanding by minors, as CasADi does for small systems, loses the square of the mass ratio in digits for light legs.
    """
    return ca.ldl_solve(right, *ca.ldl(ca.densify(matrix)))


def wellposedness(mobility: ca.SX, friction: ca.SX) -> ca.SX:
    """Return w_n M^-1 (w_n - s mu w_t)^T for s = +1 and -1, shape (2, 1).

    Slip with sign s is well posed while its entry is positive; otherwise it is Painleve's paradox.
    """
    return ca.vertcat(
        mobility[1, 1] - friction * mobility[1, 0],
        mobility[1, 1] + friction * mobility[1, 0],
    )
