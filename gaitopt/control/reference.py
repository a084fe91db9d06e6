"""Reference of a feedback law: one step of a motion as piecewise polynomials of the clock."""

from collections.abc import Sequence

import casadi as ca
import numpy as np

from gaitopt.control.law import Law, check_names
from gaitopt.dataclass import dataclass
from gaitopt.model.coordinate_entries import SLIDE
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Motion, Segment
from gaitopt.parameters import Parameter


@dataclass(frozen=True, eq=False)
class Desired:
    """Desired torque and motion at one instant, as expressions.

    Attributes
    ----------
    torque : SX, shape (n_u, 1) [N m]
    angles, rates, accelerations : SX, shape (n_angles, 1)
    foot_speed : SX [m/s]
    """

    torque: ca.SX
    angles: ca.SX
    rates: ca.SX
    accelerations: ca.SX
    foot_speed: ca.SX


@dataclass(frozen=True, eq=False)
class Reference:
    """One step of a motion as polynomials of the clock, a column of coefficients per piece.

    Between samples torques are linear, angles are quintic and foot speeds cubic Hermite polynomials.  After the last
    sample torque and accelerations are constant.

    Attributes
    ----------
    robot : Robot
    breakpoints : (K,) array [s]
    table : (n_r, K) array
        Start of the piece, torque, slope of the torque, six coefficients per angle, four of the foot speed.
    duration : float [s]
    """

    robot: Robot
    breakpoints: Array
    table: Array
    duration: float

    @property
    def size(self) -> int:
        """Number of rows of the table."""
        return int(self.table.shape[0])

    def law(self, name: str, control: ca.Function, numbers: Array, gains: Sequence[str] = ()) -> Law:
        """Return a law about this reference, with constant numbers appended to every column of the table.

        Parameters
        ----------
        name : str
        control : Function
            The `control` of a :class:`gaitopt.Law`; its data are those of the reference, followed by the numbers.
        numbers : (n,) array
        gains : sequence of str
            Names of the first numbers if these are gains.

        Raises
        ------
        InputError
            If a gain is not finite.
        """
        for gain, value in zip(gains, numbers, strict=False):
            Parameter(gain, 0.0, "1", "").check(value)
        table = np.vstack([self.table, np.tile(numbers[:, None], self.breakpoints.size)])
        return Law(name, control, self.breakpoints, table, {gain: self.size + i for i, gain in enumerate(gains)})

    def evaluate(self, clock: ca.SX, data: ca.SX) -> Desired:
        """Return the desired torque and motion at a clock time from a column of the table."""
        n_u, n_a = self.robot.n_u, len(self.robot.angles)
        since = clock - data[0]
        rows = [1, n_u, n_u, *[6] * n_a, 4]
        _, value, slope, *angles, foot = ca.vertsplit(data[: self.size], np.cumsum([0, *rows]).tolist())
        curves = [polynomial(coefficients, since) for coefficients in angles]
        positions, rates, accelerations = (ca.vertcat(*column) for column in zip(*curves, strict=True))
        return Desired(value + slope * since, positions, rates, accelerations, polynomial(foot, since)[0])


def reference(robot: Robot, motion: Motion) -> Reference:
    """Return the first step of a motion as a reference.

    Raises
    ------
    InputError
        If the motion has other actuators or angles than the robot.
    """
    check_names(robot, motion)
    first = [segment for segment in motion.segments if segment.step == motion.segments[0].step]
    start_time, p = first[0].time[0], robot.vector(motion.parameters)
    parts = [_columns(robot, segment, start_time, p) for segment in first]
    table = np.hstack([*parts, _final_column(robot, first[-1], start_time, p)])
    end = float(first[-1].time[-1] - start_time)
    return Reference(robot, table[0].copy(), table, end)


def _columns(robot: Robot, segment: Segment, start_time: float, p: Array) -> Array:
    """Return a column for each interval between two samples of a segment."""
    count = segment.time.size
    a, _ = robot.acceleration[segment.mode].map(count)(
        segment.q, segment.v, segment.torque, np.tile(p[:, None], (1, count))
    )
    a, steps = np.asarray(a), np.diff(segment.time)
    torque = segment.torque
    rows = [(segment.time[:-1] - start_time)[None], torque[:, :-1], np.diff(torque, axis=1) / steps]
    for i in robot.state_entries.angles:
        rows.append(quintic(segment.q[i], segment.v[i], a[i], steps))
    rows.append(_cubic(segment.v[SLIDE], a[SLIDE], steps))
    return np.vstack(rows)[:, steps > 0]


def _final_column(robot: Robot, segment: Segment, start_time: float, p: Array) -> Array:
    """Return the column for times after the last sample."""
    end = segment.q[:, -1], segment.v[:, -1], segment.torque[:, -1]
    a = np.asarray(robot.acceleration[segment.mode](*end, p)[0]).ravel()
    rows = [[segment.time[-1] - start_time], segment.torque[:, -1], np.zeros(robot.n_u)]
    rows += [[segment.q[i, -1], segment.v[i, -1], a[i] / 2, 0, 0, 0] for i in robot.state_entries.angles]
    return np.concatenate([*rows, [segment.v[SLIDE, -1], a[SLIDE], 0, 0]])[:, None]


def quintic(x: Array, rate: Array, second: Array, h: Array) -> Array:
    """Return the quintics that match x, its rate and its second derivative at both ends of steps h, shape (6, K)."""
    gap = (x[1:] - x[:-1] - rate[:-1] * h - second[:-1] * h**2 / 2) / h**3
    turn = (rate[1:] - rate[:-1] - second[:-1] * h) / h**2
    bend = (second[1:] - second[:-1]) / h
    third = 10 * gap - 4 * turn + bend / 2
    fourth = (-15 * gap + 7 * turn - bend) / h
    fifth = (6 * gap - 3 * turn + bend / 2) / h**2
    return np.array([x[:-1], rate[:-1], second[:-1] / 2, third, fourth, fifth])


def _cubic(rate: Array, second: Array, h: Array) -> Array:
    """Return the cubics that match a rate and its derivative at both ends of steps h, shape (4, K)."""
    gap, turn = (rate[1:] - rate[:-1] - second[:-1] * h) / h**2, (second[1:] - second[:-1]) / h
    return np.array([rate[:-1], second[:-1], 3 * gap - turn, (turn - 2 * gap) / h])


def polynomial(coefficients: ca.SX, x: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """Return a polynomial and its first two derivatives, by Horner's rule."""
    value, first, second = ca.SX(0), ca.SX(0), ca.SX(0)
    for k in reversed(range(coefficients.numel())):
        second = second * x + 2 * first
        first = first * x + value
        value = value * x + coefficients[k]
    return value, first, second
