"""A sample of odd calls and odd command lines; ``python -m tests.fuzz 20000`` makes more of them."""

from tests.fuzz.fuzzer import fuzz, public_callables


def test_odd_arguments_end_in_a_sentence(tmp_path, request):
    outcomes = list(fuzz(2000, request.config.rootpath, tmp_path))
    wrong = [f"{outcome} | {call}" for call, outcome, _ in outcomes if outcome.startswith(("raw", "hang"))]
    assert not wrong, "\n".join(wrong)
    refused = sum(outcome == "refused" for _, outcome, _ in outcomes)
    assert refused > len(outcomes) / 2


def test_every_public_verb_is_called():
    names = set(public_callables())
    assert {"gaitopt.solve", "gaitopt.sweep", "gaitopt.load", "gaitopt.simulation.simulate_planar"} <= names
    assert len(names) > 150
