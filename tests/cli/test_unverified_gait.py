"""report, stability and tune of a gait that was not replayed, or failed its replay."""

import dataclasses

import pytest

from gaitopt import load, save

WARNING = "Not verified: the torques of this gait were not replayed in the event-driven simulator."
TUNE = ("--law", "pd", "--starts", "1", "--samples", "0", "--evaluations", "1")


@pytest.fixture(autouse=True)
def unverified(folder, slip_file):
    """A gait that was not replayed."""
    return save(load(slip_file).replace_fields(verification=None), folder / "gait.h5")


@pytest.mark.parametrize("words", [("stability", "gait.h5"), ("report", "gait.h5"), ("tune", "gait.h5", *TUNE)])
def test_a_gait_that_was_not_replayed_is_remarked(command, words, slip_file):
    run = command(*words)
    assert run.status == 0, run.err
    assert run.err.count(WARNING) == 1
    assert "To replay them: gaitopt verify gait.h5 -o gait_verified.h5" in run.err
    quiet = command(*words, "--json")
    facts = quiet.json["gait_verified"]
    assert facts == ({"gait": False} if words[0] == "report" else False)
    assert "Not verified" not in quiet.err
    verified = command(words[0], slip_file, *words[2:])
    assert (verified.status, "Not verified" in verified.err) == (0, False)


def test_the_page_states_it_and_that_of_a_failed_replay(command, folder, slip_file):
    command("report", "gait.h5")
    assert WARNING in (folder / "gait.html").read_text(encoding="utf-8")
    gait = load(slip_file)
    replay = dataclasses.replace(gait.verification, passed=False, reasons=("the walker falls",))
    save(gait.with_verification(replay), folder / "failed.h5")
    run = command("report", "failed.h5")
    assert "warning: failed: Not a solution (not_verified)" in run.err
    assert command("report", "failed.h5", slip_file, "--json").json["gait_verified"] == {
        "failed": False,
        "compass_slip": True,
    }


def test_a_simulated_gait_needs_no_replay(command, root):
    run = command("stability", root / "problems/compass_passive.py", "--json")
    assert (run.status, run.json["gait_verified"]) == (0, None)
