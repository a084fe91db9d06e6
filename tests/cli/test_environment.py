"""Commands in an unusual environment."""

import os
import subprocess
import sys

import pytest

from gaitopt.cli.app import MODULES

POSIX = pytest.mark.skipif(sys.platform == "win32", reason="uses a shell of POSIX")
NO_FOLDER = "/dev/null/none"

COARSE = ("--set", "objective=torque_squared", "--set", "intervals=8", "--set", "torque_limit=10")
STUDY = ("problems/compass_stick.py", *COARSE, "--workers", "2")
GAIT = "docs/examples/compass_slip.h5"

COMMANDS = {
    "new": ("walker",),
    "solve": ("problems/compass_stick.py", *COARSE, "-o", "out.h5"),
    "show": (GAIT,),
    "verify": (GAIT,),
    "design": ("problems/compass_design.py", "--set", "intervals=8", "-o", "out"),
    "plot": (GAIT, "-o", "out.png"),
    "animate": (GAIT, "--steps", "1", "--slow", "0.5", "-o", "out.gif"),
    "report": (GAIT, "-o", "out.html"),
    "export": (GAIT, "-o", "out.csv"),
    "problems": (),
    "simulate": ("problems/rimless_wheel.py", "--steps", "5"),
    "stability": ("problems/rimless_wheel.py", "--starts", "5"),
    "trace": ("problems/compass_passive.py", "--over", "slope=1:1.05", "-o", "out.nc"),
    "impact": ("problems/kneed_walker.py", "--state", "a=-0.1", "--state", "b=0.3", "--state", "a_rate=-1"),
    "tune": (GAIT, "--law", "lqr", "--samples", "0", "--evaluations", "2", "--starts", "1", "-o", "out.json"),
    "push": (GAIT, "--law", "lqr", "--starts", "1", "--steps", "6", "--kind", "recovery", "--workers", "2"),
    "basin": ("problems/rimless_wheel.py", "--over", "theta_rate=0.1:2:8", "--workers", "2", "-o", "out.nc"),
    "run": ("study.py",),
    "search": (*STUDY, "--max-phases", "1", "--starts", "1", "-o", "out"),
    "sweep": (*STUDY, "--over", "friction=0.25:0.3:2", "--starts", "1", "-o", "out.nc"),
    "pareto": (*STUDY, "--points", "2", "-o", "out.nc"),
    "compare": (GAIT, "-o", "out.png"),
    "audit": ("--count", "1", "-o", "out.json"),
    "doctor": (GAIT,),
}
"""Arguments of each command of ``gaitopt --help``."""


def run_plainly(arguments, root, folder, **further):
    """Run a command with few environment variables, with standard input closed and lines of 20 letters."""
    environment = {
        "PATH": os.environ["PATH"],
        "PYTHONPATH": str(root),
        "LANG": "C",
        "LC_ALL": "C",
        "COLUMNS": "20",
        "TERM": "dumb",
        "MPLBACKEND": "no such backend",
        **further,
    }
    arguments = [str(root / word) if word.startswith(("problems/", "docs/")) else word for word in arguments]
    return subprocess.run(
        ["sh", "-c", 'exec "$0" "$@" <&-', sys.executable, "-m", "gaitopt", *arguments],
        capture_output=True, text=True, env=environment, cwd=folder, timeout=240,
    )  # fmt: skip


@pytest.mark.slow
@POSIX
def test_a_figure_without_home_terminal_locale_and_backend(root, folder):
    home = {"HOME": NO_FOLDER, "XDG_CACHE_HOME": NO_FOLDER, "XDG_CONFIG_HOME": NO_FOLDER}
    run = run_plainly(("plot", *COMMANDS["plot"]), root, folder, **home)
    assert (run.returncode, run.stdout) == (0, "wrote out.png\n"), run.stderr
    assert "Traceback" not in run.stderr
    assert (folder / "out.png").stat().st_size > 10_000


def test_the_commands_below_are_all_commands():
    assert COMMANDS.keys() == MODULES.keys()


@POSIX
@pytest.mark.slow
@pytest.mark.parametrize("command", COMMANDS)
def test_every_command_without_home_terminal_locale_and_backend(command, root, folder):
    (folder / "study.py").write_text("def study():\n    return 3.5\n")
    run = run_plainly((command, *COMMANDS[command]), root, folder)
    assert run.returncode == 0, run.stderr
    assert "Traceback" not in run.stderr + run.stdout
    assert "Warning" not in run.stderr
