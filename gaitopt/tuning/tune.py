"""tune_feedback: gains tuned on the return map of a gait and verified in the nonlinear simulator."""

import math
import time
from collections.abc import Mapping, Sequence

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law
from gaitopt.control.law_kinks import require_derivative, require_finite_torques
from gaitopt.control.planar_laws.planar_law import PlanarLaw
from gaitopt.errors import InputError
from gaitopt.interrupts import InterruptRecord, hold_interrupt
from gaitopt.model.planar.planar_robot import PlanarRobot
from gaitopt.model.robot import Robot
from gaitopt.motion.planar_gait import AnyGait, PlanarGait, check_any_gait
from gaitopt.parameters import check_type
from gaitopt.progress import TuningObserver, silent
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine
from gaitopt.stability.assessment import assess_stability
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.gait_recovery import walker_near
from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle
from gaitopt.stability.recovery import PushTest, Recovery, find_largest_recovery
from gaitopt.tuning.controller_family import ControllerFamily
from gaitopt.tuning.gain_search import GainSearch, GainSearchOptions
from gaitopt.tuning.record import Trial, Tuning
from gaitopt.tuning.tuned_gait import identify_gait
from gaitopt.tuning.tuning_objective import SpectralRadius, TuningObjective


@check_arguments
def tune_feedback(
    gait: AnyGait,
    family: ControllerFamily,
    *,
    objective: TuningObjective | None = None,
    frictions: Sequence[float | Mapping[str, float]] = (),
    search: GainSearchOptions | None = None,
    test: PushTest | None = None,
    engine: Engine | PlanarEngine | None = None,
    observer: TuningObserver = silent,
) -> Tuning:
    """Tune the gains of a law that stabilises a gait, and verify the tuned law by walks in the simulator.

    Ctrl-C during the search ends it, once gains have been evaluated, and keeps the best gains so far, without
    verification; `search_interrupted` is then True.  Ctrl-C during the verification ends it after the current walk and
    keeps the gains; `verified.interrupted` is then True.  A second Ctrl-C raises KeyboardInterrupt.

    Parameters
    ----------
    gait : Gait or PlanarGait
    family : ControllerFamily
    objective : TuningObjective, optional
        The spectral radius by default.
    frictions : sequence of float or mapping of str to float
        Additional friction coefficients, or values of several parameters by name, unknown to the law; the worst
        objective is minimised.
    search : GainSearchOptions, optional
    test : PushTest, optional
        Verification by walks from random states.
    engine : Engine or PlanarEngine, optional
        As in :func:`gaitopt.assess_stability`.
    observer : callable, optional
        Receives a :class:`gaitopt.progress.TuningStep` per evaluation, then a
        :class:`gaitopt.progress.VerificationStep` per walk of the verification.

    Returns
    -------
    Tuning
        Check `stable` first: a gait that the law cannot stabilise is reported with the best radius found.  The
        radius may also be larger than in open loop (`worse_than_open_loop`), and the walker may have another contact
        sequence under the law than the gait (`changes_sequence`).

    Raises
    ------
    InputError
        If the gait is not a solution, the family has no gains, or its law has a kink along the plan.

    Examples
    --------
    >>> from gaitopt import PushTest, GainSearchOptions, compass_biped, load, tune_feedback
    >>> from gaitopt.tuning import controller_family_named
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> family = controller_family_named("computed_torque", compass_biped(), gait.motion, torque_limit=8)
    >>> options = GainSearchOptions(samples=2, starts=1, evaluations=8)
    >>> tuned = tune_feedback(gait, family, search=options, test=PushTest(starts=1))
    >>> tuned.radius_after < 0.2 < tuned.radius_before
    True
    """
    check_any_gait(gait)
    example = 'a ControllerFamily such as controller_family_named("lqr", robot, gait.motion, torque_limit=8)'
    check_type("family", family, ControllerFamily, example)
    require_gains(family)
    gait.require()
    _require_derivative(gait, family)
    robot, search = gait.robot, search or GainSearchOptions()
    objective, start_time = objective or SpectralRadius(), time.perf_counter()
    gain_search = GainSearch(gait, robot, family, objective, tuple(frictions), engine, observer)
    with hold_interrupt() as interrupt:  # the best gains are kept
        radius_before = _open_loop(gait, engine)  # before the search, so that it ends soon after an interrupt
        best = gain_search.search(search, interrupt)
        seconds = time.perf_counter() - start_time
        law, cycle = _closed_loop_gait(gait, family, best, engine)
        verified = _verify_tuning(gait, law, cycle, test or PushTest(), engine, (observer, interrupt))
    return Tuning(
        law=law,
        family=family.name,
        gains=best.gains,
        settings=family.settings,
        objective=objective.name,
        radius_before=radius_before,
        radius_after=math.inf if cycle is None else cycle.radius,
        cycle=cycle,
        fixed_point_shift=math.nan if cycle is None else fixed_point_shift(gait, cycle),
        verified=verified,
        trials=tuple(gain_search.trials),
        evaluations=len(gain_search.trials),
        seconds=seconds,
        planned_sequence=gait.motion.sequence if isinstance(gait, PlanarGait) else str(gait.sequence),
        bounds={gain.name: (gain.lower, gain.upper) for gain in family.gains},
        search_interrupted=gain_search.interrupted,
        actuator_units=_list_actuator_units(robot),
        gait=identify_gait(gait),
    )


def _list_actuator_units(robot: Robot | PlanarRobot) -> dict[str, str]:
    """Return the unit of the torque or force of each actuator."""
    units = robot.actuator_units if isinstance(robot, PlanarRobot) else ["N m"] * len(robot.actuators)
    return dict(zip(robot.actuators, units, strict=True))


def _require_derivative(gait: AnyGait, family: ControllerFamily) -> None:
    """Raise InputError if the law of the first gains has a kink or no finite torque along the plan.

    It has a kink for other gains then, too.
    """
    try:
        law = family.law({gain.name: gain.start for gain in family.gains})
    except InputError:  # no law exists for these gains
        return
    require_finite_torques(gait, law)
    require_derivative(gait, law)


def require_gains(family: ControllerFamily) -> None:
    """Raise InputError if there is nothing to tune.

    Examples
    --------
    >>> from gaitopt import load
    >>> from gaitopt.tuning import controller_family_named
    >>> gait = load("docs/examples/compass_slip.h5")
    >>> require_gains(controller_family_named("lqr", gait.robot, gait.motion, torque_limit=8))
    """
    if not family.gains:
        raise InputError(
            f"The law {family.name!r} has no gains to tune. Gains of a law with the decorator define_law are the "
            "arguments after state and plan, such as law(state, plan, stiffness=10.0); those of a Law are named rows "
            "of its table, Law(name, control, breakpoints, table, gains={'stiffness': row}), with values other than 0. "
            "assess_stability and 'gaitopt stability' accept a law without gains."
        )


def fixed_point_shift(gait: AnyGait, cycle: Cycle | PlanarCycle) -> float:
    """Return the largest difference of a periodic gait's state after touchdown from a planned one's."""
    first = gait.motion.segments[0]
    planned = np.concatenate([first.q[:, 0], first.v[:, 0]])
    if isinstance(cycle, PlanarCycle):
        repeated = [name != gait.motion.travel for name in cycle.state]
        return float(np.max(np.abs(cycle.start.y - planned)[repeated]))
    section = cycle.section
    difference = np.abs(section.embed(cycle.z) - planned)
    return float(np.max(difference[section.robot.state_entries.without_position]))


def _open_loop(gait: AnyGait, engine: Engine | PlanarEngine | None) -> float:
    try:
        return assess_stability(gait, engine=engine).radius
    except InputError:
        return math.inf


def _closed_loop_gait(
    gait: AnyGait, family: ControllerFamily, best: Trial, engine: Engine | PlanarEngine | None
) -> tuple[Law | PlanarLaw | None, Cycle | PlanarCycle | None]:
    """Return the law of the best gains and its periodic gait, each None if it does not exist."""
    try:
        law = family.law(best.gains)
    except InputError:
        return None, None
    try:
        return law, assess_stability(gait, law, engine=engine)
    except InputError:
        return law, None


def _verify_tuning(
    gait: AnyGait,
    law: Law | PlanarLaw | None,
    cycle: Cycle | PlanarCycle | None,
    test: PushTest,
    engine: Engine | PlanarEngine | None,
    watch: tuple[TuningObserver, InterruptRecord],
) -> Recovery:
    if law is None or cycle is None:
        return Recovery(radius=0.0, starts=test.starts, returned=0, steps=test.steps, tolerance=test.tolerance)
    return find_largest_recovery(walker_near(gait, law, cycle, engine), cycle, test, *watch)
