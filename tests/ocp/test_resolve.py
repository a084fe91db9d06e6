"""A second solve rebuilds nothing; other starts are used and recorded."""

import pytest

from gaitopt import LinearGuess, RandomPerturbation, Status, solve
from gaitopt.ocp import FromMotion
from gaitopt.ocp.nlp import ipopt
from gaitopt.ocp.transcription.transcription import transcribe


def builds():
    return transcribe.cache_info().misses, ipopt._compile.cache_info().misses


@pytest.fixture(scope="module")
def first(reference_problem):
    # The work of this one is minimised again on the same grid, by the solver of warm starts.
    assert solve(reference_problem(sequence="slip+ stick | slip+", intervals=12, friction=0.17)).status.ok
    return solve(reference_problem(sequence="slip+ stick | slip+", intervals=12))


@pytest.mark.parametrize(
    "changes",
    [
        {"friction": 0.16},
        {"speed": 0.6},
        {"step_length": (0.4, 0.5)},
        {"slope": 0.005},
        {"parameters": {"leg_mass": 5.0, "hip_mass": 3.0}},
        {"torque": 8.0},
    ],
)
def test_a_second_solve_rebuilds_nothing(reference_problem, first, changes):
    assert first.status is Status.SOLVED
    before = builds()
    second = solve(reference_problem(sequence="slip+ stick | slip+", intervals=12, **changes))
    assert second.status is Status.SOLVED
    assert builds() == before
    assert second.solver.build_seconds == 0


def test_a_first_solve_says_what_its_build_took(reference_problem):
    transcribe.cache_clear()
    gait = solve(reference_problem(intervals=6))
    assert gait.solver.build_seconds > 0
    assert solve(reference_problem(intervals=6)).solver.build_seconds == 0


def test_a_solve_from_its_own_answer_agrees(reference_problem, solved):
    cold = solved(sequence="stick | stick")
    problem = reference_problem(guess=FromMotion(cold.motion, label="the optimum itself"))
    warm = solve(problem)
    assert warm.solver.objective == pytest.approx(cold.solver.objective, rel=1e-6)
    assert warm.problem["guess"] == "the optimum itself"
    assert cold.problem["guess"] == "a gait of least squared torques, 'stick | stick'"


def test_a_given_guess_is_the_only_start(reference_problem, solved, monkeypatch):
    motion = solved(sequence="stick | stick").motion

    def refuse(*_):
        raise AssertionError("another start was tried")

    for other in (LinearGuess, RandomPerturbation):
        monkeypatch.setattr(other, "sample", refuse)
    gait = solve(reference_problem(intervals=8, guess=FromMotion(motion, label="a given motion")))
    assert gait.status.ok
    assert gait.problem["guess"] == "a given motion"
    with pytest.raises(AssertionError, match="another start was tried"):
        solve(reference_problem(intervals=8))


def test_a_gait_carries_its_resolved_problem_and_versions(solved):
    gait = solved(sequence="stick | stick")
    assert gait.problem["leg_mass"] == 4.0
    assert gait.problem["intervals"] == [40]
    assert gait.problem["transcription"] == "collocation, 4 Lobatto points"
    assert set(gait.versions) == {"gaitopt", "casadi", "numpy", "scipy", "python"}
