"""The observer for notebooks and terminals: one line, kept up to date, for every kind of progress."""

import io
from dataclasses import is_dataclass

import pytest

from gaitopt import Execution, GaitProblem, Limits, MultipleShooting, ProgressLine, compass_biped, solve, sweep
from gaitopt import progress as kinds
from gaitopt.progress import HomotopyIteration, Iteration, TuningStep, VerificationStep


def lines(stream):
    """Return the states that the line had, and whether it was ended."""
    text = stream.getvalue()
    return [state.strip() for state in text.split("\r") if state.strip()], text.endswith("\n")


@pytest.mark.parametrize(
    ("progress", "state"),
    [
        ((3, 7), "3/7"),
        ((Iteration(4, 0.0158, 1e-9),), "iteration 4, objective 0.0158, infeasibility 1.0e-09"),
        ((HomotopyIteration(1, 0.1, 0.016, 2e-3, 25, "solved"),), "relaxation 1e-01, objective 0.016, solved"),
        ((TuningStep(3, 0.71, 0.6412),), "evaluation 3, objective 0.71, best 0.6412"),
        ((VerificationStep(0.125, 3, 200),), "verification, walk 3 of 200 within 0.125 rad/s"),
    ],
)
def test_every_kind_of_progress_is_one_line(progress, state):
    stream = io.StringIO()
    ProgressLine("solve", stream=stream)(*progress)
    assert lines(stream) == ([f"solve: {state}, 0 s"], False)


def test_no_kind_of_progress_is_forgotten():
    named = [test.args[1] for test in test_every_kind_of_progress_is_one_line.pytestmark]
    shown = {type(progress[0]) for progress, _ in named[0]}
    steps = {kind for kind in vars(kinds).values() if isinstance(kind, type) and is_dataclass(kind)}
    assert shown == steps | {int}


def test_the_last_state_is_shown_and_a_shorter_one_leaves_nothing_behind(monkeypatch):
    stream, now = io.StringIO(), [0.0]
    monkeypatch.setattr("gaitopt.progress.time.monotonic", lambda: now[0])
    with ProgressLine(stream=stream) as observer:
        for number in range(1000):
            now[0] = 1 + 0.001 * number
            observer(number, 1000)
        observer(1, 1)
    states, ended = lines(stream)
    assert 4 <= len(states) <= 8
    assert states[-1] == "progress: 1/1, 2 s"
    assert ended
    widths = [len(part.rstrip("\n")) for part in stream.getvalue().split("\r") if part]
    assert widths == sorted(widths)


def sweep_speed(problem, *, observer):
    return sweep(problem, {"speed": [0.633]}, starts=1, execution=Execution(observer=observer))


def test_a_solve_and_a_sweep_accept_it():
    problem = GaitProblem(
        robot=compass_biped(),
        sequence="stick | stick",
        friction=0.2,
        speed=0.633,
        step_length=0.4713,
        limits=Limits(torque=6),
        objective="torque_squared",
        transcription=MultipleShooting(intervals=10),
    )
    for study in (solve, sweep_speed):
        stream = io.StringIO()
        with ProgressLine(stream=stream) as observer:
            study(problem, observer=observer)
        states, ended = lines(stream)
        assert ended
        assert states[-1].startswith(("progress: iteration", "progress: 4/4"))


def test_a_notebook_shows_a_bar(monkeypatch):
    """The display of IPython is replaced by a record of what it is given."""
    display, shown = pytest.importorskip("IPython.display"), []

    class Handle:
        def update(self, content):
            shown.append(content.data)

    def show(content, display_id):
        shown.append(content.data)
        return Handle()

    monkeypatch.setattr(display, "display", show)
    monkeypatch.setattr(kinds, "_in_notebook", lambda: True)
    with ProgressLine("<sweep>") as observer:
        observer(1, 4)
    assert shown[0] == '<div><progress value="0.2500" max="1"></progress> &lt;sweep&gt;: 1/4, 0 s</div>'
    assert len(shown) == 2
