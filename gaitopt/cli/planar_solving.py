"""Optimal gaits of robots with several contacts: solution and output."""

from pathlib import Path
from typing import TYPE_CHECKING

from rich import box
from rich.table import Table

from gaitopt.cli.output import out, print_json, verdict_text
from gaitopt.errors import InputError
from gaitopt.status import Status

if TYPE_CHECKING:
    from gaitopt.motion.planar_gait import PlanarGait


def require_no_file(output: Path | None) -> None:
    """Raise InputError if a file is requested: gaits of robots with several contacts have no file format yet."""
    if output is not None:
        raise InputError(
            f"--output {output}: gaits of robots with several contacts are not saved; use --json for their numbers."
        )


def report_planar_gait(gait: "PlanarGait", *, json: bool) -> None:
    """Print a gait of a robot with several contacts, as JSON or as a table."""
    from gaitopt.motion.planar_gait_summary import summarise_planar

    if json:
        print_json(summarise_planar(gait) | {"file": None})
    else:
        print_planar_gait(gait)


def print_planar_gait(gait: "PlanarGait") -> None:
    """Print the facts of a gait of a robot with several contacts as a table."""
    from gaitopt.motion.planar_gait_summary import summarise_planar

    facts = summarise_planar(gait)
    table = Table(box=box.SIMPLE, show_header=False, pad_edge=False)
    table.add_column(style="bold", no_wrap=True)
    table.add_column()
    table.add_row("robot", facts["robot"])
    table.add_row("sequence", facts["sequence"])
    table.add_row("status", verdict_text(f"{gait.status.key}: {gait.status.hint}", gait.status is Status.SOLVED))
    if gait.verification is not None:
        replay = "passed" if gait.verification.passed else "; ".join(gait.verification.reasons)
        table.add_row("replay", verdict_text(replay, gait.verification.passed))
    table.add_row(gait.problem["objective"], f"{gait.solver.objective:.6g} {gait.problem['objective_unit']}")
    table.add_row("speed", f"{gait.speed:.4g} m/s")
    table.add_row("step length", f"{gait.step_length:.4g} m")
    for phase in facts["phases"]:
        table.add_row("phase", f"{phase['duration']:.4g} s  {phase['mode']}")
    for event in facts["events"]:
        impulses = ", ".join(f"{name} ({t:.4g}, {n:.4g}) N s" for name, (t, n) in event["impulse"].items())
        table.add_row("event", f"{event['time']:.4g} s  {' & '.join(event['names'])}  {impulses}".rstrip())
    for name, slide in facts["foot_slide"].items():
        table.add_row("slide", f"{name} {slide:.4g} m")
    for violation in facts["violations"]:
        table.add_row("violated", f"{violation['name']} at {violation['place']} by {violation['size']:.2e}")
    out.print(table)
