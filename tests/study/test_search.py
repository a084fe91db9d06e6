"""The search for the contact sequence of lowest cost."""

import json
from dataclasses import replace

import pytest

from gaitopt import (
    Collocation,
    ContactSequence,
    Execution,
    InputError,
    LinearGuess,
    PositiveWork,
    WarmStart,
    load,
    search,
    solve,
)
from gaitopt.study import multistart
from gaitopt.study.sequence_search import search as module
from gaitopt.study.sequence_search.ranking import RankedGait, judge_gait, rank_gaits, ranking_cost
from gaitopt.study.sequence_search.search import plan_search
from gaitopt.study.sequence_search.sequence_enumeration import enumerate_sequences
from gaitopt.study.storage.gait_store import GaitStore
from tests.study.conftest import quick_problem

SEQUENCES = ["stick | stick", "slip+ stick | slip+", "slip+ stick | stick", "slip+ | slip+"]


def run(directory=None, **options):
    problem = quick_problem(objective="cost_of_transport", friction=0.13)
    return search(problem, sequences=SEQUENCES, starts=1, directory=directory, execution=Execution(**options))


@pytest.fixture(scope="module")
def ranking():
    return run()


def found(ranking):
    return [(str(finding.sequence), finding.status) for finding in ranking.findings]


@pytest.mark.slow
def test_sequences_are_ranked_with_reasons(ranking):
    assert ranking.complete
    assert found(ranking) == [
        ("slip+ stick | slip+", "solved"),
        ("stick | stick", "solved"),
        ("slip+ stick | stick", "merged"),
        ("slip+ | slip+", "impossible"),
    ]
    first, second, merged, impossible = ranking.findings
    assert ranking.best is first.gait
    assert first.gait.solver.objective < second.gait.solver.objective
    assert all(finding.gait.verification.passed for finding in (first, second))
    assert str(merged.merged_into) == "stick | stick"
    assert merged.reason == "this gait degenerates to 'stick | stick': one phase has its minimum duration"
    assert "slip forward all the time" in impossible.reason


@pytest.mark.slow
def test_a_search_is_kept_gone_on_with_and_the_same_with_two_workers(ranking, tmp_path):
    def stop(done, total):
        if done == 3:
            raise KeyboardInterrupt

    folder = tmp_path / "sequences"
    part = run(directory=folder, observer=stop)
    assert not part.complete
    assert {status for _, status in found(part)} == {"pending", "impossible"}
    calls = []
    whole = run(directory=folder, workers=2, observer=lambda done, total: calls.append((done, total)))
    assert calls[0] == (4, 6)
    assert whole.records()[0] | {"file": None} == ranking.records()[0]
    assert found(whole) == found(ranking)
    assert json.loads((folder / "ranking.json").read_text())["ranked"] == whole.records()
    assert load(whole.findings[0].file).sequence == ranking.best.sequence
    assert len(list(folder.glob("*.h5"))) == 3
    calls.clear()
    assert found(run(directory=folder, observer=lambda done, total: calls.append(done))) == found(ranking)
    assert not calls
    with pytest.raises(InputError, match="different problem"):
        search(quick_problem(), sequences=SEQUENCES, starts=1, directory=folder)


def test_the_number_that_ranks_is_the_verified_cost_and_not_the_solvers(ranking):
    """Trapezoids of kinked powers may order two gaits otherwise than their true costs."""
    lower, higher = (finding.gait for finding in ranking.findings[:2])
    assert ranking_cost(lower) == lower.verification.cost_of_transport < ranking_cost(higher)
    swapped = [
        replace(gait, solver=replace(gait.solver, objective=objective))
        for gait, objective in ((lower, higher.solver.objective), (higher, lower.solver.objective))
    ]
    ranked = rank_gaits([judge_gait(gait, 1e-3, None) for gait in swapped[::-1]], complete=True)
    assert [finding.gait for finding in ranked.findings] == swapped
    record = ranked.records()[0]
    assert (record["ranked_by"], record["cost"]) == ("cost_of_transport", lower.verification.cost_of_transport)
    assert record["objective"] == higher.solver.objective


def test_positive_work_is_ranked_by_the_work_of_the_motion():
    problem = quick_problem(objective=PositiveWork(regeneration=0.5))
    gait = solve(problem)
    assert ranking_cost(gait) == pytest.approx(gait.solver.objective, rel=2e-2)
    assert ranking_cost(gait) != gait.solver.objective
    smooth = solve(quick_problem(objective="torque_squared"))
    assert ranking_cost(smooth) == smooth.solver.objective


def test_a_search_without_any_gait_says_why():
    nothing = search(quick_problem(friction=0.02, speed=1.5), sequences=["stick | stick"], starts=1)
    with pytest.raises(InputError, match=r"No contact sequence has a gait; for example 'stick \| stick'"):
        _ = nothing.best
    assert nothing.findings[0].status == "infeasible"
    assert nothing.findings[0].reason.startswith("no gait found; speed is 1.5 m/s: ")


def test_a_search_needs_intervals_for_every_sequence():
    problem = quick_problem(sequence="slip+ stick | slip+", transcription=Collocation(intervals=(5, 20)))
    message = r"one number of intervals for all contact sequences, such as intervals=20, got \(5, 20\)"
    with pytest.raises(InputError, match=message):
        search(problem, max_phases=2)


def test_longer_sequences_start_from_shorter_ones_and_all_get_a_second_look():
    needs = {task.key: task.needs for task in plan_search(enumerate_sequences(3), 4)}
    assert "slip+_stick__slip+.first" in needs["slip+_stick_slip-__slip+.first"]
    assert needs["stick__stick.first"] == ()
    assert "slip+_stick__slip+.first" in needs["stick__stick"]
    assert len(needs) == 2 * 35


def test_a_neighbour_that_the_gait_was_solved_from_is_not_tried_twice(monkeypatch):
    neighbour = solve(quick_problem(friction=0.13))
    problem = quick_problem(sequence="slip+ stick | slip+", friction=0.13)
    tried = []
    monkeypatch.setattr(module, "solve_coarse", lambda problem, starts, **options: tried.append(starts) or [neighbour])
    monkeypatch.setattr(module, "solve_fine", lambda problem, coarse: coarse)
    monkeypatch.setattr(module, "verify_best", lambda problem, gaits: gaits)
    same_label = WarmStart(neighbour, f"a gait '{neighbour.sequence}'")  # a guess of the user, not of the search
    for start, number in ((LinearGuess(), 1), (same_label, 1), (neighbour, 0)):
        first = multistart.solve_fine(problem, multistart.solve_coarse(problem, [start]))[0]
        raised = first.replace_fields(solver=first.solver.replace_fields(objective=2 * neighbour.solver.objective))
        gaits = module.solve_sequence(problem, (problem.sequence, 0), raised, raised, neighbour)
        assert len(tried) == number
        assert gaits == [raised, *[neighbour] * number]
        tried.clear()


def test_a_gait_in_disguise_is_merged_unless_it_is_cheaper(slip_gait):
    """At friction 0.205 the slide of lowest cost is shorter than allowed, but costs less than no slide."""
    slip, sequence = slip_gait, ContactSequence.parse("stick | stick")
    is_degenerate = judge_gait(slip, slip.motion.segments[0].duration, None)
    assert is_degenerate.merged_into == sequence
    for factor, status in ((1.01, "solved"), (1.0, "merged"), (None, "solved")):
        others = []
        if factor is not None:
            other = replace(slip, solver=replace(slip.solver, objective=factor * slip.solver.objective))
            others = [RankedGait(sequence=sequence, status="solved", gait=other)]
        ranking = rank_gaits([is_degenerate, *others], complete=True)
        found = {finding.sequence: finding for finding in ranking.findings}[slip.sequence]
        assert found.status == status
        assert found.ranked == (found.reason == "") == (found.merged_into is None)
        assert (ranking.best is slip) == (status == "solved")


def test_two_runs_may_tidy_up_one_folder(tmp_path, monkeypatch):
    folder = GaitStore(tmp_path / "sequences", {"sequences": 1})
    monkeypatch.setattr(GaitStore, "__iter__", lambda self: iter(["deleted by the other run"]))
    folder.keep_only([])
    assert [path.name for path in folder.path.iterdir()] == ["question.json"]
