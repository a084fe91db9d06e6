"""A contact sequence may state what changes at its events as results print it; the changes are checked."""

import re

import pytest

from gaitopt.errors import SequenceError
from gaitopt.model.robots.compass_with_two_feet import compass_with_two_feet
from gaitopt.model.robots.flat_foot_walker import flat_foot_walker
from gaitopt.model.robots.kneed_walker import kneed_walker
from gaitopt.model.robots.monopod import monopod
from gaitopt.motion.phase_sequence import PhaseSequence
from gaitopt.ocp.multicontact.open_sequences import close_sequence

DOUBLE_SUPPORT = "foot A slip+, foot B stick > foot B stick |"
WITH_CHANGES = "foot A slip+, foot B stick > (foot A opens) foot B stick | (foot B slip+ & foot A closes)"
KNEED = "foot A stick, knee A latched | foot A stick, knee A latched, knee B latched |"


@pytest.mark.parametrize(
    ("robot", "text"),
    [
        (compass_with_two_feet(), DOUBLE_SUPPORT),
        (compass_with_two_feet(), "foot A slip+ > foot A stick | [foot B slip+]"),
        (flat_foot_walker(), "heel A stick | heel A stick, toe A stick > toe A stick |"),
        (kneed_walker(), KNEED),
        (monopod(), "foot stick > flight |"),
    ],
)
def test_the_printed_events_are_read_and_give_the_same_sequence(robot, text):
    short = PhaseSequence.parse(text, robot)
    parts = re.split(r"(?<=[>|\]]) (?![\[(])", f"{short} ")
    stated = " ".join(
        f"{part} ({' & '.join(short.describe_event(robot, number))})" for number, part in enumerate(filter(None, parts))
    )
    assert stated.count("(") == len(short.phases)
    written = PhaseSequence.parse(stated)
    assert str(written) == stated
    assert PhaseSequence.parse(str(written)) == written
    assert PhaseSequence.parse(stated, robot) == written.without_changes() == short
    assert str(PhaseSequence.parse(stated, robot)) == text


def test_changes_are_read_in_any_order():
    assert str(PhaseSequence.parse(WITH_CHANGES, compass_with_two_feet())) == DOUBLE_SUPPORT


@pytest.mark.parametrize("kind", ["released", "opens"])
def test_a_release_is_read_by_its_present_and_its_former_name(kind):
    text = f"{KNEED} (foot B closes & foot A opens & knee A {kind})"
    assert str(PhaseSequence.parse(text, kneed_walker())) == KNEED


@pytest.mark.parametrize(
    ("event", "message"),
    [
        (
            "foot B opens",
            "at the event after phase 1, it states 'foot B opens', but contact 'foot B' is in mode 'stick'",
        ),
        ("foot A slip-", "contact 'foot A' is in mode 'slip\\+' before the event and 'free' after it"),
        ("foot A opens & foot B closes", "it states 'foot B closes', but contact 'foot B' is in mode 'stick' before"),
        ("toe opens", "names 'toe', which is not a contact"),
        ("foot A opens & foot A opens", "states 'foot A opens' twice at one event"),
        ("foot A lifts", "states the event 'foot A lifts', which is not a contact and what it does"),
        ("", "states the event '', which is not a contact and what it does"),
    ],
)
def test_a_change_that_contradicts_the_phases_is_an_error(event, message):
    with pytest.raises(SequenceError, match=message):
        PhaseSequence.parse(f"foot A slip+, foot B stick > ({event}) foot B stick |", compass_with_two_feet())


def test_an_omitted_change_is_an_error():
    with pytest.raises(
        SequenceError, match="after phase 2, it omits 'foot B slip\\+'; the changes are 'foot A closes & "
    ):
        PhaseSequence.parse(f"{DOUBLE_SUPPORT} (foot A closes)", compass_with_two_feet())


def test_stated_changes_select_among_the_sequences_of_an_open_one():
    walk = "foot A any, foot B stick > (foot A opens) foot B stick | (foot A closes & foot B slip-)"
    (closed,) = close_sequence(PhaseSequence.parse(walk, compass_with_two_feet()), compass_with_two_feet())
    assert str(closed) == "foot A slip-, foot B stick > foot B stick |"
