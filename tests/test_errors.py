"""Exceptions: one family, and suggestions that help."""

import pytest

from gaitopt import ArchiveError, GaitoptError, InputError
from gaitopt.errors import ScriptError, SequenceError, suggest


@pytest.mark.parametrize("error", [ArchiveError, InputError, ScriptError, SequenceError])
def test_one_family(error):
    assert issubclass(error, GaitoptError)


def test_mistakes_in_values_are_value_errors_too():
    assert issubclass(InputError, ValueError)
    assert not issubclass(ArchiveError, ValueError)


def test_the_nearest_name_is_suggested_and_all_are_listed():
    assert suggest("torqe", ["torque", "speed"]) == "Did you mean 'torque'? Known: torque, speed."


def test_nothing_is_suggested_where_nothing_is_near():
    assert suggest("zzz", ["torque", "speed"]) == "Known: torque, speed."
    assert suggest("zzz", []) == "No names are known."


def test_any_iterable_of_names_will_do():
    assert suggest("spee", (name for name in ["torque", "speed"])).startswith("Did you mean 'speed'?")
