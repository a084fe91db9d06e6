"""Commands whose walks are slow state how they become faster."""

from importlib.util import find_spec

import pytest

from gaitopt import InputError
from gaitopt.cli import engine_advice
from gaitopt.cli.engine_advice import EngineAdvice
from gaitopt.simulation import planar_engine_named
from gaitopt.simulation.scipy_engine import ScipyEngine


@pytest.fixture
def slow(monkeypatch):
    monkeypatch.setattr(engine_advice, "SLOW", 0.0)


def test_a_slow_assessment_of_several_contacts_leads_to_the_advice(slow, capsys):
    EngineAdvice(hidden=False).give(planar_engine_named("scipy"))
    assert "--engine heyoka" in capsys.readouterr().err
    EngineAdvice(hidden=True).give(planar_engine_named("scipy"))
    assert not capsys.readouterr().err


def test_a_package_that_is_missing_is_named(slow, capsys, monkeypatch):
    monkeypatch.setattr("gaitopt.simulation.engine_choice.find_spec", lambda name: None)
    EngineAdvice(hidden=False).give(ScipyEngine())
    assert "pip install 'gaitopt[fast]'" in capsys.readouterr().err


def test_a_quick_assessment_leads_to_none(capsys):
    EngineAdvice(hidden=False).give(planar_engine_named("scipy"))
    assert not capsys.readouterr().err


TRACE, PUSH = ("trace", "--over", "friction=0.8:0.79"), ("push", "--kind", "recovery", "--starts", "1")


@pytest.mark.parametrize("words", [TRACE, PUSH], ids=["trace", "push"])
def test_the_commands_give_the_advice_before_their_walks(command, root, slow, monkeypatch, words):
    def stop(*arguments, **options):
        raise InputError("stopped")

    monkeypatch.setattr("gaitopt.simulation.stiff_feedback.find_spec", lambda name: None)
    monkeypatch.setattr("gaitopt.cli.trace_command._trace", stop)
    monkeypatch.setattr("gaitopt.cli.push_command._resume", stop)
    verb, *options = words
    run = command(verb, root / "docs/examples/heel_toe.h5", *options)
    assert run.err.endswith("Error: stopped\n")
    assert "With stiff feedback the heyoka engine is about ten times faster" in run.err


TUNE = ("tune", "--law", "joint_pd", "--starts", "1")


@pytest.mark.skipif(find_spec("heyoka") is None, reason="heyoka is not installed")
@pytest.mark.parametrize("words", [TUNE, (*TRACE, "--law", "joint_pd"), (*PUSH, "--law", "joint_pd")])
def test_stiff_feedback_is_simulated_by_heyoka(command, root, monkeypatch, words):
    used = []

    def stop(*arguments, **options):
        used.append(options.get("engine") or arguments[-1]["engine"])
        raise InputError("stopped")

    monkeypatch.setattr("gaitopt.simulation.stiff_feedback.STIFF", 1)
    monkeypatch.setattr("gaitopt.cli.inputs.assess_planar", stop)
    monkeypatch.setattr("gaitopt.stability.assessment.assess_stability", stop)
    monkeypatch.setattr("gaitopt.cli.feedback._tune", stop)
    verb, *options = words
    run = command(verb, root / "docs/examples/heel_toe.h5", *options)
    assert "The feedback is stiff: the heyoka engine simulates the walks" in run.err
    assert run.err.endswith("Error: stopped\n")
    assert [engine.name for engine in used] == ["heyoka"]
