"""Motions from samples of coordinates, rates and torques: references and guesses that obey no equation of motion."""

from collections.abc import Mapping, Sequence

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Motion
from gaitopt.motion.sampling import SegmentSamples, TouchdownState, make_jump, make_motion, make_segment


@dataclass(frozen=True, eq=False, kw_only=True)
class PhaseKinematics:
    """Samples of a phase at K instants.

    Attributes
    ----------
    mode : Mode
    time : (K,) array [s]
    q, v : (n_q, K) arrays
        Stance foot (x, y) [m] and angles [rad]; their rates.
    torque : (n_u, K) array [N m]
    """

    mode: Mode
    time: Array
    q: Array
    v: Array
    torque: Array


def make_kinematic_motion(
    robot: Robot, parameters: Mapping[str, float], phases: Sequence[PhaseKinematics], *, impact: Mode = Mode.STICK
) -> Motion:
    """Return one step of a robot from samples; its touchdown has no impulse.

    The forces are those of the equations of motion for the sampled states and torques, the energies those of the
    states.  Works are integrals of the sampled powers.

    Parameters
    ----------
    robot : Robot
    parameters : mapping of str to float
        Parameters of robot and ground (SI units); missing ones have their default values.
    phases : sequence of PhaseKinematics
    impact : Mode
        Contact mode of the landing foot after the touchdown.

    Returns
    -------
    Motion
    """
    values = robot.resolve(parameters)
    p = robot.vector(values)
    segments = []
    for phase in phases:
        rates = np.asarray(
            robot.joint_rates.map(phase.time.size)(phase.q, phase.v, np.tile(p[:, None], phase.time.size))
        )
        power = phase.torque * rates.reshape(phase.torque.shape)
        steps = np.diff(phase.time) * (power[:, 1:] + power[:, :-1]) / 2
        samples = SegmentSamples(
            mode=phase.mode,
            step=0,
            time=phase.time,
            q=phase.q,
            v=phase.v,
            torque=phase.torque,
            work=np.hstack([np.zeros((robot.n_u, 1)), np.cumsum(steps, axis=1)]),
            friction_work=np.zeros(phase.time.size),
        )
        segments.append(make_segment(robot, p, samples))
    last = segments[-1]
    touchdown = TouchdownState(
        step=0,
        time=float(last.time[-1]),
        mode=impact,
        impulse=np.zeros(2),
        q=last.q[:, -1],
        v_minus=last.v[:, -1],
        v_plus=last.v[:, -1],
    )
    return make_motion(robot, values, tuple(segments), (make_jump(robot, p, touchdown),))
