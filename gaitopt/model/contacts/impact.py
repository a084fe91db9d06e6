"""The impact of the landing foot and the map to the coordinates of the next step, solved with numbers."""

import functools
import threading
from typing import NamedTuple

import casadi as ca
import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot

_STICK = Mode.STICK


class Impact(NamedTuple):
    """An impact, solved.

    Attributes
    ----------
    mode : Mode or None
        Outcome; None when no outcome is consistent.
    impulse : (2,) array [N s]
    v_plus : (n_q,) array
        Rates after, before the leg swap.
    energy_lost : float [J]
    separation : float [m/s]
        Upward speed of the trailing foot; negative means the single-impulse answer is not valid.
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


def solve_impact(robot: Robot, q: np.ndarray, v: np.ndarray, p: np.ndarray) -> Impact:
    """Solve the impact of a robot exactly, by checking the outcomes of its impact law.

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
    return _touchdown(robot, p.tobytes(), threading.get_ident()).solve(np.concatenate((q, v)))[0]


class TouchdownMap:
    """The impact of a robot with given parameters and the leg swap that follows it, ready to be solved many times.

    Parameters
    ----------
    robot : Robot
    p : (n_p,) array
    """

    def __init__(self, robot: Robot, p: np.ndarray) -> None:
        n, self._given = robot.n_q, np.zeros(2 * robot.n_q + 2)
        self._n, self._friction = n, float(p[robot.index("friction")])
        self._law = robot.contact_model.impact
        self._collision = FastCall(robot.collision, p, shared=self._given[: 2 * n])
        self._struck = FastCall(_state_after_impulse(robot), p, shared=self._given)

    def solve(self, y: np.ndarray) -> tuple[Impact, np.ndarray | None]:
        """Return the impact in a state and the state after the leg swap, both (q, v) of shape (2 n_q,).

        The latter is None where the single-impulse answer is not valid.
        """
        n, given = self._n, self._given
        given[: 2 * n] = y
        # Floats: ten times faster here than arrays.
        v_t, v_n, tt, nt, tn, nn, *_ = self._collision.here().tolist()
        found = self._law.outcomes((v_t, v_n), ((tt, tn), (nt, nn)), self._friction)
        if not found:
            return Impact(None, np.full(2, np.nan), np.full(n, np.nan), np.nan, np.nan, False), None
        mode, impulse = found[0]
        l_t, l_n = impulse
        given[2 * n], given[2 * n + 1] = l_t, l_n
        after = self._struck.here().copy()
        v_plus, following = after[:n], after[n:]
        separation = v_plus.item(1)
        lost = -(v_t * l_t + v_n * l_n + (tt * l_t * l_t + (tn + nt) * l_t * l_n + nn * l_n * l_n) / 2)
        impact = Impact(mode, given[2 * n :].copy(), v_plus, lost, separation, len(found) > 1)
        if not separation >= 0:
            return impact, None
        following[n + 1] = 0.0  # the landing foot stays on the ground, exactly
        if mode is _STICK:
            following[n] = 0.0
        return impact, following


@functools.lru_cache(maxsize=256)
def _touchdown(robot: Robot, p: bytes, thread: int) -> TouchdownMap:
    """Return the touchdown of a robot with the parameters in `p`, with memory of its own in each thread."""
    return TouchdownMap(robot, np.frombuffer(p))


@functools.lru_cache(maxsize=64)
def _state_after_impulse(robot: Robot) -> ca.Function:
    """Return (q, v, impulse, p) -> rates after an impulse at the landing foot, and q and v after the leg swap."""
    q, v, impulse = ca.SX.sym("q", robot.n_q), ca.SX.sym("v", robot.n_q), ca.SX.sym("impulse", 2)
    p = ca.SX.sym("p", len(robot.parameters))
    v_plus = v + robot.collision(q, v, p)[2] @ impulse
    return ca.Function("struck", [q, v, impulse, p], ca.cse([v_plus, *robot.swap(q, v_plus, p)]))
