"""Repair of a plan whose contacts close too early or from below, or graze the ground: its gaps are increased.

The gaps are increased to the clearance in one solve, which may lead to another gait of several times the cost: if a
foot is 20 mm below the ground after its leg has passed the other one, and then rises to 11 mm, it need not be above the
ground throughout; it suffices that it rises more than it was deep.  If the cost is much higher, the depth is therefore
decreased in stages, each of which starts at the solution of the one before, until the touchdown is valid.  Then the
depth is increased again while the rise is bounded from below, as long as this decreases the cost.  The repair of lower
cost is kept.
"""

from collections.abc import Callable

from gaitopt.dataclass import dataclass
from gaitopt.motion.undecided_touchdowns import GRAZING
from gaitopt.ocp.multicontact.grid_result import GridResult
from gaitopt.status import Status

MOST_REPAIRS = 3
"""Largest number of further solves of a grid whose gaps are increased to the clearance."""

HIGHER_COST = 0.1
"""Increase of the cost by a repair, relative to that of the rejected plan, above which a repair in stages is tried."""

STAGES = 8
"""Number of stages in which the depth is decreased to zero."""

TRIALS = 4
"""Number of depths tried between those of the last invalid stage and the first valid one."""

RISE = 1.04
"""Ratio of the least rise of a contact to its largest depth in these trials."""

DECIDED = 1.02
"""Least ratio of the rise of a contact to its depth after a repair in stages: a replay evaluates both at other instants
than the plan."""

LESS = 1e-6
"""Relative difference from which one cost is lower than another one."""

Rows = dict[int, float]
"""Rows of gaps and their lower bounds [m or rad]."""

Solve = Callable[[GridResult, Rows], GridResult]
"""Solves the problem of a solution near this solution, with further bounds of its rows."""


@dataclass(frozen=True, eq=False)
class Repair:
    """A solution, and the rows that are bounded in it.

    Attributes
    ----------
    result : GridResult
    rows : dict of int to float
    """

    result: GridResult
    rows: Rows

    @property
    def status(self) -> Status:
        """Status of the solve."""
        return self.result.outcome.status

    @property
    def cost(self) -> float:
        """Objective of the solution."""
        return self.result.outcome.objective

    def solve(self, rows: Rows, solve: Solve) -> "Repair":
        """Return the solution near this one with bounded rows, or this one if the solve is interrupted."""
        result = solve(self.result, rows)
        if result.outcome.status is Status.INTERRUPTED:
            return Repair(self.result.mark_interrupted(result.outcome.message), self.rows)
        return Repair(result, rows)


def repair_touchdowns(given: Repair, solve: Solve, *, from_below: bool, in_stages: bool = True) -> Repair:
    """Return the solution of lowest cost without invalid touchdowns that is found, and its rows.

    If there is none, the last solution before the failure is returned.

    Parameters
    ----------
    given : Repair
        The solution to be repaired.
    solve : callable
    from_below : bool
        Whether touchdowns from below and grazes are invalid, and not early touchdowns alone.
    in_stages : bool
        Whether a repair in stages is tried if the gaps of the clearance lead to a much higher cost, or to no solution.
    """
    direct = _repair_directly(given, solve, from_below=from_below)
    if direct.status is Status.INTERRUPTED or not (given.status.ok and in_stages):
        return direct
    is_valid = not direct.result.list_repairs(from_below=from_below)
    if is_valid and direct.cost - given.cost <= HIGHER_COST * abs(given.cost):
        return direct
    gradual = _Stages(given, solve, from_below=from_below).run()
    if gradual is None or (gradual.status.ok and is_valid and not _costs_less(gradual, direct)):
        return direct
    return gradual


def _costs_less(repair: Repair, other: Repair) -> bool:
    """Return whether the cost of a repair is lower than that of another one, beyond rounding errors."""
    return other.cost - repair.cost > LESS * abs(other.cost)


def _repair_directly(repair: Repair, solve: Solve, *, from_below: bool) -> Repair:
    """Return the solution with gaps of the clearance, or the last one before a failure."""
    for _ in range(MOST_REPAIRS):
        rows = repair.result.list_repairs(from_below=from_below)
        if not rows or not repair.status.ok:
            break
        following = repair.solve(repair.rows | rows, solve)
        if following.status is Status.INTERRUPTED:
            return following
        if not following.status.ok:
            return Repair(repair.result, following.rows)
        repair = following
    return repair


class _Stages:
    """The stages in which the lower bound of the gaps of a solution is increased."""

    def __init__(self, given: Repair, solve: Solve, *, from_below: bool) -> None:
        self.given, self._solve, self._from_below = given, solve, from_below
        self.rows = given.result.list_repairs(from_below=from_below)
        gaps = given.result.outcome.g[list(self.rows)]
        self._depth = -float(gaps.min(initial=0.0))

    def run(self) -> Repair | None:
        """Return the valid solution of about the largest depth, or the interrupted one; None if there is none.

        If no depth is valid, the contact is above the ground, and then keeps the clearance.
        """
        invalid, depth = self.given, self._depth
        if depth <= GRAZING:
            return None
        for stage in range(1, STAGES):
            trial = self._depth * (1 - stage / STAGES)
            following = self._bound_depth(trial, invalid)
            if following.status is Status.INTERRUPTED:
                return following
            if not following.status.ok:
                return None
            if self._is_decided(following.result):
                return self._search_depth(trial, depth, following)
            self.rows = following.result.list_repairs(from_below=self._from_below) | self.rows
            invalid, depth = following, trial
        return self._keep_clearance(invalid)

    def _keep_clearance(self, start: Repair) -> Repair | None:
        """Return the solution with gaps of the clearance near another one, if it is valid."""
        repair = _repair_directly(Repair(start.result, self.given.rows), self._solve, from_below=self._from_below)
        if repair.status is Status.INTERRUPTED:
            return repair
        return None if repair.result.list_repairs(from_below=self._from_below) else repair

    def _search_depth(self, depth: float, too_deep: float, valid: Repair) -> Repair:
        """Return the valid solution of lowest cost between two depths, with a rise that is larger than the depth.

        To increase the rise may cost less than to decrease the depth.  The larger part of the interval around the best
        depth is halved.
        """
        shallower, best, deeper = depth, depth, too_deep
        for _ in range(TRIALS):
            trial = (best + deeper) / 2 if deeper - best >= best - shallower else (best + shallower) / 2
            highest = dict.fromkeys(valid.result.list_highest_rows(), RISE * trial)
            following = self._bound_depth(trial, valid, highest)
            if following.status is Status.INTERRUPTED:
                return following
            if following.status.ok and self._is_decided(following.result) and following.cost < valid.cost:
                shallower, deeper = (best, deeper) if trial > best else (shallower, best)
                valid, best = following, trial
            elif trial > best:
                deeper = trial
            else:
                shallower = trial
        return valid

    def _bound_depth(self, depth: float, start: Repair, further: Rows | None = None) -> Repair:
        """Return the solution near another one whose contacts are at most at a depth, with further bounds."""
        rows = {row: min(least, -depth) for row, least in self.rows.items()}
        return start.solve(self.given.rows | rows | (further or {}), self._solve)

    def _is_decided(self, result: GridResult) -> bool:
        """Return whether the touchdowns of a solution are valid by a margin."""
        rises = all(each.rise > DECIDED * each.depth for each in result.penetrations if each.lands)
        return rises and not result.list_repairs(from_below=self._from_below)
