"""Contact sequences of lowest cost over the parameter, and their exact borders."""

import itertools
import math
from collections.abc import Sequence

from gaitopt.continuation.optimal.cost_extremum import find_zero
from gaitopt.continuation.optimal.kkt_point import KktLinearisation
from gaitopt.continuation.optimal.optimal_branch import LowestCostChange
from gaitopt.continuation.optimal.path_following import PathFollower
from gaitopt.continuation.optimal.path_items import PathOptions, PathPoint

LOCATED = 1e-12
"""Accuracy, relative to the range, of values at which two costs are equal; costs have rounding errors."""

Trail = Sequence[KktLinearisation]
"""Points of a branch in order."""


def locate_borders(trails: Sequence[Trail], samples: Sequence[float]) -> tuple[LowestCostChange, ...]:
    """Return the borders between the ranges in which a branch has the lowest cost, in increasing order.

    Parameters
    ----------
    trails : sequence of Trail
        Branches over the same parameter.
    samples : sequence of float
        Values at which they have points, in increasing order.
    """
    columns = [[_find_minimum(trail, value) for trail in trails] for value in samples]
    borders = list[LowestCostChange]()
    for (one, left), (other, right) in itertools.pairwise(zip(samples, columns, strict=True)):
        first, last = _find_lowest(left), _find_lowest(right)
        if first != last:
            borders.append(_locate_border((one, other), (left, right), (first, last), trails))
    return tuple(borders)


def _find_minimum(trail: Trail, value: float) -> KktLinearisation | None:
    """Return the minimum of lowest cost of a branch at a value, or None."""
    slack = 1e-12 * (trail[0].nlp.width if trail else 1.0)
    points = [optimum for optimum in trail if abs(optimum.point.value - value) <= slack and optimum.negative == 0]
    return min(points, key=lambda optimum: optimum.cost, default=None)


def _find_lowest(column: Sequence[KktLinearisation | None]) -> int | None:
    """Return the number of the branch of lowest cost, or None."""
    costs = [(optimum.cost, number) for number, optimum in enumerate(column) if optimum is not None]
    return min(costs)[1] if costs else None


def _locate_border(
    ends: tuple[float, float],
    columns: tuple[Sequence[KktLinearisation | None], Sequence[KktLinearisation | None]],
    lowest: tuple[int | None, int | None],
    trails: Sequence[Trail],
) -> LowestCostChange:
    """Return the border between two samples: equal costs of two branches, or the end of one."""
    first, last = lowest
    names = ["" if number is None else str(trails[number][0].nlp.problem.sequence) for number in lowest]
    limits = list(ends)
    for place, number in ((1, first), (0, last)):  # the branch before may end, that after may begin in between
        if number is not None and columns[place][number] is None:
            end = _find_end(trails[number], ends)
            limits[place] = limits[place] if end is None else end
    if first is not None and last is not None:
        one, other = columns[0][first], columns[1][last]
        value = None if one is None or other is None else locate_equal_costs(one, other, (limits[0], limits[1]))
        optimum = None if one is None or value is None else move_exactly(one, value)
        if value is not None and optimum is not None:
            return LowestCostChange(
                value=value, width=4 * math.ulp(value), cost=optimum.cost, before=names[0], after=names[1]
            )
    value = next((limit for limit, end in zip(limits, ends, strict=True) if limit != end), math.nan)
    known = [optimum for optimum in (*columns[0], *columns[1]) if optimum is not None]
    width = known[0].nlp.width * PathOptions().shortest_step
    after = None if last is None else columns[1][last]
    cost = math.nan if after is None else after.cost
    return LowestCostChange(value=value, width=width, cost=cost, before=names[0], after=names[1], crossing=False)


def _find_end(trail: Trail, ends: tuple[float, float]) -> float | None:
    """Return the value at which a branch ends between two values, or None."""
    low, high = sorted(ends)
    values = [optimum.point.value for optimum in (trail[0], trail[-1])]
    return next((value for value in values if low <= value <= high), None)


def locate_equal_costs(one: KktLinearisation, other: KktLinearisation, ends: tuple[float, float]) -> float | None:
    """Return the value of the parameter at which two branches have the same cost, or None.

    Parameters
    ----------
    one, other : KktLinearisation
        A point of each branch.
    ends : (float, float)
        Values between which the costs change their order.
    """

    def difference(value: float) -> float:
        first, second = move_exactly(one, value), move_exactly(other, value)
        return math.nan if first is None or second is None else first.cost - second.cost

    return find_zero(difference, *ends)


def move_exactly(optimum: KktLinearisation, value: float) -> KktLinearisation | None:
    """Return the optimum at another value of the parameter, with all changes of the active set in between."""
    if value == optimum.point.value:
        return optimum
    follower = PathFollower(optimum.nlp, PathOptions(), sorted([optimum.point.value, value]))
    last = None
    for item in follower.follow(optimum, value - optimum.point.value):
        last = item.optimum if isinstance(item, PathPoint) else last
    return last if follower.end == "range_end" else None
