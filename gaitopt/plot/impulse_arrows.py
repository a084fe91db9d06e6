"""Impulses of actuators in an animation: their values, and arrows of the reactions at the feet."""

from typing import TYPE_CHECKING, Any

from gaitopt.motion.animation_frames import AnimationFrame, AnimationFrames
from gaitopt.motion.link_roles import tilt
from gaitopt.motion.shown_impulses import SHARE, list_shown_impulses
from gaitopt.plot.style import FORCE

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

OUTLINE: dict[str, Any] = {"facecolor": "white", "edgecolor": FORCE, "linewidth": 1.2}
"""Style of the arrows, which differs from that of forces."""


class ImpulseArrows:
    """The impulses of actuators at the impacts of an animation, each shown for 0.3 s on the screen.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    film : AnimationFrames
    height : float [m]
        Height of the walker.

    Attributes
    ----------
    handles : list of Artist
        For the legend; empty without impulses.
    moving : list of Artist
        What each frame draws again.
    """

    def __init__(self, axes: "Axes", film: AnimationFrames, height: float) -> None:
        from matplotlib.patches import Patch

        slope = film.motion.parameters["slope"]
        scaled: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1}
        right: dict[str, Any] = {"ha": "right", "va": "top", "fontsize": 9, "zorder": 9}
        self._shown = []
        for each in list_shown_impulses(film, film.steps):
            places, arrows = (tilt(values, slope) for values in (each.places, SHARE * height * each.arrows))
            drawn: list[Artist] = [axes.text(0.99, 0.985, "\n".join(each.lines), transform=axes.transAxes, **right)]
            if places.size:
                drawn.append(axes.quiver(*places, *arrows, width=0.009, zorder=8, **scaled, **OUTLINE))
            self._shown.append((each, drawn))
        label = "reaction to impulses of actuators"
        self.handles: list[Artist] = [Patch(label=label, **OUTLINE)] if self._shown else []
        self.moving: list[Artist] = [artist for _, drawn in self._shown for artist in drawn]

    def show(self, frame: AnimationFrame) -> None:
        """Show the impulses of the impact just before a frame."""
        for each, drawn in self._shown:
            for artist in drawn:
                artist.set_visible(each.begin <= frame.shown < each.end)
