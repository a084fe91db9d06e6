"""Footholds of a gait of several steps on a terrain: the piece of the ground on which each foot stands."""

import math
from collections.abc import Mapping, Sequence

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.model.terrain import Piece, Terrain
from gaitopt.model.uneven_ground import INCLINE, NEXT_INCLINE, RISE, adapt_to_uneven_ground
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.statement.warm_start import FromMotion, WarmStart

EDGE, KINK = 0.05, 0.01
"""Least distances of a foot from a step of the terrain and from an end of a ramp [m]."""

FARTHEST = 1.0
"""Largest difference of an unknown rise from that at the expected place [m]."""

Bounds = Mapping[int, tuple[float, float]]


@dataclass(frozen=True)
class Foothold:
    """A piece of the ground on which a foot stands, and bounds of the place of the foot.

    Attributes
    ----------
    piece : Piece
    expected : float [m]
        Expected place.
    bounds : (float, float) [m]
        Bounds of the place when the foot lands.
    ground : (float, float) [m]
        Bounds of the place while the foot slips: those of the piece.
    """

    piece: Piece
    expected: float
    bounds: tuple[float, float]
    ground: tuple[float, float]


def find_footholds(
    terrain: Terrain, steps: Sequence[GaitProblem], stated: Bounds, expected: Mapping[int, float]
) -> tuple[Foothold, ...]:
    """Return all footholds of a gait, from that of the first stance foot, at place 0, to that of the last touchdown.

    The piece of a foothold is that at its expected place.  If this is not stated, it is the middle of finite bounds, or
    one step ahead of the previous foothold, within a bound on one side.  The length of this step is the requested one
    or that of its guess; if it is unknown, the bound is the expected place.

    Raises
    ------
    InputError
        If the length of a step is unknown, or the stated bounds leave no place on the piece.
    """
    footholds = [_on_piece(terrain, 0, 0.0, (0.0, 0.0))]
    for number, step in enumerate(steps, start=1):
        bounds = stated.get(number, (-math.inf, math.inf))
        place = expected.get(number)
        if place is None:
            place = _expected_place(number, step, footholds[-1].expected, bounds)
        footholds.append(_on_piece(terrain, number, min(max(place, bounds[0]), bounds[1]), bounds))
    return tuple(footholds)


def _expected_place(number: int, step: GaitProblem, before: float, bounds: tuple[float, float]) -> float:
    """Return the expected place of a foothold, which may be outside a bound on one side [m]."""
    ends = [end for end in bounds if math.isfinite(end)]
    if len(ends) == 2:
        return sum(ends) / 2
    length = _expected_length(step)
    if length is not None:
        return before + length
    if ends:
        return ends[0]
    raise InputError(
        f"The foothold after steps[{number - 1}] is unknown: on a terrain a step needs a step_length, a guess from a "
        f"motion, or bounds footholds={{{number}: (lower, upper)}}."
    )


def _expected_length(step: GaitProblem) -> float | None:
    lengths, guess = step.step_length_range, step.guess
    if lengths.lower == lengths.upper:
        return lengths.lower
    if isinstance(guess, WarmStart | FromMotion):
        motion = guess.gait.motion if isinstance(guess, WarmStart) else guess.motion
        length = motion.travel / max(len(motion.jumps), 1)
        return min(max(length, lengths.lower), lengths.upper)
    if lengths.lower > 0 and math.isfinite(lengths.upper):
        return (lengths.lower + lengths.upper) / 2
    return None


def _on_piece(terrain: Terrain, number: int, place: float, bounds: tuple[float, float]) -> Foothold:
    piece = terrain.pieces[terrain.piece_at(place)]
    ground = piece.begin + _clearance(terrain, piece.begin), piece.end - _clearance(terrain, piece.end)
    lower, upper = max(bounds[0], ground[0]), min(bounds[1], ground[1])
    if not lower <= upper:
        stated = f"between {bounds[0]:g} and {bounds[1]:g} m" if math.isfinite(bounds[0]) else f"near {place:g} m"
        raise InputError(
            f"Foothold {number} must be {stated} on a piece of the ground from {piece.begin:g} to {piece.end:g} m, at "
            f"least {EDGE:g} m from steps of the terrain and {KINK:g} m from ends of ramps, which leaves no position; "
            "change the terrain or the footholds."
        )
    return Foothold(piece, min(max(place, lower), upper), (lower, upper), ground)


def _clearance(terrain: Terrain, place: float) -> float:
    """Return the least distance of a foot from a change of the terrain [m]."""
    if any(at == place for at, _ in terrain.steps):
        return EDGE
    return KINK if any(place in ramp[:2] for ramp in terrain.ramps) else 0.0


def resolve_steps(steps: Sequence[GaitProblem], footholds: Sequence[Foothold]) -> tuple[GaitProblem, ...]:
    """Return the steps with the friction, the rise and the inclinations of their footholds.

    If the next foothold has another inclination, the rise depends on the place of the foot, and is a free parameter
    unless this place is fixed.
    """
    resolved = []
    for number, step in enumerate(steps):
        before, after = footholds[number], footholds[number + 1]
        offset, grade = rise_between(before.piece, after.piece)
        rise = offset + grade * before.expected
        ground = {RISE: rise, INCLINE: before.piece.incline, NEXT_INCLINE: after.piece.incline}
        free = {name: ends for name, ends in step.free.items() if name != RISE}
        if grade and (before.bounds[0] < before.bounds[1] or any(mode.slips for mode in step.sequence.phases)):
            free[RISE] = (rise - FARTHEST, rise + FARTHEST)
        friction = before.piece.friction
        resolved.append(
            step.replace(
                robot=adapt_to_uneven_ground(step.robot),
                parameters={**step.parameters, **ground},
                friction=step.friction if friction is None else friction,
                free=free,
            )
        )
    return tuple(resolved)


def passes_change(terrain: Terrain, footholds: Sequence[Foothold], number: int) -> bool:
    """Return whether the height of the ground changes between a foothold and the next one."""
    first, last = (terrain.pieces.index(foothold.piece) for foothold in footholds[number : number + 2])
    return len({terrain.pieces[i].line for i in range(min(first, last), max(first, last) + 1)}) > 1


def rise_between(before: Piece, after: Piece) -> tuple[float, float]:
    """Return the height of the extended piece `after` above the piece `before` at place 0 [m], and its grade.

    Examples
    --------
    >>> level, ramp = Terrain(ramps=[(1.0, 2.0, 0.1)]).pieces[:2]
    >>> rise_between(level, ramp)
    (-0.1, 0.1)
    """
    (height, grade), (next_height, next_grade) = before.line, after.line
    return next_height - height, next_grade - grade
