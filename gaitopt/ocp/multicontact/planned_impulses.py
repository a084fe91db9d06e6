"""Impulses of actuators in a decision vector: their initial values, and the record of a plan."""

import itertools
from collections.abc import Sequence

import casadi as ca
import numpy as np

from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.planar.phase_system import contact_forces, group_sticking
from gaitopt.motion.actuator_impulses import MOMENTS, ActuatorImpulses, split_work
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_motion import PlanarEvent
from gaitopt.ocp.multicontact.phase_grid import GridPhase
from gaitopt.ocp.multicontact.planar_builder import STAGES, PlanarStructure, stage_modes
from gaitopt.ocp.multicontact.planar_transcription import PlanarTranscription

NEGLIGIBLE = 1e-7
"""Velocity jump [m/s or rad/s] up to which the impulses of actuators are those of the solver's tolerance, and zero."""


def set_impulse_start(transcription: PlanarTranscription, x: Array, events: Sequence[PlanarEvent] = ()) -> None:
    """Set the impulses of actuators, and the rates between them and an impact, in an initial point.

    Parameters
    ----------
    transcription : PlanarTranscription
    x : (n_variables,) array
        Initial point, in which the rates at the nodes are known.
    events : sequence of PlanarEvent
        Events of a similar gait, one for each phase; without them the impulses are zero.
    """
    structure, n_q = transcription.structure, transcription.structure.robot.n_q
    for phase, moment in itertools.product(transcription.phases, MOMENTS):
        entries = structure.list_impulses(phase.number, moment)
        if not entries:
            continue
        column = transcription.variables[STAGES[moment], phase.number][:, 0]
        x[column[-n_q:]] = x[transcription.builder.velocities(phase)[:, -1]]
        known = events[phase.number].actuator_impulses if len(events) == len(transcription.phases) else ()
        for stage in known:
            if stage.moment == moment:
                x[column[: len(entries)]] = stage.impulse[[entry.actuator for entry in entries]]
                x[column[-n_q:]] = stage.v_plus if moment == "before" else stage.v_minus


def read_planned_impulses(
    transcription: PlanarTranscription, phase: GridPhase, x: Array, state: tuple[Array, Array, Array, Array]
) -> tuple[ActuatorImpulses, ...]:
    """Return the impulses of actuators at the event that ends a phase.

    Parameters
    ----------
    transcription : PlanarTranscription
    phase : GridPhase
    x : (n_variables,) array
        Decision vector.
    state : (q, v before, v after, p)
        At the event, in the names of the phase.
    """
    (q, before, after, p), structure = state, transcription.structure
    robot, stages = structure.robot, list[ActuatorImpulses]()
    for moment in MOMENTS:
        entries = structure.list_impulses(phase.number, moment)
        if not entries:
            continue
        column = x[transcription.variables[STAGES[moment], phase.number][:, 0]]
        ends = (before, column[-robot.n_q :]) if moment == "before" else (column[-robot.n_q :], after)
        impulse = np.zeros(robot.n_u)
        if np.max(np.abs(ends[1] - ends[0])) > NEGLIGIBLE:
            impulse[[entry.actuator for entry in entries]] = column[: len(entries)]
        skipped = len(entries) + len(structure.split_impulses(phase.number, moment))
        modes = stage_modes(phase, moment)
        generated, absorbed = split_work(
            impulse, *(np.array(robot.joint_rates(q, v, p)).reshape(robot.n_u) for v in ends)
        )
        stages.append(
            ActuatorImpulses(
                moment=moment,
                impulse=impulse,
                reaction=_read_reactions(structure, modes, column[skipped : -robot.n_q], p),
                outcome=ContactState(tuple(zip(robot.contact_names, modes, strict=True))),
                v_minus=ends[0],
                v_plus=ends[1],
                generated=generated,
                absorbed=absorbed,
            )
        )
    return tuple(stages)


def _read_reactions(structure: PlanarStructure, modes: list[Mode], values: Array, p: Array) -> Array:
    """Return the impulse (Lambda_t, Lambda_n) of each contact, shape (n_c, 2); sticking contacts of a body share it."""
    robot, closed = structure.robot, tuple(i for i, mode in enumerate(modes) if mode is not Mode.FREE)
    sticking = group_sticking(robot, modes)
    column = ca.DM(np.concatenate([np.zeros(robot.n_q), values]))
    finite = ca.DM(np.where(np.isinf(p), 1.0, p))
    reactions = np.array(ca.evalf(contact_forces(robot, modes, closed, sticking, ca.SX(column), ca.SX(finite)))).T
    for members in sticking:
        if len(members) > 1:
            normal, total = reactions[list(members), 1], reactions[list(members), 1].sum()
            share = normal / total if total > 0 else np.full(len(members), 1 / len(members))
            reactions[list(members), 0] = reactions[members[0], 0] * share
    return reactions
