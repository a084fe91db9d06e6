"""Prediction of the states after the events of an integrated plan, which differ from the planned ones."""

import functools

import casadi as ca
import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.phase_dynamics import PhaseDynamics
from gaitopt.model.contacts.touchdown import Touchdown
from gaitopt.model.contacts.transition import ContactQuantities
from gaitopt.model.coordinate_entries import ANGLES, SLIDE
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array


def predict_phase_end(dynamics: PhaseDynamics, state: Array, torque: Array, p: Array, following: Mode) -> Array:
    """Return angles and rates at the planned end of a phase, (2 n_angles,), if a slip ends where its guard is zero.

    While the end of a slip is delayed, the rates change with the accelerations of the slip instead of those of the
    following mode.  At the onset of a slip, the accelerations are continuous.

    Parameters
    ----------
    dynamics : PhaseDynamics
        Dynamics of the phase.
    state : (n_x,) array
        Last state of the phase.
    torque : (n_u,) array
    p : (n_p,) array
    following : Mode
        Mode of the next phase.
    """
    if not dynamics.mode.slips:
        return state[: 2 * dynamics.n_angles].copy()
    q, v = dynamics.full_samples(state[:, None])
    end = np.asarray(_build_end_of_slip(dynamics.robot, dynamics.mode, following)(q, v, torque, p)).ravel()
    return np.concatenate([q.ravel()[ANGLES], end[ANGLES]])


def predict_touchdown(dynamics: PhaseDynamics, state: Array, torque: Array, p: Array, outcome: Mode) -> Array:
    """Return angles and all rates after the touchdown of a motion that nearly touches down, (n_angles + n_q,).

    Parameters
    ----------
    dynamics : PhaseDynamics
        Dynamics of the last phase.
    state : (n_x,) array
        Last state of the step.
    torque : (n_u,) array
    p : (n_p,) array
    outcome : Mode
        Mode of the landing foot after the impact.
    """
    q, v = dynamics.full_samples(state[:, None])
    following = np.asarray(_build_touchdown(dynamics.robot, dynamics.mode, outcome)(q, v, torque, p)).ravel()
    return np.concatenate([following[: dynamics.robot.n_q][ANGLES], following[dynamics.robot.n_q :]])


@functools.lru_cache(maxsize=64)
def _build_end_of_slip(robot: Robot, mode: Mode, following: Mode) -> ca.Function:
    """Return the Function (q, v, torque, p) -> rates, those of the angles at the planned end of a slip."""
    q, v, torque, p = _make_symbols(robot)
    at_rest = ca.MX(v)
    at_rest[SLIDE] = 0
    during, force = robot.acceleration[mode](q, v, torque, p)
    after = robot.acceleration[following](q, at_rest, torque, p)[0]
    inertia = robot.wellposed(q, p)
    guard = _build_guard(robot, mode, following)(force, v[SLIDE], robot.static_friction(p), inertia, during[SLIDE])
    delay = -guard / (ca.jtimes(guard, q, v) + ca.jtimes(guard, v, during))
    return ca.Function("end_of_slip", [q, v, torque, p], [v + (during - after) * delay])


def _build_guard(robot: Robot, mode: Mode, following: Mode) -> ca.Function:
    """Return the guard of the transition between two phases as a Function of the contact's quantities."""
    sizes = {"force": 2, "speed": 1, "static_friction": 1, "sliding_inertia": 2, "acceleration": 1}
    symbols = [ca.SX.sym(name, size) for name, size in sizes.items()]
    transition = robot.contact_model.between(mode, following)
    return ca.Function("guard", symbols, [transition.guard(mode, ContactQuantities(*symbols))])


@functools.lru_cache(maxsize=64)
def _build_touchdown(robot: Robot, mode: Mode, outcome: Mode) -> ca.Function:
    """Return the Function (q, v, torque, p) -> (q, v) after a touchdown with a known outcome and the leg exchange."""
    q, v, p = ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q), ca.SX.sym("p", len(robot.parameters))
    reset = ca.Function("reset", [q, v, p], [Touchdown(robot).reset(outcome, q, v, p)])
    q, v, torque, p = _make_symbols(robot)
    guard, rate, _ = robot.touchdown(q, v, p)
    delay, acceleration = -guard / rate, robot.acceleration[mode](q, v, torque, p)[0]
    return ca.Function("touchdown", [q, v, torque, p], [reset(q + delay * v, v + delay * acceleration, p)])


def _make_symbols(robot: Robot) -> list[ca.MX]:
    sizes = {"q": robot.n_q, "v": robot.n_q, "torque": robot.n_u, "p": len(robot.parameters)}
    return [ca.MX.sym(name, size) for name, size in sizes.items()]
