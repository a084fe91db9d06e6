"""Line charts as SVG, with marks that a player moves along the lines."""

import math
from collections.abc import Sequence
from functools import cached_property

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.report.markup import Element, element, points

WIDTH, HEIGHT = 420, 230
LEFT, RIGHT, TOP, BOTTOM = 66, 10, 10, 38
"""Size of a chart and its margins [px]."""

COLOURS = 7
"""Number of line colours in the style sheet."""


@dataclass(frozen=True)
class Axis:
    """A map from numbers to pixels.

    Examples
    --------
    >>> axis = Axis(0.0, 2.0, 100.0, 300.0)
    >>> axis(0.5), axis.ticks(4)
    (150.0, [0.0, 0.5, 1.0, 1.5, 2.0])
    """

    low: float
    high: float
    start: float
    end: float

    def __call__(self, value: float) -> float:
        """Return the pixel of a number."""
        return self.start + (value - self.low) / (self.high - self.low) * (self.end - self.start)

    def ticks(self, count: int) -> list[float]:
        """Return about `count` round numbers within the axis."""
        rough = (self.high - self.low) / count
        power = 10.0 ** math.floor(math.log10(rough))
        step = next(factor * power for factor in (1, 2, 2.5, 5, 10) if factor * power >= 0.999 * rough)
        first, last = math.ceil(self.low / step - 1e-9), math.floor(self.high / step + 1e-9)
        return [round(number * step, 12) + 0.0 for number in range(first, last + 1)]


@dataclass(frozen=True, eq=False, kw_only=True)
class Curve:
    """A line of a chart, one piece for each phase of the step.

    Attributes
    ----------
    label : str
    x, y : tuple of (K,) arrays
    joint : int or None
        Number of the joint, which determines the colour; None for a line without a joint.
    role : str
        Name of the colour of a foot; empty for a line without a foot.
    time : tuple of (K,) arrays, optional
        Times of the samples [s]; by default those of the phases.
    """

    label: str
    x: tuple[Array, ...]
    y: tuple[Array, ...]
    joint: int | None = None
    role: str = ""
    time: tuple[Array, ...] | None = None

    @property
    def style(self) -> str:
        """Class of the line in the page's style sheet."""
        if self.role:
            return f"line-{self.role}"
        return "line-single" if self.joint is None else f"line-{self.joint % COLOURS}"


@dataclass(frozen=True, eq=False, kw_only=True)
class Stem:
    """A value at one instant, drawn as a line from zero with a mark at its end.

    Attributes
    ----------
    label : str
    x, y : float
    joint : int
        Number of the joint, which determines the colour.
    side : {-1, 1}
        Whether the stem lies left or right of the instant, so that two of them are visible.
    """

    label: str
    x: float
    y: float
    joint: int
    side: int

    @property
    def style(self) -> str:
        """Class of the line in the page's style sheet."""
        return f"line-{self.joint % COLOURS}"

    def draw(self, x_axis: Axis, y_axis: Axis) -> list[Element]:
        """Return the line and the mark, a triangle on the side of the stem."""
        x, zero, y = x_axis(self.x) + 2 * self.side, y_axis(0.0), y_axis(self.y)
        tip = points((x, y - 5), (x, y + 5), (x + 8 * self.side, y))
        line = element("polyline", class_=f"line solid {self.style}", points=points((x, zero), (x, y)))
        mark = element("polygon", class_=f"dot {self.style} stem", points=tip)
        mark.append(element("title", self.label))
        return [line, mark]


@dataclass(frozen=True, eq=False, kw_only=True)
class Chart:
    """A line chart.

    Attributes
    ----------
    title, x_label, y_label, unit : str
        The unit follows the values that a player shows.
    lines : sequence of Curve
    bands : sequence of (from, to, Mode)
        Shaded intervals of x.
    limits : sequence of float
        Levels of y marked by a dashed line.
    span : tuple of float, optional
        Ends of the horizontal axis; by default those of the lines.
    closed : bool
        Whether a dashed line joins the end of each line to its start.
    stems : sequence of Stem
        Values at instants.

    Examples
    --------
    >>> line = Curve(label="a", x=(np.array([0.0, 1.0]),), y=(np.array([0.0, 2.0]),))
    >>> chart = Chart(title="a", x_label="time [s]", y_label="a [m]", unit="m", lines=[line])
    >>> chart.draw().tag, chart.place(0.0, 0.0)[0]
    ('svg', 66.0)
    """

    title: str
    x_label: str
    y_label: str
    unit: str
    lines: Sequence[Curve]
    bands: Sequence[tuple[float, float, Mode]] = ()
    limits: Sequence[float] = ()
    span: tuple[float, float] | None = None
    closed: bool = False
    stems: Sequence[Stem] = ()

    @cached_property
    def x_axis(self) -> Axis:
        """The horizontal axis; time fills it to its ends."""
        low, high = self.span or _range([x for line in self.lines for x in line.x])
        margin = 0.05 * (high - low) if self.closed else 0.0
        return Axis(low - margin, high + margin, float(LEFT), float(WIDTH - RIGHT))

    @cached_property
    def y_axis(self) -> Axis:
        """The vertical axis."""
        low, high = _range([*(y for line in self.lines for y in line.y), np.array([*self.limits, *self._stem_ends])])
        margin = 0.07 * (high - low)
        return Axis(low - margin, high + margin, float(HEIGHT - BOTTOM), float(TOP))

    @property
    def _labels(self) -> list[str]:
        """Labels of all lines and stems."""
        return [*(line.label for line in self.lines), *(stem.label for stem in self.stems)]

    @property
    def _stem_ends(self) -> list[float]:
        """Zero and the value of each stem."""
        return [value for stem in self.stems for value in (0.0, stem.y)]

    def place(self, x: float, y: float) -> tuple[float, float]:
        """Return the pixels of a point of the chart."""
        return self.x_axis(x), self.y_axis(y)

    def write(self, value: float) -> str:
        """Return a value of y with as many decimals as the chart resolves."""
        axis = self.y_axis
        decimals = max(0, 3 - math.ceil(math.log10(axis.high - axis.low)))
        return f"{round(value, decimals) + 0.0:.{decimals}f}".replace("-", "\N{MINUS SIGN}")

    def draw(self) -> Element:
        """Return the chart as an SVG element."""
        x, y = self.x_axis, self.y_axis
        marks = [element("circle", class_=f"dot {line.style}", r=5, cx=-99) for line in self.lines]
        cursor = None if self.closed else element("line", class_="cursor", x1=-99, x2=-99, y1=y.end, y2=y.start)
        return element(
            "svg",
            *(_band(x, y, *band) for band in self.bands),
            *_grid(x, y),
            *(element("path", class_="limit", d=f"M{x.start} {y(level):.2f}H{x.end}") for level in self.limits),
            *(part for line in self.lines for part in self._line(line)),
            *(part for stem in self.stems for part in stem.draw(x, y)),
            element("text", self.x_label, class_="label", x=(x.start + x.end) / 2, y=HEIGHT - 4),
            element(
                "text", self.y_label, class_="label", transform=f"translate(12 {(y.start + y.end) / 2}) rotate(-90)"
            ),
            cursor,
            *marks,
            viewBox=f"0 0 {WIDTH} {HEIGHT}",
            role="img",
            aria_label=f"{self.title}: {', '.join(self._labels)}",
        )

    def _line(self, line: Curve) -> list[Element]:
        pieces = [
            [self.place(float(a), float(b)) for a, b in zip(*piece, strict=True)]
            for piece in zip(line.x, line.y, strict=True)
            if piece[0].size
        ]
        drawn = [element("polyline", class_=f"line {line.style}", points=points(*piece)) for piece in pieces]
        if self.closed:
            drawn.append(element("polyline", class_=f"jump {line.style}", points=points(pieces[-1][-1], pieces[0][0])))
        return drawn


def _range(arrays: Sequence[Array]) -> tuple[float, float]:
    """Return the smallest and the largest number; if all are equal, an interval around them."""
    joined = np.concatenate(arrays)
    low, high = float(joined.min()), float(joined.max())
    if high - low < 1e-9 * max(abs(low), abs(high), 1.0):
        half = 0.5 * max(abs(low), 1.0)
        return low - half, high + half
    return low, high


def _band(x: Axis, y: Axis, start: float, end: float, mode: Mode) -> Element:
    width = max(x(end) - x(start), 1.5)
    shade = element(
        "rect", class_=f"band {mode.name.lower()}", x=x(start), y=y.end, width=width, height=y.start - y.end
    )
    shade.append(element("title", mode.value))
    return shade


def _grid(x: Axis, y: Axis) -> list[Element]:
    parts = []
    for value in x.ticks(5):
        parts.append(element("path", class_="grid", d=f"M{x(value):.2f} {y.start}V{y.end}"))
        parts.append(element("text", _write(value), class_="tick middle", x=x(value), y=y.start + 15))
    for value in y.ticks(4):
        parts.append(element("path", class_="grid", d=f"M{x.start} {y(value):.2f}H{x.end}"))
        parts.append(element("text", _write(value), class_="tick end", x=x.start - 6, y=y(value) + 4))
    return parts


def _write(value: float) -> str:
    return f"{value:.6g}".replace("-", "\N{MINUS SIGN}")
