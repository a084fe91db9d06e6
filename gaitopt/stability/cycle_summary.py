"""Summary of periodic gaits as plain data."""

from typing import Any

from gaitopt.arguments import check_arguments
from gaitopt.motion.summary import ledger_facts, plain
from gaitopt.stability.cycle import Cycle


@check_arguments
def summarise_cycle(cycle: Cycle) -> dict[str, Any]:
    """Return the properties of a periodic gait as plain data for JSON.

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
    critical = cycle.critical_friction
    sides = [_pairs(matrix) for matrix in cycle.one_sided_multipliers]
    return plain(
        {
            "sequence": cycle.sequence,
            "state": cycle.state,
            "steps": len(cycle.sequences),
            "period": cycle.period,
            "step_length": cycle.travel / len(cycle.sequences),
            "multipliers": _pairs(cycle.multipliers),
            "one_sided_multipliers": dict(zip(("stick", "slip"), sides, strict=True)) if sides else None,
            "radius": cycle.radius,
            "stable": cycle.stable,
            "foot_speed_drift": cycle.drift,
            "critical_friction": None if critical is None else critical.friction,
            "critical_impact_ratio": None if critical is None else critical.impact,
            "impact_ratio": cycle.impact_ratio,
            "residual": cycle.residual,
            "energy": ledger_facts(cycle.energy),
        }
    )


def _pairs(values: Any) -> list[list[float]]:
    return [[float(value.real), float(value.imag)] for value in values]
