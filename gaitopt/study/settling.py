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
        Word of the gait it settled in, the key of a :class:`gaitopt.Stop`, or ``"unsettled"``.
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
        Largest change of the state from step to step, twice in a row, of a walk that repeats.

    Examples
    --------
    >>> Patience(steps=20).tolerance
    1e-06
    """

    steps: int = 100
    tolerance: float = 1e-6


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
    state, calm = section.embed(z), 0
    for step in range(1, patience.steps + 1):
        stride = walker.stride(state)
        if stride.following is None or stride.impact is None or stride.impact.mode is None:
            return Ending(stride.stop.key if stride.stop else UNSETTLED, section.project(state), step)
        before, after = section.project(state), section.project(stride.following)
        change = np.abs(after - before)
        if slips_throughout(stride.modes, stride.impact.mode):
            away = (after[-1] - before[-1]) * after[-1] > 0
            change = change[:-1] if away else np.array([np.inf])
        state = stride.following
        calm = calm + 1 if np.max(change) <= patience.tolerance else 0
        if calm == 2:
            return Ending(str(Word(stride.modes, stride.impact.mode)), after, step)
    return Ending(UNSETTLED, section.project(state), patience.steps)
