"""Segments and jumps from states: the quantities that the Functions of the robot return for (t, q, v, torque)."""

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.locks import one_at_a_time
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.coordinate_entries import GAP
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Jump, Motion, Segment


@dataclass(frozen=True, eq=False, kw_only=True)
class SegmentSamples:
    """Samples of a segment, from which its other quantities follow.

    Attributes
    ----------
    mode : Mode
    step : int
        Number of its step, from 0.
    time : (K,) array [s]
    q, v : (n_q, K) arrays
        Stance foot (x, y) [m] and angles [rad]; their rates.
    torque : (n_u, K) array [N m]
    work : (n_u, K) array [J]
        Work of each actuator since the start of the segment, signed.
    friction_work : (K,) array [J]
        Energy dissipated by sliding since the start of the segment.
    damping_work : (K,) array, optional [J]
        Energy dissipated by dampers since the start of the segment; zero by default.
    positive_work : (n_u, K) array, optional [J]
        Work of each actuator while its power is positive, since the start of the segment.
    """

    mode: Mode
    step: int
    time: Array
    q: Array
    v: Array
    torque: Array
    work: Array
    friction_work: Array
    damping_work: Array | None = None
    positive_work: Array | None = None


@dataclass(frozen=True, eq=False, kw_only=True)
class TouchdownState:
    """The impact of a touchdown, from which its other quantities follow.

    Attributes
    ----------
    step : int
        Number of the step that it ends, from 0.
    time : float [s]
    mode : Mode
        Contact mode of the landing foot after the impact.
    impulse : (2,) array [N s]
    q, v_minus, v_plus : (n_q,) arrays
        Configuration, and rates before and after, in the coordinates of the step that ends.
    """

    step: int
    time: float
    mode: Mode
    impulse: Array
    q: Array
    v_minus: Array
    v_plus: Array


@one_at_a_time
def make_segment(robot: Robot, p: Array, samples: SegmentSamples) -> Segment:
    """Return a segment with the forces, powers, energies and drawn points of its samples.

    Parameters
    ----------
    robot : Robot
    p : (n_p,) array
        Parameter vector.
    samples : SegmentSamples
    """
    count, n_points = samples.time.size, len(robot.points)
    q, v, torque = samples.q, samples.v, samples.torque
    tiled = np.tile(p[:, None], (1, count))
    _, force = robot.acceleration[samples.mode].map(count)(q, v, torque, tiled)
    kinetic, potential = robot.energy.map(count)(q, v, tiled)
    rates = np.asarray(robot.joint_rates.map(count)(q, v, tiled)).reshape(robot.n_u, count)
    elastic = robot.force_powers.map(count)(q, v, tiled)[0] if robot.has_springs else np.zeros(count)
    points = np.asarray(robot.figure.map(count)(q, tiled)).reshape(2, count, n_points)
    return Segment(
        **{name: value for name, value in vars(samples).items() if name != "damping_work"},
        damping_work=np.zeros(count) if samples.damping_work is None else samples.damping_work,
        force=np.asarray(force),
        power=torque * rates,
        kinetic=np.asarray(kinetic).ravel(),
        potential=np.asarray(potential).ravel(),
        elastic=np.asarray(elastic).ravel(),
        points=np.swapaxes(points, 1, 2),
        rims=_sample_rims(robot, q, tiled),
    )


def _sample_rims(robot: Robot, q: Array, tiled: Array) -> Array | None:
    """Return the rims of round feet, shape (4, 2, K), or None for point feet."""
    count = q.shape[1]
    if not np.any(robot.rims(q[:, 0], tiled[:, 0]).full()[2]):  # one sample is enough: radii are constant
        return None
    rims = np.asarray(robot.rims.map(count)(q, tiled)).reshape(4, count, 2)
    return np.swapaxes(rims, 1, 2)


def make_jump(robot: Robot, p: Array, touchdown: TouchdownState) -> Jump:
    """Return a touchdown with the state after the leg exchange and the energy lost.

    Parameters
    ----------
    robot : Robot
    p : (n_p,) array
        Parameter vector.
    touchdown : TouchdownState
    """
    q, v_minus, v_plus = touchdown.q, touchdown.v_minus, touchdown.v_plus
    q_next, v_next = (np.asarray(part).ravel() for part in robot.swap(q, v_plus, p))
    before, after = (float(robot.energy(q, v, p)[0]) for v in (v_minus, v_plus))
    return Jump(
        **vars(touchdown),
        q_next=q_next,
        v_next=v_next,
        energy_lost=before - after,
        separation=float(v_plus[GAP]),
    )


def make_motion(
    robot: Robot, values: dict[str, float], segments: tuple[Segment, ...], jumps: tuple[Jump, ...]
) -> Motion:
    """Return a motion of a robot with these parameter values."""
    return Motion(
        angles=robot.angles,
        actuators=robot.actuators,
        points=robot.points,
        links=robot.links,
        total_mass=float(robot.mass(robot.vector(values))),
        parameters=dict(values),
        segments=segments,
        jumps=jumps,
    )
