"""The energy ledger of a motion and the cost of transport."""

from dataclasses import astuple, dataclass, replace

import numpy as np

from gaitopt.motion.motion import Array, Motion, Segment
from gaitopt.reductions import worst

CONTINUOUS = 1e-9
"""Relative difference of the kinetic energies before and after a transition that is due to its location."""


@dataclass(frozen=True)
class Ledger:
    """Sources and losses of the energy of a motion [J].

    actuator + gravity = impact_loss + friction_loss + damping_loss + transition_loss + kinetic_change
    + elastic_change, up to `residual`.

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

    @property
    def losses(self) -> float:
        """Energy dissipated at touchdowns, by sliding, by dampers and at transitions [J]."""
        return self.impact_loss + self.friction_loss + self.damping_loss + self.transition_loss

    @property
    def residual(self) -> float:
        """Closing error of the ledger [J]."""
        changes = self.kinetic_change, self.damping_loss, self.elastic_change, self.transition_loss
        return self.actuator + self.gravity - self.impact_loss - self.friction_loss - sum(changes)

    @property
    def relative_residual(self) -> float:
        """Closing error relative to the largest entry of the ledger; infinite if an entry is nan."""
        largest = worst(np.abs(astuple(self)))
        return worst(abs(self.residual) / largest) if largest > 0 else 0.0


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
        gravity=-float(sum(_rise(segment.potential - segment.elastic) for segment in segments)),
        impact_loss=float(lost),
        friction_loss=float(sum(segment.friction_work[-1] for segment in segments)),
        kinetic_change=float(end - segments[0].kinetic[0]),
        damping_loss=float(sum(segment.damping_work[-1] for segment in segments)),
        elastic_change=float(sum(_rise(segment.elastic) for segment in segments)),
        transition_loss=float(sum(map(_transition_loss, segments[:-1], segments[1:]))),
    )


def absolute_work(motion: Motion) -> float:
    """Return the integral of the sum of absolute joint powers [J].

    The work of each actuator is known at the samples together with its rate, the power; between samples with powers
    of opposite sign the turning point of the cubic Hermite interpolant is used, so no kink is integrated over.

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> absolute_work(gait.motion) > ledger(gait.motion).actuator
    True
    """
    return sum(
        float(np.sum(_rise_and_fall(segment.time, work, power)))
        for segment in motion.segments
        for work, power in zip(segment.work, segment.power, strict=True)
    )


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
    """Return the kinetic energy lost between two segments of a step, 0 if it is rounding."""
    if before.step != after.step:
        return 0.0
    loss = float(before.kinetic[-1] - after.kinetic[0])
    return 0.0 if abs(loss) <= CONTINUOUS * abs(before.kinetic[-1]) else loss


def _rise(values: Array) -> float:
    """Return the difference of the last and the first of some samples."""
    return float(values[-1] - values[0])


def _rise_and_fall(time: Array, work: Array, power: Array) -> Array:
    """Return the total variation of a cubic Hermite interpolant over each sampling interval, shape (K-1,)."""
    step, rise = np.diff(time), np.diff(work)
    variation = np.abs(rise)
    left, right = power[:-1] * step, power[1:] * step
    finite = np.isfinite(left) & np.isfinite(right) & np.isfinite(rise)
    variation[~finite] = np.nan
    for k in np.flatnonzero(finite & (left * right < 0)):
        # Hermite slope on [0, 1] with end slopes a, b and rise c: a quadratic with one root inside.
        a, b, c = left[k], right[k], rise[k]
        roots = np.roots([3 * (a + b - 2 * c), 2 * (3 * c - 2 * a - b), a])
        inside = [r.real for r in roots if abs(r.imag) < 1e-12 and 0 < r.real < 1]
        if inside:
            s = inside[0]
            top = a * s * (1 - s) ** 2 - b * s**2 * (1 - s) + c * s**2 * (3 - 2 * s)
            variation[k] = abs(top) + abs(c - top)
    return variation
