"""Points and special points of a curve of optima, and the options of its continuation."""

from enum import Enum

import attrs

from gaitopt.arguments import check_arguments
from gaitopt.continuation.optimal.kkt_point import KktLinearisation
from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.parameters import positive, whole_number


class PathKind(Enum):
    """Kind of a special point of a branch of optimal gaits; the value states what happens there."""

    ACTIVATION = "a constraint becomes active"
    DEACTIVATION = "the multiplier of a constraint vanishes and it becomes inactive"
    TURNING_POINT = "the reduced Hessian is singular and the branch turns back"

    @property
    def key(self) -> str:
        """Name for files and JSON, in lower case."""
        return self.name.lower()

    @property
    def label(self) -> str:
        """Name for tables and figures."""
        return self.key.replace("_", " ")


@check_arguments
@attrs.frozen(kw_only=True)
class PathOptions:
    """Options of the continuation of optima.  Lengths are relative to the range and to the typical unknowns.

    Attributes
    ----------
    first_step, longest_step, shortest_step : float
    largest_angle : float [rad]
        Largest angle between the tangents of consecutive points.
    most_points : int
        Largest number of points of a branch, special points included.

    Examples
    --------
    >>> PathOptions().longest_step
    0.1
    """

    first_step: float = attrs.field(default=0.02, validator=positive())
    longest_step: float = attrs.field(default=0.1, validator=positive())
    shortest_step: float = attrs.field(default=1e-9, validator=positive())
    largest_angle: float = attrs.field(default=0.5, validator=positive())
    most_points: int = attrs.field(default=5000, validator=whole_number())


@dataclass(frozen=True, eq=False)
class PathPoint:
    """A point of the curve.

    Attributes
    ----------
    optimum : KktLinearisation
    tangent : ((k,) array, float)
        Unit tangent in the direction of the continuation: of the packed vector, and of the parameter.  A point that is
        interpolated has that of the step's start.
    sampled : bool
        Whether the parameter has one of the requested values.
    """

    optimum: KktLinearisation
    tangent: tuple[Array, float]
    sampled: bool = False

    @property
    def value(self) -> float:
        """Parameter."""
        return self.optimum.point.value


@dataclass(frozen=True, eq=False)
class PathChange:
    """A special point of the curve.

    Attributes
    ----------
    kind : PathKind
    optimum : KktLinearisation
        With the active set before the change.
    width : float
        Residual of the location in the unit of the parameter.
    index : int
        Constraint that becomes active or inactive; -1 at a turning point.
    turns : bool
        Whether the parameter turns back.
    """

    kind: PathKind
    optimum: KktLinearisation
    width: float
    index: int = -1
    turns: bool = False
