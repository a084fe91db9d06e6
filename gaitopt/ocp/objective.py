"""What an optimal gait makes small."""

from abc import ABC, abstractmethod
from dataclasses import dataclass

import casadi as ca

from gaitopt.errors import InputError, suggest

SMOOTH = (1 / 6, 4 / 6, 1 / 6)
"""Simpson's rule, exact for the square of a linear torque."""

KINKED = (1 / 4, 2 / 4, 1 / 4)
"""Trapezoids on both halves: never below the integral of a kink, so the optimiser cannot hide work in one."""


class Objective(ABC):
    """An integral over the step, optionally per weight and travel.

    To add one, derive from this class and register its name in ``OBJECTIVES``.  Joint power enters through its exact
    split P = positive - negative with both parts >= 0, so that absolute values stay smooth.
    """

    name: str
    uses_power: bool
    per_weight_and_travel: bool
    quadrature: tuple[float, float, float]
    """Weights of an interval's start, middle and end."""

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
    uses_power = True
    per_weight_and_travel = True
    quadrature = KINKED

    def integrand(self, torque: ca.SX, positive: ca.SX, negative: ca.SX) -> ca.SX:
        """Return the sum of absolute powers [W]."""
        return ca.sum1(positive) + ca.sum1(negative)


@dataclass(frozen=True)
class PositiveWork(Objective):
    """Integral of the positive parts of the joint powers over weight times travel (dimensionless).

    Examples
    --------
    >>> PositiveWork().uses_power
    True
    """

    name = "positive_work"
    uses_power = True
    per_weight_and_travel = True
    quadrature = KINKED

    def integrand(self, torque: ca.SX, positive: ca.SX, negative: ca.SX) -> ca.SX:
        """Return the sum of positive powers [W]."""
        return ca.sum1(positive)


@dataclass(frozen=True)
class TorqueSquared(Objective):
    """Integral of the sum of squared torques [N^2 m^2 s].

    Examples
    --------
    >>> TorqueSquared().uses_power
    False
    """

    name = "torque_squared"
    uses_power = False
    per_weight_and_travel = False
    quadrature = SMOOTH

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
