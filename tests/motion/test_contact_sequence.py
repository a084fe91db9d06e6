"""Contact sequences: spelling, and every mistake named."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt import ContactSequence, InputError, Mode
from gaitopt.errors import SequenceError

MODES = [Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD]


@st.composite
def sequences(draw):
    phases = [draw(st.sampled_from(MODES))]
    for _ in range(draw(st.integers(0, 6))):
        phases.append(draw(st.sampled_from([mode for mode in MODES if mode is not phases[-1]])))
    return ContactSequence(tuple(phases), draw(st.sampled_from(MODES)))


@given(sequences())
def test_spelling_is_read_back(sequence):
    assert ContactSequence.parse(str(sequence)) == sequence
    assert ContactSequence.parse(sequence) is sequence


@given(sequences())
def test_a_periodic_sequence_begins_as_its_impact_ends(sequence):
    if sequence.impact is Mode.STICK or sequence.phases[0] is sequence.impact:
        assert sequence.check_periodic() is sequence
    else:
        with pytest.raises(SequenceError, match="must begin with"):
            sequence.check_periodic()


def test_the_reference_sequence():
    sequence = ContactSequence.parse("  slip+   stick|slip+ ")
    assert sequence.phases == (Mode.SLIP_FORWARD, Mode.STICK)
    assert sequence.impact is Mode.SLIP_FORWARD
    assert str(sequence) == "slip+ stick | slip+"


@pytest.mark.parametrize(
    ("text", "message"),
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
        ("slip+ > slip+", "no '>'. Phases are separated by spaces, and the impact by '|': 'slip+ | slip+'."),
        ("slip+ > stick | slip+", "the impact by '|': 'slip+ stick | slip+'."),
        ("slip+ | stick | slip+", "the impact by '|': 'slip+ stick | slip+'."),
        ("slip+ > slip-", "the impact by '|': 'slip+ | slip-'. The sequence 'slip+ | slip-' is not periodic"),
        ("Stick | stick", "unknown mode 'Stick'"),
    ],
)
def test_a_mistake_is_named_with_the_sequence_it_is_in(text, message):
    with pytest.raises(SequenceError) as caught:
        ContactSequence.parse(text)
    assert message in str(caught.value)
    assert text.strip() in str(caught.value)


@pytest.mark.parametrize("value", [None, 3, ["stick", "|", "stick"]])
def test_a_sequence_must_be_text(value):
    with pytest.raises(SequenceError, match="A contact sequence must be text"):
        ContactSequence.parse(value)


def test_a_sequence_error_is_an_input_error():
    assert issubclass(SequenceError, InputError)
    assert issubclass(SequenceError, ValueError)


@st.composite
def open_sequences(draw):
    places = [*MODES, Mode.ANY]
    phases = [draw(st.sampled_from(places))]
    for _ in range(draw(st.integers(0, 4))):
        phases.append(draw(st.sampled_from([mode for mode in places if mode is not phases[-1]])))
    return ContactSequence(tuple(phases), draw(st.sampled_from(places)))


@given(open_sequences())
def test_open_sequences_are_read_back_and_told_from_closed_ones(sequence):
    assert ContactSequence.parse(str(sequence)) == sequence
    assert sequence.is_open == ("any" in str(sequence))
    assert sequence.has_open_phases == ("any" in str(sequence).split("|")[0])
    if sequence.is_open:
        with pytest.raises(SequenceError, match="A replay needs a contact sequence without 'any'"):
            sequence.require_closed("A replay")
    else:
        assert sequence.require_closed("A replay") is sequence


@pytest.mark.parametrize("text", ["slip+ stick | any", "any | slip-", "any | any", "stick any | stick", "stick | any"])
def test_an_open_place_fits_what_is_beside_it(text):
    sequence = ContactSequence.parse(text)
    assert sequence.check_periodic() is sequence


def test_a_closed_first_phase_still_has_to_follow_a_closed_impact():
    with pytest.raises(SequenceError, match="must begin with 'slip\\+', not 'stick'"):
        ContactSequence.parse("stick any | slip+").check_periodic()


def test_two_open_phases_in_a_row_are_one():
    with pytest.raises(SequenceError, match="repeats 'any'"):
        ContactSequence.parse("any any | stick")


@given(sequences())
def test_what_an_open_sequence_admits(sequence):
    assert ContactSequence.parse("any | any").admits(sequence)
    assert sequence.admits(sequence)
    assert ContactSequence(sequence.phases, Mode.ANY).admits(sequence)
    assert ContactSequence((Mode.ANY,), sequence.impact).admits(sequence)
    assert not ContactSequence((Mode.ANY,), Mode.STICK if sequence.impact.slips else Mode.SLIP_FORWARD).admits(sequence)


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
    assert ContactSequence.parse(asked).admits(ContactSequence.parse(given)) is admitted
