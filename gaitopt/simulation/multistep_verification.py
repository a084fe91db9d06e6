"""verify_steps: replay the torques of a gait of several steps, and compare the motions."""

from dataclasses import replace

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import feedforward
from gaitopt.model.coordinate_entries import ANGLES
from gaitopt.motion.energy import cost_of_transport, ledger
from gaitopt.motion.gait import Verification, cone_margin
from gaitopt.motion.motion import Motion
from gaitopt.ocp.multistep.multistep_gait import MultiStepGait, join_steps
from gaitopt.ocp.multistep.terrain_check import describe_contradictions
from gaitopt.reductions import worst
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.replay_tolerances import Tolerances
from gaitopt.simulation.scipy_engine import ScipyEngine
from gaitopt.simulation.simulator import Rollout, record_walk
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.status import Status, Stop


@check_arguments
def replay_steps(gait: MultiStepGait, *, engine: Engine | None = None, stepwise: bool = False) -> Rollout:
    """Replay the torques of a gait of several steps in open loop, from its first state in the event-driven simulator.

    Each step begins in the state in which the simulation of the step before ended, or with `stepwise` in its planned
    state, on its own ground; the torque clock is reset at every touchdown.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, compass_biped
    >>> from gaitopt.ocp import MultiStepProblem, solve_steps
    >>> step = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.3, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared")
    >>> replay_steps(solve_steps(MultiStepProblem(steps=(step, step)))).stop.key
    'steps_done'
    """
    robot, engine = gait.problem.robot, engine or ScipyEngine()
    grounds = [
        {**step.values, **{name: plan.parameters[name] for name in step.free}}
        for step, plan in zip(gait.problem.resolved_steps, gait.plans, strict=True)
    ]
    frictions = [*(ground["friction"] for ground in grounds), gait.problem.last_friction]
    first = gait.plans[0].segments[0]
    state = np.concatenate([first.q[:, 0], first.v[:, 0]])
    walks: list[Rollout] = []
    for number, plan in enumerate(gait.plans):
        if stepwise:
            state = np.concatenate([plan.segments[0].q[:, 0], plan.segments[0].v[:, 0]])
        walker = Walker(
            robot,
            feedforward(robot, plan),
            robot.vector(grounds[number]),
            engine,
            step_limits=StepLimits(duration=3 * plan.period),
            landing=robot.vector({**grounds[number], "friction": frictions[number + 1]}),
        )
        walks.append(record_walk(walker, state, 1))
        jumps = walks[-1].motion.jumps
        if walks[-1].stop is not Stop.STEPS_DONE or not jumps:
            break
        state = np.concatenate([jumps[0].q_next, jumps[0].v_next])
    motion = join_steps([walk.motion for walk in walks], absolute=not stepwise, terrain=gait.problem.terrain)
    return replace(walks[-1], motion=motion, events=tuple(event for walk in walks for event in walk.events))


@check_arguments
def verify_steps(
    gait: MultiStepGait,
    *,
    tolerances: Tolerances | None = None,
    engine: Engine | None = None,
    stepwise: bool = False,
) -> MultiStepGait:
    """Replay a gait of several steps and attach the result of the comparison.

    The simulator receives only the first state and the torques: it determines contact modes, event times and the
    outcomes of the impacts.  With `stepwise` it receives the first state of every step, for walkers that magnify
    errors too much within several steps.  The status is ``NOT_VERIFIED`` if the verification fails.

    Examples
    --------
    >>> from gaitopt import GaitProblem, Limits, compass_biped
    >>> from gaitopt.ocp import MultiStepProblem, solve_steps
    >>> step = GaitProblem(
    ...     robot=compass_biped(), sequence="stick | stick", friction=0.3, speed=0.6, step_length=0.45,
    ...     limits=Limits(torque=6), objective="torque_squared")
    >>> verify_steps(solve_steps(MultiStepProblem(steps=(step, step)))).verification.passed
    True
    """
    rollout = replay_steps(gait, engine=engine, stepwise=stepwise)
    tolerances = tolerances or Tolerances(state=1e-5)
    walked, planned = rollout.motion, gait.motion
    reasons = []
    if rollout.stop is not Stop.STEPS_DONE:
        reasons.append(f"the replay stopped: {rollout.stop.hint}")
    texts = [_describe(motion) for motion in (planned, walked)]
    if texts[0] != texts[1]:
        reasons.append(f"the replay has the contact sequence '{texts[1]}' instead of '{texts[0]}'")
    if gait.problem.terrain is not None:
        reasons += describe_contradictions(gait.problem, walked)
    complete = len(walked.jumps) == len(planned.jumps)
    error = _state_error(planned, walked) if complete else float("inf")
    late = abs(walked.segments[-1].time[-1] - planned.segments[-1].time[-1])
    residual = _energy_residual(walked) if stepwise else ledger(walked).relative_residual
    checks = [
        ("state after touchdown", error, tolerances.state),
        ("duration", late, len(gait.plans) * tolerances.period),
        ("energy ledger", residual, tolerances.energy),
    ]
    for name, value, allowed in checks:
        if complete and not value <= allowed:
            reasons.append(f"{name} deviates by {value:.1e}, allowed {allowed:.0e}")
    verification = Verification(
        passed=not reasons,
        sequence=texts[1],
        stop=rollout.stop.key,
        state_error=error,
        period_error=float(late),
        cost_of_transport=cost_of_transport(walked) if walked.jumps else float("nan"),
        cone_margin=cone_margin(walked),
        energy_residual=residual,
        reasons=tuple(reasons),
    )
    failed = gait.status.ok and not verification.passed
    return gait.replace_fields(verification=verification, status=Status.NOT_VERIFIED if failed else gait.status)


def _describe(motion: Motion) -> str:
    """Return the modes of the phases and of the impacts of a motion, step by step."""
    steps = []
    for number in range(motion.segments[-1].step + 1):
        modes = [segment.mode.value for segment in motion.segments if segment.step == number]
        impacts = [jump.mode.value for jump in motion.jumps if jump.step == number]
        steps.append(" ".join(modes) + " | " + " ".join(impacts))
    return "; ".join(steps)


def _energy_residual(motion: Motion) -> float:
    """Return the largest relative residual of the energy balances of steps that are replayed one by one."""
    parts = [
        replace(
            motion,
            segments=tuple(segment for segment in motion.segments if segment.step == number),
            jumps=tuple(jump for jump in motion.jumps if jump.step == number),
        )
        for number in range(motion.segments[-1].step + 1)
    ]
    return worst(*(ledger(part).relative_residual for part in parts))


def _state_error(planned: Motion, walked: Motion) -> float:
    """Return the largest difference of the states after the touchdowns: angles, rates and foot speed."""
    errors = [
        worst(np.abs(plan.q_next[ANGLES] - real.q_next[ANGLES]), np.abs(plan.v_next - real.v_next))
        for plan, real in zip(planned.jumps, walked.jumps, strict=True)
    ]
    return worst(*errors)
