"""The small pictures of an animation: contact force, stance foot enlarged, contact sequence and time."""

from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.animation_frames import AnimationFrame, AnimationFrames
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import ONE_AND_OTHER, MotionView
from gaitopt.motion.planar_gait import AnyGait
from gaitopt.motion.printable import replace_controls, show_minus
from gaitopt.motion.view_motion import AnyMotion, view_motion
from gaitopt.plot.style import CONE, FORCE, GROUND, MODE_FILL, MODE_INK, WARNING, leg_color

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PLAIN_GROUND = 5e-3
"""Length of ground seen under a foot that does not slide [m]."""

LARGEST, SMALLEST, LETTER_WIDTH, SEQUENCE_WIDTH = 14.0, 7.0, 0.602, 0.53
"""Sizes of the contact sequence [point], width of its letters over their size, and its share of the width."""


LEGEND_END = 0.7
"""Right end of the legend of the legs, as a share of the width."""


class HasMotion(Protocol):
    """A gait, or the frames of an animation."""

    @property
    def motion(self) -> AnyMotion:
        """The motion."""


class ForceDiagram:
    """The contact forces over the weight, tangential against normal, in the friction cone.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    gait : Gait, PlanarGait or AnimationFrames
        Whatever has a motion.

    Attributes
    ----------
    moving : list of Artist
        What each frame draws again.
    """

    def __init__(self, axes: "Axes", gait: HasMotion) -> None:
        self._view = view = view_motion(gait.motion)
        friction = view.parameters["friction"]
        f_t, f_n = np.concatenate([part.forces[list(view.loaded)] for part in view.segments], axis=-1).swapaxes(0, 1)
        top = 1.2 * max(float(np.max(f_n / view.weight, initial=0)), 0.1)
        widest = float(np.max(np.abs(f_t / view.weight), initial=0))
        side = 1.2 * max(widest, min(friction, 1.0) * top / 1.2)
        if view.cone_feet:
            axes.fill([0, -friction * top, friction * top], [0, top, top], facecolor=CONE, edgecolor="0.6")
        for segment in view.segments:
            for foot in view.loaded:
                if segment.modes[foot] is not Mode.FREE:
                    axes.plot(*segment.forces[foot] / view.weight, color="0.4", linewidth=1)
        self._lines, self._tips = {}, {}
        for foot in view.loaded:
            (self._lines[foot],) = axes.plot([], [], color=FORCE, linewidth=2)
            (self._tips[foot],) = axes.plot([], [], "o", color=FORCE, markersize=6)
        axes.set(xlim=(-side, side), ylim=(0, top), xlabel=r"$f_t$ / weight", ylabel=r"$f_n$ / weight")
        axes.set_title("contact force in the friction cone" if view.cone_feet else "contact force")
        axes.locator_params(nbins=5)
        self.moving: list[Artist] = [*self._lines.values(), *self._tips.values()]

    def show(self, frame: AnimationFrame) -> None:
        """Move the forces to their positions in a frame."""
        view = self._view
        for foot, line in self._lines.items():
            tip, (f_t, f_n) = self._tips[foot], frame.forces[foot] / view.weight
            is_open = frame.modes[foot] is Mode.FREE
            line.set_data(*([[], []] if is_open else [[0, f_t], [0, f_n]]))
            tip.set_data(*([[], []] if is_open else [[f_t], [f_n]]))
            if not view.is_single_support:
                color = leg_color(view.leg_of(view.owner(foot, frame.exchanges)))
                line.set_color(color)
                tip.set_color(color)


class EnlargedFoot:
    """An enlarged view of a foot, centred on the place where the foot landed, with a ruler in mm.

    With a round foot the view moves with the rolling, so that the ruler shows the slide alone.  With several feet it
    shows the one that slides the furthest.

    Parameters
    ----------
    axes : matplotlib.axes.Axes
    gait : Gait, PlanarGait or AnimationFrames
        Whatever has a motion.
    film : AnimationFrames
    scale : float
        Inches on the screen for a metre in the main picture, which determine the stated magnification of the foot.

    Attributes
    ----------
    moving : list of Artist
        What each frame draws again.
    """

    def __init__(self, axes: "Axes", gait: HasMotion, film: AnimationFrames, scale: float) -> None:
        view = view_motion(gait.motion)
        self._axes, self._film, self._view, self._travel = axes, film, view, view.travel
        self._contact, slid = choose_foot(view)
        self._landing, self._foot_point = float(slid[0]), view.foot_points[self._contact]
        self._round = view.segments[0].rims is not None
        leg = [link for link, contact in zip(view.links, view.link_contacts, strict=True) if contact == self._contact]
        self._neighbours = [a if b == self._foot_point else b for a, b in leg if self._foot_point in (a, b)]
        slid = slid - self._landing
        width = 1e3 * max(3 * float(np.ptp(slid)), PLAIN_GROUND)
        middle = 1e3 * float(slid.max() + slid.min()) / 2
        box = axes.get_window_extent()
        self._tall = width * box.height / box.width
        axes.set(xlim=(middle - width / 2, middle + width / 2), ylim=(-0.3 * self._tall, 0.7 * self._tall))
        axes.set(xlabel="slide since touchdown [mm]", yticks=[])
        larger = float(f"{box.width / axes.figure.dpi / (width / 1e3) / scale:.2g}")
        size = f"{larger:g} times larger" if larger > 1 else "its slide"
        axes.set_title(f"{view.contacts[self._contact].name}, {size}")
        self._add_artists()

    def show(self, frame: AnimationFrame) -> None:
        """Move the foot to its position in a frame; in the air it is not shown."""
        landing = self._landing + frame.step * self._travel
        mode = frame.modes[self._contact]
        for artist in (*self._legs, self._foot):
            artist.set_visible(mode is not Mode.FREE)
        x = 1e3 * (frame.slides[self._contact] - landing)
        color = leg_color(self._view.leg_of(self._view.owner(self._contact, frame.exchanges)))
        for leg, (along, up) in zip(self._legs, self._lines(frame), strict=True):
            leg.set(xdata=x + along, ydata=up, color=color)
        self._foot.set(xdata=[x], ydata=[0], markerfacecolor=MODE_FILL[mode])
        slides = [
            slide for slide in self._film.slides(frame) if slide.step == frame.step and slide.contact == self._contact
        ]
        for slide, mark in zip(slides, self._marks, strict=False):
            ends = 1e3 * (slide.slide - landing + np.array([0.0, slide.end - slide.start]))
            mark.set(xdata=ends, ydata=[-self._tall * (0.08 + 0.07 * slide.order)] * 2, color=MODE_FILL[slide.mode])
        for mark in self._marks[len(slides) :]:
            mark.set_data([], [])
        self._air.set_facecolor((MODE_FILL[mode], 0.18) if mode.slips else "none")

    def _lines(self, frame: AnimationFrame) -> list[tuple[Array, Array]]:
        """Return the lines of the foot about the place where it touches the ground [mm]: its rim, or its links."""
        if frame.rims is not None:
            radius = 1e3 * float(frame.rims[2, self._contact])
            angles = np.linspace(-1, 1, 200) * min(3 * self._tall / radius, np.pi / 2)
            return [(radius * np.sin(angles), radius * (1 - np.cos(angles)))]
        directions = [frame.points[:, other] - frame.points[:, self._foot_point] for other in self._neighbours]
        lengths = [np.linalg.norm(direction) or 1.0 for direction in directions]  # a link may have none
        ends = [3 * self._tall * part / length for part, length in zip(directions, lengths, strict=True)]
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
        slips = sum(segment.modes[self._contact].slips for segment in self._view.segments)
        style: dict[str, Any] = {"linewidth": 5, "solid_capstyle": "butt", "zorder": 3}
        self._marks = [axes.plot([], [], **style)[0] for _ in range(slips)]
        self.moving: list[Artist] = [self._air, *self._legs, self._foot, *self._marks]


def choose_foot(view: MotionView) -> tuple[int, Array]:
    """Return the foot that slides the furthest, and its slide coordinate while it is on the ground [m].

    Examples
    --------
    >>> from gaitopt import load
    >>> foot, slide = choose_foot(view_motion(load("docs/examples/compass_slip.h5").motion))
    >>> foot, round(1e3 * float(slide[-1] - slide[0]), 2)
    (0, 1.36)
    """
    paths = {
        foot: np.concatenate([part.slides[foot] for part in view.segments if part.modes[foot] is not Mode.FREE])
        for foot in view.loaded
    }
    foot = max(paths, key=lambda each: np.ptp(paths[each]), default=None)
    if foot is None:
        raise InputError("No foot is on the ground in this motion; an animation needs one.")
    return foot, paths[foot]


def name_legs(figure: "Figure", view: MotionView) -> None:
    """Add the legend of the legs to a figure, by the colours that they keep when they exchange their roles."""
    from matplotlib.lines import Line2D

    legs: dict[int, str] = {}
    for contact in sorted({contact for contact in view.link_contacts if contact is not None}):
        legs.setdefault(view.leg_of(contact), view.contacts[contact].leg)
    names = ONE_AND_OTHER if view.is_single_support else legs.values()
    lines = [Line2D([], [], color=leg_color(leg), linewidth=3) for leg in legs]
    place: dict[str, Any] = {"loc": "center right", "bbox_to_anchor": (LEGEND_END, 0.03), "borderaxespad": 0.0}
    if lines:
        figure.legend(lines, [*names][: len(lines)], ncols=len(lines), fontsize=9, handlelength=1.5, **place)


class Header:
    """The contact sequence with its current phase highlighted, the time, and whether the gait is a solution.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
    gait : Gait, PlanarGait or None
    film : AnimationFrames
    title : str
        Written below the walker, before the friction and the slope.

    Attributes
    ----------
    moving : list of Artist
        What each frame draws again.
    """

    def __init__(self, figure: "Figure", gait: AnyGait | None, film: AnimationFrames, *, title: str = "") -> None:
        self._steps, self._slowest, self._sequence = film.steps, film.slow, film.motion.tokens
        letters = sum(len(token.text) + 1.2 for token in self._sequence)
        room = 72 * figure.get_figwidth() * SEQUENCE_WIDTH / LETTER_WIDTH
        size, left = float(np.clip(room / max(letters, 1.0), SMALLEST, LARGEST)), 0.025
        self._tokens = []
        for token in self._sequence:
            text = figure.text(left, 0.935, show_minus(token.text), family="DejaVu Sans Mono", size=size, va="center")
            self._tokens.append(text)
            letters = float(len(token.text))
            if size < LARGEST:  # letters are as wide as whole pixels
                letters = text.get_window_extent().width / figure.dpi * 72 / (LETTER_WIDTH * size)
            left += (letters + 1.2) * LETTER_WIDTH * size / 72 / figure.get_figwidth()
        self._stamp = figure.text(0.975, 0.935, "", family="DejaVu Sans Mono", size=10.5, va="center", ha="right")
        self.moving: list[Artist] = [*self._tokens, self._stamp]
        slope, friction = (film.motion.parameters[name] for name in ("slope", "friction"))
        ground = rf"friction $\mu$ = {friction:g}" if np.isfinite(friction) else "infinite friction"
        way = "downhill" if slope > 0 else "uphill"
        ground += f", slope {abs(np.rad2deg(slope)):.3g}\N{DEGREE SIGN} {way}" if slope else ""
        name = replace_controls(title).replace("$", r"\$")  # a name of a user is no mathematics
        figure.text(0.025, 0.03, f"{name}, {ground}" if name else ground, size=9, va="center")
        status = getattr(gait, "status", None)  # a simulated motion has none
        if status is not None and not status.ok:
            verdict = f"NOT A SOLUTION ({status.key})"
            figure.text(0.025, 0.075, verdict, color=WARNING, weight="bold", size=12, va="center")

    def show(self, frame: AnimationFrame) -> None:
        """Highlight the phase of a frame, and its impact just after touchdown; write the time."""
        for token, text in zip(self._sequence, self._tokens, strict=True):
            is_outcome = token.phase is None and token.mode is not None
            current = token.phase == frame.phase or (is_outcome and frame.touchdown)
            fill = MODE_FILL[token.mode] if token.mode is not None else "none"
            box = {"boxstyle": "round,pad=0.25", "facecolor": (fill, 0.55), "edgecolor": "0.2"}
            text.set_bbox(box if current else None)
            text.set_color("black" if current else "0.45")
        slower = frame.slowness > 1.01 * self._slowest
        self._stamp.set_color(MODE_INK[frame.mode] if slower else "0.2")
        pace = f"slowed {frame.pace}\N{MULTIPLICATION SIGN}"
        self._stamp.set_text(f"step {frame.step + 1}/{self._steps}   t = {frame.time:.3f} s   {pace:>11}")
