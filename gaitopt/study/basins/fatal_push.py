"""The smallest push, in any direction, after which a walker does not return to its gait."""

import itertools
import math
from collections.abc import Iterator, Sequence

import numpy as np
from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.motion.motion import Array
from gaitopt.motion.printable import format_count
from gaitopt.parameters import positive, whole_number
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.pushed_walk import push_scale
from gaitopt.stability.recovery import PushTest, count_settling_steps
from gaitopt.study.basins.attractor import classify_walk

SPREADS = (0.5, 0.25, 0.12, 0.06, 0.03, 0.015, 0.007, 0.003)
"""Standard deviations of the changes of the best direction, one round of the refinement each."""

CLOSE = (0.9, 1.1)
"""Sizes of pushes between which the edge is sought first, relative to the size for a neighbouring gait."""


@check_arguments
@dataclass(frozen=True, kw_only=True)
class FatalPush:
    """The smallest push after which a walker does not return to its gait.

    The size of a push is that of :class:`gaitopt.stability.Recovery`.

    Attributes
    ----------
    size : float [rad/s]
        Distance of the gait from the edge of its basin on the section; inf if no push of the largest size is fatal.
    safe : float [rad/s]
        Largest size tried in this direction from which the walker returns: the edge lies between both.
    change : dict of str to float
        Changes of the coordinates of the section by this push.
    ending : str
        Ending of the walk after the push, as in a basin.
    walks : int
        Number of simulated walks.

    Examples
    --------
    >>> FatalPush(size=0.2, safe=0.1998, change={"theta_rate": -0.2}, ending="fell", walks=10).size
    0.2
    """

    size: float
    safe: float
    change: dict[str, float]
    ending: str
    walks: int


@check_arguments
@frozen(kw_only=True)
class PushSearch:
    """Options of the search for the smallest fatal push.

    Attributes
    ----------
    directions : int
        Number of random directions, besides those along each coordinate.
    radii : int
        Sizes that are tried along each direction, evenly spaced up to the best size: a part of the basin's edge
        thinner than their distance may be missed.
    refinements : int
        Changed directions in each round of the refinement.
    resolution : float
        Relative width to which a size is located.
    largest : float [rad/s]
        Largest size tried.
    steps : int
        Maximum number of steps of each walk.
    seed : int

    Examples
    --------
    >>> PushSearch(directions=8).radii
    12
    """

    directions: int = field(default=40, validator=whole_number())
    radii: int = field(default=12, validator=whole_number())
    refinements: int = field(default=10, validator=whole_number())
    resolution: float = field(default=1e-4, validator=positive(upper=1.0))
    largest: float = field(default=2.0, validator=positive("rad/s"))
    steps: int = field(default=60, validator=whole_number())
    seed: int = field(default=0, validator=whole_number(0))


@check_arguments
def find_fatal_push(
    walker: Walker, cycle: Cycle, search: PushSearch | None = None, *, guesses: Sequence[Array] = ()
) -> FatalPush:
    """Return the smallest push after which a walker does not return to a gait of one step.

    The first size that is fatal is located along many directions, each only up to the best size so far, and the best
    direction is refined by random changes that become smaller.

    Parameters
    ----------
    walker : Walker
    cycle : Cycle
        A stable gait of one step.
    search : PushSearch, optional
    guesses : sequence of (n_z,) arrays
        Changes of the coordinates whose directions are tried first, such as those of a neighbouring gait.

    Raises
    ------
    InputError
        If the gait is unstable, or has several steps.

    Examples
    --------
    >>> import math
    >>> from gaitopt import find_cycles, passive, rimless_wheel
    >>> from gaitopt.simulation import default_engine
    >>> from gaitopt.simulation.hybrid_automaton import Walker
    >>> wheel = rimless_wheel()
    >>> gait = find_cycles(wheel, {"slope": math.radians(13)}, starts=10)[0]
    >>> walker = Walker(wheel, passive(wheel), wheel.vector(gait.parameters), default_engine())
    >>> push = find_fatal_push(walker, gait, PushSearch(directions=1, refinements=1))
    >>> push.change["theta_rate"] > 0, push.ending
    (True, 'lift_off')
    """
    _check_gait(cycle)
    return _EdgeSearch(walker, cycle, search or PushSearch()).run(guesses)


@check_arguments
def find_push_limits(
    walker: Walker, cycle: Cycle, search: PushSearch | None = None, *, near: Array | None = None
) -> Array:
    """Return the sizes of the smallest fatal pushes along each coordinate, backward and forward.

    Parameters
    ----------
    walker : Walker
    cycle : Cycle
        A stable gait of one step.
    search : PushSearch, optional
        Its sizes, resolution and number of steps.
    near : (n_z, 2) array, optional
        Sizes for a neighbouring gait, close to which each edge is sought first.

    Returns
    -------
    (n_z, 2) array [rad/s]
        inf if no push of the largest size is fatal.

    Raises
    ------
    InputError
        If the gait is unstable, or has several steps.

    Examples
    --------
    >>> import math
    >>> from gaitopt import find_cycles, passive, rimless_wheel
    >>> from gaitopt.simulation import default_engine
    >>> from gaitopt.simulation.hybrid_automaton import Walker
    >>> wheel = rimless_wheel()
    >>> gait = find_cycles(wheel, {"slope": math.radians(13)}, starts=10)[0]
    >>> walker = Walker(wheel, passive(wheel), wheel.vector(gait.parameters), default_engine())
    >>> find_push_limits(walker, gait, PushSearch(radii=6)).round(3).tolist()
    [[inf, 0.226]]
    """
    _check_gait(cycle)
    seeker = _EdgeSearch(walker, cycle, search or PushSearch())
    count = cycle.z.size
    known = np.full((count, 2), np.inf) if near is None or near.shape != (count, 2) else near
    return np.array(
        [
            [seeker.locate(sign * axis, float(guess)) for sign, guess in zip((-1, 1), row, strict=True)]
            for axis, row in zip(np.eye(count), known, strict=True)
        ]
    )


def _check_gait(cycle: Cycle) -> None:
    """Raise InputError unless a gait is stable and has one step."""
    if len(cycle.sequences) > 1 or not cycle.stable:
        raise InputError(
            "A fatal push is defined for a stable gait of one step; this one has "
            f"{format_count(len(cycle.sequences), 'step')} and a spectral radius of {cycle.radius:.4g}."
        )


class _EdgeSearch:
    """Search for the point of the basin's edge that is nearest to a gait."""

    def __init__(self, walker: Walker, cycle: Cycle, search: PushSearch) -> None:
        self._walker, self._cycle, self._search = walker, cycle, search
        self._scale, self._walks = push_scale(walker.robot, walker.p, cycle.section), 0
        self._test = PushTest(steps=search.steps)
        self._rng = np.random.default_rng(search.seed)
        self._size, self._safe, self._direction = search.largest, 0.0, np.zeros(self._scale.size)

    def run(self, guesses: Sequence[Array]) -> FatalPush:
        """Return the smallest fatal push."""
        for direction in self._first_directions(guesses):
            self._try(direction)
        if not np.any(self._direction):
            return FatalPush(size=np.inf, safe=self._search.largest, change={}, ending="", walks=self._walks)
        for spread in SPREADS if self._scale.size > 1 else ():
            for _ in range(self._search.refinements):
                self._try(self._direction + spread * self._rng.normal(size=self._scale.size))
        change = self._size * self._scale * self._direction
        return FatalPush(
            size=float(self._size),
            safe=float(self._safe),
            change=dict(zip(self._cycle.section.names, change.tolist(), strict=True)),
            ending=self._ending(change),
            walks=self._walks,
        )

    def _first_directions(self, guesses: Sequence[Array]) -> Iterator[Array]:
        yield from (guess / self._scale for guess in guesses)
        for axis in np.eye(self._scale.size):
            yield axis
            yield -axis
        for _ in range(self._search.directions if self._scale.size > 1 else 0):
            yield self._rng.normal(size=self._scale.size)

    def _try(self, direction: Array) -> None:
        """Keep a direction if a push along it is fatal that is smaller than the best one."""
        direction = direction / np.linalg.norm(direction)
        bracket = self._bracket(direction, self._size * (1 - self._search.resolution))
        if bracket is not None:
            self._safe, self._size = self._bisect(direction, *bracket)
            self._direction = direction

    def locate(self, direction: Array, guess: float) -> float:
        """Return the smallest fatal size along a unit direction, sought first close to a guess; inf if none exists.

        Parameters
        ----------
        direction : (n_z,) array
        guess : float [rad/s]
        """
        low, high = (factor * guess for factor in CLOSE)
        if high < self._search.largest and self._returns(low, direction) and not self._returns(high, direction):
            return self._bisect(direction, low, high)[1]
        bracket = self._bracket(direction, self._search.largest)
        return math.inf if bracket is None else self._bisect(direction, *bracket)[1]

    def _bracket(self, direction: Array, largest: float) -> tuple[float, float] | None:
        """Return neighbouring sizes of pushes; the walker returns after the first one and not after the second one."""
        sizes = np.linspace(0, largest, self._search.radii + 1).tolist()
        return next((pair for pair in itertools.pairwise(sizes) if not self._returns(pair[1], direction)), None)

    def _bisect(self, direction: Array, low: float, high: float) -> tuple[float, float]:
        """Return neighbouring sizes as close as the resolution."""
        while high - low > self._search.resolution * high:
            middle = (low + high) / 2
            low, high = (middle, high) if self._returns(middle, direction) else (low, middle)
        return low, high

    def _returns(self, size: float, direction: Array) -> bool:
        self._walks += 1
        push = size * self._scale * direction
        return count_settling_steps(self._walker, self._cycle, push, self._test) is not None

    def _ending(self, change: Array) -> str:
        z = self._cycle.z + change
        return classify_walk(self._walker, z if self._cycle.section.sliding else np.append(z, 0.0)).label
