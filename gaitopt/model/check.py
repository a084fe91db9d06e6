"""A check every robot must pass: its equations of motion against energy and momentum balances."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.contacts.impact import Impact, solve_impact
from gaitopt.model.contacts.mode import PHYSICAL, Mode
from gaitopt.model.robot import Robot

_STEP = 1e-6


@dataclass(frozen=True)
class RobotCheck:
    """Largest relative errors found in random states; all should be at rounding or finite-difference level.

    Attributes
    ----------
    asymmetry : float
        Of the mass matrix.
    least_eigenvalue : float
        Smallest eigenvalue of the mass matrix over the largest in size; must be positive.
    energy : float
        Rate of total energy along the motion against the power of torques and contact force.
    force : float
        Rate of linear momentum along the motion against gravity and contact force.
    contact : float
        Conditions of the contact modes: equations of motion, foot acceleration and friction law.
    momentum : float
        Change of linear momentum at impact against the impulse, and of angular momentum about the landing foot.
    impact : float
        Complementarity residual of the exact impact solution, and energy gained (must not be).
    derivatives : float
        Jacobians by algorithmic differentiation against central differences.

    Examples
    --------
    >>> from gaitopt import check_robot, rimless_wheel
    >>> check = check_robot(rimless_wheel(), states=3)
    >>> check.passed, check.momentum < 1e-12
    (True, True)
    """

    asymmetry: float
    least_eigenvalue: float
    energy: float
    force: float
    contact: float
    momentum: float
    impact: float
    derivatives: float

    @property
    def passed(self) -> bool:
        """Whether every error is small enough for a correct robot."""
        # np.max keeps a nan, which max can lose.
        exact = np.max([self.asymmetry, self.contact, self.momentum, self.impact])
        differenced = np.max([self.energy, self.force, self.derivatives])
        return bool(self.least_eigenvalue > 0 and exact < 1e-9 and differenced < 1e-6)


def check_robot(
    robot: Robot, parameters: Mapping[str, float] | None = None, *, states: int = 20, seed: int = 0
) -> RobotCheck:
    """Check a robot in random states.

    Parameters
    ----------
    robot : Robot
    parameters : mapping of str to float, optional
        Friction is set to 0.3 unless given.
    states : int
        How many random states.
    seed : int

    Returns
    -------
    RobotCheck

    Raises
    ------
    InputError
        If a parameter cannot be, or the friction is infinite.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> check_robot(compass_biped()).passed
    True
    """
    rng = np.random.default_rng(seed)
    values = robot.resolve({"friction": 0.3, "slope": 0.1, **(parameters or {})})
    if np.isinf(values["friction"]):
        raise InputError("check_robot needs a finite friction, got inf: it checks slipping too.")
    p = robot.vector(values)
    rows = []
    for _ in range(states):
        q = np.concatenate([rng.normal(size=2), rng.uniform(-0.5, 0.5, robot.n_q - 2)])
        v = np.concatenate([[0.0, 0.0], rng.normal(size=robot.n_q - 2)])
        u = rng.normal(size=robot.n_u)
        mass = np.asarray(robot.dynamics(q, v, p)[0])
        eigenvalues = np.linalg.eigvalsh((mass + mass.T) / 2)
        largest = np.max(np.abs(eigenvalues))
        rows.append(
            (
                np.max(np.abs(mass - mass.T)) / largest,
                -eigenvalues[0] / largest,
                *_motion_errors(robot, q, v, u, p),
                *_impact_errors(robot, q, v, p),
                _derivative_error(robot, q, v, u, p),
            )
        )
    worst = np.max(np.array(rows, dtype=float), axis=0).tolist()
    return RobotCheck(worst[0], -worst[1], *worst[2:])


def _motion_errors(robot: Robot, q: np.ndarray, v: np.ndarray, u: np.ndarray, p: np.ndarray) -> tuple[float, ...]:
    """Return energy, force and contact errors, the largest over the modes."""
    names = [parameter.name for parameter in robot.parameters]
    slope, friction, gravity = (p[names.index(name)] for name in ("slope", "friction", "gravity"))
    worst = np.zeros(3)
    for mode in PHYSICAL:
        speed = v + np.eye(robot.n_q)[0] * mode.sign
        a, f = (np.asarray(part).ravel() for part in robot.acceleration[mode](q, speed, u, p))
        # Short against the time scales of the motion, which a light leg makes fast.
        step = 10 * _STEP / (np.max(np.abs(speed)) + np.sqrt(np.max(np.abs(a))) + 1)
        ahead = (q + step * speed + step**2 / 2 * a, speed + step * a)
        behind = (q - step * speed + step**2 / 2 * a, speed - step * a)
        energy = [sum(float(part) for part in robot.energy(*state, p)) for state in (ahead, behind)]
        rates = np.asarray(robot.joint_rates(q, speed, p)).ravel()
        power = float(u @ rates + f @ speed[:2])
        scale = abs(power) + abs(energy[0]) + 1
        energy_error = abs((energy[0] - energy[1]) / (2 * step) - power) / scale
        momentum = [np.asarray(robot.momentum(*state, p)[0]).ravel() for state in (ahead, behind)]
        weight = float(robot.mass(p)) * gravity * np.array([np.sin(slope), -np.cos(slope)])
        change = (momentum[0] - momentum[1]) / (2 * step)
        force_error = np.max(np.abs(change - f - weight)) / (np.max(np.abs(weight)) + np.max(np.abs(f)))
        mass, bias, actuation = (np.asarray(part) for part in robot.dynamics(q, speed, p))
        balance = mass @ a + bias.ravel() - actuation @ u - np.concatenate([f, np.zeros(robot.n_q - 2)])
        law = [f[0] + mode.sign * friction * f[1], a[1]] if mode.slips else [*a[:2]] if mode is Mode.STICK else [*f]
        scale = np.max(np.abs(f)) + np.max(np.abs(a)) + np.max(np.abs(bias)) + 1
        contact_error = np.max(np.abs([*balance, *law])) / scale
        worst = np.maximum(worst, [energy_error, force_error, contact_error])  # keeps a nan, which max can lose
    return tuple(worst)


def _impact_errors(robot: Robot, q: np.ndarray, v: np.ndarray, p: np.ndarray) -> tuple[float, float]:
    """Return momentum and impact-law errors of an impact in this configuration, the landing foot moving down."""
    landing = np.asarray(robot.landing(q, v, p)[1]).ravel()
    v = v if landing[1] < 0 else -v
    impact = solve_impact(robot, q, v, p)
    if impact.mode is None:
        return 0.0, np.inf
    foot = np.asarray(robot.landing(q, v, p)[0]).ravel()
    before, after = (_momenta(robot, q, speed, p, foot) for speed in (v, impact.v_plus))
    expected = np.array([*impact.impulse, 0.0])  # the impulse acts at the foot, so its moment there is zero
    scale = np.max(np.abs(before)) + np.max(np.abs(impact.impulse)) + 1
    momentum_error = float(np.max(np.abs(after - before - expected)) / scale)
    return momentum_error, float(np.max([_complementarity_error(robot, q, impact, p), -impact.energy_lost]))


def _momenta(robot: Robot, q: np.ndarray, v: np.ndarray, p: np.ndarray, about: np.ndarray) -> np.ndarray:
    linear, angular = (np.asarray(part).ravel() for part in robot.momentum(q, v, p))
    return np.array([*linear, angular[0] - about[1] * linear[0] + about[0] * linear[1]])


def _complementarity_error(robot: Robot, q: np.ndarray, impact: Impact, p: np.ndarray) -> float:
    friction = p[robot.index("friction")]
    velocity = np.asarray(robot.landing(q, impact.v_plus, p)[1]).ravel()
    tangential, normal = impact.impulse
    parts = (normal, max(tangential, 0.0), max(-tangential, 0.0))
    left, right = robot.contact_model.impact.pairs(parts, abs(velocity[0]), (velocity[1], velocity[0]), friction)
    scale = np.max(np.abs(impact.impulse)) + 1
    products = np.abs(np.array(left) * np.array(right))
    return float(np.max([*products, *(-np.array(left)), *(-np.array(right))]) / scale)


def _derivative_error(robot: Robot, q: np.ndarray, v: np.ndarray, u: np.ndarray, p: np.ndarray) -> float:
    """Return the error of the Jacobians of the sticking acceleration and force with respect to (q, v)."""
    function = robot.acceleration[Mode.STICK]
    exact = function.jacobian()(q, v, u, p, *function(q, v, u, p))
    worst = 0.0
    for output in range(2):
        for which, point in ((0, q), (1, v)):
            jacobian = np.asarray(exact[4 * output + which].full())
            for j in range(point.size):
                shift = np.eye(point.size)[j] * _STEP
                sides = [
                    np.asarray(function(*(q + s, v) if which == 0 else (q, v + s), u, p)[output]).ravel()
                    for s in (shift, -shift)
                ]
                difference = (sides[0] - sides[1]) / (2 * _STEP)
                error = np.max(np.abs(difference - jacobian[:, j])) / (np.max(np.abs(jacobian)) + 1)
                worst = float(np.maximum(worst, error))
    return worst
