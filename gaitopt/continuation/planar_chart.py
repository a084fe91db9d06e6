"""Independent coordinates of the section of a planar robot: some entries of the state, and the slip speeds.

Right after the section's event, the gaps of the touching contacts and the normal velocities of the closed contacts are
zero.  A sticking contact has no slip speed either, but may slip in another gait of the same family, so that slip speeds
are coordinates unless the friction is infinite.
"""

from collections.abc import Sequence

import numpy as np

from gaitopt.model.fast_call import FastCall
from gaitopt.model.planar.impact_system import contact_slopes
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.stability.planar_gaits.planar_section import SectionRows

RANK = 1e-6
"""Relative size of a new direction above which an entry of the state is independent of those chosen before."""
CORRECTIONS, ACCURACY = 12, 1e-14
"""Largest number of Newton iterations to a state with given coordinates, and their accuracy."""


class PlanarChart:
    """Independent coordinates of a section.

    Parameters
    ----------
    robot : PlanarRobot
    rows : SectionRows
        Contacts whose gap and normal velocity are zero.
    y : (2 n_q,) array
        A state on the section.
    p : (n_p,) array
        Parameters and switches.
    slips : bool
        Whether slip speeds are coordinates; otherwise they are zero.

    Attributes
    ----------
    entries : tuple of int
        Entries of the state (q, v) that are coordinates.
    speeds : tuple of int
        Contacts whose slip speeds are the last coordinates, one of each body.
    names : tuple of str
    """

    def __init__(self, robot: PlanarRobot, rows: SectionRows, y: Array, p: Array, *, slips: bool) -> None:
        self.robot, self.rows, self._reference = robot, rows, np.array(y)
        self._travel = None if robot.travel is None else robot.coordinates.index(robot.travel)
        bodies = {robot.contacts[i].body: i for i in reversed(rows.normal) if robot.contacts[i].slides}
        self._sliding = tuple(sorted(bodies.values()))
        self.speeds = self._sliding if slips else ()
        self.entries = self._choose_entries(ChartAt(self, p).constraint_rows(self._reference))
        speeds = [f"{robot.contact_names[i]} slip speed" for i in self.speeds]
        self.names = (*(robot.state_names[i] for i in self.entries), *speeds)

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.names)

    @property
    def units(self) -> tuple[str, ...]:
        """Unit of each coordinate."""
        units = (*self.robot.units, *(f"{unit}/s" for unit in self.robot.units))
        return (*(units[i] for i in self.entries), *("m/s" for _ in self.speeds))

    def at(self, p: Array) -> "ChartAt":
        """Return the chart at some parameters."""
        return ChartAt(self, p)

    @property
    def reference(self) -> Array:
        """State from which Newton's method starts, shape (2 n_q,)."""
        return self._reference

    @property
    def travel(self) -> int | None:
        """Entry of the travel, which is zero on the section."""
        return self._travel

    @property
    def sliding(self) -> Sequence[int]:
        """Contacts whose slip speeds are given, one of each closed body."""
        return self._sliding

    def _choose_entries(self, rows: Array) -> tuple[int, ...]:
        """Return entries of the state that determine it together with the constraints: angles first."""
        units, n = self.robot.units, self.robot.n_q
        order = sorted(range(n), key=lambda i: units[i] != "rad")
        chosen, basis = list[int](), _orthonormalise(rows)
        for i in [*order, *(n + i for i in order)]:
            direction = np.eye(2 * n)[i]
            rest = direction - basis.T @ (basis @ direction)
            if float(np.linalg.norm(rest)) > RANK:
                chosen.append(i)
                basis = np.vstack([basis, rest / np.linalg.norm(rest)])
        return tuple(sorted(chosen))


class ChartAt:
    """A chart at some parameters: states of coordinates, and their derivatives.

    Parameters
    ----------
    chart : PlanarChart
    p : (n_p,) array
    """

    def __init__(self, chart: PlanarChart, p: Array) -> None:
        self.chart, self._p = chart, p
        robot = chart.robot
        self._gaps, self._rows = FastCall(robot.gaps, p), FastCall(robot.rows, p)
        self._slopes = FastCall(contact_slopes(robot), p)

    def constraint_rows(self, y: Array) -> Array:
        """Return the derivatives of the constrained quantities with respect to the state (q, v), shape (m, 2 n_q)."""
        rows, chart = self.chart.rows, self.chart
        gaps, normal, tangential = self._slope_rows(y)
        travel = [] if chart.travel is None else [np.eye(1, y.size, chart.travel)]
        return np.vstack([gaps[list(rows.gaps)], normal[list(rows.normal)], tangential[list(chart.sliding)], *travel])

    def embed(self, z: Array) -> Array | None:
        """Return the state (q, v) of coordinates, shape (2 n_q,), or None if none exists near the reference."""
        y = self.chart.reference.copy()
        for _ in range(CORRECTIONS):
            residual = self._residual(y, z)
            if float(np.max(np.abs(residual))) < ACCURACY:
                return y
            step = np.linalg.lstsq(self._matrix(y), residual, rcond=1e-12)[0]
            y = y - step
            if float(np.max(np.abs(step))) < ACCURACY * (1 + float(np.max(np.abs(y)))):
                return y
        return None

    def read(self, y: Array) -> Array:
        """Return the coordinates of a state (q, v), shape (n_z,)."""
        return np.concatenate([y[list(self.chart.entries)], self._speeds(y)[list(self.chart.speeds)]])

    def embedding(self, y: Array) -> Array:
        """Return the derivative of the state with respect to the coordinates, shape (2 n_q, n_z)."""
        matrix, chart = self._matrix(y), self.chart
        right = np.zeros((matrix.shape[0], chart.size))
        first, n_e = matrix.shape[0] - len(chart.entries), len(chart.entries)
        right[first:, :n_e] = np.eye(n_e)
        slides = first - (chart.travel is not None) - len(chart.sliding)
        for k in range(len(chart.speeds)):
            right[slides + k, n_e + k] = 1.0
        return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-12)[0])

    def reading(self, y: Array) -> Array:
        """Return the derivative of the coordinates with respect to the state, shape (n_z, 2 n_q)."""
        selection = np.eye(y.size)[list(self.chart.entries)]
        return np.vstack([selection, self._slope_rows(y)[2][list(self.chart.speeds)]])

    def _residual(self, y: Array, z: Array) -> Array:
        chart, n = self.chart, self.chart.robot.n_q
        normal = self._rows(y[:n], y[n:])[0].reshape(n, -1).T @ y[n:]
        n_e = len(chart.entries)
        speeds = self._speeds(y)[list(chart.sliding)]
        if chart.speeds:
            speeds = speeds - z[n_e:]
        travel = [] if chart.travel is None else [y[chart.travel]]
        gaps = self._gaps(y[:n])[0][list(chart.rows.gaps)]
        return np.concatenate([gaps, normal[list(chart.rows.normal)], speeds, travel, y[list(chart.entries)] - z[:n_e]])

    def _speeds(self, y: Array) -> Array:
        """Return the slip speed of each contact, shape (n_c,)."""
        n = self.chart.robot.n_q
        return np.asarray(self._rows(y[:n], y[n:])[1].reshape(n, -1).T @ y[n:])

    def _slope_rows(self, y: Array) -> list[Array]:
        """Return the derivatives of gaps, normal and slip velocities with respect to the state, (n_c, 2 n_q) each."""
        n = self.chart.robot.n_q
        return [part.reshape(2 * n, -1).T for part in self._slopes(y[:n], y[n:])]

    def _matrix(self, y: Array) -> Array:
        """Return the derivatives of constraints and coordinates with respect to the state, shape (m, 2 n_q)."""
        return np.vstack([self.constraint_rows(y), np.eye(y.size)[list(self.chart.entries)]])


def _orthonormalise(rows: Array) -> Array:
    """Return an orthonormal basis of the space of some rows."""
    _, sizes, basis = np.linalg.svd(rows)
    rank = int(np.sum(sizes > 1e-9 * sizes[0])) if sizes.size else 0
    return np.asarray(basis[:rank])
