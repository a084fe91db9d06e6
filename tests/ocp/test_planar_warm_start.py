"""Warm starts of gaits of robots with several contacts: fewer iterations, the same optimum, and when they apply."""

import attrs
import pytest

from gaitopt import Collocation, Status
from gaitopt.ocp import FromPlanarGait, solve_planar
from gaitopt.ocp.multicontact import planar_solver
from gaitopt.ocp.multicontact.early_touchdown import row_of, share_of_clearance
from gaitopt.ocp.multicontact.planar_plan import sample_phase
from gaitopt.ocp.multicontact.planar_warm_start import find_warm_start, list_refinements
from tests.ocp.multicontact_examples import drag, hop, stride, walk

PROBLEMS = {"monopod": hop, "slipping double support": drag, "five links": stride}


@pytest.fixture(scope="module")
def solved():
    """Return a function that solves an example once."""
    gaits = {}

    def solve(name):
        if name not in gaits:
            gaits[name] = solve_planar(PROBLEMS[name]())
        return gaits[name]

    return solve


@pytest.mark.parametrize("factor", [pytest.param(0.9, marks=pytest.mark.slow), 1.1])
@pytest.mark.parametrize("name", PROBLEMS)
def test_a_gait_at_a_friction_nearby_takes_less_than_half_of_the_iterations(solved, name, factor):
    gait, problem = solved(name), PROBLEMS[name]()
    problem = problem.replace(friction=factor * problem.friction)
    cold, warm = solve_planar(problem), solve_planar(problem.replace(guess=FromPlanarGait(gait)))
    assert warm.status is cold.status is Status.SOLVED
    assert warm.solver.objective == pytest.approx(cold.solver.objective, rel=1e-6)
    assert warm.solver.iterations <= cold.solver.iterations / 2
    assert warm.solver.error_between_nodes <= max(problem.transcription.tolerance, cold.solver.error_between_nodes)


def test_the_start_is_on_the_refined_grid_of_the_gait(solved):
    gait, problem = solved("monopod"), hop(friction=0.95)
    start = find_warm_start(problem.replace(guess=FromPlanarGait(gait)))
    method = list(list_refinements(problem))[start.number]
    assert start.number > 0
    assert (method.name, method.intervals) == (gait.problem["transcription"], tuple(gait.problem["intervals"]))


@pytest.mark.parametrize(
    ("changes", "near"),
    [
        ({}, True),
        ({"friction": 0.9}, True),
        ({"friction": 0.89}, False),
        ({"friction": float("inf")}, False),
        ({"speed": 1.6}, True),
        ({"speed": 1.8}, False),
        ({"speed": (1.6, 2.0), "step_length": None}, True),
        ({"speed": (1.8, 2.0)}, False),
        ({"slope": 0.01}, False),
        ({"parameters": {"body_mass": 8.5}}, True),
        ({"parameters": {"body_mass": 10}}, False),
        ({"parameters": {"body_mass": 10}, "free": {"body_mass": (5, 20)}}, True),
        ({"objective": "torque_squared"}, False),
        ({"sequence": "foot slip+ > foot stick > flight |", "transcription": None}, False),
        ({"transcription": 10}, False),
    ],
)
def test_the_multipliers_are_used_near_the_gait_only(solved, changes, near):
    gait, problem = solved("monopod"), hop()
    if "transcription" in changes:
        changes = changes | {"transcription": attrs.evolve(problem.transcription, intervals=changes["transcription"])}
    start = find_warm_start(problem.replace(guess=FromPlanarGait(gait), **changes))
    assert (start is not None) == near


def test_a_gait_without_a_solution_starts_from_its_motion(solved):
    gait = solved("five links")
    for other in (gait.replace_fields(solution=None), gait.replace_fields(status=Status.FAILED)):
        assert find_warm_start(stride().replace(guess=FromPlanarGait(other))) is None


def test_other_unknowns_are_not_filled(solved):
    gait = solved("five links")
    problem = stride().replace(guess=FromPlanarGait(gait), free={"gravity": (9.0, 10.0)})
    start = find_warm_start(problem)
    free = planar_solver.transcribe_planar(planar_solver.planar_structure(problem))
    fixed = planar_solver.transcribe_planar(planar_solver.planar_structure(stride()))
    assert start.fill(free) is None
    x, (on_bounds, on_rows) = start.fill(fixed)
    assert (x.size, on_bounds.size, on_rows.size) == (fixed.variables.size, x.size, fixed.constraints.size)
    assert abs(on_rows).max() > 0


def test_a_start_that_does_not_converge_is_followed_by_one_from_the_motion(solved, monkeypatch):
    gait = solved("five links")
    monkeypatch.setattr(planar_solver, "MOST_NEARBY", 1)
    again = solve_planar(stride().replace(friction=0.65, guess=FromPlanarGait(gait)))
    assert again.status is Status.SOLVED
    assert again.solver.objective == pytest.approx(gait.solver.objective, rel=1e-6)
    assert again.solver.iterations > 2


def find_low_foot(plan, clearance):
    """Return the gap of foot B in the middle of the swing if it is less than the clearance."""
    transcription, robot = plan.transcription, plan.robot
    (phase,) = transcription.phases
    part, (q, *_) = sample_phase(transcription, phase, plan.x)
    sample, contact = 2 * part.size // 5, robot.contact_index("foot B")
    row = row_of(transcription, phase, contact, sample)
    least = clearance * share_of_clearance(transcription, row)
    gap = float(robot.gaps(q[:, sample], robot.vector(plan.values))[0][contact])
    return {row: least} if gap < least - 1e-7 else {}


def test_a_gait_without_early_touchdowns_is_found_again_in_one_solve(monkeypatch):
    """Its bounds against early touchdowns are those of the first solve; without them, it takes two solves."""
    problem = walk("foot A stick |", transcription=Collocation(intervals=10))
    free = solve_planar(problem)
    monkeypatch.setattr("gaitopt.ocp.multicontact.grid_result.find_early_touchdowns", find_low_foot)
    gait = solve_planar(problem)
    assert gait.status is free.status is Status.SOLVED
    assert gait.solver.objective > 1.0001 * free.solver.objective
    again = solve_planar(problem.replace(guess=FromPlanarGait(gait)))
    assert again.solver.objective == pytest.approx(gait.solver.objective, rel=1e-8)
    assert again.solver.iterations <= 5
    changed = problem.replace(friction=1.01 * problem.friction, guess=FromPlanarGait(gait))
    assert not find_warm_start(changed).is_same


def test_the_solution_before_an_interrupted_refinement_is_continued_from():
    """It is on the first grid, which is not accurate, so that its refinement is repeated, from its multipliers."""
    problem, seen = hop(intervals=(4, 4)), []

    def stop_on_third_grid(iteration):
        seen.extend([iteration] if iteration.number == 0 else [])
        if len(seen) == 3:
            raise KeyboardInterrupt

    stopped = solve_planar(problem, observer=stop_on_third_grid)
    assert stopped.status is Status.INTERRUPTED
    continued = problem.replace(guess=FromPlanarGait(stopped))
    assert find_warm_start(continued).number == 0
    gait, whole = solve_planar(continued), solve_planar(problem)
    assert gait.status is whole.status is Status.SOLVED
    assert gait.solver.objective == pytest.approx(whole.solver.objective, rel=1e-9)
    assert gait.solver.iterations < whole.solver.iterations
