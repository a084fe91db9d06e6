"""The main picture of an animation: the walker on its slope, its contact force, and the marks of its slides."""

from typing import TYPE_CHECKING, Any

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.animation_frames import AnimationFrame, AnimationFrames, SlideMark
from gaitopt.motion.foot_arc import MARKS, FootArc, figure_points, find_foot_arc, find_open_feet
from gaitopt.motion.force_scale import WEIGHT_DRAWN, drawn_height, force_scale
from gaitopt.motion.link_roles import tilt
from gaitopt.motion.motion import Array
from gaitopt.plot.ground_line import draw_ground
from gaitopt.plot.impulse_arrows import ImpulseArrows
from gaitopt.plot.style import BODY, CONE, FORCE, MODE_FILL, MODE_INK, leg_color

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

LABEL_WIDTH = 0.9
"""Width of the label of a slide [inch]."""

MOST_ROWS = 3
"""Rows of labels of slides that fit below the ground."""

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
    gait : object
        Not used; all parts of a picture are made alike.
    film : AnimationFrames

    Attributes
    ----------
    moving : list of Artist
        What each frame draws again.
    scale : float
        Inches on the screen for a metre.
    """

    def __init__(self, axes: "Axes", gait: object, film: AnimationFrames) -> None:
        view = film.motion
        self._axes, self._film, self._view = axes, film, view
        self._slope, self._friction = view.parameters["slope"], view.parameters["friction"]
        figures = np.hstack([figure_points(view, part).reshape(2, -1) for part in view.segments])
        self._height = drawn_height(figures)
        self._newton = self._height * force_scale(view)
        self._arc = find_foot_arc(view)
        self._marks: dict[tuple[int, int], tuple[Any, Any]] = {}
        self._frame_view(figures[0], (film.steps - 1) * view.travel)
        self._add_artists()

    def show(self, frame: AnimationFrame) -> None:
        """Move everything to its position in a frame."""
        points = tilt(frame.points, self._slope)
        for pair, contact, line in self._links:
            color = BODY if contact is None else self._color(contact, frame.exchanges)
            line.set(xdata=points[0, pair], ydata=points[1, pair], color=color)
        if self._arc is not None and frame.rims is not None:
            self._show_rims(frame, self._arc)
        self._joints.set_data(*points[:, self._view.joints])
        for foot, (dot, cone, force) in self._contacts.items():
            place, mode = tilt(frame.places[:, foot], self._slope), frame.modes[foot]
            for artist in (dot, cone, force):
                artist.set_visible(mode is not Mode.FREE and (artist is not cone or foot in self._view.cone_feet))
            dot.set(xdata=place[:1], ydata=place[1:], markerfacecolor=MODE_FILL[mode])
            cone.set_xy((place[:, None] + tilt(self._wedge, self._slope)).T)
            force.set_offsets([place])
            force.set_UVC(*tilt(self._newton * frame.forces[foot], self._slope))
        for slide in self._film.slides(frame):
            self._mark(slide)
        self._impulses.show(frame)
        self._look(frame)

    def _color(self, contact: int, exchanges: int) -> str:
        """Return the colour of a foot, which changes its role from step to step."""
        return leg_color(self._view.leg_of(self._view.owner(contact, exchanges)))

    def _show_rims(self, frame: AnimationFrame, arc: FootArc) -> None:
        """Move the arcs of round feet, their marks, and the legs that end at the centres of arcs."""
        if frame.rims is None:
            return
        for (foot, lines), spoke in zip(self._feet.items(), self._spokes, strict=True):
            rim, color = frame.rims[:, foot], self._color(foot, frame.exchanges)
            marks = np.moveaxis(arc.marks(rim), 1, 0)
            for line, places in zip(lines, (arc.outline(rim), *marks), strict=True):
                x, y = tilt(places, self._slope)
                line.set(xdata=x, ydata=y, color=color)
            x, y = tilt(arc.spoke(rim), self._slope)
            spoke.set(xdata=x, ydata=y, color=color, visible=foot in self._open_feet)

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
        ends = low - self._wide, high + self._wide
        draw_ground(self._axes, self._view.terrain, ends, self._slope, width=1.2)
        self._axes.axis("off")

    def _add_artists(self) -> None:
        """Create what :meth:`show` moves."""
        axes, view = self._axes, self._view
        leg: dict[str, Any] = {"linewidth": 4.0, "solid_capstyle": "round"}
        layers = {None: 3} | {foot: 5 if view.leg_of(foot) == 0 else 4 for foot in view.feet}
        order = sorted(zip(view.links, view.link_contacts, strict=True), key=lambda pair: layers[pair[1]])
        self._links = [(pair, contact, axes.plot([], [], zorder=layers[contact], **leg)[0]) for pair, contact in order]
        self._add_feet(leg, layers)
        (self._joints,) = axes.plot([], [], "o", color="0.2", markerfacecolor="white", markersize=9, zorder=6)
        half = np.arctan(self._friction)
        angles = np.linspace(-half, half, 24)
        length = 1.25 * WEIGHT_DRAWN * self._height
        self._wedge = np.hstack([np.zeros((2, 1)), length * np.stack([np.sin(angles), np.cos(angles)])])
        self._contacts = {foot: self._add_contact() for foot in view.loaded}
        dots, cones, forces = (list(parts) for parts in zip(*self._contacts.values(), strict=True))
        cones[0].set_label("friction cone")
        forces[0].set_label("contact force")
        self._impulses = ImpulseArrows(axes, self._film, self._height)
        handles = [forces[0], *(cones[:1] if view.cone_feet else []), *self._impulses.handles]
        axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(0.02, 1.0), fontsize=9)
        arcs = [line for lines in self._feet.values() for line in lines]
        legs = [*(line for _, _, line in self._links), *arcs, *self._spokes]
        self.moving: list[Artist] = [*cones, *legs, self._joints, *dots, *forces, *self._impulses.moving]

    def _add_feet(self, leg: dict[str, Any], layers: dict[int | None, int]) -> None:
        """Create the arcs of round feet."""
        first = self._view.segments[0]
        rims = first.rims[:, :, 0] if self._arc is not None and first.rims is not None else np.zeros((4, 0))
        feet = np.flatnonzero(rims[2] > 0).tolist()
        self._open_feet = find_open_feet(first.points[:, :, 0], rims)
        widths = (4.0, *(1.5,) * MARKS)
        self._feet = {
            foot: [self._axes.plot([], [], zorder=layers[foot], **leg | {"linewidth": width})[0] for width in widths]
            for foot in feet
        }
        self._spokes = [self._axes.plot([], [], zorder=layers[foot], **leg)[0] for foot in feet]

    def _add_contact(self) -> tuple[Any, Any, Any]:
        """Create the mark, the friction cone and the force of a foot."""
        (dot,) = self._axes.plot([], [], "o", color="0.2", markersize=8, zorder=7)
        scaled: dict[str, Any] = {"angles": "xy", "scale_units": "xy", "scale": 1}
        force = self._axes.quiver([0], [0], [0], [1], width=0.007, color=FORCE, zorder=8, **scaled)
        (cone,) = self._axes.fill([0], [0], facecolor=CONE, edgecolor="0.6", linewidth=0.6, zorder=2)
        return dot, cone, force

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
        below = (0, -10 - 14 * (row % MOST_ROWS))
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
