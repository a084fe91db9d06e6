"""Ctrl-C ends cleanly, wherever it comes."""

import contextlib
import json
import signal
import subprocess
import sys
import time

import pytest

from gaitopt import ArchiveError, load, save
from gaitopt.cli.app import main
from gaitopt.errors import InputError, ScriptError
from gaitopt.motion import archive
from gaitopt.ocp.solution.certification import Certification

SLOW_TO_BUILD = "import pathlib, time\n\n\ndef problem():\n    pathlib.Path('ready').touch()\n    time.sleep(60)\n"
SLOW_TO_SOLVE = """\
import pathlib

from gaitopt import GaitProblem, MultipleShooting, compass_biped


def problem():
    pathlib.Path("ready").touch()
    return GaitProblem(
        robot=compass_biped(), sequence="stick | stick", friction=0.14, speed=0.633, step_length=0.4713,
        transcription=MultipleShooting(intervals=1500),
    )
"""


def interrupted(script, folder, *arguments, after):
    """Run a solve, send SIGINT some seconds after its problem was made, and return what came of it."""
    script_path = script
    process = subprocess.Popen(
        [sys.executable, "-m", "gaitopt", "solve", script_path, *arguments],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    try:
        deadline = time.monotonic() + 240
        while not (folder / "ready").exists():
            assert process.poll() is None, process.communicate()
            assert time.monotonic() < deadline
            time.sleep(0.02)
        time.sleep(after)
        process.send_signal(signal.SIGINT)
        out, err = process.communicate(timeout=240)
    finally:
        process.kill()
        process.wait()
    assert "Traceback" not in err
    iterate = ["own_interrupted.h5"] * ("own_interrupted.h5" in out)
    assert sorted(path.name for path in folder.iterdir()) == ["own.py", *iterate, "ready"]
    return process.returncode, out, err


@pytest.mark.slow
@pytest.mark.parametrize("json_", [False, True])
def test_during_a_solve(script, folder, json_):
    status, out, err = interrupted(script(SLOW_TO_SOLVE), folder, *["--json"] * json_, after=2.0)
    assert status == 130
    assert "interrupted" in (out + err).lower()
    if json_:
        assert json.loads(out)["status"] == "interrupted"


@pytest.mark.parametrize("kind", [TypeError, ScriptError])
def test_an_interrupt_that_became_another_error(monkeypatch, capsys, kind):
    """CasADi clears what Python raises while it looks at arguments, and complains of them instead."""

    def load(path):
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        raise kind("Implicit conversion of symbolic CasADi type to numeric matrix not supported.")

    monkeypatch.setattr(archive, "load", load)
    with pytest.raises(SystemExit) as stop:
        main(["verify", "gait.h5"])
    assert stop.value.code == 130
    assert capsys.readouterr().err.strip() == "Interrupted; no result was written."


def test_a_mistake_after_an_interrupt_is_told(monkeypatch, capsys):
    def load(path):
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        raise ArchiveError("Cannot write gait.h5: No space left on device.")

    monkeypatch.setattr(archive, "load", load)
    with pytest.raises(SystemExit) as stop:
        main(["verify", "gait.h5"])
    assert stop.value.code == 2
    assert "No space left" in capsys.readouterr().err


def test_an_error_without_an_interrupt_is_raised(monkeypatch):
    def load(path):
        raise TypeError("our mistake")

    monkeypatch.setattr(archive, "load", load)
    with pytest.raises(TypeError, match="our mistake"):
        main(["verify", "gait.h5"])


def test_before_the_solve(script, folder):
    status, out, err = interrupted(script(SLOW_TO_BUILD), folder, "--json", after=0.1)
    assert status == 130
    assert json.loads(out)["status"] == "interrupted"
    assert err.strip() == "Interrupted; no result was written."


def raise_interrupt(*_):
    raise KeyboardInterrupt


def test_an_interrupt_after_the_solve_keeps_the_gait(command, root, folder, monkeypatch):
    """The second-order conditions are evaluated when the gait is written, which may take as long as the solve."""
    monkeypatch.setattr(Certification, "conclude", raise_interrupt)
    run = command("solve", root / "problems/compass_stick.py", "--set", "intervals=8")
    assert run.status == 130
    assert "wrote compass_stick.h5" in run.out
    gait = load("compass_stick.h5")
    assert gait.verification.passed
    assert gait.certificate is None
    assert run.err.endswith("verified, but the second-order conditions of its optimum are not checked.\n")


def test_an_interrupt_before_the_replay_is_stated(command, root, folder, monkeypatch):
    monkeypatch.setattr("gaitopt.simulation.verification.verify", raise_interrupt)
    run = command("solve", root / "problems/compass_stick.py", "--set", "intervals=8")
    assert run.status == 130
    assert load("compass_stick.h5").verification is None
    message = "the gait is solved but not verified. To replay it: gaitopt verify compass_stick.h5 -o"
    assert run.err.endswith(f"Interrupted before the end of the replay: {message} compass_stick_verified.h5\n")


def test_an_interrupt_while_a_gait_is_written_takes_effect_afterwards(slip_file, folder, monkeypatch):
    write, gait = archive.write_motion, load(slip_file)

    def interrupt(*arguments):
        signal.raise_signal(signal.SIGINT)
        write(*arguments)

    monkeypatch.setattr(archive, "write_motion", interrupt)
    former = signal.signal(signal.SIGINT, signal.default_int_handler)
    try:
        with pytest.raises(KeyboardInterrupt):
            save(gait, "gait.h5")
    finally:
        signal.signal(signal.SIGINT, former)
    assert load("gait.h5").cost_of_transport == gait.cost_of_transport


def test_an_interrupted_import_is_no_missing_package(capsys, monkeypatch):
    """The interrupt is lost in the import, whose error is then reported as that of a missing package."""

    def lose(*_):
        with contextlib.suppress(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
        try:
            raise ImportError
        except ImportError:
            raise InputError("heyoka is missing") from None

    monkeypatch.setattr("gaitopt.cli.listing._entry", lose)
    with pytest.raises(SystemExit) as stop:
        main(["problems"])
    assert (stop.value.code, "Interrupted" in capsys.readouterr().err) == (130, True)
