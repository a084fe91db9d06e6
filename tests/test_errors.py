"""Exceptions: one family, and suggestions that help."""

import pytest

from gaitopt import ArchiveError, GaitoptError, InputError
from gaitopt.errors import NoGaitError, ScriptError, SequenceError, describe_missing_file, suggest


@pytest.mark.parametrize("error", [ArchiveError, InputError, NoGaitError, ScriptError, SequenceError])
def test_one_family(error):
    assert issubclass(error, GaitoptError)


def test_mistakes_in_values_are_value_errors_too():
    assert issubclass(InputError, ValueError)
    assert not issubclass(ArchiveError, ValueError)


def test_the_nearest_name_is_suggested_and_all_are_listed():
    assert suggest("torqe", ["torque", "speed"]) == "Did you mean 'torque'? Known: torque, speed."


def test_nothing_is_suggested_where_nothing_is_near():
    assert suggest("zzz", ["torque", "speed"]) == "Known: torque, speed."
    assert suggest("zzz", []) == "No names are defined."


def test_any_iterable_of_names_will_do():
    assert suggest("spee", (name for name in ["torque", "speed"])).startswith("Did you mean 'speed'?")


def test_a_missing_file_is_reported_with_the_most_similar_one(tmp_path):
    for name in ("slip.h5", "slip.json", "sweep.nc", ".hidden.h5", "walk.png"):
        (tmp_path / name).touch()
    for name, similar in (("slip", "slip.h5"), ("slp.json", "slip.json"), ("sweeep", "sweep.nc")):
        assert describe_missing_file(tmp_path / name).endswith(f"Did you mean '{tmp_path / similar}'?")
    for name in ("walk", "hidden", "slip.csv", "other.h5"):
        assert describe_missing_file(tmp_path / name) == f"There is no file {tmp_path / name}."
    assert describe_missing_file(tmp_path / "none" / "slip") == f"There is no file {tmp_path / 'none' / 'slip'}."


@pytest.mark.parametrize("name", ["slip.h5", "slip"])
def test_a_failed_solve_is_named_for_the_missing_file_of_its_gait(name, tmp_path):
    failure = tmp_path / "slip_failed.h5"
    failure.touch()
    expected = (
        f"There is no file {tmp_path / name}: its solve found no gait. 'gaitopt show {failure}' states the reason."
    )
    assert describe_missing_file(tmp_path / name) == expected
    (tmp_path / "slip.py").touch()
    assert (describe_missing_file(tmp_path / name) == expected) is (name == "slip.h5")
