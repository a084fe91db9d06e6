"""Contact sequences with open phases: time stepping proposes the phases, a closed contact sequence finishes them."""

import math

import numpy as np
import pytest
from attrs import evolve

from gaitopt import ContactSequence, Homotopy, InputError, Ipopt, Mode, solve, verify
from gaitopt.ocp import ExactPenalty, Scholtes
from gaitopt.ocp.bounds import bounds, data_vector, structure
from gaitopt.ocp.initial.initial_point import initial_point
from gaitopt.ocp.mode_search.candidate_sequences import select_simplest
from gaitopt.ocp.mode_search.homotopy import follow_homotopy
from gaitopt.ocp.mode_search.phase_proposal import (
    ModeRun,
    contact,
    drop_brief_runs,
    find_runs,
    friction_residual,
    interval_lengths,
)
from gaitopt.ocp.nlp.keys import Unknown
from gaitopt.ocp.statement.initial_guess import LinearGuess
from gaitopt.ocp.transcription.transcription import transcribe

STICK, FORWARD, BACKWARD = Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD


@pytest.mark.slow
@pytest.mark.parametrize(
    ("friction", "sequence"),
    [(0.12, "slip+ stick slip- | slip+"), (0.14, "slip+ stick | slip+"), (0.25, "stick | stick")],
)
def test_the_whole_sequence_is_found_and_agrees_with_its_closed_solve(reference_problem, friction, sequence):
    gait = verify(solve(reference_problem(sequence="any | any", friction=friction, intervals=20)))
    assert gait.status.ok
    assert str(gait.sequence) == sequence
    assert gait.verification.passed
    assert gait.proposal.complementarity <= Homotopy().tolerance
    # Time stepping is of low order, but near.
    assert gait.proposal.cost_before == pytest.approx(gait.proposal.cost_after, rel=0.02)
    closed = solve(reference_problem(sequence=sequence, friction=friction, intervals=20))
    # From its own start the closed contact sequence may end in another optimum, but not in a much better one.
    assert gait.cost_of_transport <= closed.cost_of_transport + 1e-6


@pytest.mark.parametrize("text", ["any | stick", "stick any | any"])
def test_closed_places_are_kept(reference_problem, text):
    gait = solve(reference_problem(sequence=text, intervals=20))
    assert gait.status.ok
    assert ContactSequence.parse(text).admits(gait.sequence)


def test_another_relaxation_and_objective(reference_problem):
    problem = reference_problem(sequence="any | any", objective="torque_squared", intervals=20, friction=0.2)
    gait = solve(problem, homotopy=Homotopy(relaxation=Scholtes(), intervals=30))
    assert gait.status.ok
    assert gait.proposal.relaxation == "scholtes"
    assert gait.proposal.cost_before == pytest.approx(gait.proposal.cost_after, rel=0.05)


@pytest.fixture(scope="module")
def stepped(reference_problem):
    """Return problem, transcription and decision vector of a relaxed time-stepping solve."""
    grid = evolve(reference_problem().transcription, intervals=(40,))
    problem = reference_problem(sequence="any | any", friction=0.1, transcription=grid)
    transcription = transcribe(structure(problem, problem.transcription, ExactPenalty()))
    trail = follow_homotopy(
        Homotopy(),
        transcription,
        initial_point(transcription, problem, LinearGuess()),
        data_vector(problem),
        bounds(transcription, problem),
        lambda x: friction_residual(transcription, problem, x),
        Ipopt(),
        lambda step: None,
    )
    assert trail.ended
    return problem, transcription, trail.outcome.x


def test_time_stepping_has_the_robots_accelerations_and_forces(stepped, compass):
    """At each interval's middle the accelerations of sticking and sliding are those of the robot, made elsewhere."""
    problem, transcription, x = stepped
    layout, p = transcription.variables, compass.vector(problem.values)
    slide, speed = x[layout[Unknown.SLIDE]]
    q = np.vstack([slide, 0 * slide, x[layout["angles"]]])
    v = np.vstack([speed, 0 * slide, x[layout["rates"]]])
    step, torque = interval_lengths(transcription, x), x[layout["torque"]]
    normal, forward, backward, _ = contact(transcription, x)
    seen = set()
    for k, h in enumerate(step):
        before, after = speed[k], speed[k + 1]
        still = max(abs(before), abs(after)) < 1e-6
        if not still and min(abs(before), abs(after)) < 1e-3:
            continue  # the mode changes inside
        mode = STICK if still else Mode.slipping(after)
        at = ((q[:, k] + q[:, k + 1]) / 2, (v[:, k] + v[:, k + 1]) / 2)
        acceleration, force = compass.acceleration[mode](*at, torque[:, k], p)
        weight = 10 * 9.8
        assert np.asarray(acceleration).ravel()[2:] == pytest.approx((v[2:, k + 1] - v[2:, k]) / h, abs=1e-4)
        assert np.asarray(force).ravel() / weight == pytest.approx([forward[k] - backward[k], normal[k]], abs=1e-5)
        assert q[:, k + 1] - q[:, k] == pytest.approx(h * (v[:, k] + v[:, k + 1]) / 2, abs=1e-9)
        seen.add(mode)
    assert seen == {STICK, FORWARD, BACKWARD}


def test_a_wrong_force_is_seen_by_the_residual(stepped):
    problem, transcription, x = stepped
    assert friction_residual(transcription, problem, x) < 1e-6
    wrong = x.copy()
    wrong[transcription.variables[Unknown.CONTACT, 0][1, 5]] += 0.3
    assert friction_residual(transcription, problem, wrong) > 0.1


def test_runs_of_equal_modes():
    speed = np.array([0.3, 0.2, 0.0, 0.0, 0.0, -0.05, -0.2, 0.0, 0.0])
    assert find_runs(speed, 0.01) == [
        ModeRun(FORWARD, 0, 2),
        ModeRun(STICK, 2, 2),
        ModeRun(BACKWARD, 4, 3),
        ModeRun(STICK, 7, 1),
    ]
    # A creep below the least speed of a slide is no slide.
    assert find_runs(np.array([0.0, 0.005, 0.004, 0.0]), 0.01) == [ModeRun(STICK, 0, 3)]


def test_brief_runs_join_their_neighbours_but_an_impacts_slide_stays():
    runs = [ModeRun(FORWARD, 0, 1), ModeRun(STICK, 1, 10), ModeRun(BACKWARD, 11, 1), ModeRun(STICK, 12, 8)]
    assert drop_brief_runs(runs, STICK) == [ModeRun(STICK, 0, 20)]
    assert drop_brief_runs(runs, FORWARD) == [ModeRun(FORWARD, 0, 1), ModeRun(STICK, 1, 19)]
    assert drop_brief_runs([ModeRun(STICK, 0, 1), ModeRun(FORWARD, 1, 1)], STICK) == [ModeRun(STICK, 0, 2)]


@pytest.mark.parametrize(
    ("asked", "closed"),
    [
        ("any | any", "stick | stick"),
        ("any | slip+", "slip+ stick | slip+"),
        ("slip- any | any", "slip- stick | stick"),
        ("any stick | stick", "stick | stick"),
    ],
)
def test_without_a_solution_the_plainest_sequence_is_tried(asked, closed):
    found = select_simplest(ContactSequence.parse(asked))
    assert str(found) == closed
    assert ContactSequence.parse(asked).admits(found)
    assert found.check_periodic()


@pytest.mark.slow
def test_an_infeasible_problem_ends_with_its_status(reference_problem, monkeypatch):
    monkeypatch.setattr("gaitopt.ocp.solver.RETRIES", 0)
    problem = reference_problem(sequence="any | any", torque=0.1, intervals=10)
    gait = solve(problem, solver=Ipopt(max_iterations=50), homotopy=Homotopy(intervals=12))
    assert not gait.status.ok
    assert "the homotopy stopped" in gait.proposal.reason
    assert not gait.sequence.is_open


def test_intervals_of_phases_not_known_yet(reference_problem):
    with pytest.raises(InputError, match="intervals"):
        reference_problem(
            sequence="any | any", transcription=evolve(reference_problem().transcription, intervals=(5, 20))
        )
    with pytest.raises(InputError, match="contains 'any', which needs a finite friction"):
        reference_problem(sequence="any | any", friction=math.inf)
