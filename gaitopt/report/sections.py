"""The parts of a page: a gait, a simulated walk, a periodic gait with its multipliers, a comparison."""

import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from gaitopt.errors import InputError
from gaitopt.motion.gait_table import tabulate_gait
from gaitopt.motion.link_roles import is_drawable
from gaitopt.motion.planar_gait import AnyGait, PlanarGait
from gaitopt.motion.printable import format_count
from gaitopt.motion.solve_table import Facts
from gaitopt.motion.verification_remark import remark_on_verification
from gaitopt.motion.view_motion import AnyMotion, view_motion
from gaitopt.report.balance import draw_ledger, draw_multipliers, spell_complex
from gaitopt.report.chart import Chart
from gaitopt.report.markup import Element, element, table
from gaitopt.report.motion_charts import force_ratio_chart, portraits, time_charts
from gaitopt.report.player import make_player
from gaitopt.simulation.simulator import Rollout
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.critical_friction import describe_critical_friction
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.planar_gaits.planar_assessment import assess_planar
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
from gaitopt.study.comparison import Comparison

AnyCycle = Cycle | PlanarCycle

MOST_EVENTS, MOST_STEPS = 40, 10
"""Number of events of a walk that are listed, and of steps that are drawn."""


def gait_section(gait: AnyGait, *, title: str, name: str) -> Element:
    """Return the section of a gait: player, charts, energy, multipliers, problem and versions.

    Parameters
    ----------
    gait : Gait or PlanarGait
    title : str
    name : str
        Unique name among the sections of the page.
    """
    drawable = is_drawable(gait.motion)
    charts = [*_time_charts(gait), *portraits(gait.motion)] if drawable else []
    warning = remark_on_verification(gait)
    return element(
        "section",
        element("h2", title),
        element("p", warning, class_="warning") if warning else None,
        element(
            "div",
            make_player(gait, charts, name=name) if drawable else _nothing_to_draw(),
            _figure("Facts", facts_table(gait)),
            *map(chart_figure, charts),
            *([_energy(gait)] if drawable else []),
            _stability(gait),
            class_="columns",
        ),
        _details("Problem, fully resolved", [(key, _plainly(value)) for key, value in gait.problem.items()]),
        _details("Versions", list(gait.versions.items())),
        class_="gait",
        id=name,
    )


def cycle_section(cycle: AnyCycle, *, title: str, name: str) -> Element:
    """Return the section of a periodic gait: player, charts, facts, multipliers, energy and parameters.

    Parameters
    ----------
    cycle : Cycle or PlanarCycle
    title : str
    name : str
        Unique name among the sections of the page.
    """
    charts = [*time_charts(cycle.motion, {}), *portraits(cycle.motion)]
    return element(
        "section",
        element("h2", title),
        element(
            "div",
            make_player(cycle, charts, name=name),
            _figure("Facts", _cycle_table(cycle)),
            *map(chart_figure, charts),
            _figure("Energy of a period", draw_ledger(cycle.energy)),
            _figure("Multipliers", _multipliers(cycle.multipliers.tolist())),
            class_="columns",
        ),
        _details("Parameters", [(key, _plainly(value)) for key, value in cycle.parameters.items()]),
        class_="gait",
        id=name,
    )


def gait_card(gait: AnyGait) -> Element:
    """Return a summary of a gait: its facts, force ratio and energy."""
    drawings = []
    if is_drawable(gait.motion):
        chart = force_ratio_chart(gait.motion) or _time_charts(gait)[-1]
        drawings = [chart_figure(chart), _energy(gait)]
    return element("div", facts_table(gait), *drawings, class_="grid-of-figures")


def walk_card(walk: Rollout) -> Element:
    """Return a simulated walk: the reason of its end, its events, and its angles over time."""
    rows = [
        (str(event.step + 1), f"{event.time:.6f}", event.name, event.before, event.after)
        for event in walk.events[:MOST_EVENTS]
    ]
    more = len(walk.events) - len(rows)
    beginning = replace(walk.motion, segments=tuple(s for s in walk.motion.segments if s.step < MOST_STEPS))
    charts = time_charts(beginning, {}) if beginning.segments and is_drawable(beginning) else []
    return element(
        "div",
        element("p", f"{format_count(len(walk.motion.jumps), 'step')}: {walk.stop.hint} (engine {walk.engine})"),
        table(rows, ("step", "time [s]", "event", "from", "to"), name="Events"),
        element("p", f"and {format_count(more, 'more event')}") if more > 0 else None,
        element("div", *map(chart_figure, charts[:1]), class_="grid-of-figures"),
    )


def cycle_card(cycle: AnyCycle) -> Element:
    """Return a periodic gait: its facts, its multipliers on the unit circle, and its energy."""
    return element(
        "div",
        _cycle_table(cycle),
        _figure("Multipliers", _multipliers(cycle.multipliers.tolist())),
        _figure("Energy of a period", draw_ledger(cycle.energy)),
        class_="grid-of-figures",
    )


def _cycle_table(cycle: AnyCycle) -> Element:
    """Return the facts of a periodic gait as a table."""
    state = cycle.periodic_state if isinstance(cycle, PlanarCycle) else cycle.state
    facts = [
        ("sequence", cycle.sequence),
        ("stable", f"{'yes' if cycle.stable else 'no'}: largest modulus {cycle.radius:.6g}"),
        *((name, f"{value:.9g} {_state_unit(cycle.motion, name)}".rstrip()) for name, value in state.items()),
        ("period", f"{cycle.period:.7g} s"),
        ("travel", f"{cycle.travel:.7g} m"),
        ("critical friction", describe_critical_friction(cycle.critical_friction, cycle.sequence)),
        ("residual", f"{cycle.residual:.1e}"),
        ("section", f"right after {cycle.section}") if isinstance(cycle, PlanarCycle) else ("engine", cycle.engine),
    ]
    return table(facts, name="Facts")


def _state_unit(motion: AnyMotion, name: str) -> str:
    """Return the unit of a coordinate of a section, or of a rate."""
    view, coordinate = view_motion(motion), name.removesuffix("_rate")
    if name == "foot_speed":
        return "m/s"
    unit = next((unit for unit in ("rad", "m") for _, channel in view.channels(unit) if channel.name == coordinate), "")
    return f"{unit}/s" if unit and name != coordinate else unit


def comparison_section(gaits: Mapping[str, AnyGait]) -> Element:
    """Return a comparison of gaits by title, one column each."""
    return element("section", element("h2", "Comparison"), _side_by_side(gaits), class_="comparison")


def comparison_card(comparison: Comparison) -> Element:
    """Return a comparison of gaits, the energy ledger of each, and the assessed multipliers."""
    energies = [
        _figure(f"Energy of the step, {label}", draw_ledger(gait.energy))
        for label, gait in comparison.gaits.items()
        if is_drawable(gait.motion)
    ]
    circles = [
        _figure(f"Floquet multipliers, {label}", _multipliers(list(values)))
        for label, values in comparison.multipliers.items()
    ]
    return element(
        "div", _side_by_side(comparison.gaits), element("div", *energies, *circles, class_="grid-of-figures")
    )


def _side_by_side(gaits: Mapping[str, AnyGait]) -> Element:
    columns = [_join_facts(tabulate_gait(gait)) for gait in gaits.values()]
    names = dict.fromkeys(name for column in columns for name in column)
    rows = [(name, *(column.get(name, "\N{EN DASH}") for column in columns)) for name in names]
    return table(rows, ("", *gaits), name="Comparison of gaits")


def _join_facts(facts: Facts) -> dict[str, str]:
    """Return facts by name; facts with the same name, such as phases, are joined to one text."""
    joined: dict[str, list[str]] = {}
    for name, text in facts:
        joined.setdefault(name, []).append(text)
    return {name: "; ".join(texts) for name, texts in joined.items()}


def facts_table(gait: AnyGait) -> Element:
    """Return the facts of a gait as a table."""
    return table(tabulate_gait(gait), name="Facts")


def chart_figure(chart: Chart) -> Element:
    """Return a chart with its title, and the key and current value of each line."""
    keys = [
        element("span", element("i", class_=f"key-line {line.style}"), line.label, " ", element("output"))
        for line in chart.lines
    ]
    keys += [element("span", element("i", class_=f"key-line {stem.style}"), stem.label) for stem in chart.stems]
    return _figure(chart.title, chart.draw(), element("p", *keys, class_="key"), class_="chart")


def _time_charts(gait: AnyGait) -> list[Chart]:
    return time_charts(gait.motion, gait.problem.get("torque_limit") or {})


def _figure(title: str, *content: Element, class_: str | None = None) -> Element:
    return element("figure", element("figcaption", title), *content, class_=class_)


def _energy(gait: AnyGait) -> Element:
    energy = gait.energy
    note = element("p", f"the balance closes within {energy.relative_residual:.1e} of its largest entry", class_="note")
    return _figure("Energy of the step", draw_ledger(energy), note)


def _stability(gait: AnyGait) -> Element:
    """Return the multipliers of the gait with its torques replayed, or the reason why they are missing."""
    title = "Floquet multipliers, torques replayed in open loop"
    try:
        cycle = assess_planar(gait) if isinstance(gait, PlanarGait) else assess_stability(gait)
    except InputError as error:
        return _figure(title, element("p", f"Not assessed. {error}", class_="note"))
    verdict = "stable" if cycle.stable else "unstable"
    engine = f" (engine {cycle.engine})" if isinstance(cycle, Cycle) else ""
    note = element("p", f"{verdict}: largest modulus {cycle.radius:.4g}{engine}", class_="note")
    return _figure(title, _multipliers(cycle.multipliers.tolist()), note)


def _multipliers(values: list[complex]) -> Element:
    """Return multipliers as a picture and as a table."""
    rows = [(spell_complex(value), spell_complex(abs(value))) for value in values]
    numbers = table(rows, ("multiplier", "modulus"), name="Multipliers")
    return element("div", draw_multipliers(values), numbers, class_="side-by-side")


def _nothing_to_draw() -> Element:
    return element("p", "The last iterate is not finite and is not drawn.", class_="warning")


def _details(title: str, rows: list[tuple[str, str]]) -> Element:
    return element("details", element("summary", title), table(rows, name=title))


def _plainly(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value)
