"""Frames of an animation of a periodic step: the instant and the state that each frame shows."""

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import PhaseView
from gaitopt.motion.view_motion import AnyMotion, view_motion

SHORTEST_SLIP = 0.6
"""Minimum duration of a slip phase on the screen [s]; a slide of 20 ms would otherwise last one or two frames."""

TOUCHDOWN_SHOWN = 0.3
"""Time on the screen for which an instantaneous touchdown is marked [s]."""


@dataclass(frozen=True, eq=False, kw_only=True)
class SlideMark:
    """A slide of a foot on the ground, up to the current frame.

    A round foot rolls while it slides: the mark begins where it touched the ground when it began to slide.

    Attributes
    ----------
    step, order : int
        Number of the step, and of the slide within the step, from 0.
    contact : int
        Number of the contact in the first step.
    mode : Mode
    start, end : float
        Positions along the slope [m].
    slide : float
        Slide coordinate at its beginning [m], which is the position of a point foot.
    """

    step: int
    order: int
    contact: int
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
    shown : float
        Time on the screen [s].
    step : int
        From 0.
    exchanges : int
        Number of leg exchanges since the first frame.
    phase : int
        Number of the phase within the step.
    mode : Mode
        Mode by which the phase is shaded.
    modes : tuple of Mode
        Of each contact; the order of contacts is that of the first step.
    slowness : float
        Seconds on the screen for a second of motion.
    touchdown : bool
        Whether a touchdown is marked in this frame.
    points : (2, n_points) array [m]
    places : (2, n_c) array [m]
        Where each foot touches the ground; nan for a joint stop.
    slides : (n_c,) array [m]
        Slide coordinate of each foot, which is its position x if it is a point.
    rims : (4, n_c) array, optional
        Centre [m], radius [m] and clockwise angle [rad] of round feet.
    forces : (n_c, 2) array [N]
    """

    time: float
    shown: float
    step: int
    exchanges: int
    phase: int
    mode: Mode
    modes: tuple[Mode, ...]
    slowness: float
    touchdown: bool
    points: Array
    places: Array
    slides: Array
    rims: Array | None
    forces: Array

    @property
    def pace(self) -> str:
        """The slow-motion factor with two digits, without an exponent."""
        return f"{self.slowness:.2g}" if self.slowness < 99.5 else f"{self.slowness:.0f}"


class AnimationFrames:
    """The frames of an animation of a periodic step; the legs exchange roles at each touchdown.

    Parameters
    ----------
    motion : Motion, PlanarMotion or MotionView
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

    def __init__(self, motion: AnyMotion, *, steps: int, rate: float, slow: float) -> None:
        self.motion, self.steps, self.rate, self.slow = view_motion(motion), steps, rate, slow
        self._durations = np.array([max(segment.duration, 1e-9) for segment in self.motion.segments])
        shortest = [SHORTEST_SLIP if segment.slipping else 0.0 for segment in self.motion.segments]
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
            shown=shown,
            step=step,
            exchanges=step + segment.step,
            phase=phase,
            mode=segment.mode,
            modes=segment.modes,
            slowness=float(self._shown[phase] / self._durations[phase]),
            touchdown=step > 0 and within < TOUCHDOWN_SHOWN,
            points=_at(segment, segment.points, time) + shift[:, None],
            places=_at(segment, segment.places, time) + shift[:, None],
            slides=_at(segment, segment.slides, time) + shift[0],
            rims=rims,
            forces=_at(segment, segment.forces, time),
        )

    def screen_time(self, time: float) -> float:
        """Return the time on the screen [s] at which an instant of the first step is shown."""
        begin = float(self.motion.segments[0].time[0])
        return float(np.interp(time - begin, [0.0, *np.cumsum(self._durations)], [0.0, *self._ends]))

    def slides(self, frame: AnimationFrame) -> list[SlideMark]:
        """Return the slides of the feet up to a frame, including the current ones."""
        marks = []
        for step in range(frame.step + 1):
            order, shift = 0, step * self.motion.travel
            for phase, segment in enumerate(self.motion.segments):
                if (step, phase) > (frame.step, frame.phase):
                    break
                for foot in segment.slipping:
                    is_current = (step, phase) == (frame.step, frame.phase)
                    begin = segment.slides[foot, 0]
                    slid = frame.slides[foot] - shift - begin if is_current else segment.slide(foot)
                    start, mode = float(segment.places[0, foot, 0] + shift), segment.modes[foot]
                    mark = {"start": start, "end": start + slid, "slide": begin + shift}
                    marks.append(SlideMark(step=step, order=order, contact=foot, mode=mode, **mark))
                    order += 1
        return marks


def _at(segment: PhaseView, values: Array, time: float) -> Array:
    """Return sampled values at a time, linear between samples; the last axis is time."""
    later = int(np.clip(np.searchsorted(segment.time, time), 1, segment.time.size - 1))
    width = segment.time[later] - segment.time[later - 1]
    share = (time - segment.time[later - 1]) / width if width > 0 else 0.0
    return (1 - share) * values[..., later - 1] + share * values[..., later]
