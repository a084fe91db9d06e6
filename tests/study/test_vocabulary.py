"""Which words there are, which cannot be, and which are others in disguise."""

from dataclasses import replace

import pytest

from gaitopt import InputError, Word
from gaitopt.study.vocabulary import disguised, neighbours, why_impossible, words_up_to


def test_every_periodic_word_is_there_once():
    words = words_up_to(3)
    # 1, 2 and 3 phases without repeats: 3, 6, 12; those that begin to slip have two possible impacts.
    assert len(words) == len(set(words)) == (1 + 2 * 2) + (2 + 4 * 2) + (4 + 8 * 2)
    assert [len(word.phases) for word in words] == sorted(len(word.phases) for word in words)
    assert {"slip+ stick slip- | slip+", "slip- stick | slip-", "stick slip- | stick"} <= set(map(str, words))
    with pytest.raises(InputError, match="at least one phase"):
        words_up_to(0)


def test_who_always_slips_one_way_cannot_walk_on_level_ground(problem):
    def impossible(at):
        return {str(word) for word in words_up_to(3) if why_impossible(word, at)}

    assert impossible(problem) == {"slip+ | slip+", "slip- | slip-"}
    assert impossible(problem.replace(friction=float("inf"))) == set(map(str, words_up_to(3))) - {"stick | stick"}


def test_neighbours_are_mutual():
    for word in words_up_to(3):
        for other in neighbours(word):
            assert word in neighbours(other)
            assert abs(len(word.phases) - len(other.phases)) <= 2  # a phase between equal ones takes two away
    assert Word.parse("slip+ stick | slip+") in neighbours(Word.parse("slip+ stick slip- | slip+"))


def test_phases_at_their_shortest_are_seen_through(slip_gait):
    slip, stick = slip_gait.motion.segments
    assert disguised(slip_gait, slip.duration / 2) is None
    assert str(disguised(slip_gait, slip.duration)) == "stick | stick"
    backward = replace(slip_gait, motion=replace(slip_gait.motion, segments=(slip, stick, slip)))
    assert str(disguised(backward, stick.duration / 2)) == "stick | stick"
