"""Bifurcation diagrams: branches of gaits over a parameter, as plain arrays."""

import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from gaitopt.continuation.special_curve import SpecialCurve
from gaitopt.continuation.special_point import SpecialKind, SpecialPoint
from gaitopt.dataclass import dataclass
from gaitopt.motion.motion import Array
from gaitopt.motion.summary import plain

NEUTRAL = 1e-6
"""Largest difference from 1 of the spectral radius at a located bifurcation."""


@dataclass(frozen=True, eq=False, kw_only=True)
class GaitBranch:
    """A branch of periodic gaits over a parameter.

    Attributes
    ----------
    kind : str
        ``"periodic"``.
    steps : int
        Period of the gaits in steps.
    names, units : tuple of str
        Coordinates of the section and their units.
    values : (K,) array
        Parameter of each gait, in order along the branch.
    orbits : (K, steps, n) array
        State on the section at the start of each step of the period [rad, rad/s, m/s].
    multipliers : (K, n) complex array
        Largest modulus first; nan where a section has fewer coordinates, as after a sticking touchdown.
    sequences : tuple of K str
        Contact sequences of the steps, joined by ``"; "``.
    special : tuple of SpecialPoint
        In order along the branch.
    begin, end : str
        Reasons for which the branch ends on either side: ``"start"``, ``"range_end"``, the kind of a special point, or
        ``"interrupted"``.
    parent : int or None
        Number of the branch from which it branched off.

    Examples
    --------
    >>> from gaitopt import load_diagram
    >>> branch = load_diagram("docs/examples/compass_slope.nc").branches[0]
    >>> branch.steps, branch.special[0].kind.key
    (1, 'period_doubling')
    """

    kind: str = "periodic"
    steps: int
    names: tuple[str, ...]
    units: tuple[str, ...]
    values: Array
    orbits: Array
    multipliers: NDArray[np.complex128]
    sequences: tuple[str, ...]
    special: tuple[SpecialPoint, ...]
    begin: str = "start"
    end: str
    parent: int | None = None

    def __repr__(self) -> str:
        ends = f" from {self.values[0]:.6g} to {self.values[-1]:.6g}" if self.values.size else ""
        counts = f"{self.steps}-step gaits: {self.values.size}{ends}, special points: {len(self.special)}"
        return f"GaitBranch({counts}, end: {self.end})"

    @property
    def states(self) -> Array:
        """State of each gait at the start of its period, shape (K, n) [rad, rad/s, m/s]."""
        return np.asarray(self.orbits[:, 0])

    @property
    def radii(self) -> Array:
        """Spectral radius of each gait, shape (K,)."""
        return np.asarray(np.nanmax(np.abs(self.multipliers), axis=1))

    @property
    def stable(self) -> NDArray[np.bool_]:
        """Whether the multipliers of each gait lie inside the unit circle, shape (K,)."""
        return np.asarray(self.radii < 1)

    def special_of(self, kind: SpecialKind | str) -> tuple[SpecialPoint, ...]:
        """Return the special points of a kind, such as ``"fold"``."""
        key = kind if isinstance(kind, str) else kind.key
        return tuple(point for point in self.special if point.kind.key == key)

    def orbit_of(self, point: SpecialPoint) -> Array:
        """Return the state at a special point at the start of each step of its period, shape (steps, n).

        The first state is stored with the point; the others are interpolated between the neighbouring gaits.
        """
        if self.steps == 1 or self.values.size < 2:
            return np.concatenate([point.z[None], self.orbits[:1, 1:].reshape(-1, point.z.size)])
        k, share = self._locate(point)
        following = (1 - share) * self.orbits[k, 1:] + share * self.orbits[k + 1, 1:]
        return np.vstack([point.z, following])

    def stability_change(self, point: SpecialPoint) -> str:
        """Return whether stability is lost or gained at a special point, in the direction of the branch, or "".

        The multipliers on both sides of a kink of the return map decide; at a bifurcation, where they are on the unit
        circle, those of the neighbouring gaits.

        Examples
        --------
        >>> from gaitopt import load_diagram
        >>> branch = load_diagram("docs/examples/compass_slope.nc").branches[0]
        >>> [(point.kind.key, branch.stability_change(point)) for point in branch.special]
        [('period_doubling', 'lost')]
        """
        if not point.multipliers_after.size or self.values.size < 2:
            return ""
        sides = [float(np.nanmax(np.abs(each))) for each in (point.multipliers_before, point.multipliers_after)]
        k, _ = self._locate(point)
        for side, gaits in enumerate((self.radii[: k + 1][::-1], self.radii[k + 1 :])):
            if abs(sides[side] - 1) <= NEUTRAL:
                clear = gaits[np.abs(gaits - 1) > NEUTRAL]
                sides[side] = float(clear[0]) if clear.size else 1.0
        before, after = (side < 1 for side in sides)
        return "" if before == after else "lost" if before else "gained"

    def _locate(self, point: SpecialPoint) -> tuple[int, float]:
        """Return the gait before a special point, and the share of the way from it to the next one."""
        rows = np.column_stack([self.values, self.states])
        ranges = np.ptp(rows, axis=0)
        scale = np.where(ranges > 0, ranges, 1.0)
        distances = np.linalg.norm((rows - np.append(point.value, point.z)) / scale, axis=1)
        lengths = np.linalg.norm(np.diff(rows / scale, axis=0), axis=1)
        k = int(np.argmin(distances[:-1] + distances[1:] - lengths))
        return k, float(distances[k] / max(distances[k] + distances[k + 1], np.finfo(float).tiny))


def split_branch(branch: GaitBranch, *, joined: bool = True) -> Iterator[tuple[slice, str, bool]]:
    """Yield the pieces of a branch with constant contact sequence and stability: points, sequence and stability.

    A bifurcation at which the stability changes is the end of one piece and the start of the next one.  Otherwise, a
    line between a stable and an unstable gait belongs to the unstable piece.

    Parameters
    ----------
    branch : GaitBranch
    joined : bool
        Whether pieces of different sequences have a common point, for a quantity that is continuous between them.
    """
    names = [distinct_steps(name) for name in branch.sequences]
    stable = branch.stable | (np.abs(branch.radii - 1) <= NEUTRAL)
    kinds = [
        (names[k], bool(stable[k] and stable[k + 1])) if joined or names[k] == names[k + 1] else None
        for k in range(len(names) - 1)
    ]
    begin = 0
    for kind, group in itertools.groupby(kinds):
        end = begin + len(list(group))
        if kind is not None:
            yield slice(begin, end + 1), *kind
        begin = end


@dataclass(frozen=True, eq=False, kw_only=True)
class BranchDiagram:
    """Branches of the gaits of a walker over one parameter.

    Attributes
    ----------
    robot : str
    parameter : str
    unit : str
        Unit of the parameter; the values of an angle are in rad.
    parameters : dict of str to float
        All other parameters in SI units.
    ends : (float, float)
        Range of the parameter.
    branches : tuple of GaitBranch
    complete : bool
        Whether all requested branches were followed.
    curves : tuple of SpecialCurve
        Special points followed over a second parameter.

    Examples
    --------
    >>> from gaitopt import load_diagram
    >>> diagram = load_diagram("docs/examples/compass_slope.nc")
    >>> diagram.parameter, len(diagram.branches), [round(ratio, 2) for ratio in diagram.ratios]
    ('slope', 5, [5.32, 4.68, 4.66])
    """

    robot: str
    parameter: str
    unit: str
    parameters: dict[str, float]
    ends: tuple[float, float]
    branches: tuple[GaitBranch, ...]
    complete: bool = True
    curves: tuple[SpecialCurve, ...] = ()

    def __repr__(self) -> str:
        points = sum(branch.values.size for branch in self.branches)
        special = sum(len(branch.special) for branch in self.branches)
        counts = f"branches: {len(self.branches)}, gaits: {points}, special points: {special}"
        return f"BranchDiagram({self.robot!r}, {self.parameter!r}, {counts})"

    @property
    def ratios(self) -> tuple[float, ...]:
        """Ratios of the distances between successive period doublings, which tend to 4.669... (Feigenbaum 1978)."""
        values, branch = list[float](), 0
        while True:
            children = [k for k, other in enumerate(self.branches) if other.parent == branch]
            doublings = self.branches[branch].special_of(SpecialKind.PERIOD_DOUBLING) if self.branches else ()
            if not doublings:
                break
            values.append(doublings[0].value)
            if not children:
                break
            branch = children[0]
        gaps = np.diff(values)
        return tuple(float(one / other) for one, other in itertools.pairwise(gaps) if other)

    def records(self) -> dict[str, Any]:
        """Return the diagram as plain data for JSON; a multiplier is a pair [real part, imaginary part]."""
        return plain(
            {
                "robot": self.robot,
                "parameter": self.parameter,
                "unit": self.unit,
                "complete": self.complete,
                "branches": [_branch_record(branch) for branch in self.branches],
                "ratios": list(self.ratios),
                "curves": [curve.record() for curve in self.curves],
            }
        )


def _branch_record(branch: GaitBranch) -> dict[str, Any]:
    columns = branch.values, branch.states, branch.multipliers, branch.radii, branch.sequences, branch.stable
    return {
        "kind": branch.kind,
        "period": branch.steps,
        "units": dict(zip(branch.names, branch.units, strict=True)),
        "sequence": branch.sequences[0] if branch.sequences else "",
        "points": [
            {
                "value": float(value),
                "state": dict(zip(branch.names, state.tolist(), strict=True)),
                "multipliers": _pairs(multipliers),
                "radius": float(radius),
                "stable": bool(stable),
                "sequence": sequence,
            }
            for value, state, multipliers, radius, sequence, stable in zip(*columns, strict=True)
        ],
        "special": [_special_record(point, branch.names) for point in branch.special],
        "begin": branch.begin,
        "end": branch.end,
        "parent": branch.parent,
    }


def _special_record(point: SpecialPoint, names: tuple[str, ...]) -> dict[str, Any]:
    return {
        "kind": point.kind.key,
        "value": point.value,
        "width": point.width,
        "state": dict(zip(names, point.z.tolist(), strict=True)),
        "before": point.before,
        "after": point.after,
        "multipliers_before": _pairs(point.multipliers_before),
        "multipliers_after": _pairs(point.multipliers_after),
        "test": None if math.isnan(point.test) else point.test,
    }


def _pairs(values: NDArray[np.complex128]) -> list[list[float]]:
    """Return finite complex numbers as pairs."""
    return [[float(value.real), float(value.imag)] for value in values if np.isfinite(value)]


def section_unit(name: str) -> str:
    """Return the unit of a coordinate of the section of a walker with one foot on the ground at a time.

    Examples
    --------
    >>> section_unit("theta_rate"), section_unit("foot_speed")
    ('rad/s', 'm/s')
    """
    if name == "foot_speed":
        return "m/s"
    return "rad/s" if name.endswith("_rate") else "rad"


def distinct_steps(sequence: str) -> str:
    """Return the contact sequences of the steps of a gait without repetition.

    Examples
    --------
    >>> distinct_steps("slip+ stick | stick; stick | stick; slip+ stick | stick")
    'slip+ stick | stick; stick | stick'
    """
    return "; ".join(dict.fromkeys(sequence.split("; ")))


_NO_GAIT = "no gait '", "' beyond"


def name_missing_gait(sequence: str) -> str:
    """Return what is beyond the end of a branch: no gait of a contact sequence.

    Examples
    --------
    >>> omit_outcome(name_missing_gait("stick | slip+"))
    "no gait 'stick | slip+' beyond"
    """
    return sequence.join(_NO_GAIT)


def omit_outcome(sequence: str) -> str:
    """Return the contact sequences of steps as they are printed elsewhere.

    The sequences of a branch of a robot with several contacts also contain the outcome of the impact that ends a step,
    which is the first phase of the next one.

    Examples
    --------
    >>> omit_outcome("heel a stick | toe a stick | heel b stick"), omit_outcome("stick | slip+")
    ('heel a stick | toe a stick |', 'stick | slip+')
    """
    if sequence.startswith(_NO_GAIT[0]):
        missing = sequence.removeprefix(_NO_GAIT[0]).removesuffix(_NO_GAIT[1])
        return name_missing_gait(omit_outcome(missing))
    steps = [step.rpartition(" |") for step in sequence.split("; ")]
    return "; ".join(phases + bar + ("" if bar and " " in last.strip() else last) for phases, bar, last in steps)


def name_sides(before: str, after: str) -> tuple[str, str]:
    """Return the contact sequences on both sides of a special point as printed; with the outcomes if these differ only.

    Examples
    --------
    >>> name_sides("a stick | b stick", "a stick | b slip+")
    ('a stick | b stick', 'a stick | b slip+')
    >>> name_sides("a stick | b stick", "a slip+ > a stick | b stick")
    ('a stick |', 'a slip+ > a stick |')
    """
    names = omit_outcome(before), omit_outcome(after)
    return names if before == after or names[0] != names[1] else (before, after)


def count_steps(sequence: str) -> str:
    """Return the contact sequences of the steps of a gait, those that are all equal only once.

    Examples
    --------
    >>> count_steps("stick | stick; stick | stick")
    '2 x (stick | stick)'
    """
    steps = sequence.split("; ")
    return f"{len(steps)} x ({steps[0]})" if len(steps) > 1 and len(set(steps)) == 1 else sequence
