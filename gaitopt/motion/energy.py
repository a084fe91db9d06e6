"""The energy ledger of a motion and the cost of transport."""

from collections.abc import Iterable
from dataclasses import fields, replace

import numpy as np
from numpy.polynomial import Polynomial
from numpy.typing import NDArray

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array, Motion, Segment
from gaitopt.reductions import worst

CONTINUOUS = 1e-9
"""Relative difference of the kinetic energies before and after a transition that is due to its location error."""

STRAIGHT = 1e-9
"""Deviation of a torque from a straight line, relative to the largest torque, below which no corner is assumed."""

UNEVEN = 4
"""Ratio of neighbouring sampling intervals above which no polynomial is fitted through both."""

ROUNDING = 1e-12
"""Share of the largest work between samples below which a power is zero."""


LEAST_ENTRY = 1e-6
"""Share of the largest kinetic energy to which the closing error is relative if all entries are smaller."""


@dataclass(frozen=True)
class Ledger:
    """Sources and losses of the energy of a motion [J].

    actuator + impulse_generated - impulse_absorbed + gravity = impact_loss + friction_loss + damping_loss
    + transition_loss + kinetic_change + elastic_change, up to `residual`.

    Attributes
    ----------
    actuator, gravity : float
        Work done by the actuators (signed) and by gravity.
    impact_loss, friction_loss : float
        Energy lost at touchdowns and by sliding.
    kinetic_change : float
        Kinetic energy gained from the first state to the last, zero for a periodic gait.
    damping_loss : float
        Energy dissipated by dampers, zero for a robot without them.
    elastic_change : float
        Energy stored in springs and potentials from the first state to the last: zero for a periodic gait, and for a
        robot without them.
    transition_loss : float
        Kinetic energy that the resets of transitions within a step remove, zero with Coulomb friction.
    impulse_generated, impulse_absorbed : float
        Positive and negative work of impulses of the actuators, both >= 0; zero without such impulses.  `actuator` does
        not contain them.
    largest_kinetic : float
        Largest kinetic energy of the motion, which is no entry of the ledger; 0 if it is unknown.

    Examples
    --------
    >>> Ledger(actuator=3.0, gravity=1.0, impact_loss=2.5, friction_loss=1.5, kinetic_change=0.0).residual
    0.0
    """

    actuator: float
    gravity: float
    impact_loss: float
    friction_loss: float
    kinetic_change: float
    damping_loss: float = 0.0
    elastic_change: float = 0.0
    transition_loss: float = 0.0
    impulse_generated: float = 0.0
    impulse_absorbed: float = 0.0
    largest_kinetic: float = 0.0

    @property
    def losses(self) -> float:
        """Energy dissipated at touchdowns, by sliding, by dampers and at transitions [J]."""
        return self.impact_loss + self.friction_loss + self.damping_loss + self.transition_loss

    @property
    def residual(self) -> float:
        """Closing error of the ledger [J]."""
        changes = self.kinetic_change, self.damping_loss, self.elastic_change, self.transition_loss
        supplied = self.actuator + self.gravity + self.impulse_generated - self.impulse_absorbed
        return supplied - self.impact_loss - self.friction_loss - sum(changes)

    @property
    def relative_residual(self) -> float:
        """Closing error relative to the largest entry of the ledger; infinite if an entry is nan.

        If all entries are below 1e-6 of the largest kinetic energy, as in a motion without work and losses, the error
        is relative to this share of it.
        """
        entries = [getattr(self, each.name) for each in fields(self) if each.name != "largest_kinetic"]
        largest = worst(np.abs([*entries, LEAST_ENTRY * self.largest_kinetic]))
        if not np.isfinite(largest):
            return np.inf
        return worst(abs(self.residual) / largest) if largest > 0 else 0.0


@check_arguments
def ledger(motion: Motion) -> Ledger:
    """Return the energy ledger of a motion.

    Parameters
    ----------
    motion : Motion

    Returns
    -------
    Ledger

    Examples
    --------
    >>> from gaitopt import load, ledger
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> ledger(gait.motion).relative_residual < 1e-6
    True
    """
    segments = motion.segments
    if not segments:
        return Ledger(0.0, 0.0, 0.0, 0.0, 0.0)
    lost = sum(jump.energy_lost for jump in motion.jumps)
    end = segments[-1].kinetic[-1]
    if motion.jumps and motion.jumps[-1].step == segments[-1].step:  # nothing follows the last touchdown
        end -= motion.jumps[-1].energy_lost
    return Ledger(
        actuator=float(sum(segment.work[:, -1].sum() for segment in segments)),
        gravity=0.0 - float(sum(_rise(segment.potential - segment.elastic) for segment in segments)),
        impact_loss=float(lost),
        friction_loss=float(sum(segment.friction_work[-1] for segment in segments)),
        kinetic_change=float(end - segments[0].kinetic[0]),
        damping_loss=float(sum(segment.damping_work[-1] for segment in segments)),
        elastic_change=float(sum(_rise(segment.elastic) for segment in segments)),
        transition_loss=float(sum(map(_transition_loss, segments[:-1], segments[1:]))),
        largest_kinetic=find_largest_kinetic(segment.kinetic for segment in segments),
    )


def find_largest_kinetic(kinetic: Iterable[Array]) -> float:
    """Return the largest kinetic energy at the samples of a motion [J]; 0 without samples."""
    return worst(0.0, *kinetic)


@check_arguments
def absolute_work(motion: Motion) -> float:
    """Return the integral of the sum of absolute joint powers [J].

    A plan contains the positive work of each actuator.  Otherwise the work is known at the samples together with its
    rate, the power; where the power changes its sign between samples, the turning points of a Hermite interpolant of
    the work are used, so no kink is integrated over.

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> absolute_work(gait.motion) > ledger(gait.motion).actuator
    True
    """
    total = 0.0
    for segment in motion.segments:
        finite = all(np.all(np.isfinite(x)) for x in (segment.time, segment.work, segment.power))
        if segment.positive_work is not None and finite:
            total += float(np.sum(2 * segment.positive_work[:, -1] - segment.work[:, -1]))
            continue
        for work, power, torque in zip(segment.work, segment.power, segment.torque, strict=True):
            total += float(np.sum(integrate_absolute(segment.time, work, power, torque)))
    return total


@check_arguments
def positive_work(motion: Motion) -> float:
    """Return the integral of the positive parts of the joint powers [J].

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> 0 < positive_work(gait.motion) <= absolute_work(gait.motion)
    True
    """
    return (absolute_work(motion) + ledger(motion).actuator) / 2


@check_arguments
def cost_of_transport(motion: Motion) -> float:
    """Return absolute joint work over weight times travel (dimensionless), of the steps that reached their touchdown.

    Parameters
    ----------
    motion : Motion

    Returns
    -------
    float
        ``absolute_work / (m_total g L)`` with L the forward travel, foot slide included; nan if no step was completed
        or the travel is 0.

    Examples
    --------
    >>> from gaitopt import load, cost_of_transport
    >>> round(cost_of_transport(load("docs/examples/compass_slip.h5").motion), 3)
    0.016
    """
    if not motion.jumps:
        return float("nan")
    walked = replace(motion, segments=tuple(s for s in motion.segments if s.step <= motion.jumps[-1].step))
    weighed = motion.total_mass * motion.parameters["gravity"] * motion.travel
    return absolute_work(walked) / weighed if weighed else float("nan")


def _transition_loss(before: Segment, after: Segment) -> float:
    """Return the kinetic energy lost between two segments of a step, 0 if it is within the error of event location."""
    if before.step != after.step:
        return 0.0
    loss = float(before.kinetic[-1] - after.kinetic[0])
    return 0.0 if abs(loss) <= CONTINUOUS * abs(before.kinetic[-1]) else loss


def _rise(values: Array) -> float:
    """Return the difference of the last and the first of some samples."""
    return float(values[-1] - values[0])


def integrate_absolute(time: Array, work: Array, power: Array, torque: Array) -> Array:
    """Return the integral of the absolute power of an actuator over each sampling interval, shape (K-1,) [J].

    The zeros of the power between samples are the turning points of a Hermite interpolant of the work, which passes
    through both ends and, if the torque is linear across a neighbouring sample, through that sample too.

    Parameters
    ----------
    time, work, power, torque : (K,) arrays
        Samples [s], [J], [W], [N m].

    Examples
    --------
    >>> integrate_absolute(np.array([0.0, 1.0]), np.array([0.0, 0.0]), np.array([-1.0, 1.0]), np.ones(2)).round(3)
    array([0.5])
    """
    step, rise = np.diff(time), np.diff(work)
    variation = np.abs(rise)
    finite = np.isfinite(power[:-1]) & np.isfinite(power[1:]) & np.isfinite(rise) & np.isfinite(step)
    variation[~finite] = np.nan
    finite &= step > 0
    slack = ROUNDING * np.max(np.abs(np.concatenate([power[:-1] * step, rise])[np.tile(finite, 2)]), initial=0.0)
    straight, usable = _is_straight(time, torque) & _is_even(step), np.append(finite, False)
    for k in np.flatnonzero(finite & _may_vanish(step, rise, power, slack)):
        ends = [k, k + 1]
        if straight[k + 1] and usable[k + 1]:
            ends.append(k + 2)
        elif straight[k] and usable[k - 1]:
            ends.append(k - 1)
        variation[k] = _variation_between(time[ends], work[ends], power[ends])
    return variation


def _may_vanish(step: Array, rise: Array, power: Array, slack: float) -> NDArray[np.bool_]:
    """Return whether the power may change its sign in each sampling interval, shape (K-1,).

    The cubic Hermite interpolant of the work has the slopes left, middle and right as Bernstein coefficients of its
    derivative; the derivative has no zero if they have the same sign.
    """
    left, right = power[:-1] * step, power[1:] * step
    middle = 3 * rise - left - right
    slopes = np.stack([left, middle, right])
    return (slopes.min(axis=0) < -slack) & (slopes.max(axis=0) > slack)


def _is_straight(time: Array, torque: Array) -> NDArray[np.bool_]:
    """Return whether a torque is linear across each sample, False at both ends, shape (K,)."""
    before, after = np.diff(time)[:-1], np.diff(time)[1:]
    with np.errstate(divide="ignore", invalid="ignore"):
        line = torque[:-2] + before / (before + after) * (torque[2:] - torque[:-2])
        off = np.abs(torque[1:-1] - line) <= STRAIGHT * np.max(np.abs(torque), initial=0.0)
    return np.concatenate([[False], off & (before > 0) & (after > 0), [False]])


def _is_even(step: Array) -> NDArray[np.bool_]:
    """Return whether the sampling intervals on either side of each sample have similar lengths, shape (K,)."""
    before, after = step[:-1], step[1:]
    return np.concatenate([[False], np.minimum(before, after) * UNEVEN > np.maximum(before, after), [False]])


def _variation_between(time: Array, work: Array, power: Array) -> float:
    """Return the variation of the Hermite interpolant of some samples of the work between the first two."""
    begin, length = time[0], time[1] - time[0]
    at = (time - begin) / length
    interpolant = _hermite(at, work - work[0], power * length)
    slope = interpolant.deriv()
    zeros = np.roots(slope.coef[::-1])
    inside = np.sort(zeros[np.abs(zeros.imag) < 1e-9].real)
    inside = inside[(inside > 0) & (inside < 1)]
    values = interpolant(np.concatenate([[0.0], inside, [1.0]]))
    values[-1] = work[1] - work[0]
    return float(np.sum(np.abs(np.diff(values))))


def _hermite(at: Array, values: Array, slopes: Array) -> Polynomial:
    """Return the polynomial with the given values and slopes at some points."""
    count = 2 * at.size
    matrix = np.vander(at, count, increasing=True)
    derivative = np.hstack([np.zeros((at.size, 1)), matrix[:, :-1] * np.arange(1, count)])
    return Polynomial(np.linalg.solve(np.vstack([matrix, derivative]), np.concatenate([values, slopes])))
