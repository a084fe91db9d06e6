"""Output of the command that tests the robustness of a gait."""

import dataclasses
import math
import shlex
import statistics
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich import box
from rich.table import Table

from gaitopt.cli.feedback_output import describe_ends, describe_failures, describe_settling
from gaitopt.cli.output import out
from gaitopt.motion.printable import format_count, format_radius
from gaitopt.motion.quantity_labels import in_shown_unit, show_unit

if TYPE_CHECKING:
    from gaitopt.stability.recovery import Recovery
    from gaitopt.study.robustness.robustness_record import RobustnessRecord

RECOVERY = "recovery"
"""Name of the test that measures the fraction of pushes in a ball after which the walker returns."""

UNITS = {"friction patch": "coefficient of friction"}
"""Texts in the column of units, for kinds of disturbances without a unit."""

EXPLANATIONS = {
    "slope": "Slopes: changes relative to the slope of the gait.",
    "friction patch": "Friction patch: decrease of the coefficient of friction in the first five steps.",
    "torque noise": "Torque noise: standard deviation.",
}
"""Explanations of kinds of disturbances, by a part of their names."""


def recovery_facts(recovery: "Recovery | None") -> dict[str, Any] | None:
    """Return the fraction of pushes in a ball after which a walker returns, and in how many steps, as plain data."""
    if recovery is None:
        return None
    settling = recovery.settling
    return {
        "starts": recovery.starts,
        "returned": recovery.returned,
        "fraction": recovery.fraction,
        "steps_to_settle": {"median": statistics.median(settling), "most": max(settling)} if settling else None,
    }


def endurance_facts(record: "RobustnessRecord") -> dict[str, Any]:
    """Return the disturbances survived, and the recovery from a ball of pushes in open loop and under the law."""
    return {
        "starts": record.starts,
        **condition_facts(record),
        "survived": [dataclasses.asdict(each) for each in record.margins],
        "push_radius": record.ball,
        "basin_before": recovery_facts(record.recoveries.get("open loop")),
        "basin_after": recovery_facts(record.recoveries.get(record.law)),
        "missing": list(record.missing),
    }


def condition_facts(record: "RobustnessRecord") -> dict[str, Any]:
    """Return the friction and the torque limits of a push test; None if a file does not contain them."""
    limits = record.torque_limits
    return {
        "friction": None if math.isnan(record.friction) else record.friction,
        "torque_limits": None if limits is None else dict(limits),
    }


def format_limits(limits: Mapping[str, float]) -> str:
    """Return torque limits by actuator as a text.

    Examples
    --------
    >>> format_limits({"ankle": 6.0, "hip": 6.0}), format_limits({"hip": 8.0, "slider [N]": 50.0}), format_limits({})
    ('6 N m (ankle, hip)', '8 N m (hip), 50 N (slider)', 'none')
    """
    names: dict[str, list[str]] = {}
    for label, limit in limits.items():
        name, _, unit = label.removesuffix("]").partition(" [")
        names.setdefault(f"{limit:.4g} {unit or 'N m'}", []).append(name)
    return ", ".join(f"{limit} ({', '.join(actuators)})" for limit, actuators in names.items()) or "none"


def _describe_conditions(facts: dict[str, Any]) -> str:
    """Return friction and torque limits of a push test after a comma; empty if they are not known."""
    friction, limits = facts.get("friction"), facts.get("torque_limits")
    texts = [] if friction is None else [f", friction {friction:.4g}"]
    texts += [] if limits is None else [f", torque limits: {format_limits(limits)}"]
    return "".join(texts)


def resume_text(missing: Sequence[str], output: Path | None) -> str:
    """Return how the kinds of disturbances are tested that an interrupt left without result.

    Examples
    --------
    >>> resume_text(["torque noise", "recovery"], None)
    "The same command with --kind 'torque noise' --kind recovery tests what is missing."
    >>> resume_text(["recovery"], Path("push.json"))
    'The same command completes push.json.'
    """
    if output:
        return f"The same command completes {output}."
    options = " ".join(f"--kind {shlex.quote(kind)}" for kind in missing)
    return f"The same command with {options} tests what is missing."


def print_endurance(facts: dict[str, Any], basins: "dict[str, Recovery | None]") -> None:
    """Print the largest disturbances survived as a table, and below it the recovery from a ball of pushes."""
    radius = format_radius(facts["radius"])
    out.print(f"{facts['law']}: spectral radius {radius}{_describe_conditions(facts)}", soft_wrap=True)
    table = Table(box=box.SIMPLE, pad_edge=False, caption=_explain_margins(facts, basins), caption_justify="left")
    for column in ("disturbance", "survived", "not survived", "unit"):
        table.add_column(column)
    for each in facts["survived"]:
        sizes = (math.nan if each[name] is None else each[name] for name in ("survived", "failed"))
        survived, failed = in_shown_unit(np.array(list(sizes)), each["unit"]).tolist()
        unit = UNITS.get(each["kind"], show_unit(each["unit"]))
        table.add_row(each["kind"], f"{survived:.4g}", "-" if math.isnan(failed) else f"{failed:.4g}", unit)
    if facts["survived"]:
        out.print(table)
    for each in facts["survived"]:
        if each["kind"] == "push" and (reason := _explain_small_push(facts, each)):
            out.print(f"push: {reason}", soft_wrap=True)
    for name, recovery in basins.items():
        text = "no periodic gait to return to"
        if recovery is not None:
            share = f"{recovery.returned} of {recovery.starts}"
            text = f"{share} walks return after pushes up to {recovery.radius:g} rad/s{describe_settling(recovery)}"
        out.print(f"{name}: {text}", soft_wrap=True)
    if missing := facts.get("missing"):
        out.print(f"not tested, since the test was interrupted: {', '.join(missing)}", soft_wrap=True)


def _explain_small_push(facts: dict[str, Any], push: dict[str, Any]) -> str:
    """Return why only negligible pushes are survived; empty if larger ones are, or the reason is not known."""
    from gaitopt.stability.unreturned_walk import SLOW

    if facts["radius"] >= 1:
        return f"none is survived, since the gait is unstable (spectral radius {format_radius(facts['radius'])})"
    failures = push.get("failures")
    if not failures:
        return ""
    counts, ends = describe_failures(facts.get("starts", 0), failures), describe_ends(push.get("ends", {}))
    text = f"some walks after pushes of at most {push['failed']:.2g} rad/s do not return{counts}{ends}"
    if set(failures) != {SLOW}:
        return text
    return (
        f"{text}: none ends or leads away from the gait, but the return takes more steps than are tested ('gaitopt "
        "tune --steps' tests more)"
    )


def _explain_margins(facts: dict[str, Any], basins: "dict[str, Recovery | None]") -> str:
    """Return the caption of the table of disturbances, which explains the tested kinds only."""
    kinds = {each["kind"] for each in facts["survived"]}
    criteria = []
    if "push" in kinds:
        recovery = next((each for each in basins.values() if each is not None), None)
        limit = f" (within {recovery.tolerance:g}) in {format_count(recovery.steps, 'step')}" if recovery else ""
        pushes = _describe_starts(facts.get("starts", 0))
        criteria.append(f"A push is survived if the walker returns to the gait{limit}{pushes}")
    if kinds - {"push"}:
        steps = f"{facts['steps']} steps" if "steps" in facts else "all steps"
        others = "any other disturbance if it" if criteria else "A disturbance is survived if the walker"
        criteria.append(f"{others} completes {steps}, possibly in another gait")
    texts = ["Largest disturbance survived and smallest one not survived, to the resolution of the search."]
    texts += [f"{', '.join(criteria)}."] if criteria else []
    texts += [text for kind, text in EXPLANATIONS.items() if any(kind in each for each in kinds)]
    if any(each["failed"] is None for each in facts["survived"]):
        texts.append("A dash (-) instead of one that is not survived: the largest disturbance tried is survived.")
    is_complete = bool(basins) and kinds >= {"push", "downhill slope", "uphill slope"}
    if is_complete and not facts.get("missing") and "torque noise" in kinds and "sensor delay" not in kinds:
        texts.append("No sensor delay: the law does not read the state.")
    return " ".join(texts)


def _describe_starts(starts: int) -> str:
    """Return the number of random pushes, with which the largest push survived decreases; empty if it is not known."""
    if not starts:
        return ""
    return (
        f" after each of {format_count(starts, 'random push', 'random pushes')} of at most this size (--starts; the "
        "verification of 'gaitopt tune' has 200 by default)"
    )
