"""Segments and jumps from states: everything that follows from (t, q, v, torque) by the robot's own Functions."""

import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Jump, Motion, Segment


def make_segment(
    robot: Robot,
    p: Array,
    *,
    mode: Mode,
    step: int,
    time: Array,
    q: Array,
    v: Array,
    torque: Array,
    work: Array,
    friction_work: Array,
) -> Segment:
    """Return a segment with forces, powers, energies and drawn points filled in.

    Parameters
    ----------
    robot : Robot
    p : (n_p,) array
        Parameter vector.
    mode : Mode
    step : int
    time : (K,) array [s]
    q, v : (n_q, K) arrays
    torque : (n_u, K) array [N m]
    work : (n_u, K) array [J]
    friction_work : (K,) array [J]
    """
    count, n_points = time.size, len(robot.points)
    tiled = np.tile(p[:, None], (1, count))
    _, force = robot.acceleration[mode].map(count)(q, v, torque, tiled)
    kinetic, potential = robot.energy.map(count)(q, v, tiled)
    rates = np.asarray(robot.joint_rates.map(count)(q, v, tiled)).reshape(robot.n_u, count)
    points = np.asarray(robot.figure.map(count)(q, tiled)).reshape(2, count, n_points)
    return Segment(
        mode=mode,
        step=step,
        time=time,
        q=q,
        v=v,
        torque=torque,
        force=np.asarray(force),
        power=torque * rates,
        work=work,
        friction_work=friction_work,
        kinetic=np.asarray(kinetic).ravel(),
        potential=np.asarray(potential).ravel(),
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


def make_jump(
    robot: Robot,
    p: Array,
    *,
    step: int,
    time: float,
    mode: Mode,
    impulse: Array,
    q: Array,
    v_minus: Array,
    v_plus: Array,
) -> Jump:
    """Return a touchdown with the swapped state and the energy lost.

    Parameters
    ----------
    q, v_minus, v_plus : (n_q,) arrays
        In the coordinates of the step that ends.
    """
    q_next, v_next = (np.asarray(part).ravel() for part in robot.swap(q, v_plus, p))
    before, after = (float(robot.energy(q, v, p)[0]) for v in (v_minus, v_plus))
    return Jump(
        step=step,
        time=time,
        mode=mode,
        impulse=impulse,
        q=q,
        v_minus=v_minus,
        v_plus=v_plus,
        q_next=q_next,
        v_next=v_next,
        energy_lost=before - after,
        separation=float(v_plus[1]),
    )


def make_motion(
    robot: Robot, values: dict[str, float], segments: tuple[Segment, ...], jumps: tuple[Jump, ...]
) -> Motion:
    """Return a motion of a robot with the given parameter values."""
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
