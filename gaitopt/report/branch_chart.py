"""The diagram of branches as SVG, with circles of the gaits that can be played and numbers of the special points."""

import math
from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from gaitopt.continuation.branch_diagram import (
    BranchDiagram,
    GaitBranch,
    count_steps,
    name_sides,
    omit_outcome,
    split_branch,
)
from gaitopt.continuation.gait_names import name_gaits
from gaitopt.continuation.special_point import SpecialPoint
from gaitopt.motion.motion import Array
from gaitopt.motion.printable import typeset_powers
from gaitopt.motion.quantity_labels import in_shown_unit, label_quantity
from gaitopt.report.chart import COLOURS, HEIGHT, WIDTH, Chart, Curve
from gaitopt.report.markup import Element, element, points

LETTER, LINE = 5.0, 8.0
"""Width and height of a letter of a number [px]."""

SHIFTS = tuple(
    (along * side, up * above)
    for along, above in ((5.0, 8.0), (7.0, 0.0), (5.0, 14.0), (12.0, 10.0), (5.0, 22.0), (14.0, 18.0), (5.0, 32.0))
    for up in (-1, 1)
    for side in (1, -1)
)
"""Places of a number beside its special point, best first [px]."""

CIRCLE, DIAMOND, LEAST_SHARE = 2.6, 8.0, 0.45
"""Radius of a circle and size of a diamond of gaits of one step [px], and least share of them for longer periods."""

SPACING = 12.0
"""Least distance of the circles of a branch along its line [px]."""

NEAR = 13.0
"""Distance from its special point beyond which a line joins a number with it [px]."""

_Box = tuple[float, float, float, float]
"""Middle of a box and half of its width and height [px]."""


class ShownGait(NamedTuple):
    """A gait of a diagram by the number of its branch and its place there."""

    branch: int
    number: int

    @property
    def name(self) -> str:
        """Name of the gait in the page."""
        return f"gait-{self.branch}-{self.number}"


def choose_gaits(diagram: BranchDiagram, coordinate: str, most: int) -> list[ShownGait]:
    """Return gaits evenly spaced along each branch, at least one, whose circles leave the lines of the branch visible.

    Parameters
    ----------
    diagram : BranchDiagram
    coordinate : str
        Vertical axis.
    most : int
        Largest number of gaits of a branch.
    """
    chart, chosen = _make_chart(diagram, coordinate), list[ShownGait]()
    for number, branch in enumerate(diagram.branches):
        lengths = np.max([_measure_path(chart, diagram, branch, row) for row in _heights(branch, coordinate)], axis=0)
        count = int(np.clip(lengths[-1] / SPACING, 1, min(most, branch.values.size)))
        goals = np.linspace(0, lengths[-1], count) if count > 1 else lengths[-1:] / 2
        places = {int(np.argmin(np.abs(lengths - goal))) for goal in goals}
        chosen += [ShownGait(number, place) for place in sorted(places)]
    return chosen


def _measure_path(chart: Chart, diagram: BranchDiagram, branch: GaitBranch, row: Array) -> Array:
    """Return the distance of each gait from the first one along the line of a branch, shape (K,) [px]."""
    pairs = zip(_values(diagram, branch).tolist(), row.tolist(), strict=True)
    corners = np.nan_to_num([chart.place(x, y) for x, y in pairs])
    return np.insert(np.cumsum(np.hypot(*np.diff(corners, axis=0).T)), 0, 0.0)


def draw_diagram(diagram: BranchDiagram, coordinate: str, places: Sequence[ShownGait]) -> Element:
    """Return the branches as an SVG element with circles for each gait that can be played, one for each of its steps.

    Parameters
    ----------
    diagram : BranchDiagram
    coordinate : str
        Vertical axis.
    places : sequence of ShownGait
    """
    chart = _make_chart(diagram, coordinate)
    drawing = chart.draw()
    drawing.set("role", "group")  # a picture would not contain buttons
    for part in [*drawing.findall("polyline"), *drawing.findall("circle")]:
        drawing.remove(part)  # branches are drawn by stability
    names = name_gaits(diagram)
    for branch in diagram.branches:
        values, heights = _values(diagram, branch), _heights(branch, coordinate)
        drawing.extend(_branch_lines(chart, branch, values, heights, list(names)))
    circles = [circle for place in places for circle in _circles(chart, diagram, coordinate, place)]
    drawing.extend(circles)
    drawing.extend(_special_marks(chart, diagram, coordinate, circles))
    key = [
        element("span", element("i", class_=f"key-line line-{number % COLOURS}"), name, class_="named")
        for number, name in enumerate(names.values())
    ]
    caption = element("figcaption", "Branches: solid stable, dashed unstable")
    return element("figure", caption, drawing, element("p", *key, class_="sequences"), class_="diagram")


def show_value(value: float, unit: str, digits: int = 9) -> str:
    """Return a number in the unit of the diagram: angles in degrees, with a minus sign.

    Examples
    --------
    >>> show_value(-math.pi, "rad"), show_value(0.25, "1", 6)
    ('−180', '0.25')
    """
    text = f"{math.degrees(value) if unit == 'rad' else value:.{digits}g}"
    return text.replace("-", "\N{MINUS SIGN}")


def describe_value(diagram: BranchDiagram, value: float) -> str:
    """Return the value of the parameter of a diagram with its name and unit.

    Examples
    --------
    >>> from gaitopt import load_diagram
    >>> describe_value(load_diagram("docs/examples/compass_slope.nc"), math.radians(3))
    'slope = 3 deg'
    """
    unit = {"rad": " deg", "1": "", "": ""}.get(diagram.unit, f" {typeset_powers(diagram.unit)}")
    return f"{diagram.parameter.replace('_', ' ')} = {show_value(value, diagram.unit, 6)}{unit}"


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
    quantity = f"{coordinate.replace('_', ' ')} after touchdown"
    return Chart(
        title=f"{coordinate} over {diagram.parameter}",
        x_label=label_quantity(diagram.parameter, diagram.unit),
        y_label=label_quantity(quantity, unit),
        unit="",
        lines=lines,
        closed=True,
    )


def _values(diagram: BranchDiagram, branch: GaitBranch) -> Array:
    return in_shown_unit(branch.values, diagram.unit)


def _heights(branch: GaitBranch, coordinate: str) -> list[Array]:
    """Return the coordinate of all gaits at the start of each step; none if the branch does not have it."""
    if coordinate not in branch.names:
        return [np.full(branch.values.size, np.nan)]
    place = branch.names.index(coordinate)
    return list(in_shown_unit(branch.orbits[:, :, place].T, branch.units[place]))


def _branch_lines(
    chart: Chart, branch: GaitBranch, values: Array, heights: list[Array], gaits: list[tuple[str, int]]
) -> Iterator[Element]:
    """Yield the pieces of a branch of equal sequence and stability as lines in the colour of sequence and period."""
    for piece, sequence, stable in split_branch(branch):
        kind, colour = "stable" if stable else "unstable", gaits.index((sequence, branch.steps)) % COLOURS
        for row in heights:
            places = [chart.place(float(x), float(y)) for x, y in zip(values[piece], row[piece], strict=True)]
            yield element("polyline", class_=f"line line-{colour} {kind}", points=points(*places))


def _circles(chart: Chart, diagram: BranchDiagram, coordinate: str, place: ShownGait) -> Iterator[Element]:
    """Yield the circle of each step of a gait that can be played; keys and screen readers reach the first one."""
    branch = diagram.branches[place.branch]
    value = describe_value(diagram, float(branch.values[place.number]))
    title = f"{value}: {count_steps(omit_outcome(branch.sequences[place.number]))}"
    for step, row in enumerate(_heights(branch, coordinate)):
        if not np.isfinite(row[place.number]):
            continue
        x, y = chart.place(float(_values(diagram, branch)[place.number]), float(row[place.number]))
        button = {"tabindex": 0, "role": "button", "aria_label": f"Gait at {value}"}
        access = {"aria_hidden": "true"} if step else button
        look = {"cx": round(x, 1), "cy": round(y, 1), "r": round(CIRCLE * _share(branch), 2)}
        yield element("circle", element("title", title), class_="branch-point", data_gait=place.name, **look, **access)


def _share(branch: GaitBranch) -> float:
    """Return the size of the marks of a branch, which are close together for long periods, over that of one step."""
    return max(1 / math.sqrt(branch.steps), LEAST_SHARE)


def _special_marks(
    chart: Chart, diagram: BranchDiagram, coordinate: str, circles: Sequence[Element]
) -> Iterator[Element]:
    """Yield a diamond for each step of each special point, and its number beside the first of them."""
    firsts: list[tuple[float, float] | None] = []
    taken = [(float(each.get("cx", 0)), float(each.get("cy", 0)), CIRCLE, CIRCLE) for each in circles]
    pairs = [(branch, point) for branch in diagram.branches for point in branch.special]
    for branch, point in pairs:
        size, value = round(DIAMOND * _share(branch), 1), _in_unit(diagram, point.value)
        corners = [chart.place(value, height) for height in _special_heights(branch, coordinate, point)]
        firsts.append(corners[0] if corners else None)
        taken += [(x, y, size / 2, size / 2) for x, y in corners]
        change = " -> ".join(dict.fromkeys(name_sides(point.before, point.after)))
        title = f"{point.kind.key} at {point.value:.10g}: {change}"
        for x, y in corners:
            place = {"x": round(x, 1), "y": round(y + 0.36 * size, 1), "style": f"font-size: {size}px"}
            yield element("text", "\N{BLACK DIAMOND}", element("title", title), class_="special", **place)
    yield from _number_points(firsts, taken)


def _number_points(corners: Sequence[tuple[float, float] | None], taken: list[_Box]) -> Iterator[Element]:
    """Yield the number of each point beside it, apart from boxes that are taken, with a line if it is not close."""
    for number, corner in enumerate(corners, 1):
        if corner is None:
            continue
        (x, y), half = corner, LETTER * len(str(number)) / 2
        boxes = [(x + along + math.copysign(half, along), y + up, half, LINE / 2) for along, up in SHIFTS]
        boxes = [box for box in boxes if box[2] < box[0] < WIDTH - box[2] and LINE < box[1] < HEIGHT - LINE] or boxes
        box = min(boxes, key=lambda each: sum(_overlap(each, other) for other in taken))
        taken.append(box)
        if math.hypot(box[0] - x, box[1] - y) > NEAR:
            end = y + (box[1] - y) * (1 - LINE / 2 / max(abs(box[1] - y), LINE))
            yield element("path", class_="leader", d=f"M{x:.1f} {y:.1f}L{box[0]:.1f} {end:.1f}")
        yield element("text", str(number), class_="number", x=round(box[0], 1), y=round(box[1] + 2.8, 1))


def _overlap(one: _Box, other: _Box) -> float:
    """Return the area that two boxes have in common."""
    width, height = (one[k + 2] + other[k + 2] - abs(one[k] - other[k]) for k in (0, 1))
    return max(width, 0.0) * max(height, 0.0)


def _in_unit(diagram: BranchDiagram, value: float) -> float:
    return math.degrees(value) if diagram.unit == "rad" else value


def _special_heights(branch: GaitBranch, coordinate: str, point: SpecialPoint) -> list[float]:
    """Return the coordinate at a special point at the start of each step; empty if the branch does not have it."""
    if coordinate not in branch.names:
        return []
    place = branch.names.index(coordinate)
    return in_shown_unit(branch.orbit_of(point)[:, place], branch.units[place]).tolist()
