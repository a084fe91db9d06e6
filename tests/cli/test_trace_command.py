"""gaitopt trace: what is printed, written and refused."""

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rich.console import Console

from gaitopt import load_diagram
from gaitopt.cli.output import out
from gaitopt.cli.progress_display import Display
from gaitopt.cli.trace_output import TraceProgress, print_diagram
from gaitopt.continuation import SpecialKind
from gaitopt.continuation.following import FollowingWork
from gaitopt.continuation.gait_source import make_gait_source
from gaitopt.continuation.tracing import make_diagram
from gaitopt.study.storage.study_lock import lock_study
from tests.docs.checked_commands import read_command

PASSIVE, WHEEL = "problems/compass_passive.py", "problems/rimless_wheel.py"
GOSWAMI = [
    f"--set={name}={value}"
    for name, value in {"leg_mass": 5, "hip_mass": 10, "leg_length": 1, "leg_com": 0.5, "gravity": 9.81}.items()
]


@pytest.mark.slow
def test_the_range_is_printed_with_its_unit(command, root, folder):
    result = command("trace", root / PASSIVE, *GOSWAMI, "--over", "slope=4:4.1", "-o", "slope.nc")
    assert result.err.splitlines()[0] == "slope from 4 to 4.1 deg"
    result = command("trace", root / PASSIVE, *GOSWAMI, "--over", "hip_mass=10:10.5", "-o", "mass.nc")
    assert result.err.splitlines()[-1] == "hip_mass from 10 to 10.5 kg"


def test_a_range_has_the_unit_of_the_script(command, root, folder):
    result = command("trace", root / PASSIVE, *GOSWAMI, "--over", "slope=4:4.6", "--json", "-o", "slope.nc")
    assert result.status == 0, result.err
    (branch,) = result.json["branches"]
    assert (result.json["parameter"], result.json["unit"]) == ("slope", "rad")
    assert (branch["kind"], branch["period"], branch["sequence"], branch["end"]) == (
        "periodic",
        1,
        "stick | stick",
        "range_end",
    )
    (doubling,) = branch["special"]
    assert doubling["kind"] == "period_doubling"
    assert math.degrees(doubling["value"]) == pytest.approx(4.390898, abs=5e-7)  # Goswami's compass
    assert set(doubling) >= {"kind", "value", "width", "state", "before", "after"}
    assert set(branch["points"][0]) >= {"value", "state", "multipliers", "stable"}
    for point in branch["points"]:
        assert point["radius"] == pytest.approx(max(math.hypot(*pair) for pair in point["multipliers"]))
        assert point["stable"] is (point["radius"] < 1)
    assert branch["points"][0]["stable"] is True
    assert branch["points"][-1]["stable"] is False
    assert result.json["ratios"] == []
    assert load_diagram(folder / "slope.nc").records()["branches"] == result.json["branches"]


@pytest.mark.slow
def test_a_table_lists_branches_and_special_points(command, root):
    result = command("trace", root / WHEEL, "--over", "friction=1:0.25", "--quiet", "-o", "wheel.png")
    assert (result.status, result.out) == (0, "")
    assert Path("wheel.png").stat().st_size > 10_000
    shown = command("trace", root / WHEEL, "--over", "friction=1:0.9").out
    assert "slip onset" in shown
    assert "0.914120784" in shown
    assert "stick slip+ | stick" in shown


def test_a_table_over_an_angle_states_degrees_too(root):
    path = root / "docs/examples/compass_slope.nc"
    (doubling,) = load_diagram(path).branches[0].special_of("period_doubling")
    with out.console.capture() as capture:
        print_diagram(load_diagram(path))
    table = capture.get()
    assert "slope [rad]" in table
    assert "slope [deg]" in table
    assert f"{doubling.value:.9f}   {math.degrees(doubling.value):.7f}" in table
    branches = table.partition("special points")[0]
    first, last = load_diagram(path).branches[0].values[[0, -1]]
    assert "slope [deg]" in branches
    assert f"{first:.6g} to {last:.6g}" in branches
    assert f"{math.degrees(first):.6g} to {math.degrees(last):.6g}" in branches


@pytest.mark.parametrize("width", [60, 80])
def test_nothing_of_the_tables_is_cut_in_a_narrow_terminal(root, width, monkeypatch):
    diagram = load_diagram(root / "docs/examples/compass_slope.nc")
    change = replace(diagram.branches[0].special[0], before="slip+ stick slip- | slip+", after="slip+ stick | slip+")
    branches = (replace(diagram.branches[0], special=(change,)), *diagram.branches[1:])
    monkeypatch.setattr(out, "console", Console(width=width, markup=False))
    with out.console.capture() as capture:
        print_diagram(replace(diagram, branches=branches))
    table = capture.get()
    assert "\N{HORIZONTAL ELLIPSIS}" not in table
    assert max(map(len, table.splitlines())) <= width
    for word in (
        "begins",
        "ends",
        "range",
        "doubling",
        "stability",
        "sequence",
        "then",
        "slip-",
        f"{change.value:.9f}",
    ):
        assert word in table.split()
    assert ("[deg]" in table) is (width == 80)


def test_a_branch_of_doubled_period_begins_at_the_doubling_of_another_one(root):
    with out.console.capture() as capture:
        print_diagram(load_diagram(root / "docs/examples/compass_slope.nc"))
    words = " ".join(capture.get().partition("special points")[0].split())
    assert "range end" in words
    assert "period doubling of branch 0" in words
    assert "start" not in words


def test_progress_states_the_parameter_as_typed_and_the_work():
    display = Display("tracing")
    progress = TraceProgress(display, "slope", "deg", math.degrees(1))
    progress.show_branch(1, 12)
    progress.show_work(FollowingWork("", math.radians(2), 0.25))
    assert display.line == "branch 1, 12 gaits, slope = 2 deg, arclength 0.25"
    progress.show_work(FollowingWork("locating a fold", math.radians(2), 0.25))
    assert display.line == "branch 1, 12 gaits, slope = 2 deg, arclength 0.25: locating a fold"


def test_the_range_of_a_saved_gait_is_printed_with_its_unit_and_an_unstable_start_is_stated(command, root, monkeypatch):
    monkeypatch.setattr("gaitopt.cli.trace_command._trace", lambda problem, axis, *_: make_diagram(problem, axis, []))
    gait, weak = root / "docs/examples/heel_toe.h5", ("--law", "joint_pd", "--gain", "motor_damping=0")
    result = command("trace", gait, "--over", "slope=0.03:0.04", *weak)
    assert result.err.splitlines()[0] == "slope from 0.03 to 0.04 rad"
    (assessed,) = command("stability", gait, *weak, "--json").json["gaits"]
    stated = f"The saved gait is unstable (spectral radius {assessed['radius']:.4g})."
    assert (stated in result.err) is (assessed["radius"] >= 1)
    assert assessed["radius"] >= 1


def test_a_trace_without_period_doubling_states_that_doublings_have_no_effect(command, root):
    options = ("trace", root / WHEEL, "--over", "friction=1:0.95")
    text = "The branches have no period doubling, so --doublings has no effect."
    assert text in command(*options, "--doublings", "1").out
    assert text not in command(*options).out


def test_the_table_of_special_points_states_a_loss_of_stability_at_a_kink(root):
    diagram = load_diagram(root / "docs/examples/compass_slope.nc")
    branch = diagram.branches[0]
    (doubling,) = branch.special
    assert branch.stability_change(doubling) == "lost"
    sides = {"multipliers_before": np.array([0.5 + 0.1j, 0]), "multipliers_after": np.array([-3.2, 0])}
    kink = replace(doubling, kind=SpecialKind.IMPACT_CONE, **sides)
    back = replace(kink, multipliers_before=sides["multipliers_after"], multipliers_after=sides["multipliers_before"])
    end = replace(kink, multipliers_after=np.array([]))
    same = replace(kink, multipliers_after=np.array([0.9]))
    assert [branch.stability_change(point) for point in (kink, back, end, same)] == ["lost", "gained", "", ""]
    with out.console.capture() as capture:
        print_diagram(replace(diagram, branches=(replace(branch, special=(kink,)),)))
    (row,) = [line for line in capture.get().splitlines() if "impact cone" in line]
    assert "lost" in row


@pytest.mark.parametrize(("test", "label"), [(0.0, "limit of rolling over"), (math.nan, "fall")])
def test_a_fall_is_the_limit_of_rolling_over_only_if_its_energy_is_zero(root, test, label):
    diagram = load_diagram(root / "docs/examples/compass_slope.nc")
    branch = diagram.branches[0]
    end = replace(branch.special[0], kind=SpecialKind.ROLL_OVER, after="fell", test=test)
    with out.console.capture() as capture:
        print_diagram(replace(diagram, branches=(replace(branch, special=(end,), end="roll_over"),)))
    branches, _, special = capture.get().partition("special points")
    assert label in branches
    assert label in special


@pytest.mark.slow
def test_a_saved_gait_is_traced_under_its_torques(command, slip_file):
    result = command("trace", slip_file, "--over", "friction=0.139:0.141", "--json")
    assert result.status == 0, result.err
    (branch,) = result.json["branches"]
    values = [point["value"] for point in branch["points"]]
    assert (min(values), max(values)) == (pytest.approx(0.139), pytest.approx(0.141))
    at_start = next(point for point in branch["points"] if point["value"] == pytest.approx(0.14, abs=1e-12))
    assert at_start["sequence"] == "slip+ stick | slip+"
    stability = command("stability", slip_file, "--json").json["gaits"][0]
    moduli = [math.hypot(*pair) for pair in at_start["multipliers"]]
    assert moduli == pytest.approx([math.hypot(*pair) for pair in stability["multipliers"]], abs=1e-8)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--over", "fricton=1:0.5"], "Did you mean 'friction'"),
        (["--over", "friction=1"], "NAME=FROM:TO"),
        (["--over", "friction=1:1"], "two different finite ends"),
        (["--over", "friction=1:0.5:10"], "NAME=FROM:TO"),
        (["--over", "friction=1:-1"], "The range 1 to -1 of friction is invalid: friction must be at least 0, got -1."),
        (["--over", "friction=1:0.5", "-o", "x.txt"], "'.txt' is not that of a known format"),
        (["--over", "friction=1:0.5", "-o", "none/x.nc"], "does not exist"),
        (["--over", "friction=1:0.5", "--law", "lqr"], "--law is accepted for a saved gait only"),
    ],
)
def test_invalid_requests_are_named(command, root, arguments, message):
    result = command("trace", root / WHEEL, *arguments)
    assert result.status == 2
    assert message in " ".join(result.err.split())


@pytest.mark.parametrize(
    ("source", "ranges"),
    [
        (WHEEL, ["--over", "fricton=1:0.5"]),
        ("docs/examples/heel_toe.h5", ["--over", "fricton=1:0.5"]),
        (WHEEL, ["--over", "friction=1:0.99", "--second", "slop=0.1:0.2"]),
        ("docs/examples/heel_toe.h5", ["--over", "friction=0.4:-1"]),
        (WHEEL, ["--over", "friction=1:-1"]),
        (WHEEL, ["--over", "friction=1:0.99", "--second", "mass=1:-2"]),
    ],
)
def test_nothing_is_printed_before_the_error_of_a_parameter_or_its_range(command, root, source, ranges):
    result = command("trace", root / source, *ranges)
    assert result.status == 2
    assert result.out == ""
    assert result.err.startswith("Error: ")


def test_a_parameter_of_the_script_that_is_not_one_of_the_robot_is_named(command, script):
    text = """
from gaitopt.model import vertical_hopper
from gaitopt.stability import PlanarWalkProblem

def problem(height=0.2):
    start = {"coordinates": {"body": 0.5 + height, "foot": height}, "rates": {"body": 0, "foot": 0}, "on": ()}
    return PlanarWalkProblem(robot=vertical_hopper(), section="sole closes", **start)
"""
    run = command("trace", script(text), "--over", "height=0.1:0.2")
    assert run.status == 2
    assert "'height' is a parameter of own.py only, not of the robot" in run.err
    assert "gain of the law: body_mass, foot_mass, stiffness, thrust" in run.err


def test_a_range_without_a_gait_at_its_begin_ends_with_status_1(command, root):
    result = command("trace", root / WHEEL, "--over", "slope=0.2:1", "--set", "friction=inf")
    assert result.status == 1
    assert "was found at slope = 0.00349066 rad" in " ".join(result.err.split())


def test_a_trace_that_begins_with_an_unstable_gait_states_this(command, root):
    """The period doubling of the compass of Goswami et al. is at a slope of 4.39 deg."""
    options = root / PASSIVE, *GOSWAMI, "--set", "friction=inf", "--starts", "3"
    message = "The trace begins with an unstable gait"
    unstable, stable = (command("trace", *options, "--over", f"slope={begin}:{begin + 0.002}") for begin in (4.6, 4.2))
    assert (unstable.status, stable.status) == (0, 0)
    assert message in unstable.err
    assert message not in stable.err


def test_a_range_that_excludes_the_saved_gait_is_named(command, slip_file):
    result = command("trace", slip_file, "--over", "friction=0.2:0.3", "--json")
    assert result.status == 2
    assert "must contain the start, at 0.14" in result.json["error"]


def test_an_interrupt_keeps_the_branches_followed(command, root, folder, monkeypatch):
    from gaitopt.continuation import tracing

    follow = tracing.trace_branches

    def interrupted(*arguments, **options):
        yield next(follow(*arguments, **options))
        raise KeyboardInterrupt

    monkeypatch.setattr(tracing, "trace_branches", interrupted)
    result = command("trace", root / WHEEL, "--over", "friction=1:0.9", "--json", "-o", "part.nc")
    assert result.status == 130
    assert result.json["complete"] is False
    assert len(result.json["branches"]) == 1
    diagram = load_diagram(folder / "part.nc")
    assert not diagram.complete
    assert json.loads(json.dumps(diagram.records()))["branches"] == result.json["branches"]


def test_an_unexpected_error_keeps_the_branches_followed(command, root, folder, monkeypatch):
    from gaitopt.continuation import tracing

    follow = tracing.trace_branches

    def fail(*arguments, **options):
        yield next(follow(*arguments, **options))
        raise np.linalg.LinAlgError("Eigenvalues did not converge")

    monkeypatch.setattr(tracing, "trace_branches", fail)
    result = command("trace", root / WHEEL, "--over", "friction=1:0.9", "--json", "-o", "part.nc")
    assert result.status == 1
    assert result.json["complete"] is False
    assert len(result.json["branches"]) == 1
    assert "LinAlgError: Eigenvalues did not converge" in result.json["error"]
    assert not load_diagram(folder / "part.nc").complete
    message = " ".join(result.err.split())
    assert "Error: The trace ended on branch 1, near friction = 0.9" in message
    assert "LinAlgError: Eigenvalues did not converge (test_trace_command.py, line" in message
    assert "are kept in part.nc.checkpoint. Run the same command again to resume." in message
    assert "If the error recurs, trace a range that ends before friction = 0.9" in message
    assert "Interrupted" not in message


@pytest.mark.slow
def test_an_interrupted_trace_is_continued_by_the_same_command(command, root, folder, monkeypatch):
    from gaitopt.continuation import tracing

    arguments = ("trace", root / WHEEL, "--over", "friction=1:0.9", "--json", "-o")
    follow = tracing.trace_branches

    def interrupted(problem, over, *, observer, **options):
        def stop(branch):
            observer(branch)
            if branch.values.size == 5:
                raise KeyboardInterrupt

        yield from follow(problem, over, observer=stop, **options)

    monkeypatch.setattr(tracing, "trace_branches", interrupted)
    part = command(*arguments, "wheel.nc")
    assert part.status == 130
    assert len(part.json["branches"][0]["points"]) == 5
    checkpoint = folder / "wheel.nc.checkpoint"
    corrections = len(checkpoint.read_text().splitlines()) - 1
    assert corrections >= 5
    assert f"{corrections} corrector steps are kept in wheel.nc.checkpoint. Run the same command" in part.err
    monkeypatch.setattr(tracing, "trace_branches", follow)
    other = command(*arguments[:3], "friction=1:0.8", *arguments[4:], "wheel.nc")
    assert other.status == 2
    assert "belongs to another trace" in other.json["error"]
    rest, whole = command(*arguments, "wheel.nc"), command(*arguments, "whole.nc")
    assert rest.status == whole.status == 0
    assert rest.json["branches"] == whole.json["branches"]
    assert load_diagram(folder / "wheel.nc").records() == load_diagram(folder / "whole.nc").records()
    assert not checkpoint.exists()


@pytest.mark.slow
def test_a_robot_with_several_contacts_is_traced(command, root):
    arguments = ("trace", root / "problems/hopper.py", "--over", "thrust=0.02:0.0205", "--starts", "1")
    result = command(*arguments, "--json")
    assert result.status == 0, result.err
    (branch,) = result.json["branches"]
    assert branch["units"] == {"body_rate": "m/s"}
    assert branch["points"][0]["multipliers"][0][0] == pytest.approx(0.78107619584119, abs=1e-9)  # closed form
    pytest.importorskip("heyoka")
    fast = command(*arguments, "--engine", "heyoka", "--json")
    (other,) = fast.json["branches"]
    assert other["points"][0]["multipliers"][0] == pytest.approx(branch["points"][0]["multipliers"][0], abs=1e-8)


@pytest.mark.slow
def test_the_trace_of_a_saved_gait_of_several_contacts_begins_with_its_gait_under_the_law(command, root, monkeypatch):
    begun = []

    def begin(problem, axis, start, options, display):
        begun.append(make_gait_source(problem, axis, options.engine).start(start))
        return make_diagram(problem, axis, [])

    monkeypatch.setattr("gaitopt.cli.trace_command._trace", begin)
    gait, law = root / "docs/examples/heel_toe.h5", ("--law", "joint_pd", "--gain", "motor_damping=60")
    (assessed,) = command("stability", gait, *law, "--json").json["gaits"]
    for axis, value in (("slope=0.03:0.04", 0.03), ("motor_damping=50:70", 60)):
        assert command("trace", gait, "--over", axis, *law, "--json").status == 0
        family, z, start = begun.pop()
        assert start == value
        assert family.cycle(z, start).radius == pytest.approx(assessed["radius"], rel=1e-6)


def test_a_script_with_an_optimal_gait_of_several_contacts_is_referred_to_the_saved_gait(command, root):
    refused = command("trace", root / "problems/flat_foot.py", "--over", "friction=0.8:0.7")
    assert refused.status == 2
    assert "'gaitopt trace GAIT.h5' follows the saved gait over a parameter; the guide" in refused.err


@pytest.mark.slow
def test_the_simplest_walker_doubles_its_period_in_the_limit_of_light_legs(command, root, folder):
    # 0.0150884379 rad for feet without mass, from a computation without legs' inertia; Garcia et al. (1998): 0.015.
    (folder / "problems").symlink_to(root / "problems")
    result = command(*read_command("gaitopt trace problems/simplest_walker.py"))
    assert result.status == 0, result.err
    (curve,) = result.json["curves"]
    assert (curve["kind"], curve["parameters"]) == ("period_doubling", ["slope", "leg_mass"])
    slope, mass = zip(*curve["values"], strict=True)
    assert np.polyfit(mass, slope, 2)[-1] == pytest.approx(0.0150884379, abs=1e-10)


@pytest.mark.parametrize("script", [WHEEL, "problems/compass_slip.py"])
def test_a_trace_to_a_file_that_another_process_computes_is_refused(command, root, folder, script):
    with lock_study(folder / "branch.nc"):
        result = command("trace", root / script, "--over", "friction=1:0.9", "-o", "branch.nc")
        assert (result.status, result.out) == (2, "")
        assert "branch.nc: its results are being computed by process" in " ".join(result.err.split())
        assert sorted(path.name for path in folder.iterdir()) == ["branch.nc.lock"]
