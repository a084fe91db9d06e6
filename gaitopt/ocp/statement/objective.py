"""What an optimal gait makes small."""

from abc import ABC, abstractmethod
from collections.abc import Hashable
from dataclasses import dataclass

import casadi as ca

from gaitopt.errors import InputError, suggest
from gaitopt.parameters import Parameter


class Objective(ABC):
    """An integral over the step, optionally per weight and travel.

    To add one, derive from this class and register its name in ``OBJECTIVES``.  Joint power enters through its exact
    split P = positive - negative with both parts >= 0, so that absolute values stay smooth.
    """

    name: str
    uses_power: bool
    per_weight_and_travel: bool
    typical: float = 1.0
    """Size of a typical optimum; the solver is given the objective divided by it, so that its tolerance means as much
    for a small cost of transport as for a large sum of squares."""
    unit: str = ""
    """Unit of the objective for tables, ``"1"`` for a pure number; empty if it is not stated."""
    smooth: bool
    """Whether the integrand is smooth in time; where it has kinks, it is integrated by trapezoids."""

    @abstractmethod
    def integrand(self, torque: ca.SX, positive: ca.SX, negative: ca.SX) -> ca.SX:
        """Return the scalar to integrate over time.

        Parameters
        ----------
        torque : SX, shape (n_u, 1) [N m]
        positive, negative : SX, shape (n_u, 1) [W]
            Parts of the joint powers; empty unless `uses_power`.
        """


@dataclass(frozen=True)
class CostOfTransport(Objective):
    """Integral of the absolute joint powers over weight times travel (dimensionless).

    Examples
    --------
    >>> CostOfTransport().name
    'cost_of_transport'
    """

    name = "cost_of_transport"
    unit = "1"
    uses_power = True
    per_weight_and_travel = True
    typical = 0.01
    smooth = False

    def integrand(self, torque: ca.SX, positive: ca.SX, negative: ca.SX) -> ca.SX:
        """Return the sum of absolute powers [W]."""
        return ca.sum1(positive) + ca.sum1(negative)


@dataclass(frozen=True)
class PositiveWork(Objective):
    """Integral of the positive joint powers, less what braking gives back, over weight times travel (dimensionless).

    Attributes
    ----------
    regeneration : float
        Share of the negative work that is stored and used again, from 0 to less than 1.

    Raises
    ------
    InputError
        If `regeneration` is not in [0, 1): at 1 power could be shuffled to and fro for nothing.

    Examples
    --------
    >>> PositiveWork(regeneration=0.5).name
    'positive_work'
    """

    regeneration: float = 0.0

    name = "positive_work"
    unit = "1"
    uses_power = True
    per_weight_and_travel = True
    typical = 0.01
    smooth = False

    def __post_init__(self) -> None:
        share = Parameter("regeneration", 0.0, "1", "", lower=0.0, upper=0.999).check(self.regeneration)
        object.__setattr__(self, "regeneration", share)

    def integrand(self, torque: ca.SX, positive: ca.SX, negative: ca.SX) -> ca.SX:
        """Return the sum of positive powers less the share of the negative ones that is regenerated [W]."""
        return ca.sum1(positive) - self.regeneration * ca.sum1(negative)


@dataclass(frozen=True)
class TorqueSquared(Objective):
    """Integral of the sum of squared torques [N^2 m^2 s].

    Examples
    --------
    >>> TorqueSquared().uses_power
    False
    """

    name = "torque_squared"
    unit = "N^2 m^2 s"
    uses_power = False
    per_weight_and_travel = False
    smooth = True

    def integrand(self, torque: ca.SX, positive: ca.SX, negative: ca.SX) -> ca.SX:
        """Return the sum of squared torques [N^2 m^2]."""
        return ca.sumsqr(torque)


OBJECTIVES: dict[str, type[Objective]] = {
    objective.name: objective for objective in (CostOfTransport, TorqueSquared, PositiveWork)
}


def objective_named(name: "str | Objective") -> Objective:
    """Return an objective from its name.

    Raises
    ------
    InputError
        If the name is unknown; the message names the nearest.

    Examples
    --------
    >>> objective_named("torque_squared")
    TorqueSquared()
    """
    if isinstance(name, Objective):
        return name
    if name not in OBJECTIVES:
        raise InputError(f"There is no objective {name!r}. {suggest(str(name), OBJECTIVES)}")
    return OBJECTIVES[name]()


def check_objective(objective: Objective, n_u: int) -> None:
    """Raise InputError unless an objective has what it needs and integrates one number; its own errors come through.

    Examples
    --------
    >>> check_objective(TorqueSquared(), 2)
    """
    kind = type(objective).__name__
    missing = [
        name for name in ("name", "uses_power", "per_weight_and_travel", "smooth") if not hasattr(objective, name)
    ]
    if missing:
        raise InputError(f"The objective {kind} does not say its {', '.join(missing)}: set it in the class.")
    if not isinstance(objective, Hashable):
        raise InputError(f"The objective {kind} cannot be told from others: make its class a frozen dataclass.")
    torque = ca.SX.sym("torque", n_u)
    positive, negative = (ca.SX.sym(part, n_u if objective.uses_power else 0) for part in ("positive", "negative"))
    rows, columns = ca.SX(objective.integrand(torque, positive, negative)).shape
    if (rows, columns) != (1, 1):
        raise InputError(
            f"The integrand of {kind} must be one number, it is a table of {rows} x {columns}: sum it over the joints, "
            "for example by ca.sum1 or ca.sumsqr."
        )
