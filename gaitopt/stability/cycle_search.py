"""Systematic search for periodic gaits.

Gaits of one step are found by Newton's method on the return map from random starts, deflated by the gaits already
known.  Gaits of more steps are found from starts near a gait of half the period, displaced along the eigenvector of a
multiplier near or below -1, and from points of walks to which the walk returns closely after that number of steps.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np

from gaitopt.arguments import check_arguments
from gaitopt.control.law import Law, passive
from gaitopt.errors import InputError
from gaitopt.interrupts import defer_interrupt
from gaitopt.model.robot import Robot
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.motion import Array
from gaitopt.parameters import Parameter, check_type
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.engine_choice import default_engine
from gaitopt.simulation.hybrid_automaton import Walker
from gaitopt.simulation.step_limits import StepLimits
from gaitopt.stability.close_returns import close_returns
from gaitopt.stability.cycle import Cycle
from gaitopt.stability.cycle_iteration import find_cycle, same_gait, search_section, shortest_period
from gaitopt.stability.deflation import Deflation, KnownPoint
from gaitopt.stability.fall_prediction import FallPrediction, predict_falls
from gaitopt.stability.fixed_point import FixedPointOptions
from gaitopt.stability.linearisation import Linearisation
from gaitopt.stability.period_doubling import doubled_starts, locate_doubled_gaits
from gaitopt.stability.random_starts import random_walks
from gaitopt.stability.return_map import Passage, ReturnMap
from gaitopt.stability.section_walk import natural_rate, natural_scale, take_walk
from gaitopt.stability.start import choose_start

STARTS = 32
"""Default number of random starts."""
REPULSION = 0.6
"""Distance up to which a known gait repels Newton's method, relative to the natural size of the coordinates."""
LARGEST_FACTOR = 1e4
"""Factor of the deflation above which a start is considered a known gait."""
ITERATION = FixedPointOptions(
    max_iterations=15, smallest_step=1 / 9, reduction=3, accept_zero=False, compare_corrections=True
)
"""Newton's method in the search: most starts are far from any gait, so each is abandoned early."""
FURTHER_WALKS = 0.25
"""Number of further walks in which only close returns are sought, relative to the number of starts."""
WALK_PERIODS = 4
"""Length of the walks in which close returns are sought, relative to the longest period."""
MAX_STEP_TIME = 20.0
"""Longest step, relative to the natural time sqrt(l / g)."""


@check_arguments
def find_cycles(
    robot: Robot,
    parameters: Mapping[str, float],
    *,
    law: Law | None = None,
    sequence: ContactSequence | str | None = None,
    steps: int = 1,
    starts: int | Sequence[Mapping[str, float]] = STARTS,
    seed: int = 0,
    engine: Engine | None = None,
) -> tuple[Cycle, ...]:
    """Search for periodic gaits systematically and return every distinct one.

    Newton's method on the return map starts from random states and is deflated by the gaits already found.  Gaits of
    several steps are sought near gaits of half their period with a multiplier near or below -1, and where walks from
    the random states return closely.

    Parameters
    ----------
    robot : Robot
    parameters : mapping of str to float
        Robot and ground parameters; those not named keep their defaults.
    law : Law, optional
        Passive by default.
    sequence : ContactSequence or str, optional
        Keep only gaits all of whose steps have this contact sequence.
    steps : int
        Longest period in steps.  Each gait is returned once, with its own period and the multipliers of this period.
    starts : int or sequence of mappings of str to float
        Number of random starts from which the walker completes a step, or given states such as ``cycle.state``:
        coordinates of the section by name, without foot speed for a foot at rest.
    seed : int
        Seed of the random starts.
    engine : Engine, optional

    Returns
    -------
    tuple of Cycle
        Stable gaits first, then by contact sequence.

    Raises
    ------
    InputError
        If a parameter, a number, a state or the contact sequence is invalid.

    Examples
    --------
    >>> import math
    >>> from gaitopt import find_cycles, rimless_wheel
    >>> gaits = find_cycles(rimless_wheel(), {"slope": math.radians(13)}, starts=20)
    >>> [(gait.sequence, round(gait.radius, 6)) for gait in gaits]
    [('stick | stick', 0.734042)]
    """
    requested = (
        None
        if sequence is None
        else str(ContactSequence.parse(sequence).require_closed("A search for cycles").check_periodic())
    )
    cycles = search_cycles(robot, parameters, law=law, steps=steps, starts=starts, seed=seed, engine=engine)
    return sort_cycles(
        cycle for cycle in cycles if requested is None or {str(each) for each in cycle.sequences} == {requested}
    )


def sort_cycles(cycles: Iterable[Cycle]) -> tuple[Cycle, ...]:
    """Return gaits in the order they are reported: stable ones first, then by contact sequence."""
    return tuple(sorted(cycles, key=lambda cycle: (not cycle.stable, cycle.sequence, cycle.radius)))


def search_cycles(
    robot: Robot,
    parameters: Mapping[str, float],
    *,
    law: Law | None = None,
    steps: int = 1,
    starts: int | Sequence[Mapping[str, float]] = STARTS,
    seed: int = 0,
    engine: Engine | None = None,
) -> Iterator[Cycle]:
    """Yield each distinct periodic gait when it is found; see :func:`find_cycles`."""
    steps = int(Parameter("steps", 1, "1", "", lower=1, whole=True).check(steps))
    p = robot.vector(robot.resolve(parameters))
    law, limit = law or passive(robot), MAX_STEP_TIME / natural_rate(robot, p)[0]
    walker = Walker(robot, law, p, engine or default_engine(law, robot), step_limits=StepLimits(duration=limit))
    if isinstance(starts, Sequence) and not isinstance(starts, str):
        yield from _CycleSearch(walker, steps).find_from(_read_starts(walker, starts))
        return
    count = int(Parameter("starts", 1, "1", "", lower=1, upper=1_000_000, whole=True).check(starts))
    yield from _CycleSearch(walker, steps, predict_falls(walker)).find_from_random_starts(count, seed)


def _read_starts(walker: Walker, starts: Sequence[Mapping[str, float]]) -> list[Array]:
    """Return states given by name as points of the section of the search."""
    names, points = search_section(walker).names, []
    for start in starts:
        check_type("a start", start, Mapping, "a state by name such as cycle.state")
        state = choose_start(walker.robot, walker.p, start)
        if "foot_speed" not in names and state["foot_speed"]:
            raise InputError(
                f"A start with infinite friction must have foot_speed 0 m/s, got {state['foot_speed']:g} m/s."
            )
        points.append(np.array([state[name] for name in names], dtype=float))
    return points


class _CycleSearch:
    """Search for the gaits of a walker with periods of up to a number of steps.

    Parameters
    ----------
    walker : Walker
    steps : int
    prediction : FallPrediction, optional
        If given, steps from states it excludes are not simulated.
    """

    def __init__(self, walker: Walker, steps: int, prediction: FallPrediction | None = None) -> None:
        self._walker, self._steps, self._prediction = walker, steps, prediction
        self._section, linearisation = search_section(walker), Linearisation(walker)
        self._return_maps = {
            period: ReturnMap(walker, self._section, period, linearisation, prediction)
            for period in range(1, steps + 1)
        }
        self._known: dict[Cycle, tuple[KnownPoint, ...]] = {}

    def find_from_random_starts(self, count: int, seed: int) -> Iterator[Cycle]:
        """Yield gaits of one step from random starts, then gaits of more steps."""
        walks, further = [], int(FURTHER_WALKS * count) if self._steps > 1 else 0
        for walk in random_walks(self._walker, self._section, count + further, self._length, seed, self._prediction):
            walks.append(walk.points)
            if len(walks) > count:
                continue
            yield from self._converge(walk.points[0], 1, self._known, passage=walk.first)
            # Gaits with large multipliers are found from states after a step only.
            yield from self._converge(walk.points[1], 1, self._known)
        yield from self._find_longer(walks)

    def find_from(self, starts: Iterable[Array]) -> Iterator[Cycle]:
        """Yield gaits of each period from given starts, then gaits of more steps."""
        walks = []
        for z in starts:
            with defer_interrupt():
                walks.append(take_walk(self._walker, self._section, z, self._length).points)
            for period in range(1, self._steps + 1):
                yield from self._converge(z, period, self._known)
        yield from self._find_longer(walks)

    @property
    def _length(self) -> int:
        return WALK_PERIODS * self._steps if self._steps > 1 else 1

    def _find_longer(self, walks: list[Array]) -> Iterator[Cycle]:
        """Yield gaits of two and more steps, from period doublings and from close returns of walks."""
        scaled = [walk / natural_scale(self._walker, self._section, walk[-1]) for walk in walks]
        for period in range(2, self._steps + 1):
            for cycle in [cycle for cycle in self._known if 2 * len(cycle.points) == period]:
                yield from self._find_doubled_gaits(cycle, period)
            for number, at in close_returns(scaled, period):
                yield from self._converge(walks[number][at], period, self._known)

    def _find_doubled_gaits(self, cycle: Cycle, period: int) -> Iterator[Cycle]:
        """Yield gaits of the doubled period, from their estimated amplitude or, if that fails, from several."""
        scale = natural_scale(self._walker, cycle.section, cycle.z)
        return_map = self._return_maps[period].on_section(cycle.section)
        count = len(self._known)
        with defer_interrupt():
            located = list(locate_doubled_gaits(cycle, scale, return_map))
        for z, size in located:
            yield from self._converge(self._lift(cycle, z), period, [cycle], size / 2)
        if any(len(other.points) == period for other in list(self._known)[count:]):
            return
        for z, size in doubled_starts(cycle, scale):
            yield from self._converge(self._lift(cycle, z), period, [cycle], size)

    def _converge(
        self,
        z: Array,
        period: int,
        deflated: Iterable[Cycle],
        repulsion: float = REPULSION,
        *,
        passage: Passage | None = None,
    ) -> Iterator[Cycle]:
        """Yield the gait to which Newton's method, deflated by some gaits, converges from a start, if it is new."""
        cycles = [cycle for cycle in deflated if period % len(cycle.points) == 0]
        known = [point for cycle in cycles for point in self._known[cycle]]
        deflation = Deflation([KnownPoint(point, repulsion * scale) for point, scale in known])
        if not deflation.factor(z) < LARGEST_FACTOR:
            return
        with defer_interrupt():
            cycle = self._iterate(z, period, deflation, passage)
            if cycle is not None and (shortest := shortest_period(cycle)) < period:
                cycle = self._iterate(self._lift(cycle, cycle.z), shortest)
        if cycle is not None and not any(same_gait(cycle, other) for other in self._known):
            points = [self._lift(cycle, point) for point in cycle.points]
            scales = [natural_scale(self._walker, self._section, point) for point in points]
            self._known[cycle] = tuple(map(KnownPoint, points, scales))
            yield cycle

    def _iterate(
        self, z: Array, period: int, deflation: Deflation | None = None, passage: Passage | None = None
    ) -> Cycle | None:
        return find_cycle(
            self._walker,
            z,
            period,
            options=ITERATION,
            deflation=deflation,
            passage=passage,
            return_map=self._return_maps[period],
        )

    def _lift(self, cycle: Cycle, z: Array) -> Array:
        """Return a point of a gait's section as a point of the section of the search."""
        return self._section.project(cycle.section.embed(z))
