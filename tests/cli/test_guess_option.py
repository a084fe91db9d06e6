"""gaitopt solve --guess: from a gait, and from a recorded motion with its report."""

import pytest

from gaitopt import load, write_csv

COARSE = ("--set", "intervals=8", "--set", "objective=torque_squared")


@pytest.fixture
def solved(command, root, slip_file, folder):
    def run(*arguments):
        return command("solve", root / "problems/compass_slip.py", *COARSE, *arguments)

    return run


def test_a_gait_and_a_recorded_motion_are_guesses(solved, slip_file, folder):
    first = solved("--guess", slip_file, "--json")
    assert first.status == 0, first.err
    assert first.json["problem"]["guess"] == "gait compass_slip.h5"
    text = write_csv(load(slip_file).motion, folder / "walk.csv").read_text().replace("th1_rad,", "stance,", 1)
    (folder / "walk.csv").write_text(text)
    second = solved("--guess", "walk.csv", "--column", "th1=stance", "--angle-unit", "rad")
    assert second.status == 0, second.err
    assert "height of the landing foot at the end" in second.out
    assert load("compass_slip.h5").problem["guess"] == "recorded motion walk.csv"


def test_options_without_a_recorded_motion_are_rejected(solved, slip_file):
    assert "are accepted only with a recorded motion" in solved("--guess", slip_file, "--angle-unit", "deg").err
    assert "--column must have the form NAME=COLUMN, got 'th1'" in solved("--guess", "a.csv", "--column", "th1").err
