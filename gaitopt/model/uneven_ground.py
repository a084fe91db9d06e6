"""Robots on uneven ground, whose height and inclination differ between the stance foot and the landing foot.

The coordinates of the stance foot are those along and across the ground below it, so the contact modes and the friction
cones are those of the inclined ground.  The angles are measured as on the plane.
"""

import functools
from collections.abc import Callable

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError
from gaitopt.lazy import Deferred
from gaitopt.model.assembly import contact_functions
from gaitopt.model.coordinate_entries import CONTACT, GAP, SLIDE
from gaitopt.model.ground import GROUND
from gaitopt.model.ground_frame import INCLINE, NEXT_INCLINE, RISE
from gaitopt.model.robot import Robot
from gaitopt.model.step_check import exempt_from_step_check, require_valid_step
from gaitopt.parameters import Parameter

STEEPEST = 1.0
"""Largest inclination of the ground relative to the plane [rad]."""

PASSED = 0.05
"""Least distance of the landing foot ahead of the stance foot at a touchdown [m].

Where straight legs pass each other, the swing foot passes through the height of the stance foot.
"""

UNEVEN = (
    Parameter(RISE, 0.0, "m", "height of the next foothold's ground, extended to the stance foot, above this foot"),
    Parameter(INCLINE, 0.0, "rad", "inclination of the ground, uphill positive", lower=-STEEPEST, upper=STEEPEST),
    Parameter(NEXT_INCLINE, 0.0, "rad", "inclination at the next foothold", lower=-STEEPEST, upper=STEEPEST),
)
"""Parameters of uneven ground, before those of the ground in the parameter vector."""


def is_on_uneven_ground(robot: Robot) -> bool:
    """Return whether a robot has the parameters of uneven ground.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> is_on_uneven_ground(compass_biped()), is_on_uneven_ground(adapt_to_uneven_ground(compass_biped()))
    (False, True)
    """
    return any(parameter.name == RISE for parameter in robot.parameters)


def height_of_footprints(robot: Robot, p: ca.SX, ahead: ca.SX, distance: ca.SX) -> ca.SX:
    """Return the height of the line through the footprints of stance and landing foot, relative to the stance foot.

    Parameters
    ----------
    robot : Robot
    p : SX or (n_p,) array
        Parameter vector.
    ahead, distance : SX or float [m]
        Distance ahead of the stance foot, and the distance between the feet at touchdown.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> robot = adapt_to_uneven_ground(compass_biped())
    >>> height_of_footprints(robot, robot.vector(robot.resolve({"rise": 0.1})), 0.25, 0.5).item()
    0.05
    """
    if not is_on_uneven_ground(robot):
        return 0.0 * ahead
    return (p[robot.index(RISE)] / distance + ca.tan(p[robot.index(NEXT_INCLINE)])) * ahead


def travel_of_slides(robot: Robot, p: ca.SX, slide: ca.SX) -> ca.SX:
    """Return the distance along the plane by which the stance foot slides along the ground [m].

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> travel_of_slides(compass_biped(), None, 0.1)
    0.1
    """
    return slide * ca.cos(p[robot.index(INCLINE)]) if is_on_uneven_ground(robot) else slide


@check_arguments
def adapt_to_uneven_ground(robot: Robot) -> Robot:
    """Return a robot with the height and the inclination of the ground at its footholds as parameters.

    The added parameters are ``rise`` [m], the height of the ground of the next foothold above the stance foot;
    ``incline`` [rad], the inclination of the ground at the stance foot relative to the plane, uphill positive; and
    ``next_incline`` [rad], that of the ground at the next foothold.  The ground of the next foothold is extended to the
    stance foot, where `rise` is measured.  With ``rise`` alone, the steps of a periodic gait are those of stairs.
    Potential energy, positions and travel are those of the plane.  The touchdown is armed as on level ground, but not
    before the landing foot is 5 cm ahead of the stance foot.

    Parameters
    ----------
    robot : Robot
        A walker with point feet.

    Returns
    -------
    Robot
        The same object for the same robot.

    Raises
    ------
    InputError
        If the feet are round, or the leg exchange of the robot is invalid.

    Examples
    --------
    >>> from gaitopt import compass_biped
    >>> robot = adapt_to_uneven_ground(compass_biped())
    >>> p = robot.vector(robot.resolve({"rise": 0.02}))
    >>> float(robot.touchdown([0, 0, 0.1, 0.1], [0] * 4, p)[0])
    -0.02
    """
    if not isinstance(robot, Robot):
        raise InputError(f"robot must be a Robot such as compass_biped(), got {robot!r}.")
    return robot if is_on_uneven_ground(robot) else _adapt(robot)


@functools.lru_cache(maxsize=32)
def _adapt(robot: Robot) -> Robot:
    names = {parameter.name for parameter in robot.parameters}
    if names & {INCLINE, NEXT_INCLINE}:
        raise InputError(
            f"Robot {robot.name!r} must not have parameters named {INCLINE!r} or {NEXT_INCLINE!r}: these names are "
            "reserved for the inclinations of the ground."
        )
    if not robot.rims(ca.SX.sym("q", robot.n_q), ca.SX.sym("p", len(robot.parameters)))[2, :].is_zero():
        raise InputError(f"Robot {robot.name!r} has round feet; uneven ground is accepted for point feet only.")
    require_valid_step(robot)
    count = len(robot.parameters) - len(GROUND)
    parameters = (*robot.parameters[:count], *UNEVEN, *robot.parameters[count:])
    inclined = _InclinedFunctions(robot, tuple(parameter.name for parameter in parameters))
    adapted = robot.replace_fields(
        description=f"{robot.description}, on uneven ground", parameters=parameters, **inclined.functions()
    )
    return exempt_from_step_check(adapted)


class _InclinedFunctions:
    """The Functions of a robot in the coordinates of its stance foot along and across inclined ground.

    With R(b) = [[cos b, -sin b], [sin b, cos b]], the stance foot is at R(incline) (s, n) in the plane's coordinates,
    and the rates transform in the same way: T = diag(R, 1) is orthogonal.
    """

    def __init__(self, robot: Robot, names: tuple[str, ...]) -> None:
        self.robot, self.names = robot, names
        n, size = robot.n_q, len(names)
        symbols = {"q": n, "v": n, "a": n, "u": robot.n_u, "p": size, "v_minus": n, "v_plus": n, "v_next": n}
        self.symbols = {name: ca.SX.sym(name, rows) for name, rows in (symbols | {"impulse": 2, "q_before": n}).items()}
        p = self.symbols["p"]
        self.rise, incline, next_incline = (p[names.index(name)] for name in (RISE, INCLINE, NEXT_INCLINE))
        self.parameters = p[[names.index(parameter.name) for parameter in robot.parameters]]
        self.rotation, self.next_rotation = stance_rotation(incline), stance_rotation(next_incline)
        self.grade = ca.tan(next_incline)
        self.transform = ca.diagcat(self.rotation, ca.SX.eye(n - 2))
        self.next_transform = ca.diagcat(self.next_rotation, ca.SX.eye(n - 2))

    def plane(self, name: str) -> ca.SX:
        """Return coordinates, rates or accelerations along the plane."""
        return self.transform @ self.symbols[name]

    def functions(self) -> dict[str, object]:
        """Return the Functions of the robot that depend on its coordinates or parameters."""
        deferred = {
            "dynamics": ("qvp", self._dynamics),
            "inverse_dynamics": ("qvaup", self._inverse_dynamics),
            "landing": ("qvp", self._landing),
            "collision": ("qvp", self._collision),
            "touchdown": ("qvp", self._touchdown),
            "momentum": ("qvp", self._momentum),
            "swap": ("qvp", self._swap),
        }
        named: dict[str, object] = {
            name: self._later(name, list(inputs), outputs) for name, (inputs, outputs) in deferred.items()
        }
        inertias = [] if self.robot.inertias is None else ["inertias"]
        for name in ("mass", "energy", "upright", "joint_rates", "figure", "rims", "force_powers", *inertias):
            inputs = getattr(self.robot, name).name_in()
            named[name] = self._later(name, inputs, functools.partial(self._compose, name, inputs))
        named["impact"] = self._later("impact", ["q", "v_minus", "v_plus", "impulse", "p"], self._impact)
        named["unswap"] = self._later("unswap", ["q_before", "v_next", "p"], self._unswap)
        q, v, u, p = (self.symbols[name] for name in "qvup")
        friction = p[self.names.index("friction")]
        named["acceleration"], named["wellposed"] = contact_functions(q, v, u, p, self._equations, friction)
        return named

    def _later(self, name: str, inputs: list[str], outputs: Callable[[], list[ca.SX]]) -> Deferred[ca.Function]:
        original = getattr(self.robot, name)
        symbols = [self.symbols[each] for each in (["q_before", *inputs[1:]] if name == "unswap" else inputs)]

        def build() -> ca.Function:
            expressions = ca.cse([ca.densify(ca.SX(output)) for output in outputs()])
            return ca.Function(name, symbols, expressions, original.name_in(), original.name_out())

        return Deferred(build)

    def _compose(self, name: str, inputs: list[str]) -> list[ca.SX]:
        """Return the outputs of a Function whose values do not depend on the coordinates of the stance foot."""
        values = [self.parameters if each == "p" else self.plane(each) for each in inputs]
        return list(getattr(self.robot, name).call(values))

    def _equations(self) -> tuple[ca.SX, ca.SX]:
        mass_matrix, bias, actuation = self._dynamics()
        return mass_matrix, actuation @ self.symbols["u"] - bias

    def _dynamics(self) -> list[ca.SX]:
        mass_matrix, bias, actuation = self.robot.dynamics(self.plane("q"), self.plane("v"), self.parameters)
        transposed = self.transform.T
        return [transposed @ mass_matrix @ self.transform, transposed @ bias, transposed @ actuation]

    def _inverse_dynamics(self) -> list[ca.SX]:
        motion = [self.plane("q"), self.plane("v"), self.plane("a"), self.symbols["u"], self.parameters]
        return [self.transform.T @ self.robot.inverse_dynamics(*motion)]

    def _foot(self) -> tuple[ca.SX, ca.SX, ca.SX]:
        """Return position, velocity and Jacobian of the landing foot along and across the plane."""
        position, velocity, jacobian = self.robot.landing(self.plane("q"), self.plane("v"), self.parameters)
        return position, velocity, jacobian @ self.transform

    def _landing(self) -> list[ca.SX]:
        return list(self._foot())

    def _collision(self) -> list[ca.SX]:
        velocity, mobility, spread = self.robot.collision(self.plane("q"), self.plane("v"), self.parameters)
        rotation = self.next_rotation
        return [rotation.T @ velocity, rotation.T @ mobility @ rotation, self.transform.T @ spread @ rotation]

    def _touchdown(self) -> list[ca.SX]:
        q, v = self.plane("q"), self.plane("v")
        position, velocity, _ = self._foot()
        ahead, speed = position - q[CONTACT], velocity - v[CONTACT]
        guard = ahead[GAP] - self.rise - self.grade * ahead[SLIDE]
        armed = self.robot.touchdown(q, v, self.parameters)[2]
        return [guard, speed[GAP] - self.grade * speed[SLIDE], ca.fmin(armed, ahead[SLIDE] - PASSED)]

    def _momentum(self) -> list[ca.SX]:
        linear, angular = self.robot.momentum(self.plane("q"), self.plane("v"), self.parameters)
        return [self.rotation.T @ linear, angular]

    def _impact(self) -> list[ca.SX]:
        impulse = self.next_rotation @ self.symbols["impulse"]
        rates = self.plane("v_minus"), self.plane("v_plus")
        residual, velocity = self.robot.impact(self.plane("q"), *rates, impulse, self.parameters)
        return [self.transform.T @ residual, self.next_rotation.T @ velocity]

    def _swap(self) -> list[ca.SX]:
        following = self.robot.swap(self.plane("q"), self.plane("v"), self.parameters)
        return [self.next_transform.T @ part for part in following]

    def _unswap(self) -> list[ca.SX]:
        q, following = self.plane("q_before"), self.next_transform @ self.symbols["v_next"]
        return [self.transform.T @ self.robot.unswap(q, following, self.parameters)]


def stance_rotation(angle: ca.SX) -> ca.SX:
    """Return the matrix from coordinates along and across inclined ground to those of the plane, shape (2, 2)."""
    return ca.vertcat(ca.horzcat(ca.cos(angle), -ca.sin(angle)), ca.horzcat(ca.sin(angle), ca.cos(angle)))
