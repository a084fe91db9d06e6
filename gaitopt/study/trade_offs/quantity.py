"""Quantities of a trade-off: how each is evaluated for a gait, bounded and optimised."""

import math
from collections.abc import Callable
from typing import Any

from attrs import evolve

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, suggest
from gaitopt.motion.planar_gait import AnyGait, PlanarGait
from gaitopt.ocp.multicontact.planar_problem import PlanarProblem
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.statement.criteria import PeakFrictionDemand, PeakTorque
from gaitopt.ocp.statement.instant import StepBoundary
from gaitopt.ocp.statement.objective import Objective
from gaitopt.ocp.statement.stability_bound import StabilityBound
from gaitopt.study.gait_metrics import peak_torques
from gaitopt.study.planar_metrics import largest_foot_ratio
from gaitopt.study.stability_metrics import measure_radius, measure_recovered_push

COST = "cost"
"""Name of the objective of the problem."""

LARGEST_SPEED = 1e3
"""Upper bound of the speed if the problem states none [m/s]."""

AnyProblem = GaitProblem | PlanarProblem


@dataclass(frozen=True)
class Quantity:
    """A quantity of a gait that is to be small or large.

    Attributes
    ----------
    name : str
    unit : str
        ``"1"`` if it is dimensionless.
    meaning : str
    sign : int
        1 if small values are better, -1 if large ones are.
    read : callable
        Returns the value of a gait.
    restrict : callable or None
        Returns a problem with a bound on the quantity; None if the quantity is only measured.
    extreme : Objective or None
        Objective whose optimum has the best value of the quantity; without one, a bound needs a stated range.
    require : callable or None
        Raises an InputError if the quantity of a problem cannot be bounded.

    Examples
    --------
    >>> quantity_named("speed").sign
    -1
    """

    name: str
    unit: str
    meaning: str
    sign: int
    read: Callable[[Any], float]
    restrict: Callable[[Any, float], Any] | None = None
    extreme: Objective | None = None
    require: Callable[[Any], None] | None = None


@dataclass(frozen=True)
class TimePerDistance(Objective):
    """Time per distance, the inverse of the speed [s/m].

    Examples
    --------
    >>> TimePerDistance().unit
    's/m'
    """

    name = "time_per_distance"
    unit = "s/m"
    smooth = True

    def boundary(self, step: StepBoundary) -> Any:
        """Return the duration over the travel [s/m]."""
        return step.duration / step.travel


def quantity_named(name: str) -> Quantity:
    """Return a quantity from its name.

    Raises
    ------
    InputError
        If the name is unknown; the message names the nearest.

    Examples
    --------
    >>> quantity_named("peak_torque").unit
    'N m'
    """
    if name not in QUANTITIES:
        raise InputError(f"There is no quantity {name!r} for a trade-off. {suggest(str(name), QUANTITIES)}")
    return QUANTITIES[name]


def restrict_torque(problem: AnyProblem, value: float) -> AnyProblem:
    """Return a problem in which every torque is at most a value [N m], or its own limit if that is smaller."""
    actuators = problem.robot.actuators
    limits = dict(zip(actuators, problem.limits.torques(actuators), strict=True))
    changed: Any = evolve(problem.limits, torque={name: min(limit, value) for name, limit in limits.items()})
    return problem.replace(limits=changed)


def require_stick(problem: AnyProblem) -> None:
    """Raise an InputError if the ratio of tangential to normal force of a problem cannot be bounded.

    Raises
    ------
    InputError
        If the friction is infinite, or the sequence contains slip, during which the ratio equals the friction.
    """
    if math.isinf(problem.friction):
        raise InputError("A bound on peak_friction_demand requires a finite friction coefficient, got inf.")
    if isinstance(problem, GaitProblem):
        modes = list(problem.sequence.phases)
    else:
        modes = [mode for phase in problem.sequence.phases for _, mode in phase]
    if any(mode.slips for mode in modes):
        raise InputError(
            f"A bound on peak_friction_demand requires a sequence without slip, got '{problem.sequence}': "
            "while a foot slides, the demand equals the friction coefficient."
        )


def restrict_friction_demand(problem: AnyProblem, value: float) -> AnyProblem:
    """Return a problem in which the ratio of tangential to normal force is at most a value while the foot sticks."""
    require_stick(problem)
    margin = max(problem.margins.cone, 1 - value / problem.friction)
    return problem.replace(margins=evolve(problem.margins, cone=min(margin, 0.99)))


def restrict_speed(problem: AnyProblem, value: float) -> AnyProblem:
    """Return a problem with an average speed of at least a value [m/s]."""
    stated = problem.speed_range
    upper = stated.upper if math.isfinite(stated.upper) and stated.upper > stated.lower else LARGEST_SPEED
    return problem.replace(speed=(min(max(value, stated.lower), upper), upper))


def require_travel(problem: AnyProblem) -> None:
    """Raise an InputError if the robot of a problem does not travel, so that its speed cannot be bounded."""
    if isinstance(problem, PlanarProblem) and problem.robot.travel is None:
        raise InputError(f"Robot {problem.robot.name!r} does not travel; its speed cannot be bounded.")


def require_single_foot(problem: AnyProblem) -> None:
    """Raise an InputError if the spectral radius of the gaits of a problem can only be measured."""
    if isinstance(problem, PlanarProblem):
        raise InputError(
            "The spectral radius is bounded for robots with one foot on the ground at a time; for a PlanarProblem it "
            "is measured: omit its bounds."
        )


def read_friction_demand(gait: AnyGait) -> float:
    """Return the largest ratio of tangential to normal force of a foot over a step, at the samples."""
    if isinstance(gait, PlanarGait):
        return largest_foot_ratio(gait)
    return PeakFrictionDemand().evaluate(gait.motion)


def restrict_radius(problem: GaitProblem, value: float) -> GaitProblem:
    """Return a problem in which the spectral radius of the return map in open loop is at most a value."""
    bound = problem.stability or StabilityBound(radius=value)
    return problem.replace(stability=evolve(bound, radius=min(bound.radius, value)))


QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity(COST, "", "objective of the problem", 1, lambda gait: gait.solver.objective),
        Quantity(
            "peak_torque",
            "N m",
            "largest absolute torque or force of any actuator",
            1,
            lambda gait: max(peak_torques(gait).values()),
            restrict_torque,
            PeakTorque(),
        ),
        Quantity(
            "peak_friction_demand",
            "1",
            "largest ratio of tangential to normal contact force",
            1,
            read_friction_demand,
            restrict_friction_demand,
            PeakFrictionDemand(),
            require_stick,
        ),
        Quantity(
            "speed",
            "m/s",
            "average forward speed",
            -1,
            lambda gait: gait.speed,
            restrict_speed,
            TimePerDistance(),
            require_travel,
        ),
        Quantity(
            "spectral_radius",
            "1",
            "spectral radius of the return map in open loop",
            1,
            measure_radius,
            restrict_radius,
            require=require_single_foot,
        ),
        Quantity(
            "recovered_push", "rad/s", "largest ball of recovered pushes in open loop", -1, measure_recovered_push
        ),
    )
}
"""Quantities by name."""
