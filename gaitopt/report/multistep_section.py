"""The part of a page on a gait of several steps: its steps in a table, and its motion over time."""

import math

from gaitopt.errors import join_reasons
from gaitopt.motion.gait_table import name_objective
from gaitopt.motion.link_roles import is_drawable
from gaitopt.motion.verification_remark import remark_on_verification
from gaitopt.ocp.multistep.multistep_gait import MultiStepGait
from gaitopt.report.markup import Element, element, table
from gaitopt.report.motion_charts import portraits, time_charts
from gaitopt.report.sections import chart_figure

COLUMNS = {
    "sequence": "sequence",
    "friction": "friction",
    "slope": "slope [deg]",
    "step_length": "length [m]",
    "duration": "duration [s]",
    "rise": "rise [m]",
}
"""Headings of the facts of a step but its objective, by name; `rise` is stated on a terrain only."""


def multistep_section(gait: MultiStepGait, *, title: str, name: str) -> Element:
    """Return the section of a gait of several steps: facts, steps and charts.

    Parameters
    ----------
    gait : MultiStepGait
    title : str
    name : str
        Unique name among the sections of the page.
    """
    warning = remark_on_verification(gait)
    charts = [*time_charts(gait.motion, {}), *portraits(gait.motion)] if is_drawable(gait.motion) else []
    return element(
        "section",
        element("h2", title),
        element("p", warning, class_="warning") if warning else None,
        *_tables(gait),
        element("div", *map(chart_figure, charts), class_="grid-of-figures"),
        class_="gait",
        id=name,
    )


def multistep_card(gait: MultiStepGait) -> Element:
    """Return a summary of a gait of several steps: its facts, its steps, and its angles over time."""
    charts = time_charts(gait.motion, {})[:1] if is_drawable(gait.motion) else []
    return element("div", *_tables(gait), *map(chart_figure, charts))


def _tables(gait: MultiStepGait) -> tuple[Element, Element]:
    """Return the facts of a gait, and those of its steps."""
    replay = gait.verification
    verdict = "not replayed" if replay is None else "passed" if replay.passed else join_reasons(replay.reasons)
    objective = name_objective(*(step.objective.name for step in gait.problem.steps))
    facts = [
        ("robot", gait.problem.robot.name),
        ("status", f"{gait.status.key}: {gait.message}"),
        (objective, f"{gait.objective:.6g}"),
        ("periodic", "yes" if gait.problem.periodic else "no"),
        ("replay", verdict),
    ]
    stated = gait.summarise()["steps"]
    columns = {name: heading for name, heading in (COLUMNS | {"objective": objective}).items() if name in stated[0]}
    shown = [step | {"slope": math.degrees(step["slope"])} for step in stated]
    steps = [
        (str(number), *(value if isinstance(value, str) else f"{value:.4g}" for value in map(step.get, columns)))
        for number, step in enumerate(shown, start=1)
    ]
    return table(facts, name="Facts"), table(steps, ("step", *columns.values()), name="Steps")
