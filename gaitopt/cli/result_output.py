"""Output of results read from files: tables for the terminal, and facts as plain data for JSON."""

import math
from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, Any

from rich import box
from rich.table import Table

from gaitopt.cli.output import out
from gaitopt.errors import InputError
from gaitopt.motion.printable import format_count, format_radius
from gaitopt.motion.summary import plain

if TYPE_CHECKING:
    from gaitopt.study.robustness.robustness_record import RobustnessRecord
    from gaitopt.tuning.tuning_file import TunedGains

OUTPUTS = {
    "Gait": ("gait_output:print_gait", "result_output:gait_facts"),
    "PlanarGait": ("gait_output:print_gait", "result_output:gait_facts"),
    "MultiStepGait": ("multistep_output:print_multistep", "multistep_output:multistep_facts"),
    "BranchDiagram": ("trace_output:print_diagram", "result_output:records_of"),
    "OptimalDiagram": ("trace_optimum_command:print_optima", "result_output:records_of"),
    "Ranking": ("study_output:print_ranking", "result_output:ranking_facts"),
    "Comparison": ("study_output:print_comparison", "result_output:comparison_facts"),
    "RobustnessRecord": ("result_output:print_robustness", "result_output:robustness_facts"),
    "TunedGains": ("result_output:print_gains", "result_output:gains_facts"),
    "gaitopt sweep": ("study_output:print_sweep", "study_output:sweep_facts"),
    "gaitopt basin": ("walk_output:print_basin", "walk_output:basin_facts"),
    "gaitopt set of basins along a branch": (
        "branch_basin_output:print_branch_basin",
        "branch_basin_output:branch_basin_facts",
    ),
    "gaitopt front": ("pareto_command:print_front", "pareto_command:front_facts"),
}
"""Functions that print a result and return its facts, by the class of the result or the format of a dataset.

The functions are stated by name, so that only those in use are imported."""


def print_result(result: Any) -> None:
    """Print a result as a table; errors as :func:`find_facts`."""
    _find_function(result, 0)(result)


def find_facts(result: Any) -> dict[str, Any]:
    """Return the facts of a result as plain data.

    Raises
    ------
    InputError
        If the result is of a class without a table.
    """
    facts: dict[str, Any] = _find_function(result, 1)(result)
    return facts


def has_output(result: Any) -> bool:
    """Return whether a result can be printed."""
    return _kind_of(result) in OUTPUTS


def _kind_of(result: Any) -> str:
    """Return the format of a dataset, or the name of the class of a result."""
    return str(getattr(result, "attrs", {}).get("format") or type(result).__name__)


def _find_function(result: Any, place: int) -> Any:
    if not has_output(result):
        raise InputError(f"There is no table of an object of class {type(result).__name__}.")
    module, _, function = OUTPUTS[_kind_of(result)][place].partition(":")
    return getattr(import_module(f"gaitopt.cli.{module}"), function)


def gait_facts(gait: Any) -> dict[str, Any]:
    """Return the facts of a gait."""
    from gaitopt.motion.summary import summarise

    return summarise(gait)


def records_of(diagram: Any) -> dict[str, Any]:
    """Return the facts of a diagram of branches."""
    records: dict[str, Any] = diagram.records()
    return records


def ranking_facts(ranking: Any) -> dict[str, Any]:
    """Return the facts of a search, as the command search prints them."""
    return {"ranked": ranking.records(), "complete": ranking.complete}


def comparison_facts(comparison: Any) -> dict[str, Any]:
    """Return the facts of a comparison, as the command compare prints them."""
    return {"gaits": comparison.records()}


def robustness_facts(record: "RobustnessRecord") -> dict[str, Any]:
    """Return the facts of a push test, with the names of the command push where they are the same."""
    from gaitopt.cli.push_output import condition_facts, recovery_facts

    facts = {"law": record.law, "radius": record.radius, "steps": record.steps, "missing": list(record.missing)}
    facts |= {"starts": record.starts, **condition_facts(record)}
    survived = [vars(margin) for margin in record.margins]
    recoveries = {name: recovery_facts(recovery) for name, recovery in record.recoveries.items()}
    return plain(facts | {"survived": survived, "recoveries": recoveries})


def print_robustness(record: "RobustnessRecord") -> None:
    """Print a push test as a table."""
    from gaitopt.cli.push_output import print_endurance

    print_endurance(robustness_facts(record), dict(record.recoveries))


def gains_facts(tuned: "TunedGains") -> dict[str, Any]:
    """Return the facts of tuned gains, with the names of the command tune where they are the same."""
    return plain(
        {
            "law": tuned.family,
            "script_changed": tuned.script_changed,
            "gains": tuned.gains,
            "objective": tuned.objective,
            "radius_before": tuned.radius_before,
            "radius_after": tuned.radius,
            "multipliers": [[value.real, value.imag] for value in tuned.multipliers],
            "evaluations": len(tuned.trials),
            "torque_limit": tuned.settings.torque_limit,
            "verified": dict(tuned.verified),
        }
    )


def _limit_text(limit: float, unit: str) -> str:
    """Return the limit of an actuator with its unit."""
    return f"{limit:.4g} {unit}" if math.isfinite(limit) else "none"


def _describe_limits(tuned: "TunedGains") -> str:
    """Return the torque limits of a law, each in the unit of its actuator; files of earlier versions lack the units."""
    limits, unknown = tuned.settings.torque_limit, "N m or N" if tuned.several_contacts else "N m"
    if isinstance(limits, Mapping):
        units = {name: tuned.actuator_units.get(name, unknown) for name in limits}
        return ", ".join(f"{name} {_limit_text(limit, units[name])}" for name, limit in limits.items())
    different = list(dict.fromkeys(tuned.actuator_units.values())) or [unknown]
    if len(different) == 1 or not math.isfinite(limits):
        return _limit_text(limits, different[0])
    named = {unit: [name for name, each in tuned.actuator_units.items() if each == unit] for unit in different}
    return ", ".join(f"{_limit_text(limits, unit)} ({', '.join(names)})" for unit, names in named.items())


def print_gains(tuned: "TunedGains") -> None:
    """Print tuned gains as a table."""
    from gaitopt.cli.feedback_output import verification_text
    from gaitopt.tuning.gain_units import format_gains, tabulate_gains

    table = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    changed = "; its script has changed since the gains were tuned" if tuned.script_changed else ""
    table.add_row("law", f"{tuned.family}{changed}")
    gains = format_gains(tuned.family, tuned.gains, several_contacts=tuned.several_contacts is not False)
    table.add_row(*tabulate_gains(tuned.family, gains))
    table.add_row(
        "spectral radius",
        f"{format_radius(tuned.radius_before)} in open loop, {format_radius(tuned.radius)} under the law",
    )
    table.add_row("verified", verification_text(tuned.recovery, search_interrupted=tuned.search_interrupted))
    table.add_row("torque limits", _describe_limits(tuned))
    table.add_row("objective", tuned.objective)
    table.add_row("search", format_count(len(tuned.trials), "evaluation"))
    out.print(table)
