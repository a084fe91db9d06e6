"""The command tune states the cost of its search and of its verification before they begin."""

import dataclasses
import re
import shutil
import signal
from pathlib import Path

import pytest

from gaitopt import GainSearchOptions, PushTest, assess_stability, feedforward, save
from gaitopt.cli import feedback_output, tuning_announcement
from gaitopt.cli.law_trials import LawTrials
from gaitopt.cli.tuning_announcement import (
    TuningAnnouncement,
    describe_duration,
    describe_search,
    describe_search_duration,
    describe_verification,
)
from gaitopt.interrupts import hold_interrupt, record_interrupts
from gaitopt.progress import TuningStep, VerificationStep
from gaitopt.simulation.engine_choice import faster_planar_walks, planar_engine_named
from gaitopt.stability.recovery import Recovery
from gaitopt.tuning.record import Tuning

SHORT = ("--law", "computed-torque", "--torque-limit", "8", "--samples", "0", "--evaluations", "3", "--starts", "2")


def test_a_search_is_described_by_its_parts():
    text = describe_search(GainSearchOptions(evaluations=20))
    numbers = [int(number) for number in re.findall(r"\d+", text)]
    assert numbers == [49, 8, 2, 20]
    assert numbers[0] == 1 + numbers[1] + numbers[2] * numbers[3]
    alone = describe_search(GainSearchOptions(samples=0, evaluations=1))
    assert "at most 2 evaluations: the initial gains and one simplex search of at most 1 evaluation" in alone


@pytest.mark.parametrize(
    ("seconds", "walks", "duration"),
    [(0.31, 2000, "10 min"), (0.01, 20, "1 s"), (0.05, 2000, "100 s"), (6, 2000, "200 min")],
)
def test_the_duration_follows_from_that_of_a_walk(seconds, walks, duration):
    text = describe_duration(seconds, walks)
    assert f"a walk from a small push takes {seconds:g} s, so that all walks take about {duration}, or longer" in text


def test_walks_are_announced_before_the_search_and_their_duration_after_the_second_one(monkeypatch):
    printed, times = [], iter([9.0, 10.0, 10.5])
    monkeypatch.setattr(tuning_announcement.err, "print", lambda text, **_: printed.append(text))
    monkeypatch.setattr(tuning_announcement.time, "perf_counter", lambda: next(times))
    announcement = TuningAnnouncement(GainSearchOptions(), PushTest(), hidden=False)
    announcement.begin()
    assert printed == [describe_search(GainSearchOptions()), describe_verification(PushTest())]
    for step in (TuningStep(1, 0.5, 0.5), *(VerificationStep(0.125, walk, 200) for walk in (1, 2, 3))):
        assert announcement.time_step(step) is step
        assert len(printed) == 2 + (isinstance(step, VerificationStep) and step.walks > 1)
    assert printed[2] == describe_duration(0.5, 2000)


def test_the_second_evaluation_announces_the_duration_of_a_slow_search(monkeypatch):
    """The first evaluation also compiles: its time is not counted."""
    printed, times = [], iter([100.0, 120.0])
    monkeypatch.setattr(tuning_announcement.err, "print", lambda text, **_: printed.append(text))
    monkeypatch.setattr(tuning_announcement.time, "perf_counter", lambda: next(times))
    announcement = TuningAnnouncement(GainSearchOptions(), PushTest(), hidden=False)
    announcement.begin()
    for number in (1, 2, 3):
        step = TuningStep(number, 0.5, 0.5)
        assert announcement.time_step(step) is step
        assert printed[2:] == [describe_search_duration(20.0, 129)] * (number > 1)
    assert "second evaluation took 20 s, so that all evaluations take about 43 min" in printed[2]


@pytest.mark.parametrize(("seconds", "announced"), [(1.0, True), (0.1, False)])
def test_many_fast_evaluations_are_announced_too(monkeypatch, seconds, announced):
    printed, times = [], iter([100.0, 100.0 + seconds])
    monkeypatch.setattr(tuning_announcement.err, "print", lambda text, **_: printed.append(text))
    monkeypatch.setattr(tuning_announcement.time, "perf_counter", lambda: next(times))
    announcement = TuningAnnouncement(GainSearchOptions(), PushTest(), hidden=False)
    for number in (1, 2):
        announcement.time_step(TuningStep(number, 0.5, 0.5))
    assert printed == [describe_search_duration(seconds, 129)] * announced


def test_a_slow_search_with_scipy_is_advised_to_use_heyoka(monkeypatch):
    printed, times = [], iter([100.0, 120.0])
    monkeypatch.setattr(tuning_announcement.err, "print", lambda text, **_: printed.append(text))
    monkeypatch.setattr(tuning_announcement.time, "perf_counter", lambda: next(times))
    announcement = TuningAnnouncement(GainSearchOptions(), PushTest(), hidden=False)
    announcement.advice = faster_planar_walks(planar_engine_named("scipy"))
    for number in (1, 2):
        announcement.time_step(TuningStep(number, 0.5, 0.5))
    assert printed == [describe_search_duration(20.0, 129), announcement.advice]
    assert "--engine heyoka" in announcement.advice


@pytest.mark.parametrize(
    ("seconds", "text"),
    [
        (None, "assessed;"),
        (20.0, "the search ends, and the law of the best gains is assessed, which takes about 20 s;"),
        (0.1, ""),
    ],
)
def test_an_interrupt_of_a_slow_search_announces_its_end(monkeypatch, seconds, text):
    printed, times = [], iter([100.0, 100.0 + (seconds or 0)])
    monkeypatch.setattr(tuning_announcement.err, "print", lambda text, **_: printed.append(text))
    monkeypatch.setattr(tuning_announcement.time, "perf_counter", lambda: next(times))
    announcement = TuningAnnouncement(GainSearchOptions(), PushTest(), hidden=False)
    for number in (1, 2) if seconds else ():
        announcement.time_step(TuningStep(number, 0.5, 0.5))
    printed.clear()
    with record_interrupts() as interrupt, hold_interrupt() as held:
        interrupt.announce = announcement.announce_end
        signal.raise_signal(signal.SIGINT)
        assert held.received
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)
    assert [text in line for line in printed] == [True] * bool(text)


def test_a_slow_first_evaluation_with_fast_ones_after_it_announces_no_duration(monkeypatch):
    printed, times = [], iter([102.9, 102.91])
    monkeypatch.setattr(tuning_announcement.err, "print", lambda text, **_: printed.append(text))
    monkeypatch.setattr(tuning_announcement.time, "perf_counter", lambda: next(times))
    announcement = TuningAnnouncement(GainSearchOptions(), PushTest(), hidden=False)
    announcement.begin()
    for number in (1, 2):
        announcement.time_step(TuningStep(number, 0.5, 0.5))
    assert len(printed) == 2


def test_short_walks_are_averaged(monkeypatch):
    """The second walk takes 1 ms, the others 9 ms: all walks take 17 s, not 2 s."""
    printed, times = [], iter([10.0, *(10.001 + 0.009 * walk for walk in range(30))])
    monkeypatch.setattr(tuning_announcement.err, "print", lambda text, **_: printed.append(text))
    monkeypatch.setattr(tuning_announcement.time, "perf_counter", lambda: next(times))
    announcement = TuningAnnouncement(GainSearchOptions(), PushTest(), hidden=False)
    for walk in range(1, 30):
        announcement.time_step(VerificationStep(0.125, walk, 200))
        assert len(printed) == (walk >= 20)
    assert "about 17 s, or longer" in printed[0]


@pytest.mark.parametrize("option", ["", "--json", "--quiet"])
def test_tune_states_the_cost_of_search_and_verification(command, slip_file, option):
    run = command("tune", slip_file, *SHORT, *filter(None, [option]))
    assert run.status == 0
    texts = [
        "search: at most 4 evaluations: the initial gains and one simplex search of at most 3 evaluations",
        "verification: at most about 20 walks of at most 30 steps each, from 2 random pushes (--starts)",
        "trials of other laws: at most 100 walks, only if",
        "verification: a walk from a small push takes",
        ", and trials of other laws up to ",
    ]
    assert [text in run.err for text in texts] == [not option] * 5
    if not option:
        assert sorted(texts, key=run.err.index) == texts


def test_the_record_of_a_continued_search_is_stated_not_to_contain_the_earlier_evaluations(command, slip_file, folder):
    assert command("tune", slip_file, *SHORT, "-o", "gains.json", "--no-trials").status == 0
    run = command("tune", slip_file, "--law", "gains.json", *SHORT[2:], "--no-trials")
    assert (
        "search: the initial gains are those of the file; its 4 evaluations are not repeated, and the record of this "
        "search does not contain them\n"
    ) in run.err
    assert "trials of other laws" not in run.err


def tuning(gait, **verified):
    """Return a tuned law whose closed loop is the open loop of a gait."""
    cycle = assess_stability(gait)
    recovery = Recovery(**{"starts": 200, "returned": 200, "steps": 30, "tolerance": 1e-4, **verified})
    return Tuning(
        law=None,
        family="lqr",
        gains={"torque": 3.0},
        objective="spectral_radius",
        radius_before=cycle.radius,
        radius_after=cycle.radius,
        cycle=cycle,
        fixed_point_shift=0.0,
        verified=recovery,
        trials=(),
        evaluations=1,
        seconds=0.0,
    )


@pytest.mark.parametrize(
    ("verified", "warns"),
    [
        ({"radius": 0.004, "beyond": 0.0042}, True),
        ({"radius": 0.0, "returned": 0, "beyond": 9e-7}, True),
        ({"radius": 0.1, "beyond": 0.105}, False),
        ({"radius": 0.0, "returned": 0, "interrupted": True}, False),
    ],
)
def test_a_gait_that_recovers_from_negligible_pushes_only_is_a_warning(capsys, slip_gait, verified, warns):
    tuned = tuning(slip_gait, **verified)
    assert tuned.hardly_recovers is warns
    feedback_output.print_tuning(tuned)
    text = " ".join(capsys.readouterr().out.split())
    assert ("it recovers reliably only from negligible pushes" in text) is warns
    assert ("plan the gait with margins" in text) is warns
    if not verified.get("interrupted"):
        assert ("no: in each tested ball of pushes, some of the 200 starts do not return" in text) is (
            not verified["radius"]
        )


def test_an_unstable_gait_is_not_verified(slip_gait):
    tuned = dataclasses.replace(tuning(slip_gait, radius=0.0, returned=0, beyond=0.0), radius_after=1.2)
    assert not tuned.hardly_recovers
    assert feedback_output.verification_text(tuned.verified) == "no: the law does not stabilise the gait"


@pytest.mark.parametrize(
    ("failure", "outcome"),
    [("ended", "already end the walk. If"), ("left", "already lead away from the gait. If")],
)
def test_the_warning_states_the_outcome_of_the_walks(slip_gait, failure, outcome):
    text = feedback_output._describe_poor_recovery(tuning(slip_gait, radius=0.004, beyond=0.0042, failure=failure))
    assert f"some pushes of at most 0.0042 rad/s {outcome}" in text
    assert "--steps" not in text


def test_the_warning_counts_the_walks_by_reason(slip_gait):
    counted = {"radius": 0.004, "beyond": 0.0042, "failure": "ended", "failures": {"slow": 3, "ended": 2}}
    tuned = tuning(slip_gait, **counted)
    text = feedback_output._describe_poor_recovery(tuned)
    assert "rad/s (of 200 walks, 2 end, 3 approach it too slowly) already end the walk" in text
    verified = feedback_output.tuning_facts(tuned)["verified"]
    text = feedback_output._describe_poor_recovery(tuning(slip_gait, **counted | {"failures": {"slow": 1}}))
    assert "(of 200 walks, 1 approaches it too slowly)" in text
    assert (verified["failure"], verified["failures"], verified["steps"]) == ("ended", counted["failures"], 30)


def test_the_warning_states_the_size_of_negligible_pushes_the_ends_of_the_walks_and_other_laws(slip_gait):
    ends = {"radius": 0.004, "beyond": 0.0042, "failure": "ended", "ends": {"fell": 1, "lift_off": 4, "jam": 2}}
    text = feedback_output._describe_poor_recovery(tuning(slip_gait, **ends))
    assert "(at most 0.004 rad/s; pushes below 0.01 rad/s are negligible, since rates of legs are of the order" in text
    assert "already end the walk (the stance foot lifts off: 4, jam: 2, the walker falls: 1). If" in text
    assert "tune another law (--law joint_pd, --law computed_torque, --law step_lqr, --law push_off)" in text
    assert "--sensitivity" in text
    assert "gaitopt push" in text
    facts = feedback_output.tuning_facts(tuning(slip_gait, **ends))
    assert facts["verified"]["ends"] == ends["ends"]


@pytest.fixture
def hardly_recovering(slip_gait, monkeypatch):
    """Let tune return the open loop as a law that recovers from negligible pushes only."""
    tuned = tuning(slip_gait, radius=0.004, beyond=0.0042, failure="ended")
    tuned = dataclasses.replace(tuned, law=feedforward(slip_gait.robot, slip_gait.motion), family="push_off")
    monkeypatch.setattr("gaitopt.tuning.tune.tune_feedback", lambda *_, **__: tuned)
    monkeypatch.setattr("gaitopt.cli.law_trials.STARTS", 4)


@pytest.mark.slow
def test_the_law_that_recovers_best_is_tested_and_the_stated_command_tunes_it(
    command, slip_file, folder, hardly_recovering, monkeypatch
):
    shutil.copy(slip_file, folder / "walk.h5")
    run = command("tune", "walk.h5", "--law", "push_off", "--torque-limit", "8")
    text = " ".join(run.out.split())
    returned, other, law, torque_limit = re.search(
        r"up to 0.1 rad/s, (\d) of 4 walks return to the gait under this law, and (\d) of 4 under (\w+) with its "
        r"initial gains. Tune that law: gaitopt tune walk.h5 --law \3 --torque-limit (\d)",
        text,
    ).groups()
    assert int(returned) < int(other)
    assert torque_limit == "8"
    assert "--sensitivity" not in text
    monkeypatch.undo()  # also the working folder
    quick = ("--samples", "0", "--evaluations", "2", "--starts", "4", "--json")
    facts = command("tune", slip_file, "--law", law, "--torque-limit", torque_limit, *quick).json
    assert facts["verified"]["push_radius"] > 0.01


def test_trials_of_other_laws_are_optional(command, slip_file, hardly_recovering, monkeypatch):
    def fail(*_):
        raise AssertionError

    monkeypatch.setattr("gaitopt.stability.gait_recovery.measure_gait_recovery", fail)
    run = command("tune", slip_file, "--law", "push_off", "--no-trials")
    assert run.status == 0
    assert "tune another law (--law joint_pd" in " ".join(run.out.split())


def test_an_interrupt_of_the_trials_of_other_laws_keeps_the_gains(
    command, slip_file, folder, hardly_recovering, monkeypatch
):
    def interrupt(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr("gaitopt.stability.gait_recovery.measure_gait_recovery", interrupt)
    run = command("tune", slip_file, "--law", "push_off", "-o", "gains.json")
    assert run.status == 130
    assert "Interrupted; the gains are verified, but not all other laws were tested." in run.err
    assert (folder / "gains.json").exists()


def test_without_a_better_law_the_remedy_names_the_tested_ones():
    text = LawTrials(tuned=3, others={"lqr": 3, "joint_pd": 1}).describe(Path("walk.h5"), {})
    assert text.endswith(
        "3 of 20 walks return to the gait under this law, and not more under lqr, joint_pd with their initial gains."
    )


def test_gains_at_a_bound_are_named_with_its_value_its_unit_and_the_option_that_widens_it(slip_gait):
    tuned = dataclasses.replace(
        tuning(slip_gait, radius=0.1),
        family="joint_pd",
        gains={"hip_stiffness": 0.0, "ankle_damping": 40.0, "hip_damping": 0.1},
        bounds={"hip_stiffness": (0.0, 9.0), "ankle_damping": (0.0, 40.0), "hip_damping": (0.1, 5.0)},
    )
    assert feedback_output._describe_bounds(tuned, several_contacts=False) == (
        "hip_stiffness is at its lower bound, 0 N m/rad, and ankle_damping is at its upper bound, 40 N m s/rad, and "
        "hip_damping is at its lower bound, 0.1 N m s/rad; wider bounds may improve the law, such as with --bound "
        "ankle_damping=0:80 --bound hip_damping=0.05:5"
    )


def test_bounds_of_the_search_are_an_option(command, slip_file):
    bound = ("--bound", "stiffness=300:400")
    facts = command("tune", slip_file, *SHORT, *bound, "--json").json
    assert 300 <= facts["gains"]["stiffness"] <= 400
    assert set(facts["gains"]) == {"stiffness", "damping"}
    for text, message in [
        ("stiffnes=1:2", "has no gain 'stiffnes'. Did you mean 'stiffness'?"),
        ("stiffness=2", "--bound must have the form NAME=LOWER:UPPER, got 'stiffness=2'"),
        ("stiffness=2:1", "--bound stiffness: the bounds must be finite, LOWER below UPPER, got '2:1'"),
    ]:
        run = command("tune", slip_file, *SHORT, "--bound", text)
        assert (run.status, message in " ".join(run.err.split())) == (2, True)


@pytest.mark.parametrize(
    ("law", "options"),
    [("step_lqr", ("--torque-limit", "5")), ("no_law", ())],
)
def test_an_invalid_law_is_rejected_before_the_plan_of_the_search_is_printed(command, tmp_path, hop_gait, law, options):
    run = command("tune", save(hop_gait, tmp_path / "hop.h5"), "--law", law, *options)
    assert run.status == 2
    assert law in run.err
    assert "search:" not in run.err
    assert "verification:" not in run.err


def test_walks_with_too_few_steps_are_distinguished_from_walks_that_leave_the_gait(slip_gait):
    tuned = tuning(slip_gait, radius=0.004, beyond=0.0042, failure="slow")
    text = feedback_output._describe_poor_recovery(tuned)
    assert "approach the gait, but do not return to it (within 0.0001) in 30 steps" in text
    assert f"spectral radius ({tuned.radius_after:.4g})" in text
    assert "--steps 60" in text
    assert "PushTest(steps=60)" in text
    assert "Margins" not in text


def test_the_number_of_steps_of_the_verification_is_an_option(command, slip_file):
    run = command("tune", slip_file, *SHORT, "--steps", "7")
    assert "of at most 7 steps each" in run.err
    assert "in at most 7 steps" in " ".join(run.out.split())


@pytest.mark.parametrize("starts", [1, 50])
def test_few_starts_do_not_claim_a_margin(starts):
    verified = Recovery(radius=0.5, starts=starts, returned=starts, steps=1, tolerance=1e-4, beyond=1.0)
    text = feedback_output.verification_text(verified)
    assert text.startswith(f"{starts} of {starts} starts within 0.5 rad/s return")
    assert ("so few starts do not determine the margin, use gaitopt push" in text) is (starts == 1)
