"""Consistent modes of one contact alone in closed form, an order of magnitude faster than the enumeration."""

import math
from typing import NamedTuple

from gaitopt.model.contacts.mode import Mode
from gaitopt.model.contacts.mode_enumeration import DEPENDENT, ROUNDING, SAME, TOLERANCE, ConsistentMotion

Pair = tuple[float, float]
_SLIPS = ((Mode.SLIP_FORWARD, 1), (Mode.SLIP_BACKWARD, -1))


class SingleContact(NamedTuple):
    """The problem of one contact; normal entries first.

    Attributes
    ----------
    constant : (c_n, c_t)
        Velocities or accelerations of the contact without forces.
    mobility : (nn, nt, tt)
        Entries of G = W M^-1 W', both of the diagonal positive.
    static, kinetic : float
        Coefficients of friction.
    sign : int
        Direction of slip of a moving contact, 0 at rest.
    size : float
        Norm of the acceleration or velocity without contact forces, sqrt(a' M a).
    """

    constant: Pair
    mobility: tuple[float, float, float]
    static: float
    kinetic: float
    sign: int
    size: float


class _ModeSolution(NamedTuple):
    """A mode with its scaled force and velocity, both (normal, tangential), and its margin."""

    mode: Mode
    force: Pair
    velocity: Pair
    margin: float


def solve_foot(problem: SingleContact) -> list[ConsistentMotion] | None:
    """Return the consistent motions of a foot, or None if its rows are dependent or a slip is at its limit.

    The result is that of :func:`~gaitopt.model.contacts.mode_enumeration.enumerate_modes`, with the forces (f_n, f_t).

    Examples
    --------
    A point mass with the weight 10 and the tangential load 4:

    >>> motions = solve_foot(SingleContact((-10.0, 4.0), (1.0, 0.0, 1.0), 0.5, 0.5, 0, 10.8))
    >>> motions[0].combinations[0][0].value, motions[0].forces[0]
    ('stick', (10.0, -4.0))
    """
    nn, nt, tt = problem.mobility
    normal, tangent = 1 / math.sqrt(nn), 1 / math.sqrt(tt)
    c_n, c_t = problem.constant[0] * normal, problem.constant[1] * tangent
    coupling, ratio = nt * normal * tangent, normal / tangent
    determinant = 1 - coupling * coupling
    if determinant <= DEPENDENT:
        return None
    trials = []
    if not problem.sign:
        f_n, f_t = (coupling * c_t - c_n) / determinant, (coupling * c_n - c_t) / determinant
        cone = math.inf if math.isinf(problem.static) else problem.static * ratio * f_n - abs(f_t)
        trials.append(_ModeSolution(Mode.STICK, (f_n, f_t), (0.0, 0.0), min(f_n, cone)))
    for mode, sign in _SLIPS:
        if problem.sign == -sign or math.isinf(problem.kinetic):
            continue
        slide = -sign * problem.kinetic * ratio
        response = 1 + coupling * slide
        if response == 0:
            return None
        f_n = -c_n / response
        speed = c_t + (coupling + slide) * f_n
        margin = f_n if problem.sign else min(f_n, sign * speed)
        trials.append(_ModeSolution(mode, (f_n, slide * f_n), (0.0, speed), margin))
    trials.append(_ModeSolution(Mode.FREE, (0.0, 0.0), (c_n, c_t), c_n))
    return _motions_of(trials, max(problem.size, abs(c_n), abs(c_t)), (normal, tangent))


def solve_stop(constant: float, mobility: float, latched: bool, size: float) -> list[ConsistentMotion]:
    """Return the consistent motion of a joint stop; `size` as in :class:`SingleContact`."""
    force = -constant / mobility
    if latched:
        return [ConsistentMotion(((Mode.LATCHED,),), ((force,),))]
    closed, free = ((Mode.CLOSED,), (force,)), ((Mode.FREE,), (0.0,))
    scaled = -constant / math.sqrt(mobility)
    first, second = (closed, free) if scaled >= -ROUNDING * size else (free, closed)
    if abs(scaled) > TOLERANCE * size:
        return [ConsistentMotion((first[0],), (first[1],))]
    return [ConsistentMotion((first[0], second[0]), (first[1], second[1]))]


def _motions_of(trials: list[_ModeSolution], load: float, scale: Pair) -> list[ConsistentMotion]:
    """Return the accepted trials, those with the same velocity as one motion."""
    motions: list[list[tuple[bool, _ModeSolution]]] = []
    for trial in trials:
        size = max(load, abs(trial.force[0]), abs(trial.force[1]))
        if not trial.margin >= -TOLERANCE * size:
            continue
        for motion in motions:
            first = motion[0][1].velocity
            if max(abs(trial.velocity[0] - first[0]), abs(trial.velocity[1] - first[1])) <= SAME * size:
                motion.append((trial.margin < -ROUNDING * size, trial))
                break
        else:
            motions.append([(trial.margin < -ROUNDING * size, trial)])
    ordered = [[trial for _, trial in sorted(motion, key=lambda pair: pair[0])] for motion in motions]
    return [
        ConsistentMotion(
            tuple((trial.mode,) for trial in motion),
            tuple((trial.force[0] * scale[0], trial.force[1] * scale[1]) for trial in motion),
        )
        for motion in ordered
    ]
