"""Optima of planar robots with any contacts.

Reference values: an independent implementation of the same formulation with other code, unless stated otherwise.
"""

import math

import attrs
import numpy as np
import pytest

from gaitopt import Collocation, GaitProblem, Ipopt, Limits, LinearGuess, Margins, compass_biped, solve
from gaitopt.motion.motion import Array
from gaitopt.ocp import FromPlanarGait, PlanarLimits, solve_planar
from gaitopt.ocp.bounds import bounds, nlp_data, structure
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.multicontact.planar_bounds import planar_bounds, planar_data, planar_structure
from gaitopt.ocp.multicontact.planar_guess import find_poses
from gaitopt.ocp.multicontact.planar_start import planar_start, setting_of
from gaitopt.ocp.multicontact.planar_transcription import transcribe_planar
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.transcription.transcription import transcribe
from gaitopt.progress import silent
from tests.benchmarks.plain_five_link_opti import Gait
from tests.ocp.multicontact_examples import drag, hop, knee_strike, stride, walk

FIVE_LINKS = 76.662549
"""Least integral of squared torques of the five-link walker [N^2 m^2 s]."""


def test_the_hop_of_the_monopod():
    gait = solve_planar(hop())
    assert gait.status.ok
    assert gait.solver.objective == pytest.approx(23.505, abs=5e-4)
    assert gait.speed == pytest.approx(1.5)


@pytest.mark.slow
def test_a_hop_that_lands_in_a_slip_costs_less_than_one_that_sticks():
    stick = solve_planar(hop(friction=0.3, clearance=2e-3))
    slip = solve_planar(hop("foot slip+ > foot stick > flight |", 0.3, 2e-3, (4, 8, 24)))
    assert stick.status.ok
    assert slip.status.ok
    assert slip.solver.objective < stick.solver.objective - 0.05


@pytest.mark.slow
def test_a_soft_landing_loses_no_energy_and_keeps_the_clearance_until_shortly_before():
    """Speed, acceleration and force of the foot vanish at touchdown: its height falls with the third power of time."""
    gait = solve_planar(hop("foot stick > flight >", clearance=0.01, intervals=(6, 16), margins=Margins(slip_speed=0)))
    assert gait.status.ok, gait.status
    assert gait.energy.impact_loss == 0
    assert abs(gait.energy.actuator) < 1e-6 * gait.solver.objective
    stance, flight = gait.motion.segments
    foot = gait.robot.points.index("foot")
    rows = gait.robot.rows(flight.q[:, -1], flight.v[:, -1], gait.robot.vector(gait.motion.parameters))[0]
    assert float(rows[0, :] @ flight.v[:, -1]) == pytest.approx(0, abs=1e-9)
    part = (flight.time - flight.time[0]) / np.ptp(flight.time)
    least = 0.01 * np.minimum(1, 4 * np.minimum(part, 1 - part)) ** 3
    assert (flight.points[1, foot] >= least - 1e-5).all()
    weight = gait.motion.total_mass * gait.motion.parameters["gravity"]
    assert 0 <= stance.force[0, 1, 0] < Margins().normal_force * weight < stance.force[0, 1, 1:-1].min()
    assert gait.solver.objective > solve_planar(hop(clearance=0.01, intervals=(6, 16))).solver.objective


@pytest.mark.slow
def test_a_compass_in_single_support():
    gait = solve_planar(walk())
    assert gait.solver.objective == pytest.approx(2.1452677794, abs=2e-9)
    slow = solve_planar(walk(speed=0.25, friction=0.4, transcription=Collocation(intervals=24, tolerance=math.inf)))
    assert slow.solver.objective == pytest.approx(4.494156, abs=5e-7)


def test_a_compass_that_drags_its_trailing_foot_in_double_support():
    gait = solve_planar(drag())
    assert gait.status.ok
    assert gait.solver.objective == pytest.approx(42.7621, abs=5e-5)
    double = gait.motion.segments[0]
    assert double.time[-1] == pytest.approx(0.4771465, abs=5e-7)
    foot = double.points[0, gait.robot.points.index("foot A")]
    assert foot[-1] - foot[0] == pytest.approx(0.3531799, abs=5e-7)
    assert gait.period == pytest.approx(1.8852, abs=1e-9)


def test_the_five_link_walker():
    """A plain script of the same NLP, with equations from the energies, has the same optimum (next test)."""
    gait = solve_planar(stride())
    assert gait.status.ok
    assert gait.solver.objective == pytest.approx(FIVE_LINKS, rel=1e-8)
    assert math.trunc(1e3 * FIVE_LINKS) / 1e3 == 76.662  # the published number


@pytest.mark.slow
def test_a_plain_script_has_the_optimum_of_the_five_link_walker():
    script = Gait(12, 4, friction=0.6, speed=0.7, step=0.4, slips=False)
    objective, _ = script.solve(*find_poses(setting_of(stride())), np.array([0.4 / 0.7]))
    assert objective == pytest.approx(FIVE_LINKS, rel=1e-8)


def test_the_least_torque_of_a_kneed_walker_downhill_is_zero_in_its_passive_gait():
    """The passive gait is known from its return map; the knee strike is an event inside the step."""
    gait = solve_planar(knee_strike())
    assert gait.status.ok
    assert gait.solver.objective < 1e-12
    strike, touchdown = gait.motion.events
    assert strike.time == pytest.approx(0.3486120004843, abs=1e-8)
    assert touchdown.time == pytest.approx(0.5643281659150, abs=1e-8)
    names, first = gait.robot.coordinates, gait.motion.segments[0]
    assert first.q[names.index("a"), 0] == pytest.approx(0.2385854602534, abs=1e-8)
    assert first.v[names.index("a"), 0] == pytest.approx(-1.1095873311766, abs=1e-7)
    assert first.v[names.index("b"), 0] == pytest.approx(-0.0571481063377, abs=1e-7)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("sequence", "objective", "friction"),
    [
        ("stick | stick", "cost_of_transport", 0.2),
        ("stick | stick", "torque_squared", 0.2),
        ("slip+ stick | slip+", "cost_of_transport", 0.14),
        ("slip+ stick | slip+", "torque_squared", 0.14),
        ("stick slip- | stick", "torque_squared", 0.14),
    ],
)
def test_a_walker_with_one_foot_on_the_ground_has_the_same_optimum_in_both_formulations(sequence, objective, friction):
    """The other formulation eliminates the stance foot and has its own equations of motion."""
    method = Collocation(intervals=20, tolerance=math.inf)
    anchored = GaitProblem(
        robot=compass_biped(),
        sequence=sequence,
        friction=friction,
        speed=0.633,
        step_length=0.4713,
        objective=objective,
        limits=Limits(torque=6),
        transcription=method,
    )
    reference = transcribe(structure(anchored, method))
    x = initial_point(reference, anchored, LinearGuess())
    data = nlp_data(reference, anchored)
    expected = Ipopt().minimise(reference.nlp, x, data, bounds(reference, anchored), silent)
    gait = solve_planar(
        walk(
            sequence,
            friction=friction,
            objective=objective,
            margins=Margins(),
            limits=PlanarLimits(torque={"ankle A": 6, "hip": 6, "ankle B": 0}),
            transcription=attrs.evolve(method, intervals=method.intervals_for(anchored.sequence)),
        )
    )
    assert gait.status.ok
    assert gait.solver.objective == pytest.approx(expected.objective, rel=1e-6)


def test_constraints_hold_to_rounding_at_the_nodes_and_the_projections_are_small():
    gait = solve_planar(drag())
    robot, q, v = gait.robot, gait.motion.channel("q"), gait.motion.channel("v")
    p = robot.vector(gait.motion.parameters)
    points = int(gait.problem["transcription"].split()[1])
    segment = gait.motion.segments[0]
    nodes = segment.q[:, :: points - 1]
    gaps, slides = (np.array(part) for part in robot.gaps.map(nodes.shape[1])(nodes, p))
    assert np.abs(gaps[:2]).max() < 1e-12
    assert np.ptp(slides[1]) < 1e-12
    projections = [table.values for name, table in gait.solution.unknowns.items() if name.startswith("projection")]
    assert max(np.abs(values).max() for values in projections) < 1e-7
    assert q.shape == v.shape


def test_the_energy_of_the_plan_is_balanced():
    for gait in (solve_planar(hop()), solve_planar(drag())):
        assert gait.energy.relative_residual < 1e-7
        assert gait.energy.impact_loss > 0


def test_the_gradients_of_the_active_constraints_are_independent():
    """Rows that follow from others would make the multipliers arbitrary."""
    for problem in (hop(intervals=(3, 3)), drag().replace(transcription=Collocation(intervals=(3, 3)))):
        problem = problem.replace(transcription=attrs.evolve(problem.transcription, tolerance=math.inf))
        gait = solve_planar(problem)
        transcription = transcribe_planar(planar_structure(problem))
        assert gait.status.ok
        jacobian = equality_jacobian(transcription, problem, gait)
        assert np.linalg.matrix_rank(jacobian, tol=1e-9) == jacobian.shape[0]


def equality_jacobian(transcription, problem, gait) -> Array:
    limits, x = planar_bounds(transcription, problem), np.zeros(transcription.variables.size)
    for key, table in zip(transcription.variables.tables, gait.solution.unknowns.values(), strict=True):
        x[transcription.variables[key]] = table.values
    jacobian = np.array(transcription.nlp.derivatives["jac_g"](x, planar_data(problem))[1])
    free, rows = limits.x_lower < limits.x_upper, limits.g_lower == limits.g_upper
    return jacobian[rows][:, free]


@pytest.mark.slow
def test_a_start_with_other_durations_may_lead_to_another_optimum():
    """The optimum with the shortest possible double support costs more."""
    short = drag(0.02, 0.02)
    first, best = solve_planar(short), solve_planar(short, starts=4)
    assert best.solver.objective <= first.solver.objective
    assert best.solver.objective == pytest.approx(42.7621, abs=5e-5)


def test_a_gait_is_warm_started_from_a_neighbour():
    gait = solve_planar(walk(transcription=Collocation(intervals=20)))
    faster = solve_planar(walk(speed=0.64, guess=FromPlanarGait(gait), transcription=Collocation(intervals=20)))
    assert faster.status.ok
    assert faster.solver.iterations <= 12


def test_solve_takes_both_kinds_of_problems():
    assert solve(walk(transcription=Collocation(intervals=10))).status.ok


def test_heights_and_torque_limits_are_met():
    limits = PlanarLimits(torque={"leg": 150}, coordinate={"s": (0.35, 0.65)}, height={"hip": 0.5}, clearance=0.01)
    gait = solve_planar(hop(clearance=0.01).replace(limits=limits))
    assert gait.status.ok
    assert np.abs(gait.motion.channel("torque")[0]).max() <= 150 + 1e-5
    assert gait.motion.channel("points")[1, 0].min() >= 0.5 - 1e-7
    flight = gait.motion.segments[1]
    part = (flight.time - flight.time[0]) / np.ptp(flight.time)
    assert flight.points[1, 1, (part > 0.25) & (part < 0.75)].min() >= 0.01 - 1e-7


def test_the_guess_has_the_stated_durations():
    problem = drag(0.6)
    transcription = transcribe_planar(planar_structure(problem))
    x = planar_start(transcription, problem)
    assert x[transcription.variables[Unknown.DURATION]].tolist() == [[0.6, 1.8852 - 0.6]]
