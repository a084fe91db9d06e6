"""Checks of a robot: energy and momentum balances, leg exchange and touchdown guard."""

from collections.abc import Mapping
from dataclasses import field

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.contacts.impact import Impact, solve_impact
from gaitopt.model.contacts.mode import PHYSICAL, Mode
from gaitopt.model.mechanics import describe_mass_fault
from gaitopt.model.plausible_sizes import report_implausible_sizes
from gaitopt.model.robot import Robot
from gaitopt.model.robot_type import check_robot_type
from gaitopt.model.step_check import StepCheck, check_step
from gaitopt.parameters import Parameter

_STEP = 1e-6

UNARMED = (
    "no pose near the upright one was found in which touchdown is zero, armed > 0 and upright > 0: correct these "
    "expressions of StepEnd."
)
"""Fault of a robot without a touchdown configuration."""


@dataclass(frozen=True)
class RobotCheck:
    """Largest relative errors in random states; those of a correct robot are at rounding or finite-difference level.

    Attributes
    ----------
    asymmetry : float
        Asymmetry of the mass matrix.
    least_eigenvalue : float
        Smallest eigenvalue of the mass matrix over the largest in size; must be positive.
    energy : float
        Rate of total energy along the motion minus the power of torques, contact force and dampers.
    force : float
        Rate of linear momentum along the motion minus gravity and contact force.
    contact : float
        Conditions of the contact modes: equations of motion, foot acceleration and friction law.
    momentum : float
        Impulsive balance M (v+ - v-) = W^T impulse, W being the Jacobian of the contact's slide and gap coordinates,
        which includes rolling feet; change of linear momentum minus the impulse; angular momentum of a rigid rotation.
    impact : float
        Complementarity residual of the exact impact solution, and energy gained by it.
    derivatives : float
        Jacobians by algorithmic differentiation minus central differences.
    exchange : float
        Leg exchange at random touchdowns: change of kinetic, potential and elastic energy and of angular momentum, and
        distance of the exchanged feet from their old places; infinite if no touchdown is found.
    guard : float
        Height of the landing foot where the touchdown guard is zero; infinite if the guard has the wrong sign, or is
        armed where the landing foot is not ahead of the stance foot.
    figure : float
        Distance of the points drawn from those drawn after the exchange of two legs, as sets.
    faults : tuple of str
        Faults of the masses, the leg exchange, the guard and the figure with their remedies, one sentence each.
    remarks : tuple of str
        Implausible sizes with the likely unit, such as a length of 900 m; they do not affect `passed`.

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
    exchange: float
    guard: float
    figure: float
    faults: tuple[str, ...] = field(default=(), kw_only=True)
    remarks: tuple[str, ...] = field(default=(), kw_only=True)

    @property
    def passed(self) -> bool:
        """Whether every error is small enough for a correct robot."""
        # np.max propagates nan, unlike max.
        step = (self.exchange, self.guard, self.figure)
        exact = np.max([self.asymmetry, self.contact, self.momentum, self.impact, *step])
        differenced = np.max([self.energy, self.force, self.derivatives])
        return bool(self.least_eigenvalue > 0 and exact < 1e-9 and differenced < 1e-6)


@check_arguments
def check_robot(
    robot: Robot, parameters: Mapping[str, float] | None = None, *, states: int = 20, seed: int = 0
) -> RobotCheck:
    """Check a robot in random states.

    Parameters
    ----------
    robot : Robot
    parameters : mapping of str to float, optional
        The default of friction is 0.3.
    states : int
        Number of random states.
    seed : int

    Returns
    -------
    RobotCheck

    Raises
    ------
    InputError
        If a parameter is invalid, or the friction is infinite.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> check_robot(compass_biped()).passed
    True
    """
    check_robot_type(robot, Robot, "a Robot such as compass_biped()", "check_planar")
    Parameter("states", 1, "1", "", lower=1, upper=100_000, whole=True).check(states)
    Parameter("seed", 0, "1", "", lower=0, whole=True).check(seed)
    rng = np.random.default_rng(seed)
    values = robot.resolve({"friction": 0.3, "slope": 0.1, **(parameters or {})})
    if np.isinf(values["friction"]):
        raise InputError("check_robot needs a finite friction coefficient to check slip, got inf.")
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
    step = check_step(robot, p, states, rng, drawn=True) or StepCheck(np.inf, np.inf, np.inf, (UNARMED,))
    errors = [worst[0], -worst[1], *worst[2:], step.exchange, step.guard, step.figure]
    faults = step.faults
    if fault := describe_mass_fault(-worst[1], mass, ("x", "y", *robot.angles)):
        faults = (f"{fault[0].upper()}{fault[1:]}.", *faults)
    return RobotCheck(*errors, faults=faults, remarks=report_implausible_sizes(robot, values))


def _motion_errors(robot: Robot, q: np.ndarray, v: np.ndarray, u: np.ndarray, p: np.ndarray) -> tuple[float, ...]:
    """Return energy, force and contact errors, the largest over the modes."""
    names = [parameter.name for parameter in robot.parameters]
    slope, friction, gravity = (p[names.index(name)] for name in ("slope", "friction", "gravity"))
    worst = np.zeros(3)
    for mode in PHYSICAL:
        speed = v + np.eye(robot.n_q)[0] * mode.sign
        a, f = (np.asarray(part).ravel() for part in robot.acceleration[mode](q, speed, u, p))
        # Small compared with the time scales of the motion, which are short for a light leg.
        step = 10 * _STEP / (np.max(np.abs(speed)) + np.sqrt(np.max(np.abs(a))) + 1)
        ahead = (q + step * speed + step**2 / 2 * a, speed + step * a)
        behind = (q - step * speed + step**2 / 2 * a, speed - step * a)
        energy = [sum(float(part) for part in robot.energy(*state, p)) for state in (ahead, behind)]
        rates = np.asarray(robot.joint_rates(q, speed, p)).ravel()
        power = float(u @ rates + f @ speed[:2]) - float(robot.force_powers(q, speed, p)[1])
        scale = abs(power) + abs(energy[0]) + 1
        energy_error = abs((energy[0] - energy[1]) / (2 * step) - power) / scale
        momentum = [np.asarray(robot.momentum(*state, p)[0]).ravel() for state in (ahead, behind)]
        weight = float(robot.mass(p)) * gravity * np.array([np.sin(slope), -np.cos(slope)])
        change = (momentum[0] - momentum[1]) / (2 * step)
        force_error = np.max(np.abs(change - f - weight)) / (np.max(np.abs(weight)) + np.max(np.abs(f)))
        mass, bias, actuation = (np.asarray(part) for part in robot.dynamics(q, speed, p))
        reaction = np.concatenate([f, np.zeros(robot.n_q - 2)])
        balance = [
            *(mass @ a + bias.ravel() - actuation @ u - reaction),
            *(np.asarray(robot.inverse_dynamics(q, speed, a, u, p)).ravel() - reaction),
        ]
        law = [f[0] + mode.sign * friction * f[1], a[1]] if mode.slips else [*a[:2]] if mode is Mode.STICK else [*f]
        scale = np.max(np.abs(f)) + np.max(np.abs(a)) + np.max(np.abs(bias)) + 1
        contact_error = np.max(np.abs([*balance, *law])) / scale
        worst = np.maximum(worst, [energy_error, force_error, contact_error])  # propagates nan, unlike max
    return tuple(worst)


def _impact_errors(robot: Robot, q: np.ndarray, v: np.ndarray, p: np.ndarray) -> tuple[float, float]:
    """Return momentum and impact-law errors of an impact in this configuration, the landing foot moving down."""
    landing = np.asarray(robot.landing(q, v, p)[1]).ravel()
    v = v if landing[1] < 0 else -v
    impact = solve_impact(robot, q, v, p)
    if impact.mode is None:
        return 0.0, np.inf
    momentum = _momentum_error(robot, q, v, impact, p)
    return momentum, float(np.max([_complementarity_error(robot, q, impact, p), -impact.energy_lost]))


def _momentum_error(robot: Robot, q: np.ndarray, v: np.ndarray, impact: Impact, p: np.ndarray) -> float:
    """Return the error of the impulsive balance, of linear momentum, and of angular momentum."""
    mass = np.asarray(robot.dynamics(q, v, p)[0])
    place, _, jacobian = (np.asarray(part) for part in robot.landing(q, v, p))
    change, impulse = impact.v_plus - v, impact.impulse
    linear = np.array([np.asarray(robot.momentum(q, unit, p)[0]).ravel() for unit in np.eye(robot.n_q)]).T
    angular = np.array([float(robot.momentum(q, unit, p)[1]) for unit in np.eye(robot.n_q)])
    scale = np.max(np.abs(mass @ v)) + np.max(np.abs(impulse)) + 1
    balance = np.max(np.abs([*(mass @ change - jacobian.T @ impulse), *(linear @ change - impulse)])) / scale
    # Rates whose product with the mass matrix is the angular momentum are a rigid rotation about the origin.
    rotation = np.linalg.solve(mass, angular)
    middle = _centre_of_mass(robot, q, p)
    slip = (jacobian @ rotation)[0] - place[1, 0]  # of the contact point in that rotation, minus its height
    rotated = [*(linear @ rotation / float(robot.mass(p)) - [middle[1], -middle[0]]), slip]
    return float(np.max([balance, np.max(np.abs(rotated)) / (np.max(np.abs(middle)) + 1)]))


def _centre_of_mass(robot: Robot, q: np.ndarray, p: np.ndarray) -> np.ndarray:
    """Return the centre of mass, shape (2,) [m], from the energies of gravity on level and on vertical ground."""
    names = [parameter.name for parameter in robot.parameters]
    potential = []
    for slope in (-np.pi / 2, 0.0):
        inclined = p.copy()
        inclined[names.index("slope")] = slope
        state = (q, np.zeros(robot.n_q), inclined)
        potential.append(float(robot.energy(*state)[1] - robot.force_powers(*state)[0]))
    return np.array(potential) / (float(robot.mass(p)) * p[names.index("gravity")])


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
