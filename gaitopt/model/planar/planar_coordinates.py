"""The symbols of a planar robot in coordinates of the user's choice."""

from collections.abc import Sequence

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.errors import InputError, suggest
from gaitopt.model.robot import add_ground
from gaitopt.parameters import Parameter

GRAVITY = Parameter("gravity", 9.81, "m/s^2", "gravitational acceleration", lower=0.0, lower_open=True)

DEFAULT_TRAVEL = "x"
"""Name of the coordinate along the ground, unless another one is stated."""


@check_arguments
class PlanarCoordinates:
    """The symbols of a planar robot's expressions: coordinates q, rates v, and parameters by name.

    Parameters
    ----------
    names : sequence of str
        Names of the coordinates, lengths [m] or angles [rad], for example of a floating base and of joints.
    parameters : sequence of Parameter, optional
        Parameters of the robot, ``gravity`` among them; by default only ``gravity``, 9.81 m/s^2.  Those of the ground
        are added.
    travel : str, optional
        Coordinate along the ground, by which the whole robot moves forward and on which nothing else depends; by
        default ``"x"``, if there is a coordinate of this name.  A robot without such a coordinate moves vertically.

    Raises
    ------
    InputError
        If names are not unique, or `travel` is not one of them.

    Examples
    --------
    >>> c = PlanarCoordinates(["x", "y", "angle"])
    >>> c.coordinate("angle"), c.q.shape, c.parameters[0].default
    (SX(angle), (3, 1), 9.81)
    """

    def __init__(
        self, names: Sequence[str], parameters: Sequence[Parameter] = (GRAVITY,), *, travel: str | None = None
    ) -> None:
        self.names, self.parameters = tuple(names), add_ground(parameters)
        if not self.names or len(set(self.names)) != len(self.names):
            raise InputError(f"Coordinates must have different names, got {list(names)}.")
        if travel is not None and travel not in self.names:
            raise InputError(f"travel: there is no coordinate {travel!r}. {suggest(travel, self.names)}")
        self.travel = travel or (DEFAULT_TRAVEL if DEFAULT_TRAVEL in self.names else None)
        self.q = ca.vertcat(*[ca.SX.sym(name) for name in self.names])
        self.v = ca.vertcat(*[ca.SX.sym(f"{name}_rate") for name in self.names])
        self.p = ca.vertcat(*[ca.SX.sym(parameter.name) for parameter in self.parameters])

    @property
    def gravity(self) -> ca.SX:
        """Acceleration of gravity along and across the slope, SX of shape (2, 1) [m/s^2]."""
        slope = self.parameter("slope")
        return self.parameter("gravity") * ca.vertcat(ca.sin(slope), -ca.cos(slope))

    def coordinate(self, name: str) -> ca.SX:
        """Return the symbol of a coordinate [m or rad]."""
        return self.q[_place(name, self.names, "coordinate")]

    def rate(self, name: str) -> ca.SX:
        """Return the symbol of a coordinate's rate [m/s or rad/s]."""
        return self.v[_place(name, self.names, "coordinate")]

    def parameter(self, name: str) -> ca.SX:
        """Return the symbol of a parameter."""
        return self.p[_place(name, [parameter.name for parameter in self.parameters], "parameter")]


def _place(name: str, names: Sequence[str], kind: str) -> int:
    if name not in names:
        raise InputError(f"There is no {kind} {name!r}. {suggest(name, names)}")
    return list(names).index(name)
