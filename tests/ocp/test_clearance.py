"""How high the swing foot is, against the geometry of two straight legs written out, and along replayed motions."""

import numpy as np
import pytest
from attrs import evolve
from scipy.interpolate import CubicSpline

from gaitopt import ContactSequence, CostOfTransport, Limits, TorqueSquared
from gaitopt.ocp.bounds import bounds, data_vector, nlp_data, structure
from gaitopt.ocp.nlp.keys import Group, Key, Kind, Unknown
from gaitopt.ocp.solution.diagnosis import report_inaccuracies, violations
from gaitopt.ocp.solution.swing_foot_checks import lack_of_height
from gaitopt.ocp.solution.trajectory import BetweenNodes
from gaitopt.ocp.transcription.collocation import lobatto_points
from gaitopt.ocp.transcription.relaxation import ExactPenalty
from gaitopt.ocp.transcription.transcription import transcribe
from tests.ocp.nlp_examples import SCHEMES, example_nlp, unknowns

LEG = 1.6
CLEARANCE = Key(Kind.CLEARANCE).label
SLIP = "slip+ stick | slip+"


def over_the_bump(th1, th2, distance, clearance):
    """Return how far the swing foot of the compass biped is above the least height, in plain geometry."""
    ahead, height = LEG * (np.sin(th1) + np.sin(th2)), LEG * (np.cos(th1) - np.cos(th2))
    return height - clearance * (1 - (ahead / distance) ** 2) ** 2


def constraints(transcription, problem, x):
    return np.asarray(transcription.nlp.derivatives["jac_g"](x, nlp_data(transcription, problem, x))[0]).ravel()


@pytest.fixture(scope="module")
def random_motion(reference_problem):
    """Return a problem, its transcription, and angles that change at constant rates, each interval for itself."""
    problem = reference_problem(sequence=SLIP, limits=Limits(torque=6, clearance=0.03), objective="torque_squared")
    transcription = example_nlp(problem.sequence, (3, 4), TorqueSquared(), SCHEMES[1], cleared=True)
    rng, layout = np.random.default_rng(5), transcription.variables
    x = np.zeros(layout.size)
    x[layout["angles"]], x[layout["rates"]] = rng.uniform(-0.3, 0.3, (2, 2, 8))
    x[layout["duration"][0]], x[layout["travel"]] = (0.1, 0.5), 0.47
    x[layout[Unknown.SLIDE, 0]] = rng.uniform(0, 0.05, (2, 4))
    return problem, transcription, x


@pytest.mark.parametrize("number", [0, 1])
def test_the_height_at_nodes_and_inner_points_is_that_of_the_geometry(random_motion, number):
    problem, transcription, x = random_motion
    layout, phase = transcription.variables, transcription.phases[number]
    found = constraints(transcription, problem, x)[transcription.constraints[Group.CLEARANCE, number]]
    left = list(phase.nodes)[:-1]
    angles, rates = x[layout["angles"][:, left]], x[layout["rates"][:, left]]
    length = x[layout["duration"][0, number]] / phase.count
    distance = 0.47 - x[layout[Unknown.SLIDE, 0][0, -1]]
    for row, part in zip(found, lobatto_points(4)[:-1], strict=True):
        assert row == pytest.approx(over_the_bump(*(angles + part * length * rates), distance, 0.03), abs=1e-15)


def test_it_is_asked_for_all_along_but_at_the_ends_of_the_step(random_motion):
    problem, transcription, _ = random_motion
    limits, rows = bounds(transcription, problem), transcription.constraints
    asked = [i for i in rows.find(Kind.CLEARANCE) if limits.g_lower[i] == 0]
    assert len(asked) == 3 * 7 - 1
    assert np.all(np.isinf(limits.g_upper[asked]))
    places = {rows.label(i) for i in asked}
    assert ("phase 1 (slip+), node 0", CLEARANCE) not in places
    assert ("phase 1 (slip+), node 0", f"{CLEARANCE}, inner point 1") in places
    assert ("phase 2 (stick), node 0", CLEARANCE) in places
    assert ("phase 2 (stick), node 4", CLEARANCE) not in places


def test_without_a_clearance_there_is_nothing_of_it(reference_problem):
    transcription = transcribe(structure(reference_problem(), reference_problem().transcription))
    assert not transcription.constraints.find(Kind.CLEARANCE).size
    assert not transcription.structure.cleared


def test_problems_that_differ_in_their_clearance_share_an_nlp(reference_problem):
    one, other = (reference_problem(limits=Limits(torque=6, clearance=height)) for height in (0.0, 0.02))
    assert structure(one, one.transcription) == structure(other, other.transcription)
    assert data_vector(other)[-1] == 0.02
    assert other.describe()["clearance"] == 0.02


def test_open_phases_keep_it_too(reference_problem):
    problem = reference_problem(sequence="any | stick", limits=Limits(torque=6, clearance=0.02), intervals=6)
    transcription = transcribe(structure(problem, problem.transcription, ExactPenalty()))
    rng, layout = np.random.default_rng(8), transcription.variables
    x = rng.uniform(0.1, 0.3, layout.size)
    g, _ = transcription.nlp.derivatives["jac_g"](x, [*data_vector(problem), 1e-3])
    found = np.asarray(g).ravel()[transcription.constraints[Group.CLEARANCE, 0]]
    distance = x[layout["travel"][0, 0]] - x[layout[Unknown.SLIDE][0, -1]]
    assert found[0] == pytest.approx(over_the_bump(*x[layout["angles"]][:, :-1], distance, 0.02))


@pytest.fixture(scope="module")
def scuffing(reference_problem, solved):
    """Return a gait of straight legs, which scuff, on an NLP that does not allow it."""
    gait = solved(sequence=SLIP)
    problem = reference_problem(sequence=SLIP, limits=Limits(torque=6, clearance=0.0))
    scheme = problem.transcription.scheme
    transcription = example_nlp(problem.sequence, gait.solution.intervals, CostOfTransport(), scheme, cleared=True)
    return gait, problem, transcription, unknowns(gait, transcription)


def test_a_foot_that_is_too_low_is_named_with_phase_and_node(scuffing):
    gait, problem, transcription, x = scuffing
    first, *others = violations(
        transcription, bounds(transcription, problem), x, constraints(transcription, problem, x)
    )
    assert first.name.startswith(CLEARANCE)
    assert first.place.startswith("phase 2 (stick), node ")
    assert all(violation.name.startswith(CLEARANCE) for violation in others)
    heights = np.concatenate([over_the_bump(*segment.q[2:], 1, 0) for segment in gait.motion.segments])
    assert first.size == pytest.approx(-heights.min(), rel=0.02)


def test_the_lowest_height_between_nodes_is_that_of_the_motion(scuffing):
    gait, problem, transcription, x = scuffing
    angles = np.hstack([_dense(segment) for segment in gait.motion.segments])
    assert lack_of_height(transcription, problem, x) == pytest.approx(-over_the_bump(*angles, 1, 0).min(), abs=1e-6)
    raised = problem.replace(limits=evolve(problem.limits, clearance=0.02))
    distance = float(x[transcription.variables["travel"][0, 0]] - x[transcription.variables[Unknown.SLIDE, 0][0, -1]])
    least = over_the_bump(*angles, distance, 0.02).min()
    assert lack_of_height(transcription, raised, x) == pytest.approx(-least, abs=1e-6)


def _dense(segment):
    return CubicSpline(segment.time, segment.q[2:], axis=1)(np.linspace(*segment.time[[0, -1]], 2000))


def test_a_foot_too_low_between_nodes_is_an_inaccuracy(scuffing):
    _, problem, transcription, x = scuffing
    between = BetweenNodes(0.0, 0.0)
    (reason,) = report_inaccuracies(transcription, problem, x, 0.0, between)
    assert "m below Limits.clearance between nodes: use more intervals" in reason
    free = problem.replace(limits=evolve(problem.limits, clearance=None))
    assert report_inaccuracies(transcription, free, x, 0.0, between) == ()


def test_every_mode_of_every_scheme_has_it():
    for scheme in SCHEMES:
        transcription = example_nlp(
            ContactSequence.parse("slip- stick slip+ | slip-"), (2, 3, 2), TorqueSquared(), scheme, cleared=True
        )
        for number, count in enumerate((2, 3, 2)):
            assert transcription.constraints[Group.CLEARANCE, number].shape == (1 + len(scheme.inner), count)
