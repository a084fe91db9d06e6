"""The release of a latched contact has one name in plans, simulations and files; its former names are understood."""

from dataclasses import replace

import pytest

from gaitopt import load, save
from gaitopt.model import vertical_hopper
from gaitopt.model.contacts.contact_state import ContactState
from gaitopt.motion.planar_steps import number_steps
from gaitopt.motion.stated_changes import list_changes
from gaitopt.simulation import simulate_planar

HEIGHT = [0.7, 0.2]
"""The hopper falls with its latched leg at full length, which the landing releases."""


@pytest.fixture(scope="module")
def hop():
    return simulate_planar(vertical_hopper(), HEIGHT, [0, 0], {}, duration=0.5).motion


def test_a_simulation_and_a_plan_state_the_release(hop):
    event = hop.events[0]
    assert event.names == ("sole closes", "full length released")
    outcome = event.outcome if event.outcome is not None else event.after
    assert set(list_changes(event.before, outcome, event.after)) == set(event.names)


def test_a_latched_contact_that_can_only_push_from_now_on_is_released():
    """Before, a plan stated that it was closed, and a simulation that it was released."""
    before, after = (ContactState.of({"foot": "stick", "knee": mode}) for mode in ("latched", "closed"))
    assert list_changes(before, after, after) == ("knee released",)


@pytest.mark.parametrize("name", ["full length released", "full length opens"])
def test_a_simulation_ends_at_the_release_by_either_name(hop, name):
    rollout = simulate_planar(vertical_hopper(), HEIGHT, [0, 0], {}, until=name)
    assert rollout.stop.key == "event_reached"
    assert rollout.motion.events[-1].time == hop.events[0].time
    assert number_steps(hop, [name])[:2] == [0, 1]


def test_a_released_contact_that_stays_closed_does_not_open(hop):
    event = replace(hop.events[0], after=hop.events[0].before)
    assert event.includes("full length released")
    assert not event.includes("full length opens")


def test_files_with_the_former_name_are_read(hop_gait, tmp_path):
    """A file of an earlier version contains the former name."""
    before = ContactState.of(dict.fromkeys(hop_gait.robot.contact_names, "latched"))
    last = replace(hop_gait.motion.events[-1], before=before, names=("foot opens", "foot closes"))
    motion = replace(hop_gait.motion, events=(*hop_gait.motion.events[:-1], last))
    path = save(hop_gait.replace_fields(motion=motion), tmp_path / "old.h5")
    assert load(path).motion.events[-1].names == ("foot released", "foot closes")
