"""Checks of a planar robot in random states: mass, energy, contacts, travel and leg exchange."""

from collections.abc import Mapping
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.mechanics import SINGULAR, describe_mass_fault
from gaitopt.model.planar.contact_translation import describe_detached_contacts
from gaitopt.model.planar.mirror_check import (
    DIFFERENCED,
    EXACT,
    describe_mirror_fault,
    evaluate,
    measure_mirror_errors,
    relative_difference,
)
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.planar.plausible_geometry import report_implausible_geometry
from gaitopt.model.plausible_sizes import report_implausible_sizes
from gaitopt.model.robot_type import check_robot_type
from gaitopt.parameters import Parameter

Vector = NDArray[np.float64]

STEP = 1e-5
"""Step of central differences [m or rad]."""

MOST_COORDINATES = 12
"""Largest number of coordinates of a robot that is checked before it is used: the check forms its mass matrix."""


@dataclass(frozen=True)
class PlanarCheck:
    """Largest relative errors of a planar robot in random states.

    Attributes
    ----------
    least_eigenvalue : float
        Smallest eigenvalue of the mass matrix over the largest in size; must be positive.
    energy : float
        Kinetic energy minus v^T M v / 2, and the change of energy without contacts minus the work of torques and
        dampers.
    contacts : float
        Derivatives of gaps and slide coordinates minus central differences.
    travel : float
        Change of mass matrix, forces and gaps, and of slide coordinates minus the distance, when the robot is moved
        along the ground.
    mirror : float
        Change of mass matrix, forces, gaps, slide coordinates and actuation by the exchange of the legs.
    faults : tuple of str
        Faults with their remedies, one sentence each; empty for a correct robot.
    remarks : tuple of str
        Implausible sizes with the likely unit, such as a length of 900 m, and directions of legs and feet that seem
        reversed; they do not affect `passed`.

    Examples
    --------
    >>> print(PlanarCheck(0.01, 1e-9, 1e-10, 0.0, 0.0))
    passed; least eigenvalue of the mass matrix 1.0e-02; errors: energy 1.0e-09, contacts 1.0e-10, travel 0.0e+00, \
mirror 0.0e+00
    """

    least_eigenvalue: float
    energy: float
    contacts: float
    travel: float
    mirror: float
    faults: tuple[str, ...] = field(default=())
    remarks: tuple[str, ...] = field(default=())

    def __str__(self) -> str:
        verdict = "passed" if self.passed else f"not passed: {' '.join(self.faults)}"
        errors = ", ".join(f"{name} {getattr(self, name):.1e}" for name in ("energy", "contacts", "travel", "mirror"))
        text = f"{verdict}; least eigenvalue of the mass matrix {self.least_eigenvalue:.1e}; errors: {errors}"
        return "; ".join([text, *self.remarks])

    @property
    def passed(self) -> bool:
        """Whether the robot has no fault."""
        return not self.faults


@check_arguments
def check_planar(
    robot: PlanarRobot, parameters: Mapping[str, float] | None = None, *, states: int = 10, seed: int = 0
) -> PlanarCheck:
    """Check a planar robot in random states.

    Parameters
    ----------
    robot : PlanarRobot
    parameters : mapping of str to float, optional
        By default the defaults, on a slope of 0.1 rad.
    states : int
        Number of random states.
    seed : int

    Returns
    -------
    PlanarCheck

    Raises
    ------
    InputError
        If a parameter is invalid.

    Examples
    --------
    >>> from gaitopt.model.robots.kneed_walker import kneed_walker
    >>> check_planar(kneed_walker()).passed
    True
    """
    check_robot_type(robot, PlanarRobot, "a PlanarRobot such as monopod()", "check_robot")
    Parameter("states", 1, "1", "", lower=1, upper=100_000, whole=True).check(states)
    Parameter("seed", 0, "1", "", lower=0, whole=True).check(seed)
    rng = np.random.default_rng(seed)
    values = robot.resolve({"slope": 0.1, "friction": 0.5, **(parameters or {})})
    p = robot.vector(values)
    rows = []
    for _ in range(states):
        q, v, u = rng.uniform(0.2, 0.8, robot.n_q), rng.normal(size=robot.n_q), rng.normal(size=robot.n_u)
        mass = evaluate(robot.dynamics, q, v, p)[0]
        eigenvalues = np.linalg.eigvalsh((mass + mass.T) / 2)
        largest = np.max(np.abs(eigenvalues))
        least = float(eigenvalues[0] / largest) if largest > 0 else 0.0
        rows.append(
            (
                -least,
                _energy_error(robot, q, v, u, p) if least > SINGULAR else np.nan,
                _contact_error(robot, q, v, p),
                _travel_error(robot, q, v, p),
                float(np.max([0.0, *measure_mirror_errors(robot, robot.mirror, q, v, p).values()])),
            )
        )
    worst = np.max(np.array(rows), axis=0).tolist()
    least, energy, contacts, travel, mirror = worst
    faults = (
        *_faults(robot, worst, (q, v, p), _describe_masses(robot, -least, mass, values)),
        *_release_faults(robot),
        *_arming_faults(robot, p),
    )
    if -least > SINGULAR:
        faults += describe_detached_contacts(robot, q, p)
    remarks = report_implausible_sizes(robot, values) + report_implausible_geometry(robot, values)
    return PlanarCheck(-least, energy, contacts, travel, mirror, faults, remarks)


def require_planar(robot: PlanarRobot, parameters: Mapping[str, float]) -> None:
    """Raise InputError unless a robot passes :func:`check_planar`; a robot with many coordinates is not checked.

    Examples
    --------
    >>> from gaitopt.model.robots.kneed_walker import kneed_walker
    >>> require_planar(kneed_walker(), {})
    """
    if robot.n_q > MOST_COORDINATES:
        return
    known = {name: value for name, value in parameters.items() if name not in ("slope", "friction")}
    check = check_planar(robot, known, states=2)
    if not check.passed:
        raise InputError(" ".join(check.faults))


def _describe_masses(robot: PlanarRobot, least: float, mass: Vector, values: Mapping[str, float]) -> str:
    """Return a part of a sentence on an invalid mass matrix, with negative masses among the parameters."""
    fault = describe_mass_fault(least, mass, robot.coordinates)
    units = {each.name: each.unit for each in robot.parameters if each.unit in ("kg", "kg m^2")}
    negative = [f"{name} = {values[name]:g} {unit}" for name, unit in units.items() if values[name] < 0]
    return f"{fault} ({', '.join(negative)})" if fault and negative else fault


def _faults(
    robot: PlanarRobot, worst: list[float], state: tuple[Vector, Vector, Vector], masses: str
) -> tuple[str, ...]:
    """Return the sentences of the errors that are too large; `masses` is that on the mass matrix."""
    _, energy, contacts, travel, mirror = worst
    name, faults = f"Robot {robot.name!r}:", []
    if masses:
        return (f"{name} {masses}.",)
    if any(np.isnan(worst)):
        return (
            f"{name} the equations of motion are not finite (nan): check that every mass, length, position and "
            "parameter of the script is a finite number.",
        )
    if not energy < DIFFERENCED:
        faults.append(
            f"{name} the change of energy differs from the work of the forces by {energy:.3g} (relative error)."
        )
    if not contacts < DIFFERENCED:
        faults.append(
            f"{name} the derivatives of gaps or slide coordinates are wrong by {contacts:.3g} (relative error)."
        )
    if not travel < EXACT:
        faults.append(
            f"{name} the motion depends on the position along the ground (relative change {travel:.3g}); declare the "
            "coordinate that moves the whole robot forward, PlanarCoordinates(..., travel=...); if there is none, "
            f"rename {robot.travel!r}."
        )
    if not mirror < EXACT:
        faults.append(f"{name} {describe_mirror_fault(robot, *state, mirror)}")
    return tuple(faults)


def _release_faults(robot: PlanarRobot) -> tuple[str, ...]:
    """Return the faults of latched stops whose exchanged stop is not released by the exchanged contact."""
    if robot.mirror is None:
        return ()
    names = robot.contact_names
    image = {name: names[place] for name, place in zip(names, robot.mirror.contacts, strict=True)}
    releases = {contact.name: contact.released_by for contact in robot.contacts}
    faults = []
    for name, release in releases.items():
        expected = None if release is None else (image[release[0]], release[1])
        if releases[image[name]] != expected:
            faults.append(
                f"Robot {robot.name!r}: the mirror exchanges stops {name!r} and {image[name]!r}, which are not "
                "released by exchanged contacts."
            )
    return tuple(faults)


def _arming_faults(robot: PlanarRobot, p: Vector) -> tuple[str, ...]:
    """Return a sentence for each contact that never closes, because `armed` is a constant that is not positive."""
    zero = np.zeros(robot.n_q)
    values = evaluate(robot.arming, zero, zero, p)[0].ravel()
    varying = {row for i in (0, 1) for row in robot.arming.jac_sparsity(0, i).row()}
    return tuple(
        f"Robot {robot.name!r}: contact {name!r} never closes, because `armed` is {value:g} in every state; "
        "it must be positive where the contact may close."
        for number, (name, value) in enumerate(zip(robot.contact_names, values, strict=True))
        if number not in varying and value <= 0
    )


def _energy_error(robot: PlanarRobot, q: Vector, v: Vector, u: Vector, p: Vector) -> float:
    """Return the error of the kinetic energy and of the balance of energy without contacts."""
    mass, bias, actuation = evaluate(robot.dynamics, q, v, p)
    a = np.linalg.solve(mass, actuation @ u - bias.ravel())
    # Small compared with the time scales of the motion, which are short for a light leg.
    step = STEP / (np.max(np.abs(v)) + np.sqrt(np.max(np.abs(a))) + 1)
    sides = [(q + s * v + s**2 / 2 * a, v + s * a) for s in (step, -step)]
    energies = [float(sum(part.item() for part in evaluate(robot.energy, *side, p))) for side in sides]
    power = float(u @ evaluate(robot.joint_rates, q, v, p)[0].ravel())
    power -= evaluate(robot.force_powers, q, v, p)[1].item()
    kinetic = evaluate(robot.energy, q, v, p)[0].item()
    scale = abs(power) + abs(energies[0]) + 1
    change = (energies[0] - energies[1]) / (2 * step)
    return max(abs(change - power), abs(kinetic - v @ mass @ v / 2)) / scale


def _contact_error(robot: PlanarRobot, q: Vector, v: Vector, p: Vector) -> float:
    """Return the error of the derivatives of gaps and slide coordinates."""
    normal, tangent, *biases = evaluate(robot.rows, q, v, p)
    errors = [0.0]
    ahead, behind = (evaluate(robot.rows, q + s * v, v, p) for s in (STEP, -STEP))
    for k, rows in enumerate((normal, tangent)):
        changed = (ahead[k] - behind[k]) @ v / (2 * STEP)
        errors.append(float(np.max(np.abs(changed - biases[k].ravel())) / (np.max(np.abs(biases[k])) + 1)))
        for j, unit in enumerate(np.eye(robot.n_q)):
            places = [evaluate(robot.gaps, q + s * unit, p)[k].ravel() for s in (STEP, -STEP)]
            difference = (places[0] - places[1]) / (2 * STEP)
            errors.append(float(np.max(np.abs(difference - rows[:, j])) / (np.max(np.abs(rows)) + 1)))
    return max(errors)


def _travel_error(robot: PlanarRobot, q: Vector, v: Vector, p: Vector) -> float:
    """Return the change of everything but the slide coordinates when the robot is moved along the ground."""
    if robot.travel is None:
        return 0.0
    moved = q + np.eye(robot.n_q)[robot.coordinates.index(robot.travel)]
    original, displaced = (
        [*evaluate(robot.dynamics, place, v, p), *evaluate(robot.rows, place, v, p)] for place in (q, moved)
    )
    gaps = [evaluate(robot.gaps, place, p) for place in (q, moved)]
    slides = np.array([float(contact.slides) for contact in robot.contacts])
    original += [gaps[0][0], gaps[0][1].ravel() + slides]
    displaced += [gaps[1][0], gaps[1][1].ravel()]
    return relative_difference(original, displaced)
