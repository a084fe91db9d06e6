"""The motion of a planar robot at one instant of a phase as expressions, and the constraints that hold there."""

import math
from dataclasses import replace

import casadi as ca

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.phase_system import contact_forces
from gaitopt.ocp.multicontact.phase_grid import GridPhase
from gaitopt.ocp.multicontact.planar_builder import PlanarBuilder
from gaitopt.ocp.nlp.keys import Key, Kind, Row, equation

Condition = tuple[Row, ca.SX]
"""A constraint row and its value."""


@dataclass(frozen=True, eq=False)
class PlanarPoint:
    """The motion at one instant.

    Attributes
    ----------
    q, v, u, z : SX
        Coordinates, rates, torques; accelerations and forces, those of the contacts and then those of the joints.
    p : SX
        Parameters and switches.
    """

    q: ca.SX
    v: ca.SX
    u: ca.SX
    z: ca.SX
    p: ca.SX

    @property
    def acceleration(self) -> ca.SX:
        """Accelerations, shape (n_q, 1)."""
        return self.z[: self.q.numel()]

    def move(self, q: ca.SX, v: ca.SX, u: ca.SX, z: ca.SX) -> "PlanarPoint":
        """Return another point with the same parameters."""
        return replace(self, q=q, v=v, u=u, z=z)


def motion_residual(builder: PlanarBuilder, phase: GridPhase, point: PlanarPoint) -> ca.SX:
    """Return the residual of the equations of motion, of the accelerations of the contacts and of the joints."""
    robot, system, n, n_z = builder.robot, phase.system, builder.robot.n_q, count_solution(phase)
    forces = contact_forces(robot, list(phase.state), system.closed, system.sticking, point.z, point.p)
    balance, contacts = builder.structure.equations.motion(
        point.q, point.v, point.u, point.acceleration, forces, point.z[n_z:], point.p
    )
    normal = [contacts[1, i] for i in system.closed]
    tangential = [contacts[0, members[0]] for members in system.sticking]
    return ca.vertcat(balance[:n], *normal, *tangential, balance[n:])


def count_solution(phase: GridPhase) -> int:
    """Return the number n_z of accelerations and contact forces of a phase."""
    return int(phase.system.system.size1_out(0))


def point_outputs(phase: GridPhase, point: PlanarPoint) -> tuple[ca.SX, ca.SX]:
    """Return the power of each actuator, and the forces (f_t, f_n) of the contacts, shape (2, n_c)."""
    z = point.z[: count_solution(phase)]
    _, work_rates, forces = phase.system.outputs(point.q, point.v, point.u, z, point.p)
    return work_rates[: point.u.numel()], forces


def path_conditions(builder: PlanarBuilder, phase: GridPhase, point: PlanarPoint) -> list[Condition]:
    """Return the friction cones of sticking bodies, slip speeds, gaps of open contacts, and heights of points."""
    return [
        *cone_conditions(builder, phase, point),
        *slip_conditions(builder, phase, point),
        *gap_conditions(builder, phase, point),
        *height_conditions(builder, point),
    ]


def cone_conditions(
    builder: PlanarBuilder, phase: GridPhase, point: PlanarPoint, ended: frozenset[int] = frozenset()
) -> list[Condition]:
    """Return the friction cones of the sticking bodies, except those whose first contact is in `ended`."""
    if builder.structure.infinite:
        return []
    robot, conditions = builder.robot, []
    _, forces = point_outputs(phase, point)
    static = point.p[robot.index("friction")] * point.p[robot.index("static_friction_ratio")]
    for members in phase.system.sticking:
        if members[0] in ended:
            continue
        name, tangential = robot.contact_names[members[0]], forces[0, members[0]]
        limit = (1 - builder.margin("cone")) * static * ca.sum2(forces[1, list(members)])
        conditions.append((Row(Key(Kind.CONE_FORWARD, name), 0.0, math.inf), limit + tangential))
        conditions.append((Row(Key(Kind.CONE_BACKWARD, name), 0.0, math.inf), limit - tangential))
    return conditions


def slip_conditions(
    builder: PlanarBuilder, phase: GridPhase, point: PlanarPoint, ended: frozenset[int] = frozenset()
) -> list[Condition]:
    """Return the slip speeds of the sliding bodies in their directions, except of contacts in `ended`."""
    robot, tangent = builder.robot, builder.robot.rows(point.q, point.v, point.p)[1]
    speeds = tangent @ point.v
    return [
        (Row(Key(Kind.SLIP_SPEED_OF, robot.contact_names[i]), 0.0, math.inf), phase.state[i].sign * speeds[i])
        for i in first_of_bodies(builder, phase.state)
        if phase.state[i].slips and i not in ended
    ]


def gap_conditions(
    builder: PlanarBuilder, phase: GridPhase, point: PlanarPoint, ended: frozenset[int] = frozenset()
) -> list[Condition]:
    """Return the gaps of the open contacts, except of contacts in `ended`."""
    robot = builder.robot
    gap = robot.gaps(point.q, point.p)[0]
    return [
        (Row(Key(Kind.GAP, contact.name), 0.0, math.inf), gap[i])
        for i, contact in enumerate(robot.contacts)
        if phase.state[i] is Mode.FREE and not contact.falls and i not in ended
    ]


def height_conditions(builder: PlanarBuilder, point: PlanarPoint) -> list[Condition]:
    """Return the heights of the points with a clearance."""
    robot, positions = builder.robot, builder.robot.figure(point.q, point.p)
    return [
        (Row(Key(Kind.HEIGHT, name), 0.0, math.inf), positions[1, robot.points.index(name)])
        for name in builder.structure.points
    ]


def first_of_bodies(builder: PlanarBuilder, modes: tuple[Mode, ...]) -> list[int]:
    """Return the first closed contact with a slide coordinate of each body."""
    return [members[0] for members in closed_bodies(builder, modes)]


def closed_bodies(builder: PlanarBuilder, modes: tuple[Mode, ...]) -> list[tuple[int, ...]]:
    """Return the closed contacts with a slide coordinate of each body."""
    bodies: dict[str, list[int]] = {}
    for i, (contact, mode) in enumerate(zip(builder.robot.contacts, modes, strict=True)):
        if mode is not Mode.FREE and contact.slides:
            bodies.setdefault(contact.body, []).append(i)
    return [tuple(members) for members in bodies.values()]


def dynamics_rows(builder: PlanarBuilder, phase: GridPhase, keys: list[Key]) -> list[Row]:
    """Return the rows of the residual, from the keys of z."""
    n, n_z = builder.robot.n_q, count_solution(phase)
    motion = [equation(Kind.EQUATION_OF_MOTION, key.of) for key in keys[:n]]
    contacts = [equation(Kind.ACCELERATION, key.of) for key in keys[n:n_z]]
    return motion + contacts + [equation(key.kind, key.of) for key in keys[n_z:]]
