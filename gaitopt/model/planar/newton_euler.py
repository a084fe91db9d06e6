"""Equations of motion and of impacts of a planar robot by the Newton-Euler method, recursive or lifted.

The positions of the bodies and the coordinates of the contacts, o, are functions of q.  Their accelerations follow by
differentiation along the motion, body by body; the forces on them, by the reverse sweep, balance those of the
actuators.  No mass matrix is formed.

In the recursive form both sweeps are expressions of q, v and a.  In the lifted form the accelerations of the joints,
sigma = s'', and the forces that the joints transmit, lambda, are unknowns as well.  With s = phi(q, s), o = psi(q, s):

    sigma  = d^2 phi / dt^2
    lambda = phi_s^T lambda + psi_s^T F      with F = D (o'' - g), or minus the force at a contact
    E u    = phi_q^T lambda + psi_q^T F + R  with the forces R of springs and dampers

Every row contains one link and its joints, so that the numbers of operations and of nonzeros grow linearly with the
number of links, provided that the coordinates are absolute angles of the links: a relative angle enters the positions
of all links beyond its joint.  In an impact the jumps of v and s' take the place of the accelerations.
"""

from typing import NamedTuple

import casadi as ca

from gaitopt.model.planar.joint_sums import JointSums


class NewtonEuler(NamedTuple):
    """Equations of motion and of impacts in one form, with n_j = 0 joints in the recursive form.

    Attributes
    ----------
    motion : (q, v, u, a, forces, joints, p) -> residual (n_q + 2 n_j), contacts (2, n_c)
        Forces are (f_t, f_n) of each contact, shape (2, n_c), joints the accelerations and the forces of the joints,
        shape (2 n_j, 1).  The residual has the balance of forces, then the accelerations and the forces of the joints.
        Contacts are the accelerations of slide coordinates and gaps.
    impact : (q, jump, impulses, joints, p) -> residual (n_q + 2 n_j)
        The same with the jump of v, impulses, and the jumps of the rates and the impulses of the joints.
    n_j : int
    """

    motion: ca.Function
    impact: ca.Function
    n_j: int


class Balance(NamedTuple):
    """Inertia and forces in the equations of a robot.

    Attributes
    ----------
    inertia, gravity_accelerations : SX, shape (n_b, 1)
        Inertia and acceleration of gravity of the positions of the bodies.
    resistance : SX, shape (n_q, 1)
        Generalised forces against springs and dampers.
    angles : SX, shape (n_u, 1)
        Angles and lengths on which the actuators work.
    """

    inertia: ca.SX
    gravity_accelerations: ca.SX
    resistance: ca.SX
    angles: ca.SX


def derive_newton_euler(sums: JointSums, balance: Balance, symbols: tuple[ca.SX, ca.SX, ca.SX]) -> NewtonEuler:
    """Return the equations of a robot.

    Parameters
    ----------
    sums : JointSums
        Outputs are the positions of the bodies, then slide coordinate and gap of each contact.
    balance : Balance
    symbols : (q, v, p)
    """
    (q, v, p), n_j = symbols, sums.symbols.numel()
    n_c = (sums.outputs.numel() - balance.inertia.numel()) // 2
    u, a = ca.SX.sym("u", balance.angles.numel()), ca.SX.sym("a", q.numel())
    forces, joints = ca.SX.sym("f", 2, n_c), ca.SX.sym("j", 2 * n_j)
    parts = ca.vec(forces), joints
    residual, contacts = _sweep(sums, balance, (q, v, a), parts)
    residual[: q.numel()] += balance.resistance - ca.jtimes(balance.angles, q, u, True)
    still = balance._replace(gravity_accelerations=ca.SX.zeros(*balance.gravity_accelerations.shape))
    jump, _ = _sweep(sums, still, (q, ca.SX.zeros(*v.shape), a), parts)
    motion = [residual, ca.reshape(contacts, 2, n_c)]
    return NewtonEuler(
        ca.Function("motion", [q, v, u, a, forces, joints, p], ca.cse([ca.densify(part) for part in motion])),
        ca.Function("impact", [q, a, forces, joints, p], ca.cse([ca.densify(jump)])),
        n_j,
    )


def _sweep(
    sums: JointSums, balance: Balance, motion: tuple[ca.SX, ca.SX, ca.SX], parts: tuple[ca.SX, ca.SX]
) -> tuple[ca.SX, ca.SX]:
    """Return the residual without springs and actuators, and the accelerations of the contacts."""
    (q, v, a), (forces, joints), s = motion, parts, sums.symbols
    n, n_j, n_b = q.numel(), s.numel(), balance.inertia.numel()
    sigma, transmitted = joints[:n_j], joints[n_j:]
    positions, rate = ca.vertcat(sums.definitions, sums.outputs), ca.SX.sym("v", n)
    rates = ca.jtimes(positions, q, rate)  # of the parts that depend on q directly
    second = ca.jtimes(rates, ca.vertcat(q, rate), ca.vertcat(v, a)) + ca.jtimes(positions, s, sigma)
    second = ca.substitute(second, rate, v)
    bodies = balance.inertia * (second[n_j : n_j + n_b] - balance.gravity_accelerations)
    back = ca.jtimes(positions, ca.vertcat(q, s), ca.vertcat(transmitted, bodies, -forces), True)
    residual = ca.vertcat(back[:n], second[:n_j] - sigma, back[n:] - transmitted)
    return residual, second[n_j + n_b :]
