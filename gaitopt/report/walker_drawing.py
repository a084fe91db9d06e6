"""The walker on its ground as SVG, and the positions of all its parts in each frame of an animation."""

from typing import Any

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.animation_frames import AnimationFrame, AnimationFrames
from gaitopt.motion.foot_arc import figure_points, find_foot_arc
from gaitopt.motion.link_roles import classify_links, tilt
from gaitopt.motion.motion import Array
from gaitopt.report.markup import Element, element, points

TALL, WIDEST, FLOOR = 360, 720, 46
"""Height and maximum width of the picture, and the space below the ground for the labels of slides [px]."""

WEIGHT_DRAWN = 0.45
"""Length of a force equal to the weight, in heights of the walker."""


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
        motion = film.motion
        self._film, self._steps, self._name = film, steps, name
        self._skeleton, self._arc = classify_links(motion), find_foot_arc(motion)
        drawn = np.hstack([figure_points(motion, part).reshape(2, -1) for part in motion.segments])
        self._slope, self._friction = motion.parameters["slope"], motion.parameters["friction"]
        self._tall = float(np.max(drawn[1]))
        self._newton = WEIGHT_DRAWN * self._tall / (motion.total_mass * motion.parameters["gravity"])
        self._frame_view(*drawn)

    @property
    def links(self) -> tuple[tuple[int, int, str], ...]:
        """Pairs of points joined by a line, each with the role of the line."""
        roles = (("body", self._skeleton.body), ("swing", self._skeleton.swing), ("stance", self._skeleton.stance))
        return tuple((a, b, role) for role, pairs in roles for a, b in pairs)

    def shift(self) -> list[float]:
        """Return the displacement of the walker in a step [px]."""
        start, end = (self._pixels(np.array([x, 0.0])) for x in (0.0, self._film.motion.travel))
        return _round_pixels(end - start)

    def frames(self) -> list[dict[str, Any]]:
        """Return the pixel positions of all moving parts, for each frame of one step."""
        return [self._positions(self._film.frame(number)) for number in range(len(self._film))]

    def draw(self) -> Element:
        """Return the picture in its first frame."""
        first = self._film.frame(0)
        here = self._positions(first)
        foot = f"translate({here['foot'][0]} {here['foot'][1]})"
        lines = [
            element("line", class_=f"link {role}", x1=ends[0], y1=ends[1], x2=ends[2], y2=ends[3])
            for (_, _, role), ends in zip(self.links, here["links"], strict=True)
        ]
        joints = [element("circle", class_="joint", cx=x, cy=y, r=5) for x, y in here["joints"]]
        head = element("path", d="M0 0L7 3.5L0 7Z", class_="force-head")
        size = {"markerWidth": 4.5, "markerHeight": 4.5, "refX": 5, "refY": 3.5}
        marker = element("marker", head, id=f"{self._name}-arrow", viewBox="0 0 7 7", orient="auto", **size)
        arrow = {"x1": 0, "y1": 0, "x2": here["force"][0], "y2": here["force"][1]}
        return element(
            "svg",
            element("defs", marker),
            self._ground(),
            *(
                self._mark(step, phase)
                for step in range(self._steps)
                for phase in range(len(self._film.motion.segments))
            ),
            element("polygon", class_="cone", points=self._wedge(), transform=foot),
            *lines,
            *self._round_feet(first, here["rims"]),
            *joints,
            element("line", class_="force", marker_end=f"url(#{self._name}-arrow)", transform=foot, **arrow),
            element("circle", class_=f"foot {first.mode.name.lower()}", r=5.5, transform=foot),
            class_="stage",
            viewBox=f"0 0 {self._width} {self._height}",
            role="img",
            aria_label="The walker with its contact force, friction cone and the marks of its slides",
        )

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
        force = self._scale * self._newton * tilt(frame.force, self._slope)
        return {
            "links": [_round_pixels([*joints[:, a], *joints[:, b]]) for a, b, _ in self.links],
            "joints": [_round_pixels(joints[:, point]) for point in self._skeleton.joints],
            "rims": [] if frame.rims is None else [self._place(rim) for rim in frame.rims.T],
            "foot": _round_pixels(self._pixels(frame.foot)),
            "force": _round_pixels([force[0], -force[1]]),
        }

    def _place(self, rim: Array) -> list[float]:
        """Return the centre [px] and the clockwise angle [deg] of a rim, shape (4,), as it is seen on the slope."""
        return _round_pixels([*self._pixels(rim[:2]), np.rad2deg(rim[3] + self._slope)])

    def _round_feet(self, frame: AnimationFrame, places: list[list[float]]) -> list[Element]:
        """Return the arcs of round feet, with marks that make their turning visible."""
        if self._arc is None or frame.rims is None:
            return []
        feet = []
        for role, rim, (x, y, turn) in zip(("stance", "swing"), frame.rims.T, places, strict=True):
            upright = np.array([0.0, 0.0, rim[2], 0.0])
            parts = [self._arc.outline(upright), *np.moveaxis(self._arc.marks(upright), 1, 0)]
            lines = [points(*(self._scale * part * [[1.0], [-1.0]]).T) for part in parts]
            inside = [
                element("polyline", points=line, class_="tread" if number else "") for number, line in enumerate(lines)
            ]
            feet.append(element("g", *inside, class_=f"rim {role}", transform=f"translate({x} {y}) rotate({turn})"))
        return feet

    def _ground(self) -> Element:
        (x1, x2), (y1, y2) = self._pixels(np.array([self._ends, (0.0, 0.0)]))
        return element("line", class_="ground", x1=round(x1, 1), y1=round(y1, 1), x2=round(x2, 1), y2=round(y2, 1))

    def _wedge(self) -> str:
        """Return the friction cone above the origin; infinite friction allows every force upward."""
        half = min(np.arctan(self._friction), np.pi / 2)
        angles = np.linspace(-half, half, 16)
        rim = (
            1.25
            * WEIGHT_DRAWN
            * self._tall
            * self._scale
            * tilt(np.stack([np.sin(angles), np.cos(angles)]), self._slope)
        )
        return points((0.0, 0.0), *((float(x), -float(y)) for x, y in rim.T))

    def _mark(self, step: int, phase: int) -> Element | None:
        """Return the mark of a slide: a pointer at its start, its line to scale, and its length as text."""
        segment = self._film.motion.segments[phase]
        if not segment.mode.slips:
            return None
        start = segment.contact[0, 0] + step * self._film.motion.travel
        (x1, x2), (y1, y2) = self._pixels(np.array([[start, start + segment.slide], [0.0, 0.0]])).round(2)
        row = sum(part.mode.slips for part in self._film.motion.segments[:phase])
        arrow = "\N{RIGHTWARDS ARROW}" if segment.mode is Mode.SLIP_FORWARD else "\N{LEFTWARDS ARROW}"
        text = f"{arrow} {1e3 * abs(segment.slide):.3g} mm"
        return element(
            "g",
            element("line", class_="slide", x1=x1, y1=y1, x2=x2, y2=y2),
            element("path", class_="pointer", d=f"M{x1} {y1 + 4}l-5 9h10z"),
            element("text", text, class_="slide-label", x=x1, y=y1 + 28 + 15 * row),
            class_=f"mark {segment.mode.name.lower()}",
            data_step=step,
            data_phase=phase,
        )


def _round_pixels(values: Any) -> list[float]:
    return [round(float(value), 2) for value in values]
