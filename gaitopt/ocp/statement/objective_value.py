"""Value of an objective on a motion, computed from its samples alone: an independent check of the NLP."""

from dataclasses import replace
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.coordinate_entries import SLIDE
from gaitopt.motion.motion import Array, Jump, Motion, Segment
from gaitopt.ocp.statement.instant import Instant, StepBoundary, symbolic_instant

if TYPE_CHECKING:
    from gaitopt.ocp.statement.objective import Objective


FIELDS = ("q", "v", "acceleration", "torque", "torque_rate", "positive", "negative", "force", "slip_speed", "time")
"""Numeric fields of an instant."""


def value_of_term(objective: "Objective", motion: Motion) -> float:
    """Return the value of a single objective, not a sum, on the first step of a motion.

    Accelerations are those of a spline through the rates, torque rates are differences of the samples.

    Raises
    ------
    InputError
        If the first step did not reach its touchdown, or several contacts of the robot may be on the ground.
    """
    _refuse_several_contacts(motion)
    segments, jump = first_step(motion)
    if not is_finite(segments):
        return float("nan")
    duration = float(segments[-1].time[-1] - segments[0].time[0])
    total, peaks = 0.0, []
    for number, segment in enumerate(map(_keep_distinct_instants, segments)):
        samples = _samples(segment, segments[0].time[0], duration)
        total += _integral(objective, motion, segment, number, samples)
        peaks += _peaks(objective, motion, segment, number, samples)
    travel = replace(motion, segments=tuple(segments), jumps=(jump,)).travel
    total += float(ca.DM(objective.boundary(_boundary(motion, segments, jump, duration, travel))))
    if objective.per_weight_and_travel:
        total /= motion.total_mass * motion.parameters["gravity"] * travel
    return total + (float(np.max(peaks)) if peaks else 0.0)


def _refuse_several_contacts(motion: object) -> None:
    """Raise InputError for the motion of a robot with several contacts."""
    if isinstance(motion, Motion):
        return
    from gaitopt.motion.planar_motion import PlanarMotion  # which problems with one foot on the ground do not need

    if isinstance(motion, PlanarMotion):
        raise InputError(
            "The motion of a robot with several contacts has no value of an objective; that of the plan is "
            "gait.solver.objective."
        )


def is_finite(segments: list[Segment]) -> bool:
    """Return whether time, states, torques, powers and forces of segments are finite."""
    names = ("time", "q", "v", "torque", "power", "force")
    return all(bool(np.all(np.isfinite(getattr(segment, name)))) for segment in segments for name in names)


def first_step(motion: Motion) -> tuple[list[Segment], Jump]:
    """Return the segments of the first step of a motion and its touchdown; InputError if none exists."""
    segments = [segment for segment in motion.segments if segment.step == motion.segments[0].step]
    jumps = [jump for jump in motion.jumps if segments and jump.step == segments[0].step]
    if not jumps:
        raise InputError("The objective has no value: the first step of the motion did not reach its touchdown.")
    return segments, jumps[0]


def _keep_distinct_instants(segment: Segment) -> Segment:
    """Return a segment without the first of two samples at one instant, where a torque ends and the phase too."""
    keep = np.append(np.diff(segment.time) > 0, True)
    if np.all(keep):
        return segment
    names = ("time", "q", "v", "torque", "force", "power")
    return replace(segment, **{name: getattr(segment, name)[..., keep] for name in names})


def _samples(segment: Segment, begin: float, duration: float) -> list[dict[str, Array]]:
    """Return the numeric fields of the instants at begin, middle and end of the K - 1 gaps between samples, (n, K - 1).

    In the middle, torques, powers and forces are interpolated linearly, states by cubic Hermite polynomials.
    """
    from scipy.interpolate import CubicSpline  # whose import takes longer than a solve

    gap, q = np.diff(segment.time), segment.q.copy()
    rates = CubicSpline(segment.time, segment.v, axis=1)
    q[SLIDE] -= q[SLIDE, 0]
    acceleration = rates(segment.time, 1)

    def middle(values: Array, slopes: Array) -> Array:
        """Return the cubic Hermite interpolant in the middle of the gaps."""
        return (values[:, :-1] + values[:, 1:]) / 2 + gap * (slopes[:, :-1] - slopes[:, 1:]) / 8

    linear = {"torque": segment.torque, "power": segment.power, "force": segment.force, "time": segment.time[None]}
    instants = []
    for cut in (slice(-1), None, slice(1, None)):
        if cut is None:
            fields = {name: (values[:, :-1] + values[:, 1:]) / 2 for name, values in linear.items()}
            fields |= {"q": middle(q, segment.v), "v": middle(segment.v, acceleration)}
            fields["acceleration"] = (acceleration[:, :-1] + acceleration[:, 1:]) / 2
        else:
            parts = {**linear, "q": q, "v": segment.v, "acceleration": acceleration}
            fields = {name: values[:, cut] for name, values in parts.items()}
        power = fields.pop("power")
        fields["positive"], fields["negative"] = np.maximum(power, 0), np.maximum(-power, 0)
        fields["slip_speed"] = np.abs(fields["v"][[SLIDE]]) if segment.mode.slips else np.zeros((1, gap.size))
        fields["time"] = (fields["time"] - begin) / duration
        fields["torque_rate"] = np.diff(segment.torque, axis=1) / gap
        instants.append(fields)
    return instants


def _function(motion: Motion, segment: Segment, number: int, read: Any) -> ca.Function | None:
    """Return the Function of (the fields of `_samples`, parameters) that evaluates `read` at an instant."""
    point = symbolic_instant(motion.angles, motion.actuators, motion.parameters, segment.mode, number)
    value = read(point)
    if value is None:
        return None
    inputs = [getattr(point, name) for name in FIELDS]
    return ca.Function("value", [*inputs, ca.vertcat(*point.parameters.values())], [ca.SX(value)])


def _values(function: ca.Function, motion: Motion, samples: list[dict[str, Array]]) -> list[Array]:
    """Return the values at begin, middle and end of the gaps between samples, each of shape (K - 1,)."""
    p = np.array(list(motion.parameters.values()))[:, None]
    count = samples[0]["time"].shape[1]
    mapped = function.map(count)
    return [np.asarray(mapped(*(fields[name] for name in FIELDS), np.tile(p, count)))[0] for fields in samples]


def _integral(
    objective: "Objective", motion: Motion, segment: Segment, number: int, samples: list[dict[str, Array]]
) -> float:
    """Return the integral along a segment, by Simpson's rule for a smooth integrand, otherwise by trapezoids."""
    function = _function(motion, segment, number, objective.integrand)
    if function is None:
        return 0.0
    begin, middle, end = _values(function, motion, samples)
    mean = (begin + 4 * middle + end) / 6 if objective.smooth else (begin + 2 * middle + end) / 4
    return float(np.sum(np.diff(segment.time) * mean))


def _peaks(
    objective: "Objective", motion: Motion, segment: Segment, number: int, samples: list[dict[str, Array]]
) -> list[float]:
    """Return the peaks at begin and end of the gaps of a segment; empty if the objective has no peak."""

    def read(point: Instant) -> Any:
        peak = objective.peak(point)
        return None if peak is None else ca.mmax(ca.SX(peak.values) / peak.divisor)

    function = _function(motion, segment, number, read)
    if function is None:
        return []
    begin, _, end = _values(function, motion, samples)
    return [float(np.max(begin)), float(np.max(end))]


def _boundary(motion: Motion, segments: list[Segment], jump: Jump, duration: float, travel: float) -> StepBoundary:
    first, q_last = segments[0].q[:, 0].copy(), jump.q.copy()
    first[SLIDE] = q_last[SLIDE] = 0.0
    return StepBoundary(
        q_first=ca.DM(first),
        v_first=ca.DM(segments[0].v[:, 0]),
        q_last=ca.DM(q_last),
        v_last=ca.DM(jump.v_minus),
        velocity_jump=ca.DM(jump.v_plus - jump.v_minus),
        impulse=ca.DM(jump.impulse),
        duration=ca.DM(duration),
        travel=ca.DM(travel),
        parameters={name: ca.DM(value) for name, value in motion.parameters.items()},
        energy_lost=ca.DM(jump.energy_lost),
    )
