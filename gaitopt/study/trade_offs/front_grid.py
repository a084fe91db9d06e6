"""The grid of a front: bounds on quantities, and the tasks that solve it from both ends."""

from collections.abc import Mapping, Sequence
from dataclasses import field

import numpy as np

from gaitopt.dataclass import dataclass
from gaitopt.errors import InputError
from gaitopt.motion.motion import Array
from gaitopt.motion.planar_gait import AnyGait
from gaitopt.parallel.task_graph import Task
from gaitopt.study.multistart import objective
from gaitopt.study.trade_offs.front_solves import FrontSolves, solves_of
from gaitopt.study.trade_offs.quantity import COST, AnyProblem, Quantity

SAME_COST = 1e-7
"""Relative difference of costs below which two gaits of a point count as the same."""

INNER_FRACTION = 1e-3
"""Fraction of the range of a bound by which the tightest bound is less than extreme, where gaits are not unique."""

Index = tuple[int, ...]


@dataclass(frozen=True)
class FrontTask:
    """A task of a front.

    Attributes
    ----------
    kind : str
        ``"end"`` for the gait of lowest cost or of the best value of a quantity, ``"forward"`` and ``"backward"`` for
        gaits continued towards tighter and looser bounds, ``"forward-return"`` and ``"backward-return"`` for the better
        of those and of the gaits continued back from the other end, ``"forward-last"`` and ``"backward-last"`` for the
        best of all these and of the gaits continued from it, ``"point"`` for the verified best gait of a point.
    name : str
        Name of the quantity of an end, or of the point.
    index : tuple of int
        Number of the bound of each quantity, from the loosest.
    """

    kind: str
    name: str
    index: Index = ()


@dataclass(frozen=True, eq=False)
class FrontEnds:
    """The problems at the ends of a front.

    Attributes
    ----------
    problem : GaitProblem or PlanarProblem
    quantities : tuple of Quantity
        Those that are bounded.
    starts : int
        Number of starts of each end.
    tightest : mapping of str to float
        Stated tightest bounds by quantity; the best values of the other quantities are computed.
    """

    problem: AnyProblem
    quantities: tuple[Quantity, ...]
    starts: int
    tightest: Mapping[str, float] = field(default_factory=dict)

    @property
    def solves(self) -> FrontSolves:
        """How the gaits are solved."""
        return solves_of(self.problem)

    def tasks(self) -> list[Task]:
        """Return the tasks that solve the ends; those of the quantities are also warm-started from the lowest cost."""
        first = Task(f"end-{COST}", FrontTask("end", COST))
        return [first] + [
            Task(f"end-{quantity.name}", FrontTask("end", quantity.name), (first.key,)) for quantity in self.quantities
        ]

    def solve(self, task: FrontTask, *gaits: AnyGait | None) -> AnyGait:
        """Return the gait of lowest cost, or that of the best value or tightest bound of a quantity."""
        if task.name == COST:
            return self.solves.verify_best(self.problem, self.solves.solve_cold(self.problem, self.starts))
        quantity = next(quantity for quantity in self.quantities if quantity.name == task.name)
        known = [gait for gait in gaits if gait is not None and gait.status.ok]
        if quantity.restrict is None or task.name not in self.tightest:
            return self.solves.solve_extreme(self.problem, quantity, known, self.starts)
        problem = quantity.restrict(self.problem, self.tightest[task.name])
        solved = [self.solves.solve_near(problem, gait) for gait in known]
        return self.solves.best([*solved, *self.solves.solve_cold(problem, self.starts)])


@dataclass(frozen=True, eq=False)
class FrontGrid:
    """Bounds on quantities, from the loosest to the tightest, and the problem of each point.

    Attributes
    ----------
    ends : FrontEnds
    values : tuple of (K,) array
        Bounds of each quantity.
    """

    ends: FrontEnds
    values: tuple[Array, ...]

    @property
    def shape(self) -> Index:
        """Number of bounds of each quantity."""
        return tuple(values.size for values in self.values)

    def points(self) -> list[Index]:
        """Return every point, from the loosest bounds to the tightest."""
        return sorted(np.ndindex(*self.shape), key=sum)

    def problem_at(self, index: Index) -> AnyProblem:
        """Return the problem with the bounds of a point."""
        problem = self.ends.problem
        for quantity, values, i in zip(self.ends.quantities, self.values, index, strict=True):
            if quantity.restrict is not None:
                problem = quantity.restrict(problem, float(values[i]))
        return problem

    def tasks(self) -> list[Task]:
        """Return the tasks of the front: both ends, chains from each of them, and the best gait of each point."""
        points, planned = self.points(), self.ends.tasks()
        ends = [f"end-{quantity.name}" for quantity in self.ends.quantities]
        planned += self._chain("forward", points, -1, [f"end-{COST}"])
        planned += self._chain("backward", points[::-1], 1, ends)
        planned += self._chain("forward-return", points[::-1], 1, ["forward"])
        planned += self._chain("backward-return", points, -1, ["backward"])
        planned += self._last_chain("forward", points, -1)
        planned += self._last_chain("backward", points[::-1], 1)
        for index in points:
            name = point_name(index)
            needs = (f"forward-last-{name}", f"backward-last-{name}")
            planned.append(Task(f"point-{name}", FrontTask("point", name, index), needs))
        return planned

    def _chain(self, kind: str, points: list[Index], step: int, first: list[str]) -> list[Task]:
        """Return the tasks of a chain through all points; one that returns also needs the gaits of the chain before."""
        planned, returns = [], kind.endswith("-return")
        for index in points:
            name = point_name(index)
            needs = [f"{kind}-{point_name(other)}" for other in _neighbours(index, step, self.shape)]
            needs = [f"{first[0]}-{name}", *needs] if returns else needs or first
            planned.append(Task(f"{kind}-{name}", FrontTask(kind, name, index), tuple(needs)))
        return planned

    def _last_chain(self, kind: str, points: list[Index], step: int) -> list[Task]:
        """Return the tasks of a chain through the better gaits of both ends; those of each neighbour follow its own."""
        planned = []
        for index in points:
            needs: list[str] = []
            for other in [index, *_neighbours(index, step, self.shape)]:
                last = [] if other is index else [f"{kind}-last-{point_name(other)}"]
                needs += [f"forward-return-{point_name(other)}", f"backward-return-{point_name(other)}", *last]
            planned.append(Task(f"{kind}-last-{point_name(index)}", FrontTask(f"{kind}-last", "", index), tuple(needs)))
        return planned

    def solve(self, task: FrontTask, *gaits: AnyGait | None) -> AnyGait:
        """Return the gait of a task: that of a chain at a point, or the verified one of lowest cost."""
        problem = self.problem_at(task.index)
        if task.kind == "point":
            return self._solve_point(problem, gaits)
        if task.kind.endswith("-last"):
            return self._solve_last(problem, gaits)
        if task.kind.endswith("-return"):
            return self._solves.best(
                [gait for gait in gaits[:1] if gait is not None] + self._continue(problem, gaits[1:])
            )
        return self._solves.best(
            self._continue(problem, gaits) or self._solves.solve_cold(problem, self.ends.starts, refine=False)
        )

    @property
    def _solves(self) -> FrontSolves:
        return self.ends.solves

    def _solve_last(self, problem: AnyProblem, gaits: Sequence[AnyGait | None]) -> AnyGait:
        """Return the better gait of both ends, or one continued from a neighbour if both ends differ in cost."""
        known, others = [gait for gait in gaits[:2] if gait is not None], gaits[2:]
        neighbours = [others[i : i + 3] for i in range(0, len(others), 3)]
        if _have_same_cost(gaits[:2]) and all(map(_have_same_cost, neighbours)):
            return self._solves.best(known)
        return self._solves.best(known + self._continue(problem, [last for _, _, last in neighbours]))

    def _solve_point(self, problem: AnyProblem, gaits: Sequence[AnyGait | None]) -> AnyGait:
        """Return the gait of lowest cost, refined and verified; without one, a gait from the default starts."""
        known = _by_cost(gaits)
        if known:
            result: AnyGait = self._solves.verify_near(problem, known[0])
            if result.status.ok:
                return result
        return self._solves.verify_best(problem, self._solves.solve_cold(problem, self.ends.starts))

    def _continue(self, problem: AnyProblem, gaits: Sequence[AnyGait | None]) -> list[AnyGait]:
        """Return solutions warm-started from gaits, that of lowest cost first, until one is solved."""
        solved: list[AnyGait] = []
        for gait in _by_cost(gaits):
            solved.append(self._solves.solve_near(problem, gait, refine=False))
            if solved[-1].status.ok:
                break
        return solved


def solve_front_task(grid: FrontEnds | FrontGrid, task: FrontTask, *gaits: AnyGait | None) -> AnyGait:
    """Run a task of a front."""
    if isinstance(grid, FrontGrid) and task.kind == "end":
        return grid.ends.solve(task, *gaits)
    return grid.solve(task, *gaits)


def point_name(index: Index) -> str:
    """Return the name of a point in keys and files.

    Examples
    --------
    >>> point_name((3, 12))
    '003-012'
    """
    return "-".join(f"{i:03d}" for i in index)


def space_bounds(quantity: Quantity, loose: float, tight: float, points: int, inner: float = INNER_FRACTION) -> Array:
    """Return bounds of a quantity from loose to tight, the tightest less than extreme by a fraction of the range.

    Raises
    ------
    InputError
        If the gait of lowest cost already has the best value, so that there is no trade-off.

    Examples
    --------
    >>> from gaitopt.study.trade_offs.quantity import quantity_named
    >>> space_bounds(quantity_named("peak_torque"), 6.0, 2.0, 3)
    array([6.   , 4.   , 2.004])
    """
    if not quantity.sign * (loose - tight) > 1e-6 * abs(loose):
        unit = "" if quantity.unit == "1" else f" {quantity.unit}"
        raise InputError(
            f"There is no trade-off between cost and {quantity.name}: it is {loose:g}{unit} for the gait of "
            f"lowest cost, and its best value is {tight:g}{unit}."
        )
    values = np.linspace(loose, tight, points)
    values[-1] += inner * (loose - tight)
    return values


def _by_cost(gaits: Sequence[AnyGait | None]) -> list[AnyGait]:
    """Return the solutions among gaits, that of lowest cost first."""
    return sorted((gait for gait in gaits if gait is not None and gait.status.ok), key=objective)


def _have_same_cost(gaits: Sequence[AnyGait | None]) -> bool:
    """Return whether all gaits are solved, at the same cost."""
    costs = [gait.solver.objective for gait in gaits if gait is not None and gait.status.ok]
    return len(costs) == len(gaits) and max(costs) - min(costs) <= SAME_COST * abs(min(costs))


def _neighbours(index: Index, step: int, shape: Index) -> list[Index]:
    """Return the next points along each axis."""
    moved = [tuple(i + step * (k == axis) for k, i in enumerate(index)) for axis in range(len(index))]
    return [other for other in moved if all(0 <= i < count for i, count in zip(other, shape, strict=True))]
