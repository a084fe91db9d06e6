"""solve: from a problem to a gait."""

import functools
import math
import platform
import time
from collections.abc import Iterator
from importlib import metadata

import numpy as np

from gaitopt.motion.energy import ledger
from gaitopt.motion.gait import Gait, SolverReport
from gaitopt.ocp.bounds import bounds, data_vector, structure
from gaitopt.ocp.carrying import carried
from gaitopt.ocp.diagnosis import violations, warnings
from gaitopt.ocp.guess import Guess, Line
from gaitopt.ocp.ipopt import Ipopt, Outcome
from gaitopt.ocp.method import Method
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.readout import error_between_nodes, found_values, read_motion
from gaitopt.ocp.start import start
from gaitopt.ocp.transcription import Transcription, transcribe
from gaitopt.progress import Observer, silent
from gaitopt.status import Status

AUTOMATIC: tuple[Guess, ...] = (Line(),)
"""Starts tried, in order, for a problem without a guess of its own."""


def solve(problem: GaitProblem, *, solver: Ipopt | None = None, observer: Observer = silent) -> Gait:
    """Find an energy-optimal gait.

    Parameters
    ----------
    problem : GaitProblem
    solver : Ipopt, optional
    observer : Observer
        Receives an :class:`gaitopt.Iteration` per iteration.

    Returns
    -------
    Gait
        Look at ``gait.status`` first: a numerical failure is not an exception.  Then :func:`gaitopt.verify` it.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, compass_biped, solve
    >>> problem = GaitProblem(
    ...     robot=compass_biped(), word="stick | stick", friction=0.2, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared",
    ... )
    >>> gait = solve(problem)
    >>> gait.status.ok, round(gait.step_length, 6)
    (True, 0.45)
    """
    gaits = []
    for gait in attempts(problem, solver=solver, observer=observer):
        gaits.append(gait)
        if gait.status is Status.INTERRUPTED:
            break
    solved = [gait for gait in gaits if gait.status.ok]
    if solved:
        return min(solved, key=lambda gait: gait.solver.objective)
    return min(gaits, key=lambda gait: (gait.status is not Status.INTERRUPTED, gait.solver.constraint_violation))


def attempts(problem: GaitProblem, *, solver: Ipopt | None = None, observer: Observer = silent) -> Iterator[Gait]:
    """Yield the gait found from each start, one solve at a time."""
    for guess in (problem.guess,) if problem.guess is not None else AUTOMATIC:
        yield _attempt(problem, guess, solver or Ipopt(), observer)


def _attempt(problem: GaitProblem, guess: Guess, solver: Ipopt, observer: Observer) -> Gait:
    """Solve from one start, then refine the integration until the plan is what the robot does between nodes too."""
    method, iterations, build = problem.transcription, 0, 0.0
    began = time.perf_counter()
    transcription, seconds = _built(problem, method)
    x, multipliers = start(transcription, problem, guess), None
    data = data_vector(problem)
    while True:
        build += seconds
        limits = bounds(transcription, problem)
        outcome = solver.minimise(transcription.nlp, x, data, limits, observer, multipliers)
        iterations += outcome.iterations
        values = found_values(transcription, problem, _finite(outcome))
        motion = read_motion(transcription, values, _finite(outcome))
        error = error_between_nodes(transcription, values, _finite(outcome)) if outcome.status.ok else math.inf
        worst = max(error, ledger(motion).relative_residual)
        finer = method.finer()
        if not outcome.status.ok or worst <= problem.transcription.tolerance or finer is None:
            break
        before, method = transcription, finer
        transcription, seconds = _built(problem, method)
        x, multipliers = carried(before, outcome, transcription)
    unmet = violations(transcription, limits, outcome.x, outcome.g)
    return Gait(
        robot=problem.robot.name,
        word=problem.word,
        status=outcome.status,
        motion=motion,
        problem=problem.describe() | {"guess": guess.describe(), "transcription": method.name},
        solver=SolverReport(
            iterations=iterations,
            objective=outcome.objective,
            constraint_violation=unmet[0].size if unmet else 0.0,
            error_between_nodes=error,
            build_seconds=build,
            solve_seconds=time.perf_counter() - began - build,
            message=outcome.message,
            violations=() if outcome.status.ok else unmet,
            warnings=warnings(transcription, problem, outcome.x, worst) if outcome.status.ok else (),
        ),
        decision=outcome.x,
        versions=versions(),
    )


def _built(problem: GaitProblem, method: Method) -> tuple[Transcription, float]:
    """Return the transcription and the seconds it took to build, 0 if it had been built before."""
    began, known = time.perf_counter(), transcribe.cache_info().misses
    transcription = transcribe(structure(problem, method))
    new = transcribe.cache_info().misses > known
    return transcription, time.perf_counter() - began if new else 0.0


def _finite(outcome: Outcome) -> np.ndarray:
    return np.nan_to_num(outcome.x, nan=0.0, posinf=0.0, neginf=0.0)


def versions() -> dict[str, str]:
    """Return the versions of gaitopt and of what its numbers depend on."""
    names = ("gaitopt", "casadi", "numpy", "scipy")
    return {name: _installed(name) for name in names} | {"python": platform.python_version()}


@functools.cache
def _installed(name: str) -> str:
    return metadata.version(name)
