"""tune_feedback: gains that hold a gait, found on its return map and verified in the nonlinear simulator."""

import math
import time
from collections.abc import Sequence

import numpy as np

from gaitopt.control.law import Law
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.model.robots.catalogue import robot_named
from gaitopt.motion.gait import Gait
from gaitopt.progress import TuningObserver, silent
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.recovery import PushTest, Recovery, largest_recovery
from gaitopt.tuning.controller_family import ControllerFamily
from gaitopt.tuning.gain_search import GainSearch, GainSearchOptions
from gaitopt.tuning.objective import SpectralRadius, TuningObjective
from gaitopt.tuning.record import Trial, Tuning


def tune_feedback(
    gait: Gait,
    design: ControllerFamily,
    *,
    objective: TuningObjective | None = None,
    frictions: Sequence[float] = (),
    search: GainSearchOptions | None = None,
    test: PushTest | None = None,
    robot: Robot | None = None,
    engine: Engine | None = None,
    observer: TuningObserver = silent,
) -> Tuning:
    """Tune the gains of a law until it holds a gait best, and verify the tuned law by walks in the simulator.

    Parameters
    ----------
    gait : Gait
    design : Design
    objective : TuningObjective, optional
        The spectral radius by default.
    frictions : sequence of float
        Frictions of the ground among which the worst counts, besides the gait's own; the law does not know them.
    search : Search, optional
    test : PushTest, optional
        Of the verification: walks from seeded starts.
    robot : Robot, optional
        Needed for a robot that is not in gaitopt's catalogue.
    engine : Engine, optional
    observer : callable, optional
        Receives an :class:`gaitopt.Iteration` per evaluation: its objective, and that of the best so far; then a
        :class:`gaitopt.VerificationStep` per walk of the verification.

    Returns
    -------
    Tuning
        Look at `stable` first: a gait that cannot be held with this law is reported with the best radius found.

    Raises
    ------
    InputError
        If the gait is not a solution.

    Examples
    --------
    >>> from gaitopt import PushTest, GainSearchOptions, compass_biped, controller_family_named, load, tune_feedback
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> design = controller_family_named("computed_torque", compass_biped(), gait.motion, torque_limit=8)
    >>> tuned = tune_feedback(gait, design, search=GainSearchOptions(samples=2, starts=1, evaluations=8), test=PushTest(starts=1))
    >>> tuned.radius_after < 0.2 < tuned.radius_before
    True
    """
    gait.require()
    robot, search = robot_named(gait.robot, robot), search or GainSearchOptions()
    objective, began = objective or SpectralRadius(), time.perf_counter()
    task = GainSearch(gait, robot, design, objective, tuple(frictions), engine, observer)
    best = task.search(search)
    seconds = time.perf_counter() - began
    law, cycle = _closed_loop_gait(gait, design, best, robot, engine)
    return Tuning(
        law=law,
        design=design.name,
        gains=best.gains,
        objective=objective.name,
        radius_before=_open_loop(gait, robot, engine),
        radius_after=math.inf if cycle is None else cycle.radius,
        cycle=cycle,
        fixed_point_shift=math.nan if cycle is None else fixed_point_shift(gait, cycle),
        verified=_verify_tuning(gait, law, cycle, test or PushTest(), robot, engine, observer),
        trials=tuple(task.trials),
        evaluations=len(task.trials),
        seconds=seconds,
    )


def fixed_point_shift(gait: Gait, cycle: Cycle) -> float:
    """Return the largest difference of a periodic gait's state after touchdown from a planned one's."""
    first = gait.motion.segments[0]
    return float(np.max(np.abs(cycle.section.embed(cycle.z) - np.concatenate([first.q[:, 0], first.v[:, 0]]))[2:]))


def _open_loop(gait: Gait, robot: Robot, engine: Engine | None) -> float:
    try:
        return assess_stability(gait, robot=robot, engine=engine).radius
    except InputError:
        return math.inf


def _closed_loop_gait(
    gait: Gait, design: ControllerFamily, best: Trial, robot: Robot, engine: Engine | None
) -> tuple[Law | None, Cycle | None]:
    """Return the law of the best gains and its periodic gait, where there are any."""
    try:
        law = design.law(best.gains)
    except InputError:
        return None, None
    try:
        return law, assess_stability(gait, law, robot=robot, engine=engine)
    except InputError:
        return law, None


def _verify_tuning(
    gait: Gait,
    law: Law | None,
    cycle: Cycle | None,
    test: PushTest,
    robot: Robot,
    engine: Engine | None,
    observer: TuningObserver,
) -> Recovery:
    if law is None or cycle is None:
        return Recovery(radius=0.0, starts=test.starts, returned=0, steps=test.steps, tolerance=test.tolerance)
    walker = Walker(
        robot, law, robot.vector(cycle.parameters), engine or default_engine(law), step_time_limit=3 * gait.period
    )
    return largest_recovery(walker, cycle, test, observer)
