"""What the commands on feedback print."""

import statistics
from typing import Any

from rich import box
from rich.table import Table

from gaitopt.cli.output import err, out
from gaitopt.motion.summary import plain
from gaitopt.stability.recovery import Recovery
from gaitopt.tuning.record import Tuning


def tuning_facts(tuned: Tuning) -> dict[str, Any]:
    """Return what tuning found as plain data; no multipliers where the law leaves no periodic gait."""
    multipliers = [] if tuned.cycle is None else tuned.cycle.multipliers.tolist()
    return plain(
        {
            "law": tuned.design,
            "gains": tuned.gains,
            "radius_before": tuned.radius_before,
            "radius_after": tuned.radius_after,
            "multipliers": [[value.real, value.imag] for value in multipliers],
            "fixed_point_shift": tuned.fixed_point_shift,
            "verified": {
                "starts": tuned.verified.starts,
                "returned": tuned.verified.returned,
                "push_radius": tuned.verified.radius,
            },
            "evaluations": tuned.evaluations,
            "seconds": tuned.seconds,
        }
    )


def print_tuning(tuned: Tuning) -> None:
    """Print what tuning found as a table."""
    table = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    verified = tuned.verified
    table.add_row("law", tuned.design)
    table.add_row("gains", ", ".join(f"{name} {value:.4g}" for name, value in tuned.gains.items()))
    held = "[green]held[/]" if tuned.stable else "[red]not held: the best radius found[/]"
    table.add_row("spectral radius", f"{tuned.radius_before:.4g} before, {tuned.radius_after:.4g} after, {held}")
    if tuned.cycle is not None:
        table.add_row("fixed point", f"{tuned.fixed_point_shift:.1e} from the plan")
    table.add_row(
        "verified",
        f"{verified.returned} of {verified.starts} starts within {verified.radius:.4g} rad/s back on the gait "
        f"({verified.tolerance:g}) after {verified.steps} steps{_settled(verified)}",
    )
    table.add_row("search", f"{tuned.evaluations} evaluations, {tuned.seconds:.1f} s")
    out.print(table)


def print_unstabilised(tuned: Tuning) -> None:
    """Say that a gait is not held, and what was reached."""
    reached = "no gains tried leave a periodic gait near the plan"
    if tuned.cycle is not None:
        reached = f"the best spectral radius found is {tuned.radius_after:.4g}"
    err.print(f"[red]not held[/] by {tuned.design} within its torque limits: {reached}", soft_wrap=True)


def basin_facts(found: Recovery | None) -> dict[str, Any] | None:
    """Return from what share of a ball of pushes a walker returns, and in how many steps, as plain data."""
    if found is None:
        return None
    settling = found.settling
    return {
        "starts": found.starts,
        "returned": found.returned,
        "fraction": found.fraction,
        "steps_to_settle": {"median": statistics.median(settling), "most": max(settling)} if settling else None,
    }


def print_endurance(facts: dict[str, Any], basins: dict[str, Recovery | None]) -> None:
    """Print the largest disturbances survived as a table, and the shares of a ball of pushes below it."""
    title = f"{facts['law']}: spectral radius {facts['radius']:.4f}"
    caption = (
        "Push: back on the gait; else: all steps walked, if need be in another gait. "
        "Friction patch: how much less friction there is on it."
    )
    table = Table(
        box=box.SIMPLE, pad_edge=False, title=title, title_justify="left", caption=caption, caption_justify="left"
    )
    for column in ("disturbance", "survived", "failed", "unit"):
        table.add_column(column)
    for each in facts["survived"]:
        failed = "-" if each["failed"] is None else f"{each['failed']:.4g}"
        table.add_row(each["kind"], f"{each['survived']:.4g}", failed, each["unit"])
    out.print(table)
    for name, found in basins.items():
        told = "no periodic gait to return to"
        if found is not None:
            told = (
                f"{found.returned} of {found.starts} return from pushes up to {found.radius:g} rad/s{_settled(found)}"
            )
        out.print(f"{name}: {told}", soft_wrap=True)


def _settled(found: Recovery) -> str:
    if not found.settling:
        return ""
    return f", in {statistics.median(found.settling):g} steps by the median and {max(found.settling)} at most"
