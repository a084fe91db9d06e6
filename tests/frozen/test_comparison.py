"""The comparison of frozen results can fail: on costs, states, multipliers, contact sequences, verdicts and nan."""

import copy

import pytest

from tests.frozen.comparison import assert_agree

FROZEN = {
    "status": "solved",
    "sequence": "stick | stick",
    "cost_of_transport": 0.0162,
    "period": 0.74,
    "initial": {"velocity": [0.0, 0.0, 0.7, -0.5]},
    "multipliers": [[0.48, 0.52], [0.48, -0.52], [0.39, 0.0]],
    "passed": True,
    "returned": 8,
    "merged_into": None,
}

WITHIN = {
    "cost": ("cost_of_transport", 0.0162 * (1 + 9e-9)),
    "number": ("period", 0.74 * (1 - 9e-7)),
    "vector": ("initial", {"velocity": [6e-7, 0.0, 0.7, -0.5]}),
    "order of multipliers": ("multipliers", [[0.39, 0.0], [0.48, -0.52], [0.48, 0.52]]),
}

BEYOND = {
    "cost": ("cost_of_transport", 0.0162 * (1 + 1.1e-8)),
    "cost that is nan": ("cost_of_transport", float("nan")),
    "missing cost": ("cost_of_transport", None),
    "number": ("period", 0.74 * (1 - 1.1e-6)),
    "vector": ("initial", {"velocity": [8e-7, 0.0, 0.7, -0.5]}),
    "vector with nan": ("initial", {"velocity": [0.0, 0.0, float("nan"), -0.5]}),
    "short vector": ("initial", {"velocity": [0.0, 0.0, 0.7]}),
    "other entries": ("initial", {"rates": [0.0, 0.0, 0.7, -0.5]}),
    "multiplier": ("multipliers", [[0.48, 0.52], [0.48, -0.52], [0.39, 1e-6]]),
    "multiplier that is nan": ("multipliers", [[0.48, 0.52], [0.48, -0.52], [float("nan"), 0.0]]),
    "missing multiplier": ("multipliers", [[0.48, 0.52], [0.48, -0.52]]),
    "contact sequence": ("sequence", "slip+ stick | slip+"),
    "status": ("status", "infeasible"),
    "verdict": ("passed", False),
    "verdict as a number": ("passed", 1),
    "count": ("returned", 7),
    "something for nothing": ("merged_into", "stick | stick"),
}


def changed(name, value):
    return copy.deepcopy(FROZEN) | {name: value}


@pytest.mark.parametrize("change", WITHIN.values(), ids=WITHIN)
def test_results_within_the_tolerances_agree(change):
    assert_agree(changed(*change), FROZEN)


@pytest.mark.parametrize("change", BEYOND.values(), ids=BEYOND)
def test_results_beyond_the_tolerances_do_not(change):
    with pytest.raises(AssertionError):
        assert_agree(changed(*change), FROZEN)


def test_a_smaller_share_of_the_tolerances_is_stricter():
    with pytest.raises(AssertionError, match=r"result\.cost_of_transport"):
        assert_agree(changed("cost_of_transport", 0.0162 * (1 + 9e-9)), FROZEN, share=0.2)
