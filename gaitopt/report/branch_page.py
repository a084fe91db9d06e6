"""write_branch_page: a bifurcation diagram as one self-contained HTML page whose points play their gaits."""

from pathlib import Path

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.continuation.branch_diagram import BranchDiagram, count_steps, name_sides, omit_outcome
from gaitopt.continuation.gait_source import AnyWalkProblem, GaitSource, make_gait_source
from gaitopt.errors import InputError
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.link_roles import is_drawable
from gaitopt.motion.quantity_labels import label_quantity
from gaitopt.report.balance import spell_complex
from gaitopt.report.branch_chart import ShownGait, choose_gaits, describe_value, draw_diagram, show_value
from gaitopt.report.markup import Element, element, table, to_html
from gaitopt.report.page import document
from gaitopt.report.player import PlayedGait, make_player
from gaitopt.simulation.engine import Engine

MOST_GAITS = 40
"""Number of gaits that a page can play."""
HINT = (
    "Click a circle to play its gait, which has a circle for each of its steps; the numbered diamonds are the special"
    " points of the table."
)
MOST_STEPS = 4
"""Number of steps of a gait that are played."""


@check_arguments
def write_branch_page(
    diagram: BranchDiagram,
    problem: AnyWalkProblem,
    path: str | Path,
    *,
    coordinate: str | None = None,
    engine: Engine | None = None,
) -> Path:
    """Write a bifurcation diagram as one HTML page on which a click on a point plays the gait of this point.

    The page loads nothing from the network.

    Parameters
    ----------
    diagram : BranchDiagram
    problem : WalkProblem or PlanarWalkProblem
        The problem whose diagram it is.
    path : str or Path
        Usually ends in ``.html``.
    coordinate : str, optional
        Vertical axis; by default the first coordinate.
    engine : Engine, optional

    Returns
    -------
    Path

    Raises
    ------
    InputError
        If the diagram is empty or has no such coordinate.
    ArchiveError
        If the file is not writable.

    Examples
    --------
    >>> import math, tempfile
    >>> from gaitopt import WalkProblem, rimless_wheel, trace
    >>> wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": math.radians(13)})
    >>> diagram = trace(wheel, {"friction": (1.0, 0.98)})
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     page = write_branch_page(diagram, wheel, f"{folder}/wheel.html")
    ...     "branch-point" in page.read_text(encoding="utf-8")
    True
    """
    if not any(branch.values.size for branch in diagram.branches):
        raise InputError("The diagram has no branches to draw.")
    names = dict.fromkeys(name for branch in diagram.branches for name in branch.names)
    coordinate = coordinate or next(iter(names))
    if coordinate not in names:
        raise InputError(f"The gaits have no coordinate {coordinate!r}; they have {', '.join(names)}.")
    places = choose_gaits(diagram, coordinate, max(2, MOST_GAITS // len(diagram.branches)))
    source = make_gait_source(problem, {diagram.parameter: diagram.ends}, engine)
    title = f"{diagram.robot}: gaits over {diagram.parameter}".replace("_", " ")
    page = document(
        title,
        element("header", element("h1", title), element("p", HINT, class_="note")),
        element(
            "div",
            element(
                "div",
                draw_diagram(diagram, coordinate, places),
                _special_table(diagram),
                _list_parameters(diagram, source),
                class_="overview",
            ),
            element("div", *(_show_gait(source, diagram, place, hidden=place != places[0]) for place in places)),
            class_="branches",
        ),
        scripts=("player.js", "branches.js"),
        styles=("page.css", "parts.css", "branches.css"),
    )
    path = Path(path)
    with write_atomically(path) as temporary:
        temporary.write_text("<!doctype html>\n" + to_html(page) + "\n", encoding="utf-8")
    return path


def _list_parameters(diagram: BranchDiagram, source: GaitSource) -> Element:
    """Return the parameters of the robot but the one that varies as a table."""
    units = {each.name: each.unit for each in source.problem.robot.parameters}
    rows = [
        (label_quantity(name, units.get(name, "1")), show_value(value, units.get(name, "1")))
        for name, value in diagram.parameters.items()
        if name != diagram.parameter
    ]
    return element("details", element("summary", "Parameters"), table(rows, name="Parameters"), open="open")


def _special_table(diagram: BranchDiagram) -> Element | None:
    """Return the special points of all branches as a table; the gait after them, if it differs from that before."""
    listed = [(number, point) for number, branch in enumerate(diagram.branches) for point in branch.special]
    differ = [point.after != point.before for _, point in listed]
    rows = []
    for row, (number, point) in enumerate(listed, 1):
        before, after = map(count_steps, name_sides(point.before, point.after))
        value = show_value(point.value, diagram.unit)
        changed = [after if differ[row - 1] else "the same"] if any(differ) else []
        rows.append((str(row), str(number), point.label, value, before, *changed))
    gaits = ("before", "after") if any(differ) else ("sequence",)
    head = ("no.", "branch", "kind", label_quantity(diagram.parameter, diagram.unit), *gaits)
    return table(rows, head, name="Special points") if rows else None


def _show_gait(source: GaitSource, diagram: BranchDiagram, place: ShownGait, *, hidden: bool) -> Element:
    """Return the gait of a point: its facts, and a player of each of its steps."""
    branch, number = diagram.branches[place.branch], place.number
    value, state = float(branch.values[number]), dict(zip(branch.names, branch.states[number], strict=True))
    multipliers = [complex(each) for each in branch.multipliers[number] if np.isfinite(each)]
    facts = [
        (label_quantity(diagram.parameter, diagram.unit), show_value(value, diagram.unit)),
        ("sequence", count_steps(omit_outcome(branch.sequences[number]))),
        ("stable", "yes" if branch.stable[number] else "no"),
        ("multipliers", ", ".join(map(spell_complex, multipliers))),
        *(
            (label_quantity(name, unit), show_value(state[name], unit))
            for name, unit in zip(branch.names, branch.units, strict=True)
        ),
    ]
    motions, sequence = source.motions(value, state, branch.steps)[:MOST_STEPS], omit_outcome(branch.sequences[number])
    players = [
        element(
            "section",
            element("h3", f"Step {step + 1} of {branch.steps}") if branch.steps > 1 else None,
            make_player(PlayedGait(motion, motion.period, sequence), [], name=f"{place.name}-{step}"),
            class_="gait",
        )
        for step, motion in enumerate(motions)
        if is_drawable(motion)
    ]
    missing = None if players else element("p", "This gait was not found again and cannot be played.", class_="note")
    title = f"Branch {place.branch}, {describe_value(diagram, value)}"
    attributes = {"hidden": "hidden"} if hidden else {}
    return element(
        "div",
        element("h2", title),
        missing,
        *players,
        table(facts, name="Facts"),
        class_="branch-gait",
        id=place.name,
        **attributes,
    )
