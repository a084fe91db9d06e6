"""Certificate of an optimum: second-order conditions, nearest constraints, and sensitivities of the cost."""

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest

VERDICTS = {
    "sharp": "strict local minimum: the cost increases at first order in every admissible direction",
    "strict": "strict local minimum: the reduced Hessian is positive definite",
    "undecided": "local minimum not certified: the cost is flat to second order in some direction",
    "saddle": "not a local minimum: the cost decreases at second order in some direction",
}
"""Sentence of each verdict."""


@dataclass(frozen=True)
class NearConstraint:
    """An inactive inequality that is close to its bound.

    Attributes
    ----------
    place : str
        Phase and node, such as ``"phase 2 (stick), node 7"``.
    name : str
        Constraint or unknown.
    distance : float
        Distance from its bound, in scaled units.

    Examples
    --------
    >>> print(NearConstraint("touchdown", "impact friction cone", 2e-5))
    impact friction cone at touchdown is 2.0e-05 from its bound
    """

    place: str
    name: str
    distance: float

    def __str__(self) -> str:
        return f"{self.name} at {self.place} is {self.distance:.1e} from its bound"


@dataclass(frozen=True)
class Sensitivity:
    """Effect of a parameter, target, limit or margin of the problem on the optimal objective.

    Attributes
    ----------
    name : str
        Parameter, target, limit or margin.
    value : float
        Its value (SI units).
    derivative : float
        Derivative of the optimal objective, in the unit of the objective per SI unit.

    Examples
    --------
    >>> Sensitivity("friction", 0.14, -0.05).change(0.01) < 0
    True
    """

    name: str
    value: float
    derivative: float

    def change(self, share: float) -> float:
        """Return the change of the objective, to first order, for a relative increase of the value."""
        return self.derivative * abs(self.value) * share


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """Certificate of an optimum on its grid.

    Attributes
    ----------
    verdict : str
        A key of `VERDICTS`.
    active, weak : int
        Number of active inequalities, and of those whose multiplier is zero.
    dependent : int
        Number of active constraints whose gradients depend on those of the others; 0 if the linear independence
        constraint qualification (LICQ) is satisfied.  While a joint is at rest or its torque is zero, the equations
        that split its power are linearly dependent.
    free_directions : int
        Dimension of the null space of the strongly active constraints.
    curvature : float
        Least eigenvalue of the reduced Hessian of the scaled objective, unknowns in typical sizes; nan if
        there are no free directions.
    nearest : tuple of NearConstraint
        Inactive inequalities that are nearest to their bounds, one for each name in each phase.
    sensitivities : tuple of Sensitivity
        Derivatives of the optimal objective with respect to the parameters, targets, limits and margins that affect it,
        in order of decreasing relative effect.  They are the derivatives of the Lagrangian (envelope theorem).

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, compass_biped, solve
    >>> gait = solve(GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared"))
    >>> gait.certificate.verdict, gait.certificate.derivative_of("speed") > 0
    ('strict', True)
    """

    verdict: str
    active: int
    weak: int
    dependent: int
    free_directions: int
    curvature: float
    nearest: tuple[NearConstraint, ...] = ()
    sensitivities: tuple[Sensitivity, ...] = ()

    @property
    def strict(self) -> bool:
        """Whether the optimum is a strict local minimum."""
        return self.verdict in ("sharp", "strict")

    def derivative_of(self, name: str) -> float:
        """Return the derivative of the optimal objective with respect to a parameter, target, limit or margin.

        Raises
        ------
        InputError
            If there is none of this name, or it does not affect the optimum.
        """
        derivatives = {one.name: one.derivative for one in self.sensitivities}
        if name not in derivatives:
            raise InputError(f"The optimal cost does not depend on {name!r}. {suggest(name, derivatives)}")
        return derivatives[name]

    @property
    def sentence(self) -> str:
        """The verdict as a sentence."""
        return VERDICTS[self.verdict]
