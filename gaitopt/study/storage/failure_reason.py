"""Status of a grid point or contact sequence of a study, and reasons of failure."""

from gaitopt.errors import join_reasons
from gaitopt.motion.gait import IMPLAUSIBLE, Gait
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.status import Status

IMPOSSIBLE, LOST, PENDING, MERGED = "impossible", "lost", "pending", "merged"
"""Status of a problem without solution, of one whose process died, of one not computed yet, and of one whose gait
degenerates to another sequence; all others have the status of their gait."""

UNFINISHED = "the study was interrupted before this result was computed"


def explain_failure(gait: Gait | PlanarGait) -> str:
    """Return why a gait is not a solution; empty for a solution.

    Examples
    --------
    >>> from gaitopt import load
    >>> explain_failure(load("docs/examples/compass_slip.h5"))
    ''
    """
    if gait.status.ok:
        return ""
    if gait.verification is not None and not gait.verification.passed:
        return "replay: " + join_reasons(gait.verification.reasons)
    if gait.solver.message == IMPLAUSIBLE:
        return f"no gait found; {IMPLAUSIBLE}: {gait.solver.warnings[0]}"
    if gait.solver.conflicts:
        return "no gait found; " + join_reasons(gait.solver.conflicts)
    if gait.status is Status.PLAN_INACCURATE:
        return "the plan is inaccurate: " + " ".join(gait.solver.warnings)
    if gait.solver.violations:
        worst = gait.solver.violations[0]
        return f'no gait found; the best attempt violates "{worst.name}" ({worst.place}) by {worst.size:.2g}'
    return f"{gait.status.hint} ({gait.solver.message})"
