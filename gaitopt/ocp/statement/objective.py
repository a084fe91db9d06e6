"""Objectives: scalars of the step that an optimal gait minimises."""

import functools
import inspect
import math
from collections.abc import Hashable
from typing import Any

import casadi as ca

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.lazy import is_evaluated
from gaitopt.locks import one_at_a_time
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.coordinate_entries import count_coordinates
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Motion
from gaitopt.ocp.statement.instant import Instant, Peak, StepBoundary, symbolic_instant
from gaitopt.ocp.statement.objective_value import value_of_term

_Names = tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]]
"""Names of the angles, actuators and parameters of a robot: all that the symbols of an objective depend on."""


class Objective:
    """A scalar of the step: an integral over time, a term of the step's boundary, a peak, or several of them.

    A custom objective is a frozen dataclass derived from this class, with a name and at least one of `integrand`,
    `boundary` and `peak`.  Objectives are added and weighted, ``0.7 * CostOfTransport() + 0.3 * TorqueRate()``.

    Attributes
    ----------
    name : str
    unit : str
        Unit of the value.
    uses_power : bool
        Whether the parts of the joint powers are needed; they are further unknowns of the NLP.
    per_weight_and_travel : bool
        Whether integral and boundary term are divided by weight times travel.
    smooth : bool
        Whether the integrand, apart from the joint powers, is smooth in time; otherwise it is integrated by
        the trapezoidal rule.  The parts of the joint powers are integrated exactly in either case.
    formula : (str, str) or None
        The objective as text and as LaTeX, for the printed problem; by default its name.
    typical : float
        Size of a typical optimum.  The solver minimises the objective divided by it, so that its tolerance is relative
        to the size of the objective.

    Examples
    --------
    >>> @dataclass(frozen=True)
    ... class HipTorque(Objective):
    ...     name, unit, smooth = "hip_torque", "N^2 m^2 s", True
    ...     def integrand(self, point):
    ...         return point.torque_of("hip") ** 2
    >>> (2 * HipTorque() + HipTorque()).name
    '2 hip_torque + hip_torque'
    """

    name: str
    unit: str = ""
    uses_power: bool = False
    per_weight_and_travel: bool = False
    smooth: bool = False
    formula: tuple[str, str] | None = None
    typical: float = 1.0

    def integrand(self, point: Instant) -> Any:
        """Return the scalar to integrate over time; 0 by default."""
        return 0.0

    def boundary(self, step: StepBoundary) -> Any:
        """Return the scalar added for the boundary of the step; 0 by default."""
        return 0.0

    def peak(self, point: Instant) -> Peak | None:
        """Return quantities whose largest value over the step is added; none by default.

        The largest value is an unknown of the NLP, bounded from below at all nodes and inner points.
        """
        return None

    def terms(self) -> "tuple[tuple[float, Objective], ...]":
        """Return the weighted objectives of which this one is the sum."""
        return ((1.0, self),)

    def evaluate(self, motion: Motion) -> float:
        """Return the value of the first step of a motion, computed from its samples alone.

        Parameters
        ----------
        motion : Motion
            Motion of an optimised gait, a replay or a simulation whose first step reached its touchdown.

        Raises
        ------
        InputError
            If the first step did not reach its touchdown, or several contacts of the robot may be on the ground.
        """
        return value_of_term(self, motion)

    def __add__(self, other: "Objective") -> "WeightedSum":
        if not isinstance(other, Objective):
            return NotImplemented
        return WeightedSum((*self.terms(), *other.terms()))

    def __mul__(self, weight: float) -> "WeightedSum":
        if isinstance(weight, bool) or not isinstance(weight, int | float) or not 0 < weight < math.inf:
            raise InputError(f"The weight of an objective must be a finite positive number, got {weight!r}.")
        return WeightedSum(tuple((weight * inner, term) for inner, term in self.terms()))

    __rmul__ = __mul__


@dataclass(frozen=True)
class WeightedSum(Objective):
    """A sum of weighted objectives.

    Attributes
    ----------
    parts : tuple of (float, Objective)

    Examples
    --------
    >>> from gaitopt import CostOfTransport, TorqueSquared
    >>> mixed = 0.7 * CostOfTransport() + 0.001 * TorqueSquared()
    >>> mixed.name, mixed.uses_power, mixed.smooth
    ('0.7 cost_of_transport + 0.001 torque_squared', True, False)
    """

    parts: tuple[tuple[float, Objective], ...]

    @property
    def name(self) -> str:  # type: ignore[override]
        """Weights and names."""
        return " + ".join(term.name if weight == 1 else f"{weight:g} {term.name}" for weight, term in self.parts)

    @property
    def unit(self) -> str:  # type: ignore[override]
        """Unit of the parts; empty if they differ."""
        units = {term.unit for _, term in self.parts}
        return units.pop() if len(units) == 1 else ""

    @property
    def uses_power(self) -> bool:  # type: ignore[override]
        """Whether any part uses the joint powers."""
        return any(term.uses_power for _, term in self.parts)

    @property
    def per_weight_and_travel(self) -> bool:  # type: ignore[override]
        """Whether any part is divided by weight times travel."""
        return any(term.per_weight_and_travel for _, term in self.parts)

    @property
    def smooth(self) -> bool:  # type: ignore[override]
        """Whether all parts are smooth."""
        return all(term.smooth for _, term in self.parts)

    @property
    def typical(self) -> float:  # type: ignore[override]
        """Sum of the typical sizes of the parts."""
        return sum(weight * term.typical for weight, term in self.parts)

    def terms(self) -> tuple[tuple[float, Objective], ...]:
        """Return the parts."""
        return self.parts

    def evaluate(self, motion: Motion) -> float:
        """Return the weighted sum of the values of the parts."""
        return sum(weight * term.evaluate(motion) for weight, term in self.parts)


def overrides(objective: Objective, method: str) -> bool:
    """Return whether an objective defines `integrand`, `boundary` or `peak`."""
    return getattr(type(objective), method) is not getattr(Objective, method)


def is_curved(objective: Objective, robot: Robot) -> bool:
    """Return whether an objective has curvature in the torques or their rates.

    Without curvature optima may not be unique, or torques switch on and off.
    """
    return _is_curved(objective, _names(robot))


@functools.lru_cache(maxsize=32)
def _is_curved(objective: Objective, names: _Names) -> bool:
    """Return whether an objective is curved for a robot with some angles, actuators and parameters."""
    point = _symbolic_instant_of(names)
    integrands = [_as_expression(term.integrand(point)) for _, term in objective.terms()]
    if any(ca.hessian(integrand, point.torque)[0].nnz() for integrand in integrands):
        return True
    torques = ca.vertcat(point.torque, point.torque_rate)
    return any(ca.hessian(integrand, torques)[0].nnz() for integrand in integrands)


def _names(robot: Robot) -> _Names:
    return robot.angles, robot.actuators, tuple([parameter.name for parameter in robot.parameters])


def _as_expression(value: Any) -> ca.SX:
    """Return an expression; one is not copied, to save time."""
    return value if isinstance(value, ca.SX) else ca.SX(value)


@functools.lru_cache(maxsize=32)
def is_linear_in_power(objective: Objective, robot: Robot, mode: Mode) -> bool:
    """Return whether an integrand is linear in the parts of the joint powers, with coefficients constant in time."""
    point = symbolic_instant(robot.angles, robot.actuators, [parameter.name for parameter in robot.parameters], mode)
    parts = ca.vertcat(point.positive, point.negative)
    names = ("q", "v", "acceleration", "torque", "torque_rate", "force", "slip_speed", "time")
    varying = ca.vertcat(parts, *(getattr(point, name) for name in names))
    return not ca.depends_on(ca.jacobian(ca.SX(objective.integrand(point)), parts), varying)


@one_at_a_time
def check_objective(objective: Objective, robot: Robot) -> None:
    """Raise InputError unless an objective is complete and its terms are scalars; errors of its methods propagate.

    Examples
    --------
    >>> from gaitopt import TorqueSquared, compass_biped
    >>> check_objective(TorqueSquared(), compass_biped())
    """
    for _, term in objective.terms():
        _check_declaration(term)
        if getattr(term, "__dict__", True):
            _check_terms(term, _names(robot))
        else:
            _check_terms_of_class(term, _names(robot))


def _check_declaration(objective: Objective) -> None:
    kind = type(objective).__name__
    if not hasattr(objective, "name"):
        raise InputError(f"The objective {kind} has no name: set the class attribute name.")
    if not isinstance(objective, Hashable):
        raise InputError(f"The objective {kind} is not hashable: make its class a frozen dataclass.")
    methods = ("integrand", "boundary", "peak")
    if not any(overrides(objective, method) for method in methods):
        raise InputError(
            f"The objective {kind} defines no integrand, boundary or peak: define integrand(self, point) in its class."
        )
    for method in methods:
        names = _list_arguments(type(objective), method)  # type: ignore[arg-type]
        if len(names) != 1:
            raise InputError(
                f"The {method} of {kind} must take one argument, got ({', '.join(names)}): write "
                f"{method}(self, {'step' if method == 'boundary' else 'point'}) and use point.torque, point.positive, "
                "point.negative and other quantities of the instant."
            )


@functools.lru_cache(maxsize=64)
def _list_arguments(kind: type, method: str) -> list[str]:
    """Return the names of the arguments of a method without the object itself."""
    unbound = inspect.getattr_static(kind, method)
    names = list(inspect.signature(getattr(kind, method)).parameters)
    return names if isinstance(unbound, staticmethod | classmethod) else names[1:]


def _check_terms(objective: Objective, names: _Names) -> None:
    kind, point = type(objective).__name__, _symbolic_instant_of(names)
    terms = {"integrand": _as_expression(objective.integrand(point))}
    if overrides(objective, "boundary"):
        terms["boundary"] = ca.SX(objective.boundary(_symbolic_boundary(names)))
    for method, value in terms.items():
        rows, columns = value.shape
        if (rows, columns) != (1, 1):
            raise InputError(
                f"The {method} of {kind} must be one number, got a table of {rows} x {columns}: sum it over the "
                "joints, for example by ca.sum1 or ca.sumsqr."
            )
    read = any(is_evaluated(point, name) for name in ("positive", "negative"))
    if not objective.uses_power and read and _contains_powers(terms["integrand"], point):
        raise InputError(f"The integrand of {kind} contains parts of the joint powers: set uses_power = True.")


def _contains_powers(integrand: ca.SX, point: Instant) -> bool:
    """Return whether an integrand contains parts of the joint powers of a symbolic instant."""
    return bool(ca.depends_on(integrand, ca.vertcat(point.positive, point.negative)))


@functools.lru_cache(maxsize=32)
def _check_terms_of_class(objective: Objective, names: _Names) -> None:
    """Check the terms of an objective without attributes, once for each class and for robots with equal names."""
    _check_terms(objective, names)


@functools.lru_cache(maxsize=32)
def _symbolic_instant_of(names: _Names) -> Instant:
    """Return a symbolic argument of `integrand`."""
    return symbolic_instant(*names)


def _symbolic_boundary(names: _Names) -> StepBoundary:
    """Return a symbolic argument of `boundary` for the check of an objective."""
    columns = {
        **dict.fromkeys(("q_first", "v_first", "q_last", "v_last", "velocity_jump"), count_coordinates(len(names[0]))),
        **{"impulse": 2, "duration": 1, "travel": 1, "energy_lost": 1},
    }
    return StepBoundary(
        parameters={name: ca.SX.sym(name) for name in names[2]},
        **{name: ca.SX.sym(name, size) for name, size in columns.items()},
    )
