"""What the commands on walks print."""

from typing import TYPE_CHECKING, Any

from rich import box
from rich.markup import escape
from rich.table import Table

from gaitopt.cli.output import out
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.energy import ledger
from gaitopt.motion.summary import ledger_facts
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.simulator import Rollout
from gaitopt.stability.cycle import Cycle
from gaitopt.study.basins.basin_file import basin_question, ending_labels, ending_shares

if TYPE_CHECKING:
    import xarray as xr


def print_cycles(cycles: tuple[Cycle, ...], engine: Engine) -> None:
    """Print periodic gaits as a table."""
    if not cycles:
        out.print(f"no periodic gait found (engine {engine.name}); try more --starts or another slope or friction")
        return
    table = Table(
        box=box.SIMPLE,
        pad_edge=False,
        show_lines=True,
        title=f"periodic gaits (engine {engine.name})",
        caption="State just after touchdown in rad, rad/s, m/s. Needs: least friction without slipping.",
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("sequence")
    for column in ("state", "period [s]", "multipliers", "stable", "needs"):
        table.add_column(column, no_wrap=True)
    for cycle in cycles:
        critical = cycle.critical_friction
        table.add_row(
            cycle.sequence + (f"\nfoot speed {cycle.drift:+.4g} m/s a step" if cycle.drift else ""),
            "\n".join(f"{name} {value:.6g}" for name, value in cycle.state.items()),
            f"{cycle.period:.7g}",
            "\n".join(_multipliers(cycle)),
            "[green]yes[/]" if cycle.stable else "[red]no[/]",
            "(slips)" if critical is None else f"{critical.friction:.6g}",
        )
    out.print(table)


def basin_facts(table: "xr.Dataset", engine: Engine, own: float | None) -> dict[str, Any]:
    """Return a basin as plain data; `own` is the share of the starts that end in the gait it was asked about."""
    return {
        "engine": engine.name,
        "robot": basin_question(table)["robot"],
        "complete": bool(table.attrs["complete"]),
        "axes": basin_question(table)["axes"],
        "fractions": ending_shares(table),
        "saved_gait": own,
        "endings": ending_labels(table).tolist(),
    }


def print_basin(table: "xr.Dataset", engine: Engine, own: float | None) -> None:
    """Print the share of each ending, and of the gait that was asked about."""
    for label, share in ending_shares(table).items():
        out.print(f"{100 * share:6.2f} %  {escape(label)}")
    if own is not None:
        out.print(f"{100 * own:6.2f} %  in the saved gait itself")
    out.print(f"engine {engine.name}")


def _multipliers(cycle: Cycle) -> list[str]:
    """Return the lines that tell the multipliers, where the impact rests on the edge of its cone those of each side."""
    if not cycle.one_sided:
        return [_spelled(value) for value in cycle.multipliers]
    stick, slip = ([_spelled(value) for value in side] for side in cycle.one_sided_multipliers)
    return ["one-sided, impact sticks:", *stick, "impact slips:", *slip]


def _spelled(value: complex) -> str:
    return f"{value.real:.6g}" if abs(value.imag) < 1e-12 else f"{value.real:.6g} {value.imag:+.6g}i"


def walk_facts(walk: Rollout) -> dict[str, Any]:
    """Return a simulated walk as data."""
    return {
        "engine": walk.engine,
        "stop": walk.stop.key,
        "hint": walk.stop.hint,
        "steps": len(walk.motion.jumps),
        "sequences": list(_sequences(walk).values()),
        "events": [vars(event) for event in walk.events],
        "energy": ledger_facts(ledger(walk.motion)),
    }


def _sequences(walk: Rollout) -> dict[int, str]:
    """Return the contact sequence of each step that was walked to its end, in time that grows with the steps alone."""
    phases: dict[int, list[Mode]] = {}
    for segment in walk.motion.segments:
        phases.setdefault(segment.step, []).append(segment.mode)
    ended = (jump for jump in walk.motion.jumps if jump.step in phases)
    return {jump.step: str(ContactSequence(tuple(phases[jump.step]), jump.mode)) for jump in ended}


def print_walk(walk: Rollout) -> None:
    """Print the event log of a walk as a table, and why it ended."""
    table = Table(box=box.SIMPLE, pad_edge=False, title=f"events (engine {walk.engine})", title_justify="left")
    for column in ("step", "time [s]", "event", "from", "to", "energy lost [J]", "contact sequence of the step"):
        table.add_column(column, no_wrap=column != "contact sequence of the step")
    sequences = _sequences(walk)
    for event in walk.events:
        lost, sequence = (f"{event.energy_lost:.6g}", sequences.get(event.step, "")) if event.impulse else ("", "")
        cells = (str(event.step + 1), f"{event.time:.6f}", event.name, event.before, event.after, lost)
        table.add_row(*cells, sequence)
    out.print(table)
    out.print(f"{len(walk.motion.jumps)} steps: {walk.stop.hint}")


def print_numbers(numbers: list[dict[str, Any]], remarks: tuple[str, ...]) -> None:
    """Print computed numbers beside published ones."""
    table = Table(box=box.SIMPLE, pad_edge=False)
    for column in ("number", "ours", "published", "difference", "agrees", "source"):
        table.add_column(column, no_wrap=column in ("ours", "published", "difference"))
    for n in numbers:
        unit = "" if n["unit"] == "1" else f" {n['unit']}"
        agrees = "[green]yes[/]" if n["agrees"] else "[red]no[/]"
        table.add_row(
            escape(n["name"]),
            f"{n['value']:.10g}{unit}",
            f"{n['reference']:.10g}{unit}",
            f"{n['difference']:.1e}",
            agrees,
            escape(n["source"]),
        )
    if numbers:
        out.print(table)
    for remark in remarks:
        out.print(escape(remark))
