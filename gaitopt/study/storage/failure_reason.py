"""Status of a grid point or contact sequence of a study, and reasons of failure."""

import math
from collections.abc import Sequence

from gaitopt.errors import join_reasons
from gaitopt.motion.conflict import Conflict
from gaitopt.motion.gait import IMPLAUSIBLE, NONEXISTENT, WITHOUT_IMPULSE, Gait
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.status import Status

IMPOSSIBLE, LOST, PENDING, MERGED = "impossible", "lost", "pending", "merged"
"""Status of a problem without solution, of one whose process died, of one not computed yet, and of one whose gait
degenerates to another sequence; all others have the status of their gait."""

UNFINISHED = "the study was interrupted before this result was computed"


def explain_failure(gait: Gait | PlanarGait, *, most_conflicts: int | None = None) -> str:
    """Return why a gait is not a solution; empty for a solution.

    Parameters
    ----------
    gait : Gait or PlanarGait
    most_conflicts : int, optional
        Largest number of conflicting limits that are listed; by default all.

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
    if NONEXISTENT in gait.solver.message:
        return gait.solver.message
    causes = [warning for warning in gait.solver.warnings[:1] if WITHOUT_IMPULSE in warning]
    if gait.solver.conflicts:
        return "no gait found; " + join_reasons([*causes, list_conflicts(gait.solver.conflicts, most_conflicts)])
    if gait.status is Status.PLAN_INACCURATE:
        return "the plan is inaccurate: " + " ".join(gait.solver.warnings)
    if gait.solver.violations:
        worst = gait.solver.violations[0]
        violation = f'the best attempt violates "{worst.name}" ({worst.place}) by {worst.size:.2g}'
        return "no gait found; " + join_reasons([*causes, violation])
    return join_reasons([*causes, f"{gait.status.hint} ({gait.solver.message})"])


def list_conflicts(conflicts: Sequence[Conflict], most: int | None = None) -> str:
    """Return conflicting limits as a text: all of them, or the most informative ones and the number of the others.

    A limit with a value that suffices alone is more informative than one without, most of all if a gait was verified
    with this value.

    Parameters
    ----------
    conflicts : sequence of Conflict
    most : int, optional
        Largest number that is listed.

    Examples
    --------
    >>> limits = [
    ...     Conflict(name=name, setting=name, limit=3.0, missing=1.0, sufficient=2.0, unit="m/s", separable=alone)
    ...     for name, alone in (("a", False), ("speed", True), ("b", False))
    ... ]
    >>> list_conflicts(limits, 1)
    'speed is 3 m/s: 2 m/s alone would suffice; and 2 more'
    """
    if most is None or len(conflicts) <= most:
        return join_reasons(conflicts)

    def is_vague(conflict: Conflict) -> tuple[bool, bool, bool]:
        return not conflict.separable, math.isnan(conflict.sufficient), conflict.verified is not True

    listed = sorted(conflicts, key=is_vague)[:most]
    return f"{join_reasons(listed)}; and {len(conflicts) - most} more"
