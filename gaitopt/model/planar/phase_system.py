"""Equations of a planar robot in one contact state: accelerations and forces as the solution of a linear system.

The unknowns are z = (a, f_n of the closed contacts, f_t of the sticking bodies).  They satisfy R(q, v, u, z) = 0:

    M a + h - E u - sum of W_n^T f_n + W_t^T f_t = 0     with f_t = -s mu f_n of a contact that slips in direction s
    W_n a + W_n' v = 0                                   for each closed contact
    W_t a + W_t' v = 0                                   for each sticking body

R is linear in z, so z = -K^-1 R(q, v, u, 0) with K = dR/dz, and its derivatives follow from those of R.
"""

import functools
from collections.abc import Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.terrain import Piece, Terrain


class GuardKind(NamedTuple):
    """A guard of a contact state: the event is where it falls through zero.

    Attributes
    ----------
    name : str
        ``closes`` (gap), ``opens`` (normal force), ``slips+`` and ``slips-`` (distance to the edges of the friction
        cone), ``rests`` (slip speed), ``extends`` (switched spring), ``crosses-`` and ``crosses+`` (distance to the
        beginning and the end of the piece of the terrain).
    number : int
        Number of the contact or of the switch.

    Examples
    --------
    >>> GuardKind("opens", 0).name
    'opens'
    """

    name: str
    number: int


class Footing(NamedTuple):
    """The terrain under the contacts in a contact state.

    Attributes
    ----------
    terrain : Terrain
    pieces : tuple of int or None
        Number of the piece under each closed contact; None for free contacts and stops.

    Examples
    --------
    >>> footing = Footing(Terrain(patches=[(0, 1, 0.1)]), (1, None))
    >>> footing.friction(0, 0.5), footing.friction(1, 0.5)
    (0.1, 0.5)
    """

    terrain: Terrain
    pieces: tuple[int | None, ...]

    def piece(self, contact: int) -> Piece | None:
        """Return the piece under a contact, or None."""
        number = self.pieces[contact]
        return None if number is None else self.terrain.pieces[number]

    def friction(self, contact: int, elsewhere: float) -> float:
        """Return the coefficient of kinetic friction under a contact; `elsewhere` outside the patches."""
        piece = self.piece(contact)
        return elsewhere if piece is None or piece.friction is None else piece.friction


class PhaseSystem(NamedTuple):
    """Equations of a robot in one contact state; p is the vector of parameters and switches.

    Attributes
    ----------
    closed : tuple of int
        Closed contacts, in the order of the normal forces in z.
    sticking : tuple of tuple of int
        Closed contacts of each sticking body, in the order of the tangential forces in z.
    guards : tuple of GuardKind
    system : (q, v, u, p) -> matrix K (n_z, n_z), right (n_z), of K z = right
    outputs : (q, v, u, z, p) -> guards (n_g), work_rates (n_w), forces (2, n_c)
        Work rates are the power of each actuator, the friction loss rate of each contact and that of the dampers [W].
        Forces are (f_t, f_n) of each contact; the tangential force of a sticking body is that of its first contact.
    system_slope : (q, v, u, z, p) -> dR/d(q, v) (n_z, 2 n_q), dR/du (n_z, n_u)
    guard_slope : (q, v, u, z, p) -> derivatives of the guards with respect to (q, v), u and z
    constraints : (q, v, p) -> positions (m), rows (m, n_q)
        Gaps of the closed contacts and slide coordinates of the sticking bodies, and their Jacobian.
    """

    closed: tuple[int, ...]
    sticking: tuple[tuple[int, ...], ...]
    guards: tuple[GuardKind, ...]
    system: ca.Function
    outputs: ca.Function
    system_slope: ca.Function
    guard_slope: ca.Function
    constraints: ca.Function


@functools.lru_cache(maxsize=256)
def make_phase_system(
    robot: PlanarRobot, state: ContactState, infinite: bool, footing: Footing | None = None
) -> PhaseSystem:
    """Return the equations of a robot in a contact state.

    Parameters
    ----------
    robot : PlanarRobot
    state : ContactState
        Mode of each contact, in the order of the robot.
    infinite : bool
        Whether the parameter friction is infinite, so that no contact begins to slip outside the patches of a terrain.
    footing : Footing, optional
        The terrain; by default a plane.

    Examples
    --------
    >>> from gaitopt.model.robots.vertical_hopper import vertical_hopper
    >>> state = ContactState.of({"sole": "closed", "full length": "free"})
    >>> make_phase_system(vertical_hopper(), state, False).guards[0]
    GuardKind(name='opens', number=0)
    """
    modes = [mode for _, mode in state.modes]
    closed = tuple(i for i, mode in enumerate(modes) if mode is not Mode.FREE)
    sticking = group_sticking(robot, modes)
    q, v, u = ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q), ca.SX.sym("u", robot.n_u)
    p = ca.SX.sym("p", len(robot.parameters) + len(robot.switches))
    z = ca.SX.sym("z", robot.n_q + len(closed) + len(sticking))
    normal, tangent, normal_bias, tangent_bias = robot.rows(q, v, p)
    mass_matrix, bias, actuation = robot.dynamics(q, v, p)
    friction = [p[robot.index("friction")]] * len(modes)
    gap, slide = robot.gaps(q, p)
    if footing is not None:
        friction = [footing.friction(i, coefficient) for i, coefficient in enumerate(friction)]
        gap = gap - _heights(footing, robot.rims(q, p)[0, :])
    forces = contact_forces(robot, modes, closed, sticking, z, p, friction)
    first = [members[0] for members in sticking]
    rows = ca.vertcat(select_rows(normal, closed), select_rows(tangent, first))
    bias_rows = ca.vertcat(select_rows(normal_bias, closed), select_rows(tangent_bias, first))
    acceleration = z[: robot.n_q]
    residual = ca.vertcat(
        mass_matrix @ acceleration + bias - actuation @ u - tangent.T @ forces[0, :].T - normal.T @ forces[1, :].T,
        rows @ acceleration + bias_rows,
    )
    rough = [infinite and (footing is None or np.isinf(footing.friction(i, np.inf))) for i in range(len(modes))]
    bounded = [members for members in sticking if not any(rough[i] for i in members)]
    kinds, guards = _guards(robot, modes, bounded, friction, (q, v, p, gap, tangent @ v, forces))
    if footing is not None:
        kinds, guards = _add_place_guards(robot, modes, footing, (kinds, guards), robot.rims(q, p)[0, :])
    powers = ca.vertcat(u * robot.joint_rates(q, v, p), -forces[0, :].T * (tangent @ v), robot.force_powers(q, v, p)[1])
    y, inputs = ca.vertcat(q, v), [q, v, u, z, p]
    matrix = ca.jacobian(residual, z)
    right = -ca.substitute(residual, z, ca.SX.zeros(z.shape))
    return PhaseSystem(
        closed,
        sticking,
        kinds,
        _function("system", [q, v, u, p], [matrix, right]),
        _function("outputs", inputs, [guards, powers, forces]),
        _function("system_slope", inputs, [ca.jacobian(residual, y), ca.jacobian(residual, u)]),
        _function("guard_slope", inputs, [ca.jacobian(guards, symbol) for symbol in (y, u, z)]),
        _function("constraints", [q, v, p], [ca.vertcat(select_rows(gap, closed), select_rows(slide, first)), rows]),
    )


def select_rows(matrix: ca.SX, places: Sequence[int]) -> ca.SX:
    """Return some rows of a matrix; none gives a matrix without rows.

    Examples
    --------
    >>> select_rows(ca.SX.eye(2), [1]), select_rows(ca.SX.eye(2), []).shape
    (SX([[00, 1]]), (0, 2))
    """
    return ca.vertcat(*[matrix[i, :] for i in places]) if places else ca.SX(0, matrix.shape[1])


def group_sticking(robot: PlanarRobot, modes: list[Mode]) -> tuple[tuple[int, ...], ...]:
    """Return the sticking contacts of each body."""
    bodies: dict[str, list[int]] = {}
    for i, (contact, mode) in enumerate(zip(robot.contacts, modes, strict=True)):
        if mode is Mode.STICK:
            bodies.setdefault(contact.body, []).append(i)
    return tuple(tuple(members) for members in bodies.values())


def contact_forces(
    robot: PlanarRobot,
    modes: list[Mode],
    closed: tuple[int, ...],
    sticking: tuple[tuple[int, ...], ...],
    z: ca.SX,
    p: ca.SX,
    friction: Sequence[ca.SX] | None = None,
) -> ca.SX:
    """Return the force (f_t, f_n) of each contact, shape (2, n_c); by default `friction` is that in p."""
    forces = ca.SX.zeros(2, len(robot.contacts))
    friction = [p[robot.index("friction")]] * len(robot.contacts) if friction is None else friction
    for place, i in enumerate(closed):
        forces[1, i] = z[robot.n_q + place]
        if modes[i].slips:
            forces[0, i] = -modes[i].sign * friction[i] * forces[1, i]
    for place, members in enumerate(sticking):
        forces[0, members[0]] = z[robot.n_q + len(closed) + place]
    return forces


def _guards(
    robot: PlanarRobot,
    modes: list[Mode],
    bounded: Sequence[tuple[int, ...]],
    friction: Sequence[ca.SX],
    parts: tuple[ca.SX, ...],
) -> tuple[tuple[GuardKind, ...], ca.SX]:
    """Return the guards of a contact state and their kinds; the contacts of `bounded` bodies can begin to slip."""
    q, v, p, gap, speed, forces = parts
    kinds, guards = [], []
    for i, mode in enumerate(modes):
        if mode is Mode.FREE:
            kinds.append(GuardKind("closes", i))
            guards.append(gap[i])
        elif mode is not Mode.LATCHED:
            kinds.append(GuardKind("opens", i))
            guards.append(forces[1, i])
        if mode.slips:
            kinds.append(GuardKind("rests", i))
            guards.append(mode.sign * speed[i])
    ratio = p[robot.index("static_friction_ratio")]
    for members in bounded:
        edge, tangential = ratio * sum(friction[i] * forces[1, i] for i in members), forces[0, members[0]]
        kinds += [GuardKind("slips+", members[0]), GuardKind("slips-", members[0])]
        guards += [edge + tangential, edge - tangential]
    switches = robot.switch_guards(q, v, p)
    for k, contact in enumerate(robot.switches):
        if modes[robot.contact_index(contact)] is not Mode.FREE:
            kinds.append(GuardKind("extends", k))
            extended = p[len(robot.parameters) + k]
            guards.append((1 - extended) * switches[k] + extended)  # positive while the spring is extended
    return tuple(kinds), ca.vertcat(*guards)


def _heights(footing: Footing, places: ca.SX) -> ca.SX:
    """Return the height of the ground under each contact: of its piece if it is closed, else of its place."""
    heights = []
    for i in range(places.numel()):
        piece, place = footing.piece(i), places[i]
        steps = [] if place.is_constant() else footing.terrain.steps  # a joint stop has no place
        under = sum((rise * (place >= at) for at, rise in steps), ca.SX(0))
        heights.append(under if piece is None else ca.SX(piece.height))
    return ca.vertcat(*heights)


def _add_place_guards(
    robot: PlanarRobot,
    modes: list[Mode],
    footing: Footing,
    guards: tuple[tuple[GuardKind, ...], ca.SX],
    places: ca.SX,
) -> tuple[tuple[GuardKind, ...], ca.SX]:
    """Return the guards with the distances of sliding and rolling contacts to the ends of their pieces."""
    kinds, values = list(guards[0]), [guards[1]]
    for i, (contact, mode) in enumerate(zip(robot.contacts, modes, strict=True)):
        piece = footing.piece(i)
        if piece is None or not (mode.slips or contact.kind == "arc"):
            continue
        for name, distance in (("crosses-", places[i] - piece.begin), ("crosses+", piece.end - places[i])):
            if np.isfinite(piece.begin if name == "crosses-" else piece.end):
                kinds.append(GuardKind(name, i))
                values.append(distance)
    return tuple(kinds), ca.vertcat(*values)


def _function(label: str, inputs: list[ca.SX], outputs: list[ca.SX]) -> ca.Function:
    return ca.Function(label, inputs, ca.cse([ca.densify(output) for output in outputs]))
