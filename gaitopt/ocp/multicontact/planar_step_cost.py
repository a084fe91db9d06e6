"""Terms of the objective of a planar robot that depend on the whole period: its boundary, and peaks over time."""

import math
from collections.abc import Mapping
from typing import Any

import casadi as ca
import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.lazy import Deferred, LazyField
from gaitopt.ocp.multicontact.impulse_stages import list_instants, net_work
from gaitopt.ocp.multicontact.phase_grid import GridPhase
from gaitopt.ocp.multicontact.planar_builder import PlanarBuilder
from gaitopt.ocp.multicontact.planar_objective import make_instant
from gaitopt.ocp.multicontact.planar_point import Condition, PlanarPoint
from gaitopt.ocp.nlp.keys import Key, Kind, Row, Unknown
from gaitopt.ocp.nlp.nlp import Block
from gaitopt.ocp.statement.objective import overrides
from gaitopt.ocp.transcription.nlp_builder import BlockVariables


@dataclass(frozen=True, eq=False, kw_only=True)
class PlanarStepBoundary:
    """The ends of a period of a planar robot and its impacts.  Quantities are CasADi expressions.

    Attributes
    ----------
    coordinates : tuple of str
        Names of the rows of the states.
    q_first, v_first : (n_q)
        First state of the period, after the exchange of the legs.
    q_last, v_last : (n_q)
        Last state, before the impact that ends the period, if there is one.
    duration, travel : scalar [s], [m]
        `travel` is 0 for a robot that does not travel.
    parameters : mapping of str to scalar
        Parameters of robot and ground, SI units.
    energy_lost : scalar [J]
        Energy lost in all impacts of the period, not counting the work of impulses of actuators.

    Examples
    --------
    >>> column = ca.DM.zeros(2)
    >>> states = dict.fromkeys(("q_first", "v_first", "q_last", "v_last"), column)
    >>> PlanarStepBoundary(
    ...     **states, coordinates=("x", "y"), duration=0.7, travel=0.4, parameters={}, energy_lost=0.1
    ... ).duration
    0.7
    """

    coordinates: tuple[str, ...]
    q_first: Any
    v_first: Any
    q_last: Any
    v_last: Any
    duration: Any
    travel: Any
    parameters: LazyField[Mapping[str, Any]] = LazyField()
    energy_lost: LazyField[Any] = LazyField()


def planar_cost_block(builder: PlanarBuilder) -> Block | None:
    """Return the block of the boundary terms and the peaks of the objective; None if it has none."""
    terms, peaks = builder.structure.objective.terms(), builder.structure.peaks
    bounded: list[tuple[float, Any]] = [(weight, term) for weight, term in terms if overrides(term, "boundary")]
    if not bounded and not peaks:
        return None
    local, cost = BlockVariables(builder, 1), ca.SX(0)
    if bounded:
        p = builder.parameters(local)
        step = _make_boundary(builder, local, p)
        for weight, term in bounded:
            value = ca.SX(term.boundary(step))
            cost += weight * (value / (_weight(builder, p) * step.travel) if term.per_weight_and_travel else value)
    for place, (number, _) in enumerate(peaks):
        cost += terms[number][0] * local.add_shared(Unknown.PEAK)[place]
    return local.block("step_cost", ca.SX(0, 1), np.empty((0, 1), dtype=int), cost)


def _weight(builder: PlanarBuilder, p: ca.SX) -> ca.SX:
    return builder.robot.mass(p) * p[builder.robot.index("gravity")]


def _make_boundary(builder: PlanarBuilder, local: BlockVariables, p: ca.SX) -> PlanarStepBoundary:
    robot, first, last = builder.robot, builder.phases[0], builder.phases[-1]
    q_first, v_first = _add_state(builder, local, first, 0, "first")
    q_last, v_last = _add_state(builder, local, last, last.count, "last")
    travel = ca.SX(0)
    if robot.travel is not None:
        place = robot.coordinates.index(robot.travel)
        travel = q_last[place] - q_first[place]
    names = builder.names()
    return PlanarStepBoundary(
        coordinates=robot.coordinates,
        q_first=q_first,
        v_first=v_first,
        q_last=q_last,
        v_last=v_last,
        duration=ca.sum1(local.add_shared(Unknown.DURATION)),
        travel=travel,
        parameters=Deferred(lambda: dict(zip(names, ca.vertsplit(p[: len(names)]), strict=True))),
        energy_lost=Deferred(lambda: _sum_losses(builder, local, p)),
    )


def _add_state(
    builder: PlanarBuilder, local: BlockVariables, phase: GridPhase, node: int, name: str
) -> tuple[ca.SX, ca.SX]:
    """Return coordinates and rates at a node of a phase."""
    q = local.add(f"q {name}", builder.coordinates(phase)[:, [node]])
    return q, local.add(f"v {name}", builder.velocities(phase)[:, [node]])


def _sum_losses(builder: PlanarBuilder, local: BlockVariables, p: ca.SX) -> ca.SX:
    """Return the energy lost in the impacts of a period."""
    robot, lost = builder.robot, ca.SX(0)
    for phase in builder.phases:
        if phase.outcome is None:
            continue
        q, before = _add_state(builder, local, phase, phase.count, f"before impact {phase.number}")
        after = builder.rates_after(local, phase)  # in the coordinates of the period that ends
        lost += robot.energy(q, before, p)[0] - robot.energy(q, after, p)[0]
        for stage in list_instants(builder, local, phase, (q, before, after, p)).stages:
            lost += net_work(builder, stage, (q, p))
    return lost


def peak_conditions(
    builder: PlanarBuilder,
    local: BlockVariables,
    phase: GridPhase,
    point: PlanarPoint,
    rate: ca.SX,
    opening: frozenset[int] | None = None,
) -> list[Condition]:
    """Return the bounds of the peaks of the objective at a point.

    Parameters
    ----------
    builder, local, phase, point
    rate : (n_u)
        Torque rates.
    opening : frozenset of int, optional
        At the end of a phase, the first contact of each body that lifts off: its force is zero.  A peak that depends
        on the torques alone is left out where they are continuous, as it is bounded at the start of the next phase.
    """
    conditions: list[Condition] = []
    for place, (_, objective) in enumerate(builder.structure.peaks):
        term: Any = objective  # an instant of a planar robot has the fields of one with a single foot
        peak = term.peak(make_instant(builder, phase, point, rate, opening=opening or frozenset()))
        if peak is None:
            continue
        values, states = ca.SX(peak.values), ca.vertcat(point.q, point.v, point.z)
        continuous = opening is not None and phase.outcome is None
        if continuous and not ca.depends_on(ca.vertcat(values, ca.SX(peak.divisor)), states):
            continue
        bounds = local.add_shared(Unknown.PEAK)[place] * peak.divisor - values
        for i in range(bounds.numel()):
            key = Key(Kind.PEAK_BOUND, f"{term.name}, part {i + 1}")
            conditions.append((Row(key, 0.0, math.inf), bounds[i]))
    return conditions
