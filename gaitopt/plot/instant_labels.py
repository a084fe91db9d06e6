"""Labels of the stick figures of a step: times, and where a phase begins its slides, none of which overlap."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.link_roles import tilt
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import MotionView, PhaseView
from gaitopt.plot.style import MODE_INK, root_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LETTER = 0.64
"""Mean width of a letter over the size of letters."""

GAP = 1.0
"""Least horizontal distance of two labels [letters]."""

TIME_TOP, SLIDE_TOP, SLIDE_HEIGHT = 0.75, 2.1, 2.5
"""Distances of a time and of the first slide from the ground, and height of a slide, over the size of letters."""

LEAST_SLIDE = 1e-3
"""Length below which a slide is stated as shorter [mm]."""

TALLEST = 2.4
"""Largest height of the row of stick figures [inch]."""


class MotionSample(NamedTuple):
    """A sample of a motion: its segment, and the column in the arrays of the segment."""

    segment: PhaseView
    sample: int

    @property
    def time(self) -> float:
        """Time of the sample [s]."""
        return float(self.segment.time[self.sample])


class _LabelArea(NamedTuple):
    """The area of the labels of a phase: ends along the axis [m], and first and last row below the times."""

    left: float
    right: float
    top: int
    bottom: int

    def overlaps(self, other: "_LabelArea") -> bool:
        """Return whether two areas have a common point."""
        beside = self.right <= other.left or other.right <= self.left
        return not beside and self.top < other.bottom and other.top < self.bottom


def draw_instant_labels(
    axes: "Axes", motion: MotionView, instants: Sequence[MotionSample], shifts: Array, slope: float
) -> None:
    """Write the time below each figure, and where a phase begins its slides, or that no foot is on the ground.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        With the stick figures, whose extent determines the scale.
    motion : MotionView
    instants : sequence of MotionSample
    shifts : (K,) array [m]
        Displacement of each stick figure along the ground.
    slope : float [rad]
    """
    size = _find_letter_size()
    below: dict[str, Any] = {"textcoords": "offset points", "ha": "center", "va": "top", "fontsize": size}
    places = np.array([_ground_below(motion, instant) for instant in instants]) + np.stack([shifts, 0 * shifts], axis=1)
    x, y = tilt(places.T, slope)
    times, scale = _write_times(instants), _estimate_scale(axes)
    gap = GAP * LETTER * size / 72
    moved = spread_places(x, estimate_time_width(instants) / scale)
    y = y - np.tan(slope) * (moved - x)
    named, areas = set[int](), list[_LabelArea]()
    for instant, time, corner in zip(instants, times, zip(moved.tolist(), y.tolist(), strict=True), strict=True):
        axes.annotate(time, corner, (0, -TIME_TOP * size), color="0.25", **below)
        if id(instant.segment) in named:
            continue
        if motion.is_flight(instant.segment) and instant.sample == instant.segment.time.size - 1:
            continue  # the instant of the landing
        named.add(id(instant.segment))
        labels = _list_labels(motion, instant.segment)
        width = max((_measure_text(axes, text, fontsize=size, **look) for text, look in labels), default=0.0) + gap
        area = _place_labels(len(labels), corner[0], width / scale, areas)
        for row, (text, look) in enumerate(labels, area.top):
            axes.annotate(text, corner, (0, -(SLIDE_TOP + SLIDE_HEIGHT * row) * size), **look, **below)


def estimate_time_width(instants: Sequence[MotionSample]) -> float:
    """Return the width that the longest time takes below a stick figure [inch]."""
    return _find_letter_size() / 72 * LETTER * (max(map(len, _write_times(instants))) + GAP)


def _write_times(instants: Sequence[MotionSample]) -> list[str]:
    """Return the texts of the times."""
    return [f"{instant.time:.3f} s" for instant in instants]


def _find_letter_size() -> float:
    """Return the size of the letters of labels [pt]."""
    from matplotlib import rcParams
    from matplotlib.font_manager import FontProperties

    # The setting is a number, or a name such as medium.
    return float(FontProperties(size=rcParams["legend.fontsize"]).get_size_in_points())


def spread_places(places: Array, gap: float) -> Array:
    """Return increasing places that are at least a gap apart and have the least squared distances from the given ones.

    Examples
    --------
    >>> spread_places(np.array([0.0, 5.0, 6.0]), 2.0).tolist()
    [0.0, 4.5, 6.5]
    """
    groups: list[tuple[float, int]] = []
    for number, place in enumerate(places.tolist()):
        mean, count = place - number * gap, 1
        while groups and groups[-1][0] > mean:
            before, others = groups.pop()
            mean, count = (mean * count + before * others) / (count + others), count + others
        groups.append((mean, count))
    return np.repeat([mean for mean, _ in groups], [count for _, count in groups]) + gap * np.arange(places.size)


def _estimate_scale(axes: "Axes") -> float:
    """Return an estimate of the scale of stick figures [inch/m]."""
    figure = root_figure(axes)
    width, height = np.maximum(axes.dataLim.size, 1e-9)
    return float(min((figure.get_figwidth() if figure else 1.0) / width, TALLEST / height))


def _list_labels(motion: MotionView, segment: PhaseView) -> list[tuple[str, dict[str, Any]]]:
    """Return the texts and looks of the labels of a phase, from top to bottom."""
    labels: list[tuple[str, dict[str, Any]]] = []
    for foot in segment.slipping:
        mode, length = segment.modes[foot], abs(1e3 * segment.slide(foot))
        arrow = "\N{RIGHTWARDS ARROW}" if mode.sign > 0 else "\N{LEFTWARDS ARROW}"
        slid = f"{length:.3g} mm" if length >= LEAST_SLIDE else f"< {LEAST_SLIDE:g} mm"
        several = len(motion.loaded) > 1
        text = f"{motion.contacts[foot].name}\n{arrow} {slid}" if several else f"{arrow} {mode.label}\n{slid}"
        labels.append((text, {"color": MODE_INK[mode], "weight": "bold"}))
    if motion.is_flight(segment):
        labels.append(("flight", {"color": "0.25", "style": "italic"}))
    return labels


def _measure_text(axes: "Axes", text: str, **look: Any) -> float:
    """Return the width of a text [inch]."""
    figure = root_figure(axes)
    if figure is None:
        return 0.0
    drawn = figure.text(0, 0, text, **look)
    width = float(drawn.get_window_extent().width) / figure.dpi
    drawn.remove()
    return width


def _place_labels(count: int, place: float, width: float, areas: list[_LabelArea]) -> _LabelArea:
    """Return the highest area at a place for a number of labels that overlaps no earlier one, and add it to them."""
    area = _LabelArea(place - width / 2, place + width / 2, 0, count)
    while count and (others := [other for other in areas if area.overlaps(other)]):
        top = max(other.bottom for other in others)
        area = area._replace(top=top, bottom=top + count)
    if count:
        areas.append(area)
    return area


def _ground_below(motion: MotionView, instant: MotionSample) -> Array:
    """Return the place of the first foot on the ground, or below the middle of the feet in flight, shape (2,) [m]."""
    segment, feet = instant.segment, motion.feet
    closed = [foot for foot in feet if segment.modes[foot] is not Mode.FREE]
    if closed:
        return np.asarray(segment.places[:, closed[0], instant.sample])
    shown = [motion.foot_points[foot] for foot in feet] or slice(None)
    return np.array([segment.points[0, shown, instant.sample].mean(), 0.0])
