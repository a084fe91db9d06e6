"""Equations of motion of a planar mechanism made of point masses and rigid links.

They read  M(q) a + h(q, v) = W^T f + E tau  with q = (x, y, angles); (x, y) is the stance foot, so
W = [I 0] and the contact force f = (f_t, f_n) enters the first two rows.
"""

import math
from collections.abc import Sequence

import casadi as ca
import numpy as np

from gaitopt.arguments import check_record
from gaitopt.dataclass import dataclass
from gaitopt.errors import NAN_CAUSES, InputError
from gaitopt.locks import cached_property
from gaitopt.model.forces import Damper, Force, Potential, RotorInertia, Spring

SINGULAR, LEAST_SHARE = 1e-14, 1e-3
"""Least eigenvalue of the mass matrix of a valid robot, relative to the largest one, and share of a coordinate in a
motion without mass from which it is named."""

NEGATIVE = 1e-12
"""Least size of a negative eigenvalue of the mass matrix, relative to the largest one, that is not a rounding error."""

LONGEST_POSITION = 80
"""Number of characters up to which a message quotes the position of a body."""


@check_record
@dataclass(frozen=True, eq=False)
class PointMass:
    """A mass at a point.

    Attributes
    ----------
    mass : SX or float
        Mass [kg].
    position : SX, shape (2, 1)
        Position in the slope-fixed frame [m].

    Raises
    ------
    InputError
        If the mass is a negative number or not finite.

    Examples
    --------
    >>> import casadi as ca
    >>> angle = ca.SX.sym("angle")
    >>> PointMass(2.0, ca.vertcat(ca.sin(angle), ca.cos(angle))).position.shape
    (2, 1)
    """

    mass: ca.SX
    position: ca.SX

    def __post_init__(self) -> None:
        _check_inertia(self, "mass", "kg")


@check_record
@dataclass(frozen=True, eq=False)
class RigidLink:
    """A rigid body with rotary inertia.

    Attributes
    ----------
    mass : SX or float
        Mass [kg]; 0 only if the inertia is 0 as well.  A rotor without mass is a :class:`RotorInertia`.
    position : SX, shape (2, 1)
        Position of the centre of mass [m].
    inertia : SX or float
        Moment of inertia about the centre of mass [kg m^2].
    angle : SX
        Orientation [rad].

    Raises
    ------
    InputError
        If the mass or the inertia is a negative number or not finite.

    Examples
    --------
    >>> import casadi as ca
    >>> angle = ca.SX.sym("angle")
    >>> RigidLink(2.0, ca.vertcat(ca.sin(angle), ca.cos(angle)), 0.1, angle).inertia
    0.1
    """

    mass: ca.SX
    position: ca.SX
    inertia: ca.SX
    angle: ca.SX

    def __post_init__(self) -> None:
        _check_inertia(self, "mass", "kg")
        _check_inertia(self, "inertia", "kg m^2")


def _check_inertia(body: "Body", name: str, unit: str) -> None:
    """Raise InputError if a number of a body is negative or not finite; an expression of parameters is not checked."""
    value = _as_expression(getattr(body, name))
    number = float(value) if value.is_scalar() and value.is_constant() else 0.0
    if 0 <= number < math.inf:
        return
    cause = f": {NAN_CAUSES}" if math.isnan(number) else ""
    fault = "must not be negative" if number < 0 else "must be finite"
    raise InputError(f"{type(body).__name__}{_locate(body)}: {name} {fault} [{unit}], got {number:g}{cause}.")


def _locate(body: "Body") -> str:
    """Return the place of a body, or the symbols in a long expression of it, which identify the body in a message."""
    position = _as_expression(body.position)
    if len(text := str(position)) <= LONGEST_POSITION:
        return f" at {text}"
    return f" whose position depends on {', '.join(symbol.name() for symbol in ca.symvar(position))}"


def describe_massless(matrix: np.ndarray, names: Sequence[str]) -> str:
    """Return the coordinates that move no mass or inertia by a singular mass matrix, as a part of a sentence.

    Examples
    --------
    >>> describe_massless(np.diag([2.0, 0.0]), ["x", "knee"])
    ", because no mass or inertia moves with 'knee'"
    """
    largest = float(np.max(np.abs(matrix), initial=0.0))
    massless = [repr(name) for name, entry in zip(names, np.diag(matrix), strict=True) if entry <= SINGULAR * largest]
    if massless:
        return f", because no mass or inertia moves with {', '.join(massless)}"
    values, vectors = np.linalg.eigh((matrix + matrix.T) / 2)
    shares = np.linalg.norm(vectors[:, values <= SINGULAR * max(largest, values[-1])], axis=1)
    together = [repr(name) for name, share in zip(names, shares, strict=True) if share > LEAST_SHARE]
    return f", because no mass or inertia moves in some motion of {', '.join(together)}" if together else ""


def describe_mass_fault(least: float, matrix: np.ndarray, names: Sequence[str]) -> str:
    """Return a part of a sentence on a mass matrix that is not positive definite; empty if it is.

    Parameters
    ----------
    least : float
        Least eigenvalue relative to the largest one.
    matrix : (n, n) array
    names : sequence of str
        Names of the coordinates.

    Examples
    --------
    >>> describe_mass_fault(-0.5, np.diag([2.0, -1.0]), ["x", "knee"])
    "the mass matrix has a negative eigenvalue: a mass or an inertia that moves with 'knee' is negative"
    """
    if least > SINGULAR:
        return ""
    if not least < -NEGATIVE:
        massless = describe_massless(matrix, names)
        return f"the mass matrix is singular{massless}; every coordinate needs a mass or an inertia"
    shares = np.abs(np.linalg.eigh((matrix + matrix.T) / 2)[1][:, 0])
    negative = [name for name, entry in zip(names, np.diag(matrix), strict=True) if entry < 0]
    moving = negative or [name for name, share in zip(names, shares, strict=True) if share > np.max(shares) / 2]
    return (
        "the mass matrix has a negative eigenvalue: a mass or an inertia that moves with "
        f"{', '.join(map(repr, moving))} is negative"
    )


def _refuse_massless(bodies: "Sequence[Body]", q: ca.SX) -> None:
    """Raise InputError if a link has an inertia but no mass; expressions of parameters are not checked."""
    for number, body in enumerate(bodies, start=1):
        if isinstance(body, RigidLink) and _as_expression(body.mass).is_zero():
            inertia = _as_expression(body.inertia)
            if inertia.is_constant() and not inertia.is_zero():
                angle = _as_expression(body.angle)
                turning = ", ".join(repr(each.name()) for each in ca.symvar(q) if ca.depends_on(angle, each))
                raise InputError(
                    f"Body {number}{turning and f', which turns with {turning}'}: a RigidLink with an inertia of "
                    f"{float(inertia):g} kg m^2 needs a mass greater than 0 kg, got 0 kg. A rotor or flywheel without "
                    "mass is a RotorInertia(angle, inertia) among the `forces`."
                )


def _as_expression(value: ca.SX | float) -> ca.SX:
    """Return an expression; one is not copied, to save time."""
    return value if isinstance(value, ca.SX) else ca.SX(value)


Body = PointMass | RigidLink


class Mechanics:
    """Symbolic mechanics of a mechanism, expressions of (q, v, parameters) that are derived when they are first read.

    The positions of the bodies, the angles of the links and the coordinates of rotors are the entries of one vector
    r(q) with the diagonal inertia D, so that M = J^T D J with its Jacobian J.

    Parameters
    ----------
    bodies : sequence of PointMass or RigidLink
    q, v : SX, shape (n_q, 1)
        Coordinates and their rates.
    gravity : SX, shape (2, 1)
        Gravitational acceleration in the slope-fixed frame [m/s^2].
    forces : sequence of Spring, Damper, Potential or RotorInertia

    Raises
    ------
    InputError
        If a link has an inertia but no mass.

    Attributes
    ----------
    entries, inertia, gravity_accelerations : SX, shape (n_r, 1)
        The vector r, its inertia D and the acceleration of gravity of each entry.

    Examples
    --------
    >>> import casadi as ca
    >>> q, v = ca.SX.sym("q"), ca.SX.sym("v")
    >>> pendulum = Mechanics([PointMass(2.0, ca.vertcat(ca.sin(q), ca.cos(q)))], q, v, ca.vertcat(0, -9.8))
    >>> torque = ca.Function("torque", [q, v], [pendulum.require(ca.SX(3.0))])
    >>> round(float(torque(0.0, 1.0)), 9), round(float(torque(ca.pi / 2, 1.0)), 9)
    (6.0, -13.6)
    """

    def __init__(
        self, bodies: Sequence[Body], q: ca.SX, v: ca.SX, gravity: ca.SX, forces: Sequence[Force] = ()
    ) -> None:
        _refuse_massless(bodies, q)
        self._bodies, self._q, self._v, self._gravity, self._forces = tuple(bodies), q, v, gravity, tuple(forces)
        links = [body for body in bodies if isinstance(body, RigidLink)]
        rotors = [force for force in forces if isinstance(force, RotorInertia)]
        coordinates = [*(body.position for body in bodies), *(part.angle for part in links)]
        self.entries = ca.vertcat(ca.SX(0, 1), *coordinates, *(part.coordinate for part in rotors))
        masses = [mass for body in bodies for mass in (body.mass, body.mass)]
        reflected = [rotor.reflected for rotor in rotors]
        self.inertia = ca.vertcat(ca.SX(0, 1), *masses, *(link.inertia for link in links), *reflected)
        self.gravity_accelerations = ca.vertcat(*[gravity] * len(bodies), ca.SX(len(links) + len(rotors), 1))

    def require(self, acceleration: ca.SX) -> ca.SX:
        """Return the generalised forces that accelerations require, M a + h, shape (n_q, 1) [N, N m].

        The accelerations of the bodies follow from those of q by forward differentiation, body by body from the foot
        outwards, and the forces by the reverse sweep, which is the recursive Newton-Euler method: the number of
        operations grows linearly with that of the bodies, and no mass matrix is formed.

        Parameters
        ----------
        acceleration : SX, shape (n_q, 1)
            Rates of v [m/s^2, rad/s^2].
        """
        rates = ca.jtimes(self._rates, ca.vertcat(self._q, self._v), ca.vertcat(self._v, acceleration))
        forces = ca.jtimes(self.entries, self._q, self.inertia * (rates - self.gravity_accelerations), True)
        return forces + self.resistance

    def momentum_change(self, before: ca.SX, after: ca.SX) -> ca.SX:
        """Return M (w - v) for rates v and w, shape (n_q, 1), without the mass matrix, as in :meth:`require`."""
        change = ca.jtimes(self.entries, self._q, before - after)
        return -ca.jtimes(self.entries, self._q, self.inertia * change, True)

    @cached_property
    def mass_matrix(self) -> ca.SX:
        """Mass matrix M, shape (n_q, n_q)."""
        jacobian, count = ca.jacobian(self.entries, self._q), 2 * len(self._bodies)
        rows = [jacobian[k : k + 2, :] for k in range(0, count, 2)]
        rows += [jacobian[k, :] for k in range(count, jacobian.shape[0])]
        inertias = [ca.SX(body.mass) for body in self._bodies] + ca.vertsplit(self.inertia[count:])
        products = (inertia * (part.T @ part) for inertia, part in zip(inertias, rows, strict=True))
        return ca.triu2symm(ca.triu(ca.simplify(sum(products, ca.SX(*2 * self._q.shape[:1])))))

    @cached_property
    def bias(self) -> ca.SX:
        """Coriolis and gravity terms, springs and dampers h, shape (n_q, 1) [N, N m]."""
        return self.require(ca.SX(*self._q.shape))

    @cached_property
    def kinetic(self) -> ca.SX:
        """Kinetic energy [J]."""
        return ca.dot(self.inertia * self._rates, self._rates) / 2

    @cached_property
    def potential(self) -> ca.SX:
        """Potential energy, that of springs and potentials included [J]."""
        return self.elastic - ca.dot(self.inertia * self.gravity_accelerations, self.entries)

    @cached_property
    def momentum(self) -> ca.SX:
        """Linear momentum, summed over the bodies, independent of the mass matrix, shape (2, 1) [kg m/s]."""
        return ca.sum2(ca.reshape((self.inertia * self._rates)[: 2 * len(self._bodies)], 2, -1))

    @cached_property
    def angular_momentum(self) -> ca.SX:
        """Angular momentum about the origin of the frame [kg m^2/s], positive for increasing angle (clockwise)."""
        count, momenta = len(self._bodies), self.inertia * self._rates
        # Angles are clockwise from the vertical, and so is the moment: r_y p_x - r_x p_y.
        moment = sum((self._moment(momenta, k) for k in range(count)), ca.SX(0))
        links = sum(isinstance(body, RigidLink) for body in self._bodies)
        return moment + ca.sum1(momenta[2 * count : 2 * count + links])

    def _moment(self, momenta: ca.SX, number: int) -> ca.SX:
        """Return the moment of a body's linear momentum about the origin."""
        x, y = self.entries[2 * number], self.entries[2 * number + 1]
        return y * momenta[2 * number] - x * momenta[2 * number + 1]

    @cached_property
    def total_mass(self) -> ca.SX:
        """Total mass [kg]."""
        return sum((_as_expression(body.mass) for body in self._bodies[1:]), _as_expression(self._bodies[0].mass))

    @cached_property
    def elastic(self) -> ca.SX:
        """Energy of springs and potentials [J]."""
        return sum((force.energy for force in self._forces if isinstance(force, Spring | Potential)), ca.SX(0))

    @cached_property
    def dissipation(self) -> ca.SX:
        """Power dissipated by dampers [W]."""
        return sum((damper.damping * rate**2 for damper, rate in self._dampers), ca.SX(0))

    @cached_property
    def _rates(self) -> ca.SX:
        return ca.jtimes(self.entries, self._q, self._v)

    @cached_property
    def _dampers(self) -> list[tuple[Damper, ca.SX]]:
        """Dampers and the rates of their coordinates."""
        dampers = (force for force in self._forces if isinstance(force, Damper))
        return [(damper, ca.jtimes(damper.coordinate, self._q, self._v)) for damper in dampers]

    @cached_property
    def resistance(self) -> ca.SX:
        """Generalised forces required by springs, potentials and dampers, shape (n_q, 1)."""
        total = ca.SX(*self._q.shape)
        if any(isinstance(force, Spring | Potential) for force in self._forces):
            total += ca.gradient(self.elastic, self._q)
        for damper, rate in self._dampers:
            total += ca.jtimes(damper.coordinate, self._q, damper.damping * rate, True)
        return total


def derive(bodies: Sequence[Body], q: ca.SX, v: ca.SX, gravity: ca.SX, forces: Sequence[Force] = ()) -> Mechanics:
    """Return the mechanics of `bodies`; parameters as of :class:`Mechanics`."""
    return Mechanics(bodies, q, v, gravity, forces)


def body_points(bodies: Sequence[Body]) -> dict[str, ca.SX]:
    """Return the centres of mass of the bodies, which are drawn of a robot without a drawing.

    Examples
    --------
    >>> [*body_points([PointMass(1.0, ca.SX(2, 1)), PointMass(2.0, ca.SX(2, 1))])]
    ['body 1', 'body 2']
    """
    return {f"body {number}": ca.SX(body.position) for number, body in enumerate(bodies, start=1)}
