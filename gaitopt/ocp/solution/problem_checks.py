"""Checks of a problem: poor scaling, and a guess outside the bounds."""

import math

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.keys import Key, Kind
from gaitopt.ocp.transcription.transcription import Transcription

MOVED = 1e-3
"""Least distance of a guess from its bounds that is reported, in the unit of the quantity."""

STATED = (Kind.ANGLE, Kind.RATE, Kind.TORQUE, Kind.DURATION, Kind.FOOT_SLIDE, Kind.SPEED_OF_FOOT)
"""Quantities that a guess states; all others are computed from them."""

STEEP = 1e6
"""Derivative above which a constraint is badly scaled: Ipopt scales it to 100, which reduces its accuracy."""


def report_poor_scaling(transcription: Transcription, start: Array, data: Array) -> tuple[str, ...]:
    """Return a sentence about the constraint with the largest derivative if it is badly scaled."""
    jacobian = transcription.nlp.derivatives["jac_g"](start, data)[1]
    sizes, rows = np.abs(np.asarray(jacobian.nonzeros())), jacobian.sparsity().row()
    steepest = int(np.argmax(np.where(np.isfinite(sizes), sizes, np.inf)))
    place, name = transcription.constraints.label(int(rows[steepest]))
    if not math.isfinite(sizes[steepest]):
        return (f"'{name}' at {place} has no finite derivative at the initial guess: choose another guess.",)
    if sizes[steepest] <= STEEP:
        return ()
    return (
        f"'{name}' at {place} has a derivative of {sizes[steepest]:.0e}: the problem is badly scaled. Give masses, "
        f"lengths and speeds in SI units, and look for a parameter that is off by orders of magnitude.",
    )


def report_clipped_guess(transcription: Transcription, limits: Bounds, guessed: Array) -> tuple[str, ...]:
    """Return a sentence per quantity of a guess outside its bounds, for its largest violation.

    A quantity that is computed from the guess is not reported, nor is a foot at rest in a slip phase: keyframes state
    no slide, and speeds of a slip have a margin to 0.

    Parameters
    ----------
    transcription : Transcription
    limits : Bounds
    guessed : (n_variables,) array
        Decision vector of the guess before it is clipped to the bounds.
    """
    excess = np.maximum(limits.x_lower - guessed, guessed - limits.x_upper)
    excess = np.where(np.isnan(excess), np.inf, excess)
    worst: dict[Key, int] = {}
    for index in np.flatnonzero(excess > MOVED):
        key = transcription.variables.entries[int(index)][1]
        if key.kind not in STATED or (key.kind is Kind.SPEED_OF_FOOT and guessed[index] == 0):
            continue
        if key not in worst or excess[index] > excess[worst[key]]:
            worst[key] = int(index)
    return tuple(
        f"the guess has {key.label} outside its bounds by {excess[index]:.2g} at "
        f"{transcription.variables.label(index)[0]}; it was moved inside them."
        for key, index in worst.items()
    )
