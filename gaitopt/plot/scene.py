"""The main picture of an animation: the walker on its slope, its contact force, and the marks of its slides."""

from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.motion.animation_frames import AnimationFrame, AnimationFrames, SlideMark
from gaitopt.motion.foot_arc import MARKS, figure_points, find_foot_arc
from gaitopt.motion.gait import Gait
from gaitopt.motion.link_roles import classify_links, tilt
from gaitopt.motion.motion import Array
from gaitopt.plot.style import BODY, CONE, FIRST_LEG, FORCE, GROUND, MODE_FILL, MODE_INK, SECOND_LEG

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

WEIGHT_DRAWN = 0.45
"""Length of a force as large as the weight, in heights of the walker."""

LABEL_WIDTH = 0.9
"""Width of the label of a slide [inch]."""

CARETUP = 6
"""Matplotlib's marker of a triangle below a point, its tip there."""

BELOW, ABOVE = 0.25, 1.12
"""How much of the picture lies below and above the middle of the ground, in heights of the walker."""


class Scene:
    """The walker on its slope with the force on its foot, the friction cone and the marks of its slides.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
        Its shape decides how much ground is seen; the view follows a walk that is longer.
    gait : Gait
    film : AnimationFrames

    Attributes
    ----------
    moving : list of Artist
        What each frame draws again.
    scale : float
        Inches on the screen for a metre.
    """

    def __init__(self, axes: "Axes", gait: Gait, film: AnimationFrames) -> None:
        motion = gait.motion
        self._axes, self._film = axes, film
        self._slope, self._friction = motion.parameters["slope"], motion.parameters["friction"]
        figures = np.hstack([figure_points(motion, part).reshape(2, -1) for part in motion.segments])
        self._height = float(np.max(figures[1]))
        self._newton = WEIGHT_DRAWN * self._height / (motion.total_mass * motion.parameters["gravity"])
        self._skeleton, self._arc = classify_links(motion), find_foot_arc(motion)
        self._marks: dict[tuple[int, int], tuple[Any, Any]] = {}
        self._frame_view(figures[0], (film.steps - 1) * motion.travel)
        self._add_artists()

    def show(self, frame: AnimationFrame) -> None:
        """Move everything to its position in a frame."""
        points, foot = tilt(frame.points, self._slope), tilt(frame.foot, self._slope)
        swapped = frame.step % 2 == 1
        for pairs, lines, color in (
            (self._skeleton.stance, self._stance, SECOND_LEG if swapped else FIRST_LEG),
            (self._skeleton.swing, self._swing, FIRST_LEG if swapped else SECOND_LEG),
            (self._skeleton.body, self._body, BODY),
        ):
            for pair, line in zip(pairs, lines, strict=True):
                line.set(xdata=points[0, pair], ydata=points[1, pair], color=color)
        if self._arc is not None and frame.rims is not None:
            self._show_feet(frame.rims, swapped)
        self._joints.set_data(*points[:, self._skeleton.joints])
        self._foot.set(xdata=foot[:1], ydata=foot[1:], markerfacecolor=MODE_FILL[frame.mode])
        self._cone.set_xy((foot[:, None] + tilt(self._wedge, self._slope)).T)
        self._force.set_offsets([foot])
        self._force.set_UVC(*tilt(self._newton * frame.force, self._slope))
        for slide in self._film.slides(frame):
            self._mark(slide)
        self._look(frame)

    def _show_feet(self, rims: Array, swapped: bool) -> None:
        """Move the arcs of round feet and their marks."""
        if self._arc is None:
            return
        for foot, lines in enumerate(self._feet):
            color = (SECOND_LEG, FIRST_LEG)[(foot == 0) ^ swapped]
            marks = np.moveaxis(self._arc.marks(rims[:, foot]), 1, 0)
            for line, places in zip(lines, (self._arc.outline(rims[:, foot]), *marks), strict=True):
                x, y = tilt(places, self._slope)
                line.set(xdata=x, ydata=y, color=color)

    def _frame_view(self, x: Array, walked: float) -> None:
        """Choose the view: all of the walk where it fits, else a window that follows it."""
        box = self._axes.get_window_extent()
        self.scale = box.height / self._axes.figure.dpi / ((BELOW + ABOVE) * self._height)
        self._tall = (BELOW + ABOVE) * self._height
        self._wide = self._tall * box.width / box.height
        margin = 0.1 * self._height
        low, high = float(x.min()) - margin, float(x.max()) + walked + margin
        first, last = low + self._wide / 2, high - self._wide / 2
        self._centres = (first, last) if last > first else ((low + high) / 2,) * 2
        ground = tilt(np.array([[low - self._wide, high + self._wide], [0.0, 0.0]]), self._slope)
        self._axes.plot(*ground, color=GROUND, linewidth=1.2, zorder=1)
        self._axes.axis("off")

    def _add_artists(self) -> None:
        """Create what :meth:`show` moves."""
        axes = self._axes
        leg: dict[str, Any] = {"linewidth": 4.0, "solid_capstyle": "round"}
        self._body = [axes.plot([], [], zorder=3, **leg)[0] for _ in self._skeleton.body]
        self._swing = [axes.plot([], [], zorder=4, **leg)[0] for _ in self._skeleton.swing]
        self._stance = [axes.plot([], [], zorder=5, **leg)[0] for _ in self._skeleton.stance]
        widths = (4.0, *(1.5,) * MARKS) if self._arc else ()
        self._feet = [
            [axes.plot([], [], zorder=order, **leg | {"linewidth": width})[0] for width in widths] for order in (5, 4)
        ]
        (self._joints,) = axes.plot([], [], "o", color="0.2", markerfacecolor="white", markersize=9, zorder=6)
        (self._foot,) = axes.plot([], [], "o", color="0.2", markersize=8, zorder=7)
        self._force = axes.quiver(
            [0], [0], [0], [1], angles="xy", scale_units="xy", scale=1, width=0.007, color=FORCE, zorder=8
        )
        self._force.set_label("contact force")
        half = min(np.arctan(self._friction), np.pi / 2)
        angles = np.linspace(-half, half, 24)
        length = 1.25 * WEIGHT_DRAWN * self._height
        self._wedge = np.hstack([np.zeros((2, 1)), length * np.stack([np.sin(angles), np.cos(angles)])])
        (self._cone,) = axes.fill([0], [0], facecolor=CONE, edgecolor="0.6", linewidth=0.6, zorder=2)
        self._cone.set_label("friction cone")
        axes.legend(handles=[self._force, self._cone], loc="upper left", bbox_to_anchor=(0.02, 1.0), fontsize=9)
        legs = [*self._body, *self._swing, *self._stance, *self._feet[0], *self._feet[1]]
        self.moving: list[Artist] = [self._cone, *legs, self._joints, self._foot, self._force]

    def _mark(self, slide: SlideMark) -> None:
        """Draw a slide to scale on the ground, and below it its direction and length, which are always legible."""
        key = (slide.step, slide.order)
        if key not in self._marks:
            self._marks[key] = self._add_mark(slide)
        line, text = self._marks[key]
        line.set_data(*tilt(np.array([[slide.start, slide.end], [0.0, 0.0]]), self._slope))
        arrow = "\N{RIGHTWARDS ARROW}" if slide.mode.sign > 0 else "\N{LEFTWARDS ARROW}"
        slid = 1e3 * abs(slide.end - slide.start)
        text.set_text(f"{arrow} {slid:.{2 if slid < 10 else 1 if slid < 100 else 0}f} mm")

    def _add_mark(self, slide: SlideMark) -> tuple[Any, Any]:
        """Create the line and the text of a slide, and a pointer that shows where even a tiny one is."""
        fill, ink = MODE_FILL[slide.mode], MODE_INK[slide.mode]
        (line,) = self._axes.plot([], [], color=fill, linewidth=5, solid_capstyle="butt", zorder=2)
        x, y = tilt(np.array([slide.start, 0.0]), self._slope)
        (pointer,) = self._axes.plot([x], [y], marker=CARETUP, color=fill, markersize=8, zorder=2)
        style: dict[str, Any] = {"color": ink, "weight": "bold", "ha": "center", "va": "top", "fontsize": 9}
        # Where steps are too short for the labels to lie side by side, every other one goes down a line.
        row = slide.order + (slide.step % 2 if self.scale * self._film.motion.travel < LABEL_WIDTH else 0)
        below = (0, -10 - 14 * row)
        text = self._axes.annotate("", (x, y), below, textcoords="offset points", annotation_clip=True, **style)
        self.moving += [line, pointer, text]
        return line, text

    def _look(self, frame: AnimationFrame) -> None:
        """Point the view at where the walk has come to, at a steady pace so that it is the walker that moves."""
        first, last = self._centres
        share = frame.time / (self._film.steps * self._film.motion.period)
        x, y = tilt(np.array([first + share * (last - first), 0.0]), self._slope)
        self._axes.set_xlim(x - self._wide / 2, x + self._wide / 2)
        self._axes.set_ylim(y - BELOW * self._height, y - BELOW * self._height + self._tall)
