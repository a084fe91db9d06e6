"""Words: spelling, and every mistake named."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt import InputError, Mode, Word, WordError

MODES = [Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD]


@st.composite
def words(draw):
    phases = [draw(st.sampled_from(MODES))]
    for _ in range(draw(st.integers(0, 6))):
        phases.append(draw(st.sampled_from([mode for mode in MODES if mode is not phases[-1]])))
    return Word(tuple(phases), draw(st.sampled_from(MODES)))


@given(words())
def test_spelling_is_read_back(word):
    assert Word.parse(str(word)) == word
    assert Word.parse(word) is word


@given(words())
def test_a_periodic_word_begins_as_its_impact_ends(word):
    if word.impact is Mode.STICK or word.phases[0] is word.impact:
        assert word.check_periodic() is word
    else:
        with pytest.raises(WordError, match="must begin with"):
            word.check_periodic()


def test_the_reference_word():
    word = Word.parse("  slip+   stick|slip+ ")
    assert word.phases == (Mode.SLIP_FORWARD, Mode.STICK)
    assert word.impact is Mode.SLIP_FORWARD
    assert str(word) == "slip+ stick | slip+"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("stick", "exactly one '|'"),
        ("stick | stick | stick", "exactly one '|'"),
        ("stick |", "exactly one impact after '|', got 0"),
        ("stick | stick slip+", "exactly one impact after '|', got 2"),
        ("| stick", "no phases"),
        ("stick stick | stick", "repeats 'stick'"),
        ("stick slip+ slip+ | stick", "repeats 'slip+'"),
        ("stick | slide", "unknown mode 'slide'"),
        ("stik | stick", "unknown mode 'stik'. Did you mean 'stick'?"),
        ("stick free | stick", "contains 'free'"),
        ("stick | free", "contains 'free'"),
        ("Stick | stick", "unknown mode 'Stick'"),
    ],
)
def test_a_mistake_is_named_with_the_word_it_is_in(text, says):
    with pytest.raises(WordError) as caught:
        Word.parse(text)
    assert says in str(caught.value)
    assert text.strip() in str(caught.value)


@pytest.mark.parametrize("value", [None, 3, ["stick", "|", "stick"]])
def test_a_word_must_be_text(value):
    with pytest.raises(WordError, match="A word is text"):
        Word.parse(value)


def test_a_word_error_is_an_input_error():
    assert issubclass(WordError, InputError)
    assert issubclass(WordError, ValueError)


@st.composite
def open_words(draw):
    places = [*MODES, Mode.ANY]
    phases = [draw(st.sampled_from(places))]
    for _ in range(draw(st.integers(0, 4))):
        phases.append(draw(st.sampled_from([mode for mode in places if mode is not phases[-1]])))
    return Word(tuple(phases), draw(st.sampled_from(places)))


@given(open_words())
def test_open_words_are_read_back_and_told_from_closed_ones(word):
    assert Word.parse(str(word)) == word
    assert word.is_open == ("any" in str(word))
    assert word.has_open_phases == ("any" in str(word).split("|")[0])
    if word.is_open:
        with pytest.raises(WordError, match="A replay needs a closed word"):
            word.require_closed("A replay")
    else:
        assert word.require_closed("A replay") is word


@pytest.mark.parametrize("text", ["slip+ stick | any", "any | slip-", "any | any", "stick any | stick", "stick | any"])
def test_an_open_place_fits_what_is_beside_it(text):
    word = Word.parse(text)
    assert word.check_periodic() is word


def test_a_closed_first_phase_still_has_to_follow_a_closed_impact():
    with pytest.raises(WordError, match="must begin with 'slip\\+', not 'stick'"):
        Word.parse("stick any | slip+").check_periodic()


def test_two_open_phases_in_a_row_are_one():
    with pytest.raises(WordError, match="repeats 'any'"):
        Word.parse("any any | stick")


@given(words())
def test_what_an_open_word_admits(word):
    assert Word.parse("any | any").admits(word)
    assert word.admits(word)
    assert Word(word.phases, Mode.ANY).admits(word)
    assert Word((Mode.ANY,), word.impact).admits(word)
    assert not Word((Mode.ANY,), Mode.STICK if word.impact.slips else Mode.SLIP_FORWARD).admits(word)


@pytest.mark.parametrize(
    ("asked", "given", "admitted"),
    [
        ("stick any | any", "slip+ stick | slip+", False),
        ("stick any | any", "stick slip- | stick", True),
        ("any stick | any", "stick | stick", True),
        ("slip+ any slip- | any", "slip+ stick slip- | slip+", True),
        ("slip+ stick | any", "slip+ stick slip- | slip+", False),
    ],
)
def test_closed_places_stay_where_they_are(asked, given, admitted):
    assert Word.parse(asked).admits(Word.parse(given)) is admitted
