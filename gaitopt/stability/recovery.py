"""Recovery of periodic gaits from pushes, tested in the event-driven simulator."""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from dataclasses import field as entry
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from attrs import field, frozen

from gaitopt.arguments import check_arguments
from gaitopt.dataclass import dataclass
from gaitopt.interrupts import InterruptRecord
from gaitopt.model.robot import Robot
from gaitopt.motion.motion import Array
from gaitopt.parameters import positive, whole_number
from gaitopt.progress import VerificationStep
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.pushed_walk import PushedWalk, make_pushed_walk, push_scale
from gaitopt.stability.section import Section
from gaitopt.stability.unreturned_walk import classify_unreturned_walk, summarise_failures

if TYPE_CHECKING:  # the simulation of robots with several contacts imports scipy
    from gaitopt.simulation.planar_simulation.planar_walker import PlanarWalker
    from gaitopt.stability.planar_gaits.planar_cycle import PlanarCycle

WalkObserver = Callable[[VerificationStep], None]

FIRST_BALL = 1 / 16
"""Radius of the first ball of a search for the largest ball, over the largest radius."""

NEGLIGIBLE_PUSH = 0.01
"""Size of negligible pushes [rad/s]: rates of legs are of the order of 1 rad/s, and a push of this size changes an
angle by 0.2 deg at most if the legs are 1 m long."""

CONVERGED_FRACTION = 1e-3
"""Fraction of the tolerance below which a walk counts as converged to the gait."""


@dataclass(frozen=True, kw_only=True)
class Recovery:
    """Outcome of walks from random starts around a gait.

    A start is the gait's state after touchdown plus a push drawn uniformly from a ball.  With w = sqrt(g / l) and l the
    height of the upright robot, the size of a push [rad/s] is the root of the sum of squares of the changes of the
    rates, of w times those of the angles, and of that of the foot speed over l.  For a robot with several contacts, l
    is the height of the highest point drawn at the start of the gait, lengths and their rates are divided by l, and the
    feet on the ground stay there.

    Attributes
    ----------
    radius : float [rad/s]
        Radius of the ball.
    starts, returned : int
        Number of starts, and of those that returned to the gait.
    steps : int
        Maximum number of steps of each walk.
    tolerance : float
        Largest difference of the state after touchdown from the gait's that counts as returned.
    settling : tuple of int
        Number of steps after which each start that returned stays within the tolerance.
    beyond : float [rad/s]
        In a search for the largest ball: the smallest radius tested from which not all starts return; inf if none.
    interrupted : bool
        Whether the search for the largest ball was interrupted; all starts of the ball of this radius were tested.
    failure : str
        In a search whose largest ball contains negligible pushes only: the reason for which starts of the ball of
        radius `beyond` did not return, ``"slow"`` if all of them approached the gait, so that more steps are needed,
        otherwise the more frequent one of ``"ended"`` and ``"left"``; empty in any other search.
    failures : dict of str to int
        Number of these starts by reason: ``"ended"`` if the walk ended, ``"left"`` if its distance from the gait did
        not decrease, ``"slow"`` if it decreased.
    ends : dict of str to int
        Number of the walks that ended by the key of their :class:`gaitopt.Stop`, such as ``"lift_off"``.

    Examples
    --------
    >>> Recovery(radius=0.1, starts=20, returned=20, steps=30, tolerance=1e-4).complete
    True
    """

    radius: float
    starts: int
    returned: int
    steps: int
    tolerance: float
    settling: tuple[int, ...] = ()
    beyond: float = math.inf
    interrupted: bool = False
    failure: str = ""
    failures: Mapping[str, int] = entry(default_factory=dict)
    ends: Mapping[str, int] = entry(default_factory=dict)

    @property
    def complete(self) -> bool:
        """Whether all starts returned."""
        return self.returned == self.starts

    @property
    def fraction(self) -> float:
        """Fraction of starts that returned, an estimate of the fraction of the ball in the gait's basin."""
        return self.returned / self.starts


@check_arguments
@frozen(kw_only=True)
class PushTest:
    """Options of a recovery test.

    Attributes
    ----------
    starts : int
        Number of random starts.
    seed : int
    steps : int
        Maximum number of steps of each walk.
    tolerance : float
        Largest difference of the state after touchdown from the gait's that counts as returned.
    largest : float [rad/s]
        Largest radius tested.
    resolution : float
        Relative width to which the largest radius is located.

    Examples
    --------
    >>> PushTest(starts=50).steps
    30
    """

    starts: int = field(default=200, validator=whole_number())
    seed: int = field(default=0, validator=whole_number(0))
    steps: int = field(default=30, validator=whole_number())
    tolerance: float = field(default=1e-4, validator=positive())
    largest: float = field(default=2.0, validator=positive("rad/s"))
    resolution: float = field(default=0.05, validator=positive(upper=1.0))

    @property
    def most_walks(self) -> int:
        """Approximate maximum number of walks of a search for the largest ball.

        The radius is doubled up to the largest one at most, and the last interval is bisected.  The search may take
        more walks if the largest ball is much smaller than the first one; larger balls then usually end early.
        """
        balls = 1 + round(-math.log2(FIRST_BALL)) + math.ceil(-math.log2(self.resolution))
        return balls * self.starts


@check_arguments
def measure_recovery(
    walker: "Walker | PlanarWalker", cycle: "Cycle | PlanarCycle", radius: float, test: PushTest | None = None
) -> Recovery:
    """Simulate walks from random starts around a gait of one step and count those that return to it.

    Parameters
    ----------
    walker : Walker or PlanarWalker
    cycle : Cycle or PlanarCycle
    radius : float [rad/s]
    test : PushTest, optional

    Examples
    --------
    >>> import math
    >>> from gaitopt import find_cycles, passive, rimless_wheel
    >>> from gaitopt.simulation import default_engine
    >>> from gaitopt.simulation.hybrid_automaton import Walker
    >>> wheel = rimless_wheel()
    >>> gait = find_cycles(wheel, {"slope": math.radians(13)}, starts=10)[0]
    >>> walker = Walker(wheel, passive(wheel), wheel.vector(gait.parameters), default_engine())
    >>> measure_recovery(walker, gait, 0.01, PushTest(starts=5)).returned
    5
    """
    test, walk = test or PushTest(), make_pushed_walk(walker, cycle)
    settling = [_count_settling_steps(walk, radius * push, test) for push in draw_from_ball(walk.spread, test)]
    returned = tuple(steps for steps in settling if steps is not None)
    return _make_recovery(test, radius, len(returned), returned)


@check_arguments
def find_largest_recovery(
    walker: "Walker | PlanarWalker",
    cycle: "Cycle | PlanarCycle",
    test: PushTest | None = None,
    observer: WalkObserver | None = None,
    interrupt: InterruptRecord | None = None,
) -> Recovery:
    """Return the recovery from the largest ball from which all starts return; radius 0 if none exists.

    The radius is located by bisection; larger balls from which all starts return again are not searched.

    Parameters
    ----------
    walker : Walker or PlanarWalker
    cycle : Cycle or PlanarCycle
        For an unstable gait the radius is 0.
    test : PushTest, optional
    observer : callable, optional
        Receives a :class:`gaitopt.progress.VerificationStep` after each walk.
    interrupt : InterruptRecord, optional
        Record of Ctrl-C; once one is received the search ends after the current walk and returns the largest ball so
        far.

    Examples
    --------
    >>> import math
    >>> from gaitopt import find_cycles, passive, rimless_wheel
    >>> from gaitopt.simulation import default_engine
    >>> from gaitopt.simulation.hybrid_automaton import Walker
    >>> wheel = rimless_wheel()
    >>> gait = find_cycles(wheel, {"slope": math.radians(13)}, starts=10)[0]
    >>> walker = Walker(wheel, passive(wheel), wheel.vector(gait.parameters), default_engine())
    >>> find_largest_recovery(walker, gait, PushTest(starts=3, resolution=0.5)).radius > 0.1
    True
    """
    test = test or PushTest()
    best = _make_recovery(test, 0.0, 0, ())
    if not cycle.stable:
        return replace(best, beyond=0.0)
    lower, upper, beyond = 0.0, test.largest, math.inf
    radius, walk = test.largest * FIRST_BALL, make_pushed_walk(walker, cycle)
    while (math.isinf(beyond) or upper - lower > test.resolution * upper) and upper > 1e-6:
        settling = []
        for push in draw_from_ball(walk.spread, test):
            if interrupt is not None and interrupt.received:
                return replace(best, beyond=beyond, interrupted=True)
            settling.append(_count_settling_steps(walk, radius * push, test))
            if observer is not None:
                observer(VerificationStep(radius, len(settling), test.starts))
            if settling[-1] is None:
                upper, beyond = radius, radius
                break
        else:
            lower = radius
            best = _make_recovery(test, radius, test.starts, tuple(steps for steps in settling if steps is not None))
        radius = min(2 * lower, upper) if lower and math.isinf(beyond) else (lower + upper) / 2
        if not lower:
            radius = upper / 2
        if lower == test.largest:
            break
    if math.isinf(beyond) or best.radius >= NEGLIGIBLE_PUSH:
        return replace(best, beyond=beyond)
    failures, ends, complete = _count_failures(walk, beyond, test, observer, interrupt)
    failure = summarise_failures(failures)
    return replace(best, beyond=beyond, failure=failure, failures=failures, ends=ends, interrupted=not complete)


def _count_failures(
    walk: PushedWalk,
    radius: float,
    test: PushTest,
    observer: WalkObserver | None,
    interrupt: InterruptRecord | None,
) -> tuple[dict[str, int], dict[str, int], bool]:
    """Count the starts of a ball that do not return.

    Return their numbers by reason, those of the walks that end by stop, and whether all starts were tested.
    """
    counts, ends = Counter[str](), Counter[str]()
    for number, push in enumerate(draw_from_ball(walk.spread, test), start=1):
        if interrupt is not None and interrupt.received:
            return dict(counts), dict(ends), False
        if _count_settling_steps(walk, radius * push, test) is None:
            reason, stop = classify_unreturned_walk(walk, radius * push, test.steps)
            counts[reason] += 1
            if stop is not None:
                ends[stop.key] += 1
        if observer is not None:
            observer(VerificationStep(radius, number, test.starts))
    return dict(counts), dict(ends), True


def _make_recovery(test: PushTest, radius: float, returned: int, settling: tuple[int, ...]) -> Recovery:
    return Recovery(
        radius=radius,
        starts=test.starts,
        returned=returned,
        steps=test.steps,
        tolerance=test.tolerance,
        settling=settling,
    )


def draw_pushes(robot: Robot, p: Array, section: Section, test: PushTest) -> Iterator[Array]:
    """Yield pushes of the unit ball as changes of the coordinates of a section, shape (n_z,) each.

    Parameters
    ----------
    robot : Robot
    p : (n_p,) array
    section : Section
    test : PushTest
        Number and seed of the pushes.

    Examples
    --------
    >>> from gaitopt import rimless_wheel
    >>> wheel = rimless_wheel()
    >>> p = wheel.vector(wheel.resolve({}))
    >>> next(draw_pushes(wheel, p, Section(wheel, p, sliding=False), PushTest(starts=3))).shape
    (1,)
    """
    return draw_from_ball(np.diag(push_scale(robot, p, section)), test)


def draw_from_ball(spread: Array, test: PushTest) -> Iterator[Array]:
    """Yield pushes from points drawn uniformly in the unit ball; `spread` is that of a :class:`PushedWalk`."""
    rng, size = np.random.default_rng(test.seed), spread.shape[1]
    for _ in range(test.starts):
        direction = rng.normal(size=size)
        yield spread @ direction / np.linalg.norm(direction) * rng.uniform() ** (1 / size)


def count_settling_steps(
    walker: "Walker | PlanarWalker", cycle: "Cycle | PlanarCycle", push: Array, test: PushTest
) -> int | None:
    """Return the number of steps after which a walk stays within the tolerance of the gait, or None without return."""
    return _count_settling_steps(make_pushed_walk(walker, cycle), push, test)


def _count_settling_steps(walk: PushedWalk, push: Array, test: PushTest) -> int | None:
    state, outside = walk.begin(push), 0
    for step in range(1, test.steps + 1):
        state = walk.take_step(state)
        if state is None:
            return None
        distance = walk.distance(state)
        if distance > test.tolerance:
            outside = step
        elif distance <= CONVERGED_FRACTION * test.tolerance:
            break
    return None if outside == test.steps else outside + 1
