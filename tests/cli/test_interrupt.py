"""Ctrl-C ends cleanly, wherever it comes."""

import json
import signal
import subprocess
import sys
import time

import pytest

SLOW_TO_BUILD = "import pathlib, time\n\n\ndef problem():\n    pathlib.Path('ready').touch()\n    time.sleep(60)\n"
SLOW_TO_SOLVE = """\
import pathlib

from gaitopt import GaitProblem, MultipleShooting, compass_biped


def problem():
    pathlib.Path("ready").touch()
    return GaitProblem(
        robot=compass_biped(), word="stick | stick", friction=0.14, speed=0.633, step_length=0.4713,
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
    assert sorted(path.name for path in folder.iterdir()) == ["own.py", "ready"]
    return process.returncode, out, err


@pytest.mark.parametrize("json_", [False, True])
def test_during_a_solve(script, folder, json_):
    status, out, err = interrupted(script(SLOW_TO_SOLVE), folder, *["--json"] * json_, after=2.0)
    assert status in (1, 130)
    assert "interrupted" in (out + err).lower()
    if json_:
        assert json.loads(out)["status"] == "interrupted"


def test_before_the_solve(script, folder):
    status, out, err = interrupted(script(SLOW_TO_BUILD), folder, "--json", after=0.1)
    assert status == 130
    assert json.loads(out)["status"] == "interrupted"
    assert err.strip() == "Interrupted; nothing was written."
