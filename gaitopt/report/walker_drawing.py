"""The walker on its ground as SVG, and the positions of all its parts in each frame of an animation."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.animation_frames import AnimationFrame, AnimationFrames
from gaitopt.motion.foot_arc import MARKS, figure_points, find_foot_arc, find_open_feet
from gaitopt.motion.force_scale import WEIGHT_DRAWN, drawn_height, force_scale
from gaitopt.motion.link_roles import tilt
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import MotionView
from gaitopt.motion.shown_impulses import SHARE, ShownImpulse
from gaitopt.report.markup import Element, element, points

TALL, WIDEST, FLOOR = 360, 720, 46
"""Height and maximum width of the picture, and the space below the ground for the labels of slides [px]."""

ROLES = ("stance", "swing", "third", "fourth", "fifth", "sixth")
"""Names of the colours of the feet in the style sheet."""


class Stage:
    """The picture of a periodic step.

    Parameters
    ----------
    film : AnimationFrames
        Frames of one step.
    steps : int
        Number of repetitions; the legs exchange roles each time.
    name : str
        Unique name among the stages of the page.

    Examples
    --------
    >>> from gaitopt import load
    >>> film = AnimationFrames(load("docs/examples/compass_slip.h5").motion, steps=1, rate=30, slow=2.0)
    >>> stage = Stage(film, steps=2, name="walker")
    >>> stage.draw().tag, len(stage.frames()), len(stage.frames()[0]["links"])
    ('svg', 61, 2)
    """

    def __init__(self, film: AnimationFrames, *, steps: int, name: str) -> None:
        self._view = view = film.motion
        self._film, self._steps, self._name = film, steps, name
        self._arc = find_foot_arc(view)
        drawn = np.hstack([figure_points(view, part).reshape(2, -1) for part in view.segments])
        self._slope, self._friction = view.parameters["slope"], view.parameters["friction"]
        self._tall = drawn_height(drawn)
        self._newton = self._tall * force_scale(view)
        first = view.segments[0]
        rims = first.rims[:, :, 0] if self._arc is not None and first.rims is not None else np.zeros((4, 0))
        self._round = np.flatnonzero(rims[2] > 0).tolist()
        self._open_feet = find_open_feet(first.points[:, :, 0], rims)
        self._frame_view(*drawn)

    @property
    def links(self) -> list[tuple[int, int, int | None]]:
        """Pairs of points joined by a line, each with the contact to whose leg it belongs; the first leg is last."""
        pairs = zip(self._view.links, self._view.link_contacts, strict=True)
        order = {None: 0} | {foot: 2 if number == 0 else 1 for number, foot in enumerate(self._view.feet)}
        return sorted(((a, b, contact) for (a, b), contact in pairs), key=lambda link: order[link[2]])

    def shift(self) -> list[float]:
        """Return the displacement of the walker in a step [px]."""
        start, end = (self._pixels(np.array([x, 0.0])) for x in (0.0, self._film.motion.travel))
        return _round_pixels(end - start)

    def frames(self) -> list[dict[str, Any]]:
        """Return the pixel positions of all moving parts, for each frame of one step."""
        return [self._positions(self._film.frame(number)) for number in range(len(self._film))]

    def draw_impulses(self, impulses: Sequence[ShownImpulse]) -> list[Element]:
        """Return the impulses of actuators: their values, and arrows of the reactions at the feet."""
        parts, length = [], SHARE * self._tall * self._scale
        for each in impulses:
            starts, arrows = self._pixels(each.places), length * tilt(each.arrows, self._slope)
            ends = [
                _round_pixels([x, y, x + along, y - up]) for (x, y), (along, up) in zip(starts.T, arrows.T, strict=True)
            ]
            lines = [
                element("line", class_="reaction", x1=a, y1=b, x2=c, y2=d, marker_end=f"url(#{self._name}-arrow)")
                for a, b, c, d in ends
            ]
            rows = range(16, 16 + 15 * len(each.lines), 15)
            texts = [element("text", line, x=6, y=y) for line, y in zip(each.lines, rows, strict=True)]
            shown = {"data_begin": round(each.begin, 4), "data_end": round(each.end, 4)}
            parts.append(element("g", *lines, *texts, class_="impulse", **shown))
        return parts

    def draw(self, above: Sequence[Element] = ()) -> Element:
        """Return the picture in its first frame, with elements above it."""
        first = self._film.frame(0)
        positions = self._positions(first)
        lines = [
            element("line", x1=ends[0], y1=ends[1], x2=ends[2], y2=ends[3], **self._leg("link", contact))
            for (_, _, contact), ends in zip(self.links, positions["links"], strict=True)
        ]
        joints = [element("circle", class_="joint", cx=x, cy=y, r=5) for x, y in positions["joints"]]
        head = element("path", d="M0 0L7 3.5L0 7Z", class_="force-head")
        size = {"markerWidth": 4.5, "markerHeight": 4.5, "refX": 5, "refY": 3.5}
        marker = element("marker", head, id=f"{self._name}-arrow", viewBox="0 0 7 7", orient="auto", **size)
        slides = [
            self._mark(step, phase, foot)
            for step in range(self._steps)
            for phase, segment in enumerate(self._view.segments)
            for foot in segment.slipping
        ]
        cones, forces, feet = self._contacts(positions)
        cone = ", friction cone" if self._view.cone_feet else ""
        return element(
            "svg",
            element("defs", marker),
            self._ground(),
            *slides,
            *cones,
            *lines,
            *self._round_feet(first, positions["rims"]),
            *joints,
            *forces,
            *feet,
            *above,
            class_="stage",
            viewBox=f"0 0 {self._width} {self._height}",
            role="img",
            aria_label=f"The walker with its contact force{cone} and the marks of its slides",
        )

    def _contacts(self, frame: dict[str, Any]) -> tuple[list[Element], list[Element], list[Element]]:
        """Return the friction cones, the forces and the marks of the feet that touch the ground."""
        cones, forces, feet = [], [], []
        marks = zip(self._view.loaded, frame["foot"], frame["force"], frame["modes"], strict=True)
        for contact, (x, y), (along, up), mode in marks:
            at: dict[str, Any] = {"transform": f"translate({x} {y})"}
            at |= {"visibility": "hidden"} if mode == "free" else {}
            arrow = {"x1": 0, "y1": 0, "x2": along, "y2": up, "marker_end": f"url(#{self._name}-arrow)"}
            wedge = self._wedge() if contact in self._view.cone_feet else ""
            cones.append(element("polygon", class_="cone", points=wedge, **at))
            forces.append(element("line", class_="force", **at, **arrow))
            feet.append(element("circle", class_=f"foot {mode}", r=5.5, **at))
        return cones, forces, feet

    def _leg(self, kind: str, contact: int | None) -> dict[str, str]:
        """Return class and colours of a part of a leg: its own, and those of the leg it is exchanged with."""
        if contact is None:
            return {"class_": f"{kind} body"}
        role, other = (role_of(self._view, each) for each in (contact, self._view.exchange[contact]))
        return {"class_": f"{kind} {role}", "style": f"--own: var(--{role}); --other: var(--{other})"}

    def _frame_view(self, x: Array, y: Array) -> None:
        """Choose scale and origin so that all steps and the force are visible."""
        low, high = float(x.min()), float(x.max()) + (self._steps - 1) * self._film.motion.travel
        corners = tilt(np.array([[low, low, high, high], [0.0, float(y.max()), 0.0, float(y.max())]]), self._slope)
        margin = 0.22 * self._tall
        left, right = float(corners[0].min()) - margin, float(corners[0].max()) + margin
        bottom, top = float(corners[1].min()), float(corners[1].max()) + 0.08 * self._tall
        self._scale = min(WIDEST / (right - left), TALL / (top - bottom))
        self._origin = self._scale * np.array([-left, top])
        self._width = round(self._scale * (right - left))
        self._height = round(self._scale * (top - bottom)) + FLOOR
        self._ends = (low - 4 * self._tall, high + 4 * self._tall)

    def _pixels(self, places: Array) -> Array:
        """Return positions of the slope-fixed frame, shape (2, ...) [m], as pixels."""
        level = tilt(places, self._slope)
        return np.stack([self._origin[0] + self._scale * level[0], self._origin[1] - self._scale * level[1]])

    def _positions(self, frame: AnimationFrame) -> dict[str, Any]:
        joints = self._pixels(frame.points)
        forces = self._scale * self._newton * tilt(frame.forces.T, self._slope)
        feet = self._view.loaded
        rims = [] if frame.rims is None else [self._place(frame.rims[:, foot]) for foot in self._round]
        return {
            "links": [_round_pixels([*joints[:, a], *joints[:, b]]) for a, b, _ in self.links],
            "joints": [_round_pixels(joints[:, point]) for point in self._view.joints],
            "rims": rims,
            "foot": [_round_pixels(self._pixels(frame.places[:, foot])) for foot in feet],
            "force": [_round_pixels([forces[0, foot], -forces[1, foot]]) for foot in feet],
            "modes": [frame.modes[foot].name.lower() for foot in feet],
        }

    def _place(self, rim: Array) -> list[float]:
        """Return the centre [px] and the clockwise angle [deg] of a rim, shape (4,), as it is seen on the slope."""
        return _round_pixels([*self._pixels(rim[:2]), np.rad2deg(rim[3] + self._slope)])

    def _round_feet(self, frame: AnimationFrame, places: list[list[float]]) -> list[Element]:
        """Return the arcs of round feet, with marks that make their turning visible."""
        if self._arc is None or frame.rims is None:
            return []
        parts = []
        for foot, (x, y, turn) in zip(self._round, places, strict=True):
            upright = np.array([0.0, 0.0, frame.rims[2, foot], 0.0])
            lines = [self._arc.outline(upright), *np.moveaxis(self._arc.marks(upright), 1, 0)]
            lines += [self._arc.spoke(upright)] if foot in self._open_feet else []
            pieces = [points(*(self._scale * line * [[1.0], [-1.0]]).T) for line in lines]
            thin = range(1, 1 + MARKS)
            inside = [
                element("polyline", points=piece, class_="tread" if number in thin else "")
                for number, piece in enumerate(pieces)
            ]
            place = f"translate({x} {y}) rotate({turn})"
            parts.append(element("g", *inside, transform=place, **self._leg("rim", foot)))
        return parts

    def _ground(self) -> Element:
        (x1, x2), (y1, y2) = self._pixels(np.array([self._ends, (0.0, 0.0)]))
        return element("line", class_="ground", x1=round(x1, 1), y1=round(y1, 1), x2=round(x2, 1), y2=round(y2, 1))

    def _wedge(self) -> str:
        """Return the friction cone above the origin."""
        half = np.arctan(self._friction)
        angles = np.linspace(-half, half, 16)
        rim = (
            1.25
            * WEIGHT_DRAWN
            * self._tall
            * self._scale
            * tilt(np.stack([np.sin(angles), np.cos(angles)]), self._slope)
        )
        return points((0.0, 0.0), *((float(x), -float(y)) for x, y in rim.T))

    def _mark(self, step: int, phase: int, foot: int) -> Element:
        """Return the mark of a slide: a pointer at its start, its line to scale, and its length as text."""
        segment = self._view.segments[phase]
        mode, slid = segment.modes[foot], segment.slide(foot)
        start = segment.places[0, foot, 0] + step * self._view.travel
        (x1, x2), (y1, y2) = self._pixels(np.array([[start, start + slid], [0.0, 0.0]])).round(2)
        former = sum(len(part.slipping) for part in self._view.segments[:phase])
        row = former + segment.slipping.index(foot)
        arrow = "\N{RIGHTWARDS ARROW}" if mode is Mode.SLIP_FORWARD else "\N{LEFTWARDS ARROW}"
        text = f"{arrow} {1e3 * abs(slid):.3g} mm"
        return element(
            "g",
            element("line", class_="slide", x1=x1, y1=y1, x2=x2, y2=y2),
            element("path", class_="pointer", d=f"M{x1} {y1 + 4}l-5 9h10z"),
            element("text", text, class_="slide-label", x=x1, y=y1 + 28 + 15 * row),
            class_=f"mark {mode.name.lower()}",
            data_step=step,
            data_phase=phase,
        )


def role_of(view: MotionView, contact: int) -> str:
    """Return the name of the colour of a foot in the style sheet.

    Examples
    --------
    >>> from gaitopt import load
    >>> view = AnimationFrames(load("docs/examples/compass_slip.h5").motion, steps=1, rate=30, slow=2.0).motion
    >>> role_of(view, 0), role_of(view, 1)
    ('stance', 'swing')
    """
    return ROLES[view.leg_of(contact) % len(ROLES)]


def _round_pixels(values: Any) -> list[float]:
    return [round(float(value), 2) for value in values]
