"""Colours, line styles and sizes of all drawings; the global settings of matplotlib are unchanged."""

import re
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from attrs import field, frozen

from gaitopt.arguments import check_record
from gaitopt.model.contacts.mode import Mode
from gaitopt.parameters import number_within, positive
from gaitopt.plot.literal_text import finish_texts

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# The palette of Okabe and Ito is distinguishable for colour-blind readers; dashes distinguish lines in grey print.  Its
# orange and sky blue are the colours of slip, in whose place lines have brown and violet.
LINES = (
    ("#0072B2", "-"),
    ("#D55E00", (0, (5, 1.5))),
    ("#009E73", (0, (5, 1.5, 1, 1.5))),
    ("#CC79A7", (0, (1, 1))),
    ("#000000", (0, (9, 2))),
    ("#663311", "-"),
    ("#8822EE", (0, (5, 1.5))),
)
AREA_SHADE = 0.55
"""Share of the colour of a line in that of an area, so that lines and letters on it are readable."""

NARROW = 5.0
"""Width of a figure below which it is laid out for a column of a journal [inch]."""

TALLEST, LARGEST_FONT = 9.0, 9.0
"""Largest height of a figure, which leaves space for a caption on a page [inch], and size of letters up to which it
holds [pt]; figures of larger letters are taller in proportion."""

DASHES = tuple(dict.fromkeys(dashes for _, dashes in LINES))

LIMIT: dict[str, Any] = {"color": "0.35", "linewidth": 0.9, "linestyle": (0, (2, 2))}

# Two legs: dark and thick against light and thin, so that they differ in grey as well.  Contact modes differ from both.
FIRST_LEG, SECOND_LEG, BODY = "#12355B", "#785AD2", "0.45"
CONTACTS = (FIRST_LEG, SECOND_LEG, "#2E7D5B", "#8E3B76", "#5A5A5A", "#7A5C00")
"""Colours of the feet and their legs, in the order of the contacts; they repeat."""

GROUND = "0.25"
PATCH = "#008B8B"
"""Colour of the band of a patch of other friction on the ground."""

FORCE = "#B3123F"
CONE = "#DCE6C8"
WARNING = "#B00020"

MODE_FILL = {
    Mode.SLIP_FORWARD: "#E69F00",
    Mode.SLIP_BACKWARD: "#56B4E9",
    Mode.STICK: "0.85",
    Mode.FREE: "0.95",
    Mode.CLOSED: "#A9C6A0",
    Mode.LATCHED: "#B9A9C9",
}
"""For areas and marks."""

MODE_INK = {Mode.SLIP_FORWARD: "#8F4A00", Mode.SLIP_BACKWARD: "#00598C", Mode.STICK: "0.25", Mode.FREE: "0.25"}
MODE_INK |= {Mode.CLOSED: "#2F5A24", Mode.LATCHED: "#4B3566"}
"""For text: the same hues, dark enough to read on white."""

MODE_HATCH = {Mode.SLIP_FORWARD: "///", Mode.SLIP_BACKWARD: "\\\\\\", Mode.STICK: "", Mode.FREE: ""}
MODE_HATCH |= {Mode.CLOSED: "", Mode.LATCHED: ""}


@check_record
@frozen
class FigureStyle:
    """Size and fonts of a figure, and the colours with the same meaning in all figures.

    Attributes
    ----------
    width : float [inch]
        7.2 is the text of a page, 3.5 a column of most journals.
    font_size : float [pt]
        Of axis labels; numbers at ticks are half a point smaller.
    font : str
        Font family that matplotlib finds.
    titled : bool
        Whether figures have a title; in a paper the caption replaces it.

    Raises
    ------
    InputError
        If the width is not between 0 and 100 inches, or the font size not between 1 and 500 pt.

    Examples
    --------
    >>> column = FigureStyle(width=3.5, font_size=8, titled=False)
    >>> with column.figure(2.0) as figure:
    ...     axes = figure.add_subplot()
    ...     lines = axes.plot([0, 1], [0, 1], **line_style(0))
    ...     limit = axes.axhline(0.5, **column.limit_line)
    >>> figure.get_size_inches().tolist()
    [3.5, 2.0]
    """

    width: float = field(default=7.2, validator=positive("inch", upper=100.0))
    font_size: float = field(default=8.5, validator=number_within("pt", 1.0, 500.0))
    font: str = "DejaVu Sans"
    titled: bool = True

    limit_line: ClassVar[dict[str, Any]] = LIMIT
    """Style of the line of a limit."""
    mode_fill: ClassVar[dict[Mode, str]] = MODE_FILL
    """Colour of areas and wide lines by contact mode."""

    @property
    def tallest(self) -> float:
        """Largest height of a figure [inch]."""
        return TALLEST * max(self.font_size / LARGEST_FONT, 1.0)

    @property
    def settings(self) -> Any:
        """For ``matplotlib.rc_context``, whose type differs between versions of matplotlib."""
        size = self.font_size
        return {
            "font.family": self.font,
            "font.size": size,
            "axes.titlesize": size,
            "axes.labelsize": size,
            "xtick.labelsize": size - 0.5,
            "ytick.labelsize": size - 0.5,
            "legend.fontsize": size - 0.5,
            "legend.frameon": False,
            "figure.titlesize": size + (self.width >= NARROW),
            **_LOOKS,
        }

    @contextmanager
    def figure(self, height: float) -> "Iterator[Figure]":
        """Yield an empty figure of this style, which is laid out when the context ends.

        Parameters
        ----------
        height : float [inch]
        """
        from matplotlib import rc_context
        from matplotlib.figure import Figure

        with rc_context(self.settings):
            figure = Figure(figsize=(self.width, height), layout="constrained")
            yield figure
            finish_texts(figure)
            figure.draw_without_rendering()  # ticks are made only when drawn, and must be made with these settings


_LOOKS: dict[str, Any] = {
    "figure.facecolor": "white",
    "axes.facecolor": "white",
    "axes.edgecolor": "0.3",
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.unicode_minus": True,
    "axes.formatter.useoffset": False,
    "grid.color": "0.9",
    "grid.linewidth": 0.6,
    "lines.linewidth": 1.5,
    "hatch.linewidth": 0.5,
    "pdf.fonttype": 42,
    "svg.fonttype": "path",
}


def begin_at_zero(axes: "Axes") -> None:
    """Begin axes at zero whose values are not negative, where a margin would extend below; marks at zero stay whole.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        With all lines drawn.

    Examples
    --------
    >>> with FigureStyle().figure(2.0) as figure:
    ...     axes = figure.add_subplot()
    ...     lines = axes.plot([-1, 1], [0.001, 1])
    ...     begin_at_zero(axes)
    >>> bool(axes.get_xlim()[0] < -1), float(axes.get_ylim()[0])
    (True, 0.0)
    """
    if axes.dataLim.x0 >= 0 > axes.get_xlim()[0]:
        axes.set_xlim(left=0)
    if axes.dataLim.y0 >= 0 > axes.get_ylim()[0]:
        axes.set_ylim(bottom=0)
    for line in axes.lines:
        if np.isfinite(np.asarray(line.get_ydata(), dtype=float)).any():  # others would extend the layout to the corner
            line.set_clip_on(False)


def root_figure(artist: "Artist") -> "Figure | None":
    """Return the figure that contains an artist or a subfigure, of any version of matplotlib; None without any.

    Examples
    --------
    >>> with FigureStyle().figure(2.0) as figure:
    ...     axes = figure.subfigures().add_subplot()
    >>> root_figure(axes) is root_figure(figure) is figure
    True
    """
    parent = artist.figure
    return None if parent is None else parent.figure


def line_style(number: int) -> dict[str, Any]:
    """Return colour and dashes of the n-th line, from 0; when the colours repeat, the dashes differ.

    Examples
    --------
    >>> line_style(0)
    {'color': '#0072B2', 'linestyle': '-'}
    >>> line_style(len(LINES))
    {'color': '#0072B2', 'linestyle': (0, (5, 1.5))}
    """
    rounds, place = divmod(number, len(LINES))
    color, dashes = LINES[place]
    return {"color": color, "linestyle": DASHES[(DASHES.index(dashes) + rounds) % len(DASHES)]}


def area_color(number: int) -> str:
    """Return the colour of areas of the n-th kind, from 0: that of the n-th line, mixed with white.

    Examples
    --------
    >>> area_color(0)
    '#73b1d5'
    """
    from matplotlib.colors import to_hex, to_rgb

    red, green, blue = (1 - AREA_SHADE * (1 - part) for part in to_rgb(line_style(number)["color"]))
    return to_hex((red, green, blue))


def leg_color(number: int) -> str:
    """Return the colour of the n-th leg, from 0, which its contacts, forces and lines have in all figures.

    Examples
    --------
    >>> leg_color(0) == leg_color(len(CONTACTS)) == FIRST_LEG
    True
    """
    return CONTACTS[number % len(CONTACTS)]


def foot_line_style(number: int, leg: int) -> dict[str, Any]:
    """Return the style of the line of the n-th contact, from 0: the colour of its leg, and the dashes of its number.

    Examples
    --------
    >>> foot_line_style(0, 0)["linestyle"]
    '-'
    """
    return {"color": leg_color(leg), "linestyle": DASHES[number % len(DASHES)]}


def angle_symbol(name: str) -> str:
    r"""Return the text of an angle in a figure: Greek for ``th1``, ``th_knee`` or ``theta``, otherwise words.

    Examples
    --------
    >>> angle_symbol("th2"), angle_symbol("left_knee"), angle_symbol("thrust")
    ('$\\theta_{2}$', 'left knee', 'thrust')
    """
    match = re.fullmatch(r"th(?:eta)?(?:|_?(\d[A-Za-z0-9]*|[A-Za-z])|_([A-Za-z0-9]+))", name)
    if not match:
        return name.replace("_", " ")
    index = match[1] or match[2]
    return rf"$\theta_{{{index}}}$" if index else r"$\theta$"


def panel_styles(numbers: Sequence[int]) -> list[dict[str, Any]]:
    """Return the styles of the lines of a panel by their numbers, with other dashes for those that repeat.

    Colours, which a line has in all figures, remain.

    Parameters
    ----------
    numbers : sequence of int
        Number of each line, from 0.

    Examples
    --------
    >>> [style["linestyle"] for style in panel_styles([1, 5, 6])]
    [(0, (5, 1.5)), '-', (0, (5, 1.5, 1, 1.5))]
    """
    styles: list[dict[str, Any]] = []
    for number in numbers:
        style, taken = line_style(number), [each["linestyle"] for each in styles]
        if style["linestyle"] in taken:
            style["linestyle"] = next((dashes for dashes in DASHES if dashes not in taken), style["linestyle"])
        styles.append(style)
    return styles
