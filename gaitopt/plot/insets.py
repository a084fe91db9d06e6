"""The small pictures of an animation: contact force, stance foot enlarged, contact sequence and time."""

from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.model.coordinate_entries import SLIDE
from gaitopt.motion.animation_frames import AnimationFrame, AnimationFrames
from gaitopt.motion.gait import Gait
from gaitopt.motion.link_roles import classify_links
from gaitopt.motion.motion import Array
from gaitopt.plot.style import CONE, FIRST_LEG, FORCE, GROUND, MODE_FILL, MODE_INK, SECOND_LEG, WARNING

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PLAIN_GROUND = 5e-3
"""Length of ground seen under a foot that does not slide [m]."""


class ForceDiagram:
    """The contact force over the weight, tangential against normal, in the friction cone.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    gait : Gait

    Attributes
    ----------
    moving : list of Artist
        What each frame draws again.
    """

    def __init__(self, axes: "Axes", gait: Gait) -> None:
        motion = gait.motion
        self._weight = motion.total_mass * motion.parameters["gravity"]
        friction = motion.parameters["friction"]
        f_t, f_n = motion.channel("force") / self._weight
        top = 1.2 * max(float(np.max(f_n)), 0.1)
        side = 1.2 * max(float(np.max(np.abs(f_t))), min(friction, 1.0) * top / 1.2)
        if np.isfinite(friction):
            axes.fill([0, -friction * top, friction * top], [0, top, top], facecolor=CONE, edgecolor="0.6")
        for segment in motion.segments:
            axes.plot(*segment.force / self._weight, color="0.4", linewidth=1)
        (self._line,) = axes.plot([], [], color=FORCE, linewidth=2)
        (self._tip,) = axes.plot([], [], "o", color=FORCE, markersize=6)
        axes.set(xlim=(-side, side), ylim=(0, top), xlabel=r"$f_t$ / weight", ylabel=r"$f_n$ / weight")
        axes.set_title("contact force in the friction cone")
        axes.locator_params(nbins=5)
        self.moving: list[Artist] = [self._line, self._tip]

    def show(self, frame: AnimationFrame) -> None:
        """Move the force to its position in a frame."""
        f_t, f_n = frame.force / self._weight
        self._line.set_data([0, f_t], [0, f_n])
        self._tip.set_data([f_t], [f_n])


class FootGlass:
    """An enlarged view of the stance foot, centred on the place where the foot landed, with a ruler in mm.

    With a round foot the glass rolls along, so that the ruler shows the slide alone.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    gait : Gait
    film : AnimationFrames
    scale : float
        Inches on the screen for a metre in the main picture, which determine the stated magnification of the foot.

    Attributes
    ----------
    moving : list of Artist
        What each frame draws again.
    """

    def __init__(self, axes: "Axes", gait: Gait, film: AnimationFrames, scale: float) -> None:
        motion, skeleton = gait.motion, classify_links(gait.motion)
        self._axes, self._film, self._travel = axes, film, motion.travel
        self._landing, self._foot_point = float(motion.segments[0].q[SLIDE, 0]), skeleton.stance_foot
        self._round = motion.segments[0].rims is not None
        self._neighbours = [a if b == self._foot_point else b for a, b in skeleton.stance if self._foot_point in (a, b)]
        slid = motion.channel("q")[SLIDE] - self._landing
        width = 1e3 * max(3 * float(np.ptp(slid)), PLAIN_GROUND)
        middle = 1e3 * float(slid.max() + slid.min()) / 2
        box = axes.get_window_extent()
        self._tall = width * box.height / box.width
        axes.set(xlim=(middle - width / 2, middle + width / 2), ylim=(-0.3 * self._tall, 0.7 * self._tall))
        axes.set(xlabel="slide since touchdown [mm]", yticks=[])
        larger = box.width / axes.figure.dpi / (width / 1e3) / scale
        axes.set_title(f"stance foot, {float(f'{larger:.2g}'):g} times larger")
        self._add_artists()

    def show(self, frame: AnimationFrame) -> None:
        """Move the foot to its position in a frame."""
        landing = self._landing + frame.step * self._travel
        x = 1e3 * (frame.slide - landing)
        for leg, (along, up) in zip(self._legs, self._lines(frame), strict=True):
            leg.set(xdata=x + along, ydata=up, color=SECOND_LEG if frame.step % 2 else FIRST_LEG)
        self._foot.set(xdata=[x], ydata=[0], markerfacecolor=MODE_FILL[frame.mode])
        slides = [slide for slide in self._film.slides(frame) if slide.step == frame.step]
        for slide, mark in zip(slides, self._marks, strict=False):
            ends = 1e3 * (slide.slide - landing + np.array([0.0, slide.end - slide.start]))
            mark.set(xdata=ends, ydata=[-self._tall * (0.08 + 0.07 * slide.order)] * 2, color=MODE_FILL[slide.mode])
        for mark in self._marks[len(slides) :]:
            mark.set_data([], [])
        self._air.set_facecolor((MODE_FILL[frame.mode], 0.18) if frame.mode.slips else "none")

    def _lines(self, frame: AnimationFrame) -> list[tuple[Array, Array]]:
        """Return the lines of the foot about the place where it touches the ground [mm]: its rim, or its links."""
        if frame.rims is not None:
            radius = 1e3 * float(frame.rims[2, 0])
            angles = np.linspace(-1, 1, 200) * min(3 * self._tall / radius, np.pi / 2)
            return [(radius * np.sin(angles), radius * (1 - np.cos(angles)))]
        directions = [frame.points[:, other] - frame.points[:, self._foot_point] for other in self._neighbours]
        ends = [3 * self._tall * direction / np.linalg.norm(direction) for direction in directions]
        return [(np.array([0.0, x]), np.array([0.0, y])) for x, y in ends]

    def _add_artists(self) -> None:
        """Create what :meth:`show` moves."""
        axes = self._axes
        axes.axhspan(-self._tall, 0, color="0.93", zorder=0)
        self._air = axes.axhspan(0, self._tall, zorder=0)
        axes.axhline(0, color=GROUND, linewidth=1.2, zorder=2)
        axes.plot([0, 0], [-0.3 * self._tall, 0], color="0.5", linewidth=1, zorder=2)
        leg: dict[str, Any] = {"linewidth": 7, "solid_capstyle": "round", "zorder": 3}
        self._legs = [axes.plot([], [], **leg)[0] for _ in ([None] if self._round else self._neighbours)]
        (self._foot,) = axes.plot([], [], "o", color="0.2", markersize=13, zorder=4)
        slips = sum(segment.mode.slips for segment in self._film.motion.segments)
        style: dict[str, Any] = {"linewidth": 5, "solid_capstyle": "butt", "zorder": 3}
        self._marks = [axes.plot([], [], **style)[0] for _ in range(slips)]
        self.moving: list[Artist] = [self._air, *self._legs, self._foot, *self._marks]


class Header:
    """The contact sequence with its current phase highlighted, the time, and whether the gait is a solution.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    gait : Gait
    film : AnimationFrames

    Attributes
    ----------
    moving : list of Artist
        What each frame draws again.
    """

    def __init__(self, figure: "Figure", gait: Gait, film: AnimationFrames) -> None:
        self._steps, self._slowest = film.steps, film.slow
        tokens = [*(mode.value for mode in gait.sequence.phases), "|", gait.sequence.impact.value]
        self._fills = [*(MODE_FILL[mode] for mode in gait.sequence.phases), "none", MODE_FILL[gait.sequence.impact]]
        size, left = 14.0, 0.025
        self._tokens = []
        for token in tokens:
            text = figure.text(left, 0.935, token, family="DejaVu Sans Mono", size=size, va="center")
            self._tokens.append(text)
            left += (len(token) + 1.2) * 0.602 * size / 72 / figure.get_figwidth()
        self._stamp = figure.text(0.975, 0.935, "", family="DejaVu Sans Mono", size=10.5, va="center", ha="right")
        self.moving: list[Artist] = [*self._tokens, self._stamp]
        slope, friction = (gait.motion.parameters[name] for name in ("slope", "friction"))
        ground = rf"friction $\mu$ = {friction:g}"
        ground += f", slope {np.rad2deg(slope):.3g}\N{DEGREE SIGN} downhill" if slope else ""
        figure.text(0.025, 0.03, ground, size=9, va="center")
        if not gait.status.ok:
            verdict = f"NOT A SOLUTION ({gait.status.key})"
            figure.text(0.025, 0.075, verdict, color=WARNING, weight="bold", size=12, va="center")

    def show(self, frame: AnimationFrame) -> None:
        """Highlight the phase of a frame, and its impact just after touchdown; write the time."""
        current = {frame.phase} | ({len(self._tokens) - 1} if frame.touchdown else set())
        for number, (text, fill) in enumerate(zip(self._tokens, self._fills, strict=True)):
            box = {"boxstyle": "round,pad=0.25", "facecolor": (fill, 0.55), "edgecolor": "0.2"}
            text.set_bbox(box if number in current else None)
            text.set_color("black" if number in current else "0.45")
        slower = frame.slowness > 1.01 * self._slowest
        self._stamp.set_color(MODE_INK[frame.mode] if slower else "0.2")
        pace = f"slowed {frame.slowness:.2g}\N{MULTIPLICATION SIGN}"
        self._stamp.set_text(f"step {frame.step + 1}/{self._steps}   t = {frame.time:.3f} s   {pace:>11}")
