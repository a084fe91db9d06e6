"""Plans that the simulator walks: what the NLP excludes, and what is refused after it."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest

from gaitopt import (
    Collocation,
    GaitProblem,
    InputError,
    Limits,
    LinearGuess,
    Margins,
    Newton,
    Status,
    TorqueSquared,
    compass_biped,
    solve,
    verify,
)
from gaitopt.model.contacts.mode import Mode
from gaitopt.motion.gait_table import tabulate_gait
from gaitopt.ocp.bounds import bounds, structure
from gaitopt.ocp.nlp.keys import Kind
from gaitopt.ocp.solution import mesh_refinement
from gaitopt.ocp.solution.grid_solve import SingleStart
from gaitopt.ocp.solution.mesh_refinement import approach_through_coarse_grids
from gaitopt.ocp.solution.swing_foot_checks import early_touchdown
from gaitopt.ocp.solution.trajectory import check_between_nodes
from gaitopt.ocp.solution.transition_checks import report_inconsistent_transitions
from gaitopt.ocp.statement.well_posedness import POSES, _shares_of_ranges, allows_paradox
from gaitopt.ocp.transcription.collocation import Lobatto
from gaitopt.progress import silent
from gaitopt.study.storage.failure_reason import explain_failure
from tests.ocp.nlp_examples import SCHEMES, example_nlp, unknowns

SLIP = "slip+ stick | slip+"
ROBOT = compass_biped()


def _random_problem(sequence, robot, **statement):
    names = ("leg_length", "leg_com", "leg_mass", "hip_mass", "gravity")
    parameters = dict(zip(names, robot, strict=True))
    return GaitProblem(
        robot=ROBOT,
        sequence=sequence,
        parameters=parameters,
        limits=Limits(torque=statement.pop("torque")),
        transcription=Collocation(intervals=10),
        **statement,
    )


def test_a_direct_reversal_is_walked():
    """Its optimum had the sticking force on the cone at rest: the replay stuck for a moment between the slips."""
    gait = solve(
        _random_problem(
            "slip+ slip- stick | slip+",
            (0.357734, 0.135692, 8.04204, 21.0298, 3.7),
            friction=0.104959,
            slope=0.0464462,
            speed=(0.167404, 0.272031),
            step_length=0.0468636,
            objective="torque_squared",
            torque=7.03225,
        )
    )
    assert verify(gait).status is Status.SOLVED


@pytest.mark.slow
def test_a_slip_after_a_sticking_impact_is_walked():
    """Its optimum had the sticking force on the cone after the impact: the replay stuck at the first instant."""
    gait = solve(
        _random_problem(
            "slip+ stick slip- | stick",
            (0.406693, 0.0982584, 0.368432, 0.58571, 20.0),
            friction=0.0922665,
            slope=(0.0207041, 0.0607041),
            speed=(0.47492, 0.771745),
            step_length=0.200962,
            objective="cost_of_transport",
            torque=1.84933,
        )
    )
    assert verify(gait).status is Status.SOLVED


@pytest.fixture(scope="module")
def resting(reference_problem):
    """Return a gait whose foot comes to rest in its second slip, since no margin keeps it moving."""
    return solve(reference_problem(sequence="slip+ stick slip- | slip+", margins=Margins(slip_speed=0)))


@pytest.mark.slow
def test_a_slip_that_comes_to_rest_is_an_inaccurate_plan(resting):
    assert resting.status is Status.PLAN_INACCURATE
    assert "changes its contact mode between nodes" in resting.solver.warnings[0]
    assert not verify(resting).verification.passed
    assert verify(resting).status is Status.PLAN_INACCURATE


@pytest.mark.slow
def test_an_inaccurate_plan_is_no_solution_and_its_reasons_are_stated(resting):
    with pytest.raises(InputError, match=r"not a solution \(plan_inaccurate\).* changes its contact mode"):
        resting.require()
    assert explain_failure(resting).startswith("the plan is inaccurate: the foot changes its contact mode")
    assert "cost of transport" in dict(tabulate_gait(resting))
    assert math.isfinite(resting.solver.error_between_nodes)


@pytest.mark.slow
def test_without_a_tolerance_the_plan_is_not_checked(reference_problem):
    margins, method = Margins(slip_speed=0), Collocation(tolerance=math.inf)
    gait = solve(reference_problem(sequence="slip+ stick slip- | slip+", margins=margins, transcription=method))
    assert gait.status is Status.SOLVED
    assert "changes its contact mode between nodes" in gait.solver.warnings[0]


@pytest.mark.parametrize("scheme", SCHEMES)
def test_the_sliding_inertia_is_constrained_at_every_point_of_a_slip(reference_problem, scheme):
    transcription = example_nlp(SLIP, (3, 2), TorqueSquared(), scheme, inertia_limited=True)
    rows = transcription.constraints.find(Kind.SLIDING_INERTIA)
    assert rows.size == 3 * (1 + len(scheme.inner)) + 1
    problem = reference_problem(sequence=SLIP, margins=Margins(sliding_inertia=0.125))
    assert set(bounds(transcription, problem).g_lower[rows]) == {0.125}
    x, p = np.zeros(transcription.variables.size), ROBOT.vector(problem.values)
    x[transcription.variables["angles"][:, 0]] = -0.2, -0.1
    x[transcription.variables["duration"]] = x[transcription.variables["travel"]] = 0.5
    values = np.asarray(transcription.nlp.derivatives["jac_g"](x, [*p, 0, 0])[0]).ravel()
    forward, backward = np.asarray(ROBOT.wellposed([0, 0, -0.2, -0.1], p)).ravel()
    assert values[rows[0]] == pytest.approx(2 * forward / (forward + backward))
    assert not example_nlp(SLIP, (3, 2), TorqueSquared(), scheme).constraints.find(Kind.SLIDING_INERTIA).size


def test_the_sliding_inertia_is_constrained_only_where_slip_allows_paradox(reference_problem):
    def is_limited(**changes):
        problem = reference_problem(**changes)
        return structure(problem, problem.transcription).inertia_limited

    assert not is_limited(sequence=SLIP)
    assert is_limited(sequence=SLIP, friction=0.8)
    assert not is_limited(sequence="stick | stick", friction=0.8)
    values = reference_problem().values
    assert allows_paradox(ROBOT, values | {"leg_mass": math.nan}, [(-1.0, 1.0)] * 2, 0.0)


@pytest.mark.parametrize("count", [1, 2, 4])
def test_poses_at_which_the_sliding_inertia_is_computed_fill_the_ranges_evenly(count):
    shares = _shares_of_ranges(count)
    assert shares.shape == (count, POSES)
    edges = np.linspace(0, 1, 11)
    for one, other in itertools.combinations_with_replacement(range(count), 2):
        if one == other:
            counts, expected = np.histogram(shares[one], edges)[0], POSES / 10
        else:
            counts, expected = np.histogram2d(shares[one], shares[other], edges[::2])[0], POSES / 25
        assert np.all(np.abs(counts / expected - 1) < 0.3)


def test_a_gait_keeps_the_margin_of_the_sliding_inertia(reference_problem):
    problem = reference_problem(sequence=SLIP, objective="torque_squared", transcription=Collocation(intervals=20))
    least = {}
    for margin in (0.01, 0.8):
        gait = solve(problem.replace(margins=Margins(sliding_inertia=margin)))
        assert verify(gait).status is Status.SOLVED
        p, q = ROBOT.vector(gait.motion.parameters), gait.motion.segments[0].q
        shares = np.asarray(ROBOT.wellposed.map(q.shape[1])(q, p))
        least[margin] = np.min(shares[0] / shares.mean(axis=0))
    assert least[0.01] < 0.79
    assert least[0.8] == pytest.approx(0.8, abs=1e-4)


@pytest.fixture(scope="module")
def planned(solved, reference_problem):
    """Return a gait with a slip, its problem, its transcription and its decision vector."""
    gait, problem = solved(sequence=SLIP), reference_problem(sequence=SLIP)
    transcription = example_nlp(SLIP, gait.solution.intervals, problem.objective, Lobatto())
    return gait, problem, transcription, unknowns(gait, transcription)


def test_a_slip_that_is_not_well_posed_violates_its_mode(planned):
    gait, _, transcription, x = planned
    values = gait.motion.parameters
    between = check_between_nodes(transcription, values, x)
    assert between.outside == 0.0
    assert 0.5e-3 < between.reserve <= 1e-3
    with pytest.MonkeyPatch.context() as patch:
        # The equations of motion of the plan are kept; only the range of well-posed slip is changed.
        patch.setattr("gaitopt.ocp.solution.trajectory.PARADOX_MARGIN", 1.0)
        assert check_between_nodes(transcription, values, x).outside == 1.0


def test_a_drift_delays_the_touchdown(planned):
    gait, _, transcription, x = planned
    exact = check_between_nodes(transcription, gait.motion.parameters, x)
    x = x.copy()
    x[transcription.variables["rates"][0, 0]] += 1e-6
    drift = check_between_nodes(transcription, gait.motion.parameters, x)
    assert exact.touchdown < 1e-8
    assert 2 * drift.drift < drift.touchdown < 20 * drift.drift


def test_transitions_are_those_of_the_simulator(planned):
    gait, _, transcription, _ = planned
    phases, motion, (jump,) = transcription.phases, gait.motion, gait.motion.jumps
    assert report_inconsistent_transitions(ROBOT, phases, motion) == ()
    (reason,) = report_inconsistent_transitions(ROBOT, phases, replace(motion, jumps=(replace(jump, mode=Mode.STICK),)))
    assert reason.startswith("the impact ends in slip+, but stick is planned")
    inside = replace(phases[1], mode=Mode.SLIP_FORWARD, previous=Mode.SLIP_BACKWARD, starts_at_rest=True)
    (reason,) = report_inconsistent_transitions(ROBOT, (phases[0], inside), motion)
    assert reason.startswith("the foot does not start to slide at the start of phase 2 (slip+)")


def test_a_touchdown_from_below_is_not_located(planned):
    """The guard is below zero from the middle of the step on and reaches zero at its last node."""
    _, problem, transcription, x = planned
    assert early_touchdown(transcription, problem, x) is None
    x, layout = x.copy(), transcription.variables
    angles, rates = layout["angles"], layout["rates"]
    armed = np.flatnonzero(x[angles[0]] > 0)[:-1]
    x[angles[1, armed]], x[rates[1, armed]] = x[angles[0, armed]] - 0.01, x[rates[0, armed]]
    x[angles[1, armed[0] - 1]] = x[angles[0, armed[0] - 1]] - 0.01
    x[rates[1, -1]] = x[rates[0, -1]] - 1e-3
    grazing = early_touchdown(transcription, problem, x)
    assert grazing.grazes
    assert grazing.place == f"phase 2 (stick), node {transcription.phases[1].count - 1}"
    assert grazing.schedule.above < 2.0


@pytest.fixture(scope="module")
def twice(reference_problem):
    """Return a problem whose optimum on the coarse grid touches down early, but not that on the fine grid."""
    return reference_problem(
        friction=math.inf,
        speed=0.35232242684986326,
        step_length=0.45969822868282467,
        limits=Limits(torque={"ankle": 20, "hip": 0.5}),
    )


def test_an_early_touchdown_is_excluded_on_the_coarse_grid(twice):
    solution = approach_through_coarse_grids(SingleStart(twice, LinearGuess(), Newton(), silent))
    assert solution.transcription.structure.schedule is not None


def test_guard_constraints_of_the_coarse_grid_are_released(twice, monkeypatch):
    gait = solve(twice)
    assert verify(gait).status is Status.SOLVED
    assert gait.problem["landing"] is None
    monkeypatch.setattr(mesh_refinement, "MAX_GUARD_REPAIRS", 0)  # no guard constraints on any grid
    assert gait.solver.objective == pytest.approx(solve(twice).solver.objective, rel=1e-6)
