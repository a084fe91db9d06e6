"""Numerical solution of the impact of the landing foot, and the map to the coordinates of the next step."""

import functools
import threading
from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.arguments import check_arguments, check_vector
from gaitopt.errors import InputError
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot

_STICK = Mode.STICK


class Impact(NamedTuple):
    """Solution of an impact.

    Attributes
    ----------
    mode : Mode or None
        Outcome; None if no outcome is consistent.
    impulse : (2,) array [N s]
    v_plus : (n_q,) array
        Rates after the impact, before the leg exchange.
    energy_lost : float [J]
    separation : float [m/s]
        Upward speed of the trailing foot; if negative, the single-impulse solution is invalid.
    ambiguous : bool
        Whether more than one outcome is consistent (possible only at large friction).

    Examples
    --------
    >>> import numpy as np
    >>> from gaitopt import rimless_wheel
    >>> from gaitopt.model import solve_impact
    >>> wheel = rimless_wheel()
    >>> p = wheel.vector(wheel.resolve({"friction": 0.1}))
    >>> impact = solve_impact(wheel, np.array([0, 0, np.pi / 10]), np.array([0, 0, 2.0]), p)
    >>> impact.mode.value, impact.ambiguous
    ('slip+', False)
    """

    mode: Mode | None
    impulse: np.ndarray
    v_plus: np.ndarray
    energy_lost: float
    separation: float
    ambiguous: bool


@check_arguments
def solve_impact(robot: Robot, q: np.ndarray, v: np.ndarray, p: np.ndarray) -> Impact:
    """Solve the impact of a robot exactly, by enumeration of the outcomes of its impact law.

    Parameters
    ----------
    robot : Robot
    q, v : (n_q,) arrays
        Configuration and rates just before touchdown.
    p : (n_p,) array
        Parameter vector, :meth:`Robot.vector`.

    Returns
    -------
    Impact

    Examples
    --------
    >>> import numpy as np
    >>> from gaitopt import compass_biped
    >>> robot = compass_biped()
    >>> p = robot.vector(robot.resolve({"friction": 0.5}))
    >>> impact = solve_impact(robot, np.array([0, 0, 0.15, 0.15]), np.array([0, 0, 0.6, -0.1]), p)
    >>> impact.mode.value, impact.energy_lost > 0
    ('stick', True)
    """
    q, v = check_vector("q", q, robot.n_q), check_vector("v", v, robot.n_q)
    values = np.asarray(p, dtype=float)
    if values.shape != (len(robot.parameters),):
        raise InputError(f"p must be the vector of {len(robot.parameters)} parameters, got the shape {values.shape}.")
    return _touchdown(robot, values.tobytes(), threading.get_ident()).solve(np.concatenate((q, v)))[0]


class TouchdownMap:
    """The impact of a robot with fixed parameters and the leg exchange after it, compiled for repeated solution.

    Parameters
    ----------
    robot : Robot
    p : (n_p,) array
    """

    def __init__(self, robot: Robot, p: np.ndarray) -> None:
        n, self._inputs = robot.n_q, np.zeros(2 * robot.n_q + 2)
        self._n, self._friction = n, float(p[robot.index("friction")])
        self._law = robot.contact_model.impact
        self._collision = FastCall(robot.collision, p, shared=self._inputs[: 2 * n])
        self._after_impulse = FastCall(_state_after_impulse(robot), p, shared=self._inputs)

    def solve(self, y: np.ndarray) -> tuple[Impact, np.ndarray | None]:
        """Return the impact in a state and the state after the leg exchange, both (q, v) of shape (2 n_q,).

        The state is None if the single-impulse solution is invalid.
        """
        n, inputs = self._n, self._inputs
        inputs[: 2 * n] = y
        # Floats are ten times faster than arrays of this size.
        v_t, v_n, tt, nt, tn, nn, *_ = self._collision.evaluate().tolist()
        consistent = self._law.outcomes((v_t, v_n), ((tt, tn), (nt, nn)), self._friction)
        if not consistent:
            return Impact(None, np.full(2, np.nan), np.full(n, np.nan), np.nan, np.nan, False), None
        mode, impulse = consistent[0]
        l_t, l_n = impulse
        inputs[2 * n], inputs[2 * n + 1] = l_t, l_n
        after = self._after_impulse.evaluate().copy()
        v_plus, following = after[:n], after[n:]
        separation = v_plus.item(1)
        lost = -(v_t * l_t + v_n * l_n + (tt * l_t * l_t + (tn + nt) * l_t * l_n + nn * l_n * l_n) / 2)
        impact = Impact(mode, inputs[2 * n :].copy(), v_plus, lost, separation, len(consistent) > 1)
        if not separation >= 0:
            return impact, None
        following[n + 1] = 0.0  # the landing foot stays on the ground, exactly
        if mode is _STICK:
            following[n] = 0.0
        return impact, following


@functools.lru_cache(maxsize=256)
def _touchdown(robot: Robot, p: bytes, thread: int) -> TouchdownMap:
    """Return the touchdown of a robot with the parameters in `p`, with separate memory for each thread."""
    return TouchdownMap(robot, np.frombuffer(p))


@functools.lru_cache(maxsize=64)
def _state_after_impulse(robot: Robot) -> ca.Function:
    """Return (q, v, impulse, p) -> rates after an impulse at the landing foot, and q and v after the leg exchange."""
    q, v, impulse = ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q), ca.SX.sym("impulse", 2)
    p = ca.SX.sym("p", len(robot.parameters))
    v_plus = v + robot.collision(q, v, p)[2] @ impulse
    return ca.Function("after_impulse", [q, v, impulse, p], ca.cse([v_plus, *robot.swap(q, v_plus, p)]))
