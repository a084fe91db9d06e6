"""Accelerations, contact forces and impulses of a planar robot in given contact modes, for the second replay."""

import itertools

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.motion.motion import Array
from gaitopt.study.audit.dense_call import DenseCall

Solution = tuple[Array, Array, dict[str, float]]
"""Rates or accelerations (n_q,), normal forces or impulses (n_c,), and tangential ones by body."""


@dataclass(frozen=True)
class Contacts:
    """Closed contacts by place, and the slip direction of each body on the ground, 0 while it sticks."""

    closed: tuple[int, ...]
    slides: tuple[tuple[str, int], ...]

    def slide(self, body: str) -> int:
        """Return the slip direction of a body."""
        return dict(self.slides)[body]


class ContactSolver:
    """Accelerations, contact forces and impulses of a robot in given contact modes.

    Parameters
    ----------
    robot : PlanarRobot
    p : (n_p,) array
    friction : (float, float)
        Coefficients of static and of kinetic friction.
    """

    def __init__(self, robot: PlanarRobot, p: Array, friction: tuple[float, float]) -> None:
        self.robot, self.n, self.p = robot, robot.n_q, p
        self.static, self.sliding = friction
        self.bodies = tuple(entry.body or entry.name for entry in robot.contacts)
        self.dynamics, self.rows = DenseCall(robot.dynamics, p), DenseCall(robot.rows, p)
        self.gaps = DenseCall(robot.gaps, p)
        self.weight = float(robot.mass(p)) * float(p[robot.index("gravity")])

    def solve(self, contacts: Contacts, matrices: tuple[Array, ...], right: Array) -> Solution:
        """Return rates (n_q,), normal forces (n_c,) and tangential forces by body for a right side.

        The equations are M a - W_n^T f_n - W_t^T f_t = right, W_n a = b_n, and W_t a = b_t or f_t = -sign mu f_n.
        """
        mass, normal, tangent, normal_bias, tangent_bias = matrices
        bodies, closed, n = [body for body, _ in contacts.slides], contacts.closed, self.n
        k, size = len(closed), n + len(closed) + len(bodies)
        system, whole = np.zeros((size, size)), np.zeros(size)
        system[:n, :n], whole[:n] = mass, right
        for i, place in enumerate(closed):
            system[:n, n + i], system[n + i, :n] = -normal[place], normal[place]
            whole[n + i] = -normal_bias[place]
        for j, (body, slide) in enumerate(contacts.slides):
            row, places = n + k + j, [place for place in closed if self.bodies[place] == body]
            system[:n, row] = -tangent[places[0]]
            if slide:
                system[row, row] = 1.0
                system[row, [n + closed.index(place) for place in places]] = slide * self.sliding
            else:
                system[row, :n], whole[row] = tangent[places[0]], -tangent_bias[places[0]]
        solution = np.linalg.solve(system, whole)
        forces = np.zeros(len(self.bodies))
        forces[list(closed)] = solution[n : n + k]
        return np.asarray(solution[:n]), forces, dict(zip(bodies, solution[n + k :].tolist(), strict=True))

    def accelerate(self, contacts: Contacts, state: Array, torque: Array) -> Solution:
        """Return accelerations and forces in a state."""
        q, v = state[: self.n], state[self.n :]
        mass, bias, actuation = self.dynamics(q, v)
        force = actuation.reshape(self.n, torque.size) @ torque  # with one actuator, the matrix is a vector
        return self.solve(contacts, (mass, *self.rows(q, v)), force - bias)

    def collide(self, contacts: Contacts, state: Array, impulse: Array) -> Solution:
        """Return the rates after an impact or impulses of actuators (n_u,), and the impulses of the contacts."""
        q, v = state[: self.n], state[self.n :]
        mass, _, actuation = self.dynamics(q, v)
        normal, tangent = self.rows(q, v)[:2]
        push = actuation.reshape(self.n, impulse.size) @ impulse
        nothing = np.zeros(len(self.bodies))
        return self.solve(contacts, (mass, normal, tangent, nothing, nothing), mass @ v + push)

    def slip_speed(self, body: str, closed: tuple[int, ...], state: Array) -> float:
        """Return the slip speed of a body on the ground [m/s]."""
        place = next(place for place in closed if self.bodies[place] == body)
        return float(self.rows(state[: self.n], state[self.n :])[1][place] @ state[self.n :])

    def list_modes(self, places: tuple[int, ...]) -> list[Contacts]:
        """Return all modes of some contacts, the ones with most closed contacts first."""
        every, slips = [], (0, 1, -1) if np.isfinite(self.sliding) else (0,)
        for count in range(len(places), -1, -1):
            for closed in itertools.combinations(places, count):
                bodies = sorted({self.bodies[place] for place in closed})
                for slides in itertools.product(slips, repeat=len(bodies)):
                    every.append(Contacts(closed, tuple(zip(bodies, slides, strict=True))))
        return every
