"""Constraints of the intervals of a phase: collocation with projected end points, contact rows, path constraints.

Accelerations and forces are unknown at every Lobatto point; q and v inside an interval are integrals of the
interpolated accelerations.  The equations of motion and the accelerations of the contacts hold at every point.  At the
end of each interval the constraints hold on positions and velocities as well, and the end points are projected,

    q_{k+1} = integral + W^T nu,    v_{k+1} = integral + W^T eta,

with two further unknowns per constraint.  nu and eta have the order of the integration error.
"""

import casadi as ca
import numpy as np

from gaitopt.ocp.multicontact.phase_grid import GridPhase, opening_bodies
from gaitopt.ocp.multicontact.planar_builder import PlanarBuilder, constraint_names, solution_keys
from gaitopt.ocp.multicontact.planar_objective import IntervalCost
from gaitopt.ocp.multicontact.planar_point import (
    Condition,
    PlanarPoint,
    dynamics_rows,
    motion_residual,
    path_conditions,
    point_outputs,
)
from gaitopt.ocp.multicontact.planar_step_cost import peak_conditions
from gaitopt.ocp.nlp.keys import Group, Key, Kind, Row, Unknown, equation
from gaitopt.ocp.nlp.layout import Index
from gaitopt.ocp.nlp.nlp import Block
from gaitopt.ocp.transcription.collocation import end_slopes, integrals, lobatto_points
from gaitopt.ocp.transcription.nlp_builder import BlockVariables


def planar_interval_block(builder: PlanarBuilder, phase: GridPhase) -> Block:
    """Return the block of the intervals of a phase."""
    return _PhaseIntervals(builder, phase).block()


class _PhaseIntervals:
    """The block of the intervals of a phase under construction.

    Attributes
    ----------
    points : list of PlanarPoint
        Start, inner points and end of an interval.
    conditions : list of Condition
        Rows of each interval.
    """

    def __init__(self, builder: PlanarBuilder, phase: GridPhase) -> None:
        self.builder, self.phase, self.local = builder, phase, BlockVariables(builder, phase.count)
        self.conditions: list[Condition] = []
        self.p = builder.parameters(self.local)
        left, right = np.arange(phase.count), np.arange(1, phase.count + 1)
        start, end = self._node("", left), self._node(" after", right)
        self.length = self.local.add("duration", builder.variables[Unknown.DURATION][:, [phase.number]]) / phase.count
        inner = self.local.add("inner", builder.variables[Unknown.INNER_ACCELERATION, phase.number])
        self.points = [start, *self._advance(start, end, inner), end]

    def block(self) -> Block:
        """Return the block."""
        builder, phase = self.builder, self.phase
        rate = (self.points[-1].u - self.points[0].u) / self.length
        for inner, point in enumerate(self.points[:-1]):
            keys = solution_keys(builder.structure, phase)
            rows = [row._replace(key=row.key.at(inner)) for row in dynamics_rows(builder, phase, keys)]
            self.conditions += zip(rows, ca.vertsplit(motion_residual(builder, phase, point)), strict=True)
            path = path_conditions(builder, phase, point) + peak_conditions(builder, self.local, phase, point, rate)
            self.conditions += [(row._replace(key=row.key.at(inner)), value) for row, value in path]
        self._add_constraints()
        self._add_lift_off()
        cost = IntervalCost(builder, self.local, phase, self.points, self.length)
        self.conditions += cost.conditions()
        plain, relative = cost.integrals()
        rows = [row for row, _ in self.conditions]
        index = builder.rows.add((Group.INTERVAL, phase.number), rows, [phase.place(k) for k in range(phase.count)])
        self._release_first_node(rows, index)
        values = ca.vertcat(*[value for _, value in self.conditions])
        if builder.structure.objective.per_weight_and_travel:
            values = ca.vertcat(values, relative)
            index = np.vstack([index, np.full(phase.count, builder.integral_row())])
        return self.local.block(f"interval_{phase.number}", values, index, plain)

    def _node(self, suffix: str, nodes: Index) -> PlanarPoint:
        builder, phase = self.builder, self.phase
        columns = {
            "q": builder.coordinates(phase),
            "v": builder.velocities(phase),
            "u": builder.torques(phase),
            "z": builder.variables[Unknown.ACCELERATION, phase.number],
        }
        symbols = {name: self.local.add(name + suffix, index[:, nodes]) for name, index in columns.items()}
        return PlanarPoint(**symbols, p=self.p)

    def _advance(self, start: PlanarPoint, end: PlanarPoint, inner: ca.SX) -> list[PlanarPoint]:
        """Return the inner points, and add the rows of the end point."""
        builder, phase, count, h = self.builder, self.phase, self.builder.structure.scheme.points, self.length
        n = builder.robot.n_q
        unknowns = ca.horzsplit(ca.reshape(inner, start.z.numel(), count - 2))
        accelerations = ca.horzcat(start.acceleration, *[z[:n] for z in unknowns], end.acceleration)
        once, twice = integrals(count)
        fractions = lobatto_points(count)

        def at(i: int) -> tuple[ca.SX, ca.SX]:
            velocity = start.v + h * (accelerations @ ca.DM(once[i]))
            return start.q + h * (float(fractions[i]) * start.v + h * (accelerations @ ca.DM(twice[i]))), velocity

        q, v = at(count - 1)
        names = constraint_names(builder.robot, phase)
        if names:
            projection = self.local.add("projection", builder.variables[Unknown.PROJECTION, phase.number])
            rows = phase.system.constraints(end.q, end.v, self.p)[1]
            q, v = q + rows.T @ projection[: len(names)], v + rows.T @ projection[len(names) :]
        for gap, kind in ((end.q - q, Kind.ANGLE), (end.v - v, Kind.RATE)):
            keys = [Key(Kind.DYNAMICS, kind.text.format(of=name)) for name in builder.robot.coordinates]
            self.conditions += [(Row(key, 0.0, 0.0), value) for key, value in zip(keys, ca.vertsplit(gap), strict=True)]
        places = range(1, count - 1)
        torques = [start.u + float(fractions[i]) * (end.u - start.u) for i in places]
        return [start.move(*at(i), u, z) for i, u, z in zip(places, torques, unknowns, strict=True)]

    def _add_constraints(self) -> None:
        """Add the positions and rates of the contacts at the end of an interval."""
        system, start, end = self.phase.system, self.points[0], self.points[-1]
        before, _ = system.constraints(start.q, start.v, self.p)
        positions, rows = system.constraints(end.q, end.v, self.p)
        closed = len(system.closed)
        values = ca.vertcat(positions[:closed], positions[closed:] - before[closed:])
        for kind, column in ((Kind.CONTACT_POSITION, values), (Kind.CONTACT_RATE, rows @ end.v)):
            names = constraint_names(self.builder.robot, self.phase)
            self.conditions += [(equation(kind, name), column[i]) for i, name in enumerate(names)]

    def _add_lift_off(self) -> None:
        """Add the friction cones of bodies that lift off: their forces vanish, and the slopes are in the cone.

        The slopes are those of the polynomials through the forces of an interval, at its end.
        """
        builder, phase, robot = self.builder, self.phase, self.builder.robot
        if builder.structure.infinite or not opening_bodies(phase):
            return
        static = self.p[robot.index("friction")] * self.p[robot.index("static_friction_ratio")]
        slopes = end_slopes(builder.structure.scheme.points)
        forces = [point_outputs(phase, point)[1] for point in self.points]
        slope = sum((float(weight) * force for weight, force in zip(slopes, forces, strict=True)), ca.SX(0))
        for members in phase.system.sticking:
            if members[0] in opening_bodies(phase):
                name, tangential = robot.contact_names[members[0]], slope[0, members[0]]
                limit = -(1 - builder.margin("cone")) * static * ca.sum2(slope[1, list(members)])
                for kind, value in (
                    (Kind.LIFT_OFF_FORWARD, limit - tangential),
                    (Kind.LIFT_OFF_BACKWARD, limit + tangential),
                ):
                    self.conditions.append((Row(Key(kind, name), 0.0, np.inf), value))

    def _release_first_node(self, rows: list[Row], index: Index) -> None:
        """Remove the bounds of rows that follow at the first node from the event before, and of lift-off elsewhere."""
        for i, row in enumerate(rows):
            if row.key.kind in (Kind.LIFT_OFF_FORWARD, Kind.LIFT_OFF_BACKWARD):
                for place in index[i, :-1]:
                    self.builder.rows.bound(int(place), -np.inf, np.inf)
            if row.key.inner == 0 and row.key.kind in (Kind.GAP, Kind.HEIGHT, Kind.SLIP_SPEED_OF):
                self.builder.rows.bound(int(index[i, 0]), -np.inf, np.inf)
