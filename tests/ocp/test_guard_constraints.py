"""Plans that would touch down early, against the event-driven simulator."""

from dataclasses import replace

import numpy as np
import pytest

from gaitopt import (
    Collocation,
    ContactSequence,
    GaitProblem,
    InputError,
    Ipopt,
    Limits,
    LinearGuess,
    Newton,
    Status,
    TorqueSquared,
    compass_biped,
    replay,
    solve,
    verify,
)
from gaitopt.ocp.nlp.keys import Kind
from gaitopt.ocp.solution import mesh_refinement
from gaitopt.ocp.solution.grid_solve import SingleStart
from gaitopt.ocp.solution.single_start import solve_from_start
from gaitopt.ocp.solution.swing_foot_checks import EarlyTouchdown, early_touchdown
from gaitopt.ocp.transcription.grid import divide_into_phases, node_places
from gaitopt.ocp.transcription.guard_constraints import GuardSchedule, propose_schedule, shift_arming
from gaitopt.ocp.transcription.transcription import transcribe
from gaitopt.progress import silent
from tests.ocp.nlp_examples import example_nlp, unknowns

ROBOT = compass_biped()


@pytest.fixture(scope="module")
def problem():
    """Return a problem whose best plan swings its leg, which no torque drives, twice: a step at half its rhythm."""
    return GaitProblem(
        robot=ROBOT,
        sequence="stick | stick",
        speed=0.4,
        step_length=0.4713,
        limits=Limits(torque={"ankle": 20, "hip": 0}),
        transcription=Collocation(intervals=20),
    )


@pytest.fixture(scope="module")
def gait(problem):
    return solve(problem)


@pytest.fixture(scope="module")
def early(problem):
    """Return the plan without guard constraints."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(mesh_refinement, "MAX_GUARD_REPAIRS", 0)
        return solve_from_start(problem, LinearGuess(), Newton(), silent)


def test_an_early_touchdown_is_where_the_simulator_finds_it(problem, early):
    (warning,) = early.solver.warnings
    ended = replay(early).motion.period
    assert ended < 0.5 * early.period
    node = int(20 * ended / early.period)
    assert f"touches down before its end, after phase 1 (stick), node {node}, and its replay" in warning
    assert early.status is Status.PLAN_INACCURATE
    assert not verify(early).verification.passed


def test_it_is_solved_again_without(gait, early):
    assert gait.status.ok
    assert gait.solver.warnings == ()
    assert verify(gait).verification.passed
    assert early.cost_of_transport < gait.cost_of_transport < 1.02 * early.cost_of_transport
    assert early.problem["landing"] is None
    assert gait.problem["landing"].keys() == {"unarmed", "below", "above", "least"}


def test_where_no_other_plan_is_found_the_early_one_is_kept(problem, early, monkeypatch):
    impossible = EarlyTouchdown(
        "anywhere", GuardSchedule(unarmed=0.95, below=0.95, above=0.95)
    )  # hardly armed at touchdown
    monkeypatch.setattr(mesh_refinement, "early_touchdown", lambda *_: impossible)
    kept = solve_from_start(problem, LinearGuess(), Ipopt(max_iterations=100), silent)
    assert kept.status is Status.PLAN_INACCURATE
    assert kept.cost_of_transport == pytest.approx(early.cost_of_transport, rel=1e-6)
    assert kept.problem["landing"] is None
    with pytest.raises(InputError, match=r"plan_inaccurate.* touches down before its end, after phase 1"):
        kept.require()
    assert kept.solver.iterations > early.solver.iterations


def test_a_remedy_that_runs_out_of_iterations_on_a_finer_grid_is_none(problem, early, monkeypatch):
    """Nor is its status that of the plan there was before, which is solved."""
    start = SingleStart(problem, LinearGuess(), Ipopt(), silent)
    with monkeypatch.context() as patch:
        patch.setattr(mesh_refinement, "MAX_GUARD_REPAIRS", 0)
        solution = mesh_refinement.refine_mesh(start, mesh_refinement.approach_through_coarse_grids(start))
    ran_out = replace(solution, outcome=replace(solution.outcome, status=Status.ITERATION_LIMIT), kept=True)
    monkeypatch.setattr(mesh_refinement, "refine_mesh", lambda start, solution: ran_out)
    kept = mesh_refinement.repair_early_touchdown(start, solution)
    assert kept.outcome.status is Status.SOLVED
    assert kept.outcome.objective == pytest.approx(early.solver.objective, rel=1e-6)


@pytest.mark.slow
def test_the_touchdown_is_armed_at_the_cheapest_node(problem, gait):
    start = SingleStart(problem, LinearGuess(), Ipopt(), silent)
    solution = mesh_refinement.refine_mesh(start, mesh_refinement.approach_through_coarse_grids(start))
    schedule = replace(GuardSchedule(**gait.problem["landing"]), unarmed=0.4)
    worse = mesh_refinement._solve_with_guard(start, solution, schedule)
    assert worse.outcome.objective > 1.02 * gait.solver.objective
    better = mesh_refinement._improve_arming_node(start, worse)
    assert better.transcription.structure.schedule.unarmed == gait.problem["landing"]["unarmed"]
    assert better.outcome.objective == pytest.approx(gait.solver.objective, rel=1e-6)


def test_a_schedule_is_shifted_by_a_node_and_not_beyond_the_lowest_guard():
    phases = divide_into_phases(ContactSequence.parse("slip+ stick | slip+"), (2, 4))
    schedule = GuardSchedule(unarmed=0.5, below=1.5, above=1.75)
    assert shift_arming(phases, schedule, 1) == replace(schedule, unarmed=1.0)
    assert shift_arming(phases, schedule, -1) is None  # there is no touchdown at the first node
    assert shift_arming(phases, replace(schedule, unarmed=1.25), 1) is None
    assert shift_arming(phases, None, 1) is None


def test_the_guard_falls_only_unarmed_along_the_replayed_motion(gait):
    segment = replay(gait).motion.segments[0]
    th1, th2 = segment.q[2:, :-1]
    falls = np.flatnonzero((th2 - th1)[:-1] * (th2 - th1 < 0)[1:] > 0)
    assert falls.size == 1
    assert np.all(th1[falls + 1] < 0)


def test_scuffing_that_ends_no_step_is_none(solved):
    """The guard of the slipping gait rises through zero in mid-swing, which is ignored, and falls at the end."""
    gait = solved(sequence="slip+ stick | slip+")
    segment = gait.motion.segments[-1]
    assert np.any(np.diff(np.sign(segment.q[3] - segment.q[2])) > 0)
    assert gait.problem["landing"] is None


def bent(gait, transcription, dip):
    """Return the unknowns of a gait whose guard is lowered in a dip of one interval, between two nodes."""
    x, layout = unknowns(gait, transcription), transcription.variables
    node = transcription.n_nodes - 6
    guard = np.diff(x[layout["angles"][:, node : node + 2]], axis=0)
    length = x[layout["duration"][0, -1]] / transcription.phases[-1].count
    x[layout["angles"][1, node : node + 2]] -= guard[0] - 1e-4
    x[layout["rates"][1, node]] = x[layout["rates"][0, node]] - dip / length
    x[layout["rates"][1, node + 1]] = x[layout["rates"][0, node + 1]] + dip / length
    return node, x


@pytest.mark.parametrize(("dip", "falls"), [(3e-4, False), (5e-4, True)])
def test_a_dip_between_two_nodes_is_seen(solved, reference_problem, dip, falls):
    gait = solved(sequence="stick | stick")
    problem = reference_problem()
    scheme, counts = problem.transcription.scheme, gait.solution.intervals
    transcription = example_nlp(problem.sequence, counts, problem.objective, scheme)
    node, x = bent(gait, transcription, dip)  # at its lowest 1e-4 - dip / 4
    found = early_touchdown(transcription, problem, x)
    assert (found is not None) is falls
    if found is not None:
        assert found.place == f"phase 1 (stick), node {node}"


def test_a_guard_that_is_positive_when_armed_falls_before():
    """It is 0.01 above zero when the touchdown is armed and 0.2 below later: to fall earlier is the lesser change."""
    phases = divide_into_phases(ContactSequence.parse("stick | stick"), (10,))
    guard = np.array([0.0, -0.2, 0.1, 0.2, 0.01, -0.1, -0.2, 0.1, 0.3, 0.1])
    armed = np.linspace(-0.4, 0.5, 10)
    assert propose_schedule(phases, guard, armed) == GuardSchedule(unarmed=0.4, below=0.6, above=0.8)


def test_a_guard_that_dips_a_little_stays_above():
    phases = divide_into_phases(ContactSequence.parse("slip+ stick | slip+"), (4, 6))
    guard = np.array([0.0, -0.2, 0.1, 0.2, 0.2, -0.01, 0.2, 0.3, 0.3, 0.1])
    armed = np.linspace(-0.3, 0.5, 10) - 0.02
    assert propose_schedule(phases, guard, armed) == GuardSchedule(0.75, 0.75, 0.75)


def test_a_schedule_constrains_the_nodes_of_any_grid():
    schedule = GuardSchedule(unarmed=0.5, below=1.25, above=1.5)
    for scale in (1, 2):
        counts = (4 * scale, 8 * scale)
        transcription = example_nlp(
            ContactSequence.parse("slip+ stick | slip+"), counts, TorqueSquared(), schedule=schedule
        )
        rows, labels = transcription.constraints, [place.label for place in node_places(transcription.phases)]
        spans = {"not armed": (1, 2), "guard below zero": (2, 6), "guard above zero": (8, 11)}
        for name, (first, last) in spans.items():
            index = rows[f"touchdown {name}"][0]
            end = scale * last if "above" not in name else sum(counts) - 1
            begin = 1 if "not" in name else scale * first
            assert [rows.label(i)[0] for i in index] == labels[begin : end + 1]
            lower, upper = transcription.row_bounds[:, index]
            assert 0.5e-3 < lower.max() <= 1e-3
            assert np.all(upper == np.inf)


def test_its_rows_are_the_guard_and_what_arms_it():
    transcription = example_nlp(
        ContactSequence.parse("stick | stick"), (8,), TorqueSquared(), schedule=GuardSchedule(0.25, 0.5, 0.75)
    )
    rng, rows = np.random.default_rng(2), transcription.constraints
    x = rng.uniform(-0.3, 0.3, transcription.variables.size)
    data = [*ROBOT.vector(ROBOT.resolve({})), 0, 0]
    g = np.asarray(transcription.nlp.derivatives["jac_g"](x, data)[0]).ravel()
    th1, th2 = x[transcription.variables["angles"]]
    assert g[rows["touchdown not armed"][0]] == pytest.approx(-th1[1:3])
    assert g[rows["touchdown guard below zero"][0]] == pytest.approx((th1 - th2)[2:5])
    assert g[rows["touchdown guard above zero"][0]] == pytest.approx((th2 - th1)[6:8])


def test_an_nlp_without_a_schedule_has_no_such_rows():
    rows = transcribe(example_nlp(ContactSequence.parse("stick | stick"), (8,), TorqueSquared()).structure).constraints
    assert not any(rows.find(kind).size for kind in (Kind.NOT_ARMED, Kind.GUARD_ABOVE, Kind.GUARD_BELOW))
