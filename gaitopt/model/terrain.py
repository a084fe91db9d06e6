"""Terrain: steps, ramps and patches of other friction as functions of the position along the ground."""

import bisect
import itertools
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.locks import cached_property

TERRAIN = "terrain"
"""Name of the terrain among parameters."""


class Piece(NamedTuple):
    """A part of the terrain with one height or one grade, and one friction.

    Attributes
    ----------
    begin, end : float [m]
        First and last position along the ground; infinite for the first and the last piece.
    height : float [m]
        Height at the position `begin`; of the first piece, everywhere.
    friction : float or None
        Coefficient of kinetic friction; None where it is the parameter ``friction``.
    grade : float
        Rise over distance, 0 unless it is part of a ramp.
    level : float [m]
        Height at position 0 of the extended piece, the same for all parts of a straight ramp.
    """

    begin: float
    end: float
    height: float
    friction: float | None
    grade: float = 0.0
    level: float = 0.0

    @property
    def line(self) -> tuple[float, float]:
        """Height at position 0 of the extended piece [m], and its grade."""
        return self.level, self.grade

    @property
    def incline(self) -> float:
        """Inclination relative to the plane, uphill positive [rad]."""
        return math.atan(self.grade)


@check_arguments
@dataclass(frozen=True)
class Terrain:
    """Steps, ramps and patches of other friction along the ground.

    The height is measured across the slope and is 0 before the first step or ramp; it is constant except on ramps.  The
    ratio of static to kinetic friction is the same everywhere.  Simulations of robots with several contacts accept no
    ramps.

    Parameters
    ----------
    steps : sequence of (position, rise)
        Positions along the ground and changes of the height there [m]; a negative rise is a step down.
    patches : sequence of (begin, end, friction)
        First and last position of each patch [m], and its coefficient of kinetic friction.
    ramps : sequence of (begin, end, rise)
        First and last position of each ramp [m], and the change of the height along it [m].

    Raises
    ------
    InputError
        If a number is invalid, two steps are at one position, or patches overlap.

    Examples
    --------
    >>> terrain = Terrain(steps=[(1.2, -0.02)], patches=[(0.8, 1.4, 0.1)])
    >>> terrain.height(1.5), terrain.pieces[1]
    (-0.02, Piece(begin=0.8, end=1.2, height=0.0, friction=0.1, grade=0.0, level=0.0))
    """

    steps: Sequence[tuple[float, float]] = ()
    patches: Sequence[tuple[float, float, float]] = ()
    ramps: Sequence[tuple[float, float, float]] = ()

    def __post_init__(self) -> None:
        steps = _read_rows("steps", "(position, rise)", self.steps, 2)
        patches = _read_rows("patches", "(begin, end, friction)", self.patches, 3)
        ramps = _read_rows("ramps", "(begin, end, rise)", self.ramps, 3)
        object.__setattr__(self, "steps", tuple(sorted(steps)))
        object.__setattr__(self, "ramps", tuple(sorted(ramps)))
        object.__setattr__(self, "patches", tuple(sorted(patches)))
        places = [place for place, _ in self.steps]
        if len(set(places)) < len(places):
            raise InputError(f"Terrain.steps must have different positions, got {places}.")
        _check_order("patch", "Patches", self.patches)
        _check_order("ramp", "Ramps", self.ramps)
        for _, _, friction in self.patches:
            if not friction >= 0:
                raise InputError(f"The friction of a patch must be at least 0, got {friction!r}.")
        for _, _, rise in self.ramps:
            if not math.isfinite(rise):
                raise InputError(f"The rise of a ramp must be finite, got {rise!r}.")

    @cached_property
    def pieces(self) -> tuple[Piece, ...]:
        """The parts of the terrain in their order along the ground."""
        changes = {place for place, _ in self.steps}
        changes |= {place for band in (*self.patches, *self.ramps) for place in band[:2]}
        bounds = [-math.inf, *sorted(changes), math.inf]
        return tuple(
            Piece(begin, end, self.height(begin), self._friction(begin), self._grade(begin), self._level(begin))
            for begin, end in itertools.pairwise(bounds)
        )

    def piece_at(self, place: float) -> int:
        """Return the number of the piece at a position; a change belongs to the piece that begins there."""
        return bisect.bisect_right([piece.end for piece in self.pieces[:-1]], place)

    def height(self, place: float) -> float:
        """Return the height at a position [m]."""
        height = sum((rise for at, rise in self.steps if at <= place), 0.0)
        for begin, end, rise in self.ramps:
            height += rise * min(max((place - begin) / (end - begin), 0.0), 1.0)
        return height

    def describe(self) -> dict[str, Any]:
        """Return the terrain as plain data."""
        rows = {"steps": self.steps, "patches": self.patches} | ({"ramps": self.ramps} if self.ramps else {})
        return {name: [list(row) for row in table] for name, table in rows.items()}

    def _friction(self, place: float) -> float | None:
        return next((friction for begin, end, friction in self.patches if begin <= place < end), None)

    def _level(self, place: float) -> float:
        """Return the height at position 0 of the extended ground at a position [m], from the start of a ramp."""
        ramp = next((begin for begin, end, _ in self.ramps if begin <= place < end), None)
        if ramp is None:
            return self.height(place)
        height = self.height(ramp) + sum(rise for at, rise in self.steps if ramp < at <= place)
        return height - self._grade(place) * ramp

    def _grade(self, place: float) -> float:
        return next((rise / (end - begin) for begin, end, rise in self.ramps if begin <= place < end), 0.0)


def separate_terrain(parameters: Mapping[str, Any]) -> tuple[dict[str, float], Terrain | None]:
    """Return parameters without the terrain, and the terrain, for simulations of robots with several contacts.

    Raises
    ------
    InputError
        If the terrain is not a Terrain, or has ramps.

    Examples
    --------
    >>> separate_terrain({"friction": 0.5, "terrain": Terrain(steps=[(1, 0.1)])})
    ({'friction': 0.5}, Terrain(steps=((1.0, 0.1),), patches=(), ramps=()))
    """
    values = {name: value for name, value in parameters.items() if name != TERRAIN}
    terrain = check_terrain(parameters.get(TERRAIN))
    if terrain is not None and terrain.ramps:
        raise InputError(
            "Simulations of robots with several contacts accept a terrain without ramps, got ramps="
            f"{terrain.ramps!r}; plans of several steps (MultiStepProblem) accept ramps."
        )
    return values, terrain


def check_terrain(terrain: object) -> Terrain | None:
    """Return a terrain, or None for a plane.

    Raises
    ------
    InputError
        If it is neither a Terrain nor None.
    """
    if terrain is not None and not isinstance(terrain, Terrain):
        raise InputError(f"terrain must be a Terrain such as Terrain(steps=[(1.2, -0.02)]), got {terrain!r}.")
    return terrain


def refuse_terrain(parameters: Mapping[str, object]) -> None:
    """Raise InputError if parameters contain a terrain, which is not a parameter of a robot."""
    if check_terrain(parameters.get(TERRAIN)) is not None:
        raise InputError(
            "A terrain is accepted by simulate_planar and place_planar, and by MultiStepProblem for plans of robots "
            "with one foot on the ground at a time; other gaits need a plane with the same friction everywhere."
        )


def _check_order(name: str, names: str, bands: Sequence[tuple[float, float, float]]) -> None:
    """Raise InputError unless each band of the ground begins before it ends, and no two overlap."""
    for begin, end, _ in bands:
        if not begin < end:
            raise InputError(f"A {name} must begin before it ends, got {begin:g} to {end:g} m.")
    for (_, end, _), (begin, _, _) in itertools.pairwise(bands):
        if begin < end:
            raise InputError(f"{names} must not overlap: one begins at {begin:g} m, before another ends at {end:g} m.")


def _read_rows(name: str, form: str, rows: object, size: int) -> list[Any]:
    """Return rows of numbers as tuples of floats."""
    try:
        numbers = [tuple(_read_number(value) for value in row) for row in rows]  # type: ignore[attr-defined]
    except (TypeError, ValueError):
        numbers = None
    if numbers is None or any(len(row) != size or not all(map(math.isfinite, row[:2])) for row in numbers):
        raise InputError(
            f"Terrain.{name} must be a sequence of {form} with finite positions, lengths in m, got {rows!r}."
        )
    return numbers


def _read_number(value: object) -> float:
    """Return a number as a float; ValueError for a text or a Boolean."""
    if isinstance(value, bool | str):
        raise ValueError
    return float(value)  # type: ignore[arg-type]
