"""Facts on a solve for the table of its gait: message, iterations, times, warnings, conflicts and violations."""

import math

from gaitopt.motion.gait import Gait, SolverReport
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.motion.printable import format_count

Facts = list[tuple[str, str]]
"""Pairs of a name and a text."""


def describe_solve(gait: Gait | PlanarGait) -> str:
    """Return the message of a solve with its iterations and times; a problem that is refused has neither.

    Examples
    --------
    >>> from gaitopt import load
    >>> describe_solve(load("docs/examples/compass_slip.h5")).partition(";")[0]
    'Solve_Succeeded, 58 iterations'
    """
    solver = gait.solver
    if not (solver.iterations or gait.status.ok):
        return solver.message
    times = f"build {solver.build_seconds:.2f} s, solve {solver.solve_seconds:.2f} s"
    return f"{solver.message}, {format_count(solver.iterations, 'iteration')}; {times}"


NOT_YET_VERIFIED = (
    "A value that would suffice relaxes the conflict at the nodes of a coarse grid; no gait has been solved and "
    "verified with it yet. If that solve ends as plan_inaccurate or not_verified, relax the limit further."
)
"""Meaning of the sufficient value of a conflict."""


def list_remarks(solver: SolverReport) -> Facts:
    """Return the warnings of a solve and, of a failure, the conflicting limits or the constraints that are not met.

    Examples
    --------
    >>> from gaitopt import load
    >>> list_remarks(load("docs/examples/compass_slip.h5").solver)
    []
    """
    facts = [("warning", warning) for warning in solver.warnings]
    facts += [("conflict", str(conflict)) for conflict in solver.conflicts]
    if any(math.isfinite(conflict.sufficient) and conflict.verified is None for conflict in solver.conflicts):
        facts.append(("note", NOT_YET_VERIFIED))
    if not solver.conflicts:  # otherwise the last iterate is that of a solve that was stopped early
        facts += [("not met", str(violation)) for violation in solver.violations]
    return facts
