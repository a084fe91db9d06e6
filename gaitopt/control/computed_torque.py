"""Computed torque: the torque that gives the angles the accelerations asked for, whether the foot sticks or slides."""

from collections.abc import Mapping

import casadi as ca
import numpy as np

from gaitopt.control.law import Law
from gaitopt.control.limits import limited, torque_limits
from gaitopt.control.reference import Reference, reference
from gaitopt.errors import InputError
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array, Motion


def computed_torque(
    robot: Robot,
    motion: Motion,
    *,
    stiffness: float = 0.0,
    damping: float = 0.0,
    torque_limit: float | Mapping[str, float] = np.inf,
) -> Law:
    """Return the law that makes the angles' errors obey e'' + damping e' + stiffness e = 0, within torque limits.

    A sticking foot rests, so the torques follow from the angles' own rows of the equations of motion.  A sliding foot
    is not driven: its acceleration a_x follows from those asked of the angles and from friction, s mu f_n against it,

        (M_xx + s mu M_yx) a_x + (M_xa + s mu M_ya) a_a + h_x + s mu h_y = 0,

    and enters the angles' rows, E u = M_ax a_x + M_aa a_a + h_a.  The law must know whether the foot slides.  Where it
    sticks or slides at another time than planned, it asks for the acceleration planned nearest in time in that mode
    (reference spreading; Rijnen, Saccon & Nijmeijer 2015), so that the error of a late event stays small.

    Parameters
    ----------
    robot : Robot
        With as many actuators as angles.
    motion : Motion
        Its first step is the reference; its parameters, friction included, are what the law believes.
    stiffness : float [1/s^2]
    damping : float [1/s]
        Of all angles; ``Law.with_gains`` sets those of one, named such as ``"th2_stiffness"``.
    torque_limit : float or mapping of actuator to float [N m]

    Raises
    ------
    InputError
        If the robot has fewer actuators than angles, or the motion belongs to another robot.

    Examples
    --------
    >>> from gaitopt import compass_biped, computed_torque, load
    >>> law = computed_torque(compass_biped(), load("docs/examples/compass_slip.h5").motion, stiffness=16, damping=8)
    >>> list(law.gain_values)
    ['th1_stiffness', 'th2_stiffness', 'th1_damping', 'th2_damping']
    """
    n_a = len(robot.angles)
    if robot.n_u != n_a:
        raise InputError(f"Computed torque needs an actuator for each angle; {robot!r} has {robot.n_u} for {n_a}.")
    plan, believed = reference(robot, motion), robot.vector(motion.parameters)
    if np.isinf(believed[_place_of_friction(robot)]):
        believed[_place_of_friction(robot)] = 0.0  # no foot will slide
    spread = _spread(plan)
    sizes = [plan.size, spread.shape[0], 2 * n_a, believed.size]
    clock, q, v = ca.SX.sym("clock"), ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q)
    data, held, slide = ca.SX.sym("data", sum(sizes)), ca.SX.sym("held", 0), ca.SX.sym("slide")
    _, rows, gains, p = ca.vertsplit(data, np.cumsum([0, *sizes]).tolist())
    desired = plan.desired(clock, data)
    planned = _in_mode(rows, desired.accelerations, slide)
    asked = planned - gains[:n_a] * (q[2:] - desired.angles) - gains[n_a:] * (v[2:] - desired.rates)
    torque = ca.Function(
        "torque", [clock, q, v, data, held, slide], [ca.cse(_inverse_dynamics(robot, q, v, p, asked, slide))]
    )
    values = np.concatenate([np.full(n_a, float(stiffness)), np.full(n_a, float(damping)), believed])
    names = [f"{angle}_{kind}" for kind in ("stiffness", "damping") for angle in robot.angles]
    law = Law(
        "computed torque",
        torque,
        plan.breakpoints,
        np.vstack([plan.table, spread, np.tile(values[:, None], plan.breakpoints.size)]),
        {name: sizes[0] + sizes[1] + i for i, name in enumerate(names)},
    )
    return limited(law, torque_limits(robot, torque_limit))


def _inverse_dynamics(robot: Robot, q: ca.SX, v: ca.SX, p: ca.SX, asked: ca.SX, slide: ca.SX) -> ca.SX:
    """Return the torques that give the angles the accelerations asked for, the foot sliding with the sign `slide`."""
    mass, bias, actuation = robot.dynamics(q, v, p)
    lean = slide * p[_place_of_friction(robot)]
    row, load = mass[0, :] + lean * mass[1, :], bias[0] + lean * bias[1]
    foot = -(slide**2) * (row[2:] @ asked + load) / row[0]
    return ca.solve(actuation[2:, :], mass[2:, 0] * foot + mass[2:, 2:] @ asked + bias[2:])


def _place_of_friction(robot: Robot) -> int:
    return [parameter.name for parameter in robot.parameters].index("friction")


def _in_mode(rows: ca.SX, own: ca.SX, slide: ca.SX) -> ca.SX:
    """Return the accelerations planned for the mode the foot is in."""
    n_a = own.numel()
    choices = [rows[k * (n_a + 1)] * own + rows[k * (n_a + 1) + 1 : (k + 1) * (n_a + 1)] for k in range(3)]
    stick, forward, backward = choices
    return (1 - slide**2) * stick + slide * (slide + 1) / 2 * forward + slide * (slide - 1) / 2 * backward


def _spread(plan: Reference) -> Array:
    """Return, for sticking, slip+ and slip-, whether a piece has this mode, and else the accelerations to ask for.

    These are the ones of this mode planned nearest in time; the piece's own where no piece has this mode.
    """
    n_a, n_u = len(plan.robot.angles), plan.robot.n_u
    begins = plan.breakpoints
    ends = np.append(begins[1:], begins[-1])
    first = 1 + 2 * n_u
    curves = [np.polynomial.polynomial.polyder(plan.table[first + 6 * i : first + 6 * i + 6], 2) for i in range(n_a)]
    rows = []
    for mode in (0, 1, -1):
        having = np.flatnonzero(plan.modes[:-1] == mode)
        block = np.zeros((n_a + 1, begins.size))
        for k in range(begins.size):
            if plan.modes[k] == mode or not having.size:
                block[0, k] = 1.0
                continue
            near = having[np.argmin(np.minimum(np.abs(begins[having] - ends[k]), np.abs(ends[having] - begins[k])))]
            since = 0.0 if begins[near] >= ends[k] else ends[near] - begins[near]
            block[1:, k] = [np.polynomial.polynomial.polyval(since, curve[:, near]) for curve in curves]
        rows.append(block)
    return np.vstack(rows)
