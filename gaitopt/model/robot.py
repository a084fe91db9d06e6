"""A robot: a frozen bundle of named CasADi Functions, and how one is assembled from its parts."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import casadi as ca
import numpy as np

from gaitopt.errors import InputError
from gaitopt.model import contact
from gaitopt.model.mechanics import Body, derive
from gaitopt.model.modes import PHYSICAL, Mode
from gaitopt.parameters import Parameter, as_vector, resolve

GROUND = (
    Parameter("slope", 0.0, "rad", "downhill slope", lower=-math.pi / 2, upper=math.pi / 2),
    Parameter("friction", math.inf, "1", "Coulomb friction coefficient", lower=0.0, infinite=True),
)


class Coordinates:
    """The symbols a robot is written in: q = (x, y, angles), rates, and parameters by name.

    Parameters
    ----------
    angles : sequence of str
        Names of the joint or leg angles [rad].
    parameters : sequence of Parameter
        The robot's own parameters; ``gravity`` must be one of them.  Slope and friction are added.

    Examples
    --------
    >>> gravity = Parameter("gravity", 9.8, "m/s^2", "gravity")
    >>> Coordinates(["theta"], [gravity]).q.shape
    (3, 1)
    """

    def __init__(self, angles: Sequence[str], parameters: Sequence[Parameter]) -> None:
        self.angles = tuple(angles)
        self.parameters = (*parameters, *GROUND)
        names = [p.name for p in self.parameters]
        if len(set(names)) != len(names):
            raise InputError("Two parameters share a name; 'slope' and 'friction' belong to the ground.")
        if "gravity" not in names:
            raise InputError("A robot needs a parameter named 'gravity'.")
        self.q = ca.vertcat(ca.SX.sym("x"), ca.SX.sym("y"), *[ca.SX.sym(a) for a in angles])
        self.v = ca.SX.sym("v", self.q.numel())
        self.p = ca.vertcat(*[ca.SX.sym(name) for name in names])

    @property
    def foot(self) -> ca.SX:
        """Position of the stance foot, SX of shape (2, 1) [m]."""
        return self.q[:2]

    def angle(self, name: str) -> ca.SX:
        """Return the symbol of an angle [rad]."""
        return self.q[2 + self.angles.index(name)]

    def parameter(self, name: str) -> ca.SX:
        """Return the symbol of a parameter."""
        return self.p[[p.name for p in self.parameters].index(name)]


@dataclass(frozen=True, eq=False, kw_only=True)
class Robot:
    """A planar single-support walker.  Build one with :func:`assemble`.

    Every attribute from `dynamics` on is a CasADi Function of q (n_q), v (n_q), u (n_u) and the parameter
    vector p (n_p); the optimiser calls them on symbols and the simulator on numbers, so both run the same physics.

    Attributes
    ----------
    name, description : str
    angles, actuators : tuple of str
        Names of the angles (q without the foot) and of the actuators.
    parameters : tuple of Parameter
        Own parameters, then slope and friction; the order of p.
    points, links : tuple
        Names of the points drawn, and pairs of their indices joined by a line.
    dynamics : (q, v, p) -> mass_matrix (n_q, n_q), bias (n_q), actuation (n_q, n_u)
    acceleration : mode -> ((q, v, u, p) -> acceleration (n_q), force (2))
    energy : (q, v, p) -> kinetic, potential [J]
    momentum : (q, v, p) -> linear (2), angular (1), total_mass (1)
    wellposed : (q, p) -> (2), share of the mass that resists slip+ / slip-, positive where that slip is well posed
    landing : (q, v, p) -> position (2), velocity (2), jacobian (2, n_q) of the landing foot
    impact : (q, v_minus, v_plus, impulse, p) -> momentum residual (n_q), landing-foot velocity after (2)
    collision : (q, v, p) -> landing-foot velocity (2), its mobility (2, 2), rates per unit impulse (n_q, 2)
    touchdown : (q, v, p) -> guard, rate, armed; the step ends when the guard falls through 0 while armed > 0
    swap : (q, v, p) -> q, v in the coordinates of the next step, the landing foot being (x, y)
    unswap : (q_before, v_next, p) -> v before the swap
    upright : (q, p) -> positive while the walker has not fallen
    joint_rates : (q, v, p) -> (n_u) rates the actuators work on [rad/s]
    figure : (q, p) -> (2, n_points) positions drawn [m]

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> robot = compass_biped()
    >>> robot.n_q, robot.n_u, robot.energy([0] * 4, [0] * 4, robot.vector(robot.resolve({})))[0]
    (4, 2, DM(0))
    """

    name: str
    description: str
    angles: tuple[str, ...]
    actuators: tuple[str, ...]
    parameters: tuple[Parameter, ...]
    points: tuple[str, ...]
    links: tuple[tuple[int, int], ...]
    dynamics: ca.Function
    acceleration: Mapping[Mode, ca.Function] = field(repr=False)
    energy: ca.Function
    momentum: ca.Function
    wellposed: ca.Function
    landing: ca.Function
    impact: ca.Function
    collision: ca.Function
    touchdown: ca.Function
    swap: ca.Function
    unswap: ca.Function
    upright: ca.Function
    joint_rates: ca.Function
    figure: ca.Function

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, angles={self.angles}, actuators={self.actuators})"

    @property
    def n_q(self) -> int:
        """Number of coordinates, the stance foot's two included."""
        return 2 + len(self.angles)

    @property
    def n_u(self) -> int:
        """Number of actuators."""
        return len(self.actuators)

    def resolve(self, values: Mapping[str, object]) -> dict[str, float]:
        """Return every parameter by name, defaults filled in; raise InputError for a name or value that cannot be.

        Examples
        --------
        >>> from gaitopt import compass_biped
        >>> compass_biped().resolve({"leg_mass": 5})["leg_mass"]
        5.0
        """
        return resolve(self.parameters, values, f"Robot {self.name!r}")

    def vector(self, values: Mapping[str, float]) -> np.ndarray:
        """Return resolved parameters as the vector p, shape (n_p,)."""
        return as_vector(self.parameters, values)


def assemble(
    name: str,
    coordinates: Coordinates,
    *,
    description: str,
    bodies: Sequence[Body],
    landing_foot: ca.SX,
    touchdown: ca.SX,
    armed: ca.SX,
    relabel: Sequence[ca.SX],
    upright: ca.SX,
    actuators: Mapping[str, ca.SX],
    points: Mapping[str, ca.SX],
    links: Sequence[tuple[str, str]],
) -> Robot:
    """Assemble a robot from its symbolic description.

    Parameters
    ----------
    name, description : str
    coordinates : Coordinates
        The symbols all expressions are written in.
    bodies : sequence of PointMass or RigidLink
    landing_foot : SX, shape (2, 1)
        Position of the foot that will land [m].
    touchdown, armed : SX
        The step ends when `touchdown` falls through zero while `armed` > 0.
    relabel : sequence of SX
        The angles of the next step as functions of the angles at touchdown (linear, invertible).
    upright : SX
        Positive while the walker stands.
    actuators : mapping of str to SX
        The angle each actuator's torque works on [rad].
    points : mapping of str to SX of shape (2, 1)
        Points to draw.
    links : sequence of pairs of point names

    Returns
    -------
    Robot

    Raises
    ------
    InputError
        If the relabelling is not a linear, invertible map of the angles.

    Examples
    --------
    A pendulum that never walks (see ``gaitopt/model/compass.py`` for a robot that does):

    >>> from gaitopt import Coordinates, Parameter, PointMass, assemble
    >>> c = Coordinates(["theta"], [Parameter("gravity", 9.8, "m/s^2", "gravity")])
    >>> theta = c.angle("theta")
    >>> tip = c.foot + ca.vertcat(ca.sin(theta), ca.cos(theta))
    >>> pendulum = assemble(
    ...     "pendulum", c, description="inverted pendulum", bodies=[PointMass(1.0, tip)], landing_foot=tip,
    ...     touchdown=1 - theta, armed=theta, relabel=[-theta], upright=ca.cos(theta), actuators={"ankle": theta},
    ...     points={"foot": c.foot, "tip": tip}, links=[("foot", "tip")],
    ... )
    >>> pendulum.n_q
    3
    """
    q, v, p = coordinates.q, coordinates.v, coordinates.p
    n, n_u = q.numel(), len(actuators)
    u, w = ca.SX.sym("u", n_u), ca.SX.sym("w", n)
    impulse = ca.SX.sym("impulse", 2)
    slope, friction = coordinates.parameter("slope"), coordinates.parameter("friction")
    gravity = coordinates.parameter("gravity") * ca.vertcat(ca.sin(slope), -ca.cos(slope))
    parts = derive(bodies, q, v, gravity)

    relative = ca.vertcat(*actuators.values()) if actuators else ca.SX(0, 1)
    joint = ca.jacobian(relative, q) if n_u else ca.SX(0, n)
    drive = joint.T @ u - parts.bias

    landing_jacobian = ca.jacobian(landing_foot, q)
    permutation = _relabelling(relabel, q, name)
    next_q = ca.vertcat(landing_foot, *relabel)
    next_v = ca.vertcat(landing_jacobian @ v, permutation @ v[2:])
    # The inverse of next_v for given landing configuration: angles first, then the old foot's own velocity.
    back = ca.solve(permutation, w[2:])
    old_v = ca.vertcat(w[:2] - landing_jacobian[:, 2:] @ back, back)

    qp, qvp = {"q": q, "p": p}, {"q": q, "v": v, "p": p}
    rate = ca.jacobian(touchdown, q) @ v
    spread = contact.solve_symmetric(parts.mass_matrix, landing_jacobian.T)
    residual = parts.mass_matrix @ (w - v) - landing_jacobian.T @ impulse
    acceleration, wellposed = contact_functions(q, v, u, p, parts.mass_matrix, drive, friction)
    index = {point: i for i, point in enumerate(points)}
    return Robot(
        name=name,
        description=description,
        angles=coordinates.angles,
        actuators=tuple(actuators),
        parameters=coordinates.parameters,
        points=tuple(points),
        links=tuple((index[a], index[b]) for a, b in links),
        dynamics=_function(
            "dynamics", qvp, {"mass_matrix": parts.mass_matrix, "bias": parts.bias, "actuation": joint.T}
        ),
        acceleration=acceleration,
        energy=_function("energy", qvp, {"kinetic": parts.kinetic, "potential": parts.potential}),
        momentum=_function(
            "momentum",
            qvp,
            {"linear": parts.momentum, "angular": parts.angular_momentum, "total_mass": parts.total_mass},
        ),
        wellposed=wellposed,
        landing=_function(
            "landing",
            qvp,
            {"position": landing_foot, "velocity": landing_jacobian @ v, "jacobian": landing_jacobian},
        ),
        impact=_function(
            "impact",
            {"q": q, "v_minus": v, "v_plus": w, "impulse": impulse, "p": p},
            {"residual": residual, "foot_velocity": landing_jacobian @ w},
        ),
        collision=_function(
            "collision",
            qvp,
            {"velocity": landing_jacobian @ v, "mobility": landing_jacobian @ spread, "spread": spread},
        ),
        touchdown=_function("touchdown", qvp, {"guard": touchdown, "rate": rate, "armed": armed}),
        swap=_function("swap", qvp, {"q_next": next_q, "v_next": next_v}),
        unswap=_function("unswap", {"q": q, "v_next": w, "p": p}, {"v": old_v}),
        upright=_function("upright", qp, {"upright": upright}),
        joint_rates=_function("joint_rates", qvp, {"rates": joint @ v}),
        figure=_function("figure", qp, {"points": ca.horzcat(*points.values())}),
    )


def contact_functions(
    q: ca.SX, v: ca.SX, u: ca.SX, p: ca.SX, mass_matrix: ca.SX, drive: ca.SX, friction: ca.SX
) -> tuple[dict[Mode, ca.Function], ca.Function]:
    """Return the Functions `acceleration` and `wellposed` of a robot.

    Parameters
    ----------
    q, v, u, p : SX
        Their inputs.
    mass_matrix, drive, friction : SX
        As in :func:`gaitopt.model.contact.accelerations`, expressions of the inputs.
    """
    acceleration = {}
    for mode in PHYSICAL:
        a, f = contact.accelerations(mode, mass_matrix, drive, friction)
        label = "acceleration_" + mode.name.lower()
        acceleration[mode] = _function(label, {"q": q, "v": v, "u": u, "p": p}, {"acceleration": a, "force": f})
    share = contact.sliding_inertia(mass_matrix, friction)
    return acceleration, _function("wellposed", {"q": q, "p": p}, {"share": share})


def _function(label: str, inputs: dict[str, ca.SX], outputs: dict[str, ca.SX]) -> ca.Function:
    expressions = ca.cse([ca.densify(ca.SX(e)) for e in outputs.values()])
    return ca.Function(label, list(inputs.values()), expressions, list(inputs), list(outputs))


def _relabelling(relabel: Sequence[ca.SX], q: ca.SX, name: str) -> ca.DM:
    """Return the constant matrix of the leg swap on the angles' rates."""
    matrix = ca.jacobian(ca.vertcat(*relabel), q[2:])
    if not matrix.is_constant() or matrix.shape[0] != matrix.shape[1]:
        raise InputError(f"Robot {name!r}: the relabelled angles must be linear in the angles, one for each.")
    constant = ca.DM(matrix)
    if abs(float(ca.det(constant))) < 1e-12:
        raise InputError(f"Robot {name!r}: the relabelling of the angles cannot be inverted.")
    return constant
