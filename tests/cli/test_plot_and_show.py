"""plot and show accept files of every kind, and push stores its result."""

import json
import re
from dataclasses import replace

import numpy as np
import pytest

from gaitopt import WalkProblem, basin, load_basin, rimless_wheel, trace
from gaitopt.continuation import save_diagram
from gaitopt.study import RobustnessMargins, RobustnessRecord, load_result, load_robustness, save_robustness


@pytest.fixture
def record(folder):
    margins = (RobustnessMargins("push", 0.1, 0.2, "rad/s"),)
    record = RobustnessRecord(law="lqr", radius=0.4, steps=50, margins=margins, recoveries={"lqr": None})
    save_robustness(record, folder / "push.json")
    return record


def test_files_of_each_kind_are_drawn_and_printed(command, folder, root, record):
    basin(rimless_wheel(), {"slope": 0.23}, {"theta_rate": [0.1, 2.0]}, path=folder / "basin.nc")
    for path, words in [
        (folder / "basin.nc", "50.00 % fell"),
        (folder / "push.json", "push 0.1 0.2 rad/s"),
        (root / "docs/examples/compass_slope.nc", "special points"),
    ]:
        done = command("plot", path, "-o", folder / "figure.png", "--width", 3.5, "--json")
        assert (done.status, done.json) == (0, {"file": str(folder / "figure.png")})
        assert words in " ".join(command("show", path).out.split())
        assert command("show", path, "--json").json["file"] == str(path)
    done = command(
        "plot", root / "docs/examples/compass_slope.nc", "--quantity", "th2_rate", "-o", folder / "branch.svg"
    )
    assert done.status == 0


@pytest.mark.slow
def test_the_page_of_a_saved_diagram_is_written(command, folder, root):
    wheel = WalkProblem(robot=rimless_wheel(), parameters={"slope": 0.2269, "spokes": 8})
    save_diagram(trace(wheel, {"friction": (1.0, 0.99)}), folder / "wheel.nc")
    done = command("plot", folder / "wheel.nc", "-o", "wheel.html", "--json")
    assert (done.status, done.json) == (0, {"file": "wheel.html"})
    page = (folder / "wheel.html").read_text(encoding="utf-8")
    assert 'class="film"' in page
    assert "not found again" not in page
    script = root / "problems/rimless_wheel.py"  # with another number of spokes, which the diagram replaces
    assert command("plot", folder / "wheel.nc", "-o", "other.html", "--problem", script).status == 0
    assert (folder / "other.html").read_text(encoding="utf-8") == page
    slope = root / "docs/examples/compass_slope.nc"
    for arguments, message in [
        ((slope, "-o", "x.html", "--problem", script), "The gaits in .*compass_slope.nc are not the gaits of"),
        ((slope, "-o", "x.png", "--problem", script), "--problem is accepted for the page of a diagram"),
        ((root / "docs/examples/compass_slip.h5", "-o", "x.html"), "A page .* is written for a diagram of periodic"),
    ]:
        done = command("plot", *arguments)
        assert done.status == 2
        assert re.search(message, " ".join(done.err.split()))


def test_slopes_survived_are_printed_in_degrees_and_stored_in_rad(command, folder, record):
    margins = (RobustnessMargins("uphill slope", np.radians(2), None, "rad"),)
    save_robustness(replace(record, margins=margins), folder / "slope.json")
    assert "uphill slope 2 - deg" in " ".join(command("show", "slope.json").out.split())
    (margin,) = command("show", "slope.json", "--json").json["survived"]
    assert (margin["survived"], margin["unit"]) == (pytest.approx(np.radians(2)), "rad")


def test_long_labels_of_push_tests_lose_the_words_that_all_share(command, folder, record, monkeypatch):
    names = ["compass_slip_push_lqr_torque_limit_8.json", "compass_slip_push_step_lqr_torque_limit_8.json"]
    for name in names:
        save_robustness(record, folder / name)
    drawn = []
    monkeypatch.setattr("gaitopt.plot.saving.save_figure", lambda figure, path: drawn.append(figure) or path)
    assert command("plot", *names).status == 0
    labels = [text.get_text() for text in drawn[0].legends[0].get_texts()]
    assert labels == ["lqr", "step_lqr", "smallest not survived"]


def test_push_tests_of_two_laws_share_a_figure(command, folder, root, record, monkeypatch):
    save_robustness(replace(record, law="pd", recoveries={}), folder / "second.json")
    drawn = []
    monkeypatch.setattr("gaitopt.plot.saving.save_figure", lambda figure, path: drawn.append(figure) or path)
    assert command("plot", "push.json", "second.json", "--json").json == {"file": "comparison.png"}
    labels = [text.get_text() for legend in drawn[0].legends for text in legend.get_texts()]
    assert labels == ["push (lqr)", "second (pd)", "smallest not survived"]
    assert drawn[0].legends[0].get_title().get_text() == "largest disturbance survived"
    gait = root / "docs/examples/compass_slip.h5"
    for arguments, message in [
        (("push.json", gait), f"{gait} contains another result: plot each of the 2 files .*'gaitopt compare'"),
        (("push.json", "push.json"), "files must be different"),
        (("push.json", "second.json", "-o", "x.html"), "shows a single diagram, got 2 files"),
        (("push.json", "second.json", "--quantity", "speed"), "only sweeps and diagrams of periodic gaits"),
    ]:
        done = command("plot", *arguments)
        assert done.status == 2
        assert re.search(message, " ".join(done.err.split()))


def test_stored_results_are_the_same(folder, record):
    assert load_robustness(folder / "push.json") == load_result(folder / "push.json") == record
    unknown = save_robustness(replace(record, radius=float("nan")), folder / "unknown.json")
    assert np.isnan(load_robustness(unknown).radius)
    table = basin(rimless_wheel(), {"slope": 0.23}, {"theta_rate": [0.1, 2.0]}, path=folder / "basin.nc")
    assert load_result(folder / "basin.nc").identical(load_basin(folder / "basin.nc"))
    assert table.identical(load_basin(folder / "basin.nc"))


STUDY = """
from gaitopt import load
from gaitopt.stability import assess_stability

def study(share: float = 0.5):
    gait = load({gait!r})
    return {{"slipping gait": gait, "cycle": assess_stability(gait), "share": share}}
"""


@pytest.mark.slow
def test_a_study_script_returns_any_results(command, folder, slip_file):
    (folder / "study.py").write_text(STUDY.format(gait=str(slip_file)))
    done = command("run", "study.py", "--set", "share=0.25")
    assert done.status == 0
    assert {path.name for path in folder.glob("*.png")} == {"study_slipping_gait.png", "study_cycle.png"}
    assert "cost of transport" in done.out
    assert "share: 0.25" in done.out
    results = command("run", "study.py", "--json").json["results"]
    assert results["slipping gait"]["result"]["status"] == "solved"
    assert results["share"] == {"value": 0.5}
    (folder / "study.py").write_text("def study():\n    return 'walks'\n")
    done = command("run", "study.py")
    assert done.status == 2
    assert "must return a Reproduction, a figure, a result of gaitopt" in done.err
    figures = "def study():\n    return {'a walk': Figure(), 'a_walk': Figure()}\n"
    (folder / "study.py").write_text(f"from matplotlib.figure import Figure\n\n\n{figures}")
    errors = command("run", "study.py").err  # of two figures, one would be lost
    assert "must still differ if each character other than a letter, a digit, " in errors


def test_files_that_are_no_results_are_named(command, folder):
    (folder / "other.json").write_text(json.dumps({"format": "poem"}))
    (folder / "empty").mkdir()
    for name, message in [
        ("other.json", "is not a JSON file of 'gaitopt tuned gains', 'gaitopt push test'"),
        ("empty", "contains no ranking.json"),
        ("nowhere.nc", "There is no file"),
    ]:
        for verb in ("plot", "show"):
            done = command(verb, folder / name)
            assert done.status == 2
            assert message in done.err
