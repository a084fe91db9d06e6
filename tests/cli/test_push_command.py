"""gaitopt push: its kinds of disturbances, and what it keeps after Ctrl-C."""

import dataclasses
import json
import signal

import pytest

from gaitopt import assess_stability
from gaitopt.cli.progress_display import Display
from gaitopt.cli.push_output import _explain_small_push
from gaitopt.progress import VerificationStep
from gaitopt.simulation import default_engine
from gaitopt.study import RobustnessMargins, RobustnessRecord, load_robustness, save_robustness
from gaitopt.study.robustness import disturbed_gait
from gaitopt.study.robustness.margin_log import MarginLog, read_margin_log

QUICK = ("--law", "computed_torque", "--torque-limit", "8", "--steps", "6", "--starts", "1", "--workers", "1")
TUNED = ("--law", "computed_torque", "--samples", "0", "--evaluations", "2", "--starts", "3")
KINDS = ["push", "downhill slope", "uphill slope", "friction patch", "torque noise", "sensor delay"]


@pytest.fixture
def interrupt_after(monkeypatch):
    """Return a function that has Ctrl-C pressed when a kind of disturbance begins."""

    def interrupt(kind):
        def show(display, names):
            if kind in names:
                signal.raise_signal(signal.SIGINT)

        monkeypatch.setattr(Display, "show_active", show)

    return interrupt


@pytest.mark.parametrize("option", ["", "--json", "--quiet"])
def test_the_finished_kinds_are_kept_after_an_interrupt(command, slip_file, folder, interrupt_after, option):
    interrupt_after("uphill slope")
    run = command("push", slip_file, *QUICK, "-o", "push.json", *filter(None, [option]))
    assert run.status == 130
    assert "nothing was written" not in run.err
    missing = [*KINDS[2:], "recovery"]
    assert "The same command completes push.json." in run.err
    record = load_robustness(folder / "push.json")
    assert [margin.kind for margin in record.margins] == KINDS[:2]
    assert list(record.missing) == missing
    if option == "--json":
        facts = json.loads(run.out)
        assert [each["kind"] for each in facts["survived"]] == KINDS[:2]
        assert facts["missing"] == missing
        assert facts["basin_before"] is facts["basin_after"] is None
    elif not option:
        assert f"not tested, since the test was interrupted: {', '.join(missing)}" in run.out
        shown = command("show", "push.json").out
        assert f"not tested, since the test was interrupted: {', '.join(missing)}" in shown
        assert command("plot", "push.json").status == 0


@pytest.mark.slow
@pytest.mark.parametrize("engine", ["scipy", "auto"])
def test_the_stated_engine_simulates_the_walks(command, slip_file, engine, monkeypatch):
    used, make = set(), disturbed_gait.make_walker

    def make_walker(*arguments, **options):
        used.add(options["engine"].name)
        return make(*arguments, **options)

    monkeypatch.setattr(disturbed_gait, "make_walker", make_walker)
    run = command("push", slip_file, *QUICK, "--kind", "friction patch", "--engine", engine, "--json")
    assert run.status == 0
    assert {run.json["engine"]} == used == {"scipy" if engine == "scipy" else default_engine().name}


@pytest.mark.slow
def test_the_same_command_completes_an_interrupted_test(command, slip_file, folder, interrupt_after, monkeypatch):
    interrupt_after("uphill slope")
    assert command("push", slip_file, *QUICK, "-o", "push.json").status == 130
    begun = load_robustness(folder / "push.json")
    for option, said in [
        (("--steps", "7"), "with --steps 6, not 7"),
        (("--starts", "2"), "with --starts 1, not 2"),
        (("--ball", "0.2"), "with --ball 0.1, not 0.2"),
        (("--torque-limit", "9", "--gain", "stiffness=90"), "with the spectral radius "),
    ]:
        run = command("push", slip_file, *QUICK, *option, "-o", "push.json")
        assert run.status == 2
        assert f"push.json contains an interrupted push test {said}" in run.err
        assert load_robustness(folder / "push.json") == begun

    tested = []
    monkeypatch.setattr(Display, "show_active", lambda display, names: tested.extend(names))
    run = command("push", slip_file, *QUICK, "--kind", "torque noise", "-o", "push.json")
    assert run.status == 0
    assert set(KINDS[:2]).isdisjoint(tested)
    record = load_robustness(folder / "push.json")
    assert ([margin.kind for margin in record.margins], record.missing) == (KINDS, ())
    assert record.margins[:2] == begun.margins
    assert command("push", slip_file, *QUICK, "-o", "whole.json").status == 0
    assert load_robustness(folder / "whole.json") == record
    assert command("push", slip_file, *QUICK, "--steps", "7", "--kind", "push", "-o", "push.json").status == 0


def test_an_interrupted_test_of_an_earlier_version_is_kept_and_the_remedy_stated(command, slip_file, folder):
    """Its file does not contain the number of starts and the radius of the ball."""
    margins = (RobustnessMargins("push", 0.1, 0.2, "rad/s"),)
    old = RobustnessRecord(law="lqr", radius=0.5, steps=6, margins=margins, recoveries={}, missing=("recovery",))
    save_robustness(old, folder / "push.json")
    run = command("push", slip_file, *QUICK, "-o", "push.json")
    assert run.status == 2
    text = " ".join(run.err.split())
    assert "push.json contains an interrupted push test of an earlier version of gaitopt." in text
    assert "delete the file, or state another output file with -o." in text
    assert "--starts 0" not in text
    assert load_robustness(folder / "push.json").margins == margins


def test_an_interrupt_before_the_first_result_keeps_nothing(command, slip_file, folder, interrupt_after):
    interrupt_after("push")
    run = command("push", slip_file, *QUICK, "-o", "push.json")
    assert (run.status, run.err.strip()) == (130, "Interrupted; no result was written.")
    assert list(folder.iterdir()) == []


def test_an_interrupt_of_the_recovery_keeps_all_margins(command, slip_file, folder, monkeypatch):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("gaitopt.stability.gait_recovery.measure_gait_recovery", interrupt)
    run = command("push", slip_file, *QUICK, "--kind", "uphill-slope", "--kind", "recovery", "-o", "push.json")
    assert run.status == 130
    record = load_robustness(folder / "push.json")
    assert ([margin.kind for margin in record.margins], record.missing) == (["uphill slope"], ("recovery",))


def test_a_repeated_interrupt_keeps_the_finished_kinds(command, slip_file, folder, interrupt_after, monkeypatch):
    def save(record, path):
        signal.raise_signal(signal.SIGINT)
        return save_robustness(record, path)

    interrupt_after("uphill slope")
    monkeypatch.setattr("gaitopt.study.robustness.robustness_record.save_robustness", save)
    run = command("push", slip_file, *QUICK, "-o", "push.json")
    assert run.status == 130
    assert "Interrupted; wrote push.json." in run.err
    assert [margin.kind for margin in load_robustness(folder / "push.json").margins] == KINDS[:2]


def test_friction_torque_limits_and_number_of_pushes_are_stated(command, slip_file, folder):
    """They decide which pushes are survived, and the number of pushes makes the result comparable with that of tune."""
    options = ("--law", "computed_torque", "--starts", "1", "--workers", "1", "--kind", "push")
    conditions = "friction 0.14, torque limits: 8 N m (ankle, hip)"
    run = command("push", slip_file, *options, "--torque-limit", "8", "-o", "push.json")
    for text in (run.out, command("show", "push.json").out):
        printed = " ".join(text.split())
        assert f", {conditions}" in printed
        assert (
            "after each of 1 random push of at most this size (--starts; the verification of 'gaitopt tune'" in printed
        )
    facts = command("show", "push.json", "--json").json
    assert (facts["friction"], facts["torque_limits"], facts["starts"]) == (0.14, {"ankle": 8.0, "hip": 8.0}, 1)
    begun = dataclasses.replace(load_robustness(folder / "push.json"), missing=("recovery",))
    save_robustness(begun, folder / "push.json")
    run = command("push", slip_file, *options, "--torque-limit", "7", "--gain", "stiffness=90", "-o", "push.json")
    assert run.status == 2
    save_robustness(dataclasses.replace(begun, torque_limits={"hip": 9.0}), folder / "push.json")
    run = command("push", slip_file, *options, "--torque-limit", "8", "-o", "push.json")
    assert "an interrupted push test with torque limits 9 N m (hip), not 8 N m (ankle, hip)" in " ".join(
        run.err.split()
    )
    save_robustness(dataclasses.replace(begun, torque_limits=None, missing=()), folder / "push.json")
    assert "torque limits" not in command("show", "push.json").out


@pytest.mark.slow
def test_the_largest_push_of_push_and_tune_agrees_for_equal_numbers_of_starts(command, slip_file):
    tuned = command("tune", slip_file, *TUNED, "-o", "gains.json", "--json").json["verified"]
    options = ("--law", "gains.json", "--starts", "3", "--workers", "1", "--kind", "push")
    (margin,) = command("push", slip_file, *options, "--json").json["survived"]
    assert margin["survived"] == tuned["push_radius"]


@pytest.mark.slow
def test_stated_kinds_alone_are_tested(command, slip_file, folder):
    run = command("push", slip_file, *QUICK, "--kind", "recovery", "--kind", "torque_noise", "-o", "push.json")
    assert run.status == 0
    record = load_robustness(folder / "push.json")
    assert ([margin.kind for margin in record.margins], record.missing) == (["torque noise"], ())
    assert set(record.recoveries) == {"computed_torque", "open loop"}
    assert "No sensor delay" not in " ".join(run.out.split())
    assert command("push", slip_file, *QUICK, "--kind", "recovery", "-o", "ball.json").status == 0
    assert command("plot", "ball.json").status == 0


def test_a_kind_that_does_not_apply_is_rejected(command, slip_file):
    run = command("push", slip_file, "--kind", "sensor delay")
    assert run.status == 2
    assert "--kind 'sensor delay' does not apply to this gait and law. Known: push, downhill slope" in run.err


def test_a_dead_beat_law_has_a_radius_below_a_bound(command, slip_file, monkeypatch):
    def assess(*arguments, **options):
        cycle = assess_stability(*arguments, **options)
        return dataclasses.replace(cycle, multipliers=1e-7 * cycle.multipliers)

    monkeypatch.setattr("gaitopt.stability.assessment.assess_stability", assess)
    run = command("push", slip_file, *QUICK, "--kind", "uphill slope")
    assert "computed_torque: spectral radius below 1e-4" in run.out


@pytest.mark.parametrize("option", ["", "--json"])
def test_an_interrupt_within_a_kind_reports_what_is_found_so_far(command, slip_file, folder, monkeypatch, option):
    add_trial = MarginLog.add_trial

    def interrupt(log, survived, failed):
        add_trial(log, survived, failed)
        if log._walks == 2:
            signal.raise_signal(signal.SIGINT)

    monkeypatch.setattr(MarginLog, "add_trial", interrupt)
    run = command("push", slip_file, *QUICK, "--kind", "downhill slope", "-o", "push.json", *filter(None, [option]))
    assert run.status == 130
    assert "Incomplete: downhill slope: " in run.err
    assert "so far, after 2 walks." in run.err
    assert list(load_robustness(folder / "push.json").missing) == ["downhill slope"]
    if option == "--json":
        (found,) = json.loads(run.out)["unfinished"]
        assert (found["kind"], found["walks"], found["most"]) == ("downhill slope", 2, 12)
        assert found["survived"] > 0 or found["failed"] > 0


def test_the_tasks_under_way_are_shown_with_their_walks():
    display = Display("push test")
    display.show_active(("push", "uphill slope"))
    display.detail = {"push": "3 of at most about 40 walks, at most about 9 s left", "uphill slope": ""}.__getitem__
    assert display.active == "under way: push (3 of at most about 40 walks, at most about 9 s left); uphill slope"


def test_the_log_of_pushes_infers_which_balls_are_survived(tmp_path):
    log = MarginLog(tmp_path, "push", "rad/s", 40)
    for radius, walks in ((0.1, 1), (0.1, 2), (0.2, 1), (0.15, 1)):
        log.add_push(VerificationStep(radius, walks, 2))
    found = read_margin_log(tmp_path, "push")
    assert (found.survived, found.failed, found.walks) == (0.1, 0.2, 4)
    assert str(found) == "push: 0.1 rad/s is survived, and 0.2 rad/s is not, so far, after 4 walks"
    assert found.progress.startswith("4 of at most about 40 walks, at most about ")


def test_a_worker_without_the_folder_of_the_log_continues(tmp_path):
    MarginLog(tmp_path / "absent", "push", "rad/s", 40).add_trial(0.1, None)


def test_it_is_stated_why_only_negligible_pushes_are_survived(command, root, folder):
    """In open loop, some walks return to the gait within more steps than are tested."""
    assert command("solve", root / "problems/compass_stick.py", "--quiet").status == 0
    run = command("push", "compass_stick.h5", "--kind", "push", "--starts", "20", "--workers", "1", "-o", "push.json")
    (margin,) = load_robustness(folder / "push.json").margins
    assert margin.survived < 0.01
    assert margin.failures == {"slow": 1}
    reason = "do not return (of 20 walks, 1 approaches it too slowly): none ends or leads away from the gait"
    assert reason in run.out
    assert reason in command("show", "push.json").out


@pytest.mark.parametrize(
    ("radius", "failures", "ends", "reason"),
    [
        (1.2, {}, {}, "none is survived, since the gait is unstable (spectral radius 1.2)"),
        (
            0.5,
            {"ended": 2, "slow": 1},
            {"lift_off": 2},
            "some walks after pushes of at most 0.002 rad/s do not return (of 9 walks, 2 end, 1 approaches it too "
            "slowly) (the stance foot lifts off: 2)",
        ),
        (0.5, {}, {}, ""),
    ],
)
def test_the_reason_is_that_of_the_walks(radius, failures, ends, reason):
    push = {"failed": 0.002, "failures": failures, "ends": ends}
    assert _explain_small_push({"radius": radius, "starts": 9}, push) == reason
