"""Reference of a planar gait's feedback: the planned motion as piecewise polynomials of the clock."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from gaitopt.control.planar_laws.planar_law import PlannedImpulses
from gaitopt.control.reference import polynomial, quintic
from gaitopt.dataclass import dataclass
from gaitopt.model.planar.phase_system import make_phase_system
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.actuator_impulses import EventImpulses
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.planar_motion import PlanarEvent, PlanarSegment
from gaitopt.motion.stated_changes import find_closing

IDLE = 1e-6
"""Torque [N m] or force [N] below which an actuator counts as idle."""


@dataclass(frozen=True, eq=False)
class PlanarReference:
    """A part of a planned period between two impacts, as polynomials of the clock.

    Torques are linear and coordinates quintic between nodes.  Torques and accelerations are constant after the last
    node; before the first one, the first polynomials are continued.

    Attributes
    ----------
    robot : PlanarRobot
    table : (n_r, K) array
        Column of each piece: its start, torque, slope of the torque, six coefficients per coordinate.
    """

    robot: PlanarRobot
    table: Array

    @property
    def breakpoints(self) -> Array:
        """Start of each piece [s], shape (K,)."""
        return self.table[0]

    @property
    def size(self) -> int:
        """Number of rows of the table."""
        return int(self.table.shape[0])

    def torque(self, clock: ca.SX, data: ca.SX) -> ca.SX:
        """Return the planned torque, shape (n_u, 1)."""
        n_u = self.robot.n_u
        return data[1 : 1 + n_u] + (clock - data[0]) * data[1 + n_u : 1 + 2 * n_u]

    def state(self, clock: ca.SX, data: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return the planned coordinates and rates, shape (n_q, 1) each."""
        first = 1 + 2 * self.robot.n_u
        curves = [polynomial(data[first + 6 * i : first + 6 * i + 6], clock - data[0]) for i in range(self.robot.n_q)]
        return ca.vertcat(*[curve[0] for curve in curves]), ca.vertcat(*[curve[1] for curve in curves])


def planar_references(gait: PlanarGait) -> tuple[PlanarReference, ...]:
    """Return the reference of each part of a gait's period between two impacts."""
    robot, motion = gait.robot, gait.motion
    p, counts = robot.vector(motion.parameters), gait.problem.get("intervals", ())
    counts = counts if len(counts) == len(motion.segments) else [0] * len(motion.segments)
    parts: list[list[Array]] = [[]]
    for segment, event, count in zip(motion.segments, motion.events, counts, strict=True):
        parts[-1].append(_columns(robot, segment, p, count))
        if event.is_impact or segment is motion.segments[-1]:
            parts[-1].append(_final_column(robot, segment, p))
            parts.append([])
    return tuple(PlanarReference(robot, np.hstack(part)) for part in parts if part)


def used_actuators(gait: PlanarGait) -> tuple[str, ...]:
    """Return the actuators with a planned torque; others may not act at all, such as the ankle of a free foot."""
    largest = np.max(np.abs(gait.motion.channel("torque")), axis=1)
    return tuple(name for name, size in zip(gait.robot.actuators, largest, strict=True) if size > IDLE)


def plan_impulses(gait: PlanarGait) -> tuple[PlannedImpulses | None, ...]:
    """Return the impulses of the actuators at each impact of a gait; empty if it has none.

    Examples
    --------
    >>> plan_impulses.__name__
    'plan_impulses'
    """
    planned = [plan_event_impulses(event) for event in gait.motion.events if event.is_impact]
    return tuple(planned) if any(planned) else ()


def plan_event_impulses(event: PlanarEvent) -> PlannedImpulses | None:
    """Return the impulses of the actuators at an event; None if it has none."""
    values = EventImpulses.of(event.actuator_impulses)
    if values is None:
        return None
    return PlannedImpulses(find_closing(event.names)[0], values)


def _columns(robot: PlanarRobot, segment: PlanarSegment, p: Array, count: int) -> Array:
    """Return a column for each interval between two nodes of a segment."""
    last = segment.time.size - 1
    step = last // count if count and last % count == 0 else 1
    time, q, v, u = (part[..., ::step] for part in (segment.time, segment.q, segment.v, segment.torque))
    a, steps = _accelerations(robot, segment, (q, v, u), p), np.diff(time)
    rows = [time[None, :-1], u[:, :-1], np.diff(u, axis=1) / steps]
    rows += [quintic(q[i], v[i], a[i], steps) for i in range(robot.n_q)]
    return np.vstack(rows)


def _final_column(robot: PlanarRobot, segment: PlanarSegment, p: Array) -> Array:
    """Return the column for times after the last node."""
    q, v, u = (part[:, -1:] for part in (segment.q, segment.v, segment.torque))
    a = _accelerations(robot, segment, (q, v, u), p)
    parts = [segment.time[-1:], u[:, 0], np.zeros(robot.n_u)]
    parts += [np.array([q[i, 0], v[i, 0], a[i, 0] / 2, 0, 0, 0]) for i in range(robot.n_q)]
    return np.concatenate(parts)[:, None]


def _accelerations(robot: PlanarRobot, segment: PlanarSegment, samples: Sequence[Array], p: Array) -> Array:
    """Return the accelerations at some samples (q, v, torque) of a segment, shape (n_q, K)."""
    infinite = bool(np.isinf(p[robot.index("friction")]))
    system = make_phase_system(robot, segment.state, infinite).system
    columns = []
    for sample in zip(*(part.T for part in samples), strict=True):
        matrix, right = (np.array(part) for part in system(*sample, p))
        columns.append(np.linalg.solve(matrix, right)[: robot.n_q, 0])
    return np.array(columns).T
