"""The objective of a planar robot: its integral over an interval, and the parts of the joint powers."""

from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.lazy import Deferred, LazyField
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.motion.motion import Array
from gaitopt.ocp.multicontact.phase_grid import GridPhase
from gaitopt.ocp.multicontact.planar_builder import PlanarBuilder
from gaitopt.ocp.multicontact.planar_point import Condition, PlanarPoint, closed_bodies, point_outputs
from gaitopt.ocp.nlp.keys import Kind, Unknown, equation
from gaitopt.ocp.nlp.nlp import Block
from gaitopt.ocp.transcription.bernstein import bernstein_basis, bernstein_transformation
from gaitopt.ocp.transcription.nlp_builder import BlockVariables


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanarInstant:
    """A planar robot at one instant, the argument of objectives.  Quantities are CasADi expressions.

    Attributes
    ----------
    phase : int
        Number of the phase, from 0.
    state : ContactState
        Modes of the contacts.
    coordinates, actuators : tuple of str
        Names of the rows of `q` and of `torque`.
    q, v, acceleration : (n_q)
        Coordinates [m or rad], their rates and accelerations.
    torque, torque_rate : (n_u) [N m or N]
    positive, negative : (n_u) [W]
        Parts of the joint powers, both >= 0, with power = positive - negative; zero unless the objective `uses_power`.
    force : (2, n_c) [N]
        Force (f_t, f_n) of each contact; that of a sticking body at its first contact.
    foot_forces : (2, n_f) [N]
        Force (f_t, f_n) of each of the n_f bodies on the ground, the sum of those of its contacts.
    slip_speed : scalar [m/s]
        Sum of the absolute slip speeds of the bodies.
    parameters : mapping of str to scalar

    Examples
    --------
    >>> column = ca.DM([0.0, 0.7])
    >>> instant = PlanarInstant(
    ...     phase=0, state=ContactState.of({"foot": "stick"}), coordinates=("x", "y"), actuators=("leg",), q=column,
    ...     v=column, acceleration=column, torque=ca.DM([3]), torque_rate=ca.DM([0]), positive=ca.DM([0]),
    ...     negative=ca.DM([0]), force=ca.DM([[0], [98]]),
    ...     foot_forces=ca.DM([[0], [98]]), slip_speed=ca.DM(0), parameters={},
    ... )
    >>> instant.coordinate("y"), instant.torque_of("leg"), instant.force_of("foot")
    (DM(0.7), DM(3), DM([0, 98]))
    """

    phase: int
    state: ContactState
    coordinates: tuple[str, ...]
    actuators: tuple[str, ...]
    q: Any
    v: Any
    acceleration: Any
    torque: Any
    torque_rate: Any
    positive: Any
    negative: Any
    force: Any
    foot_forces: LazyField[Any] = LazyField()
    slip_speed: Any
    parameters: Mapping[str, Any]

    def coordinate(self, name: str) -> Any:
        """Return a coordinate [m or rad]."""
        return self.q[self.coordinates.index(name)]

    def rate(self, name: str) -> Any:
        """Return the rate of a coordinate [m/s or rad/s]."""
        return self.v[self.coordinates.index(name)]

    def torque_of(self, actuator: str) -> Any:
        """Return the torque or force of an actuator [N m or N]."""
        return self.torque[self.actuators.index(actuator)]

    def force_of(self, contact: str) -> Any:
        """Return the force (f_t, f_n) of a contact [N]."""
        names = [name for name, _ in self.state.modes]
        return self.force[:, names.index(contact)]


class IntervalCost:
    """The integral of the objective over an interval of a phase.

    Parameters
    ----------
    builder : PlanarBuilder
    local : BlockVariables
        Local variables of the block; the parts of the powers are added to them.
    phase : GridPhase
    points : list of PlanarPoint
        Start, inner points and end of an interval.
    length : SX [s]
    """

    def __init__(
        self, builder: PlanarBuilder, local: BlockVariables, phase: GridPhase, points: list[PlanarPoint], length: ca.SX
    ) -> None:
        self.builder, self.phase, self.points, self.length = builder, phase, points, length
        self.powers: list[ca.SX] = []
        if (Unknown.POWER, phase.number) in builder.variables:
            nodes = builder.variables[Unknown.POWER, phase.number]
            inner = local.add("inner power", builder.variables[Unknown.INNER_POWER, phase.number])
            size = inner.numel() // (len(points) - 2)
            self.powers = [
                local.add("power", nodes[:, :-1]),
                *ca.vertsplit(inner, size),
                local.add("power after", nodes[:, 1:]),
            ]

    def conditions(self) -> list[Condition]:
        """Return power = positive part - negative part for the Bernstein coefficients of the powers."""
        if not self.powers:
            return []
        powered = list(self.builder.structure.powered)
        values = ca.horzcat(*[point_outputs(self.phase, point)[0][powered] for point in self.points])
        fractions = tuple(self.builder.structure.scheme.fractions)
        coefficients = ca.horzsplit(values @ ca.DM(bernstein_transformation(fractions)).T)
        conditions: list[Condition] = []
        for inner in range(len(self.points) - 1):
            split = planar_power_split(self.builder, coefficients[inner], self.powers[inner])
            conditions += [(row._replace(key=row.key.at(inner)), value) for row, value in split]
        return conditions

    def integrals(self) -> tuple[ca.SX, ca.SX]:
        """Return the integrals of the plain integrands and of those per weight and travel."""
        scheme, plain, relative = self.builder.structure.scheme, ca.SX(0), ca.SX(0)
        rate = (self.points[-1].u - self.points[0].u) / self.length
        idle = [make_instant(self.builder, self.phase, point, rate) for point in self.points]
        powered = idle
        if self.powers:
            basis = [bernstein_basis(at, len(self.powers) - 1) for at in scheme.fractions]
            parts = ca.horzsplit(ca.horzcat(*self.powers) @ ca.DM(basis).T)
            powered = [
                make_instant(self.builder, self.phase, point, rate, part)
                for point, part in zip(self.points, parts, strict=True)
            ]
        smooth = scheme.smooth_weights()
        for weight, term in self.builder.structure.objective.terms():
            rule = smooth if term.smooth else scheme.kinked_weights()
            mean = _weighted_sum(term, rule, idle)
            if term.uses_power:
                mean += _weighted_sum(term, smooth, powered) - _weighted_sum(term, smooth, idle)
            if term.per_weight_and_travel:
                relative += weight * mean
            else:
                plain += weight * mean
        return self.length * plain, self.length * relative


def _weighted_sum(term: Any, rule: Array, instants: list[PlanarInstant]) -> ca.SX:
    parts = zip(rule, instants, strict=True)
    return sum((float(share) * ca.SX(term.integrand(instant)) for share, instant in parts if share), ca.SX(0))


def planar_power_split(builder: PlanarBuilder, power: ca.SX, parts: ca.SX) -> list[Condition]:
    """Return power = positive part - negative part for every actuator that is not idle."""
    count = len(builder.structure.powered)
    names = [builder.robot.actuators[i] for i in builder.structure.powered]
    values = parts[:count] - parts[count:] - power
    return [(equation(Kind.POWER_SPLIT, name), values[i]) for i, name in enumerate(names)]


def make_instant(
    builder: PlanarBuilder,
    phase: GridPhase,
    point: PlanarPoint,
    rate: ca.SX,
    parts: ca.SX | None = None,
    opening: frozenset[int] = frozenset(),
) -> PlanarInstant:
    """Return the argument of objectives at a point.

    Parameters
    ----------
    builder, phase, point
    rate : (n_u)
        Torque rates.
    parts : (2 n_powered), optional
        Parts of the powers, if they are known.
    opening : frozenset of int
        First contact of each body that lifts off at this point; it counts as no longer on the ground.
    """
    robot, powered = builder.robot, list(builder.structure.powered)
    positive, negative = ca.SX.zeros(robot.n_u), ca.SX.zeros(robot.n_u)
    if parts is not None:
        positive[powered], negative[powered] = parts[: len(powered)], parts[len(powered) :]
    speeds = robot.rows(point.q, point.v, point.p)[1] @ point.v
    slips = [phase.state[i].sign * speeds[i] for i in range(len(phase.state)) if phase.state[i].slips]
    forces = point_outputs(phase, point)[1]
    feet = [list(members) for members in closed_bodies(builder, phase.state) if members[0] not in opening]
    return PlanarInstant(
        phase=phase.number,
        state=ContactState(tuple(zip(robot.contact_names, phase.state, strict=True))),
        coordinates=robot.coordinates,
        actuators=robot.actuators,
        q=point.q,
        v=point.v,
        acceleration=point.acceleration,
        torque=point.u,
        torque_rate=rate,
        positive=positive,
        negative=negative,
        force=forces,
        foot_forces=Deferred(lambda: ca.horzcat(ca.SX(2, 0), *[ca.sum2(forces[:, members]) for members in feet])),
        slip_speed=sum(slips, ca.SX(0)),
        parameters=dict(zip(builder.names(), ca.vertsplit(point.p[: len(builder.names())]), strict=True)),
    )


def planar_quotient_block(builder: PlanarBuilder) -> Block:
    """Return the block of the objective per weight and travel, and complete the row that defines its integral."""
    local, robot = BlockVariables(builder, 1), builder.robot
    p = builder.parameters(local)
    if robot.travel is None:
        raise ValueError("an objective divided by travel requires a coordinate of travel")
    place = robot.coordinates.index(robot.travel)
    columns = builder.variables[Unknown.COORDINATES][[place]]
    travel = local.add("last", columns[:, [-1]]) - local.add("first", columns[:, [0]])
    integral = local.add("integral", builder.variables[Unknown.INTEGRAL])
    cost = integral / (robot.mass(p) * p[robot.index("gravity")] * travel)
    return local.block("quotient", -integral, np.array([[builder.integral_row()]]), cost)
