"""What every command has: an example, --json, --quiet, --verbose, and names that Python knows too."""

import gc
import json
import os
import subprocess
import sys
from pathlib import Path

import pytest
import typer

import gaitopt
from gaitopt.cli.app import app
from gaitopt.cli.collection import ALLOCATIONS

COMMANDS = typer.main.get_command(app).commands
GAIT = "docs/examples/compass_slip.h5"


@pytest.mark.parametrize("name", COMMANDS)
def test_every_command_has_an_example_and_the_shared_options(name):
    command = COMMANDS[name]
    options = {spelled for parameter in command.params for spelled in parameter.opts}
    assert {"--json", "--quiet", "--verbose"} <= options
    assert f"Example: gaitopt {name} " in command.help or command.help.endswith(f"Example: gaitopt {name}")


def test_starts_states_what_it_counts_and_its_default_in_every_command():
    named = {name: [each for each in command.params if "--starts" in each.opts] for name, command in COMMANDS.items()}
    starts = {name: found[0] for name, found in named.items() if found}
    assert set(starts) == {"search", "sweep", "pareto", "audit", "stability", "trace", "tune", "push"}
    for name, option in starts.items():
        counted = "initial guesses" if name in ("search", "sweep", "pareto", "audit") else "random"
        assert counted in option.help, name
        assert option.show_default
    assert "optimal gaits" in starts["trace"].help
    assert "saved gait" in starts["stability"].help


def test_a_command_searches_for_unreachable_objects_seldom_and_restores_the_default(command, monkeypatch):
    before, during = gc.get_threshold(), []
    monkeypatch.setattr("gaitopt.cli.listing.print_json", lambda facts: during.append(gc.get_threshold()[0]))
    assert command("problems", "--json").status == 0
    assert during == [ALLOCATIONS]
    assert gc.get_threshold() == before
    assert gc.get_freeze_count() == 0


COUNTING = """
import atexit, gc, sys
from gaitopt import __main__
from gaitopt.cli import collection

searches = []
gc.callbacks.append(lambda phase, _: phase == "start" and searches.append(gc.get_threshold()[0]))
excluded, exclude = [], collection.exclude_imported_modules
collection.exclude_imported_modules = lambda: (exclude(), excluded.append(len(searches)))
atexit.register(lambda: print("searches", len(searches) - excluded[0]))
sys.argv = ["gaitopt", "solve", sys.argv[1], "--quiet", "-o", sys.argv[2]]
__main__.main()
"""


@pytest.mark.slow
def test_a_solve_ends_before_python_searches_for_unreachable_objects(tmp_path):
    words = [sys.executable, "-c", COUNTING, "problems/compass_slip.py", str(tmp_path / "gait.h5")]
    run = subprocess.run(words, capture_output=True, text=True, check=True)
    assert run.stdout.splitlines()[-1] == "searches 0"


@pytest.mark.parametrize("given", [{}, {"OMP_NUM_THREADS": "2"}, {"OPENBLAS_NUM_THREADS": "3"}])
def test_linear_algebra_has_one_thread_unless_a_number_is_given(given):
    inherited = {key: value for key, value in os.environ.items() if not key.endswith("_NUM_THREADS")}
    code = "import os; from gaitopt.__main__ import _use_one_thread; _use_one_thread(); "
    code += "print(os.environ.get('OPENBLAS_NUM_THREADS'))"
    words = [sys.executable, "-c", code]
    run = subprocess.run(words, env=inherited | given, capture_output=True, text=True, check=True)
    assert run.stdout.strip() == (given.get("OPENBLAS_NUM_THREADS", "None") if given else "1")


def test_commands_and_python_verbs_have_the_same_names():
    """Those that are not on the list do what several Python verbs do, or none."""
    other = {
        "new",
        "show",
        "problems",
        "doctor",
        "run",
        "export",
        "plot",
        "report",
        "stability",
        "tune",
        "push",
        "impact",
        "pareto",  # Pareto(...).trace
        "design",  # solve, and Family(...).solve
        "audit",  # solve, verify, and the replay of gaitopt.study.audit
    }
    assert set(COMMANDS) - other <= set(gaitopt.__all__)


def test_quiet_prints_nothing(command, root):
    run = command("show", root / GAIT, "--quiet")
    assert (run.status, run.out, run.err) == (0, "", "")
    assert command("show", root / GAIT).out


def test_verbose_says_versions_and_seconds_beside_the_answer(command, root):
    run = command("show", root / GAIT, "--verbose", "--json")
    assert run.json["sequence"] == "slip+ stick | slip+"
    assert f"gaitopt {gaitopt.__version__}" in run.err
    assert "gaitopt show took 0." in run.err


@pytest.mark.parametrize(
    ("verb", "name"), [("plot", "slip.svg"), ("export", "slip.json"), ("report", "slip.html"), ("new", "walker.py")]
)
def test_files_that_are_written_are_told_as_json(verb, name, command, root, folder):
    given = (name,) if verb == "new" else (root / GAIT, "-o", name)
    run = command(verb, *given, "--json")
    more = {"gait_verified": {"compass_slip": True}} if verb == "report" else {}
    assert json.loads(run.out) == {"file": name} | more
    assert (folder / name).is_file()


GAIT_FILE = Path(__file__).parents[2] / "docs/examples/compass_slip.h5"
INFEASIBLE = """
from gaitopt import Collocation, GaitProblem, Limits, compass_biped


def problem():
    return GaitProblem(
        robot=compass_biped(), sequence="stick | stick", friction=0.01, speed=0.6, step_length=0.45,
        limits=Limits(torque=6), transcription=Collocation(intervals=10),
    )
"""


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (("solve", "own.py"), "infeasible: no gait found; "),
        pytest.param(
            ("sweep", "own.py", "--over", "friction=0.01", "-o", "own.nc"),
            "No gait was found: no gait found; ",
            marks=pytest.mark.slow,
        ),
        (("simulate", GAIT_FILE, "--set", "friction=0.01"), "fell: The walker fell."),
        (("doctor", "own.py"), "own.py"),
    ],
)
def test_a_quiet_command_that_fails_states_the_reason_in_one_line(command, script, folder, arguments, reason):
    script(INFEASIBLE)
    run = command(*arguments, "--quiet")
    assert run.status == 1
    assert run.out == ""
    assert run.err.count("\n") == 1
    assert reason in run.err
