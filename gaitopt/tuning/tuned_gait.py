"""The gait for which gains were tuned, in the file of the gains, and its differences from another gait."""

import math
from collections.abc import Mapping
from typing import Any

from gaitopt.motion.planar_gait import AnyGait

UNITS = {"robot": "", "sequence": "", "cost_of_transport": "", "speed": "m/s", "step_length": "m", "period": "s"}
"""Quantities that identify a gait, in the order of messages, with their units; the parameters follow."""

SAME = 1e-3
"""Relative difference of a quantity up to which gaits are the same: solves on several grids differ by less."""

MOST = 6
"""Number of different quantities that a message states."""


def identify_gait(gait: AnyGait) -> dict[str, Any]:
    """Return the quantities that identify a gait as plain data: those of `UNITS` and all parameters.

    Examples
    --------
    >>> from gaitopt import load
    >>> facts = identify_gait(load("docs/examples/compass_slip.h5"))
    >>> facts["sequence"], round(facts["speed"], 3), facts["parameters"]["friction"]
    ('slip+ stick | slip+', 0.633, 0.14)
    """
    numbers = {name: float(getattr(gait, name)) for name in ("cost_of_transport", "speed", "step_length")}
    return {
        "robot": gait.robot_name,
        "sequence": str(gait.sequence),
        **numbers,
        "period": float(gait.motion.period),
        "parameters": {name: float(value) for name, value in gait.motion.parameters.items()},
    }


def compare_gaits(stored: Mapping[str, Any], gait: AnyGait) -> tuple[str, str]:
    """Return the quantities that differ between a stored gait and a gait, as two texts; empty if they are the same.

    Parameters
    ----------
    stored : mapping
        As :func:`identify_gait` returns them; empty if they are not known, as in files of earlier versions.
    gait : Gait or PlanarGait

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> other = {**identify_gait(gait), "speed": 0.7, "parameters": {**gait.motion.parameters, "friction": 0.2}}
    >>> compare_gaits(other, gait)
    ('speed 0.7 m/s, friction 0.2', 'speed 0.633 m/s, friction 0.14')
    """
    if not stored:
        return "", ""
    former, present = _flatten(stored), _flatten(identify_gait(gait))
    units = UNITS | {parameter.name: parameter.unit for parameter in gait.robot.parameters}
    names = [name for name in present if name in former and not _is_same(former[name], present[name])][:MOST]
    former_text, present_text = (
        ", ".join(_state(name, facts[name], units.get(name, "")) for name in names) for facts in (former, present)
    )
    return former_text, present_text


def _flatten(facts: Mapping[str, Any]) -> dict[str, Any]:
    return {**{name: facts[name] for name in UNITS if name in facts}, **facts.get("parameters", {})}


def _is_same(one: Any, other: Any) -> bool:
    """Return whether two values are equal to the accuracy of a solve; None, as nan in a file, is that of any gait."""
    if isinstance(other, str):
        return bool(one == other)
    return one is None or not math.isfinite(other) or math.isclose(one, other, rel_tol=SAME, abs_tol=1e-9)


def _state(name: str, value: Any, unit: str) -> str:
    """Return a quantity with its value and its unit."""
    text = repr(value) if name == "sequence" else value if isinstance(value, str) else f"{value:.4g}"
    return f"{name.replace('_', ' ')} {text} {'' if unit == '1' else unit}".rstrip()
