"""Which words there are, which cannot be, and which are others in disguise."""

from dataclasses import replace

import pytest

from gaitopt import InputError, Word, search, sweep
from gaitopt.study.vocabulary import closed_words, disguised, neighbours, why_impossible, words_up_to


def test_every_periodic_word_is_there_once():
    words = words_up_to(3)
    # 1, 2 and 3 phases without repeats: 3, 6, 12; those that begin to slip have two possible impacts.
    assert len(words) == len(set(words)) == (1 + 2 * 2) + (2 + 4 * 2) + (4 + 8 * 2)
    assert [len(word.phases) for word in words] == sorted(len(word.phases) for word in words)
    assert {"slip+ stick slip- | slip+", "slip- stick | slip-", "stick slip- | stick"} <= set(map(str, words))
    for count in (0, 1.5, 7):
        with pytest.raises(InputError, match="max_phases must be"):
            words_up_to(count)


def test_studies_refuse_what_they_cannot_compare_at_their_door(problem):
    with pytest.raises(InputError, match=r"A search needs a closed word, but 'any \| stick' .* solve\(\) closes it"):
        search(problem, words=["stick | stick", "any | stick"])
    with pytest.raises(InputError, match=r"A sweep needs a closed word, but 'slip\+ stick \| any'"):
        sweep(problem.replace(word="slip+ stick | any"), friction=[0.14])
    with pytest.raises(InputError, match="A search needs a word"):
        search(problem, words=[])
    for study, options in ((search, {}), (sweep, {"friction": [0.14]})):
        with pytest.raises(InputError, match="starts must be"):
            study(problem, starts=0, **options)
    assert closed_words("stick | stick", "A sweep") == (Word.parse("stick | stick"),)


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
