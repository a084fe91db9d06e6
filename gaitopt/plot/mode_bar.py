"""The mode of each contact over time, as a bar for each contact."""

from typing import TYPE_CHECKING, Any

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion_view import MotionView
from gaitopt.plot.style import MODE_FILL, MODE_HATCH, root_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

HEIGHT = 0.7
"""Height of a bar over the distance of neighbouring bars."""

LETTER = 0.07
"""Width of a letter [inch]."""

AXIS_SHARE = 0.7
"""Width of the time axis over that of the figure."""


def draw_mode_bar(axes: "Axes", view: MotionView) -> None:
    """Draw the mode of each contact over time; flight, and the modes of long phases, are named.

    The modes of phases too short for their names, but for slip, are labels of bars, which a legend shows.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    view : MotionView
    """
    shown, letter, unnamed = view.closing, _letter_width(axes, view), set[Mode]()
    for row, contact in enumerate(shown):
        for start, end, mode in merge_modes(view, contact):
            if mode is not Mode.FREE:
                _draw_bar(axes, (start, end), row, mode, letter, unnamed)
    feet = [row for row, contact in enumerate(shown) if contact in view.feet]
    for part in view.segments:
        if view.is_flight(part) and part.duration > len("flight") * letter:
            middle = float(part.time[0] + part.time[-1]) / 2
            axes.text(middle, sum(feet) / max(len(feet), 1), "flight", ha="center", va="center", style="italic")
    for event in view.events[:-1]:
        axes.axvline(event.time, color="0.6", linewidth=0.6, zorder=0)
    axes.set_yticks(range(len(shown)), [view.contacts[contact].name for contact in shown])
    axes.set_ylim(max(len(shown), 1) - 0.5, -0.5)
    axes.grid(visible=False)
    axes.tick_params(left=False)


def merge_modes(view: MotionView, contact: int) -> list[tuple[float, float, Mode]]:
    """Return begin, end and mode of each interval in which the mode of a contact is the same.

    Examples
    --------
    >>> from gaitopt import load
    >>> from gaitopt.motion.view_motion import view_motion
    >>> view = view_motion(load("docs/examples/compass_slip.h5").motion)
    >>> [mode.value for _, _, mode in merge_modes(view, 0)]
    ['slip+', 'stick']
    """
    intervals: list[tuple[float, float, Mode]] = []
    for part in view.segments:
        start, end, mode = float(part.time[0]), float(part.time[-1]), part.modes[contact]
        if intervals and intervals[-1][2] is mode:
            start = intervals.pop()[0]
        intervals.append((start, end, mode))
    return intervals


def _letter_width(axes: "Axes", view: MotionView) -> float:
    """Return the width of a letter on the time axis [s]."""
    figure = root_figure(axes)
    return LETTER / (AXIS_SHARE * figure.get_figwidth()) * view.period if figure else 0.0


def _draw_bar(axes: "Axes", span: tuple[float, float], row: int, mode: Mode, letter: float, unnamed: set[Mode]) -> None:
    """Draw an interval of a mode, and its name if it fits in letters of a width [s]; add other modes to `unnamed`."""
    width = span[1] - span[0]
    fits = width > len(mode.label) * letter
    style: dict[str, Any] = {"facecolor": MODE_FILL[mode], "edgecolor": "0.3", "hatch": MODE_HATCH[mode]}
    label = mode.label if not (fits or mode.slips or mode in unnamed) else None
    axes.barh(row, width, HEIGHT, left=span[0], linewidth=0.5, gid=mode.value, label=label, **style)
    if not fits:
        unnamed.add(mode)
    else:
        text: dict[str, Any] = {"color": "black", "ha": "center", "va": "center"}
        if MODE_HATCH[mode]:  # on which letters are not readable; a box may be higher than the bar
            text["bbox"] = {"boxstyle": "square,pad=0.1", "facecolor": MODE_FILL[mode], "edgecolor": "none"}
        axes.text(sum(span) / 2, row, mode.label, **text)
