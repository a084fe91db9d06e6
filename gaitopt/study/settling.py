"""Where a walk ends: step by step until it repeats or fails."""

from dataclasses import dataclass

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.motion.word import Word
from gaitopt.simulation.walker import Walker
from gaitopt.stability.cycle import slips_throughout
from gaitopt.stability.section import Section

UNSETTLED = "unsettled"


@dataclass(frozen=True, eq=False)
class Ending:
    """How a walk ended.

    Attributes
    ----------
    label : str
        Words of the gait it settled in, the key of a :class:`gaitopt.Stop`, or ``"unsettled"``.
    z : (n_z,) array
        Last point on the section with foot speed.
    steps : int
        Steps taken.
    """

    label: str
    z: Array
    steps: int


@dataclass(frozen=True, kw_only=True)
class Patience:
    """When a walk counts as settled.

    Attributes
    ----------
    steps : int
        Most steps taken.
    tolerance : float
        Largest change of the state over a period, for two periods in a row, of a walk that repeats.
    longest_period : int
        Longest period looked for, in steps; the words of its steps are joined by ``"; "``.

    Examples
    --------
    >>> Patience(steps=20).tolerance
    1e-06
    """

    steps: int = 100
    tolerance: float = 1e-6
    longest_period: int = 4


def settle(walker: Walker, z: Array, patience: Patience | None = None) -> Ending:
    """Walk from a point of the section with foot speed until the walk repeats, fails, or patience ends.

    A gait that slips throughout repeats in all but its foot speed, and is settled only if that speed drifts away from
    zero; where it drifts towards zero the foot comes to rest sooner or later and the walk goes on to another gait.

    Parameters
    ----------
    walker : Walker
    z : (n_z,) array
        Coordinates of ``Section(robot, p, sliding=True)``.
    patience : Patience, optional
    """
    patience = patience or Patience()
    section = Section(walker.robot, walker.p, sliding=True)
    points, words = [np.asarray(z, dtype=float)], []
    state, calm = section.embed(z), dict.fromkeys(range(1, patience.longest_period + 1), 0)
    for step in range(1, patience.steps + 1):
        stride = walker.stride(state)
        if stride.following is None or stride.impact is None or stride.impact.mode is None:
            return Ending(stride.stop.key if stride.stop else UNSETTLED, points[-1], step)
        throughout = slips_throughout(stride.modes, stride.impact.mode)
        state = stride.following
        points.append(section.project(state))
        words.append(str(Word(stride.modes, stride.impact.mode)))
        for period in calm:
            near = step >= period and _repeats(points[-1 - period], points[-1], throughout, patience.tolerance)
            calm[period] = calm[period] + 1 if near else 0
            if calm[period] == 2 * period:
                return Ending("; ".join(_canonical(words[-period:])), points[-1], step)
    return Ending(UNSETTLED, points[-1], patience.steps)


def _repeats(before: Array, after: Array, throughout: bool, tolerance: float) -> bool:
    """Return whether two points are the same; in complete slip, up to a foot speed that drifts away from zero."""
    change = np.abs(after - before)
    if throughout:
        away = (after[-1] - before[-1]) * after[-1] > 0
        return bool(away and np.max(change[:-1]) <= tolerance)
    return bool(np.max(change) <= tolerance)


def _canonical(words: list[str]) -> list[str]:
    """Return the words of a period from the first in alphabetical order on, whichever step came last."""
    turns = [words[i:] + words[:i] for i in range(len(words))]
    return min(turns)
