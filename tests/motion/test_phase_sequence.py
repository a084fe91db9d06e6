"""Contact sequences of robots with several contacts are read back unambiguously and checked against a robot."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt.errors import SequenceError
from gaitopt.model.contacts.mode import Mode
from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
from gaitopt.model.robots.kneed_walker import kneed_walker
from gaitopt.model.robots.monopod import monopod
from gaitopt.motion.phase_sequence import PhaseEvent, PhaseSequence

MODES = [Mode.STICK, Mode.SLIP_FORWARD, Mode.SLIP_BACKWARD, Mode.CLOSED, Mode.LATCHED]
NAMES = ["foot A", "foot B", "knee", "heel of the left foot"]
phases = st.dictionaries(st.sampled_from(NAMES), st.sampled_from(MODES)).map(lambda modes: tuple(modes.items()))
events = st.one_of(st.just(PhaseEvent(False)), st.builds(PhaseEvent, st.just(True), st.one_of(st.none(), phases)))
sequences = st.lists(st.tuples(phases, events), min_size=1, max_size=4).map(
    lambda parts: PhaseSequence(tuple(phase for phase, _ in parts), tuple(event for _, event in parts))
)


@given(sequences)
def test_every_sequence_is_read_back_from_its_text(sequence):
    assert PhaseSequence.parse(str(sequence)) == sequence


@pytest.mark.parametrize(
    ("short", "long"),
    [
        ("stick | stick", "foot A stick |"),
        ("slip+ stick | slip+", "foot A slip+ > foot A stick |"),
        ("stick slip- | stick", "foot A stick > foot A slip- |"),
        ("slip- stick | stick", "foot A slip- > foot A stick | [foot B stick]"),
    ],
)
def test_sequences_of_walkers_in_single_support_are_read(short, long):
    robot = compass_with_two_feet()
    assert PhaseSequence.parse(short, robot) == PhaseSequence.parse(long, robot)
    assert str(PhaseSequence.parse(short, robot)) == long


def test_the_exchange_of_the_legs_leads_to_the_first_phase():
    robot = compass_with_two_feet()
    sequence = PhaseSequence.parse("foot A slip+, foot B stick > foot B stick |", robot)
    after = sequence.state_after(robot, 1)
    assert (after.mode("foot A"), after.mode("foot B")) == (Mode.STICK, Mode.SLIP_FORWARD)
    assert sequence.describe_event(robot, 1) == ("foot A closes", "foot B slip+")


def test_a_knee_that_the_foot_releases_takes_part_in_the_impact():
    robot = kneed_walker()
    text = "foot A stick, knee A latched | foot A stick, knee A latched, knee B latched |"
    sequence = PhaseSequence.parse(text, robot)
    outcome, after = sequence.outcome(robot, 1), sequence.state_after(robot, 1)
    assert (outcome.mode("knee A"), after.mode("knee A")) == (Mode.LATCHED, Mode.FREE)
    assert (outcome.mode("foot A"), outcome.mode("foot B")) == (Mode.FREE, Mode.STICK)
    assert sequence.describe_event(robot, 0) == ("knee B closes",)
    assert sequence.describe_event(robot, 1) == ("foot B closes", "foot A opens", "knee A released")


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("foot stick > flight", r"must end with an event, '>' or '\|'"),
        ("foot", "must end with an event"),
        ("foot glide |", "contains 'foot glide', which is not a contact and its mode"),
        ("stick |", "contains 'stick', which is not a contact and its mode. The contact in mode 'stick' is missing"),
        ("foot |", "The mode of the contact is missing: write, for example, 'foot stick'"),
        ("fot > flight |", "The mode of the contact is missing: write, for example, 'foot stick'"),
        ("foot stik |", r"Did you mean 'stick'\?"),
        ("foot stick, foot slip+ |", "names contact 'foot' twice"),
        ("foot stick > [foot stick] flight |", "states an outcome .* after '>'"),
        ("toe stick > flight |", "names 'toe', which is not a contact"),
        ("foot latched > flight |", "contact 'foot' in mode 'latched'; accepted: stick, slip\\+, slip-"),
        ("foot stick > foot stick > flight |", "no mode changes after phase 1"),
        (
            "foot stick | flight |",
            r"no contact closes in the impact after phase 1\. Add the contact that closes to phase 2, or write '>' for "
            r"an event without impact: 'foot stick > flight \|'",
        ),
        (
            "foot stick |",
            "no contact closes in the impact after phase 1. Robot .* has no mirror, .* state mirror=",
        ),
        (
            "foot stick > flight | [foot slip+]",
            "after an impact that ends in 'slip\\+', contact 'foot' does not change to mode 'stick'",
        ),
        (3, "must be text"),
    ],
)
def test_an_impossible_sequence_is_refused_with_a_sentence(text, message):
    with pytest.raises(SequenceError, match=message):
        PhaseSequence.parse(text, monopod())


@pytest.mark.parametrize(
    ("text", "end"),
    [
        ("hip point stick |", "but the robot has fallen when this contact closes (falls=True). Known: foot A, foot B."),
        ("hip point stick >", "but the robot has fallen when this contact closes (falls=True). Known: foot A, foot B."),
        ("flight |", " Add a phase in which a contact is closed, for example 'foot A stick > flight |'."),
        (
            "foot A stick, foot B stick |",
            " Add the contact that closes to the first phase, before which the legs are exchanged.",
        ),
        (
            "foot A stick > foot A stick, foot B slip+ > foot A stick, foot B stick |",
            " Add the contact that closes to the first phase, before which the legs are exchanged, or write '>' for an "
            "event without impact: "
            "'foot A stick > foot A stick, foot B slip+ > foot A stick, foot B stick >'.",
        ),
    ],
)
def test_the_advice_on_an_impossible_impact_is_possible(text, end):
    with pytest.raises(SequenceError) as raised:
        PhaseSequence.parse(text, compass_with_two_feet())
    assert str(raised.value).endswith(end)
    assert ",," not in str(raised.value)


def test_wrong_separators_of_the_short_form_are_named_with_the_right_spelling():
    with pytest.raises(SequenceError, match=r"Phases are separated by spaces, .*: 'slip\+ stick \| slip\+'"):
        PhaseSequence.parse("slip+ > stick > slip+", compass_with_two_feet())


def test_a_short_form_needs_a_pair_of_feet():
    with pytest.raises(SequenceError, match="does not have exactly one pair of feet"):
        PhaseSequence.parse("stick | stick", monopod())


@pytest.mark.parametrize("text", ["foot slide > flight |", "foot stick > (foot slide) flight |"])
def test_slip_without_a_direction_is_reported_with_both_directions(text):
    with pytest.raises(SequenceError, match=r"'slip\+' is forward .*'slip-' backward"):
        PhaseSequence.parse(text)
