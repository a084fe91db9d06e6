"""Progress: live on a terminal, lines at growing intervals without one, silent with --quiet; counts are honest."""

import io
import os
import re
import subprocess
import sys
import time

import pytest
from rich.console import Console

from gaitopt.cli import feedback, progress_display
from gaitopt.cli.output import TERMINAL_VARIABLES
from gaitopt.progress import TuningStep, VerificationStep

GAIT = "docs/examples/compass_slip.h5"


@pytest.fixture
def error_stream(monkeypatch):
    """Return a function that replaces standard error by a stream, a terminal or not."""

    def replace(terminal):
        stream = io.StringIO()
        console = Console(file=stream, force_terminal=terminal, width=100, markup=False)
        monkeypatch.setattr(progress_display.err, "console", console)
        return stream

    return replace


def test_without_a_terminal_there_is_a_line_now_and_then(error_stream, monkeypatch):
    stream = error_stream(terminal=False)
    monkeypatch.setattr(progress_display, "PERIOD", 0.3)
    with progress_display.show_progress("basin [s]", hidden=False, counted="starts") as display:
        for done in range(1, 41):
            display.count(done, 40)
            time.sleep(0.02)
    lines = stream.getvalue().splitlines()
    assert 1 <= len(lines) <= 4  # not one for each of the 40 counts
    assert lines[0].startswith("basin [s] ")
    assert "/40 starts (" in lines[0]


def test_the_longest_time_between_lines_can_be_shorter(error_stream, monkeypatch):
    stream = error_stream(terminal=False)
    monkeypatch.setattr(progress_display, "FIRST", 0.05)
    with progress_display.show_progress("tracing", hidden=False, longest=0.05):
        time.sleep(0.6)
    assert len(stream.getvalue().splitlines()) >= 5  # two of them with the intervals doubled up to 30 s


def test_the_period_is_half_a_minute(error_stream):
    stream = error_stream(terminal=False)
    assert (progress_display.FIRST, progress_display.PERIOD) == (3, 30)
    with progress_display.show_progress("quick", hidden=False):
        pass
    assert stream.getvalue() == ""


def test_the_first_line_is_earlier_than_the_period(error_stream, monkeypatch):
    stream = error_stream(terminal=False)
    monkeypatch.setattr(progress_display, "FIRST", 0.05)
    with progress_display.show_progress("sweep of 9 points", hidden=False, counted="optimisations") as display:
        display.count(6, 1000)
        time.sleep(0.3)
    assert re.fullmatch(r"sweep of 9 points 6/1000 optimisations \(0 s\)", stream.getvalue().splitlines()[0])


def test_the_intervals_between_lines_grow(error_stream, monkeypatch):
    stream = error_stream(terminal=False)
    monkeypatch.setattr(progress_display, "FIRST", 0.1)
    with progress_display.show_progress("drawing frames", hidden=False):
        time.sleep(1.6)  # lines at 0.1, 0.3, 0.7 and 1.5 s
    assert 3 <= len(stream.getvalue().splitlines()) <= 4


@pytest.mark.parametrize("terminal", [True, False])
def test_the_tasks_under_way_are_shown_with_the_time(error_stream, monkeypatch, terminal):
    stream = error_stream(terminal)
    monkeypatch.setattr(progress_display, "FIRST", 0.1)
    with progress_display.show_progress("sweep of 9 points", hidden=False, counted="optimisations") as display:
        display.show_active(("friction 0.1", "friction 0.2 (replay)"))
        display.count(1, 9)
        time.sleep(0.4)
    text = stream.getvalue()
    assert "under way: friction 0.1; friction 0.2 (replay)" in text
    assert (
        ("0:00:00" in text)
        if terminal
        else text.startswith("sweep of 9 points 1/9 optimisations (0 s), under way: friction 0.1; ")
    )
    display.show_active(())
    assert display.active == ""


def test_a_sweep_names_the_points_that_are_computed(command, root, monkeypatch):
    seen = []
    monkeypatch.setattr(progress_display.Display, "show_active", lambda display, names: seen.extend(names))
    coarse = ("--set", "objective=torque_squared", "--set", "intervals=10", "--set", "torque_limit=10")
    words = ("--over", "friction=0.2,0.3", "--starts", "1", "--workers", "1", "-o", "out.nc")
    assert command("sweep", root / "problems/compass_stick.py", *coarse, *words).status == 0
    assert {"friction 0.2", "friction 0.3", "friction 0.2 (replay)", "friction 0.3 (replay)"} == set(seen)


@pytest.mark.parametrize(("hidden", "quiet"), [(True, False), (False, True)])
@pytest.mark.parametrize("terminal", [True, False])
def test_hidden_progress_is_silent(error_stream, monkeypatch, hidden, quiet, terminal):
    stream = error_stream(terminal)
    monkeypatch.setattr(progress_display, "PERIOD", 0.01)
    monkeypatch.setattr(progress_display.out, "quiet", quiet)
    with progress_display.show_progress("starts", hidden=hidden) as display:
        display.count(1, 2)
        time.sleep(0.1)
    assert stream.getvalue() == ""


def test_a_terminal_shows_no_count_before_the_total_is_known(error_stream):
    stream = error_stream(terminal=True)
    with progress_display.show_progress("push test", hidden=False, counted="kinds") as display:
        time.sleep(0.3)
        assert "push test" in stream.getvalue()
        assert "0/1" not in stream.getvalue()
        display.count(2, 6)
        time.sleep(0.3)
    assert "2/6 kinds" in stream.getvalue()


def test_tuning_shows_its_verification():
    assert feedback._progress(TuningStep(3, 0.5, 0.25)) == "evaluation   3   lowest 0.2500"
    assert feedback._progress(TuningStep(3, 0.5, 0.25, 129)) == "evaluation   3 of at most 129   lowest 0.2500"
    text = feedback._progress(VerificationStep(0.125, 30, 200))
    assert text == "verifying: pushes up to 0.125 rad/s, 30 of 200 walks"


@pytest.mark.slow
def test_each_walk_of_a_verification_is_reported(command, root, monkeypatch):
    seen = []
    monkeypatch.setattr(feedback, "_progress", lambda step: seen.append(step) or "")
    run = command("tune", root / GAIT, "--law", "computed_torque", "--torque-limit", "8", "--starts", "2", "--json")
    assert run.status == 0
    kinds = [type(step) for step in seen]
    assert kinds == sorted(kinds, key=lambda kind: kind is VerificationStep)  # first the search, then the verification
    walks = [step for step in seen if isinstance(step, VerificationStep)]
    assert {step.starts for step in walks} == {2}
    assert {step.walks for step in walks} == {1, 2}


@pytest.mark.parametrize(("variable", "imported"), [(None, False), ("FORCE_COLOR", True)])
def test_without_a_terminal_rich_is_not_imported_for_the_display(variable, imported):
    script = (
        "import sys\nfrom gaitopt.cli.progress_display import show_progress\n"
        "with show_progress('starts', hidden=False):\n    imported = 'rich.console' in sys.modules\nprint(imported)"
    )
    environment = {name: value for name, value in os.environ.items() if name not in TERMINAL_VARIABLES}
    environment |= {variable: "1"} if variable else {}
    run = subprocess.run(
        [sys.executable, "-c", script], env=environment, capture_output=True, text=True, timeout=60, check=True
    )
    assert run.stdout == f"{imported}\n"
