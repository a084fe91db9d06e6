"""gaitopt trace of a script that states an optimal-control problem."""

import math
from pathlib import Path

import pytest

from gaitopt.continuation import load_optima

OPTIMA = "problems/compass_optima.py"
COARSE = ["--set", "intervals=10", "--over", "friction=0.25:0.15"]


def test_a_script_of_a_gait_problem_gives_branches_of_optimal_gaits(command, root, folder):
    result = command("trace", root / OPTIMA, *COARSE, "--points", "5", "--json", "-o", "optima.nc")
    assert result.status == 0, result.err
    (branch,) = result.json["branches"]
    assert (branch["kind"], branch["period"], branch["sequence"], branch["end"]) == (
        "optimal",
        1,
        "stick | stick",
        "range_end",
    )
    assert {"value", "state", "multipliers", "stable", "cost"} <= set(branch["points"][0])
    assert {point["replay"] for point in branch["points"]} == {"passed"}
    for point in branch["points"]:
        assert point["radius"] == pytest.approx(max(math.hypot(*pair) for pair in point["multipliers"]))
        assert point["stable"] is (point["radius"] < 1)
    assert branch["special"][0]["constraint"] == "forward friction cone at phase 1 (stick), node 10"
    assert result.json["ratios"] == []
    assert load_optima(folder / "optima.nc").records()["branches"] == result.json["branches"]


@pytest.mark.slow
def test_tables_list_branches_of_several_sequences(command, root, folder):
    result = command(
        "trace", root / OPTIMA, *COARSE, "--points", "3", "--replay", "0", "--sequences", "slip+ stick | slip+"
    )
    assert result.status == 0, result.err
    assert "slip+ stick | slip+" in result.out
    assert "activation" in result.out
    assert command("trace", root / OPTIMA, *COARSE, "--replay", "0", "-q", "-o", "optima.png").out == ""
    assert Path("optima.png").stat().st_size > 10_000


@pytest.mark.parametrize(
    ("options", "sentence"),
    [
        (["--over", "fiction=0.1:0.2"], "no parameter, target or limit 'fiction'"),
        (["--over", "friction=0.1:0.2", "--second", "slope=0:0.1"], "--second is not accepted"),
        (["--over", "friction=0.1"], "NAME=FROM:TO"),
        (["--over", "friction=0.1:0.2", "-o", "optima.txt"], "optima.txt"),
    ],
)
def test_invalid_options_get_a_sentence(command, root, options, sentence):
    result = command("trace", root / OPTIMA, *options)
    assert result.status == 2
    assert sentence in " ".join(result.err.split())


@pytest.mark.parametrize(("error", "status"), [(KeyboardInterrupt, 130), (RecursionError, 1)])
def test_an_interrupt_or_error_keeps_the_gaits_followed(command, root, monkeypatch, error, status):
    from gaitopt.continuation.optimal.branch_recorder import BranchRecorder

    add_point, count = BranchRecorder.add_point, iter(range(100))

    def add_and_interrupt(recorder, point):
        if next(count) == 3:
            raise error
        add_point(recorder, point)

    monkeypatch.setattr(BranchRecorder, "add_point", add_and_interrupt)
    result = command("trace", root / OPTIMA, *COARSE, "--replay", "0", "--json")
    assert result.status == status
    assert ("RecursionError" in result.json.get("error", "")) is (status == 1)
    assert result.json["complete"] is False
    assert len(result.json["branches"][0]["points"]) == 3
    assert {point["radius"] for point in result.json["branches"][0]["points"]} == {None}


@pytest.mark.slow
def test_neighbouring_sequences_and_their_border_are_printed(command, root):
    options = ["--set", "friction=0.14", "--set", "intervals=20", "--points", "4", "--replay", "0", "--neighbours"]
    result = command("trace", root / OPTIMA, *options, "--over", "speed=0.62:0.66")
    assert result.status == 0, result.err
    assert "backward impact cone at touchdown" in result.out
    assert "lowest cost: 'stick | stick' below speed = 0.6473140" in result.out
    assert "'slip+ stick | slip+' above" in result.out
