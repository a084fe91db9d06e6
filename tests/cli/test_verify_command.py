"""The option of `gaitopt verify` that stores the result of the replay."""

import shutil

import pytest

from gaitopt import load, save
from tests.hdf5 import edit_hdf5


@pytest.fixture
def unverified(folder, slip_file):
    """A gait that was not replayed."""
    return save(load(slip_file).replace_fields(verification=None), folder / "gait.h5")


def test_the_replay_is_stored_in_another_file(command, unverified, folder):
    before = unverified.read_bytes()
    run = command("verify", "gait.h5", "-o", "verified.h5")
    assert run.status == 0, run.err
    assert "wrote verified.h5 (the gait with the result of its replay)" in run.out
    assert "was not changed" not in run.out
    assert unverified.read_bytes() == before
    assert load("verified.h5").verification.passed
    assert command("show", "verified.h5", "--json").json["verification"]["passed"]
    assert command("plot", "verified.h5", "-o", "verified.png").status == 0
    stored = command("verify", "gait.h5", "-o", "again.h5", "--json")
    assert (stored.status, stored.json["file"]) == (0, "again.h5")
    assert load("again.h5").verification == load("verified.h5").verification


def test_a_failed_replay_is_stored_with_its_reasons(command, slip_file, folder):
    shutil.copy(slip_file, "gait.h5")
    with edit_hdf5(folder / "gait.h5") as file:
        file["motion/segments/0001/torque"][1] *= 1.01
    run = command("verify", "gait.h5", "-o", "failed.h5")
    assert run.status == 1
    assert load("failed.h5").status.key == "not_verified"
    assert load("failed.h5").verification.reasons


def test_no_input_is_replaced_and_no_part_is_written(command, unverified, folder, monkeypatch):
    before = unverified.read_bytes()
    assert "is an input of this command" in command("verify", "gait.h5", "-o", "gait.h5").err
    assert "the suffix '.csv' is not that of a known format" in command("verify", "gait.h5", "-o", "gait.csv").err

    def stop(*arguments):
        raise KeyboardInterrupt

    monkeypatch.setattr("gaitopt.motion.archive.write_motion", stop)
    assert command("verify", "gait.h5", "-o", "verified.h5").status == 130
    assert [path.name for path in folder.iterdir()] == ["gait.h5"]
    assert unverified.read_bytes() == before
