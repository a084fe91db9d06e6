"""The equations of motion of one contact state, in its reduced coordinates.

The elimination of coordinates by a contact state is defined in this module alone.

State of a sticking phase: (angles, rates).  State of a slip phase, and of one whose mode is open: (angles, rates, foot
slide, foot speed); slide counts from the start of the phase, or of the step if the mode is open.
"""

from collections.abc import Callable

import casadi as ca
import numpy as np

from gaitopt.locks import cached_property
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.transition import Condition, ContactQuantities
from gaitopt.model.coordinate_entries import ANGLES, CONTACT, SLIDE, full_coordinates
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot


class PhaseDynamics:
    """The equations of motion of a walker in single support, its stance contact in one mode.

    Parameters
    ----------
    robot : Robot
    mode : Mode
        Mode of the stance contact; an open mode, ``any``, has the coordinates of a slip.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> PhaseDynamics(compass_biped(), Mode.SLIP_FORWARD).moving
    ('th1', 'th2', 'foot')
    """

    def __init__(self, robot: Robot, mode: Mode) -> None:
        self.robot, self.mode = robot, mode
        self.slides = mode.slips or mode is Mode.ANY
        self.n_angles = len(robot.angles)
        self.state_names = (*robot.angles, *(f"{name} rate" for name in robot.angles))
        self.moving = robot.angles
        if self.slides:
            self.state_names += ("foot slide", "foot speed")
            self.moving += ("foot",)
        self.n_x, self.n_a = len(self.state_names), len(self.moving)

    def full(self, state: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return q and v of a reduced state, each of shape (n_q, 1)."""
        n = self.n_angles
        slide, speed = (state[self.slide_entry], state[self.speed_entry]) if self.slides else (ca.SX(1, 1),) * 2
        return full_vector(slide, state[:n]), full_vector(speed, state[n : 2 * n])

    def full_samples(self, states: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return q and v of numeric reduced states, (n_x, K), each of shape (n_q, K)."""
        n = self.n_angles
        slide, speed = (states[self.slide_entry], states[self.speed_entry]) if self.slides else (0.0, 0.0)
        return full_coordinates(states[:n], slide), full_coordinates(states[n : 2 * n], speed)

    def parts(self, state: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return positions and velocities of `moving` in a reduced state, each of shape (n_a, 1)."""
        n = self.n_angles
        angles, rates = state[:n], state[n : 2 * n]
        if not self.slides:
            return angles, rates
        return ca.vertcat(angles, state[self.slide_entry]), ca.vertcat(rates, state[self.speed_entry])

    def join(self, positions: ca.SX, velocities: ca.SX) -> ca.SX:
        """Return the reduced states, (n_x, K), with positions and velocities of `moving`, (n_a, K), as columns.

        It is the inverse of :meth:`parts`.
        """
        if not self.slides:
            return ca.vertcat(positions, velocities)
        n = self.n_angles
        return ca.vertcat(positions[:n, :], velocities[:n, :], positions[n, :], velocities[n, :])

    def full_acceleration(self, acceleration: ca.SX) -> ca.SX:
        """Return the rates of v for accelerations of `moving`, shape (n_q, 1)."""
        n = self.n_angles
        return full_vector(acceleration[n] if self.slides else ca.SX(1, 1), acceleration[:n])

    def flow(self, state: ca.SX, torque: ca.SX, p: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return the state's rate, shape (n_x, 1), and the contact force (f_t, f_n) [N]."""
        q, v = self.full(state)
        acceleration, force = self.robot.acceleration[self.mode](q, v, torque, p)
        rate = ca.vertcat(v[ANGLES], acceleration[ANGLES])
        if self.mode.slips:
            rate = ca.vertcat(rate, v[SLIDE], acceleration[SLIDE])
        return rate, force

    def balance(self, state: ca.SX, acceleration: ca.SX, torque: ca.SX, p: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return the residual of the equations of motion per weight, shape (n_a, 1), and the contact force [N].

        By inverse dynamics M a + h - E u is the contact force in its first two rows and must vanish in the others.
        `acceleration` is that of `moving`: the angles, then the foot if it slides.
        """
        residual, force = self._balance(state, acceleration, torque, p)
        return residual, force

    @cached_property
    def _balance(self) -> ca.Function:
        """The Function :meth:`balance`, built once for all points of a phase."""
        state, acceleration = ca.SX.sym("state", self.n_x), ca.SX.sym("acceleration", self.n_a)
        torque, (p, weight) = ca.SX.sym("torque", self.robot.n_u), self._weight
        excess = self._inverse_dynamics(state, acceleration, torque, p)
        force, residual = excess[CONTACT], excess[ANGLES]
        if self.mode.slips:
            friction = -self.mode.sign * self.friction(p) * force[1]
            residual = ca.vertcat(residual, force[0] - friction)
            force = ca.vertcat(friction, force[1])
        return ca.Function("balance", [state, acceleration, torque, p], ca.cse([residual / weight, force]))

    def sample_accelerations(self, states: np.ndarray, torques: np.ndarray, p: np.ndarray) -> np.ndarray:
        """Return the accelerations of `moving` in numeric states, (n_a, K); nan if a mass matrix is singular.

        They are solutions of the equations of motion, which are linear in them, so that no Function of the forward
        dynamics is built.
        """
        n, count = self.n_a, states.shape[1]
        columns = np.repeat(np.arange(count), n + 1)
        trials = np.tile(np.hstack([np.zeros((n, 1)), np.eye(n)]), (1, count))
        inputs = states[:, columns], trials, torques[:, columns], np.tile(p[:, None], columns.size)
        balance = FastCall(self._balance.map(columns.size))
        residuals = balance(*(part.ravel(order="F") for part in inputs))[0].reshape(count, n + 1, n)
        at_rest, slopes = residuals[:, 0], (residuals[:, 1:] - residuals[:, :1]).swapaxes(1, 2)
        try:
            return np.asarray(np.linalg.solve(slopes, -at_rest[..., None])[..., 0].T)
        except np.linalg.LinAlgError:
            return np.full((n, count), np.nan)

    def _inverse_dynamics(self, state: ca.SX, acceleration: ca.SX, torque: ca.SX, p: ca.SX) -> ca.SX:
        """Return the generalised forces that `acceleration` requires besides the torques, shape (n_q, 1)."""
        return self.robot.inverse_dynamics(*self.full(state), self.full_acceleration(acceleration), torque, p)

    def flow_and_energy(self, state: ca.SX, torque: ca.SX, p: ca.SX) -> ca.SX:
        """Return the state's rate and the rates of the works, shape (n_x + n_works, 1)."""
        reduced = state[: self.n_x]
        rate, force = self.flow(reduced, torque, p)
        sliding = force if self.mode.slips else ca.SX.zeros(2)
        return ca.vertcat(rate, self.robot.work_rates(*self.full(reduced), torque, sliding, p))

    def interval(
        self,
        state: ca.SX,
        torque: ca.SX,
        torque_after: ca.SX,
        step: ca.SX,
        p: ca.SX,
        *,
        substeps: int,
        energy: bool = False,
    ) -> tuple[ca.SX, ca.SX]:
        """Return the states in the middle and at the end of an interval with linear torque.

        Each half has `substeps` Runge-Kutta steps.  With `energy`, the works of the actuators and the losses are
        appended to the states and integrated with them.
        """

        def flow(x: ca.SX, u: ca.SX) -> ca.SX:
            return self.flow_and_energy(x, u, p) if energy else self.flow(x, u, p)[0]

        count = 2 * substeps
        rise, states = torque_after - torque, [state]
        for i in range(count):
            torques = tuple(torque + rise * ((i + part) / count) for part in (0, 0.5, 1))
            states.append(rk4(flow, states[-1], torques, step / count))
        return states[substeps], states[count]

    def power(self, state: ca.SX, torque: ca.SX, p: ca.SX) -> ca.SX:
        """Return the joint powers, shape (n_u, 1) [W]."""
        return torque * self.joint_rates(state, p)

    def joint_rates(self, state: ca.SX, p: ca.SX) -> ca.SX:
        """Return the rates of the actuated joints, shape (n_u, 1) [rad/s]."""
        rates: ca.SX = self._joint_rates(state, p)
        return rates

    @cached_property
    def _joint_rates(self) -> ca.Function:
        """The Function :meth:`joint_rates`, built once for all points of a phase."""
        state, p = ca.SX.sym("state", self.n_x), ca.SX.sym("p", len(self.robot.parameters))
        return ca.Function("joint_rates", [state, p], [self.robot.joint_rates(*self.full(state), p)])

    def joint_accelerations(self, state: ca.SX, acceleration: ca.SX, p: ca.SX) -> ca.SX:
        """Return the accelerations of the actuated joints, shape (n_u, 1), for accelerations of `moving`."""
        q, v = (ca.SX.sym(name, self.robot.n_q) for name in "qv")
        accelerations = ca.SX.sym("a", self.robot.n_q)
        rates = ca.jtimes(self.robot.joint_rates(q, v, p), ca.vertcat(q, v), ca.vertcat(v, accelerations))
        values = [ca.densify(part) for part in (*self.full(state), self.full_acceleration(acceleration))]
        return ca.substitute([rates], [q, v, accelerations], values)[0]

    @cached_property
    def _weight(self) -> tuple[ca.SX, ca.SX]:
        """Symbols of the parameters, and the total weight as an expression of them."""
        p = ca.SX.sym("p", len(self.robot.parameters))
        return p, self.weight(p)

    def weight(self, p: ca.SX) -> ca.SX:
        """Return total weight m g [N]."""
        return self.robot.weight(p)

    def balance_of(self, state: ca.SX, acceleration: ca.SX, torque: ca.SX, force: ca.SX, p: ca.SX) -> ca.SX:
        """Return the residual of the equations of motion for a contact force, both per weight, shape (n_q, 1)."""
        excess = self._inverse_dynamics(state, acceleration, torque, p)
        return excess / self.weight(p) - ca.vertcat(force, ca.SX.zeros(self.n_angles))

    def slip_speed(self, state: ca.SX) -> ca.SX:
        """Return the absolute speed of the foot [m/s]."""
        return self.mode.sign * state[self.speed_entry] if self.mode.slips else ca.SX(0)

    def sliding_inertia(self, state: ca.SX, p: ca.SX) -> ca.SX:
        """Return the effective mass of the sliding foot relative to that without friction, positive in well-posed slip.

        It is 1 + s mu S_tn / S_tt with the sign s of the slip and the inverse S of the foot's mobility W M^-1 W^T.
        """
        forward, backward = ca.vertsplit(self.robot.wellposed(self.full(state)[0], p))
        return (forward if self.mode.sign > 0 else backward) / ((forward + backward) / 2)

    def excess_at_rest(self, state: ca.SX, torque: ca.SX, p: ca.SX, margin: ca.SX) -> ca.SX:
        """Return by how much the sticking force is outside the static cone in the direction that starts this slip.

        The foot is at rest in `state`.  With the sticking force f and the sign s of the slip, the value is
        - s f_t / mu_s - (1 + margin) f_n per weight.  A well-posed slip starts from rest if and only if it is positive
        without the margin, since the slip acceleration times the effective mass is - s f_t - mu f_n.
        """
        force = self.robot.acceleration[Mode.STICK](*self.full(state), torque, p)[1]
        tangential, normal = ca.vertsplit(force / self.weight(p))
        return -self.mode.sign * tangential / self.robot.static_friction(p) - (1 + margin) * normal

    @property
    def contact_state(self) -> ContactState:
        """Mode of each contact."""
        return ContactState.single_support(self.mode)

    @property
    def entries(self) -> tuple[int, ...]:
        """Indices of the coordinates in q that are not eliminated."""
        return tuple(sorted(self.moving_entries))

    @property
    def moving_entries(self) -> list[int]:
        """Indices of `moving` in q and v, in its order."""
        return [*self.robot.state_entries.angles, *([SLIDE] if self.slides else [])]

    @property
    def slide_entry(self) -> int:
        """Index of the foot slide in the reduced state of a phase that slides."""
        return 2 * self.n_angles

    @property
    def speed_entry(self) -> int:
        """Index of the foot speed in the reduced state of a phase that slides."""
        return 2 * self.n_angles + 1

    def path(self, force: ca.SX, p: ca.SX, margin: ca.SX) -> tuple[list[Condition], ca.SX]:
        """Return meaning and values of the conditions >= 0 along the phase, forces per weight.

        They contain 1/mu, so that an infinite friction reduces them to f_n >= 0.
        """
        if self.mode is Mode.ANY:
            return [], ca.SX(0, 1)
        conditions = [Condition.NORMAL_FORCE] if self.mode.slips else [Condition.FORWARD_CONE, Condition.BACKWARD_CONE]
        return conditions, self._path(force, p, margin)

    @cached_property
    def _path(self) -> ca.Function:
        """The Function of the values of :meth:`path`, built once for all points of a phase."""
        force, margin, (p, weight) = ca.SX.sym("force", 2), ca.SX.sym("margin"), self._weight
        tangential, normal = ca.vertsplit(force / weight)
        scaled = tangential / ((1 - margin) * self.robot.static_friction(p))
        values = normal if self.mode.slips else ca.vertcat(normal - scaled, normal + scaled)
        return ca.Function("path", [force, p, margin], [values])

    def contact(self, state: ca.SX, acceleration: ca.SX, force: ca.SX, p: ca.SX) -> ContactQuantities:
        """Return the arguments of conditions on the stance contact, from the force in N and the rates of `moving`."""
        speed = state[self.speed_entry] if self.slides else ca.SX(0)
        slip_acceleration = acceleration[self.n_angles] if self.slides and acceleration.numel() else ca.SX(0)
        inertia = self.robot.wellposed(self.full(state)[0], p) if self.mode.slips else ca.SX.ones(2)
        return ContactQuantities(
            force / self.weight(p), speed, self.robot.static_friction(p), inertia, slip_acceleration
        )

    def friction(self, p: ca.SX) -> ca.SX:
        """Return the coefficient of kinetic friction."""
        return p[self.robot.index("friction")]


def full_vector(slide: ca.SX, angles: ca.SX) -> ca.SX:
    """Return q for the slide coordinate and the angles of a contact on the ground, or v for their rates, (n_q, 1)."""
    vector = ca.SX(2 + angles.numel(), 1)
    vector[ANGLES] = angles
    if slide.nnz():
        vector[SLIDE] = slide
    return vector


def rk4(flow: Callable[[ca.SX, ca.SX], ca.SX], state: ca.SX, torques: tuple[ca.SX, ...], step: ca.SX) -> ca.SX:
    """Return the state after one classical Runge-Kutta step, with torques at its start, middle and end."""
    start, middle, end = torques
    k1 = flow(state, start)
    k2 = flow(state + step / 2 * k1, middle)
    k3 = flow(state + step / 2 * k2, middle)
    k4 = flow(state + step * k3, end)
    return state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
