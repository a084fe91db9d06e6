"""Probable cause of a failed replay of a gait, and its remedy."""

import math

from gaitopt.motion.gait import Gait, Verification
from gaitopt.status import Stop

BEGINNING = "the replay fails, probably because "
"""Beginning of the advice, by which that of an earlier replay is found."""

USUAL_TOLERANCE = 1e-7
"""Default tolerance of the error between nodes."""

ACCURATE = 1e-8
"""Error between nodes below which a finer grid is no remedy [rad, rad/s, m, m/s]."""


def advise_on_replay(gait: Gait, verification: Verification) -> str:
    """Return the probable cause of a failed replay and its remedy in one sentence; empty if none is known.

    Parameters
    ----------
    gait : Gait
    verification : Verification

    Examples
    --------
    >>> from gaitopt import load
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> advise_on_replay(gait, gait.verification)
    ''
    """
    if verification.passed:
        return ""
    cause = _find_grid_error(gait) or _find_changed_mode(gait, verification)
    if not cause and verification.stop == Stop.STEPS_DONE.key:
        drift = gait.solver.error_between_nodes
        cause = (
            f"the step amplifies the error of the plan ({drift:.1e} between nodes): use a smaller tolerance, such as "
            f"Collocation(tolerance=1e-9), or more intervals."
        )
    return f"{BEGINNING}{cause}" if cause else ""


def _find_grid_error(gait: Gait) -> str:
    """Return that the grid is too coarse, if the plan is inaccurate between its nodes."""
    drift, tolerance = gait.solver.error_between_nodes, gait.problem.get("tolerance", math.nan)
    if not ACCURATE < drift < math.inf:
        return ""
    text = f"the grid is too coarse: the plan deviates by {drift:.1e} from a motion of the robot between its nodes"
    if tolerance > USUAL_TOLERANCE:
        return f"{text}, which its tolerance of {tolerance:g} permits; use the default tolerance, {USUAL_TOLERANCE:g}."
    return f"{text}; use more intervals."


def _find_changed_mode(gait: Gait, verification: Verification) -> str:
    """Return which margin is too small, if the replay has other contact modes than the plan."""
    planned, replayed = str(gait.sequence), verification.sequence
    if planned == replayed or verification.stop != Stop.STEPS_DONE.key:
        return ""
    if planned.partition("|")[0] == replayed.partition("|")[0]:
        return "the impulse of the impact lies too close to the friction cone: use a larger Margins.impact_cone."
    return (
        "a contact force or foot speed lies too close to the boundary of its contact mode: use larger Margins (cone, "
        "slip_speed)."
    )
