"""Periodic gaits in plain data."""

from typing import Any

from gaitopt.motion.summary import plain
from gaitopt.stability.cycle import Cycle


def summarise_cycle(cycle: Cycle) -> dict[str, Any]:
    """Return the facts of a periodic gait as plain data that any JSON reader takes.

    Parameters
    ----------
    cycle : Cycle

    Returns
    -------
    dict
        SI units; a multiplier is a pair [real part, imaginary part].

    Examples
    --------
    >>> import math
    >>> from gaitopt import find_cycles, rimless_wheel
    >>> gait = find_cycles(rimless_wheel(), {"slope": math.radians(13)}, starts=20)[0]
    >>> summarise_cycle(gait)["stable"]
    True
    """
    critical, energy = cycle.critical_friction, cycle.energy
    sides = [_pairs(matrix) for matrix in cycle.one_sided_multipliers]
    return plain(
        {
            "word": cycle.word,
            "state": cycle.state,
            "steps": len(cycle.words),
            "period": cycle.period,
            "step_length": cycle.travel / len(cycle.words),
            "multipliers": _pairs(cycle.multipliers),
            "one_sided_multipliers": dict(zip(("stick", "slip"), sides, strict=True)) if sides else None,
            "radius": cycle.radius,
            "stable": cycle.stable,
            "foot_speed_drift": cycle.drift,
            "critical_friction": None if critical is None else critical.friction,
            "critical_impact_ratio": None if critical is None else critical.impact,
            "impact_ratio": cycle.impact_ratio,
            "residual": cycle.residual,
            "energy": {
                "actuator": energy.actuator,
                "gravity": energy.gravity,
                "impact_loss": energy.impact_loss,
                "friction_loss": energy.friction_loss,
                "kinetic_change": energy.kinetic_change,
                "residual": energy.residual,
                "relative_residual": energy.relative_residual,
            },
        }
    )


def _pairs(values: Any) -> list[list[float]]:
    return [[float(value.real), float(value.imag)] for value in values]
