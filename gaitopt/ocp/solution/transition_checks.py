"""Checks of a plan against the rules of the simulator: starts of slip from rest, and the outcome of the impact."""

import numpy as np

from gaitopt.model.contacts.impact import solve_impact
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Jump, Motion
from gaitopt.ocp.transcription.grid import Phase


def report_inconsistent_transitions(robot: Robot, phases: tuple[Phase, ...], motion: Motion) -> tuple[str, ...]:
    """Return a sentence for each transition of a plan at which the simulator would select another mode.

    The start of a sticking phase and the onset of slip after it are not included, since the forces are compared with
    the friction cone over the whole phase.

    Parameters
    ----------
    robot : Robot
    phases : tuple of Phase
    motion : Motion
        The planned step, a segment per phase and one jump.
    """
    p = robot.vector(motion.parameters)
    sentences = []
    for phase, segment in zip(phases, motion.segments, strict=True):
        if not _starts_from_rest(phase):
            continue
        state = segment.q[:, 0], segment.v[:, 0], segment.torque[:, 0]
        tangential, normal = np.asarray(robot.acceleration[Mode.STICK](*state, p)[1]).ravel()
        outside = not abs(tangential) <= motion.static_friction * normal
        if not (outside and Mode.slipping(-tangential) is phase.mode):
            sentences.append(
                f"the foot does not start to slide at the start of {phase.place().label}: the sticking force is not "
                f"outside the friction cone in the direction that starts this slip."
            )
    return (*sentences, *_report_impact(robot, motion.jumps[0], p))


def _starts_from_rest(phase: Phase) -> bool:
    """Return whether a slip starts from rest without a sticking phase before it."""
    return phase.mode.slips and phase.starts_at_rest and (phase.number == 0 or phase.previous.slips)


def _report_impact(robot: Robot, jump: Jump, p: np.ndarray) -> tuple[str, ...]:
    impact = solve_impact(robot, jump.q, jump.v_minus, p)
    if impact.mode is not jump.mode:
        outcome = "has no consistent outcome" if impact.mode is None else f"ends in {impact.mode.value}"
        return (f"the impact {outcome}, but {jump.mode.value} is planned: use a larger Margins.impact_cone.",)
    if not impact.separation >= 0:
        return ("the trailing foot does not separate at the impact: use a larger Margins.separation.",)
    return ()
