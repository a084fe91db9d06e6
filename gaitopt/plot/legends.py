"""Legends that stay inside the page, and texts in lines."""

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Literal

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.printable import show_minus
from gaitopt.plot.style import root_figure

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

LETTERS_PER_INCH = 12
"""Letters in a line of a label per width of the page; longer labels are wrapped."""

PAGE_MARGIN = 0.2
"""Width of the page that legends leave free [inch]."""

NARROW_COLUMNS = {"columnspacing": 0.7, "handlelength": 1.6, "handletextpad": 0.5}
"""Distances in a legend with one more column than otherwise fits [font size]."""

FEW_LINES, CLOSE_LINES = 2, {"labelspacing": 0.2}
"""Lines of a legend beyond which they are close to each other, and their distance [font size]."""

INCLUDED = 0.8
"""Height of a legend for which the height of a figure has space [inch]."""

INNER_PLACES: tuple[Literal["upper right", "lower right", "upper center", "lower center"], ...]
INNER_PLACES = ("upper right", "lower right", "upper center", "lower center")
"""Places of a legend in a panel, the first ones preferred."""

NO_BREAK = "\N{NO-BREAK SPACE}"
MODES, LONGEST_NAME = {mode.value for mode in Mode}, 3
"""Spellings of contact modes, and largest number of words of the name of a contact before them."""


def wrap_text(text: str, letters: int, *, divide: bool = True) -> str:
    """Return a text in lines of a number of letters; words that are longer are divided, or are longer lines.

    A contact and its mode remain on one line, and so do the bar of an impact and the phase before it.

    Examples
    --------
    >>> print(wrap_text("foot A slip+, foot B stick > foot B stick |: cost 0.1344", 24))
    foot A slip+,
    foot B stick >
    foot B stick |: cost
    0.1344
    """
    words, name = text.split(" "), 0  # number of words of the name of a contact
    spaces = [" "] * len(words)  # before each word
    for number, word in enumerate(words):
        is_mode = word.strip("',:()") in MODES
        if is_mode and name <= LONGEST_NAME:
            spaces[number - name + 1 : number + 1] = [NO_BREAK] * name
        elif word.startswith("|"):
            spaces[number] = NO_BREAK
        name = 0 if is_mode or word[-1:] in (",", ">", "|", "&") else name + 1
    joined = "".join(map("".join, zip(spaces, words, strict=True)))[1:]
    return textwrap.fill(joined, letters, break_long_words=divide).replace(NO_BREAK, " ")


def wrap_lines(text: str, letters: int) -> str:
    r"""Return a text of several lines, each of which is divided as by :func:`wrap_text`.

    Examples
    --------
    >>> wrap_lines("monopod\nfoot stick > flight |", 16)
    'monopod\nfoot stick >\nflight |'
    """
    return "\n".join(wrap_text(line, letters) for line in text.splitlines())


def shorten_sequence(sequence: str) -> list[str]:
    """Return a contact sequence and its beginnings, longest first, whose missing phases are an ellipsis.

    Examples
    --------
    >>> shorten_sequence("slip+ stick | slip+")
    ['slip+ stick | slip+', 'slip+ stick | …']
    """
    phases = sequence.replace("> ", ">\0").replace("| ", "|\0").split("\0")
    beginnings = [" ".join(phases[:count]) for count in range(len(phases) - 1, 0, -1)]
    return [sequence, *(f"{beginning} \N{HORIZONTAL ELLIPSIS}" for beginning in beginnings)]


def add_page_legend(
    owner: "Axes | Figure",
    handles: Sequence["Artist"],
    labels: Sequence[str],
    *,
    columns: int,
    width: float,
    **placement: Any,
) -> "Legend":
    """Add a legend with as many columns as the page is wide enough for, close to each other if this adds a column.

    More than two lines are close to each other.

    Parameters
    ----------
    owner : matplotlib.axes.Axes or matplotlib.figure.Figure
    handles, labels : sequences of equal length, at least one
    columns : int
        Maximum number of columns.
    width : float [inch]
        Width of the page.
    **placement
        Keywords of matplotlib's ``legend``.
    """
    figure = root_figure(owner)
    if figure is None:
        raise ValueError("a legend needs axes or a figure that belong to a figure")
    wrapped = [show_minus(wrap_text(label, int(LETTERS_PER_INCH * width))) for label in labels]
    most = min(columns, len(wrapped))
    for count in range(most, 0, -1):
        lines = -(-len(wrapped) // count)
        if count > 1 and lines * (count - 1) >= len(wrapped):  # fewer columns of as many lines are of equal length
            continue
        close = CLOSE_LINES if lines > FEW_LINES else {}
        for distances in ({}, NARROW_COLUMNS) if count > 1 else ({},):
            legend = owner.legend(handles, wrapped, ncols=count, **(close | distances | placement))
            if count == 1 or legend.get_window_extent().width <= (width - PAGE_MARGIN) * figure.dpi:
                return legend
            legend.remove()
    raise ValueError("a legend needs at least one entry")


def add_inner_legend(
    axes: "Axes", handles: Sequence["Artist"], labels: Sequence[str], *, size: tuple[float, float]
) -> "Legend | None":
    """Add a legend of one line where no line or area of a panel is; None if there is no such place.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        With all lines drawn, and its final limits.
    handles, labels : sequences of equal length, at least one
    size : (float, float) [inch]
        Width and height of the panel.
    """
    from matplotlib.transforms import Bbox

    legend = axes.legend(handles, labels, ncols=len(handles), borderaxespad=0.2, borderpad=0.2)
    box, dots = legend.get_window_extent(), axes.figure.dpi
    width, height = box.width / dots / size[0], box.height / dots / size[1]
    axes.get_ylim()  # updates the limits
    artists: list[Line2D | Patch] = [*axes.lines, *axes.patches]
    drawn = [
        ((each.get_transform() - axes.transAxes).transform_path(each.get_path()), each in axes.patches)
        for each in artists
    ]
    for place in INNER_PLACES:
        across = 1 - width if "right" in place else (1 - width) / 2 if "center" in place else 0.0
        bounds = Bbox.from_bounds(across, 1 - height if "upper" in place else 0.0, width, height)
        if not any(path.intersects_bbox(bounds, filled=filled) for path, filled in drawn):
            legend.set_loc(place)
            return legend
    legend.remove()
    return None


def extend_page(figure: "Figure", legend: "Legend", tallest: float) -> None:
    """Extend a figure by the height of a legend outside the axes that exceeds 0.8 inch.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    legend : matplotlib.legend.Legend
    tallest : float [inch]
        Largest height of the figure.
    """
    more = legend.get_window_extent().height / figure.dpi - INCLUDED
    figure.set_figheight(min(figure.get_figheight() + max(more, 0.0), tallest))
