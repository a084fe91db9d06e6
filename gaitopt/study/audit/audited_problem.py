"""Audit of one problem: it is solved, verified by the simulator, and replayed by the second integrator."""

import math
import time
from typing import TYPE_CHECKING, Any

from gaitopt.address_space import lacks_memory
from gaitopt.errors import GaitoptError, join_reasons
from gaitopt.motion.gait import Gait
from gaitopt.motion.planar_gait import AnyGait, PlanarGait
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solver import solve
from gaitopt.simulation.replay_tolerances import Tolerances
from gaitopt.simulation.verification import verify
from gaitopt.status import Status
from gaitopt.study.audit.second_planar_replay import replay_planar_again
from gaitopt.study.audit.second_replay import SecondReplay, replay_again

if TYPE_CHECKING:
    from gaitopt.ocp.multicontact.planar_problem import PlanarProblem

VERIFIED, FALSE_PASS, REFUSED, ERROR, NOT_REPLAYED = "verified", "false pass", "refused", "error", "not replayed"
"""Results of a problem whose solve has a solution: both replays agree with the plan, only the simulator's does, it does
not; an exception was raised, or the second replay does not support the robot."""

FACTOR = 2.0
"""Deviations allowed in the second replay, over those allowed in the simulator's."""


def audit_problem(problem: "GaitProblem | PlanarProblem", *, starts: int | None = None) -> dict[str, Any]:
    """Return the result of a problem as plain data.

    Parameters
    ----------
    problem : GaitProblem or PlanarProblem
    starts : int, optional
        Number of starts of a further solve, whose cost is compared.

    Returns
    -------
    dict
        ``result`` (one of the constants of this module, or the status of a solve without a solution), ``reason``,
        ``sequence``, ``objective``, ``cost``, ``best`` (lowest cost of the solves), ``state_error`` and
        ``second_error`` of the replays, ``seconds`` of processor time.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, compass_biped
    >>> audit_problem(GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.2, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared"))["result"]
    'verified'
    """
    began = time.process_time()
    record: dict[str, Any] = {"sequence": str(problem.sequence), "objective": problem.objective.name}
    try:
        gait = solve(problem)
        record |= _judge(gait)
        if starts is not None and gait.status.ok:
            record["best"] = _find_best(problem, gait, starts)
    except Exception as error:  # any other exception is a finding of the audit
        if lacks_memory(error):
            raise
        record |= {"result": ERROR, "reason": f"{type(error).__name__}: {error}"[:300]}
    return record | {"seconds": round(time.process_time() - began, 3)}


def _judge(gait: AnyGait) -> dict[str, Any]:
    """Return the result of a solve; one that a Ctrl-C has ended has none."""
    if gait.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    if not gait.status.ok:
        report = gait.solver
        reasons = report.conflicts or (report.warnings if gait.status is Status.PLAN_INACCURATE else ())
        return {"result": gait.status.key, "reason": join_reasons(reasons[:2]) or report.message}
    verification = verify(gait).verification
    facts = {"cost": gait.solver.objective, "state_error": getattr(verification, "state_error", None)}
    if verification is None or not verification.passed:
        return facts | {"result": REFUSED, "reason": join_reasons(getattr(verification, "reasons", ()))}
    try:
        second = replay_planar_again(gait) if isinstance(gait, PlanarGait) else replay_again(gait)
    except GaitoptError as error:
        return facts | {"result": NOT_REPLAYED, "reason": str(error)}
    reason = describe_disagreement(gait, second)
    return facts | {"second_error": second.state_error, "result": FALSE_PASS if reason else VERIFIED, "reason": reason}


def describe_disagreement(gait: AnyGait, second: SecondReplay) -> str:
    """Return how a second replay differs from the plan by more than the tolerances; empty if it does not."""
    tolerances, planned = Tolerances(), str(gait.sequence if isinstance(gait, Gait) else gait.motion.sequence)
    if second.reason:
        return f"the second replay stopped: {second.reason}"
    if second.sequence != planned:
        return f"the second replay has the contact sequence '{second.sequence}' instead of '{planned}'"
    for name, error, allowed in (
        ("state", second.state_error, tolerances.state),
        ("period", second.period_error, tolerances.period),
    ):
        if not error <= FACTOR * allowed:
            return f"the {name} of the second replay deviates by {error:.1e}"
    return ""


def _find_best(problem: "GaitProblem | PlanarProblem", gait: AnyGait, starts: int) -> float:
    """Return the lowest objective of a gait and of the verified gait of several starts."""
    other = solve(problem, starts=starts)
    if other.status is Status.INTERRUPTED:
        raise KeyboardInterrupt
    lowest = other.solver.objective if other.status.ok and verify(other).status.ok else math.inf
    return min(float(gait.solver.objective), float(lowest))
