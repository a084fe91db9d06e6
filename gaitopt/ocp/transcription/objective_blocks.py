"""The objective in the NLP: integrals gathered interval by interval, the boundary of the step, and peaks."""

import math
from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.lazy import Deferred, LazyField
from gaitopt.locks import cached_property
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.block import Block
from gaitopt.ocp.nlp.keys import Key, Kind, Row, Unknown
from gaitopt.ocp.statement.instant import Instant, StepBoundary
from gaitopt.ocp.statement.objective import Objective, is_linear_in_power, overrides
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder
from gaitopt.ocp.transcription.scheme import Point


class InstantFactory:
    """Instants of the points of one block, the arguments of objectives.

    Parameters
    ----------
    builder : NlpBuilder
    local : BlockVariables
        Local variables of the block; those of the elapsed time are added if an objective depends on it.
    phase : Phase
    dynamics : PhaseDynamics
    p : SX
        Parameters.
    nodes : (count,) int array
        Nodes of the instances of the block, counted from the start of the phase.
    """

    def __init__(
        self,
        builder: NlpBuilder,
        local: BlockVariables,
        phase: Phase,
        dynamics: PhaseDynamics,
        p: ca.SX,
        nodes: np.ndarray,
    ) -> None:
        self.builder, self.local, self.phase, self.dynamics, self.p, self.nodes = (
            builder,
            local,
            phase,
            dynamics,
            p,
            nodes,
        )

    def make(
        self, point: Point, power: ca.SX | None, rate: "ca.SX | Deferred[ca.SX]", fraction: float = 0.0
    ) -> Instant:
        """Return an instant.

        Parameters
        ----------
        point : Point
        power : SX, shape (2 n_powered, 1), or None
            Parts of the powers of the actuators that are not idle.
        rate : SX or Deferred, shape (n_u, 1)
            Torque rates.
        fraction : float
            Fraction of the interval that begins at the node.
        """
        robot, dynamics, count = self.builder.robot, self.dynamics, len(self.builder.powered)
        positive, negative = (None, None) if power is None else (power[:count], power[count:])
        # Expressions that the objective does not use are not built.
        return Instant(
            mode=self.phase.mode,
            phase=self.phase.number,
            angles=robot.angles,
            actuators=robot.actuators,
            q=Deferred(lambda: dynamics.full(point.state)[0]),
            v=Deferred(lambda: dynamics.full(point.state)[1]),
            acceleration=Deferred(lambda: dynamics.full_acceleration(point.acceleration)),
            torque=point.torque,
            torque_rate=rate,
            positive=Deferred(lambda: self._of_all_actuators(positive)),
            negative=Deferred(lambda: self._of_all_actuators(negative)),
            force=Deferred(lambda: point.force),
            slip_speed=point.slip_speed,
            parameters=Deferred(lambda: self._parameters),
            time=Deferred(lambda: (self._elapsed + fraction * self._length) / self._period),
        )

    def _of_all_actuators(self, parts: ca.SX | None) -> ca.SX:
        """Return parts of the powers of the actuators that are not idle, or of none, with zeros for the others."""
        values = ca.SX.zeros(self.builder.robot.n_u)
        if parts is not None:
            values[list(self.builder.powered)] = parts
        return values

    @cached_property
    def _parameters(self) -> Mapping[str, ca.SX]:
        return name_parameters(self.builder, self.p)

    @cached_property
    def _length(self) -> ca.SX:
        """Length of an interval [s]."""
        return self.local.add_length(self.phase, self._duration, self.nodes.tolist())

    @cached_property
    def _duration(self) -> ca.SX:
        """Duration of the phase [s]."""
        return self.local.add_shared(Unknown.DURATION)[self.phase.number]

    @cached_property
    def _period(self) -> ca.SX:
        return ca.sum1(self.local.add_shared(Unknown.DURATION))

    @cached_property
    def _elapsed(self) -> ca.SX:
        """Time from the start of the step to the node [s]."""
        durations = self.local.add_shared(Unknown.DURATION)
        before = sum((durations[i] for i in range(self.phase.number)), ca.SX(0))
        return before + self.local.add_intervals(self.phase, self.nodes.tolist())[0] * self._duration


def name_parameters(builder: NlpBuilder, p: ca.SX) -> Mapping[str, ca.SX]:
    """Return the parameters by name."""
    return dict(zip(builder.names(), ca.vertsplit(p), strict=True))


@dataclass(frozen=True, eq=False, kw_only=True)
class IntervalInstants:
    """Instants of an interval, the arguments of objectives.

    Attributes
    ----------
    points : list of Instant or None
        Start, inner points and end, with the parts of the joint powers; None where the contact force is unknown.  They
        are built when they are first read, since most objectives depend on the mean alone.
    idle : list of Instant or None
        The same without joint powers.
    mean : Instant or None
        The start with the means of the parts over the interval, if sign changes of the powers are data.
    """

    points: LazyField[list[Instant | None]] = LazyField()
    idle: list[Instant | None]
    mean: Instant | None


def mean_integrand(builder: NlpBuilder, instants: IntervalInstants) -> tuple[ca.SX, ca.SX]:
    """Return the means over an interval of the plain integrands and of those per weight and travel.

    Within an interval the parts of the joint powers are polynomials that are integrated exactly; their sum bounds the
    absolute power from above.  The mean of an integrand that is linear in them depends only on their means, which are
    exact once sign changes are located.
    """
    plain, relative = ca.SX(0), ca.SX(0)
    scheme = builder.scheme
    for weight, term in builder.terms:
        rule = scheme.smooth_weights() if term.smooth else scheme.kinked_weights()
        mean = _weighted_sum(term, rule, instants.idle)
        start = instants.idle[0]
        if not term.uses_power:
            pass
        elif start is not None and instants.mean is not None and is_linear_in_power(term, builder.robot, start.mode):
            mean += term.integrand(instants.mean) - term.integrand(start)
        else:
            smooth = scheme.smooth_weights()
            mean += _weighted_sum(term, smooth, instants.points) - _weighted_sum(term, smooth, instants.idle)
        weighted = mean if weight == 1 else weight * mean
        if term.per_weight_and_travel:
            relative += weighted
        else:
            plain += weighted
    return plain, relative


def _weighted_sum(term: Objective, rule: Array, instants: Sequence[Instant | None]) -> ca.SX:
    """Return the weighted sum of an integrand over some instants."""
    values = []
    for share, instant in zip(rule, instants, strict=True):
        if share and instant is not None:
            value = term.integrand(instant)
            if not (isinstance(value, ca.SX) and value.is_zero()):  # zeros take as long to sum as other terms
                values.append(value * float(share))
    return sum(values[1:], values[0]) if values else ca.SX(0)


def peak_rows(builder: NlpBuilder, local: BlockVariables, instant: Instant) -> tuple[list[Row], ca.SX]:
    """Return rows and values that bound the peaks of the objective from below at an instant."""
    table: list[Row] = []
    values = [ca.SX(0, 1)]
    for place, (_, term) in enumerate(builder.peaks):
        peak = term.peak(instant)
        if peak is None:
            continue
        quantities = ca.SX(peak.values)
        values.append(local.add_shared(Unknown.PEAK)[place] * peak.divisor - quantities)
        keys = (Key(Kind.PEAK_BOUND, f"{term.name}, part {i + 1}") for i in range(quantities.numel()))
        table += [Row(key, 0.0, math.inf) for key in keys]
    return table, ca.vertcat(*values)


def peak_cost(builder: NlpBuilder, local: BlockVariables) -> ca.SX:
    """Return the weighted sum of the peaks of the objective."""
    return sum(
        (builder.terms[number][0] * local.add_shared(Unknown.PEAK)[i] for i, (number, _) in enumerate(builder.peaks)),
        ca.SX(0),
    )


def boundary_cost(builder: NlpBuilder, dynamics: PhaseDynamics, step: StepBoundary, p: ca.SX) -> ca.SX:
    """Return the boundary terms of the objective."""
    cost = ca.SX(0)
    for weight, term in builder.terms:
        if not overrides(term, "boundary"):
            continue
        value = ca.SX(term.boundary(step))
        cost += weight * (value / (dynamics.weight(p) * step.travel) if term.per_weight_and_travel else value)
    return cost


def quotient_block(builder: NlpBuilder, dynamics: PhaseDynamics) -> Block:
    """Return the block of the objective per weight and travel, and complete the row that defines its integral."""
    local = BlockVariables(builder, 1)
    p = local.parameters()
    integral = local.add("integral", builder.variables[Unknown.INTEGRAL])
    travel = local.add("travel", builder.variables[Unknown.TRAVEL])
    cost = integral / (dynamics.weight(p) * travel)
    return local.block("quotient", -integral, np.array([[builder.integral_row()]]), cost, merged=True)
