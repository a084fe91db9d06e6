"""verify: replay a gait's torques without access to the plan, and compare the motions."""

from typing import overload

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import feedforward
from gaitopt.model.coordinate_entries import ANGLES, CONTACT, GAP
from gaitopt.model.ground_frame import NEXT_INCLINE, place_on_plane
from gaitopt.model.robot import Robot
from gaitopt.motion.energy import cost_of_transport, ledger
from gaitopt.motion.gait import Gait, Verification, check_gait, cone_margin
from gaitopt.motion.motion import Motion
from gaitopt.motion.planar_gait import PlanarGait
from gaitopt.reductions import worst
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.replay_advice import BEGINNING, advise_on_replay
from gaitopt.simulation.replay_tolerances import Tolerances
from gaitopt.simulation.scipy_engine import ScipyEngine
from gaitopt.simulation.simulator import Rollout, simulate
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.status import Stop

FINEST = ScipyEngine(relative=2.3e-14, absolute=1e-16)
"""The reference engine at the limit of double precision, about 1e3 times the accuracy of its default."""

EXCHANGE_TOLERANCE = 1e-6
"""Largest change by the leg exchange of energy, relative to the kinetic energy, and of the foot position [m]."""


@check_arguments
def replay(gait: Gait, *, steps: int = 1, engine: Engine | None = None) -> Rollout:
    """Replay a gait's torques in open loop from its first state in the event-driven simulator.

    Parameters
    ----------
    gait : Gait
    steps : int
        The torque clock is reset at every touchdown.
    engine : Engine, optional
        By default the reference engine, :class:`gaitopt.ScipyEngine`.

    Examples
    --------
    >>> from gaitopt import load
    >>> replay(load("docs/examples/compass_slip.h5")).stop.key
    'steps_done'
    """
    check_gait(gait)
    robot, first = gait.robot, gait.motion.segments[0]
    return simulate(
        robot,
        first.q[:, 0],
        first.v[:, 0],
        gait.motion.parameters,
        law=feedforward(robot, gait.motion),
        steps=steps,
        step_limits=StepLimits(duration=3 * gait.period),
        engine=engine or ScipyEngine(),
    )


@check_arguments
@overload
def verify(gait: Gait, *, tolerances: Tolerances | None = None, engine: Engine | None = None) -> Gait: ...


@check_arguments
@overload
def verify(gait: PlanarGait, *, tolerances: Tolerances | None = None, engine: Engine | None = None) -> PlanarGait: ...


@check_arguments
def verify(
    gait: Gait | PlanarGait, *, tolerances: Tolerances | None = None, engine: Engine | None = None
) -> Gait | PlanarGait:
    """Replay a gait and attach the result of the comparison.

    The simulator receives only the first state and the torques as functions of time: it determines contact modes, event
    times and the outcome of the impact with another integrator and adaptive steps.  At touchdown the landing foot must
    come from above and become the stance foot, and the leg exchange must conserve kinetic and potential energy.

    Some steps magnify errors at their start by more than 1e8, errors of the integrator included.  A gait that fails is
    therefore replayed once more at the limit of double precision, and that replay decides.

    Parameters
    ----------
    gait : Gait or PlanarGait
    tolerances : Tolerances, optional
    engine : Engine, optional
        By default the reference engine, :class:`gaitopt.ScipyEngine`; with another one the gait is replayed once.  A
        planar robot has only the reference engine.

    Returns
    -------
    Gait or PlanarGait
        The gait with its `verification`; its status is ``NOT_VERIFIED`` if the verification fails.  A gait whose plan
        is not accurate enough, or too close to another contact mode, then has a warning with the remedy.

    Raises
    ------
    InputError
        If the gait was read from an older file that contains only the name of its robot, and the robot is not in the
        catalogue.

    Examples
    --------
    >>> from gaitopt import load, verify
    >>> verify(load("docs/examples/compass_slip.h5")).verification.passed
    True
    """
    if isinstance(gait, PlanarGait):
        from gaitopt.simulation.planar_verification import verify_planar

        return verify_planar(gait, tolerances=tolerances)
    tolerances = tolerances or Tolerances()
    rollout = replay(gait, engine=engine)
    verification = _compare(gait, rollout, tolerances)
    if not verification.passed and engine is None:
        rollout = replay(gait, engine=FINEST)
        verification = _compare(gait, rollout, tolerances)
    is_advised = gait.verification is not None and not gait.verification.passed
    gait = gait.with_verification(verification)
    if verification.passed and not is_advised:
        return gait  # without the evaluation of its warnings
    others = [warning for warning in gait.solver.warnings if not warning.startswith(BEGINNING)]
    is_wrong_robot = bool(_check_exchange(gait.robot, rollout.motion))  # which no setting of the problem remedies
    advice = "" if is_wrong_robot else advise_on_replay(gait, verification)
    report = gait.solver.replace_fields(warnings=(*others, *filter(None, [advice])))
    return gait.replace_fields(solver=report)


def _compare(gait: Gait, rollout: Rollout, tolerances: Tolerances) -> Verification:
    walked, planned = rollout.motion, gait.motion
    reasons = []
    sequence = walked.sequence()
    replayed_sequence = (
        str(sequence) if sequence is not None else " ".join(segment.mode.value for segment in walked.segments)
    )
    if rollout.stop is not Stop.STEPS_DONE:
        time = walked.segments[-1].time[-1] if walked.segments else 0.0
        reasons.append(f"the replay stopped at {time:.4g} s: {rollout.stop.hint}")
    if walked.segments and replayed_sequence != str(gait.sequence):
        reasons.append(f"the replay has the contact sequence '{replayed_sequence}' instead of '{gait.sequence}'")
    state_error = _state_error(planned, walked)
    period_error, cost, residual = abs(walked.period - planned.period), float("nan"), ledger(walked).relative_residual
    if walked.jumps:
        cost = cost_of_transport(walked)
    checks = [
        ("state after touchdown", state_error, tolerances.state, ""),
        ("period", period_error, tolerances.period, " s"),
        (
            "cost of transport",
            abs(cost - gait.cost_of_transport) / max(gait.cost_of_transport, 1e-12),
            tolerances.cost_of_transport,
            "",
        ),
        ("energy ledger", residual, tolerances.energy, ""),
    ]
    for name, error, allowed, unit in checks:
        if not error <= allowed and walked.jumps:
            reasons.append(f"{name} deviates by {error:.1e}{unit}, allowed {allowed:.0e}")
    reasons += _check_exchange(gait.robot, walked)
    return Verification(
        passed=not reasons,
        sequence=replayed_sequence,
        stop=rollout.stop.key,
        state_error=state_error,
        period_error=period_error,
        cost_of_transport=cost,
        cone_margin=cone_margin(walked),
        energy_residual=residual,
        reasons=tuple(reasons),
    )


def _check_exchange(robot: Robot, walked: Motion) -> list[str]:
    """Return the violations of a repeatable touchdown in a motion, one sentence each.

    The landing foot must approach the ground from above and become the stance foot, and the leg exchange, which only
    renames coordinates, must conserve kinetic and potential energy.
    """
    p, faults = robot.vector(walked.parameters), []
    for jump in walked.jumps:
        place = np.asarray(robot.landing(jump.q, jump.v_minus, p)[0]).ravel()
        velocity = np.asarray(robot.collision(jump.q, jump.v_minus, p)[0]).ravel()
        if not velocity[GAP] < 0:
            faults.append(
                "the landing foot does not approach the ground from above: its normal velocity is "
                f"{velocity[GAP]:.3g} m/s"
            )
        foothold = place_on_plane(jump.q_next[CONTACT], walked.parameters, NEXT_INCLINE)
        distance = float(np.linalg.norm(foothold - place))
        if not distance <= EXCHANGE_TOLERANCE:
            faults.append(f"the landing foot does not become the stance foot: they are {distance:.3g} m apart")
        before, after = (
            [float(part) for part in robot.energy(*state, p)]
            for state in ((jump.q, jump.v_plus), (jump.q_next, jump.v_next))
        )
        for name, old, new in zip(("kinetic", "potential"), before, after, strict=True):
            if not abs(new - old) <= EXCHANGE_TOLERANCE * before[0]:
                faults.append(f"the leg exchange changes the {name} energy by {new - old:.3g} J")
    return faults


def _state_error(planned: Motion, walked: Motion) -> float:
    """Return the largest difference of the states after the touchdown: angles, rates and foot speed."""
    if not walked.jumps:
        return float("inf")
    plan, real = planned.jumps[0], walked.jumps[0]
    return worst(np.abs(plan.q_next[ANGLES] - real.q_next[ANGLES]), np.abs(plan.v_next - real.v_next))
