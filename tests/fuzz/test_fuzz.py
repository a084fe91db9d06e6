"""A sample of odd calls and odd command lines; ``python -m tests.fuzz 20000`` makes more of them."""

from gaitopt.cli.output import out
from tests.fuzz import command_lines
from tests.fuzz.fuzzer import fuzz, public_callables


def test_odd_arguments_end_in_a_sentence(tmp_path, request):
    outcomes = list(fuzz(1200, request.config.rootpath, tmp_path))
    wrong = [f"{outcome} | {call}" for call, outcome, _ in outcomes if outcome.startswith(("raw", "hang"))]
    assert not wrong, "\n".join(wrong)
    refused = sum(outcome == "refused" for _, outcome, _ in outcomes)
    assert refused > len(outcomes) / 2


def test_every_public_verb_is_called():
    names = set(public_callables())
    assert {"gaitopt.solve", "gaitopt.sweep", "gaitopt.load", "gaitopt.simulation.simulate_planar"} <= names
    assert len(names) > 150


def test_odd_command_lines_end_in_a_sentence(tmp_path, request, monkeypatch):
    monkeypatch.setattr(out, "quiet", False)  # which a command line that is refused in its midst does not restore
    command_lines.prepare(request.config.rootpath, tmp_path)
    for number in range(48):
        words = command_lines.draw(number)
        outcome = command_lines.run(words, tmp_path)
        assert outcome in ("status 0", "status 1", "status 2"), (outcome, words)
