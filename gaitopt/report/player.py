"""The player of a gait: stage, contact sequence, controls, and the positions of every mark in every frame."""

from typing import Any, NamedTuple, Protocol

import numpy as np

from gaitopt.motion.animation_frames import AnimationFrame, AnimationFrames
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import ONE_AND_OTHER, MotionView
from gaitopt.motion.shown_impulses import list_shown_impulses
from gaitopt.motion.view_motion import AnyMotion
from gaitopt.report.chart import Chart, Curve
from gaitopt.report.markup import Element, data_element, element
from gaitopt.report.walker_drawing import Stage, role_of

STEPS, RATE, SLOW = 2, 60, 2.0
"""Number of steps, frames per second, and seconds on the screen for a second of motion."""


class HasPeriod(Protocol):
    """A gait, or a periodic gait of a simulation."""

    @property
    def motion(self) -> AnyMotion:
        """The period."""

    @property
    def period(self) -> float:
        """Its duration [s]."""

    @property
    def sequence(self) -> object:
        """Its contact sequence."""


class PlayedGait(NamedTuple):
    """A step to play.

    Attributes
    ----------
    motion : Motion or PlanarMotion
    period : float [s]
    sequence : str
        Contact sequence, for readers of the screen.
    """

    motion: AnyMotion
    period: float
    sequence: str


def make_player(gait: HasPeriod, charts: list[Chart], *, name: str) -> Element:
    """Return the player of a gait, which moves its stage and the marks of the charts beside it.

    Parameters
    ----------
    gait : Gait, PlanarGait, Cycle, PlanarCycle or PlayedGait
    charts : list of Chart
        Charts in the order of the section of the player.
    name : str
        Unique name among the players of the page.
    """
    film = AnimationFrames(gait.motion, steps=1, rate=RATE, slow=SLOW)
    stage = Stage(film, steps=STEPS, name=name)
    impulses = list_shown_impulses(film, STEPS)
    frames = [film.frame(number) for number in range(len(film))]
    positions = stage.frames()
    for frame, position in zip(frames, positions, strict=True):
        position |= {
            "time": round(frame.time, 5),
            "phase": frame.phase,
            "mode": frame.mode.name.lower(),
            "pace": frame.pace,
            "charts": [_marks(chart, film.motion, frame) for chart in charts],
        }
    data = {
        "steps": STEPS,
        "rate": RATE,
        "period": gait.period,
        "shift": stage.shift(),
        "frames": positions,
    }
    return element(
        "div",
        _sequence(film.motion),
        stage.draw(stage.draw_impulses(impulses)),
        _controls(STEPS * len(frames) - 1),
        _key(film.motion, impulsive=bool(impulses)),
        data_element(data, class_="film"),
        class_="player",
        role="group",
        aria_label=f"Animation of {gait.sequence}",
    )


def _sequence(view: MotionView) -> Element:
    """Return the contact sequence as it is typed, whose current phase is highlighted."""
    tokens = []
    for token in view.tokens:
        if token.mode is None:
            tokens.append(element("span", token.text, class_="bar"))
            continue
        kind = f"token {token.mode.name.lower()}" + (" impact" if token.phase is None else "")
        tokens.append(element("span", token.text, class_=kind, data_phase=token.phase))
    return element("p", *tokens, class_="sequence")


def _controls(last: int) -> Element:
    return element(
        "div",
        element("button", "\N{BLACK RIGHT-POINTING TRIANGLE}", class_="play", type="button", aria_label="Play"),
        element("input", class_="time", type="range", min=0, max=last, value=0, step=1, aria_label="Time"),
        element("output", "", class_="stamp"),
        class_="controls",
    )


def _key(view: MotionView, *, impulsive: bool) -> Element:
    legs = sorted({contact for contact in view.link_contacts if contact is not None})
    names = ONE_AND_OTHER if view.is_single_support else [view.contacts[leg].name for leg in legs]
    parts = [("force", "contact force"), *([("cone", "friction cone")] if view.cone_feet else [])]
    parts += [("impulse", "reaction to impulses of actuators")] if impulsive else []
    parts += [(role_of(view, leg), name) for leg, name in zip(legs, names, strict=False)]
    return element(
        "p",
        *(element("span", element("i", class_=f"swatch {kind}"), text) for kind, text in parts),
        element("span", "Space bar: play or pause. Arrow keys: single frames.", class_="hint"),
        class_="key",
    )


def _marks(chart: Chart, view: MotionView, frame: AnimationFrame) -> list[list[Any]]:
    """Return the position and the value of the mark of each line of a chart."""
    return [_mark(chart, line, view, frame) for line in chart.lines]


def _mark(chart: Chart, line: Curve, view: MotionView, frame: AnimationFrame) -> list[Any]:
    """Return the position of the mark and the value; outside the chart where the line has no samples in this phase."""
    if not line.x[frame.phase].size:
        return [-99, -99, "\N{EN DASH}"]
    x, y = (_value(view, frame, line, pieces) for pieces in (line.x, line.y))
    column, row = chart.place(x, y)
    return [round(column, 1), round(row, 1), f"{chart.write(y)} {chart.unit}".strip()]


def _value(view: MotionView, frame: AnimationFrame, line: Curve, pieces: tuple[Array, ...]) -> float:
    """Return a sampled quantity at the time of a frame, in the phase of the frame."""
    time = frame.time + float(view.segments[0].time[0])
    known = view.segments[frame.phase].time
    return float(np.interp(time, known if line.time is None else line.time[frame.phase], pieces[frame.phase]))
