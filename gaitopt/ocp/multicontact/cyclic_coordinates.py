"""Coordinates on which nothing in a problem depends, whose value a solver may increase without limit."""

from dataclasses import replace

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpResult
from gaitopt.status import Status

FAR = 1e3
"""Size beyond which a coordinate drifts [rad or m]; at 1e16 rad, rounding errors exceed a revolution."""

SHIFT, UNCHANGED = 1.0, 1e-9
"""Shift of a coordinate that is tested for an effect, and largest relative effect of rounding errors."""


def fix_drifting_coordinates(
    transcription: PlanarTranscription, data: Array, bounds: Bounds, start: Array, outcome: NlpResult
) -> Bounds | None:
    """Return bounds that fix the initial value of the cyclic coordinates that drifted in a solve; None without any.

    The rates of a cyclic coordinate enter the equations, but not its value, such as the angle of a body that is
    balanced at the hip.  Without bounds, its mean is undetermined: the Hessian is singular, and the steps of a solver
    may increase the mean until rounding errors hide violated equations.  All values are equivalent, also the initial
    one.

    Parameters
    ----------
    transcription : PlanarTranscription
    data : (n_p,) array
    bounds : Bounds
    start : (n_x,) array
        Initial point of the solve.
    outcome : NlpResult
    """
    if outcome.status is Status.INTERRUPTED:
        return None
    drifting = [
        row
        for row in transcription.variables[Unknown.COORDINATES]
        if not np.max(np.abs(outcome.x[row])) <= FAR
        and np.max(np.abs(start[row])) <= FAR
        and not np.any(np.isfinite([bounds.x_lower[row], bounds.x_upper[row]]))
        and _is_cyclic(transcription, data, start, row)
    ]
    if not drifting:
        return None
    lower, upper = bounds.x_lower.copy(), bounds.x_upper.copy()
    first = [row[0] for row in drifting]
    lower[first] = upper[first] = start[first]
    return replace(bounds, x_lower=lower, x_upper=upper)


def _is_cyclic(transcription: PlanarTranscription, data: Array, x: Array, row: Array) -> bool:
    """Return whether a shift of a coordinate at all nodes changes neither objective nor constraints."""
    shifted = x.copy()
    shifted[row] += SHIFT
    before, after = (
        np.concatenate([np.asarray(part).ravel() for part in transcription.nlp.values(point, data)])
        for point in (x, shifted)
    )
    return bool(np.all(np.abs(after - before) <= UNCHANGED * (1 + np.abs(before))))
