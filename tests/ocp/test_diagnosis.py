import numpy as np
import pytest

from gaitopt import ContactSequence, TorqueSquared
from gaitopt.ocp.nlp.bound_vectors import Bounds
from gaitopt.ocp.nlp.keys import Group
from gaitopt.ocp.solution.diagnosis import report_inaccuracies, report_short_phases, report_short_steps, violations
from gaitopt.ocp.solution.trajectory import BetweenNodes
from tests.ocp.nlp_examples import example_nlp


@pytest.fixture(scope="module")
def transcription():
    return example_nlp(ContactSequence.parse("slip+ stick | slip+"), (3, 4), TorqueSquared())


@pytest.fixture
def wide(transcription):
    n, m = transcription.variables.size, transcription.constraints.size
    return Bounds(*np.full((2, n), np.array([[-1.0], [1.0]])), *np.full((2, m), np.array([[-1.0], [1.0]])))


def found(transcription, bounds, x=None, g=None, **options):
    x = np.zeros(transcription.variables.size) if x is None else x
    g = np.zeros(transcription.constraints.size) if g is None else g
    return violations(transcription, bounds, x, g, **options)


def test_nothing_violated_is_nothing_listed(transcription, wide):
    assert found(transcription, wide) == ()


@pytest.mark.parametrize(("value", "size"), [(1.5, 0.5), (-3.0, 2.0)])
def test_a_violated_row_is_named_with_its_size(transcription, wide, value, size):
    g = np.zeros(transcription.constraints.size)
    g[transcription.constraints[Group.INTERVAL, 1][5, 2]] = value
    (violation,) = found(transcription, wide, g=g)
    assert (violation.place, violation.name) == ("phase 2 (stick), node 2", "backward friction cone")
    assert violation.size == pytest.approx(size)
    assert str(violation) == f"backward friction cone at phase 2 (stick), node 2 violated by {size:.2e}"


def test_a_variable_beyond_its_bound_is_named(transcription, wide):
    x = np.zeros(transcription.variables.size)
    x[transcription.variables["torque"][1, 5]] = 4.0
    (violation,) = found(transcription, wide, x=x)
    assert (violation.place, violation.name, violation.size) == ("phase 2 (stick), node 2", "hip torque", 3.0)


def test_the_worst_of_each_name_in_each_phase_comes_first(transcription, wide):
    rows = transcription.constraints
    g = np.zeros(rows.size)
    g[rows[Group.INTERVAL, 1][4, 0]] = 1.2  # forward cone
    g[rows[Group.INTERVAL, 1][4, 3]] = 1.4
    g[rows[Group.INTERVAL, 1][6, 1]] = 1.3  # the same cone at mid-interval
    g[rows[Group.INTERVAL, 1][0, 0]] = 1.1
    g[rows["touchdown"][0, 0]] = 2.0
    listed = [(v.place, v.name) for v in found(transcription, wide, g=g)]
    assert listed == [
        ("touchdown", "leg swap of th1"),
        ("phase 2 (stick), node 3", "forward friction cone"),
        ("phase 2 (stick), node 0", "dynamics of th1"),
    ]


def test_small_violations_and_long_lists_are_cut(transcription, wide):
    g = np.full(transcription.constraints.size, 1 + 1e-7)
    assert found(transcription, wide, g=g) == ()
    g += 1.0
    assert len(found(transcription, wide, g=g, most=3)) == 3
    assert len(found(transcription, wide, g=g)) == 10


def test_a_value_that_is_not_a_number_is_the_worst(transcription, wide):
    g = np.full(transcription.constraints.size, 5.0)
    g[transcription.constraints["touchdown"][2, 0]] = np.nan
    first = found(transcription, wide, g=g)[0]
    assert (first.name, first.size) == ("momentum balance 1", np.inf)


def test_only_a_duration_on_its_bound_is_warned_about(transcription, reference_problem):
    problem = reference_problem(sequence="slip+ stick | slip+")
    x = np.zeros(transcription.variables.size)
    shortest = problem.limits.shortest_phase
    x[transcription.variables["duration"][0]] = [2 * shortest, shortest * (1 + 1e-6)]
    (warning,) = report_short_phases(transcription, problem, x)
    assert warning.startswith("phase 2 (stick) lasts 0.005 s")
    x[transcription.variables["duration"][0]] = [2 * shortest, 100 * shortest]
    assert report_short_phases(transcription, problem, x) == ()


def with_a_touchdown(transcription):
    """Return unknowns of 1 whose swing foot is above the ground before the last node."""
    x = np.ones(transcription.variables.size)
    x[transcription.variables["angles"][1, -2]] = 1.1
    return x


def test_a_plan_too_coarse_is_inaccurate(transcription, reference_problem):
    problem = reference_problem(sequence="slip+ stick | slip+")
    x, between = with_a_touchdown(transcription), BetweenNodes(0.0, 0.0)
    assert report_inaccuracies(transcription, problem, x, problem.transcription.tolerance, between) == ()
    (reason,) = report_inaccuracies(transcription, problem, x, 2 * problem.transcription.tolerance, between)
    assert "use more intervals" in reason


@pytest.mark.parametrize(
    ("between", "text"),
    [
        (BetweenNodes(0.0, 2e-3), "the contact mode is violated by 2.0e-03 between nodes"),
        (
            BetweenNodes(0.0, 0.0, -2e-8),
            "the foot changes its contact mode between nodes: its least distance from another mode is -2.0e-08",
        ),
    ],
)
def test_a_mode_left_between_nodes_is_an_inaccuracy(transcription, reference_problem, between, text):
    problem = reference_problem(sequence="slip+ stick | slip+")
    (reason,) = report_inaccuracies(transcription, problem, with_a_touchdown(transcription), 0.0, between)
    assert text in reason


@pytest.mark.parametrize(
    ("change", "travel", "reason"),
    [
        ({}, 0.05, "far shorter than the reach of 3.2 m"),
        ({"step_length": (0.2, 0.6)}, 0.2, "its lower bound"),
        ({}, 0.2, None),
        ({"speed": 0.5}, 0.05, None),
        ({"speed": (0.3, 0.5)}, 0.05, None),
        ({"step_length": 0.05}, 0.05, None),
    ],
)
def test_a_free_speed_with_ever_shorter_steps_is_warned_about(transcription, reference_problem, change, travel, reason):
    problem = reference_problem(**{"sequence": "slip+ stick | slip+", "speed": None, "step_length": None, **change})
    x = np.ones(transcription.variables.size)
    x[transcription.variables["travel"]] = travel
    sentences = report_short_steps(transcription, problem, x)
    assert len(sentences) == (reason is not None)
    if reason is not None:
        assert sentences[0].startswith(f"the speed is free, and the step length decreases to {travel:g} m, {reason}")
