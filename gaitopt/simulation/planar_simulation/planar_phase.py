"""Numerical equations of a planar robot in one contact state: flow, guards, forces and constraints."""

import numpy as np
from scipy.linalg.lapack import dgesv

from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.fast_call import FastCall
from gaitopt.model.planar.phase_system import Footing, PhaseSystem, make_phase_system
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.simulation.dormand_prince import DormandPrince, Rate
from gaitopt.simulation.planar_simulation.phase_torque import PhaseTorque, TorqueSlope

RELATIVE, ABSOLUTE = 1e-13, 1e-15
"""Tolerances of the integration."""

LARGEST_CONDITION = 1e12
"""Condition number of the equations of motion above which constraints count as dependent."""

PROJECTIONS = 4
"""Largest number of Newton iterations with which positions return to their constraints."""


class PlanarPhase:
    """A planar robot under a torque, in one contact state.

    Parameters
    ----------
    robot : PlanarRobot
    state : ContactState
    p : (n_p,) array
        Parameters and switches.
    torque : PhaseTorque
    footing : Footing, optional
        The terrain under the contacts; by default a plane.
    """

    def __init__(
        self,
        robot: PlanarRobot,
        state: ContactState,
        p: Array,
        torque: PhaseTorque,
        footing: Footing | None = None,
    ) -> None:
        infinite = bool(np.isinf(p[robot.index("friction")]))
        self.robot, self.state, self.p = robot, state, p
        self.equations: PhaseSystem = make_phase_system(robot, state, infinite, footing)
        self.n_q, self.n_z = robot.n_q, self.equations.system.size1_out(0)
        self.n_works = robot.n_u + len(robot.contacts) + 1
        self.source, self._torque = torque, torque.value
        self._share_memory()
        self._constraints = FastCall(self.equations.constraints, p)
        self._mass = FastCall(robot.dynamics, p)
        self._samples = [FastCall(function, p) for function in (robot.energy, robot.force_powers, robot.figure)]

    def _share_memory(self) -> None:
        """Let the equations read (q, v, u, z) from one array: their evaluation takes less time than copies of it."""
        n, n_u, equations = 2 * self.n_q, self.robot.n_u, self.equations
        inputs = np.zeros(n + n_u + self.n_z)
        self._state, self._held_torque, self._unknowns = inputs[:n], inputs[n : n + n_u], inputs[n + n_u :]
        self._system = FastCall(equations.system, self.p, shared=inputs[: n + n_u])
        self._outputs, self._system_slope, self._guard_slope = (
            FastCall(function, self.p, shared=inputs)
            for function in (equations.outputs, equations.system_slope, equations.guard_slope)
        )
        matrix, self._right = self._system.evaluate_separately()
        self._matrix = matrix.reshape(self.n_z, self.n_z).T

    def torque(self, t: float, y: Array) -> Array:
        """Return the torque, shape (n_u,)."""
        return self._torque(t, y[: self.n_q], y[self.n_q : 2 * self.n_q])

    def solve(self, t: float, y: Array) -> tuple[Array, Array]:
        """Return the torque u (n_u,) and the unknowns z (n_z,): accelerations and forces."""
        u = self._form_system(t, y)
        z = solve_linear(self._matrix, self._right)
        self._unknowns[:] = z
        return u, z

    def _form_system(self, t: float, y: Array) -> Array:
        """Store (q, v, u) and the linear system of the unknowns, and return the torque u (n_u,)."""
        u = self.torque(t, y)
        self._state[:] = y[: 2 * self.n_q]
        self._held_torque[:] = u
        self._system.evaluate()
        return u

    def is_regular(self, t: float, y: Array) -> bool:
        """Return whether the constraints are independent, so that accelerations and all forces are determined."""
        self._form_system(t, y)
        return bool(np.linalg.cond(self._matrix.T) < LARGEST_CONDITION)

    def rates(self, t: float, y: Array) -> Array:
        """Return the rates of y = (q, v, works), shape (2 n_q + n_works,)."""
        n = self.n_q
        _, z = self.solve(t, y)
        powers = self._outputs.evaluate_separately()[1]
        return np.concatenate([y[n : 2 * n], z[:n], powers])

    def guards(self, t: float, y: Array) -> Array:
        """Return the guards, shape (n_g,)."""
        self.solve(t, y)
        return self._outputs.evaluate_separately()[0].copy()

    def forces(self, t: float, y: Array) -> Array:
        """Return the force (f_t, f_n) of each contact, shape (n_c, 2) [N].

        The contacts of one sticking body share the tangential force in proportion to their normal forces.
        """
        self.solve(t, y)
        forces = self._outputs.evaluate_separately()[2].reshape(-1, 2).copy()
        for members in self.equations.sticking:
            normal, tangential = forces[list(members), 1], forces[members[0], 0]
            total = normal.sum()
            if len(members) > 1 and total > 0:
                forces[list(members), 0] = tangential * normal / total
        return forces

    def integrate(self, begin: float, y: Array, end: float) -> Array:
        """Return (q, v) or (q, v, works) at a later time of the same phase, without event detection."""
        if end <= begin:
            return y.copy()
        size = y.size
        integrator = make_integrator(lambda t, y: self.rates(t, y)[:size], begin, y, end)
        while integrator.status == "running":
            integrator.step()
        return integrator.y if integrator.status == "finished" else np.full(size, np.nan)

    def slope(self, t: float, y: Array) -> tuple[Array, Array]:
        """Return the derivatives of (v, a) with respect to (q, v, latched) and time, (2 n_q, 2 n_q + n_l), (2 n_q,)."""
        _, by_state, by_time = self.linearise(t, y)
        return by_state, by_time

    def linearise(self, t: float, y: Array) -> tuple[Array, Array, Array]:
        """Return (v, a), shape (2 n_q,), and its derivatives with respect to (q, v, latched) and time, as `slope`."""
        n = self.n_q
        by_state, by_time, _ = self._derivatives(t, y)
        slope, rates = np.zeros((2 * n, by_state.shape[1])), np.zeros(2 * n)
        slope[np.arange(n), np.arange(n, 2 * n)] = 1.0
        slope[n:], rates[n:] = by_state[:n], by_time[:n]
        return np.concatenate([y[n : 2 * n], self._unknowns[:n]]), slope, rates

    def torque_effect(self, t: float, y: Array) -> Array:
        """Return the derivative of (v, a) with respect to the torque, shape (2 n_q, n_u)."""
        n = self.n_q
        self.solve(t, y)
        by_u = self._system_slope.evaluate_separately()[1].reshape(-1, self.n_z).T
        return np.vstack([np.zeros((n, by_u.shape[1])), -solve_linear(self._matrix, by_u)[:n]])

    def guard_slope(self, t: float, y: Array, guard: int) -> tuple[Array, float]:
        """Return the derivatives of a guard with respect to (q, v, latched), shape (2 n_q + n_l,), and time."""
        n_g = len(self.equations.guards)
        by_state, by_time, torque = self._derivatives(t, y)
        slopes = self._guard_slope.evaluate_separately()
        by_y, by_u, by_z = (part.reshape(-1, n_g)[:, guard] for part in slopes)
        direct = np.concatenate([by_y + torque.by_state.T @ by_u, torque.by_latched.T @ by_u])
        return direct + by_state.T @ by_z, float(torque.by_time @ by_u + by_time @ by_z)

    def _derivatives(self, t: float, y: Array) -> tuple[Array, Array, TorqueSlope]:
        """Return the derivatives of z with respect to (q, v, latched) and time, and those of the torque."""
        n = self.n_q
        self.solve(t, y)
        by_y, by_u = (part.reshape(-1, self.n_z).T for part in self._system_slope.evaluate_separately())
        torque = self.source.slope(t, y[:n], y[n : 2 * n])
        right = np.empty((self.n_z, 2 * n + len(torque.by_latched.T) + 1))
        right[:, : 2 * n] = by_y + by_u @ torque.by_state
        right[:, 2 * n : -1] = by_u @ torque.by_latched
        right[:, -1] = by_u @ torque.by_time
        solution = -solve_linear(self._matrix, right)
        return solution[:, :-1], solution[:, -1], torque

    def sample(self, y: Array) -> tuple[tuple[float, float, float], Array]:
        """Return kinetic, potential and elastic energy [J], and the points of figures, shape (2, n_points) [m]."""
        q, v = y[: self.n_q], y[self.n_q : 2 * self.n_q]
        energy, powers, figure = self._samples
        kinetic, potential = (part.item() for part in energy(q, v))
        return (kinetic, potential, powers(q, v)[0].item()), figure(q)[0].reshape(-1, 2).T.copy()

    def constraints(self, y: Array) -> tuple[Array, Array]:
        """Return gaps and slide coordinates of the constraints, shape (m,), and their Jacobian, shape (m, n_q)."""
        n = self.n_q
        positions, rows = self._constraints(y[:n], y[n : 2 * n])
        return positions.copy(), rows.reshape(n, -1).T.copy()

    def anchors(self, y: Array) -> Array:
        """Return the values at which the constraints hold from a state on: gaps 0, slide coordinates as they are."""
        positions, _ = self.constraints(y)
        positions[: len(self.equations.closed)] = 0.0
        return positions

    def drift(self, y: Array, anchors: Array) -> float:
        """Return the largest violation of the constraints on positions and velocities."""
        positions, rows = self.constraints(y)
        speeds = rows @ y[self.n_q : 2 * self.n_q]
        return float(np.max(np.abs([*(positions - anchors), *speeds]), initial=0.0))

    def project(self, y: Array, anchors: Array) -> Array:
        """Return the nearest state, in the metric of the mass matrix, that satisfies the constraints."""
        n, y = self.n_q, y.copy()
        if not anchors.size:
            return y
        for _ in range(PROJECTIONS):
            positions, rows = self.constraints(y)
            if np.max(np.abs(positions - anchors)) < 1e-15:
                break
            y[:n] -= self._correction(y, rows, positions - anchors)
        _, rows = self.constraints(y)
        y[n : 2 * n] -= self._correction(y, rows, rows @ y[n : 2 * n])
        return y

    def _correction(self, y: Array, rows: Array, violation: Array) -> Array:
        n = self.n_q
        mass_matrix = self._mass(y[:n], y[n : 2 * n])[0].reshape(n, n)
        spread = np.linalg.solve(mass_matrix, rows.T)
        correction: Array = spread @ solve_linear(rows @ spread, violation)
        return correction


def make_integrator(rate: Rate, begin: float, y: Array, end: float, relative: float = RELATIVE) -> DormandPrince:
    """Return an integrator of the rates with a relative tolerance, by default that of the simulation."""
    return DormandPrince(rate, begin, y, end, relative=relative, absolute=ABSOLUTE * (relative / RELATIVE))


def solve_linear(matrix: Array, right: Array) -> Array:
    """Return the solution of a linear system; that of least norm if its rows are dependent."""
    if not right.size:
        return np.zeros(right.shape)
    solution, info = dgesv(matrix, right)[2:]  # numpy.linalg.solve takes five times as long for such small systems
    if info == 0:
        return solution.reshape(right.shape)
    return np.asarray(np.linalg.lstsq(matrix, right, rcond=1e-12)[0], dtype=float)
