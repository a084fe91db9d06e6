"""Repair of touchdowns from below: the depth is decreased in stages if the clearance leads to a higher cost."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from gaitopt import Collocation, Ipopt, Status
from gaitopt.motion.ground_penetration import find_penetrations
from gaitopt.ocp import FromPlanarGait, solve_planar
from gaitopt.ocp.multicontact.touchdown_repair import DECIDED, HIGHER_COST, Repair, repair_touchdowns
from gaitopt.ocp.multicontact.touchdown_repair import RISE as RISE_TO_DEPTH
from gaitopt.simulation import verify_planar
from gaitopt.simulation.planar_verification import replay_planar
from tests.ocp.multicontact_examples import walk

DEPTH, RISE, CLEARANCE = 0.02, 0.011, 0.001
"""Depth and rise of the foot of a plan, and least gap [m]."""


@dataclass(frozen=True)
class Plan:
    """A plan of cost 1 whose foot is below the ground, and then rises; the bounds of its two rows increase the cost."""

    depth: float = DEPTH
    cost: float = 1.0
    rise: float = RISE
    status: Status = Status.SOLVED

    @property
    def outcome(self):
        return SimpleNamespace(status=self.status, objective=self.cost, g=np.array([-self.depth]), message="")

    @property
    def penetrations(self):
        return (SimpleNamespace(depth=self.depth, rise=self.rise, lands=True),) if self.depth > 0 else ()

    def list_repairs(self, *, from_below):
        return {0: CLEARANCE} if any(each.rise <= each.depth for each in self.penetrations) else {}

    def list_highest_rows(self):
        return [1]

    def mark_interrupted(self, message):
        return replace(self, status=Status.INTERRUPTED)


class Solves:
    """Solves of plans, with the cost and the status of those at the clearance, and the status of the others."""

    def __init__(self, cost, at_clearance=Status.SOLVED, below=Status.SOLVED):
        self.cost, self.at_clearance, self.below, self.bounds = cost, at_clearance, below, []

    def __call__(self, plan, rows):
        self.bounds.append(rows[0])
        if rows[0] == CLEARANCE:
            return Plan(-CLEARANCE, self.cost, status=self.at_clearance)
        raised = DEPTH + rows[0]  # the foot then also rises higher afterwards
        rise = max(RISE + raised, rows.get(1, 0.0))
        return Plan(-rows[0], 1 + raised**2 + 2 * (rise - RISE - raised) ** 2, rise=rise, status=self.below)


def test_the_clearance_is_kept_if_it_costs_little():
    solve = Solves(1 + 0.9 * HIGHER_COST)
    repair = repair_touchdowns(Repair(Plan(), {}), solve, from_below=True)
    assert (repair.cost, repair.rows, len(solve.bounds)) == (solve.cost, {0: CLEARANCE}, 1)


@pytest.mark.parametrize("solve", [Solves(5.0), Solves(1.0, Status.ITERATION_LIMIT)])
def test_otherwise_depth_and_rise_have_nearly_the_lowest_cost(solve):
    repair = repair_touchdowns(Repair(Plan(), {}), solve, from_below=True)
    depths = np.linspace(0, DEPTH, 10001)
    rises = np.maximum(RISE + DEPTH - depths, RISE_TO_DEPTH * depths)
    least = np.min(1 + (DEPTH - depths) ** 2 + 2 * (rises - RISE - DEPTH + depths) ** 2)
    assert 0 <= repair.cost - least < 0.01 * (least - 1)
    assert repair.rows == {0: -repair.result.depth, 1: repair.result.rise}
    assert repair.result.rise > DECIDED * repair.result.depth
    assert solve.bounds[0] == CLEARANCE


def test_the_repair_of_lower_cost_is_kept():
    solve = Solves(5.0, below=Status.ITERATION_LIMIT)
    repair = repair_touchdowns(Repair(Plan(), {}), solve, from_below=True)
    assert (repair.cost, repair.rows, len(solve.bounds)) == (5.0, {0: CLEARANCE}, 2)


@pytest.mark.parametrize(
    "solve", [Solves(5.0, Status.INTERRUPTED), Solves(5.0, below=Status.INTERRUPTED)], ids=["clearance", "stages"]
)
def test_an_interrupted_repair_returns_the_last_plan(solve):
    repair = repair_touchdowns(Repair(Plan(), {}), solve, from_below=True)
    assert (repair.status, repair.cost, repair.rows) == (Status.INTERRUPTED, 1.0, {})


def test_without_stages_the_clearance_is_kept_or_the_plan_remains_invalid():
    solve = Solves(5.0)
    repair = repair_touchdowns(Repair(Plan(), {}), solve, from_below=True, in_stages=False)
    assert (repair.cost, len(solve.bounds)) == (5.0, 1)
    given = Plan()
    failed = Solves(1.0, Status.ITERATION_LIMIT)
    assert repair_touchdowns(Repair(given, {}), failed, from_below=True, in_stages=False).result is given


def test_a_valid_plan_is_not_solved_again():
    solve, given = Solves(1.0), Repair(Plan(0.01), {3: 0.5})
    assert repair_touchdowns(given, solve, from_below=True) is given
    assert solve.bounds == []


FROM_BELOW = 4.494156
"""Cost of the optimum whose foot is 6.7 mm below the ground with its leg in front, and then rises to 3.5 mm."""

SOLVER = Ipopt(max_iterations=100)
"""With gaps of the clearance, 500 iterations do not suffice either."""


def slow_walk():
    return walk(speed=0.25, friction=0.4, transcription=Collocation(intervals=24))


@pytest.fixture(scope="module")
def repaired():
    return verify_planar(solve_planar(slow_walk(), solver=SOLVER))


@pytest.mark.slow
def test_the_foot_rises_more_than_it_was_deep(repaired):
    assert repaired.verification.passed
    assert repaired.solver.warnings == ()
    assert FROM_BELOW < repaired.solver.objective < 1.13 * FROM_BELOW
    for motion in (repaired.motion, replay_planar(repaired).motion):
        (penetration,) = find_penetrations(repaired.robot, motion)
        assert 4e-3 < penetration.depth < 6e-3
        assert penetration.rise > penetration.depth


@pytest.mark.slow
def test_the_clearance_does_not_affect_a_foot_below_the_ground(repaired):
    assert repaired.certificate.strict
    assert "clearance" not in {one.name for one in repaired.certificate.sensitivities}


@pytest.mark.slow
def test_the_same_problem_is_solved_again_with_the_same_bounds(repaired):
    again = solve_planar(slow_walk().replace(guess=FromPlanarGait(repaired)), solver=SOLVER)
    assert again.status is Status.SOLVED
    assert again.solver.objective == pytest.approx(repaired.solver.objective, rel=1e-5)
    assert again.solver.iterations < 20
