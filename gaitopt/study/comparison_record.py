"""The entries of a comparison for one gait, of robots with any contacts."""

from typing import Any

from gaitopt.motion.energy import absolute_work
from gaitopt.motion.gait import Gait
from gaitopt.motion.planar_gait import AnyGait, PlanarGait
from gaitopt.motion.planar_gait_summary import find_slides
from gaitopt.study.gait_metrics import force_ratio, peak_torques
from gaitopt.study.planar_metrics import largest_foot_ratio, largest_impulse_ratio


def record_gait(label: str, gait: AnyGait) -> dict[str, Any]:
    """Return the entries of a gait.

    Examples
    --------
    >>> from gaitopt import load
    >>> record = record_gait("slip", load("docs/examples/compass_slip.h5"))
    >>> record["sequence"], round(record["cost_of_transport"], 4)
    ('slip+ stick | slip+', 0.0159)
    """
    verification = gait.verification
    return {
        "label": label,
        "sequence": str(gait.sequence),
        "status": gait.status.key,
        "verified": None if verification is None else verification.passed,
        "objective": gait.problem["objective"],
        "objective_value": gait.solver.objective,
        "objective_unit": gait.problem.get("objective_unit", ""),
        "friction": gait.motion.parameters["friction"],
        "cost_of_transport": gait.cost_of_transport,
        "speed": gait.speed,
        "step_length": gait.step_length,
        "period": gait.period,
        **(_record_contacts(gait) if isinstance(gait, PlanarGait) else _record_foot(gait)),
        "energy_per_distance": energy_per_distance(gait),
    }


def _record_foot(gait: Gait) -> dict[str, Any]:
    return {
        "foot_slide": gait.motion.foot_slide,
        "peak_torque": peak_torques(gait),
        "force_ratio": force_ratio(gait),
        "impulse_ratio": gait.motion.jumps[0].ratio,
    }


def _record_contacts(gait: PlanarGait) -> dict[str, Any]:
    return {
        "foot_slide": find_slides(gait),
        "peak_torque": peak_torques(gait),
        "force_ratio": largest_foot_ratio(gait),
        "impulse_ratio": largest_impulse_ratio(gait),
    }


def list_energy_terms(gait: AnyGait) -> dict[str, float]:
    """Return the absolute work of a gait and the terms that add up to it [J].

    The terms ``damping_loss``, ``transition_loss`` and ``switched_springs`` are included if they are not zero.

    Examples
    --------
    >>> from gaitopt import load
    >>> terms = list_energy_terms(load("docs/examples/compass_slip.h5"))
    >>> total = terms.pop("absolute_work")
    >>> abs(total - sum(terms.values())) < 1e-4
    True
    """
    energy, switched = gait.energy, 0.0
    if isinstance(gait, PlanarGait):
        work, switched = gait.absolute_work, sum(event.switch_work for event in gait.motion.events)
    else:
        work = absolute_work(gait.motion)
    signed = energy.actuator - switched + energy.impulse_generated - energy.impulse_absorbed
    further = {"damping_loss": energy.damping_loss, "transition_loss": energy.transition_loss}
    return {
        "absolute_work": work,
        "impact_loss": energy.impact_loss,
        "friction_loss": energy.friction_loss,
        **{name: value for name, value in (further | {"switched_springs": -switched}).items() if value},
        "gravity": -energy.gravity,
        "twice_braking": work - signed,
    }


def energy_per_distance(gait: AnyGait) -> dict[str, float]:
    """Return the absolute work of a gait per distance and the terms that add up to it [J/m]; nan without travel.

    Examples
    --------
    >>> from gaitopt import load
    >>> round(energy_per_distance(load("docs/examples/compass_slip.h5"))["absolute_work"], 3)
    1.554
    """
    travel = gait.step_length or float("nan")
    return {name: value / travel for name, value in list_energy_terms(gait).items()}
