"""Output of the commands on walks."""

from typing import TYPE_CHECKING, Any

from rich import box
from rich.markup import escape
from rich.table import Table

from gaitopt.cli.output import out, verdict_text
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.energy import ledger
from gaitopt.motion.printable import format_count
from gaitopt.motion.summary import ledger_facts
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.simulator import Rollout
from gaitopt.stability.critical_friction import describe_critical_friction
from gaitopt.stability.cycle import Cycle
from gaitopt.study.basins.basin_file import basin_key, ending_labels, ending_shares

if TYPE_CHECKING:
    import xarray as xr

    from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine

    AnyEngine = Engine | PlanarEngine

ROUNDING, LEAST_STATE = 1e-9, 1e-12
"""Magnitudes of parts of multipliers, and of values of a state, below which they are printed as 0."""


def print_cycles(cycles: tuple[Cycle, ...], engine: Engine, law: str = "") -> None:
    """Print periodic gaits as a table, whose title names the feedback law if there is one."""
    if not cycles:
        out.print(f"no periodic gait found (engine {engine.name}); try more --starts or another slope or friction")
        return
    table = Table(
        box=box.SIMPLE,
        pad_edge=False,
        show_lines=True,
        title=f"periodic gaits{f' under {escape(law)}' if law else ''} (engine {engine.name})",
        caption="State after touchdown [rad, rad/s, m/s]. Critical friction: lowest friction without slipping. "
        f"Parts of multipliers below {ROUNDING:g} are printed as 0.",
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("sequence")
    for column in ("state", "period [s]", "multipliers", "stable", "critical friction"):
        table.add_column(column, no_wrap=True)
    for cycle in cycles:
        table.add_row(
            cycle.sequence + (f"\nfoot speed changes by {cycle.drift:+.4g} m/s per period" if cycle.drift else ""),
            "\n".join(f"{name} {format_state(value)}" for name, value in cycle.state.items()),
            f"{cycle.period:.7g}",
            "\n".join(_multipliers(cycle)),
            verdict_text("yes" if cycle.stable else "no", cycle.stable),
            describe_critical_friction(cycle.critical_friction, cycle.sequence),
        )
    out.print(table)


def format_state(value: float) -> str:
    """Return a coordinate or rate of a state with 6 digits; magnitudes below `LEAST_STATE` are printed as 0.

    Examples
    --------
    >>> format_state(-2.5e-26), format_state(0.45)
    ('0', '0.45')
    """
    return f"{value if abs(value) >= LEAST_STATE else 0.0:.6g}"


def basin_facts(table: "xr.Dataset", engine: "AnyEngine | None" = None, share: float | None = None) -> dict[str, Any]:
    """Return a basin as plain data; `share` is the fraction of starts that end in the saved gait."""
    return {
        **({} if engine is None else {"engine": engine.name}),
        "robot": basin_key(table)["robot"],
        "complete": bool(table.attrs["complete"]),
        "axes": basin_key(table)["axes"],
        "fractions": ending_shares(table),
        "saved_gait": share,
        "endings": ending_labels(table).tolist(),
    }


def print_basin(table: "xr.Dataset", engine: "AnyEngine | None" = None, share: float | None = None) -> None:
    """Print the fraction of starts with each ending, and of those that end in the saved gait."""
    for label, fraction in ending_shares(table).items():
        out.print(f"{100 * fraction:6.2f} %  {label}")
    if share is not None:
        out.print(f"{100 * share:6.2f} %  in the saved gait")
    if engine is not None:
        out.print(f"engine {engine.name}")


def _multipliers(cycle: Cycle) -> list[str]:
    """Return the multipliers in lines; those of each side if the impact is on the boundary of its friction cone."""
    if not cycle.one_sided:
        return [format_multiplier(value) for value in cycle.multipliers]
    stick, slip = ([format_multiplier(value) for value in side] for side in cycle.one_sided_multipliers)
    return ["one-sided, impact sticks:", *stick, "one-sided, impact slips:", *slip]


def format_multiplier(value: complex) -> str:
    """Return a multiplier with 6 digits; parts below `ROUNDING` are printed as 0."""
    real, imaginary = (0.0 if abs(part) < ROUNDING else part for part in (value.real, value.imag))
    return f"{real:.6g} {imaginary:+.6g}i" if imaginary else f"{real:.6g}"


def walk_facts(walk: Rollout) -> dict[str, Any]:
    """Return a simulated walk as plain data."""
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
    """Return the contact sequence of each completed step."""
    phases: dict[int, list[Mode]] = {}
    for segment in walk.motion.segments:
        phases.setdefault(segment.step, []).append(segment.mode)
    ended = (jump for jump in walk.motion.jumps if jump.step in phases)
    return {jump.step: str(ContactSequence(tuple(phases[jump.step]), jump.mode)) for jump in ended}


def print_walk(walk: Rollout) -> None:
    """Print the event log of a walk as a table, and the reason of its end."""
    table = Table(box=box.SIMPLE, pad_edge=False, title=f"events (engine {walk.engine})", title_justify="left")
    for column in ("step", "time [s]", "event", "from", "to", "energy lost [J]", "contact sequence of the step"):
        table.add_column(column, no_wrap=column != "contact sequence of the step")
    sequences = _sequences(walk)
    for event in walk.events:
        lost, sequence = (f"{event.energy_lost:.6g}", sequences.get(event.step, "")) if event.impulse else ("", "")
        cells = (str(event.step + 1), f"{event.time:.6f}", event.name, event.before, event.after, lost)
        table.add_row(*cells, sequence)
    out.print(table)
    out.print(f"{format_count(len(walk.motion.jumps), 'step')}: {walk.stop.hint}")


def print_numbers(numbers: list[dict[str, Any]], remarks: tuple[str, ...]) -> None:
    """Print computed and published numbers as a table."""
    table = Table(box=box.SIMPLE, pad_edge=False)
    for column in ("number", "computed", "published", "difference", "agrees", "source"):
        table.add_column(column, no_wrap=column in ("computed", "published", "difference"))
    for n in numbers:
        unit = "" if n["unit"] == "1" else f" {n['unit']}"
        table.add_row(
            n["name"],
            f"{n['value']:.10g}{unit}",
            f"{n['reference']:.10g}{unit}",
            f"{n['difference']:.1e}",
            verdict_text("yes" if n["agrees"] else "no", n["agrees"]),
            n["source"],
        )
    if numbers:
        out.print(table)
    for remark in remarks:
        out.print(remark)
