"""Tuning: what is found, reported and verified."""

import dataclasses
import itertools
import signal

import numpy as np
import pytest

from gaitopt import (
    GainSearchOptions,
    InputError,
    PushTest,
    SensitivityNorm,
    SpectralRadius,
    Stop,
    assess_stability,
    compass_biped,
    feedforward,
    joint_pd,
    simulate,
    tune_feedback,
)
from gaitopt.progress import TuningStep
from gaitopt.tuning import ControllerFamily, Gain, controller_family_named

QUICK = GainSearchOptions(samples=3, starts=1, evaluations=15)


@pytest.fixture(scope="module")
def design(slipping):
    whole = controller_family_named("pd", compass_biped(), slipping.motion, torque_limit=8)
    return whole.with_bounds({"hip_stiffness": (0, 60), "hip_damping": (0, 20)})


@pytest.fixture(scope="module")
def tuned(slipping, design):
    seen = []
    found = tune_feedback(
        slipping, design, search=QUICK, test=PushTest(starts=10, resolution=0.3), observer=seen.append
    )
    searched, verified = seen[: found.evaluations], seen[found.evaluations :]
    assert [step.number for step in searched] == list(range(1, found.evaluations + 1))
    objectives = [step.objective for step in searched]
    assert objectives == [trial.objective for trial in found.trials]
    assert [step.best for step in searched] == np.minimum.accumulate(objectives).tolist()
    assert verified
    assert all(1 <= step.walks <= step.starts == 10 and step.radius > 0 for step in verified)
    return found


def test_objectives_of_trials_are_radii_of_the_gaits_under_their_laws(slipping, design, tuned):
    stable = [trial for trial in tuned.trials if trial.objective < 1]
    assert len(stable) > 2
    for trial in (stable[0], max(stable, key=lambda trial: trial.objective)):
        law = design.law(trial.gains)
        assert law.gain_values["hip_stiffness"] == trial.gains["hip_stiffness"]
        assert assess_stability(slipping, law).radius == pytest.approx(trial.objective, abs=1e-6)


def test_the_best_trial_is_returned(slipping, tuned):
    best = min(tuned.trials, key=lambda trial: trial.objective)
    assert tuned.gains == best.gains
    assert set(tuned.gains) == {"hip_stiffness", "hip_damping"}
    assert tuned.radius_after == pytest.approx(best.objective, abs=1e-5)
    assert tuned.radius_after == assess_stability(slipping, tuned.law).radius
    assert tuned.radius_after < tuned.radius_before
    assert tuned.stable
    assert tuned.fixed_point_shift < 1e-6


@pytest.mark.slow
def test_the_verified_radius_is_one_from_which_walks_return(slipping, tuned):
    """Walks of the simulator from well inside the ball end in the gait, and from far outside they do not.

    Ten random starts leave the edge of the ball uncertain.
    """
    inside, first = 0.7 * tuned.verified.radius, slipping.motion.segments[0]
    assert inside > 0.01
    for rate, push in itertools.product((2, 3), (inside, -inside, 10 * tuned.verified.beyond)):
        v = first.v[:, 0].copy()
        v[rate] += push
        walk = simulate(slipping.robot, first.q[:, 0], v, slipping.motion.parameters, law=tuned.law, steps=30)
        stays = walk.stop is Stop.STEPS_DONE
        assert stays == (abs(push) == inside)
        assert not stays or walk.motion.jumps[-1].v_next == pytest.approx(first.v[:, 0], abs=1e-4)


def test_gains_at_bounds_of_the_search_are_named(tuned):
    assert set(tuned.bounds) == set(tuned.gains)
    upper = {name: (0.0, value) for name, value in tuned.gains.items()}
    assert set(dataclasses.replace(tuned, bounds=upper).at_bounds.values()) == {"upper"}
    wide = {name: (value - 1, value + 1) for name, value in tuned.gains.items()}
    assert dataclasses.replace(tuned, bounds=wide).at_bounds == {}


def test_same_seed_same_gains(slipping, design, tuned):
    again = tune_feedback(slipping, design, search=QUICK, test=PushTest(starts=1, resolution=0.9))
    assert again.gains == tuned.gains


@pytest.mark.parametrize("evaluation", [2, 8])
def test_ctrl_c_ends_the_search_with_the_best_gains_so_far(slipping, design, tuned, evaluation):
    """Among the random gains and among those of the simplex method, which an uninterrupted search evaluates too."""

    def interrupt(step):
        if step.number == evaluation:
            signal.raise_signal(signal.SIGINT)

    found = tune_feedback(slipping, design, search=QUICK, test=PushTest(starts=1), observer=interrupt)
    assert found.trials == tuned.trials[:evaluation]
    assert found.gains == min(found.trials, key=lambda trial: trial.objective).gains
    assert found.radius_after == assess_stability(slipping, found.law).radius
    assert (found.search_interrupted, tuned.search_interrupted) == (True, False)
    assert (found.verified.interrupted, found.verified.radius) == (True, 0.0)


def test_ctrl_c_in_the_last_evaluation_ends_the_verification_only(slipping, design):
    def interrupt(step):
        if isinstance(step, TuningStep) and step.number == step.limit:
            signal.raise_signal(signal.SIGINT)

    search = GainSearchOptions(samples=0, starts=1, evaluations=1)
    found = tune_feedback(slipping, design, search=search, test=PushTest(starts=1), observer=interrupt)
    assert (found.search_interrupted, found.verified.interrupted) == (False, True)


def test_a_second_ctrl_c_ends_the_search_without_a_result(slipping, design):
    def interrupt(_):
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    with pytest.raises(KeyboardInterrupt):
        tune_feedback(slipping, design, search=QUICK, observer=interrupt)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_worst_friction_counts(slipping, design):
    search, test = GainSearchOptions(samples=1, starts=1, evaluations=1), PushTest(starts=1, resolution=0.9)
    own, wide = (tune_feedback(slipping, design, frictions=more, search=search, test=test) for more in ((), (0.13,)))
    pairs = zip(own.trials, wide.trials, strict=True)
    assert all(alone.objective <= worst.objective + 1e-9 for alone, worst in pairs)
    assert any(alone.objective < worst.objective - 1e-3 for alone, worst in zip(own.trials, wide.trials, strict=True))


def test_what_cannot_be_held_is_reported_with_the_best_radius(slipping, design):
    # Gains that pull the wrong way.
    wrong = ControllerFamily(
        "wrong",
        (Gain("push", 30.0, 20.0, 40.0),),
        lambda g: design.law({"hip_stiffness": -g["push"], "hip_damping": 0}),
    )
    found = tune_feedback(
        slipping,
        wrong,
        search=GainSearchOptions(samples=2, starts=1, evaluations=4),
        test=PushTest(starts=1, resolution=0.9),
    )
    assert not found.stable
    assert found.radius_after > 1
    assert found.radius_after == pytest.approx(min(trial.objective for trial in found.trials), abs=1e-5)
    assert (found.verified.radius, found.verified.returned) == (0.0, 0)


def test_no_gait_and_no_law_are_answers_too(slipping, design):
    quick = {
        "search": GainSearchOptions(samples=1, starts=1, evaluations=1),
        "test": PushTest(starts=1, resolution=0.9),
    }

    def none(gains):
        raise InputError("no law")

    for name, law in (
        ("too weak", lambda g: joint_pd(compass_biped(), slipping.motion, torque_limit=1e-3)),
        ("no law", none),
    ):
        found = tune_feedback(slipping, ControllerFamily(name, (Gain("a", 0.5, 0.0, 1.0),), law), **quick)
        assert not found.stable
        assert (found.radius_after, found.cycle, found.verified.returned) == (np.inf, None, 0)
        assert np.isnan(found.fixed_point_shift)
        assert (found.law is None) is (name == "no law")


def test_a_design_by_the_stance_angle(slipping, design):
    by_angle = design.by_stance_angle(compass_biped(), slipping.motion)
    law = by_angle.law({"hip_stiffness": 3.0, "hip_damping": 2.0})
    assert law.name == "joint_pd by th1"
    assert law.gain_values["hip_stiffness"] == 3.0


def test_mistakes_are_explained(slipping, design):
    with pytest.raises(InputError, match="no feedback law 'pid'"):
        controller_family_named("pid", compass_biped(), slipping.motion)
    with pytest.raises(InputError, match="no gain 'knee'"):
        design.with_bounds({"knee": (0, 1)})
    with pytest.raises(InputError, match="bounds that contain its start"):
        Gain("a", 3.0, 0.0, 1.0)


@pytest.mark.parametrize("share", [0.0, 0.3, 1.0])
def test_gains_lie_where_their_share_says(share):
    for gain in (Gain("a", 2.0, 1.0, 9.0), Gain("a", 2.0, 1.0, 9.0, logarithmic=True)):
        assert Gain("a", gain.at(share), 1.0, 9.0, gain.logarithmic).share == pytest.approx(share)


def test_sensitivity_norm_adds_up_what_becomes_of_pushes():
    matrix, scale = np.array([[0.3, 1.0], [-0.2, 0.5]]), np.array([0.1, 2.0])
    scaled = np.diag(1 / scale) @ matrix @ np.diag(scale)
    powers = [np.linalg.matrix_power(scaled, k) for k in range(1, 200)]
    assert SensitivityNorm()(matrix, scale) == pytest.approx(np.sqrt(sum(np.sum(p**2) for p in powers)))
    assert SensitivityNorm()(2 * np.eye(2), scale) == np.inf
    assert SpectralRadius()(matrix, scale) == pytest.approx(max(abs(np.linalg.eigvals(matrix))))


def test_a_tuning_is_shown_in_a_line(tuned):
    assert repr(tuned).startswith("Tuning('joint_pd', spectral radius 0.6")
    assert "hip_stiffness=" in repr(tuned)
    many = dataclasses.replace(tuned, gains={f"actuator_{k}_stiffness": 1 / 3 for k in range(50)})
    assert len(repr(tuned)) < len(repr(many)) < 300
    assert "np.float64" not in repr(tuned)


def test_a_law_without_gains_is_refused(slipping):
    family = ControllerFamily.from_law(feedforward(slipping.robot, slipping.motion))
    with pytest.raises(
        InputError, match=r"has no gains to tune\. Gains of a law with the decorator define_law are the arguments"
    ):
        tune_feedback(slipping, family)
