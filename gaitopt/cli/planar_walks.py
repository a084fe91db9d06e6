"""Periodic gaits of robots with several contacts: search and output."""

import itertools
from typing import TYPE_CHECKING

from rich import box
from rich.markup import escape
from rich.table import Table

from gaitopt.cli.output import out, print_json, verdict_text
from gaitopt.cli.walk_output import format_multiplier, format_state
from gaitopt.errors import InputError
from gaitopt.simulation.engine_choice import planar_engine_named

if TYPE_CHECKING:
    from gaitopt.cli.inputs import Request
    from gaitopt.cli.planar_law_option import PlanarLawOption
    from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem


GUIDE = "The guide 'Stability and branches of a custom robot' explains the state from which gaits are sought."


def find_planar_gaits(
    request: "Request", starts: int, *, steps: int, law: "PlanarLawOption"
) -> tuple["PlanarCycle", ...] | None:
    """Return the periodic gaits of a robot with several contacts; None for a robot with one foot on the ground.

    A saved gait is assessed under a law; that of an optimal-control problem is solved first.

    Raises
    ------
    InputError
        If an option does not apply to the source, or no gait is found.
    """
    from gaitopt.cli.planar_gait_walk import find_planar_gait, is_planar_gait
    from gaitopt.stability.planar_gaits.planar_assessment import assess_planar
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem

    stated = request.stated if request.is_script else request.gait
    if is_planar_gait(stated):
        _check_steps(steps)
        engine, gait = planar_engine_named(request.engine), find_planar_gait(stated)
        return (assess_planar(gait, law.make(gait), engine=engine),)
    if isinstance(stated, PlanarWalkProblem) and isinstance(request.problem, PlanarWalkProblem):
        return search_planar(request.problem, starts, steps=steps, engine=request.engine)
    return None


def search_planar(problem: "PlanarWalkProblem", starts: int, *, steps: int, engine: str) -> tuple["PlanarCycle", ...]:
    """Return the periodic gaits of a robot with several contacts, stable ones first.

    Raises
    ------
    InputError
        If the period has several steps, or the engine is unknown or not installed.
    """
    _check_steps(steps)
    cycles = itertools.islice(problem.search(starts, engine=planar_engine_named(engine)), starts)
    return tuple(sorted(cycles, key=lambda cycle: cycle.radius))


def explain_no_gait(request: "Request", engine: str) -> str:
    """Return a sentence that states why no gait of a walking problem is found from its state."""
    from gaitopt.stability.planar_gaits.planar_walk_problem import PlanarWalkProblem

    problem = request.problem
    reason = problem.explain_failure(planar_engine_named(engine)) if isinstance(problem, PlanarWalkProblem) else ""
    return f"{reason} {GUIDE}"


def _check_steps(steps: int) -> None:
    """Raise InputError if the period has several steps."""
    if steps > 1:
        raise InputError(f"--steps must be 1 for a robot with several contacts, got {steps}.")


def report_planar_cycles(
    cycles: tuple["PlanarCycle", ...], engine: str, law: str, verified: bool | None, *, json: bool
) -> None:
    """Print periodic gaits of a robot with several contacts, as JSON with the engine that was used, or as a table.

    `verified` is whether the replay of a saved gait has passed, None for a script.
    """
    from gaitopt.stability.planar_gaits.planar_cycle_summary import summarise_planar_cycle

    if json:
        used, gaits = planar_engine_named(engine).name, [summarise_planar_cycle(cycle) for cycle in cycles]
        print_json({"engine": used, "gaits": gaits, "gait_verified": verified})
    else:
        print_planar_cycles(cycles, law)


def print_planar_cycles(cycles: tuple["PlanarCycle", ...], law: str = "") -> None:
    """Print periodic gaits of a robot with several contacts as a table, whose title names the feedback law if any."""
    from gaitopt.stability.critical_friction import describe_critical_friction

    if not cycles:
        out.print("no periodic gait found; try more --starts or another slope or friction")
        return
    first = cycles[0]
    excluded = f"; {first.motion.travel}, the position along the ground, does not repeat" if first.motion.travel else ""
    table = Table(
        box=box.SIMPLE,
        pad_edge=False,
        show_lines=True,
        title=f"periodic gaits{f' under {escape(law)}' if law else ''}",
        caption=f"State (SI units, rad) after the event '{first.section}' and the leg exchange, if any{excluded}. "
        "Critical friction: lowest friction without slipping.",
        title_justify="left",
        caption_justify="left",
    )
    table.add_column("sequence")
    for column in ("state", "period [s]", "multipliers", "stable", "critical friction"):
        table.add_column(column, no_wrap=True)
    for cycle in cycles:
        table.add_row(
            cycle.sequence,
            "\n".join(f"{name} {format_state(value)}" for name, value in cycle.periodic_state.items()),
            f"{cycle.period:.7g}",
            "\n".join(format_multiplier(value) for value in cycle.multipliers),
            verdict_text("yes" if cycle.stable else "no", cycle.stable),
            describe_critical_friction(cycle.critical_friction, cycle.sequence),
        )
    out.print(table)
