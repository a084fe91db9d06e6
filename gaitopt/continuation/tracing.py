"""trace: branches of periodic gaits over a parameter, through folds, doublings and changes of contact sequence."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field, replace

import attrs
import numpy as np

from gaitopt.arguments import check_arguments, check_record
from gaitopt.continuation.branch_diagram import BranchDiagram, GaitBranch
from gaitopt.continuation.checkpoint import Checkpoint
from gaitopt.continuation.following import BranchFollower, WorkObserver
from gaitopt.continuation.gait_family import name_structure
from gaitopt.continuation.gait_source import (
    AnyCycle,
    AnyFamily,
    AnyWalkProblem,
    GaitSource,
    GaitStart,
    make_gait_source,
)
from gaitopt.continuation.pseudo_arclength import ArclengthOptions, CurvePoint, Stepper
from gaitopt.continuation.special_point import SpecialKind, SpecialPoint, merge_changes, merge_folds
from gaitopt.continuation.switching import has_half_period, switch_branch
from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError, NoGaitError
from gaitopt.motion.quantity_labels import state_value
from gaitopt.parameters import whole_number
from gaitopt.simulation.engine import Engine
from gaitopt.simulation.planar_simulation.planar_engine import PlanarEngine
from gaitopt.stability.cycle_search import STARTS

SAME_GAIT = 1e-5
"""Largest scaled distance of a gait from a branch to which it belongs."""
ONE_CHANGE = 1e-8
"""Relative distance of changes of the contact sequence that are one change."""
DOUBLING_STEPS = 0.4
"""Factor of the step lengths from one doubled branch to the next, whose range is shorter."""

MOST_DOUBLINGS = 20
"""Largest number of branches of doubled period."""

BranchObserver = Callable[[GaitBranch], None]
"""Called with a branch whenever a point of it has been added."""


@check_record
@attrs.frozen(kw_only=True)
class TraceOptions:
    """Options of :func:`trace`.

    Attributes
    ----------
    doublings : int
        Number of branches of doubled period to follow, each from the first period doubling of the one before up to
        its own.  At most 20, a period of a million steps.
    deflate : bool
        Whether to search for further gaits at both ends and in the middle of the range, and to follow them too.
    starts : int
        Random starts of each search for gaits.
    arclength : ArclengthOptions
    engine : Engine or PlanarEngine, optional
        By default the fastest installed engine that supports the law; for robots with several contacts, scipy.
    checkpoint : Checkpoint, optional
        File from which an interrupted trace continues.

    Examples
    --------
    >>> TraceOptions(doublings=3).deflate
    False
    """

    doublings: int = attrs.field(default=0, validator=whole_number(0, MOST_DOUBLINGS))
    deflate: bool = False
    starts: int = attrs.field(default=STARTS, validator=whole_number())
    arclength: ArclengthOptions = attrs.field(factory=ArclengthOptions)
    engine: Engine | PlanarEngine | None = None
    checkpoint: Checkpoint | None = None


@check_arguments
def trace(
    problem: AnyWalkProblem,
    over: Mapping[str, tuple[float, float]],
    *,
    start: AnyCycle | None = None,
    options: TraceOptions | None = None,
    observer: BranchObserver | None = None,
) -> BranchDiagram:
    """Follow periodic gaits as a parameter varies, and locate every special point.

    Pseudo-arclength continuation follows each branch around folds and through changes of the contact sequence.
    Bifurcations are located as zeros of test functions, changes of the contact sequence by bisection to 1e-10.

    Parameters
    ----------
    problem : WalkProblem or PlanarWalkProblem
        Robot, law and parameters.
    over : mapping of str to (float, float)
        One parameter of robot or ground, or gain of the law, and its range in SI units.
    start : Cycle or PlanarCycle, optional
        Gait to start from; by default the first stable gait at the first end of the range, or at the value of the
        problem if none is found there.
    options : TraceOptions, optional
    observer : callable, optional
        Called with the branch that is being followed after each of its points.

    Returns
    -------
    BranchDiagram

    Raises
    ------
    InputError
        If the parameter is unknown, the range does not contain the start, or there is no gait to start from.

    Examples
    --------
    >>> import math
    >>> from gaitopt import WalkProblem, rimless_wheel, trace
    >>> wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": math.radians(13)})
    >>> diagram = trace(wheel, {"friction": (1.0, 0.9)})
    >>> [str(point) for point in diagram.branches[0].special]
    ['slip_onset at 0.9141207839: stick | stick -> stick slip+ | stick']
    """
    branches = tuple(trace_branches(problem, over, start=start, options=options, observer=observer))
    return make_diagram(problem, over, branches)


def make_diagram(
    problem: AnyWalkProblem,
    over: Mapping[str, tuple[float, float]],
    branches: Sequence[GaitBranch],
    *,
    complete: bool = True,
) -> BranchDiagram:
    """Return the diagram of branches."""
    source = make_gait_source(problem, over)
    return BranchDiagram(
        robot=problem.robot.name,
        parameter=source.parameter,
        unit=source.unit,
        parameters={name: value for name, value in source.values.items() if name != source.parameter},
        ends=source.ends,
        branches=tuple(branches),
        complete=complete,
    )


def trace_branches(
    problem: AnyWalkProblem,
    over: Mapping[str, tuple[float, float]],
    *,
    start: AnyCycle | None = None,
    options: TraceOptions | None = None,
    observer: BranchObserver | None = None,
    work_observer: WorkObserver | None = None,
) -> Iterator[GaitBranch]:
    """Yield each branch when it has been followed; see :func:`trace`.

    The `work_observer` is called with each step and each location of a special point that begins.
    """
    options = options or TraceOptions()
    source = make_gait_source(problem, over, options.engine)
    tracer = _Tracer(source, options, observer or (lambda branch: None), work_observer)
    first = tracer.find_start() if start is None else source.start(start)
    low, high = min(source.ends), max(source.ends)
    if not low <= first.value <= high:
        start_value, *ends = (state_value(value, source.unit) for value in (first.value, *source.ends))
        raise InputError(
            f"The range of {source.parameter} must contain the start, at {start_value}; it is {' to '.join(ends)}."
        )
    yield from tracer.follow_gait(first)
    if options.deflate:
        yield from tracer.follow_further_gaits()


@dataclass(eq=False)
class _Tracer:
    """Branches of the gaits of a walking problem."""

    source: GaitSource
    options: TraceOptions
    observer: BranchObserver
    work_observer: WorkObserver | None = None
    branches: list[GaitBranch] = field(default_factory=list)
    _continuations: list[CurvePoint] = field(default_factory=list)

    def find_start(self) -> GaitStart:
        """Return the first gait, stable if there is one, at the first end of the range or the value of the problem."""
        source = self.source
        value, ends = source.values[source.parameter], source.ends
        inside = [value] if min(ends) <= value <= max(ends) else []
        for place in dict.fromkeys([ends[0], *inside]):
            for gait in source.search(place, self.options.starts):
                return source.start(gait, place)
        unit = "" if source.unit in ("", "1") else f" {source.unit}"
        raise NoGaitError(
            f"No periodic gait of {source.problem.name!r} was found at {source.parameter} = {ends[0]:g}{unit}; begin "
            f"the range where there is a gait. {source.explain_failure(ends[0])}".rstrip()
        )

    def follow_further_gaits(self) -> Iterator[GaitBranch]:
        """Yield the branches of the gaits at the ends and in the middle of the range that are on no branch yet."""
        first, last = self.source.ends
        for value in (first, (first + last) / 2, last):
            for cycle in self.source.search(value, self.options.starts):
                start = self.source.start(cycle, value)
                if not self._is_known(start):
                    yield from self.follow_gait(start)

    def follow_gait(self, start: GaitStart) -> Iterator[GaitBranch]:
        """Yield the branch of a gait, in both directions, and the branches that begin at its period doublings."""
        family, z, value = start
        stepper, ends = Stepper(family, self.options.arclength, self.options.checkpoint), self.source.ends
        towards = np.sign(ends[1] - ends[0])
        sides = list[GaitBranch]()
        for direction in (towards, -towards):
            if value == ends[1 if direction == towards else 0]:
                continue
            point = stepper.initialise(z, value, direction)
            if point is not None:
                sides.append(self._follow(family, stepper, point, other_side=sides[0] if sides else None))
        if not sides:
            raise InputError(
                f"The start is not a periodic gait at {self.source.parameter} = {value:.6g}; find one there with "
                "find_cycles, or omit the start."
            )
        branch = sides[0] if len(sides) == 1 else _join_sides(sides[1], sides[0])
        number = len(self.branches)
        yield self._add(branch)
        yield from self._follow_doublings(family, branch, number, self.options.doublings - 1)
        for beyond in self._take_continuations():
            cycle = family.cycle(beyond.z, beyond.value)
            if cycle is None:
                continue
            continuation = self.source.start(cycle, beyond.value)
            if not self._is_known(continuation):
                yield from self.follow_gait(continuation)

    def _take_continuations(self) -> list[CurvePoint]:
        """Return the gaits as which the last branches continue in another family, once."""
        taken, self._continuations = self._continuations, []
        return taken

    def _follow_doublings(self, family: AnyFamily, branch: GaitBranch, number: int, left: int) -> Iterator[GaitBranch]:
        """Yield the branch of doubled period at the first period doubling of a branch, and those that follow it."""
        doublings = branch.special_of(SpecialKind.PERIOD_DOUBLING)
        if left < 0 or not doublings:
            return
        level = self.options.doublings - left
        arclength = self.options.arclength
        factor = DOUBLING_STEPS**level
        arclength = attrs.evolve(
            arclength, first_step=factor * arclength.first_step, longest_step=factor * arclength.longest_step
        )
        doubled = family.double_period()
        # The distances of the states shrink by about DOUBLING_STEPS from one doubling to the next, too.
        reduction, checkpoint = DOUBLING_STEPS ** (level - 1), self.options.checkpoint
        switched = switch_branch(doubled, doublings[0], arclength, reduction=reduction, checkpoint=checkpoint)
        if switched is None:
            return
        following = replace(self._follow(doubled, *switched, to_doubling=True), parent=number)
        number = len(self.branches)
        yield self._add(following)
        yield from self._follow_doublings(doubled, following, number, left - 1)

    def _add(self, branch: GaitBranch) -> GaitBranch:
        self.branches.append(branch)
        return branch

    def _follow(
        self,
        family: AnyFamily,
        stepper: Stepper,
        start: CurvePoint,
        *,
        to_doubling: bool = False,
        other_side: GaitBranch | None = None,
    ) -> GaitBranch:
        """Return the branch from a point on; or up to its first period doubling.

        The observer is called with this branch joined with that on the other side of the start, if there is one.
        """
        ends, keeps, work = self.source.ends, family.keeps_coordinates, self.work_observer
        follower = BranchFollower(stepper, ends, name_structure, continues=keeps, work_observer=work)
        points, special = list[CurvePoint](), list[SpecialPoint]()
        for item in follower.follow(start):
            if isinstance(item, CurvePoint):
                points.append(item)
                branch = _make_branch(family, points, special, "interrupted")
                self.observer(branch if other_side is None else _join_sides(branch, other_side))
                continue
            if item.kind is SpecialKind.FOLD and points and has_half_period(points[-1].orbit, family.scale):
                follower.end = "period_halving"
                break
            special.append(item)
            if to_doubling and item.kind is SpecialKind.PERIOD_DOUBLING:
                follower.end = item.kind.key
                break
        if follower.beyond is not None:
            self._continuations.append(follower.beyond)
        return _make_branch(family, points, special, follower.end)

    def _is_known(self, start: GaitStart) -> bool:
        """Return whether a gait lies on a branch that has been followed."""
        family, z, value = start
        stepper = Stepper(family, self.options.arclength, self.options.checkpoint)
        for branch in self.branches:
            if (branch.steps, branch.names) != (family.steps, family.names):
                continue
            for near in points_at(branch, value):
                point = stepper.initialise(near, value, 1.0)
                if point is not None and np.max(np.abs((point.z - z) / family.scale)) < SAME_GAIT:
                    return True
        return False


def points_at(branch: GaitBranch, value: float) -> Iterator[np.ndarray]:
    """Yield the states at which a branch passes a value, by linear interpolation between its points."""
    for k in range(branch.values.size - 1):
        one, other = branch.values[k], branch.values[k + 1]
        slack = 1e-12 * abs(value)
        if min(one, other) - slack <= value <= max(one, other) + slack and one != other:
            share = (value - one) / (other - one)
            yield branch.states[k] + share * (branch.states[k + 1] - branch.states[k])


def _make_branch(
    family: AnyFamily, points: Sequence[CurvePoint], special: Sequence[SpecialPoint], end: str
) -> GaitBranch:
    width = ONE_CHANGE * family.value_scale
    merged = merge_folds(merge_changes(special, width, family.classify_names), width, family.scale)
    points = list(drop_spurious(points, special, merged, width))
    multipliers = np.full((len(points), family.size), np.nan, dtype=complex)
    for row, point in zip(multipliers, points, strict=True):
        row[: point.multipliers.size] = point.multipliers
    return GaitBranch(
        steps=family.steps,
        names=family.names,
        units=family.units,
        values=np.array([point.value for point in points]),
        orbits=np.array([point.orbit for point in points]),
        multipliers=multipliers,
        sequences=tuple(name_structure(point.sample.structure) for point in points),
        special=tuple(merged),
        end=end,
    )


def drop_spurious(
    points: Sequence[CurvePoint], special: Sequence[SpecialPoint], merged: Sequence[SpecialPoint], width: float
) -> Iterator[CurvePoint]:
    """Yield the points of a branch without those of sequences that exist only within a width beside a special point."""
    known = {name for each in merged for name in (each.before, each.after)}
    known |= {name_structure(point.sample.structure) for point in points[:1]}
    for point in points:
        beside = any(abs(point.value - each.value) <= width for each in special)
        if not beside or name_structure(point.sample.structure) in known:
            yield point


def _join_sides(backward: GaitBranch, forward: GaitBranch) -> GaitBranch:
    """Return one branch from two that begin at the same gait and lead in opposite directions."""
    reverse = slice(None, 0, -1)
    special = [_reverse(point) for point in reversed(backward.special)]
    return replace(
        forward,
        values=np.concatenate([backward.values[reverse], forward.values]),
        orbits=np.concatenate([backward.orbits[reverse], forward.orbits]),
        multipliers=np.concatenate([backward.multipliers[reverse], forward.multipliers]),
        sequences=(*backward.sequences[reverse], *forward.sequences),
        special=(*special, *forward.special),
        begin=backward.end,
    )


def _reverse(point: SpecialPoint) -> SpecialPoint:
    """Return a special point as it is passed in the opposite direction; that of an end is unchanged."""
    if not point.multipliers_after.size:
        return point
    return replace(
        point,
        before=point.after,
        after=point.before,
        multipliers_before=point.multipliers_after,
        multipliers_after=point.multipliers_before,
    )
