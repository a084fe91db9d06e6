"""Summary of a gait as plain data, for ``--json`` and tables."""

import dataclasses
import math
from typing import TYPE_CHECKING, Any

from gaitopt.arguments import check_arguments
from gaitopt.motion.energy import Ledger
from gaitopt.motion.gait import Gait
from gaitopt.motion.impact_edge import find_impact_edges

if TYPE_CHECKING:
    from gaitopt.motion.planar_gait import PlanarGait


@check_arguments
def summarise(gait: "Gait | PlanarGait") -> dict[str, Any]:
    """Return the facts of a gait as plain data for JSON (nan becomes null, inf the text "inf").

    Parameters
    ----------
    gait : Gait or PlanarGait

    Returns
    -------
    dict
        SI units; angles in rad.

    Examples
    --------
    >>> from gaitopt import load
    >>> summary = summarise(load("docs/examples/compass_slip.h5"))
    >>> summary["status"], [phase["mode"] for phase in summary["phases"]]
    ('solved', ['slip+', 'stick'])
    """
    if not isinstance(gait, Gait):
        from gaitopt.motion.planar_gait_summary import summarise_planar

        return summarise_planar(gait)
    motion, energy = gait.motion, gait.energy
    jump = motion.jumps[0]
    solver = dataclasses.asdict(gait.solver)
    violations, warnings, conflicts = (solver.pop(name) for name in ("violations", "warnings", "conflicts"))
    data = {
        "status": gait.status.key,
        "hint": gait.status.hint,
        "robot": gait.robot_name,
        "sequence": str(gait.sequence),
        "cost_of_transport": gait.cost_of_transport,
        "speed": gait.speed,
        "step_length": gait.step_length,
        "period": gait.period,
        "design": gait.design,
        "phases": [{"mode": segment.mode.value, "duration": segment.duration} for segment in motion.segments],
        "friction_margin": gait.friction_margin,
        "foot_slide": motion.foot_slide,
        "impact": {"mode": jump.mode.value, "ratio": jump.ratio},
        "energy": ledger_facts(energy),
        "verification": None if gait.verification is None else dataclasses.asdict(gait.verification),
        "proposal": None if gait.proposal is None else dataclasses.asdict(gait.proposal),
        "certificate": None if gait.certificate is None else dataclasses.asdict(gait.certificate),
        "solver": solver,
        "violations": violations,
        "conflicts": conflicts,
        "warnings": [*warnings, *map(str, find_impact_edges(gait))],
        "problem": gait.problem,
        "versions": gait.versions,
    }
    return plain(data)


def ledger_facts(energy: Ledger) -> dict[str, float]:
    """Return every entry of an energy ledger and its closing error by name [J]."""
    closing = {"residual": energy.residual, "relative_residual": energy.relative_residual}
    return {**dataclasses.asdict(energy), **closing}


def plain(value: Any) -> Any:
    """Return nested data with numbers that are valid in JSON: nan becomes None, infinities the text "inf" or "-inf"."""
    if isinstance(value, dict):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if hasattr(value, "item") and not isinstance(value, str):
        value = value.item()
    if isinstance(value, float) and not math.isfinite(value):
        return None if math.isnan(value) else ("inf" if value > 0 else "-inf")
    return value
