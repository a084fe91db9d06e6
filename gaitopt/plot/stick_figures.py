"""The top row of the figure of a gait: a step as a row of stick figures."""

from collections.abc import Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.foot_arc import figure_points, find_foot_arc, find_open_feet
from gaitopt.motion.link_roles import Links, tilt
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import MotionView
from gaitopt.motion.view_motion import AnyMotion, view_motion
from gaitopt.plot.contact_forces import (
    LABELS,
    draw_contact_forces,
    find_cone_ends,
    find_force_top,
    force_handles,
    walker_height,
)
from gaitopt.plot.ground_line import BAND, draw_ground
from gaitopt.plot.instant_labels import TALLEST, MotionSample, draw_instant_labels, estimate_time_width
from gaitopt.plot.legends import add_page_legend
from gaitopt.plot.style import BODY, FIRST_LEG, MODE_FILL, PATCH, leg_color, root_figure

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

INSTANTS = 9

MOST_COLUMNS = 4
"""Columns of the key."""

NARROWEST = 0.33
"""Smallest distance of neighbouring figures over their height, which leaves room for their times."""

LEAST_SHAPE = 0.08
"""Least height of the view over its width."""

FRONT = 4
"""Drawing order of thin legs, which are above the thick ones that would hide them."""


def choose_instants(motion: AnyMotion, count: int = INSTANTS) -> list[MotionSample]:
    """Return samples spread evenly over a step, with at least one in every slip phase, however short.

    There are fewer where a motion has few samples.

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
    motion = view_motion(motion)
    start = motion.segments[0].time[0]
    times = start + np.linspace(0, motion.period, count)
    owner = [_segment_at(motion, time) for time in times]
    for number, segment in enumerate(motion.segments):
        if segment.slipping and number not in owner:
            middle = (segment.time[0] + segment.time[-1]) / 2
            nearest = int(np.argmin(np.abs(times - middle)))
            times[nearest], owner[nearest] = middle, number
    chosen = zip(times, (motion.segments[number] for number in owner), strict=True)
    samples = (MotionSample(segment, int(np.argmin(np.abs(segment.time - time)))) for time, segment in chosen)
    return list(dict.fromkeys(samples))


def draw_stick_figures(axes: "Axes", motion: AnyMotion, count: int = INSTANTS, *, tallest: float = TALLEST) -> None:
    """Draw a step as a row of stick figures on its slope, with contact forces, times, and slides of the stance foot.

    Forces have a smaller scale if one would extend above the walker.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    motion : Motion, PlanarMotion or MotionView
        Its points must be finite.
    count : int
        How many figures.
    tallest : float [inch]
        Largest height of the row, in which the times below the figures do not overlap.
    """
    motion = view_motion(motion)
    instants = choose_instants(motion, count)
    slope = motion.parameters["slope"]
    figures = [figure_points(motion, instant.segment)[:, :, instant.sample] for instant in instants]
    height = walker_height(figures)
    highest = max(find_force_top(motion, each.segment, each.sample, height=height) for each in instants)
    unit = height * min(1.0, height / highest) if highest > 0 else height  # no force extends above the walker
    cones = [find_cone_ends(motion, instant.segment, instant.sample, height=unit) for instant in instants]
    tops = [find_force_top(motion, instant.segment, instant.sample, height=unit) for instant in instants]
    top = max(*tops, *(float(np.max(figure[1])) for figure in figures))  # above the figures in a jump
    spacing = max(_spacing(figures, cones), estimate_time_width(instants) / tallest * top)
    shifts = spacing * np.arange(len(instants), dtype=float)
    for instant, shift in zip(instants, shifts, strict=True):
        draw_contact_forces(axes, motion, instant.segment, instant.sample, shift=shift, height=unit)
        _draw_walker(axes, motion, instant, shift, slope)
    _draw_grounds(axes, motion, figures, shifts)
    draw_instant_labels(axes, motion, instants, shifts, slope)
    _draw_key(axes, motion, wide=count == INSTANTS)
    axes.set_aspect("equal")
    axes.margins(0.01, 0.03)
    _raise_flat(axes)
    axes.axis("off")


def _raise_flat(axes: "Axes") -> None:
    """Extend the view of a flat robot upwards, so that the axes have a height."""
    (low, high), (left, right) = axes.get_ylim(), axes.get_xlim()
    axes.set_ylim(low, max(high, low + LEAST_SHAPE * (right - left)))


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


def _segment_at(motion: MotionView, time: float) -> int:
    ends = [segment.time[-1] for segment in motion.segments]
    return min(int(np.searchsorted(ends, time)), len(ends) - 1)


def _draw_feet(axes: "Axes", motion: MotionView, outlines: Array, feet: Sequence[int], slope: float) -> None:
    """Draw the arcs of round feet, the thick first one below the others.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    motion : MotionView
    outlines : (2, n, n_feet) array [m]
        Arcs of the feet.
    feet : sequence of int
        Their numbers.
    slope : float [rad]
    """
    for outline, foot in zip(np.moveaxis(outlines, 2, 0), feet, strict=True):
        color, _, order = leg_look(motion, foot)
        width = 1.3 if order == FRONT else 2.0
        axes.plot(*tilt(outline, slope), color=color, linewidth=width, zorder=order, solid_capstyle="round")


def leg_look(motion: MotionView, contact: int | None) -> tuple[str, float, float]:
    """Return colour, line width and drawing order of the leg of a contact, or of the body."""
    if contact is None:
        return BODY, 2.0, 2
    number = motion.leg_of(contact)
    return leg_color(number), 1.3 if number else 2.6, FRONT if number else FRONT - 1


def _spacing(figures: Sequence[Array], cones: Sequence[tuple[float, float]]) -> float:
    """Return the smallest distance between neighbours that keeps them and their friction cones apart [m]."""
    height = walker_height(figures)
    height = height or max(float(np.max(np.abs(figure[1]))) for figure in figures) or 1.0  # a single point is drawn
    overlap = max(float(left[0].max() - right[0].min()) for left, right in pairwise(figures))
    beside = max(left[1] - right[0] for left, right in pairwise(cones))
    return max(max(overlap, 0.0) + 0.2 * height, NARROWEST * height, beside + 0.02 * height)


def _draw_walker(axes: "Axes", motion: MotionView, instant: MotionSample, shift: float, slope: float) -> None:
    segment, aside = instant.segment, np.array([shift, 0.0])
    points = tilt(segment.points[:, :, instant.sample] + aside[:, None], slope)
    order = sorted(zip(motion.links, motion.link_contacts, strict=True), key=lambda pair: leg_look(motion, pair[1])[2])
    for link, contact in order:
        color, width, layer = leg_look(motion, contact)
        draw_links(axes, points, (link,), color=color, linewidth=width, zorder=layer)
    joints: dict[str, Any] = {"color": FIRST_LEG, "markersize": 5, "markerfacecolor": "white"}
    if motion.joints:  # the markers of an empty line would extend the layout to the corner of the figure
        axes.plot(*points[:, motion.joints], "o", zorder=5, clip_on=False, **joints)
    arc, rims = find_foot_arc(motion), segment.rims
    if arc is not None and rims is not None:
        feet = np.flatnonzero(rims[2, :, instant.sample] > 0)
        outlines = arc.outline(rims[:, feet, instant.sample]) + aside[:, None, None]
        _draw_feet(axes, motion, outlines, feet.tolist(), slope)
        for foot in find_open_feet(segment.points[:, :, instant.sample], rims[:, :, instant.sample]):
            color, width, layer = leg_look(motion, foot)
            spoke = tilt(arc.spoke(rims[:, foot, instant.sample]) + aside[:, None], slope)
            axes.plot(*spoke, color=color, linewidth=width, zorder=layer, solid_capstyle="round")
    for foot in motion.feet:
        mode = segment.modes[foot]
        if mode is Mode.FREE:
            continue
        color = leg_look(motion, foot)[0]
        place = tilt(segment.places[:, foot, instant.sample] + aside, slope)
        fill, size = (MODE_FILL[mode], 6) if mode.slips else (color, 4)
        axes.plot(*place, "o", color=color, markerfacecolor=fill, markersize=size, zorder=6, clip_on=False)


def _draw_grounds(axes: "Axes", motion: MotionView, figures: Sequence[Array], shifts: Array) -> None:
    """Draw the plane below all figures, or the terrain below each of them, as they are moved apart."""
    slope = motion.parameters["slope"]
    low, high = figures[0][0].min() + shifts[0], figures[-1][0].max() + shifts[-1]
    margin = 0.03 * (high - low)
    if motion.terrain is None:
        draw_ground(axes, None, (low - margin, high + margin), slope)
        return
    for figure, shift in zip(figures, shifts, strict=True):
        ends = float(figure[0].min() - margin), float(figure[0].max() + margin)
        draw_ground(axes, motion.terrain, ends, slope, shift=shift)


def _draw_key(axes: "Axes", motion: MotionView, *, wide: bool) -> None:
    """Name the legs, forces and patches of the ground above the figures."""
    from matplotlib.lines import Line2D

    entries: dict[str, Artist] = {}
    for contact in sorted({contact for contact in motion.link_contacts if contact is not None}):
        color, width, _ = leg_look(motion, contact)
        entries[motion.contacts[contact].leg] = Line2D([], [], color=color, linewidth=width)
    legs, names = [*entries.values()], [*entries]
    if motion.loaded:
        shown = len(LABELS) if motion.cone_feet else 1
        legs, names = [*legs, *force_handles()[:shown]], [*names, *LABELS[:shown]]
    if any(line.get_color() == PATCH for line in axes.lines):
        legs, names = [*legs, Line2D([], [], color=PATCH, linewidth=BAND)], [*names, "patch"]
    if not legs:
        return
    place: dict[str, Any] = {"loc": "lower center", "bbox_to_anchor": (0.5, 1), "borderaxespad": 0.5, "borderpad": 0}
    figure = root_figure(axes)
    if figure is not None:
        columns = MOST_COLUMNS if wide or len(legs) != MOST_COLUMNS else MOST_COLUMNS // 2  # four entries in two lines
        add_page_legend(axes, legs, names, columns=columns, width=figure.get_figwidth(), **place)
