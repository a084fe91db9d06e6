"""Contact sequences: the possible ones, the impossible ones, and degenerate cases of others."""

import math
from dataclasses import replace

import pytest

from gaitopt import ContactSequence, InputError, search, solve, sweep
from gaitopt.ocp.solution.impossible_sequences import explain_impossibility
from gaitopt.status import Status
from gaitopt.study.sequence_search.sequence_enumeration import (
    closed_sequences,
    enumerate_sequences,
    is_degenerate,
    neighbours,
)


def test_every_periodic_sequence_is_there_once():
    sequences = enumerate_sequences(3)
    # 1, 2 and 3 phases without repeats: 3, 6, 12; those that begin to slip have two possible impacts.
    assert len(sequences) == len(set(sequences)) == (1 + 2 * 2) + (2 + 4 * 2) + (4 + 8 * 2)
    assert [len(sequence.phases) for sequence in sequences] == sorted(len(sequence.phases) for sequence in sequences)
    assert {"slip+ stick slip- | slip+", "slip- stick | slip-", "stick slip- | stick"} <= set(map(str, sequences))
    for count in (0, 1.5, 7):
        with pytest.raises(InputError, match="max_phases must be"):
            enumerate_sequences(count)


def test_studies_refuse_what_they_cannot_compare_at_their_door(problem):
    with pytest.raises(
        InputError, match=r"A search needs a contact sequence without 'any', got 'any \| stick'; solve\(\) determines"
    ):
        search(problem, sequences=["stick | stick", "any | stick"])
    with pytest.raises(InputError, match=r"A sweep needs a contact sequence without 'any', got 'slip\+ stick \| any'"):
        sweep(problem.replace(sequence="slip+ stick | any"), {"friction": [0.14]})
    with pytest.raises(InputError, match="A search needs a contact sequence"):
        search(problem, sequences=[])
    for study, options in ((search, {}), (sweep, {"axes": {"friction": [0.14]}})):
        with pytest.raises(InputError, match="starts must be"):
            study(problem, starts=0, **options)
    assert closed_sequences("stick | stick", "A sweep") == (ContactSequence.parse("stick | stick"),)


def test_who_always_slips_one_way_cannot_walk_on_level_ground(problem):
    def impossible(at):
        return {str(sequence) for sequence in enumerate_sequences(3) if explain_impossibility(sequence, at)}

    assert impossible(problem) == {"slip+ | slip+", "slip- | slip-"}
    assert impossible(problem.replace(friction=float("inf"))) == set(map(str, enumerate_sequences(3))) - {
        "stick | stick"
    }


def test_neighbours_are_mutual():
    for sequence in enumerate_sequences(3):
        for other in neighbours(sequence):
            assert sequence in neighbours(other)
            assert abs(len(sequence.phases) - len(other.phases)) <= 2  # a phase between equal ones takes two away
    assert ContactSequence.parse("slip+ stick | slip+") in neighbours(
        ContactSequence.parse("slip+ stick slip- | slip+")
    )


def test_phases_at_their_shortest_are_seen_through(slip_gait):
    slip, stick = slip_gait.motion.segments
    assert is_degenerate(slip_gait, slip.duration / 2) is None
    assert str(is_degenerate(slip_gait, slip.duration)) == "stick | stick"
    backward = replace(slip_gait, motion=replace(slip_gait.motion, segments=(slip, stick, slip)))
    assert str(is_degenerate(backward, stick.duration / 2)) == "stick | stick"


def test_a_solve_states_the_reason_of_a_search(problem):
    (finding,) = search(problem, sequences=["slip+ | slip+"], starts=1).findings
    gait = solve(problem.replace(sequence="slip+ | slip+"))
    assert (finding.status, gait.status) == ("impossible", Status.INFEASIBLE)
    assert gait.solver.message == finding.reason
    assert "all contacts slip forward all the time: friction" in finding.reason
    assert gait.solver.iterations <= 1
    assert gait.solver.violations == ()


def test_a_slope_that_balances_friction_allows_slip_in_one_direction(problem):
    downhill = problem.replace(slope=0.1, friction=math.tan(0.1), sequence="slip+ | slip+")
    assert explain_impossibility(downhill.sequence, downhill) == ""
    assert explain_impossibility(downhill.sequence, downhill.replace(friction=0.2))
    assert explain_impossibility(downhill.sequence, downhill.replace(friction=0.2, slope=(0.0, 0.3))) == ""


def test_a_slope_steeper_than_friction_is_refused_before_the_solve(problem):
    steep = problem.replace(slope=math.radians(20), friction=0.14, sequence="slip+ stick | slip+")
    gait = solve(steep)
    assert gait.status is Status.INFEASIBLE
    assert gait.solver.iterations <= 1
    assert gait.solver.message.startswith(
        "tan(slope) = 0.364 exceeds friction 0.14 on the slope of 0.3491 rad (20 deg)"
    )
    assert "state an absolute slope of at most 0.1391 rad (7.97 deg), or friction of at least 0.364" in (
        gait.solver.message
    )
    uphill = steep.replace(slope=-1.2)
    assert "if it is in deg, convert it by math.radians(-1.2)" in explain_impossibility(uphill.sequence, uphill)
    ridge = steep.replace(parameters={**steep.parameters, "static_friction_ratio": 3.0})
    assert explain_impossibility(ridge.sequence, ridge) == ""
    free = steep.replace(slope=(0.1, 0.4))
    assert explain_impossibility(free.sequence, free) == ""


@pytest.mark.parametrize("sequence", ["any | any", "stick any | any", "slip+ any | slip+", "any slip- any | any"])
def test_an_open_sequence_on_a_slope_steeper_than_friction_is_refused_before_the_solve(problem, sequence):
    steep = problem.replace(slope=math.radians(20), friction=0.14, sequence=sequence)
    gait = solve(steep)
    assert gait.status is Status.INFEASIBLE
    assert gait.solver.iterations <= 1
    assert gait.solver.message.startswith("tan(slope) = 0.364 exceeds friction 0.14")
    assert gait.solver.violations == ()
    gentle = steep.replace(slope=math.radians(5))
    assert explain_impossibility(gentle.sequence, gentle) == ""
