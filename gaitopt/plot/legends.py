"""Legends that stay inside the page."""

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.legend import Legend

LETTERS_PER_INCH = 12
"""Letters in a line of a label per width of the page; longer labels are wrapped."""

PAGE_MARGIN = 0.2
"""Width of the page that legends leave free [inch]."""


def add_page_legend(
    owner: "Axes | Figure",
    handles: Sequence["Artist"],
    labels: Sequence[str],
    *,
    columns: int,
    width: float,
    **placement: Any,
) -> "Legend":
    """Add a legend with as many columns as the page is wide enough for.

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
    figure = owner.get_figure(root=True)
    if figure is None:
        raise ValueError("a legend needs axes or a figure that belong to a figure")
    wrapped = [textwrap.fill(label, int(LETTERS_PER_INCH * width)) for label in labels]
    for count in range(min(columns, len(wrapped)), 1, -1):
        legend = owner.legend(handles, wrapped, ncols=count, **placement)
        if legend.get_window_extent().width <= (width - PAGE_MARGIN) * figure.dpi:
            return legend
        legend.remove()
    return owner.legend(handles, wrapped, ncols=1, **placement)
