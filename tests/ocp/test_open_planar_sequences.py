"""Contact sequences of robots with several contacts that leave modes open."""

import numpy as np
import pytest

from gaitopt import Collocation, search, sweep
from gaitopt.errors import InputError, SequenceError
from gaitopt.model import compass_with_two_feet, flat_foot_walker, kneed_walker, monopod
from gaitopt.motion import PhaseSequence
from gaitopt.ocp import solve_planar
from gaitopt.ocp.multicontact import open_sequences
from gaitopt.ocp.multicontact.open_sequences import close_sequence
from gaitopt.ocp.multicontact.planar_enumeration import enumerate_planar_sequences
from tests.ocp.multicontact_examples import walk


def closed(text, robot):
    return [str(each) for each in close_sequence(PhaseSequence.parse(text, robot), robot)]


@pytest.mark.parametrize(
    ("text", "sequences"),
    [
        ("foot A stick |", ["foot A stick |"]),
        ("foot A any |", ["foot A stick |", "foot A slip+ |", "foot A slip- |"]),
        ("stick | any", ["foot A stick |"]),  # after a slipping impact the stance foot slips
        (
            "foot A slip+ > foot A stick | [foot B any]",
            ["foot A slip+ > foot A stick | [foot B stick]", "foot A slip+ > foot A stick |"],
        ),
        (
            "foot A any, foot B stick > foot B stick |",
            [f"foot A {mode}, foot B stick > foot B stick |" for mode in ("stick", "slip+", "slip-")],
        ),
    ],
)
def test_the_sequences_that_an_open_one_stands_for(text, sequences):
    assert closed(text, compass_with_two_feet()) == sequences


def test_contacts_of_one_body_slip_together():
    robot = flat_foot_walker()
    sequences = closed("heel A any, toe A any > toe A any |", robot)
    for phase in (PhaseSequence.parse(each, robot).phases[0] for each in sequences):
        assert len({mode for _, mode in phase}) == 1
    assert sequences


def test_any_alone_is_every_sequence():
    robot = monopod()
    assert closed("any", robot) == [str(each) for each in enumerate_planar_sequences(robot, 2)]
    assert str(PhaseSequence.parse(" any ", robot)) == "any"
    assert PhaseSequence.parse("any", robot).is_open
    assert not PhaseSequence.parse("foot stick > flight |", robot).is_open


@pytest.mark.slow
def test_an_open_problem_has_the_best_gait_of_its_sequences():
    problem = walk(transcription=Collocation(intervals=10), friction=0.3)
    best = solve_planar(problem.replace(sequence="foot A any |"))
    assert best.status.ok
    assert str(best.sequence) == "foot A stick |"
    assert best.solver.objective == pytest.approx(solve_planar(problem).solver.objective, rel=1e-9)


def test_sequences_that_the_problem_excludes_are_left_out():
    problem = walk(transcription=Collocation(intervals=10), friction=np.inf)
    assert str(solve_planar(problem.replace(sequence="foot A any |")).sequence) == "foot A stick |"


def test_a_search_ranks_the_sequences_of_an_open_one():
    problem = walk(transcription=Collocation(intervals=10), friction=np.inf)
    ranking = search(problem, sequences=["foot A any |"], starts=1)
    assert {str(finding.sequence) for finding in ranking.findings} == set(
        closed("foot A any |", compass_with_two_feet())
    )
    assert str(ranking.best.sequence) == "foot A stick |"


def test_open_sequences_that_are_refused(monkeypatch):
    robot = compass_with_two_feet()
    with pytest.raises(SequenceError, match=r"A sweep needs a sequence without 'any', got 'foot A any \|'"):
        sweep(walk().replace(sequence="foot A any |"), {"speed": [0.6]})
    with pytest.raises(SequenceError, match="matches no possible contact sequence of 'compass_with_two_feet'"):
        closed("foot A slip+ > foot A any | [foot B slip-]", robot)
    with pytest.raises(InputError, match="with joint stops are not enumerated"):
        closed("any", kneed_walker())
    with pytest.raises(SequenceError, match="has contact 'knee A' in mode 'any'; accepted: closed, latched"):
        PhaseSequence.parse("foot A stick, knee A any |", kneed_walker())
    monkeypatch.setattr(open_sequences, "MOST_SEQUENCES", 2)
    with pytest.raises(SequenceError, match=r"matches 3 contact sequences of .* more than 2: specify more modes"):
        closed("foot A any |", robot)
