"""Coordinates on which nothing in a problem depends, whose value a solver may increase without limit."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from gaitopt.motion.motion import Array
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.nlp.nlp_solver import NlpResult
from gaitopt.status import Status

Multipliers = tuple[Array, Array] | None
Minimise = Callable[[Array, Bounds, Multipliers], NlpResult]
"""Solve from an initial point within bounds, near a solution if multipliers are stated."""

FAR = 1e3
"""Size beyond which a coordinate drifts [rad or m]; at 1e16 rad, rounding errors exceed a revolution."""

SHIFT, UNCHANGED = 1.0, 1e-9
"""Shift of a coordinate that is tested for an effect, and largest relative effect of rounding errors."""


def minimise_without_drift(
    minimise: Minimise,
    transcription: PlanarTranscription,
    data: Array,
    bounds: Bounds,
    start: Array,
    multipliers: Multipliers,
) -> NlpResult:
    """Return the result of a solve, which is repeated with fixed initial values of cyclic coordinates that drifted.

    The rates of a cyclic coordinate enter the equations, but not its value, such as the angle of a body that is
    balanced at the hip.  Without bounds, its mean is undetermined: the Hessian is singular, and the steps of a solver
    may increase the mean until rounding errors hide violated equations.  All values are equivalent, also the initial
    one.

    Parameters
    ----------
    minimise : callable
    transcription : PlanarTranscription
    data : (n_p,) array
    bounds : Bounds
    start : (n_x,) array
        Initial point.
    multipliers : ((n_x,) array, (n_g,) array), optional
        Those of a solution near the initial point.
    """
    outcome = minimise(start, bounds, multipliers)
    rows = _find_drifting_rows(transcription, data, bounds, start, outcome)
    if not rows:
        return outcome
    lower, upper = bounds.x_lower.copy(), bounds.x_upper.copy()
    near = outcome.x.copy()
    for row in rows:
        lower[row[0]] = upper[row[0]] = start[row[0]]
        near[row] = start[row]  # the differences of large values are rounding errors
    fixed = replace(bounds, x_lower=lower, x_upper=upper)
    iterations, first = outcome.iterations, outcome
    if first.status.ok:
        outcome = minimise(near, fixed, first.multipliers)
        iterations += outcome.iterations
        if outcome.status is Status.INTERRUPTED:
            outcome = replace(first, status=outcome.status, message=outcome.message)
    if not first.status.ok or not (outcome.status.ok or outcome.status is Status.INTERRUPTED):
        outcome = minimise(start, fixed, multipliers)
        iterations += outcome.iterations
    return replace(outcome, iterations=iterations)


def _find_drifting_rows(
    transcription: PlanarTranscription, data: Array, bounds: Bounds, start: Array, outcome: NlpResult
) -> list[Array]:
    """Return the places of the cyclic coordinates without bounds that a solve has led far from its initial point."""
    if outcome.status is Status.INTERRUPTED:
        return []
    return [
        row
        for row in transcription.variables[Unknown.COORDINATES]
        if not np.max(np.abs(outcome.x[row])) <= FAR
        and np.max(np.abs(start[row])) <= FAR
        and not np.any(np.isfinite([bounds.x_lower[row], bounds.x_upper[row]]))
        and _is_cyclic(transcription, data, start, row)
    ]


def _is_cyclic(transcription: PlanarTranscription, data: Array, x: Array, row: Array) -> bool:
    """Return whether a shift of a coordinate at all nodes changes neither objective nor constraints."""
    shifted = x.copy()
    shifted[row] += SHIFT
    before, after = (
        np.concatenate([np.asarray(part).ravel() for part in transcription.nlp.values(point, data)])
        for point in (x, shifted)
    )
    return bool(np.all(np.abs(after - before) <= UNCHANGED * (1 + np.abs(before))))
