"""The iterate of an interrupted solve is stored, and the stated command continues from it."""

import re
import shlex

import pytest

from gaitopt import load
from gaitopt.cli import solving
from gaitopt.cli.failed_solve import SolveCommand
from gaitopt.status import Status

PROBLEM = ("--set", "intervals=8", "--set", "objective=torque_squared")


@pytest.fixture
def interrupted_solve(command, monkeypatch):
    """Return a function that solves a problem and is interrupted at an iteration."""

    def run(*words, iteration=3):
        observe_uninterrupted = solving._observer

        def observer(*arguments):
            observe, count = observe_uninterrupted(*arguments), []

            def stop(step):
                observe(step)
                count.append(step)
                if len(count) > iteration:
                    raise KeyboardInterrupt

            return stop

        with monkeypatch.context() as patch:
            patch.setattr(solving, "_observer", observer)
            return command("solve", *words)

    return run


def test_the_iterate_is_stored_and_continued_from(command, interrupted_solve, root, folder):
    source = root / "problems/compass_stick.py"
    run = interrupted_solve(source, *PROBLEM)
    assert run.status == 130
    assert [path.name for path in folder.iterdir()] == ["compass_stick_interrupted.h5"]
    stated = shlex.join(["gaitopt", "solve", str(source), *PROBLEM, "--guess", "compass_stick_interrupted.h5"])
    text = "Interrupted; wrote compass_stick_interrupted.h5 with the last iterate, which is not a solution."
    advice = "A new solve is usually the better choice; to start from the iterate:"
    assert run.out.endswith(f"{text} {advice} {stated}\n")
    assert load("compass_stick_interrupted.h5").status.key == "interrupted"
    assert command("show", "compass_stick_interrupted.h5", "--json").json["status"] == "interrupted"
    again = command(*shlex.split(stated)[1:])
    assert again.status == 0, again.err
    assert load("compass_stick.h5").verification.passed


def test_the_file_is_named_in_json_and_by_quiet_commands(interrupted_solve, root, folder):
    source = root / "problems/compass_stick.py"
    run = interrupted_solve(source, *PROBLEM, "--json", "-o", "walk.h5")
    assert (run.status, run.json["file"], run.json["failure_file"]) == (130, None, "walk_interrupted.h5")
    quiet = interrupted_solve(source, *PROBLEM, "--quiet")
    assert (quiet.status, quiet.out) == (130, "")
    assert "compass_stick_interrupted.h5" in quiet.err


def test_a_repeated_interrupt_does_not_replace_the_iterate_it_started_from(interrupted_solve, root, folder):
    source = root / "problems/compass_stick.py"
    interrupted_solve(source, *PROBLEM)
    before = (folder / "compass_stick_interrupted.h5").read_bytes()
    run = interrupted_solve(source, *PROBLEM, "--guess", "compass_stick_interrupted.h5", iteration=1)
    assert run.status == 130
    assert "--guess compass_stick_interrupted_2.h5" in run.out
    assert (folder / "compass_stick_interrupted.h5").read_bytes() == before


def test_the_repeated_solve_of_a_failure_stores_its_iterate_in_another_file(folder):
    command = SolveCommand(source=folder / "walk_failed.h5")
    assert command.result.name == "walk_failed_solved.h5"
    assert command.failure(Status.INTERRUPTED).name == "walk_failed_interrupted.h5"


def test_a_failed_solve_from_a_guess_names_the_solve_without_it(command, root, folder):
    source, example = root / "problems/compass_stick.py", root / "docs/examples/compass_slip.h5"
    run = command("solve", source, "--set", "slope=20", "--guess", example)
    assert run.status == 1
    assert f"The solve started from {example}; without --guess it starts from the guess of the problem." in run.err
    assert "without --guess" not in command("solve", source, "--set", "slope=20").err


def test_the_solution_before_a_refinement_is_named(command, interrupted_solve, root, folder):
    run = interrupted_solve(root / "problems/monopod.py", iteration=35)
    assert run.status == 130
    assert "with the solution on the last grid, which is not refined. To continue from it: gaitopt solve" in run.out


def test_the_best_feasible_iterate_is_named(command, interrupted_solve, root, folder):
    run = interrupted_solve(root / "problems/compass_stick.py", *PROBLEM, iteration=15)
    assert run.status == 130
    message = re.search(r"User_Requested_Stop; the result is (iterate \d+, the best feasible one)", run.out)
    text = "Interrupted; wrote compass_stick_interrupted.h5 with"
    assert f"{text} {message.group(1)}. To continue from it: gaitopt solve" in run.out
