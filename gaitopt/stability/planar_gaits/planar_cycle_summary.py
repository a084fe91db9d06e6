"""Summary of periodic gaits of planar robots as plain data."""

from typing import Any

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.planar_gait_summary import event_facts
from gaitopt.motion.stated_changes import find_closing
from gaitopt.motion.summary import ledger_facts, plain
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
from gaitopt.stability.planar_gaits.planar_friction import impact_ratios


@check_arguments
def summarise_planar_cycle(cycle: PlanarCycle) -> dict[str, Any]:
    """Return the properties of a periodic gait as plain data for JSON, with the keys of a single-support gait and more.

    Parameters
    ----------
    cycle : PlanarCycle

    Returns
    -------
    dict
        SI units; a multiplier is a pair [real part, imaginary part].  `impacts` contains time, outcome, impulse
        [Lambda_t, Lambda_n] and energy lost of every impact, `forces` the largest normal force and the largest force
        ratio of every contact at the samples, both by contact.

    Examples
    --------
    >>> from gaitopt.model import vertical_hopper
    >>> from gaitopt.stability import find_planar_cycle
    >>> hop = find_planar_cycle(vertical_hopper(), [0.7, 0.2], [0, 0], {"gravity": 9.81}, section="sole closes")
    >>> summarise_planar_cycle(hop)["impacts"][0]["events"]
    ['full length closes', 'sole opens']
    """
    critical, last = cycle.critical_friction, cycle.motion.events[-1]
    (closing,) = find_closing([cycle.section])
    return plain(
        {
            "sequence": cycle.sequence,
            "state": cycle.state,
            "steps": 1,
            "period": cycle.period,
            "step_length": cycle.travel,
            "multipliers": [[float(value.real), float(value.imag)] for value in cycle.multipliers],
            "one_sided_multipliers": None,
            "radius": cycle.radius,
            "stable": cycle.stable,
            "foot_speed_drift": 0.0,
            "critical_friction": None if critical is None else critical.friction,
            "critical_impact_ratio": None if critical is None else critical.impact,
            "impact_ratio": impact_ratios(last).get(closing),
            "residual": cycle.residual,
            "energy": ledger_facts(cycle.energy),
            "impacts": _impacts(cycle),
            "forces": _forces(cycle),
        }
    )


def _impacts(cycle: PlanarCycle) -> list[dict[str, Any]]:
    """Return every impact of a gait."""
    names = cycle.motion.contacts
    return [
        {
            "time": event.time,
            "events": list(event.names),
            "outcome": {name: mode.value for name, mode in event.outcome.modes},
            "impulse": {name: impulse.tolist() for name, impulse in zip(names, event.impulse, strict=True)},
            "energy_lost": event.energy_lost,
            "actuator_impulses": event_facts(cycle.motion, event)["actuator_impulses"],
        }
        for event in cycle.motion.events
        if event.outcome is not None
    ]


def _forces(cycle: PlanarCycle) -> dict[str, dict[str, float]]:
    """Return the largest normal force and force ratio of every contact that closes."""
    facts = {}
    for place, name in enumerate(cycle.motion.contacts):
        closed = [s.force[place] for s in cycle.motion.segments if s.state.mode(name) is not Mode.FREE]
        if closed:
            tangential, normal = np.concatenate(closed, axis=-1)
            ratios = np.abs(tangential[normal > 0]) / normal[normal > 0]
            facts[name] = {
                "largest_normal": float(np.max(normal)),
                "largest_ratio": float(np.max(ratios, initial=0.0)),
            }
    return facts
