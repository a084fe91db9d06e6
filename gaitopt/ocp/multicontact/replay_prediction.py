"""Prediction of the replay of a plan: its open-loop integration, with the first-order change of each event time."""

import numpy as np

from gaitopt.model.contacts.transition import saltation
from gaitopt.model.planar.impact_system import contact_slopes, impact_slope
from gaitopt.motion.motion import Array
from gaitopt.ocp.multicontact.phase_grid import GridPhase
from gaitopt.ocp.multicontact.planar_plan import STEPS, build_step
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.reductions import worst


def predict_replay_error(transcription: PlanarTranscription, values: dict[str, float], x: Array) -> float:
    """Return the largest difference of the state after the last event of a replay from the planned one.

    The errors of the intervals are magnified by the motion and by its impacts.  nan with impulses of actuators, whose
    effect is not predicted, or if the equations of motion have no unique solution.

    Parameters
    ----------
    transcription : PlanarTranscription
    values : dict
        Every parameter by name.
    x : (n_variables,) array
        Decision vector.
    """
    if transcription.structure.impulses:
        return float("nan")
    p = transcription.structure.robot.vector(values)
    finite = np.where(np.isinf(p), 1.0, p)  # no force contains an infinite coefficient of friction
    deviation = np.zeros(2 * transcription.structure.robot.n_q)
    for phase in transcription.phases:
        try:
            deviation = _integrate_phase(transcription, phase, x, finite, deviation)
        except RuntimeError:  # the linear system of CasADi is singular
            return float("nan")
        deviation = _event_slope(transcription, phase, x, finite) @ deviation
    return float(worst(0.0, np.abs(deviation)))


def _integrate_phase(
    transcription: PlanarTranscription, phase: GridPhase, x: Array, p: Array, deviation: Array
) -> Array:
    """Return the deviation from the plan at the end of a phase, (2 n_q,), from the one at its start."""
    builder = transcription.builder
    q, v, u = (x[part(phase)] for part in (builder.coordinates, builder.velocities, builder.torques))
    h = float(x[transcription.variables[Unknown.DURATION][0, phase.number]]) / phase.count / STEPS
    step, y = build_step(phase.system), np.concatenate([q[:, 0], v[:, 0]]) + deviation
    for k in range(phase.count):
        for part in range(STEPS):
            ends = (u[:, k] + share / STEPS * (u[:, k + 1] - u[:, k]) for share in (part, part + 1))
            y = np.array(step(y, *ends, h, p)).ravel()
    return y - np.concatenate([q[:, -1], v[:, -1]])


def _event_slope(transcription: PlanarTranscription, phase: GridPhase, x: Array, p: Array) -> Array:
    """Return the derivative of the state after the event of a phase by the one before it, shape (2 n_q, 2 n_q).

    At lift-off and slip onset the accelerations are continuous, so that the state has the derivative 1.
    """
    robot, builder, n = transcription.structure.robot, transcription.builder, transcription.structure.robot.n_q
    q, v = x[builder.coordinates(phase)[:, -1]], x[builder.velocities(phase)[:, -1]]
    reset, (gaps, _, slips) = np.eye(2 * n), (np.array(part) for part in contact_slopes(robot)(q, v, p))
    resting = [i for i in range(len(phase.state)) if phase.state[i].slips and phase.comes_to_rest(i)]
    if phase.outcome is None and not resting:
        return reset
    if phase.outcome is None:
        gradient = slips[resting[0]]
    else:
        outcome = transcription.structure.sequence.outcome(robot, phase.number)
        by_q, by_v = (np.array(part) for part in impact_slope(robot, outcome)(q, v, np.zeros(robot.n_u), p)[1:])
        reset[n:] = np.hstack([by_q, by_v])
        gradient = gaps[phase.closing()[0]]
    before = np.concatenate([v, x[transcription.variables[Unknown.ACCELERATION, phase.number]][:n, -1]])
    after = np.zeros(2 * n)  # the comparison is at the last event
    if not phase.is_last:
        following = transcription.phases[phase.number + 1]
        table = transcription.variables[Unknown.ACCELERATION, following.number]
        after = np.concatenate([x[builder.velocities(following)[:, 0]], x[table][:n, 0]])
    return saltation(reset, before, after, -gradient / (gradient @ before))
