"""Labels are printed, never compared: with every label renamed the NLP and its solution stay what they are."""

import numpy as np
import pytest

from gaitopt import Ipopt, Limits, load, save, solve
from gaitopt.ocp import FromMotion
from gaitopt.ocp.bounds import bounds, structure
from gaitopt.ocp.nlp.keys import Key, Place
from gaitopt.ocp.solution.diagnosis import violations
from gaitopt.ocp.statement.warm_start import WarmStart
from gaitopt.ocp.transcription.transcription import transcribe


@pytest.fixture
def renamed(monkeypatch):
    """Rename every label, of quantities and of places, to one and the same text."""
    monkeypatch.setattr(Key, "label", "something")
    monkeypatch.setattr("gaitopt.ocp.nlp.layout.label", lambda key, identifier: "something")
    monkeypatch.setattr(Place, "label", "somewhere")
    transcribe.cache_clear()
    yield
    transcribe.cache_clear()


@pytest.fixture(scope="module")
def before(reference_problem):
    """Return a problem with every bound that is set by key, its NLP's bounds, and its solution on two grids."""
    problem = reference_problem(
        sequence="slip+ stick | slip+", limits=Limits(torque={"hip": 6}, torque_rate=400.0), intervals=24
    )
    transcription = transcribe(structure(problem, problem.transcription))
    return problem, bounds(transcription, problem), solve(problem)


def test_renamed_labels_leave_the_bounds_alone(before, renamed):
    problem, limits, _ = before
    transcription = transcribe(structure(problem, problem.transcription))
    assert {label for entry in transcription.constraints.labels for label in entry} == {"something", "somewhere"}
    found = bounds(transcription, problem)
    for part in ("x_lower", "x_upper", "g_lower", "g_upper"):
        assert np.array_equal(getattr(found, part), getattr(limits, part))


def test_renamed_labels_leave_the_solution_alone(before, renamed):
    """The solve passes from grid to grid with its multipliers, which are matched by key."""
    problem, _, gait = before
    again = solve(problem)
    assert again.solver.iterations == gait.solver.iterations
    assert again.solver.objective == gait.solver.objective
    for name, table in gait.solution.unknowns.items():
        assert np.array_equal(again.solution.unknowns[name].values, table.values)
        assert again.solution.unknowns[name].keys == table.keys
    assert set(again.solution.unknowns["torque"].rows) == {"something"}


def test_a_gait_saved_under_other_labels_starts_a_solve_as_well(before, renamed, tmp_path):
    problem, _, gait = before
    loaded = load(save(gait, tmp_path / "gait.h5"))
    assert loaded.solution.unknowns["torque"].keys == gait.solution.unknowns["torque"].keys
    # Newton's method and Ipopt leave differences of 1e-7 of an absolute work; Ipopt started from its result none.
    warm = solve(problem.replace(guess=WarmStart(loaded)), solver=Ipopt())
    cold = solve(problem.replace(guess=FromMotion(loaded.motion)), solver=Ipopt())
    assert warm.status.ok
    assert warm.solver.objective == pytest.approx(gait.solver.objective, rel=1e-8)
    assert warm.solver.iterations < cold.solver.iterations


def test_the_diagnosis_groups_by_key_and_prints_labels(before, renamed):
    problem, limits, _ = before
    transcription = transcribe(structure(problem, problem.transcription))
    x, g = np.zeros(transcription.variables.size), np.full(transcription.constraints.size, np.nan)
    found = violations(transcription, limits, x, g, most=1000)
    assert {(violation.place, violation.name) for violation in found} == {("somewhere", "something")}
    rows = {(p.part, p.phase, k.at(0)) for p, k in transcription.constraints.entries}
    assert len(found) >= len(rows)
