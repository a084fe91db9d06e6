"""Markers of special points on branches; those of points that are closer than their markers lie side by side."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.plot.style import root_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LINES_ONLY = ("x", "+", "|", (6, 2, 0), "1", "2", "3", "4")
"""Markers that have no area."""

MARKER, LEAST_MARKER = 5.0, 2.0
"""Sizes of the markers of gaits of one step, and of long periods, whose special points are close together [pt]."""

MARKER_SHARE = 0.15
"""Largest size of a marker over the extent of its branch, which it would otherwise hide."""

ABOVE_MARKERS = 6
"""Drawing order of lines above all markers."""

REACH, DISTANCE, SAME = 0.75, 1.2, 0.5
"""Distance of points whose markers overlap, and of markers side by side, over their size; distance of points of
different branches that are one point [pixel]."""


LETTER = 1.6
"""Size of a marker that is a letter over that of others."""

LEADER = 0.6
"""Width of the line from a point to a marker beside it [pt]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SpecialMark:
    """The marker of a special point, at each step of the period.

    Attributes
    ----------
    branch : int
        Number of its branch.
    label : str
        Entry in the legend.
    marker : str or tuple
    size : float [pt]
    places : (steps, 2) array
        Points of the axes.
    line : (K, 2) array
        Points of the branch at the first step.
    """

    branch: int
    label: str
    marker: Any
    size: float
    places: Array
    line: Array


def choose_marker_size(axes: "Axes", steps: int, values: Array, heights: Array) -> float:
    """Return the size of the markers of a branch [pt], which is small if the branch is short in axes that show all.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        With all branches drawn.
    steps : int
        Period of its gaits.
    values, heights : (K,) and (K, steps) arrays
    """
    extents = np.array([np.ptp(values), np.nanmax(np.ptp(heights, axis=0))])
    total = np.asarray(axes.dataLim.size)
    shares = extents / np.where(total > 0, total, 1.0)
    box, figure = axes.get_window_extent(), root_figure(axes)
    length = float(np.hypot(*(shares * box.size))) * 72 / (figure.dpi if figure else 72)
    return max(min(MARKER / math.sqrt(steps), MARKER_SHARE * length), LEAST_MARKER)


def draw_special_marks(axes: "Axes", marks: Sequence[SpecialMark]) -> None:
    """Draw the markers of special points.

    The first marker of points that are closer than a marker is on its branch, the others are beside it in the order of
    the points: above it, or on the right where the branch is steep.  A line joins them with their points.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        With all branches drawn, and its final limits.
    marks : sequence of SpecialMark
        In order along each branch.
    """
    from matplotlib.transforms import ScaledTranslation

    figure = root_figure(axes)
    if figure is None:
        raise ValueError("markers need axes that belong to a figure")
    for mark, number in zip(marks, _arrange(axes, marks), strict=True):
        offset = number * DISTANCE * mark.size / 72
        aside = (offset, 0.0) if _is_steep(axes, mark) else (0.0, offset)
        shift = ScaledTranslation(*aside, figure.dpi_scale_trans)
        axes.plot(
            *mark.places.T,
            zorder=ABOVE_MARKERS - 1,
            label=mark.label,
            transform=axes.transData + shift if number else axes.transData,
            clip_on=not number,
            **_look_of(mark),
        )
        if number:
            arrow = {"arrowstyle": "-", "color": "0.15", "linewidth": LEADER, "shrinkA": 0, "shrinkB": 0}
            points = (72 * aside[0], 72 * aside[1])
            for place in mark.places:
                axes.annotate("", place, points, textcoords="offset points", arrowprops=arrow, zorder=ABOVE_MARKERS - 2)


def explain_marker_sizes(marks: Sequence[SpecialMark], handles: list[Any], labels: list[str]) -> None:
    """Add an entry to a legend on the reason of small markers, if there are any.

    Parameters
    ----------
    marks : sequence of SpecialMark
    handles, labels : list
        Entries of the legend, which are extended.
    """
    from matplotlib.lines import Line2D

    small = [mark for mark in marks if mark.size < MARKER]
    if small:
        longer = all(len(mark.places) > 1 for mark in small)
        largest = max(small, key=lambda mark: mark.size)
        handles.append(Line2D([], [], **_look_of(largest)))
        labels.append(f"smaller: {'longer periods' if longer else 'short branches'}")


def _look_of(mark: SpecialMark) -> dict[str, Any]:
    """Return the style of a marker; letters have no edge."""
    look: dict[str, Any] = {"linestyle": "none", "marker": mark.marker, "markersize": mark.size, "color": "0.15"}
    if isinstance(mark.marker, str) and mark.marker.startswith("$"):
        return look | {"markersize": LETTER * mark.size, "markeredgewidth": 0}
    fill = {} if mark.marker in LINES_ONLY else {"markerfacecolor": "white"}
    return look | {"markeredgewidth": mark.size / MARKER} | fill


def _arrange(axes: "Axes", marks: Sequence[SpecialMark]) -> list[int]:
    """Return the number of each marker among those that overlap, 0 for the one on its branch."""
    figure = root_figure(axes)
    dots = (figure.dpi if figure else 72) / 72
    axes.get_ylim()  # updates the limits
    places = [axes.transData.transform(mark.places) for mark in marks]
    numbers: list[int] = []
    for place, mark in zip(places, marks, strict=True):
        taken = set()
        number = None
        for other, before, chosen in zip(places, marks, numbers, strict=False):
            gap = float(np.min(np.linalg.norm(place[:, None] - other[None], axis=2)))
            if mark.branch != before.branch and mark.label == before.label and gap < SAME:
                number = chosen
            elif gap < REACH * dots * (mark.size + before.size) / 2:
                taken.add(chosen)
        hidden = mark.size <= LEAST_MARKER  # it may hide others, since its branch is hardly longer
        free = next(each for each in range(len(marks)) if each not in taken)
        numbers.append((0 if hidden else free) if number is None else number)
    return numbers


def _is_steep(axes: "Axes", mark: SpecialMark) -> bool:
    """Return whether a branch is closer to a vertical than to a horizontal line at a special point."""
    line = axes.transData.transform(mark.line)
    gaps = np.linalg.norm(line - axes.transData.transform(mark.places[0]), axis=1)
    if line.shape[0] < 2 or not np.isfinite(gaps).any():
        return False
    near = int(np.nanargmin(gaps))
    along, upward = np.abs(line[min(near + 1, len(line) - 1)] - line[max(near - 1, 0)])
    return bool(upward > along)
