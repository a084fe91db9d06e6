"""``gaitopt solve`` for robots with several contacts."""

import json
from pathlib import Path

import pytest

from gaitopt.cli.app import main

MONOPOD = str(Path(__file__).parents[2] / "problems" / "monopod.py")
QUICK = ["--set", "stance_intervals=6", "--set", "flight_intervals=16", "--set", "clearance=0.02"]


def run(capsys, *words):
    with pytest.raises(SystemExit) as end:
        main(["solve", MONOPOD, *words])
    return end.value.code, capsys.readouterr()


def test_the_summary_has_forces_and_impulses_by_contact(capsys):
    status, printed = run(capsys, "--json", *QUICK)
    data = json.loads(printed.out)
    assert status == 0
    assert (data["status"], data["file"]) == ("solved", None)
    assert data["verification"]["passed"]
    assert data["phases"][0]["modes"]["foot"] == "stick"
    assert data["phases"][0]["largest_normal_force"]["foot"] > 300
    assert data["impact"]["outcome"]["foot"] == "stick"
    assert data["impact"]["impulse"]["foot"][1] > 1
    assert data["problem"]["events"] == ["foot opens", "foot closes"]


def test_a_table_is_printed_and_nothing_is_written(capsys, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    status, printed = run(capsys, *QUICK)
    assert status == 0
    assert "foot stick > flight |" in printed.out
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["-o", "hop.h5"], "gaits of robots with several contacts are not saved"),
        (["--set", "sequence=foot stick > flight"], "must end with an event"),
        (["--set", "friction=0"], "finite friction coefficient greater than 0"),
    ],
)
def test_invalid_input_is_refused_in_a_sentence(capsys, words, sentence):
    status, printed = run(capsys, *words)
    assert status == 2
    assert sentence in " ".join(printed.err.split())
