"""The equations of motion of one contact state, in its reduced coordinates.

The elimination of coordinates by a contact state is defined in this module alone.

State of a sticking phase: (angles, rates).  State of a slip phase, and of one whose mode is open: (angles, rates, foot
slide, foot speed); slide counts from the start of the phase, or of the step if the mode is open.
"""

from collections.abc import Callable

import casadi as ca

from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.transition import Condition, ContactQuantities, NodeCondition
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
        slide, speed = (state[2 * n], state[2 * n + 1]) if self.slides else (ca.SX(0), ca.SX(0))
        zero = ca.SX(1, 1)
        return ca.vertcat(slide, zero, state[:n]), ca.vertcat(speed, zero, state[n : 2 * n])

    def parts(self, state: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return positions and velocities of `moving` in a reduced state, each of shape (n_a, 1)."""
        n = self.n_angles
        foot = (state[2 * n], state[2 * n + 1]) if self.slides else (ca.SX(0, 1), ca.SX(0, 1))
        return ca.vertcat(state[:n], foot[0]), ca.vertcat(state[n : 2 * n], foot[1])

    def join(self, positions: ca.SX, velocities: ca.SX) -> ca.SX:
        """Return the reduced state with positions and velocities of `moving`, the inverse of :meth:`parts`."""
        n = self.n_angles
        foot = (positions[n], velocities[n]) if self.slides else ()
        return ca.vertcat(positions[:n], velocities[:n], *foot)

    def full_acceleration(self, acceleration: ca.SX) -> ca.SX:
        """Return the rates of v for accelerations of `moving`, shape (n_q, 1)."""
        n, zero = self.n_angles, ca.SX(1, 1)
        foot = acceleration[n] if self.slides else zero
        return ca.vertcat(foot, zero, acceleration[:n])

    def flow(self, state: ca.SX, torque: ca.SX, p: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return the state's rate, shape (n_x, 1), and the contact force (f_t, f_n) [N]."""
        q, v = self.full(state)
        acceleration, force = self.robot.acceleration[self.mode](q, v, torque, p)
        rate = ca.vertcat(v[2:], acceleration[2:])
        if self.mode.slips:
            rate = ca.vertcat(rate, v[0], acceleration[0])
        return rate, force

    def balance(self, state: ca.SX, acceleration: ca.SX, torque: ca.SX, p: ca.SX) -> tuple[ca.SX, ca.SX]:
        """Return the residual of the equations of motion per weight, shape (n_a, 1), and the contact force [N].

        By inverse dynamics M a + h - E u is the contact force in its first two rows and must vanish in the others.
        `acceleration` is that of `moving`: the angles, then the foot if it slides.
        """
        q, v = self.full(state)
        mass_matrix, bias, actuation = self.robot.dynamics(q, v, p)
        excess = mass_matrix @ self.full_acceleration(acceleration) + bias - actuation @ torque
        force = excess[:2]
        residual = excess[2:]
        if self.mode.slips:
            friction = -self.mode.sign * self.friction(p) * force[1]
            residual = ca.vertcat(residual, force[0] - friction)
            force = ca.vertcat(friction, force[1])
        return residual / self.weight(p), force

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
        return self.robot.joint_rates(*self.full(state), p)

    def joint_accelerations(self, state: ca.SX, acceleration: ca.SX, p: ca.SX) -> ca.SX:
        """Return the accelerations of the actuated joints, shape (n_u, 1), for accelerations of `moving`."""
        q, v = (ca.SX.sym(name, self.robot.n_q) for name in "qv")
        given = ca.SX.sym("a", self.robot.n_q)
        rates = ca.jtimes(self.robot.joint_rates(q, v, p), ca.vertcat(q, v), ca.vertcat(v, given))
        values = [ca.densify(part) for part in (*self.full(state), self.full_acceleration(acceleration))]
        return ca.substitute([rates], [q, v, given], values)[0]

    def weight(self, p: ca.SX) -> ca.SX:
        """Return total weight m g [N]."""
        return self.robot.weight(p)

    def balance_of(self, state: ca.SX, acceleration: ca.SX, torque: ca.SX, force: ca.SX, p: ca.SX) -> ca.SX:
        """Return the residual of the equations of motion for a contact force, both per weight, shape (n_q, 1)."""
        q, v = self.full(state)
        mass_matrix, bias, actuation = self.robot.dynamics(q, v, p)
        excess = mass_matrix @ self.full_acceleration(acceleration) + bias - actuation @ torque
        return excess / self.weight(p) - ca.vertcat(force, ca.SX.zeros(self.n_angles))

    def slip_speed(self, state: ca.SX) -> ca.SX:
        """Return the absolute speed of the foot [m/s]."""
        return self.mode.sign * state[2 * self.n_angles + 1] if self.mode.slips else ca.SX(0)

    @property
    def contact_state(self) -> ContactState:
        """Mode of each contact."""
        return ContactState.single_support(self.mode)

    @property
    def entries(self) -> tuple[int, ...]:
        """Indices of the coordinates in q that are not eliminated."""
        return (*((0,) if self.slides else ()), *range(2, self.robot.n_q))

    def path(self, force: ca.SX, p: ca.SX, margin: ca.SX) -> tuple[list[Condition], ca.SX]:
        """Return meaning and values of the conditions >= 0 along the phase, forces per weight.

        They contain 1/mu, so that an infinite friction reduces them to f_n >= 0.
        """
        if self.mode is Mode.ANY:
            return [], ca.SX(0, 1)
        tangential, normal = ca.vertsplit(force / self.weight(p))
        if self.mode.slips:
            return [Condition.NORMAL_FORCE], normal
        scaled = tangential / ((1 - margin) * self.robot.static_friction(p))
        return [Condition.FORWARD_CONE, Condition.BACKWARD_CONE], ca.vertcat(normal - scaled, normal + scaled)

    def onset(self, force: ca.SX, p: ca.SX, slip: Mode) -> list[NodeCondition]:
        """Return the conditions of the transition from stick to a slip mode, with the force in N."""
        static, unused = self.robot.static_friction(p), ca.SX.ones(2)
        contact = ContactQuantities(force / self.weight(p), ca.SX(0), static, unused)
        return self.robot.contact_model.onset(slip).conditions(Mode.STICK, contact)

    def friction(self, p: ca.SX) -> ca.SX:
        """Return the coefficient of kinetic friction."""
        return p[self.robot.index("friction")]


def rk4(flow: Callable[[ca.SX, ca.SX], ca.SX], state: ca.SX, torques: tuple[ca.SX, ...], step: ca.SX) -> ca.SX:
    """Return the state after one classical Runge-Kutta step, with torques at its start, middle and end."""
    start, middle, end = torques
    k1 = flow(state, start)
    k2 = flow(state + step / 2 * k1, middle)
    k3 = flow(state + step / 2 * k2, middle)
    k4 = flow(state + step * k3, end)
    return state + step / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
