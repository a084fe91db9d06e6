"""Rigid, plastic, frictional impact of the landing foot.

M (v+ - v-) = W^T (L_t, L_n) with

    0 <= L_n  _|_  v_n+ >= 0
    L_t = a - b
    0 <= a  _|_  c + v_t+ >= 0
    0 <= b  _|_  c - v_t+ >= 0
    0 <= c  _|_  mu L_n - a - b >= 0

(c is the slip speed).  In the plane the outcome is stick, slip+ or slip-, found exactly by checking the three.
"""

import functools
import math
import threading
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.fast_call import FastCall
from gaitopt.model.robot import Robot

_ROUNDING = 1e-12
_STICK, _SLIPS = Mode.STICK, ((Mode.SLIP_FORWARD, 1), (Mode.SLIP_BACKWARD, -1))


def complementarity_pairs(
    normal: Any, forward: Any, backward: Any, excess: Any, v_normal: Any, v_tangent: Any, friction: Any
) -> tuple[list[Any], list[Any]]:
    """Return the two sides of the impact law's complementarity pairs; works on symbols and on numbers.

    Parameters
    ----------
    normal, forward, backward : scalar
        L_n, a and b, with L_t = a - b [N s].
    excess : scalar
        c, the slip speed [m/s].
    v_normal, v_tangent : scalar
        Landing-foot velocity after the impact [m/s].
    friction : scalar

    Returns
    -------
    left, right : list of 4
        All >= 0 and ``left[i] * right[i] == 0`` at a solution.

    Examples
    --------
    >>> left, right = complementarity_pairs(2.0, 0.0, 0.2, 0.5, 0.0, 0.5, 0.1)
    >>> [a * b for a, b in zip(left, right)]
    [0.0, 0.0, 0.0, 0.0]
    """
    left = [normal, forward, backward, excess]
    right = [v_normal, excess + v_tangent, excess - v_tangent, friction * normal - forward - backward]
    return left, right


def impulse_excess(impulse: Any, friction: Any, mode: Mode, margin: Any) -> Any:
    """Return what an outcome asks of the impulse: = 0 for a slip, >= 0 (two entries) for a stick.

    This is the last pair of :func:`complementarity_pairs` with the outcome known, divided by mu so that an unlimited
    friction is allowed; `margin` keeps a sticking impulse inside the cone.

    Parameters
    ----------
    impulse : SX or array, shape (2,)
        (L_t, L_n) [N s].
    """
    tangential, normal = impulse[0], impulse[1]
    if mode.slips:
        return mode.sign * tangential / friction + normal
    scaled = tangential / ((1 - margin) * friction)
    return ca.vertcat(normal - scaled, normal + scaled)


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
    >>> from gaitopt import rimless_wheel, solve_impact
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
    """Solve the impact law exactly by checking its three outcomes.

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
        self._n, self._friction = n, float(p[[parameter.name for parameter in robot.parameters].index("friction")])
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
        found = outcomes((v_t, v_n), ((tt, tn), (nt, nn)), self._friction)
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


def outcomes(
    velocity: tuple[float, float], mobility: tuple[tuple[float, float], tuple[float, float]], friction: float
) -> list[tuple[Mode, tuple[float, float]]]:
    """Return every consistent outcome of an impact with its impulse (L_t, L_n) [N s].

    Parameters
    ----------
    velocity : (v_t, v_n) [m/s]
        Of the landing foot before the impact.
    mobility : ((tt, tn), (tn, nn)) [1/kg]
        Foot velocity per unit impulse.
    friction : float
    """
    ((tt, tn), (_, nn)), (v_t, v_n) = mobility, velocity
    found: list[tuple[Mode, tuple[float, float]]] = []
    determinant = tt * nn - tn * tn
    l_t, l_n = (tn * v_n - nn * v_t) / determinant, (tn * v_t - tt * v_n) / determinant
    if l_n >= 0 and abs(l_t) <= friction * l_n:
        found.append((_STICK, (l_t, l_n)))
        if nn > friction * abs(tn):  # then at most one outcome is consistent
            return found
    if math.isinf(friction):
        return found
    for mode, sign in _SLIPS:
        slide = -sign * friction
        response = nn + tn * slide
        if response <= 0:
            continue
        normal = -v_n / response
        if normal >= 0 and sign * (v_t + (tt * slide + tn) * normal) > 0:
            found.append((mode, (slide * normal, normal)))
    # Exactly on the edge of the cone rounding may refuse the stick and the slip that coincide there.
    if not found and v_n < 0 and abs(l_t) - friction * l_n <= _ROUNDING * math.hypot(l_t, l_n):
        found.append((_STICK, (l_t, l_n)))
    return found
