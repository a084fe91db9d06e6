"""Frames of an animation of a periodic step: the instant and the state that each frame shows."""

from dataclasses import dataclass

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.coordinate_entries import SLIDE
from gaitopt.motion.motion import Array, Motion, Segment

SHORTEST_SLIP = 0.6
"""Minimum duration of a slip phase on the screen [s]; a slide of 20 ms would otherwise last one or two frames."""

TOUCHDOWN_SHOWN = 0.3
"""Time on the screen for which an instantaneous touchdown is marked [s]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SlideMark:
    """A slide of a stance foot on the ground, up to the current frame.

    A round foot rolls while it slides: the mark begins where it touched the ground when it began to slide.

    Attributes
    ----------
    step, order : int
        Number of the step, and of the slide within the step, from 0.
    mode : Mode
    start, end : float
        Positions along the slope [m].
    slide : float
        Slide coordinate at its beginning [m], which is the position of a point foot.
    """

    step: int
    order: int
    mode: Mode
    start: float
    end: float
    slide: float


@dataclass(frozen=True, eq=False, kw_only=True)
class AnimationFrame:
    """One frame of an animation.

    Attributes
    ----------
    time : float [s]
    step : int
        From 0.
    phase : int
        Number of the phase within the step.
    mode : Mode
    slowness : float
        Seconds on the screen for a second of motion.
    touchdown : bool
        Whether a touchdown is marked in this frame.
    points : (2, n_points) array [m]
    foot : (2,) array [m]
        Where the stance foot touches the ground.
    slide : float [m]
        Slide coordinate of the stance foot, which is its position x if it is a point.
    rims : (4, 2) array, optional
        Centre [m], radius [m] and clockwise angle [rad] of round feet, stance foot first.
    force : (2,) array [N]
    """

    time: float
    step: int
    phase: int
    mode: Mode
    slowness: float
    touchdown: bool
    points: Array
    foot: Array
    slide: float
    rims: Array | None
    force: Array


class AnimationFrames:
    """The frames of an animation of a periodic step; the legs exchange roles at each touchdown.

    Parameters
    ----------
    motion : Motion
        One step.
    steps : int
        Number of repetitions.
    rate : float
        Frames per second on the screen.
    slow : float
        Seconds on the screen for a second of motion, outside short slip phases.

    Examples
    --------
    >>> from gaitopt import load
    >>> film = AnimationFrames(load("docs/examples/compass_slip.h5").motion, steps=2, rate=30, slow=2.0)
    >>> film.frame(0).mode.value, film.frame(0).step, film.frame(len(film) - 1).step
    ('slip+', 0, 1)
    """

    def __init__(self, motion: Motion, *, steps: int, rate: float, slow: float) -> None:
        self.motion, self.steps, self.rate, self.slow = motion, steps, rate, slow
        self._durations = np.array([max(segment.duration, 1e-9) for segment in motion.segments])
        shortest = [SHORTEST_SLIP if segment.mode.slips else 0.0 for segment in motion.segments]
        self._shown = np.maximum(self._durations * slow, shortest)
        self._ends = np.cumsum(self._shown)

    def __len__(self) -> int:
        return max(1, round(self.steps * float(self._ends[-1]) * self.rate))

    def frame(self, number: int) -> AnimationFrame:
        """Return a frame by its number, from 0."""
        shown = number / self.rate
        step = min(int(shown / self._ends[-1]), self.steps - 1)
        within = min(shown - step * self._ends[-1], self._ends[-1])
        phase = min(int(np.searchsorted(self._ends, within, side="right")), len(self._ends) - 1)
        segment = self.motion.segments[phase]
        share = 1 - (self._ends[phase] - within) / self._shown[phase]
        time = float(segment.time[0] + share * segment.duration)
        shift = np.array([step * self.motion.travel, 0.0])
        rims = None if segment.rims is None else _at(segment, segment.rims, time)
        if rims is not None:
            rims[0] += shift[0]
        return AnimationFrame(
            time=time - float(self.motion.segments[0].time[0]) + step * self.motion.period,
            step=step,
            phase=phase,
            mode=segment.mode,
            slowness=float(self._shown[phase] / self._durations[phase]),
            touchdown=step > 0 and within < TOUCHDOWN_SHOWN,
            points=_at(segment, segment.points, time) + shift[:, None],
            foot=_at(segment, segment.contact, time) + shift,
            slide=float(_at(segment, segment.q[SLIDE], time) + shift[0]),
            rims=rims,
            force=_at(segment, segment.force, time),
        )

    def slides(self, frame: AnimationFrame) -> list[SlideMark]:
        """Return the slides of the stance feet up to a frame, including the current one."""
        marks = []
        for step in range(frame.step + 1):
            order, shift = 0, step * self.motion.travel
            for phase, segment in enumerate(self.motion.segments):
                if (step, phase) > (frame.step, frame.phase):
                    break
                if segment.mode.slips:
                    is_current = (step, phase) == (frame.step, frame.phase)
                    slid = frame.slide - shift - segment.q[SLIDE, 0] if is_current else segment.slide
                    start = float(segment.contact[0, 0] + shift)
                    mark = {"start": start, "end": start + slid, "slide": segment.q[SLIDE, 0] + shift}
                    marks.append(SlideMark(step=step, order=order, mode=segment.mode, **mark))
                    order += 1
        return marks


def _at(segment: Segment, values: Array, time: float) -> Array:
    """Return sampled values at a time, linear between samples; the last axis is time."""
    later = int(np.clip(np.searchsorted(segment.time, time), 1, segment.time.size - 1))
    width = segment.time[later] - segment.time[later - 1]
    share = (time - segment.time[later - 1]) / width if width > 0 else 0.0
    return (1 - share) * values[..., later - 1] + share * values[..., later]
