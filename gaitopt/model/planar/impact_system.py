"""Equations of a plastic impact with given outcome, and the derivatives of contact velocities.

The unknowns are w = (v+, Lambda_n of the contacts with an impulse, Lambda_t of the sticking bodies).  They satisfy

    M (v+ - v) - E P - sum of W_n^T Lambda_n + W_t^T Lambda_t = 0     with impulses P of the actuators, if there are any
    Lambda_t = -s mu Lambda_n of a contact that slips in direction s
    W_n v+ = 0, and W_t v+ = 0 of a sticking body
"""

import functools

import casadi as ca

from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.phase_system import contact_forces, group_sticking, select_rows
from gaitopt.model.planar.planar_robot import PlanarRobot


@functools.lru_cache(maxsize=256)
def impact_slope(robot: PlanarRobot, outcome: ContactState) -> ca.Function:
    """Return (q, v, P, p) -> velocity after the impact (n_q), its derivatives with respect to q and v, (n_q, n_q) each.

    Parameters
    ----------
    robot : PlanarRobot
    outcome : ContactState
        Mode of each contact in the impact.

    Notes
    -----
    P are the impulses of the actuators, shape (n_u,) [N s or N m s].

    Examples
    --------
    >>> from gaitopt.model.robots.vertical_hopper import vertical_hopper
    >>> hopper = vertical_hopper()
    >>> slope = impact_slope(hopper, ContactState.of({"sole": "closed", "full length": "free"}))
    >>> slope([0.5, 0], [-2, -2], [], hopper.vector(hopper.resolve({})))[0]
    DM([-2, 0])
    """
    modes = [mode for _, mode in outcome.modes]
    closed = tuple(i for i, mode in enumerate(modes) if mode is not Mode.FREE)
    sticking, n = group_sticking(robot, modes), robot.n_q
    q, v, acting = ca.SX.sym("q", n), ca.SX.sym("v", n), ca.SX.sym("P", robot.n_u)
    p = ca.SX.sym("p", len(robot.parameters) + len(robot.switches))
    w = ca.SX.sym("w", n + len(closed) + len(sticking))
    normal, tangent, _, _ = robot.rows(q, v, p)
    impulse = contact_forces(robot, modes, closed, sticking, w, p)
    rows = ca.vertcat(select_rows(normal, closed), select_rows(tangent, [members[0] for members in sticking]))
    mass_matrix, _, actuation = robot.dynamics(q, v, p)
    change = mass_matrix @ (w[:n] - v) - actuation @ acting
    residual = ca.vertcat(change - tangent.T @ impulse[0, :].T - normal.T @ impulse[1, :].T, rows @ w[:n])
    matrix = ca.jacobian(residual, w)
    parts = [q, v, w, acting, p]
    slopes = ca.Function("slopes", parts, [matrix, ca.jacobian(residual, q), ca.jacobian(residual, v)])
    system = ca.Function("system", [q, v, acting, p], [matrix, -ca.substitute(residual, w, ca.SX.zeros(w.shape))])
    mq, mv, ma, mp = (ca.MX.sym("x", symbol.numel()) for symbol in (q, v, acting, p))
    solution = ca.solve(*system(mq, mv, ma, mp))
    factor, by_q, by_v = slopes(mq, mv, solution, ma, mp)
    derivative = -ca.solve(factor, ca.horzcat(by_q, by_v))
    outputs = [solution[:n], derivative[:n, :n], derivative[:n, n:]]
    return ca.Function("impact_slope", [mq, mv, ma, mp], [ca.densify(output) for output in outputs])


@functools.lru_cache(maxsize=64)
def contact_slopes(robot: PlanarRobot) -> ca.Function:
    """Return (q, v, p) -> derivatives with respect to (q, v) of gaps, their rates and slip speeds, (n_c, 2 n_q) each.

    Examples
    --------
    >>> from gaitopt.model.robots.vertical_hopper import vertical_hopper
    >>> hopper = vertical_hopper()
    >>> contact_slopes(hopper)([1, 0.5], [0, 0], hopper.vector(hopper.resolve({})))[1][0, :]
    DM([[0, 0, 0, 1]])
    """
    q, v = ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q)
    p = ca.SX.sym("p", len(robot.parameters) + len(robot.switches))
    normal, tangent, _, _ = robot.rows(q, v, p)
    y, quantities = ca.vertcat(q, v), (robot.gaps(q, p)[0], normal @ v, tangent @ v)
    outputs = [ca.densify(ca.jacobian(quantity, y)) for quantity in quantities]
    return ca.Function("contact_slopes", [q, v, p], outputs)
