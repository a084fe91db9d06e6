"""trace_optimum: branches of optimal gaits over a parameter, target or limit of their problem."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import attrs
import numpy as np

from gaitopt.arguments import check_arguments, check_record
from gaitopt.continuation.optimal.branch_recorder import BranchRecorder
from gaitopt.continuation.optimal.branch_start import list_samples, start_branch
from gaitopt.continuation.optimal.kkt_point import KktLinearisation
from gaitopt.continuation.optimal.lowest_cost import locate_borders
from gaitopt.continuation.optimal.optimal_branch import OptimalBranch, OptimalDiagram, OptimalSpecialPoint
from gaitopt.continuation.optimal.optimum_replay import solve_result
from gaitopt.continuation.optimal.parametric_nlp import find_number
from gaitopt.continuation.optimal.path_following import PathFollower
from gaitopt.continuation.optimal.path_items import PathOptions, PathPoint
from gaitopt.continuation.optimal.sequence_neighbours import list_neighbours
from gaitopt.errors import InputError
from gaitopt.motion.contact_sequence import ContactSequence
from gaitopt.motion.gait import Gait
from gaitopt.ocp.problem import GaitProblem
from gaitopt.ocp.solver import solve
from gaitopt.ocp.statement.warm_start import FromMotion
from gaitopt.parameters import check_type, optional, whole_number
from gaitopt.simulation.engine import Engine
from gaitopt.status import Status

OptimumObserver = Callable[[OptimalBranch], None]
"""Called with a branch whenever a point of it has been added."""

UNITS = {"speed": "m/s", "step_length": "m"}
"""Units of the parameters that do not belong to the robot or the ground."""


def _check_sequences(options: object, attribute: object, sequences: tuple[str | ContactSequence, ...]) -> None:
    for sequence in sequences:
        ContactSequence.parse(str(sequence))


@check_record
@attrs.frozen(kw_only=True)
class OptimumOptions:
    """Options of :func:`trace_optimum`.

    Attributes
    ----------
    points : int
        Equally spaced values of the parameter at which gaits are computed.
    replay : int
        Number of points from one replayed gait to the next; 0 for no replay.
    starts : int, optional
        Starts of the solve at the first end of the range; see :func:`gaitopt.solve`.
    sequences : tuple of str or ContactSequence
        Further contact sequences, whose branches are followed over the same range.
    neighbours : bool
        Whether the neighbouring contact sequences are followed too: those with a slipping impact from the point at
        which a sticking impact reaches its friction cone, and those without a slip phase from the point at which this
        phase has its minimum duration.
    path : PathOptions
    engine : Engine, optional
        Engine of the replays; by default the fastest installed one.

    Examples
    --------
    >>> OptimumOptions(replay=10).points
    50
    """

    points: int = attrs.field(default=50, validator=whole_number(2))
    replay: int = attrs.field(default=1, validator=whole_number(0))
    starts: int | None = attrs.field(default=None, validator=optional(whole_number()))
    sequences: tuple[str | ContactSequence, ...] = attrs.field(default=(), validator=_check_sequences)
    neighbours: bool = False
    path: PathOptions = attrs.field(factory=PathOptions)
    engine: Engine | None = None


@check_arguments
def trace_optimum(
    problem: GaitProblem,
    over: Mapping[str, tuple[float, float]],
    *,
    start: Gait | None = None,
    options: OptimumOptions | None = None,
    observer: OptimumObserver | None = None,
) -> OptimalDiagram:
    """Follow optimal gaits as a parameter of their problem varies, and locate every change of the active constraints.

    The grid of the first gait is kept.  Its optimality conditions are continued over the parameter; the parameter is
    friction, slope, speed, step length, a parameter of the robot or a limit.  A constraint that becomes active or
    inactive is a special point, located by Newton's method.  Gaits are replayed in the event-driven simulator.

    Parameters
    ----------
    problem : GaitProblem
        With an objective such as cost of transport, whose optima have intervals without torque, several constraints
        change together; the optimum beyond such a point is found by a solve from there.
    over : mapping of str to (float, float)
        One parameter of the problem and its range in SI units, named as in the certificate's sensitivities, such as
        ``"friction"`` or ``"torque_limit of hip"``.
    start : Gait, optional
        Solution of the problem; by default the problem is solved at the first end of the range.
    options : OptimumOptions, optional
    observer : callable, optional
        Called with the branch that is being followed after each of its points.

    Returns
    -------
    OptimalDiagram

    Raises
    ------
    InputError
        If the problem has no such parameter, or there is no optimum to start from.

    Examples
    --------
    >>> from gaitopt import Collocation, GaitProblem, Limits, compass_biped
    >>> problem = GaitProblem(robot=compass_biped(), sequence="stick | stick", friction=0.25, speed=0.6,
    ...                       step_length=0.45, limits=Limits(torque=6), objective="torque_squared",
    ...                       transcription=Collocation(intervals=10))
    >>> diagram = trace_optimum(problem, {"friction": (0.25, 0.15)}, options=OptimumOptions(points=5))
    >>> [point.constraint for point in diagram.branches[0].special][0]
    'forward friction cone at phase 1 (stick), node 10'
    """
    tracer = OptimumTracer(problem, over, options or OptimumOptions(), observer)
    branches = tuple(tracer.trace(start))
    return tracer.make_diagram(branches)


class OptimumTracer:
    """Branches of optimal gaits of a problem over one of its parameters, targets or limits.

    Parameters
    ----------
    problem : GaitProblem
    over : mapping of str to (float, float)
    options : OptimumOptions
    observer : callable or None
    """

    def __init__(
        self,
        problem: GaitProblem,
        over: Mapping[str, tuple[float, float]],
        options: OptimumOptions,
        observer: OptimumObserver | None,
    ) -> None:
        check_type("problem", problem, GaitProblem, "a GaitProblem(...)")
        self.problem, self.options, self.observer = problem, options, observer
        self.parameter, self.ends = _read_range(over)
        find_number(problem, self.parameter)
        self.points = list[list[KktLinearisation]]()
        self._changes = list[tuple[int, KktLinearisation, int]]()

    def trace(self, start: Gait | None) -> Iterator[OptimalBranch]:
        """Yield each branch when it has been followed."""
        yield self._follow_gait(self.problem, start)
        for sequence in self.options.sequences:
            yield self._follow_gait(self.problem.replace(sequence=sequence), None)
        if self.options.neighbours:
            yield from self._follow_neighbours()

    def _follow_neighbours(self) -> Iterator[OptimalBranch]:
        """Yield the branches of contact sequences that begin where a mode of a followed one is about to change."""
        known = {trail[0].nlp.problem.sequence for trail in self.points if trail}
        for parent, optimum, index in self._changes:  # to which the branches that are yielded append theirs
            for sequence in list_neighbours(optimum.nlp, index):
                if sequence in known:
                    continue
                known.add(sequence)
                guess = FromMotion(solve_result(optimum).motion, label="the gait of the neighbouring sequence")
                problem = optimum.problem.replace(sequence=sequence, guess=guess)
                gait = self._solve(problem)
                try:
                    branch = self._follow_gait(problem.without_guess(), gait)
                except InputError:  # no gait of this sequence exists at this place
                    continue
                yield replace(branch, parent=parent)

    def make_diagram(self, branches: Sequence[OptimalBranch], *, complete: bool = True) -> OptimalDiagram:
        """Return the diagram of branches."""
        parameters = {each.name: each.unit for each in self.problem.robot.parameters}
        name = self.parameter
        targets = {key: getattr(self.problem, key) for key in ("speed", "step_length") if key != name}
        return OptimalDiagram(
            robot=self.problem.robot.name,
            objective=self.problem.objective.name,
            parameter=name,
            unit=parameters.get(name, UNITS.get(name, "1")),
            parameters={key: value for key, value in self.problem.values.items() if key != name},
            ends=self.ends,
            branches=tuple(branches),
            borders=locate_borders([trail for trail in self.points if trail], self._samples) if complete else (),
            complete=complete,
            targets={key: float(value) for key, value in targets.items() if isinstance(value, int | float)},
        )

    @property
    def _samples(self) -> Sequence[float]:
        return list_samples(self.ends, self.options.points, self.ends[0])

    def _solve(self, problem: GaitProblem) -> Gait:
        """Return the result of a solve; raise KeyboardInterrupt if it was interrupted."""
        gait = solve(problem, starts=self.options.starts)
        if gait.status is Status.INTERRUPTED:
            raise KeyboardInterrupt
        return gait

    def _follow_gait(self, problem: GaitProblem, gait: Gait | None) -> OptimalBranch:
        """Return the branch of a gait, in both directions; by default of the solution at the first end of the range."""
        if gait is None:
            problem = find_number(problem, self.parameter).change(self.ends[0])
            gait = self._solve(problem)
            if not gait.status.ok:
                raise InputError(
                    f"No optimal gait '{problem.sequence}' was found at {self.parameter} = {self.ends[0]:g}: "
                    f"{gait.status.hint}"
                )
        value = find_number(problem, self.parameter).value
        if not min(self.ends) <= value <= max(self.ends):
            raise InputError(
                f"The range of {self.parameter} must contain the start, at {value:.6g}; it is {self.ends[0]:g} to "
                f"{self.ends[1]:g}."
            )
        optimum = start_branch(problem, self.parameter, self.ends, gait)
        towards = math.copysign(1.0, self.ends[1] - self.ends[0])
        sides, trails = list[OptimalBranch](), list[list[KktLinearisation]]()
        for direction, end in ((-towards, self.ends[0]), (towards, self.ends[1])):
            if value != end:
                branch, trail = self._follow(
                    optimum, direction, gait.solution.cost_factor if gait.solution else math.nan
                )
                sides.append(branch)
                trails.append(trail)
        self.points.append(trails[0] if len(trails) == 1 else [*reversed(trails[0][1:]), *trails[1]])
        return sides[0] if len(sides) == 1 else _join_sides(*sides)

    def _follow(
        self, start: KktLinearisation, direction: float, cost_factor: float
    ) -> tuple[OptimalBranch, list[KktLinearisation]]:
        options, nlp = self.options, start.nlp
        samples = list_samples(self.ends, options.points, start.point.value)
        follower = PathFollower(nlp, options.path, samples)
        recorder = BranchRecorder(nlp, options.replay, options.engine, cost_factor)
        self._changes += [(len(self.points), start, int(index)) for index in start.active.inequalities]
        last = start
        for item in follower.follow(start, direction):
            last = item.optimum
            if isinstance(item, PathPoint):
                recorder.add_point(item)
                if self.observer is not None:
                    self.observer(recorder.finish("interrupted"))
            else:
                recorder.add_change(item)
                if item.index >= 0:
                    self._changes.append((len(self.points), item.optimum, item.index))
        trail = recorder.points if follower.end == "range_end" else [*recorder.points, last]
        return recorder.finish(follower.end), trail


def _read_range(over: Mapping[str, tuple[float, float]]) -> tuple[str, tuple[float, float]]:
    if not isinstance(over, Mapping) or len(over) != 1:
        raise InputError(
            f"over must be one parameter of the problem with its range, such as {{'friction': (0.3, 0.1)}}, "
            f"got {over!r}."
        )
    ((parameter, ends),) = over.items()
    try:
        low, high = (float(end) for end in ends)
    except (TypeError, ValueError):
        raise InputError(f"The range of {parameter} must be two numbers, got {ends!r}.") from None
    if not (math.isfinite(low) and math.isfinite(high) and low != high):
        raise InputError(f"The range of {parameter} must have two different finite ends, got {low:g} to {high:g}.")
    return parameter, (low, high)


def _join_sides(backward: OptimalBranch, forward: OptimalBranch) -> OptimalBranch:
    """Return one branch from two that begin at the same gait and lead in opposite directions."""
    arrays: dict[str, Any] = {
        name: np.concatenate([value[:0:-1], getattr(forward, name)])
        for name, value in vars(backward).items()
        if isinstance(value, np.ndarray)
    }
    count = backward.values.size
    before = [replace(_reverse(point), place=count - point.place) for point in reversed(backward.special)]
    after = [replace(point, place=point.place + count - 1) for point in forward.special]
    return replace(forward, **arrays, special=(*before, *after), begin=backward.end)


def _reverse(point: OptimalSpecialPoint) -> OptimalSpecialPoint:
    """Return a special point as it is passed in the opposite direction."""
    kinds = {"activation": "deactivation", "deactivation": "activation"}
    return replace(point, kind=kinds.get(point.kind, point.kind), before=point.after, after=point.before)
