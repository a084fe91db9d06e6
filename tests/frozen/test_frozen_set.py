"""The set of frozen results is as large and as varied as it should be, and the default run sees all kinds of it."""

import json
from pathlib import Path

import pytest

from tests.frozen import candidates, studies
from tests.frozen.storage import FILES, load_frozen

LARGEST = 1_000_000
"""Of all files together [bytes]."""


def kinds(entries, *path):
    """Return the different values of one field of the statements of solved problems."""
    found = set()
    for entry in entries:
        value = entry["arguments"]["statement"]
        for key in path:
            value = value[key]
        found.add(json.dumps(value))
    return {json.loads(value) for value in found}


@pytest.fixture(scope="module")
def problems():
    return load_frozen("problems")


def test_sixty_problems_are_solved_and_some_fail(problems):
    statuses = [entry["result"]["status"] for entry in problems]
    assert statuses.count("solved") >= 60
    assert statuses.count("infeasible") >= 5
    assert all(entry["result"]["verification"]["passed"] for entry in problems if "verification" in entry["result"])


@pytest.mark.parametrize("default", [False, True], ids=["all", "default run"])
def test_every_kind_of_problem_is_there(problems, default):
    chosen = [entry for entry in problems if entry["default"] or not default]
    solved = [entry for entry in chosen if entry["result"]["status"] == "solved"]
    assert kinds(solved, "objective", "name") == {"cost_of_transport", "positive_work", "torque_squared"}
    assert any(entry["arguments"]["statement"]["objective"].get("regeneration") for entry in solved)
    assert kinds(solved, "transcription", "name") == {"collocation", "multiple_shooting"}
    assert kinds(solved, "robot") == {"compass_biped", "five_link"}
    assert kinds(solved, "sequence") >= set(candidates.CLOSED)
    assert any("any" in sequence for sequence in kinds(solved, "sequence"))


def test_the_default_run_solves_a_third(problems):
    assert 3 * sum(entry["default"] for entry in problems) == pytest.approx(len(problems), abs=3)


def test_the_statements_are_those_of_the_scripts(problems):
    numbers = [int(entry["name"].split()[0]) for entry in problems]
    for number, entry in zip(numbers, problems, strict=True):
        drawn = [candidates.draw(number, attempt) for attempt in range(8)]
        assert entry["arguments"]["statement"] in drawn
    for name in ("published", "studies"):
        planned = json.loads(json.dumps(getattr(studies, name)()))
        assert [[one["name"], one["computation"], one["arguments"]] for one in load_frozen(name)] == planned


def test_the_files_are_small_and_named_once():
    folder = Path(__file__).parent
    assert sum((folder / f"{name}.json").stat().st_size for name in FILES) < LARGEST
    names = [entry["name"] for file in FILES for entry in load_frozen(file)]
    assert len(names) == len(set(names))
