"""write_branch_page: a bifurcation diagram as one self-contained HTML page whose points play their gaits."""

import math
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.continuation.branch_diagram import (
    BranchDiagram,
    GaitBranch,
    count_steps,
    list_gait_names,
    name_gaits,
    split_branch,
)
from gaitopt.continuation.gait_source import AnyWalkProblem, GaitSource, make_gait_source
from gaitopt.continuation.special_point import SpecialPoint
from gaitopt.errors import InputError
from gaitopt.motion.atomic import write_atomically
from gaitopt.motion.link_roles import is_drawable
from gaitopt.motion.motion import Array
from gaitopt.motion.printable import typeset_powers
from gaitopt.report.balance import spell_complex
from gaitopt.report.chart import COLOURS, Chart, Curve
from gaitopt.report.markup import Element, element, points, table, to_html
from gaitopt.report.page import document
from gaitopt.report.player import PlayedGait, make_player
from gaitopt.simulation.engine import Engine

MOST_GAITS = 40
"""Number of gaits that a page can play."""
HINT = "Click a circle to play its gait; the numbered diamonds are the special points of the table."
MOST_STEPS = 4
"""Number of steps of a gait that are played."""


class _ShownGait(NamedTuple):
    """A gait of a diagram by the number of its branch and its place there."""

    branch: int
    number: int

    @property
    def name(self) -> str:
        return f"gait-{self.branch}-{self.number}"


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
    places = list(_choose_places(diagram))
    source = make_gait_source(problem, {diagram.parameter: diagram.ends}, engine)
    title = f"{diagram.robot}: gaits over {diagram.parameter}"
    page = document(
        title,
        element("header", element("h1", title), element("p", HINT, class_="note")),
        element(
            "div",
            element("div", _draw_diagram(diagram, coordinate, places), _special_table(diagram), class_="overview"),
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


def _choose_places(diagram: BranchDiagram) -> Iterator[_ShownGait]:
    """Yield gaits of all branches, evenly spaced along each of them."""
    share = max(2, MOST_GAITS // max(len(diagram.branches), 1))
    for number, branch in enumerate(diagram.branches):
        count = min(share, branch.values.size)
        for place in sorted({round(each) for each in np.linspace(0, branch.values.size - 1, count)}):
            yield _ShownGait(number, place)


def _draw_diagram(diagram: BranchDiagram, coordinate: str, places: list[_ShownGait]) -> Element:
    """Return the branches as an SVG element with a circle for each gait that can be played."""
    chart = _make_chart(diagram, coordinate)
    drawing = chart.draw()
    for part in [*drawing.findall("polyline"), *drawing.findall("circle")]:
        drawing.remove(part)  # branches are drawn by stability
    names = list_gait_names(diagram)
    for branch in diagram.branches:
        values, heights = _values(diagram, branch), _heights(branch, coordinate)
        drawing.extend(_branch_lines(chart, branch, values, heights, names))
    for place in places:
        branch = diagram.branches[place.branch]
        height = float(_heights(branch, coordinate)[0][place.number])
        x, y = chart.place(float(_values(diagram, branch)[place.number]), height)
        drawing.append(_point(diagram, place, x, y))
    pairs = [(branch, point) for branch in diagram.branches for point in branch.special]
    for number, (branch, point) in enumerate(pairs, 1):
        for height in _special_heights(branch, coordinate, point):
            x, y = chart.place(_in_unit(diagram, point.value), height)
            mark = element("text", "\N{BLACK DIAMOND}", class_="special", x=round(x, 1), y=round(y + 3, 1))
            mark.append(element("title", str(point)))
            drawing.extend([mark, element("text", str(number), class_="number", x=round(x + 3, 1), y=round(y - 4, 1))])
    key = [
        element("span", element("i", class_=f"key-line line-{number % COLOURS}"), name, class_="named")
        for number, name in enumerate(names)
    ]
    caption = element("figcaption", "Branches: solid stable, dashed unstable")
    return element("figure", caption, drawing, element("p", *key, class_="sequences"), class_="diagram")


def _make_chart(diagram: BranchDiagram, coordinate: str) -> Chart:
    """Return the chart whose axes contain all branches."""
    unit = next(
        unit
        for branch in diagram.branches
        for name, unit in zip(branch.names, branch.units, strict=True)
        if name == coordinate
    )
    known = [branch for branch in diagram.branches if coordinate in branch.names]
    lines = [
        Curve(label=f"branch {number}", x=(_values(diagram, branch),), y=(row,))
        for number, branch in enumerate(known)
        for row in _heights(branch, coordinate)
    ]
    axis = "deg" if diagram.unit == "rad" else typeset_powers(diagram.unit)
    name = diagram.parameter.replace("_", " ")
    return Chart(
        title=f"{coordinate} over {diagram.parameter}",
        x_label=name if axis in ("", "1") else f"{name} [{axis}]",
        y_label=f"{coordinate.replace('_', ' ')} [{'deg' if unit == 'rad' else typeset_powers(unit)}]",
        unit="",
        lines=lines,
        closed=True,
    )


def _in_unit(diagram: BranchDiagram, value: float) -> float:
    return math.degrees(value) if diagram.unit == "rad" else value


def _values(diagram: BranchDiagram, branch: GaitBranch) -> Array:
    return np.degrees(branch.values) if diagram.unit == "rad" else branch.values


def _heights(branch: GaitBranch, coordinate: str) -> list[Array]:
    """Return the coordinate of all gaits at the start of each step; none if the branch does not have it."""
    if coordinate not in branch.names:
        return [np.full(branch.values.size, np.nan)]
    place = branch.names.index(coordinate)
    rows = branch.orbits[:, :, place].T
    return list(np.degrees(rows) if branch.units[place] == "rad" else rows)


def _special_heights(branch: GaitBranch, coordinate: str, point: SpecialPoint) -> list[float]:
    """Return the coordinate at a special point at the start of each step; empty if the branch does not have it."""
    if coordinate not in branch.names:
        return []
    place = branch.names.index(coordinate)
    heights = branch.orbit_of(point)[:, place]
    return (np.degrees(heights) if branch.units[place] == "rad" else heights).tolist()


def _branch_lines(
    chart: Chart, branch: GaitBranch, values: Array, heights: list[Array], names: list[str]
) -> Iterator[Element]:
    """Yield the pieces of a branch of equal sequence and stability as lines in the colour of sequence and period."""
    for piece, sequence, stable in split_branch(branch):
        kind, colour = "stable" if stable else "unstable", names.index(name_gaits(sequence, branch.steps)) % COLOURS
        for row in heights:
            places = [chart.place(float(x), float(y)) for x, y in zip(values[piece], row[piece], strict=True)]
            yield element("polyline", class_=f"line line-{colour} {kind}", points=points(*places))


def _point(diagram: BranchDiagram, place: _ShownGait, x: float, y: float) -> Element:
    """Return the circle of a gait that can be played."""
    branch = diagram.branches[place.branch]
    value = f"{diagram.parameter} = {_in_unit(diagram, float(branch.values[place.number])):.6g}"
    circle = element(
        "circle",
        class_="branch-point",
        cx=round(x, 1),
        cy=round(y, 1),
        r=2.6,
        tabindex=0,
        role="button",
        aria_label=f"Gait at {value}",
        data_gait=place.name,
    )
    circle.append(element("title", f"{value}: {count_steps(branch.sequences[place.number])}"))
    return circle


def _special_table(diagram: BranchDiagram) -> Element | None:
    """Return the special points of all branches as a table."""
    listed = [(number, point) for number, branch in enumerate(diagram.branches) for point in branch.special]
    rows = [
        (
            str(row),
            str(number),
            point.kind.label,
            f"{point.value:.9g}",
            count_steps(point.before),
            "" if point.after == point.before else count_steps(point.after),
        )
        for row, (number, point) in enumerate(listed, 1)
    ]
    head = ("no.", "branch", "kind", f"{diagram.parameter} [{diagram.unit}]", "before", "after")
    return table(rows, head, name="Special points") if rows else None


def _show_gait(source: GaitSource, diagram: BranchDiagram, place: _ShownGait, *, hidden: bool) -> Element:
    """Return the gait of a point: its facts, and a player of each of its steps."""
    branch, number = diagram.branches[place.branch], place.number
    value, state = float(branch.values[number]), dict(zip(branch.names, branch.states[number], strict=True))
    multipliers = [complex(each) for each in branch.multipliers[number] if np.isfinite(each)]
    facts = [
        (f"{diagram.parameter} [{diagram.unit}]", f"{value:.9g}"),
        ("sequence", count_steps(branch.sequences[number])),
        ("stable", "yes" if branch.stable[number] else "no"),
        ("multipliers", ", ".join(map(spell_complex, multipliers))),
        *((f"{name} [{unit}]", f"{state[name]:.9g}") for name, unit in zip(branch.names, branch.units, strict=True)),
    ]
    motions = source.motions(value, state, branch.steps)[:MOST_STEPS]
    players = [
        element(
            "section",
            element("h3", f"Step {step + 1} of {branch.steps}") if branch.steps > 1 else None,
            make_player(PlayedGait(motion, motion.period, branch.sequences[number]), [], name=f"{place.name}-{step}"),
            class_="gait",
        )
        for step, motion in enumerate(motions)
        if is_drawable(motion)
    ]
    missing = None if players else element("p", "This gait was not found again and cannot be played.", class_="note")
    title = f"Branch {place.branch}, {diagram.parameter} = {_in_unit(diagram, value):.6g}"
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
