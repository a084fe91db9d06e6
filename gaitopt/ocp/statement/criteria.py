"""The built-in objectives."""

from typing import Any

import casadi as ca

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.motion.energy import absolute_work, cost_of_transport, ledger
from gaitopt.motion.motion import Motion
from gaitopt.ocp.statement.instant import Instant, Peak, StepBoundary
from gaitopt.ocp.statement.objective import Objective
from gaitopt.ocp.statement.objective_value import first_step
from gaitopt.parameters import Parameter


@check_arguments
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
    formula = ("1/(m g L) ∫ Σ |u_i ṡ_i| dt", r"\frac{1}{m g L} \int_0^T \sum_i |u_i \dot s_i|\, dt")
    uses_power = True
    per_weight_and_travel = True
    typical = 0.01

    def integrand(self, point: Instant) -> Any:
        """Return the sum of absolute powers [W]."""
        return ca.sum1(point.positive) + ca.sum1(point.negative)

    def evaluate(self, motion: Motion) -> float:
        """Return the absolute work over weight times travel, integrated exactly at the kinks."""
        return cost_of_transport(motion)


def _formula_of_work(regeneration: float) -> tuple[str, str]:
    """Return the positive work as text and as LaTeX, with the value of the regenerated share unless it is zero."""
    text, latex = "max(u_i ṡ_i, 0)", r"\max(u_i \dot s_i, 0)"
    if regeneration:
        text = f"({text} - {regeneration:g} max(-u_i ṡ_i, 0))"
        latex = rf"\left({latex} - {regeneration:g} \max(-u_i \dot s_i, 0)\right)"
    return f"1/(m g L) ∫ Σ {text} dt", rf"\frac{{1}}{{m g L}} \int_0^T \sum_i {latex}\, dt"


@check_arguments
@dataclass(frozen=True)
class PositiveWork(Objective):
    """Integral of the positive joint powers minus a regenerated share of the negative ones, over weight times travel.

    Attributes
    ----------
    regeneration : float
        Share of the negative work that is recovered, from 0 to less than 1.

    Raises
    ------
    InputError
        If `regeneration` is not in [0, 1); with 1 the optimum is not unique.

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

    def __post_init__(self) -> None:
        share = Parameter("regeneration", 0.0, "1", "", lower=0.0, upper=0.999).check(self.regeneration)
        object.__setattr__(self, "regeneration", share)
        object.__setattr__(self, "formula", _formula_of_work(share))

    def integrand(self, point: Instant) -> Any:
        """Return the sum of the positive powers minus the regenerated share of the negative ones [W]."""
        return ca.sum1(point.positive) - self.regeneration * ca.sum1(point.negative)

    def evaluate(self, motion: Motion) -> float:
        """Return the work over weight times travel, integrated exactly at the kinks."""
        absolute, net = absolute_work(motion), ledger(motion).actuator
        work = (absolute + net) / 2 - self.regeneration * (absolute - net) / 2
        return work / (motion.total_mass * motion.parameters["gravity"] * motion.travel)


@check_arguments
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
    formula = ("∫ Σ u_i² dt", r"\int_0^T \sum_i u_i^2\, dt")
    smooth = True

    def integrand(self, point: Instant) -> Any:
        """Return the sum of squared torques [N^2 m^2]."""
        return ca.sumsqr(point.torque)


@check_arguments
@dataclass(frozen=True)
class TorqueRate(Objective):
    """Integral of the sum of squared torque rates within the step [N^2 m^2/s]; torques may jump at touchdown.

    Examples
    --------
    >>> TorqueRate().unit
    'N^2 m^2/s'
    """

    name = "torque_rate"
    unit = "N^2 m^2/s"
    formula = ("∫ Σ (du_i/dt)² dt", r"\int_0^T \sum_i \dot u_i^2\, dt")
    smooth = True
    typical = 100.0

    def integrand(self, point: Instant) -> Any:
        """Return the sum of squared torque rates [N^2 m^2/s^2]."""
        return ca.sumsqr(point.torque_rate)


@check_arguments
@dataclass(frozen=True)
class FootSlide(Objective):
    """Distance that the stance foot slides on the ground, forward and backward alike [m].

    Examples
    --------
    >>> FootSlide().unit
    'm'
    """

    name = "foot_slide"
    unit = "m"
    formula = ("∫ |v_t| dt", r"\int_0^T |v_t|\, dt")
    smooth = True
    typical = 0.01

    def integrand(self, point: Instant) -> Any:
        """Return the absolute speed of the stance foot [m/s]."""
        return point.slip_speed

    def evaluate(self, motion: Motion) -> float:
        """Return the sum of the distances of the first step; within a phase the direction of slip is constant."""
        return sum(abs(segment.slide) for segment in first_step(motion)[0])


@check_arguments
@dataclass(frozen=True)
class ImpactLoss(Objective):
    """Kinetic energy lost in the impact at touchdown [J].

    Examples
    --------
    >>> ImpactLoss().unit
    'J'
    """

    name = "impact_loss"
    unit = "J"
    formula = ("E_kin before - E_kin after the impact", r"E_\mathrm{kin}^- - E_\mathrm{kin}^+")
    smooth = True

    def boundary(self, step: StepBoundary) -> Any:
        """Return the energy lost [J]."""
        return step.energy_lost


@check_arguments
@dataclass(frozen=True)
class PeakTorque(Objective):
    """Largest absolute torque of any actuator over the step [N m].

    Examples
    --------
    >>> PeakTorque().unit
    'N m'
    """

    name = "peak_torque"
    unit = "N m"
    formula = ("max |u_i| over i and t", r"\max_{i, t} |u_i(t)|")

    def peak(self, point: Instant) -> Peak:
        """Return the torques of both signs [N m]."""
        return Peak(ca.vertcat(point.torque, -point.torque))


@check_arguments
@dataclass(frozen=True)
class PeakFrictionDemand(Objective):
    """Largest ratio abs(f_t) / f_n of the contact force of any foot over the step (dimensionless).

    During a slide the ratio equals the friction coefficient, so the objective is meant for gaits that stick.

    Examples
    --------
    >>> PeakFrictionDemand().unit
    '1'
    """

    name = "peak_friction_demand"
    unit = "1"
    formula = ("max |f_t| / f_n over t", r"\max_t |f_t(t)| / f_n(t)")
    typical = 0.1

    def peak(self, point: Instant) -> Peak:
        """Return the tangential force of both signs over the normal force, of every foot on the ground."""
        tangential, normal = (row.T for row in ca.vertsplit(point.foot_forces))
        return Peak(ca.vertcat(tangential, -tangential), ca.vertcat(normal, normal))


@check_arguments
@dataclass(frozen=True)
class Duration(Objective):
    """Duration of the step [s].

    Examples
    --------
    >>> Duration().unit
    's'
    """

    name = "duration"
    unit = "s"
    formula = ("T", r"T")
    smooth = True

    def boundary(self, step: StepBoundary) -> Any:
        """Return the duration [s]."""
        return step.duration
