"""Assembly of a robot from its symbolic description: Functions of the motion, the landing foot and the step."""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from typing import Any

import casadi as ca

from gaitopt.arguments import check_arguments, check_record
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.lazy import Deferred
from gaitopt.locks import ONE_AT_A_TIME, one_at_a_time
from gaitopt.model.contacts import accelerations
from gaitopt.model.contacts.contact import Contact, PointContact
from gaitopt.model.contacts.mode import PHYSICAL, Mode
from gaitopt.model.expression_check import check_constants, check_shapes, check_symbols, label_parts
from gaitopt.model.forces import Force
from gaitopt.model.inertias import derive_inertias
from gaitopt.model.mechanics import Body, Mechanics, body_points, derive
from gaitopt.model.robot import Coordinates, Robot


@check_record
@dataclass(frozen=True, eq=False, kw_only=True)
class StepEnd:
    """End of a step: the contact that lands, its guard, and the exchange of the legs.

    Attributes
    ----------
    landing : Contact or SX of shape (2, 1)
        The contact that lands; a position stands for a point contact.
    touchdown, armed : SX
        The step ends when `touchdown` falls through zero while `armed` > 0; only `armed` may depend on the rates `c.v`.
    exchange : sequence of SX, optional
        The angles of the next step as functions of those at touchdown (linear, invertible).  None is the identity.
    upright : SX
        Positive while the walker stands.

    Examples
    --------
    >>> angle = ca.SX.sym("angle")
    >>> StepEnd(landing=ca.vertcat(angle, 0), touchdown=1 - angle, armed=angle, upright=ca.cos(angle)).exchange is None
    True
    """

    landing: Contact | ca.SX
    touchdown: ca.SX
    armed: ca.SX
    upright: ca.SX
    exchange: Sequence[ca.SX] | None = None

    @property
    def contact(self) -> Contact:
        """The contact that lands."""
        return self.landing if isinstance(self.landing, Contact) else PointContact(ca.SX(self.landing))

    def relabel(self, coordinates: Coordinates) -> list[ca.SX]:
        """Return the angles of the next step."""
        return [*coordinates.q.elements()[2:]] if self.exchange is None else list(self.exchange)


@check_record
@dataclass(frozen=True, eq=False)
class Drawing:
    """Points and lines of a robot in figures.

    Attributes
    ----------
    points : mapping of str to SX of shape (2, 1)
        Points [m]; without a drawing, the contacts and the centres of mass of the bodies.
    links : sequence of tuples of point names
        Lines from each point of a tuple to the next one.
    stance : Contact, optional
        The stance contact, if it is not a point contact.

    Raises
    ------
    InputError
        If a link has fewer than two points.

    Examples
    --------
    >>> Drawing(links=[("hip", "heel", "toe", "hip"), ("hip", "head")]).lines
    [('hip', 'heel'), ('heel', 'toe'), ('toe', 'hip'), ('hip', 'head')]
    """

    points: Mapping[str, ca.SX] = field(default_factory=dict)
    links: Sequence[tuple[str, ...]] = ()
    stance: Contact | None = None

    def __post_init__(self) -> None:
        for chain in self.links:
            if len(chain) < 2:
                raise InputError(f"Drawing: a link needs at least two points, got {chain!r}.")

    @property
    def lines(self) -> list[tuple[str, str]]:
        """Names of the two ends of every line."""
        return [ends for chain in self.links for ends in itertools.pairwise(chain)]


@check_arguments
@one_at_a_time
def assemble(
    name: str,
    coordinates: Coordinates,
    *,
    bodies: Sequence[Body],
    step: StepEnd,
    actuators: Mapping[str, ca.SX],
    drawing: Drawing | None = None,
    forces: Sequence[Force] = (),
    description: str = "",
) -> Robot:
    """Assemble a robot from its symbolic description.

    Parameters
    ----------
    name : str
    coordinates : Coordinates
        The symbols of all expressions.
    bodies : sequence of PointMass or RigidLink
    step : StepEnd
        The contact that lands, its guard, and the exchange of the legs.
    actuators : mapping of str to SX
        The angle conjugate to the torque of each actuator [rad].
    drawing : Drawing, optional
    forces : sequence of Spring, Damper, Potential or RotorInertia
    description : str

    Returns
    -------
    Robot

    Raises
    ------
    InputError
        If the exchange is not a linear, invertible map of the angles, or an expression contains other symbols.

    Examples
    --------
    A pendulum, which does not walk (``gaitopt/model/robots/compass.py`` assembles a walker):

    >>> from gaitopt import Coordinates, Parameter, PointMass, StepEnd, assemble
    >>> c = Coordinates(["theta"], [Parameter("gravity", 9.8, "m/s^2", "gravity")])
    >>> theta = c.angle("theta")
    >>> tip = c.foot + ca.vertcat(ca.sin(theta), ca.cos(theta))
    >>> pendulum = assemble(
    ...     "pendulum", c, bodies=[PointMass(1.0, tip)], actuators={"ankle": theta},
    ...     step=StepEnd(landing=tip, touchdown=1 - theta, armed=theta, exchange=[-theta], upright=ca.cos(theta)),
    ... )
    >>> pendulum.n_q
    3
    """
    _check_parts(name, coordinates, step, drawing)
    q, v, qp, qvp = coordinates.q, coordinates.v, *_inputs(coordinates)
    relabel, guard = step.relabel(coordinates), step.touchdown
    scalars = _check_expressions(name, coordinates, (bodies, forces), step, actuators, drawing)
    contact = step.contact
    relative = ca.vertcat(*actuators.values()) if actuators else ca.SX(0, 1)
    joint = ca.jacobian(relative, q) if actuators else ca.SX(0, q.numel())
    mechanics = derive(bodies, q, v, coordinates.gravity, forces)
    jacobian = ca.jacobian(foot := contact.coordinates, q)
    if drawing is None:
        drawing = Drawing({"stance foot": coordinates.foot, **body_points(bodies), "landing foot": contact.point})
    index = {point: i for i, point in enumerate(drawing.points)}
    stance = drawing.stance or PointContact(coordinates.foot)
    return Robot(
        name=name,
        description=description,
        angles=coordinates.angles,
        actuators=tuple(actuators),
        parameters=coordinates.parameters,
        points=tuple(drawing.points),
        links=tuple((index[a], index[b]) for a, b in drawing.lines),
        inertias=derive_inertias(name, scalars, coordinates.p, coordinates.parameters),
        **_motion(coordinates, mechanics, joint),
        **_landing(coordinates, mechanics, foot, jacobian),
        **_step(coordinates, foot, jacobian, _exchange_matrix(relabel, q, name), relabel),
        touchdown=_later(
            "touchdown", qvp, lambda: {"guard": guard, "rate": ca.jtimes(guard, q, v), "armed": step.armed}
        ),
        upright=_later("upright", qp, lambda: {"upright": step.upright}),
        joint_rates=_later("joint_rates", qvp, lambda: {"rates": joint @ v}),
        figure=_later("figure", qp, lambda: {"points": ca.horzcat(*drawing.points.values())}),
        rims=_later("rims", qp, lambda: {"rims": ca.horzcat(stance.rim, contact.rim)}),
        force_powers=_later(
            "force_powers", qvp, lambda: {"elastic": mechanics.elastic, "dissipation": mechanics.dissipation}
        ),
    )


def _check_expressions(
    name: str,
    coordinates: Coordinates,
    parts: tuple[Sequence[Body], Sequence[Force]],
    step: StepEnd,
    actuators: Mapping[str, ca.SX],
    drawing: Drawing | None,
) -> dict[str, ca.SX | float]:
    """Return the scalar expressions by label; raise InputError for an invalid shape, nan, or another symbol."""
    landing = step.landing if isinstance(step.landing, Contact) else PointContact(step.landing)
    points, scalars = label_parts(*parts, {"the landing foot": landing})
    points |= {f"point {label!r}": expression for label, expression in (drawing.points if drawing else {}).items()}
    scalars |= {label: getattr(step, label) for label in ("touchdown", "armed", "upright")}
    scalars |= {f"actuator {label!r}": joint for label, joint in actuators.items()}
    check_shapes(name, points, scalars)
    angles = enumerate(step.relabel(coordinates), start=1)
    expressions = points | scalars | {f"exchanged angle {number}": angle for number, angle in angles}
    check_constants(name, expressions)
    check_symbols(name, expressions, coordinates, "c.angle(...), c.parameter(...) and c.foot")
    return scalars


def _check_parts(name: str, coordinates: Coordinates, step: StepEnd, drawing: Drawing | None) -> None:
    if not isinstance(coordinates, Coordinates):
        raise InputError(f"Robot {name!r}: coordinates must be Coordinates(angles, parameters), got {coordinates!r}.")
    if not isinstance(step, StepEnd):
        raise InputError(
            f"Robot {name!r}: step must be a StepEnd(landing=..., touchdown=..., armed=..., upright=...), got {step!r}."
        )
    if drawing is not None and not isinstance(drawing, Drawing):
        raise InputError(f"Robot {name!r}: drawing must be a Drawing(points, links), got {drawing!r}.")
    points, links = (drawing.points, drawing.lines) if drawing else ({}, ())
    for pair in links:
        for point in pair:
            if point not in points:
                raise InputError(
                    f"Robot {name!r}: a link ends at {point!r}, which is not among the points. {suggest(point, points)}"
                )


def _motion(coordinates: Coordinates, parts: Mechanics, joint: ca.SX) -> dict[str, Any]:
    """Return the Functions of motion between touchdowns; `joint` is the Jacobian of the actuators' angles."""
    u, a, qvp = ca.SX.sym("u", joint.shape[0]), ca.SX.sym("a", joint.shape[1]), _inputs(coordinates)[1]
    acceleration, wellposed = contact_functions(
        coordinates.q,
        coordinates.v,
        u,
        coordinates.p,
        lambda: (parts.mass_matrix, joint.T @ u - parts.bias),
        coordinates.parameter("friction"),
    )
    motion = {"q": coordinates.q, "v": coordinates.v, "a": a, "u": u, "p": coordinates.p}
    return {
        "acceleration": acceleration,
        "wellposed": wellposed,
        "dynamics": _later(
            "dynamics",
            qvp,
            lambda: {"mass_matrix": parts.mass_matrix, "bias": parts.bias, "actuation": joint.T},
            merge=True,
        ),
        "inverse_dynamics": _later("inverse_dynamics", motion, lambda: {"force": parts.require(a) - joint.T @ u}),
        "mass": _later("mass", {"p": coordinates.p}, lambda: {"total_mass": parts.total_mass}),
        "energy": _later("energy", qvp, lambda: {"kinetic": parts.kinetic, "potential": parts.potential}),
        "momentum": _later("momentum", qvp, lambda: {"linear": parts.momentum, "angular": parts.angular_momentum}),
    }


def _landing(coordinates: Coordinates, mechanics: Mechanics, foot: ca.SX, jacobian: ca.SX) -> dict[str, Any]:
    """Return the Functions of the landing foot, with its Jacobian, and its impact."""
    q, v, p, qvp = coordinates.q, coordinates.v, coordinates.p, _inputs(coordinates)[1]
    w, impulse = ca.SX.sym("w", q.numel()), ca.SX.sym("impulse", 2)
    impact = {"q": q, "v_minus": v, "v_plus": w, "impulse": impulse, "p": p}

    def collision() -> dict[str, ca.SX]:
        spread = accelerations.solve_symmetric(mechanics.mass_matrix, jacobian.T)
        return {"velocity": jacobian @ v, "mobility": jacobian @ spread, "spread": spread}

    def exchange() -> dict[str, ca.SX]:
        return {"residual": mechanics.momentum_change(v, w) - jacobian.T @ impulse, "foot_velocity": jacobian @ w}

    return {
        "landing": _later("landing", qvp, lambda: {"position": foot, "velocity": jacobian @ v, "jacobian": jacobian}),
        "impact": _later("impact", impact, exchange),
        "collision": _later("collision", qvp, collision, merge=True),
    }


def _step(
    coordinates: Coordinates, foot: ca.SX, jacobian: ca.SX, permutation: ca.DM, relabel: Sequence[ca.SX]
) -> dict[str, Any]:
    """Return the Functions that map a state to the coordinates of the next step, and its rates back."""
    q, v, p, w = coordinates.q, coordinates.v, coordinates.p, ca.SX.sym("w", coordinates.q.numel())

    def after() -> dict[str, ca.SX]:
        return {"q_next": ca.vertcat(foot, *relabel), "v_next": ca.vertcat(jacobian @ v, permutation @ v[2:])}

    def before() -> dict[str, ca.SX]:
        # At the landing configuration: angles first, then the velocity of the former stance foot.
        back = ca.solve(permutation, w[2:])
        return {"v": ca.vertcat(w[:2] - jacobian[:, 2:] @ back, back)}

    return {
        "swap": _later("swap", _inputs(coordinates)[1], after),
        "unswap": _later("unswap", {"q": q, "v_next": w, "p": p}, before),
    }


def _inputs(coordinates: Coordinates) -> tuple[dict[str, ca.SX], dict[str, ca.SX]]:
    """Return the named inputs (q, p) and (q, v, p) of most Functions."""
    q, v, p = coordinates.q, coordinates.v, coordinates.p
    return {"q": q, "p": p}, {"q": q, "v": v, "p": p}


def contact_functions(
    q: ca.SX, v: ca.SX, u: ca.SX, p: ca.SX, equations: Callable[[], tuple[ca.SX, ca.SX]], friction: ca.SX
) -> tuple[Mapping[Mode, ca.Function], Deferred[ca.Function]]:
    """Return the Functions `acceleration` and `wellposed` of a robot.

    Parameters
    ----------
    q, v, u, p : SX
        Inputs of the Functions.
    equations : callable
        Returns mass matrix and drive, as in :func:`gaitopt.model.contacts.accelerations.accelerations`, expressions of
        the inputs.
    friction : SX
        Coulomb coefficient.
    """

    def of(mode: Mode) -> ca.Function:
        a, f = accelerations.accelerations(mode, *equations(), friction)
        label = "acceleration_" + mode.name.lower()
        return _function(label, {"q": q, "v": v, "u": u, "p": p}, {"acceleration": a, "force": f}, merge=True)

    return PerMode(of), _later(
        "wellposed",
        {"q": q, "p": p},
        lambda: {"share": accelerations.sliding_inertia(equations()[0], friction)},
        merge=True,
    )


class PerMode(Mapping[Mode, ca.Function]):
    """The Functions of the physical contact modes, each built at its first use."""

    def __init__(self, make: Callable[[Mode], ca.Function]) -> None:
        self._make, self._made = make, dict[Mode, ca.Function]()

    def __getitem__(self, mode: Mode) -> ca.Function:
        if mode not in PHYSICAL:
            raise KeyError(mode)
        with ONE_AT_A_TIME:
            if mode not in self._made:
                self._made[mode] = self._make(mode)
            return self._made[mode]

    def __iter__(self) -> Iterator[Mode]:
        return iter(PHYSICAL)

    def __len__(self) -> int:
        return len(PHYSICAL)

    def __reduce__(self) -> tuple[type, tuple[dict[Mode, ca.Function]]]:
        return dict, (dict(self),)  # Functions can be pickled, expressions cannot


def _later(
    label: str, inputs: dict[str, ca.SX], outputs: Callable[[], dict[str, ca.SX]], *, merge: bool = False
) -> Deferred[ca.Function]:
    """Return a Function that is built at its first use: most programs need few Functions of a robot."""
    return Deferred(lambda: _function(label, inputs, outputs(), merge=merge))


def _function(label: str, inputs: dict[str, ca.SX], outputs: dict[str, ca.SX], *, merge: bool = False) -> ca.Function:
    """Return a Function; common subexpressions are merged if it is evaluated often, as in a simulation."""
    expressions = [_densify(e) for e in outputs.values()]
    if merge:
        expressions = ca.cse(expressions)
    return ca.Function(label, list(inputs.values()), expressions, list(inputs), list(outputs))


def _densify(expression: ca.SX | float) -> ca.SX:
    """Return a dense expression; one that is dense already is not copied, which would take longer than to build it."""
    matrix = expression if isinstance(expression, ca.SX) else ca.SX(expression)
    return matrix if matrix.is_dense() else ca.densify(matrix)


def _exchange_matrix(relabel: Sequence[ca.SX], q: ca.SX, name: str) -> ca.DM:
    """Return the constant matrix of the leg exchange on the angles' rates."""
    matrix = ca.jacobian(ca.vertcat(*relabel), q[2:])
    if not matrix.is_constant() or matrix.shape[0] != matrix.shape[1]:
        raise InputError(
            f"Robot {name!r}: the exchanged angles must be linear functions of the angles, one for each angle."
        )
    constant = ca.DM(matrix)
    if abs(float(ca.det(constant))) < 1e-12:
        raise InputError(f"Robot {name!r}: the exchange of the angles must be invertible, but it is singular.")
    return constant
