"""The top row of the figure of a gait: a step as a row of stick figures."""

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitopt.motion.foot_arc import figure_points, find_foot_arc
from gaitopt.motion.link_roles import Links, classify_links, tilt
from gaitopt.motion.motion import Array, Motion, Segment
from gaitopt.plot.style import BODY, FIRST_LEG, GROUND, MODE_FILL, MODE_INK, SECOND_LEG

if TYPE_CHECKING:
    from matplotlib.axes import Axes

INSTANTS = 9


class MotionSample(NamedTuple):
    """A sample of a motion: its segment, and the column in the arrays of the segment."""

    segment: Segment
    sample: int

    @property
    def time(self) -> float:
        """Time of the sample [s]."""
        return float(self.segment.time[self.sample])


def choose_instants(motion: Motion, count: int = INSTANTS) -> list[MotionSample]:
    """Return samples spread evenly over a step, with at least one in every slip phase, however short.

    Parameters
    ----------
    motion : Motion
    count : int
        At least the number of slip phases.

    Examples
    --------
    >>> from gaitopt import load
    >>> instants = choose_instants(load("docs/examples/compass_slip.h5").motion)
    >>> len(instants), instants[0].segment.mode.value, instants[-1].segment.mode.value
    (9, 'slip+', 'stick')
    """
    start = motion.segments[0].time[0]
    times = start + np.linspace(0, motion.period, count)
    owner = [_segment_at(motion, time) for time in times]
    for number, segment in enumerate(motion.segments):
        if segment.mode.slips and number not in owner:
            middle = (segment.time[0] + segment.time[-1]) / 2
            nearest = int(np.argmin(np.abs(times - middle)))
            times[nearest], owner[nearest] = middle, number
    chosen = zip(times, (motion.segments[number] for number in owner), strict=True)
    return [MotionSample(segment, int(np.argmin(np.abs(segment.time - time)))) for time, segment in chosen]


def draw_stick_figures(axes: "Axes", motion: Motion, count: int = INSTANTS) -> None:
    """Draw a step as a row of stick figures on its slope, with time stamps and the slides of the stance foot.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    motion : Motion
        Its points must be finite.
    count : int
        How many figures.
    """
    instants = choose_instants(motion, count)
    slope = motion.parameters["slope"]
    figures = [figure_points(motion, instant.segment)[:, :, instant.sample] for instant in instants]
    spacing = _spacing(figures)
    shifts = spacing * np.arange(len(instants), dtype=float)
    for instant, shift in zip(instants, shifts, strict=True):
        _draw_walker(axes, motion, instant, shift, slope)
    _draw_ground(axes, figures, shifts, slope)
    _draw_labels(axes, motion, instants, shifts, slope)
    _draw_key(axes, columns=2 if count == INSTANTS else 1)
    axes.set_aspect("equal")
    axes.margins(0.01, 0.03)
    axes.axis("off")


def draw_links(axes: "Axes", points: Array, links: Links, **style: Any) -> None:
    """Draw links as one line each, with round ends.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    points : (2, n_points) array [m]
    links : tuple of pairs of int
    """
    for pair in links:
        axes.plot(*points[:, pair], solid_capstyle="round", **style)


def _segment_at(motion: Motion, time: float) -> int:
    ends = [segment.time[-1] for segment in motion.segments]
    return min(int(np.searchsorted(ends, time)), len(ends) - 1)


def _draw_feet(axes: "Axes", outlines: Array, slope: float) -> None:
    """Draw the arcs of round feet, the landing foot lighter and below the stance foot.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    outlines : (2, n, 2) array [m]
        Arcs of the stance and the landing foot.
    slope : float [rad]
    """
    legs = ((FIRST_LEG, 2.0, 4), (SECOND_LEG, 1.3, 3))
    for outline, (color, width, order) in zip(np.moveaxis(outlines, 2, 0), legs, strict=True):
        axes.plot(*tilt(outline, slope), color=color, linewidth=width, zorder=order, solid_capstyle="round")


def _spacing(figures: Sequence[Array]) -> float:
    """Return the smallest distance between neighbours that keeps them apart [m]."""
    height = max(float(np.ptp(figure[1])) for figure in figures)
    overlap = max(float(left[0].max() - right[0].min()) for left, right in pairwise(figures))
    return max(overlap, 0.0) + 0.2 * height


def _draw_walker(axes: "Axes", motion: Motion, instant: MotionSample, shift: float, slope: float) -> None:
    skeleton = classify_links(motion)
    mode = instant.segment.mode
    points = tilt(instant.segment.points[:, :, instant.sample] + np.array([[shift], [0.0]]), slope)
    draw_links(axes, points, skeleton.body, color=BODY, linewidth=2.0)
    draw_links(axes, points, skeleton.swing, color=SECOND_LEG, linewidth=1.3, zorder=3)
    draw_links(axes, points, skeleton.stance, color=FIRST_LEG, linewidth=2.6, zorder=4)
    axes.plot(
        *points[:, skeleton.joints],
        "o",
        color=FIRST_LEG,
        markersize=5,
        markerfacecolor="white",
        zorder=5,
        clip_on=False,
    )
    arc, rims = find_foot_arc(motion), instant.segment.rims
    foot = points[:, skeleton.stance_foot]
    if arc is not None and rims is not None:
        _draw_feet(axes, arc.outline(rims[:, :, instant.sample]) + np.array([shift, 0.0])[:, None, None], slope)
        foot = tilt(instant.segment.contact[:, instant.sample] + np.array([shift, 0.0]), slope)
    fill = MODE_FILL[mode] if mode.slips else FIRST_LEG
    size = 6 if mode.slips else 4
    axes.plot(*foot, "o", color=FIRST_LEG, markerfacecolor=fill, markersize=size, zorder=6, clip_on=False)


def _draw_ground(axes: "Axes", figures: Sequence[Array], shifts: Array, slope: float) -> None:
    low, high = figures[0][0].min() + shifts[0], figures[-1][0].max() + shifts[-1]
    margin = 0.03 * (high - low)
    ends = tilt(np.array([[low - margin, high + margin], [0.0, 0.0]]), slope)
    axes.plot(*ends, color=GROUND, linewidth=1.0, zorder=1)


def _draw_labels(axes: "Axes", motion: Motion, instants: Sequence[MotionSample], shifts: Array, slope: float) -> None:
    named: set[int] = set()
    below: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "va": "top"}
    for instant, shift in zip(instants, shifts, strict=True):
        segment = instant.segment
        x, y = tilt(segment.contact[:, instant.sample] + np.array([shift, 0.0]), slope)
        axes.annotate(f"{instant.time:.3f} s", (x, y), (0, -6), fontsize=8, color="0.25", **below)
        if segment.mode.slips and id(segment) not in named:
            named.add(id(segment))
            arrow = "\N{RIGHTWARDS ARROW}" if segment.mode.sign > 0 else "\N{LEFTWARDS ARROW}"
            text = f"{arrow} {segment.mode.label}\n{abs(1e3 * segment.slide):.3g} mm"
            axes.annotate(text, (x, y), (0, -17), fontsize=8, color=MODE_INK[segment.mode], weight="bold", **below)


def _draw_key(axes: "Axes", columns: int) -> None:
    """Name the legs above the figures, and state that their distances are not those of the walker."""
    from matplotlib.lines import Line2D

    legs = [Line2D([], [], color=FIRST_LEG, linewidth=2.6), Line2D([], [], color=SECOND_LEG, linewidth=1.3)]
    names = ["stance leg", "swing leg (instants drawn side by side)"]
    place: dict[str, Any] = {"loc": "lower center", "bbox_to_anchor": (0.5, 1), "borderaxespad": 0.5, "borderpad": 0}
    axes.legend(legs, names, ncols=columns, **place)
