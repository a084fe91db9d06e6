"""Impulses of actuators in animations: where and how long each is shown, and with which arrows and text."""

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.motion.animation_frames import TOUCHDOWN_SHOWN, AnimationFrames
from gaitopt.motion.force_scale import WEIGHT_DRAWN
from gaitopt.motion.motion import Array
from gaitopt.motion.motion_view import EventView, MotionView

SHARE = 1.25 * WEIGHT_DRAWN
"""Length of the arrow of the largest reaction, over the height of the walker."""


@dataclass(frozen=True, eq=False, kw_only=True)
class ShownImpulse:
    """The impulses of actuators at one impact, shown for a moment after it.

    Attributes
    ----------
    begin, end : float
        Time on the screen [s].
    lines : tuple of str
        Each impulse with its unit.
    places, arrows : (2, n) arrays
        Feet that receive the reactions [m], and the reactions over the largest one of the motion.
    """

    begin: float
    end: float
    lines: tuple[str, ...]
    places: Array
    arrows: Array


def list_shown_impulses(film: AnimationFrames, steps: int) -> list[ShownImpulse]:
    """Return the impulses of actuators that an animation of some steps shows, in the order of time.

    Impulses at the end of the last step are not shown.

    Parameters
    ----------
    film : AnimationFrames
    steps : int
        Number of repetitions of the step.

    Examples
    --------
    >>> from gaitopt import load
    >>> film = AnimationFrames(load("docs/examples/compass_slip.h5").motion, steps=2, rate=30, slow=2.0)
    >>> list_shown_impulses(film, 2)
    []
    """
    view = film.motion
    events = [event for event in view.events if event.actuator_impulses]
    largest = max((float(np.linalg.norm(_sum_reactions(event), axis=1).max()) for event in events), default=0.0)
    shown = []
    for step in range(steps):
        for event in events:
            begin = film.screen_time(event.time) + step * film.screen_time(float(view.segments[-1].time[-1]))
            feet, reactions = _loaded_feet(view, event), _sum_reactions(event)
            places = [_place_foot(view, event, foot) + np.array([step * view.travel, 0.0]) for foot in feet]
            shown.append(
                ShownImpulse(
                    begin=begin,
                    end=begin + TOUCHDOWN_SHOWN,
                    lines=describe_impulses(view, event),
                    places=np.reshape(places, (-1, 2)).T,
                    arrows=reactions[feet].T / (largest or 1.0),
                )
            )
    return [each for each in shown if each.begin < steps * film.screen_time(float(view.segments[-1].time[-1]))]


def describe_impulses(view: MotionView, event: EventView) -> tuple[str, ...]:
    """Return the impulses of actuators at an event as text, such as ``"leg A 0.1 N s before impact"``."""
    return tuple(
        f"{channel.name} {stage.impulse[row]:.3g} {channel.unit} s {stage.moment} impact".replace("-", "\N{MINUS SIGN}")
        for stage in event.actuator_impulses
        for row, channel in enumerate(view.actuators)
        if stage.impulse[row]
    )


def _sum_reactions(event: EventView) -> Array:
    """Return the reaction of each contact to all impulses of an event, shape (n_c, 2)."""
    total: Array = np.sum([stage.reaction for stage in event.actuator_impulses], axis=0)
    return total


def _loaded_feet(view: MotionView, event: EventView) -> list[int]:
    reactions = _sum_reactions(event)
    return [foot for foot in view.feet if reactions[foot].any()]


def _place_foot(view: MotionView, event: EventView, foot: int) -> Array:
    """Return where a foot touches the ground at an event, shape (2,)."""
    segment = min(view.segments, key=lambda part: abs(float(part.time[-1]) - event.time))
    place: Array = segment.places[:, foot, -1]
    return place
