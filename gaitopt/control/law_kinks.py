"""Undefined torques and kinks of a law at the planned motion, where it has no derivative."""

from collections.abc import Iterator
from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import AnyGait, PlanarGait

NONSMOOTH = frozenset(
    {ca.OP_FABS, ca.OP_FMIN, ca.OP_FMAX, ca.OP_IF_ELSE_ZERO, ca.OP_SQRT, ca.OP_POW, ca.OP_CONSTPOW}
    | {ca.OP_LT, ca.OP_LE, ca.OP_SIGN, ca.OP_COPYSIGN, ca.OP_ASIN, ca.OP_ACOS}
)
"""Operations of which a continuous torque may have a kink."""

STEP = 1e-5
"""Change of a coordinate or rate [rad, m, rad/s or m/s] by which the slopes on both sides are compared."""

LEAST_KINK = 1e-6
"""Least difference of the slopes on both sides that is a kink, relative to 1 plus the slope."""

PERSISTENCE = 0.5
"""Least ratio of this difference at a step to that at a step ten times as large; it is 0.1 for a smooth torque."""

ON_PLAN = 1e-6
"""Largest difference from the planned torque for which the walker follows the plan, relative to 1 plus the torque."""

CONSECUTIVE = 3
"""Number of consecutive samples with a kink from which the motion is along the kink and does not only cross it."""


class _PlannedPhase(NamedTuple):
    """Samples of a phase of the plan on which one law acts."""

    law: Law
    slide: int
    time: Array
    q: Array
    v: Array
    torque: Array


def require_derivative(gait: AnyGait, law: Law | PlanarLaw) -> None:
    """Raise InputError if a law has a kink along the planned motion, so that the return map has no derivative.

    A law may have kinks elsewhere, which the motion crosses at isolated instants: its torque is continuous there.

    Examples
    --------
    >>> from gaitopt import load
    >>> from gaitopt.control import feedforward
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> require_derivative(gait, feedforward(gait.robot, gait.motion))
    """
    parts = (law,) if isinstance(law, Law) else law.parts
    if any(part.memory.events for part in parts) or not any(map(_may_have_kinks, parts)):
        return
    names = ("x", "y", *gait.robot.angles) if isinstance(gait, Gait) else gait.robot.coordinates
    latched = np.array(parts[0].memory.latch(*_first_state(gait), parts[0].table[:, 0])).ravel()
    for phase in _list_phases(gait, law):
        place = _find_kink(phase, latched)
        if place is not None:
            actuator, entry = gait.robot.actuators[place[0]], place[1]
            state = f"the {'coordinate' if entry < len(names) else 'rate of'} {names[entry % len(names)]!r}"
            raise InputError(
                f"The law {law.name!r} has a kink at the planned motion: the torque of {actuator!r} has different "
                f"derivatives with respect to {state} on both sides of it, so that the return map has no derivative "
                "and the gait no multipliers. Use a smooth form, such as sqrt(x**2 + width**2) for fabs(x), and a "
                "blend with tanh((q - plan) / width) for an if_else that switches at the plan."
            )


def require_finite_torques(gait: AnyGait, law: Law | PlanarLaw) -> None:
    """Raise InputError if a torque of a law is nan or infinite along the planned motion; laws with events are skipped.

    Examples
    --------
    >>> from gaitopt import load
    >>> from gaitopt.control import feedforward
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> require_finite_torques(gait, feedforward(gait.robot, gait.motion))
    """
    parts = (law,) if isinstance(law, Law) else law.parts
    if any(part.memory.events for part in parts):
        return
    latched = np.array(parts[0].memory.latch(*_first_state(gait), parts[0].table[:, 0])).ravel()
    for phase in _list_phases(gait, law):
        torque = _evaluate(phase, latched, None, 0.0)
        for actuator, values in zip(gait.robot.actuators, torque, strict=True):
            if not np.all(np.isfinite(values)):
                first = int(np.argmin(np.isfinite(values)))
                raise InputError(
                    f"The law {law.name!r} returns {values[first]:g} as the torque of {actuator!r} at "
                    f"{phase.time[first]:.3g} s of the planned motion. Check the law for divisions by zero, also by a "
                    "gain that is zero, and for the square root or logarithm of a negative number."
                )


def _may_have_kinks(law: Law) -> bool:
    """Return whether the torque of a law contains an operation that may have a kink."""
    return any(law.control.instruction_id(step) in NONSMOOTH for step in range(law.control.n_instructions()))


def _first_state(gait: AnyGait) -> tuple[Array, Array]:
    first = gait.motion.segments[0]
    return first.q[:, 0], first.v[:, 0]


def _list_phases(gait: AnyGait, law: Law | PlanarLaw) -> Iterator[_PlannedPhase]:
    """Yield the phases of the first period of the plan with the law that acts there."""
    begin = gait.motion.segments[0].time[0]
    if isinstance(gait, Gait) and isinstance(law, Law):
        for one in gait.motion.segments:
            if one.step == gait.motion.segments[0].step:
                yield _PlannedPhase(law, one.mode.sign, one.time - begin, one.q, one.v, one.torque)
    if isinstance(gait, PlanarGait) and isinstance(law, PlanarLaw):
        number = 0
        for each, event in zip(gait.motion.segments, gait.motion.events, strict=True):
            yield _PlannedPhase(law.parts[number], 0, each.time - begin, each.q, each.v, each.torque)
            ends = event.is_impact or law.ending(number) in event.names
            number = min(number + ends, len(law.parts) - 1)


def _find_kink(phase: _PlannedPhase, latched: Array) -> tuple[int, int] | None:
    """Return the actuator and the entry of the state (q, v) of a kink along a phase, or None."""
    base = _evaluate(phase, latched, None, 0.0)
    on_plan = np.max(np.abs(base - phase.torque) / (1 + np.abs(phase.torque)), axis=0, initial=0.0) <= ON_PLAN
    on_plan[[0, -1]] = False  # a piece of the law may begin or end there
    for entry in range(2 * phase.q.shape[0]):
        differences = []
        for step in (STEP, 10 * STEP):
            sides = [_evaluate(phase, latched, entry, sign * step) - base for sign in (1, -1)]
            differences.append(np.abs(sides[0] + sides[1]) / step)
            slope = np.max(np.abs(sides), axis=0) / step
        kinks = (differences[0] > LEAST_KINK * (1 + slope)) & (differences[0] > PERSISTENCE * differences[1]) & on_plan
        for actuator, row in enumerate(kinks):
            if np.any(np.convolve(row, np.ones(CONSECUTIVE), "valid") >= CONSECUTIVE):
                return actuator, entry
    return None


def _evaluate(phase: _PlannedPhase, latched: Array, entry: int | None, change: float) -> Array:
    """Return the torque at all samples, shape (n_u, K), with a changed entry of the state (q, v)."""
    law, n, count = phase.law, phase.q.shape[0], phase.time.size
    y = np.vstack([phase.q, phase.v])
    columns = [law.data(t, np.append(state, latched)) for t, state in zip(phase.time, y.T, strict=True)]
    if entry is not None:
        y[entry] += change
    values = np.tile(latched[:, None], count)
    torque = law.control(phase.time[None], y[:n], y[n:], values, np.full((1, count), phase.slide), np.array(columns).T)
    return np.asarray(torque[0], dtype=float)
