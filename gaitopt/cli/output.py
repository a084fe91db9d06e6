"""What commands print: tables for people, one JSON object for programs."""

import json
import sys
from pathlib import Path
from typing import Any

from rich import box
from rich.console import Console
from rich.markup import escape
from rich.table import Table

from gaitopt.motion.gait import Gait
from gaitopt.motion.summary import summarise
from gaitopt.status import Status

# A file or a pipe has no width of its own: numbers must not be cut there to fit a terminal.
out = Console(highlight=False, width=None if sys.stdout.isatty() else 140)
err = Console(stderr=True, highlight=False)


def print_json(data: dict[str, Any]) -> None:
    """Print one JSON object on standard output, as it is (no wrapping, no colour)."""
    print(json.dumps(data, indent=2, allow_nan=False))


def print_written(path: Path) -> None:
    """Print which file was written, on one line however long."""
    out.print(f"wrote {escape(str(path))}", soft_wrap=True)


def print_gait(gait: Gait) -> None:
    """Print the facts of a gait as a table."""
    facts = summarise(gait)
    table = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    for name, text in _rows(gait, facts):
        table.add_row(name, text)
    out.print(table)


def _rows(gait: Gait, facts: dict[str, Any]) -> list[tuple[str, str]]:
    problem = facts["problem"]
    colour = "green" if gait.status.ok else "red"
    rows = [
        ("status", f"[{colour}]{gait.status.key}[/]: {gait.status.hint}"),
        ("word", str(gait.word)),
        (
            "robot",
            escape(f"{gait.robot}, friction {gait.motion.parameters['friction']:g}, objective {problem['objective']}"),
        ),
    ]
    if gait.status in (Status.SOLVED, Status.ACCEPTABLE, Status.NOT_VERIFIED):
        rows += _numbers(gait, facts)
    rows.append(
        (
            "solver",
            f"{gait.solver.message}, {gait.solver.iterations} iterations; "
            f"build {gait.solver.build_seconds:.2f} s, solve {gait.solver.solve_seconds:.2f} s",
        )
    )
    rows += [("warning", f"[yellow]{escape(warning)}[/]") for warning in gait.solver.warnings]
    rows += [("not met", escape(str(violation))) for violation in gait.solver.violations]
    return rows


def _numbers(gait: Gait, facts: dict[str, Any]) -> list[tuple[str, str]]:
    energy = gait.energy
    return [
        ("cost of transport", f"{gait.cost_of_transport:.6f}"),
        ("speed", f"{gait.speed:.6g} m/s"),
        ("step length", f"{gait.step_length:.6g} m"),
        ("period", f"{gait.period:.6g} s"),
        ("phases", ", ".join(f"{phase['mode']} {phase['duration']:.4g} s" for phase in facts["phases"])),
        ("friction margin", f"{gait.friction_margin:.2e} of the cone while sticking"),
        ("foot slide", f"{1e3 * gait.motion.foot_slide:.3f} mm"),
        ("impact", f"{facts['impact']['mode']}, impulse ratio {facts['impact']['ratio']:+.4f}"),
        (
            "energy",
            f"actuators {energy.actuator:.6f} J + gravity {energy.gravity + 0.0:.6f} J = "
            f"impact {energy.impact_loss:.6f} J + friction {energy.friction_loss:.6f} J, "
            f"closing error {energy.relative_residual:.1e}",
        ),
        ("replay", _replay(gait)),
    ]


def _replay(gait: Gait) -> str:
    verdict = gait.verification
    if verdict is None:
        return "not replayed"
    if not verdict.passed:
        return f"[red]failed[/]: {escape('; '.join(verdict.reasons))}"
    return (
        f"[green]passed[/]: word '{verdict.word}', state within {verdict.state_error:.1e}, "
        f"cost of transport {verdict.cost_of_transport:.6f}"
    )
