"""The player of a gait: stage, contact sequence, controls, and the positions of every mark in every frame."""

from typing import Any

import numpy as np

from gaitopt.motion.animation_frames import AnimationFrame, AnimationFrames
from gaitopt.motion.gait import Gait
from gaitopt.motion.motion import Array
from gaitopt.report.chart import Chart, Curve
from gaitopt.report.markup import Element, data_element, element
from gaitopt.report.walker_drawing import Stage

STEPS, RATE, SLOW = 2, 60, 2.0
"""Number of steps, frames per second, and seconds on the screen for a second of motion."""


def make_player(gait: Gait, charts: list[Chart], *, name: str) -> Element:
    """Return the player of a gait, which moves its stage and the marks of the charts beside it.

    Parameters
    ----------
    gait : Gait
    charts : list of Chart
        Charts in the order of the section of the player.
    name : str
        Unique name among the players of the page.
    """
    film = AnimationFrames(gait.motion, steps=1, rate=RATE, slow=SLOW)
    stage = Stage(film, steps=STEPS, name=name)
    frames = [film.frame(number) for number in range(len(film))]
    positions = stage.frames()
    for frame, position in zip(frames, positions, strict=True):
        position |= {
            "time": round(frame.time, 5),
            "phase": frame.phase,
            "mode": frame.mode.name.lower(),
            "pace": f"{frame.slowness:.2g}",
            "charts": [_marks(chart, gait, frame) for chart in charts],
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
        _sequence(gait),
        stage.draw(),
        _controls(STEPS * len(frames) - 1),
        _key(),
        data_element(data, class_="film"),
        class_="player",
        role="group",
        aria_label=f"Animation of {gait.sequence}",
    )


def _sequence(gait: Gait) -> Element:
    """Return the contact sequence of the gait, whose current mode is highlighted."""
    tokens = [
        element("span", mode.label, class_=f"token {mode.name.lower()}", data_phase=phase)
        for phase, mode in enumerate(gait.sequence.phases)
    ]
    impact = gait.sequence.impact
    landing = element("span", impact.label, class_=f"token {impact.name.lower()} impact")
    return element("p", *tokens, element("span", "|", class_="bar"), landing, class_="sequence")


def _controls(last: int) -> Element:
    return element(
        "div",
        element("button", "\N{BLACK RIGHT-POINTING TRIANGLE}", class_="play", type="button", aria_label="Play"),
        element("input", class_="time", type="range", min=0, max=last, value=0, step=1, aria_label="Time"),
        element("output", "", class_="stamp"),
        class_="controls",
    )


def _key() -> Element:
    parts = (("force", "contact force"), ("cone", "friction cone"), ("stance", "one leg"), ("swing", "the other leg"))
    return element(
        "p",
        *(element("span", element("i", class_=f"swatch {kind}"), text) for kind, text in parts),
        element("span", "Space bar: play or pause. Arrow keys: single frames.", class_="hint"),
        class_="key",
    )


def _marks(chart: Chart, gait: Gait, frame: AnimationFrame) -> list[list[Any]]:
    """Return the position and the value of the mark of each line of a chart."""
    return [_mark(chart, line, gait, frame) for line in chart.lines]


def _mark(chart: Chart, line: Curve, gait: Gait, frame: AnimationFrame) -> list[Any]:
    x, y = (_value(gait, frame, pieces) for pieces in (line.x, line.y))
    column, row = chart.place(x, y)
    return [round(column, 1), round(row, 1), f"{chart.write(y)} {chart.unit}".strip()]


def _value(gait: Gait, frame: AnimationFrame, pieces: tuple[Array, ...]) -> float:
    """Return a sampled quantity at the time of a frame, in the phase of the frame."""
    motion = gait.motion
    time = frame.time + float(motion.segments[0].time[0])
    return float(np.interp(time, motion.segments[frame.phase].time, pieces[frame.phase]))
