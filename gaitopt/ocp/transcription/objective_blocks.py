"""The objective in the NLP: integrals gathered interval by interval, the boundary of the step, and peaks."""

import functools
import math
from collections.abc import Mapping, Sequence

import casadi as ca
import numpy as np

from gaitopt.lazy import Deferred
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.ocp.nlp.keys import Key, Kind, Row, Unknown
from gaitopt.ocp.nlp.nlp import Block
from gaitopt.ocp.statement.instant import Instant, StepBoundary
from gaitopt.ocp.transcription.grid import Phase
from gaitopt.ocp.transcription.nlp_builder import BlockVariables, NlpBuilder
from gaitopt.ocp.transcription.scheme import Point


class InstantMaker:
    """Makes the instants of the points of one block, as objectives see them.

    Parameters
    ----------
    frame : Frame
    local : BlockVariables
        Local variables of the block, which gain those of the elapsed time where an objective asks for it.
    phase : Phase
    stance : PhaseDynamics
    p : SX
        Parameters.
    nodes : (count,) int array
        Nodes of the phase, counted from its start, to which the instances of the block belong.
    """

    def __init__(
        self, frame: NlpBuilder, local: BlockVariables, phase: Phase, stance: PhaseDynamics, p: ca.SX, nodes: np.ndarray
    ) -> None:
        self.frame, self.local, self.phase, self.stance, self.p, self.nodes = frame, local, phase, stance, p, nodes

    def make(
        self, point: Point, power: ca.SX | None, rate: "ca.SX | Deferred[ca.SX]", fraction: float = 0.0
    ) -> Instant:
        """Return an instant.

        Parameters
        ----------
        point : Point
        power : SX, shape (2 n_powered, 1), or None
            Parts of the powers of the actuators that may work.
        rate : SX or Deferred, shape (n_u, 1)
            Torque rates.
        fraction : float
            Of the interval that begins at the node.
        """
        robot, powered = self.frame.robot, list(self.frame.powered)
        positive, negative = ca.SX.zeros(robot.n_u), ca.SX.zeros(robot.n_u)
        if power is not None:
            positive[powered], negative[powered] = power[: len(powered)], power[len(powered) :]
        q, v = self.stance.full(point.state)
        return Instant(
            mode=self.phase.mode,
            phase=self.phase.number,
            angles=robot.angles,
            actuators=robot.actuators,
            q=q,
            v=v,
            acceleration=self.stance.full_acceleration(point.acceleration),
            torque=point.torque,
            torque_rate=rate,
            positive=positive,
            negative=negative,
            force=point.force,
            slip_speed=point.slip_speed,
            parameters=self._parameters,
            time=Deferred(lambda: (self._elapsed + fraction * self._length) / self._period),
        )

    @functools.cached_property
    def _parameters(self) -> Mapping[str, ca.SX]:
        return named_parameters(self.frame, self.p)

    @functools.cached_property
    def _length(self) -> ca.SX:
        """Length of an interval [s]."""
        return self.local.shared(Unknown.DURATION)[self.phase.number] / self.phase.count

    @functools.cached_property
    def _period(self) -> ca.SX:
        return ca.sum1(self.local.shared(Unknown.DURATION))

    @functools.cached_property
    def _elapsed(self) -> ca.SX:
        """Time from the start of the step to the node [s]."""
        durations = self.local.shared(Unknown.DURATION)
        before = sum((durations[i] for i in range(self.phase.number)), ca.SX(0))
        return before + self.local.add_constant("node", np.asarray(self.nodes, dtype=float)) * self._length


def named_parameters(frame: NlpBuilder, p: ca.SX) -> Mapping[str, ca.SX]:
    """Return the parameters by name."""
    return dict(zip(frame.names(), ca.vertsplit(p), strict=True))


def mean_integrand(frame: NlpBuilder, instants: Sequence[Instant | None]) -> tuple[ca.SX, ca.SX]:
    """Return the mean over an interval of the integrands that count as they are, and of those per weight and travel.

    Parameters
    ----------
    frame : Frame
    instants : sequence of Instant or None
        At the points of the interval: start, inner points and end; None where the scheme's weight is zero.
    """
    plain, relative = ca.SX(0), ca.SX(0)
    for weight, term in frame.terms:
        rule = frame.scheme.smooth_weights() if term.smooth else frame.scheme.kinked_weights()
        mean = ca.SX(0)
        for share, instant in zip(rule, instants, strict=True):
            if share and instant is not None:
                mean += float(share) * ca.SX(term.integrand(instant))
        if term.per_weight_and_travel:
            relative += weight * mean
        else:
            plain += weight * mean
    return plain, relative


def peak_rows(frame: NlpBuilder, local: BlockVariables, instant: Instant) -> tuple[list[Row], ca.SX]:
    """Return rows and values that keep the peaks of the objective above an instant."""
    table: list[Row] = []
    values = [ca.SX(0, 1)]
    for place, (_, term) in enumerate(frame.peaks):
        peak = term.peak(instant)
        if peak is None:
            continue
        quantities = ca.SX(peak.values)
        values.append(local.shared(Unknown.PEAK)[place] * peak.divisor - quantities)
        keys = (Key(Kind.PEAK_BOUND, f"{term.name}, part {i + 1}") for i in range(quantities.numel()))
        table += [Row(key, 0.0, math.inf) for key in keys]
    return table, ca.vertcat(*values)


def peak_cost(frame: NlpBuilder, local: BlockVariables) -> ca.SX:
    """Return the peaks of the objective, weighted."""
    return sum(
        (frame.terms[number][0] * local.shared(Unknown.PEAK)[i] for i, (number, _) in enumerate(frame.peaks)), ca.SX(0)
    )


def boundary_cost(frame: NlpBuilder, stance: PhaseDynamics, step: StepBoundary, p: ca.SX) -> ca.SX:
    """Return the boundary terms of the objective."""
    cost = ca.SX(0)
    for weight, term in frame.terms:
        value = ca.SX(term.boundary(step))
        cost += weight * (value / (stance.weight(p) * step.travel) if term.per_weight_and_travel else value)
    return cost


def quotient_block(frame: NlpBuilder, stance: PhaseDynamics) -> Block:
    """Return the part of the objective per weight and travel, and close the row that defines its integral."""
    local = BlockVariables(frame, 1)
    p = local.parameters()
    integral = local.add("integral", frame.variables[Unknown.INTEGRAL])
    travel = local.add("travel", frame.variables[Unknown.TRAVEL])
    cost = integral / (stance.weight(p) * travel)
    return local.block("quotient", -integral, np.array([[frame.integral_row()]]), cost)
