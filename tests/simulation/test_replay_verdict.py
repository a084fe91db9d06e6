"""verify: the example passes, and every way of tampering with it is found and named."""

import dataclasses
import math
import re

import numpy as np
import pytest

from gaitopt import (
    Collocation,
    GaitProblem,
    InputError,
    Limits,
    ScipyEngine,
    Status,
    compass_biped,
    load,
    replay,
    solve,
    verify,
)
from gaitopt.motion import Verification
from gaitopt.simulation import Tolerances, verification
from gaitopt.simulation.replay_advice import BEGINNING, advise_on_replay


def with_motion(gait, **changes):
    return dataclasses.replace(gait, motion=dataclasses.replace(gait.motion, **changes))


def with_first(gait, **changes):
    first, *rest = gait.motion.segments
    return with_motion(gait, segments=(dataclasses.replace(first, **changes), *rest))


def with_parameters(gait, **changes):
    return with_motion(gait, parameters={**gait.motion.parameters, **changes})


def reasons(gait, **options):
    """Return the reasons of a verdict that must not pass."""
    verified = verify(gait, **options)
    assert not verified.verification.passed
    assert verified.status is Status.NOT_VERIFIED
    return " / ".join(verified.verification.reasons)


def test_the_example_passes(slip_gait):
    verified = verify(slip_gait)
    verdict = verified.verification
    assert verdict.passed
    assert verdict.reasons == ()
    assert verified.status is Status.SOLVED
    assert verdict.sequence == "slip+ stick | slip+"
    assert verdict.stop == "steps_done"
    assert verdict.state_error < 3e-7  # own numbers: the reference gaits land within 3e-7
    assert verdict.period_error < 1e-7
    assert verdict.energy_residual < 1e-8
    assert verdict.cost_of_transport == pytest.approx(0.01586, abs=1e-5)
    assert verdict.cone_margin == pytest.approx(0.001, abs=2e-5)  # the requested margin


def test_the_replay_forgets_the_plan(slip_gait, compass):
    """Only the first state, the torques and the parameters are given: the rest of the plan may be nonsense."""
    nonsense = dataclasses.replace(
        slip_gait.motion,
        segments=tuple(
            dataclasses.replace(
                segment,
                q=np.hstack([segment.q[:, :1], np.full_like(segment.q[:, 1:], np.nan)]),
                v=np.hstack([segment.v[:, :1], np.full_like(segment.v[:, 1:], np.nan)]),
                force=np.full_like(segment.force, np.nan),
            )
            for segment in slip_gait.motion.segments
        ),
    )
    straight = replay(slip_gait)
    blind = replay(dataclasses.replace(slip_gait, motion=nonsense))
    np.testing.assert_array_equal(blind.motion.jumps[0].v_next, straight.motion.jumps[0].v_next)


@pytest.mark.parametrize(
    ("tolerance", "remedy"),
    [
        (math.inf, "which its tolerance of inf permits; use the default tolerance, 1e-07."),
        (1e-7, "from a motion of the robot between its nodes; use more intervals."),
    ],
)
def test_the_advice_on_a_coarse_grid_is_a_smaller_tolerance_or_more_intervals(tolerance, remedy):
    problem = GaitProblem(
        robot=compass_biped(), sequence="slip+ stick | slip+", friction=0.14, speed=0.633, step_length=0.4713,
        limits=Limits(torque=2.5), transcription=Collocation(intervals=5, tolerance=math.inf),
    )  # fmt: skip
    gait = solve(problem)
    assert (gait.status, gait.solver.warnings) == (Status.SOLVED, ())
    failed = verify(gait.replace_fields(problem=gait.problem | {"tolerance": tolerance}))
    assert failed.status is Status.NOT_VERIFIED
    (advice,) = failed.solver.warnings
    assert advice.startswith(f"{BEGINNING}the grid is too coarse: the plan deviates by ")
    assert advice.endswith(remedy)
    assert verify(failed).solver.warnings == failed.solver.warnings
    assert verify(failed, tolerances=Tolerances(state=1e-4)).solver.warnings == ()


@pytest.mark.parametrize(
    ("sequence", "error", "remedy"),
    [
        ("slip+ stick | stick", 1e-9, "use a larger Margins.impact_cone."),
        ("slip+ stick slip- | slip+", 1e-9, "use larger Margins (cone, slip_speed)."),
        ("slip+ stick | slip+", 1e-9, "such as Collocation(tolerance=1e-9), or more intervals."),
        ("slip+ stick | stick", 1e-6, "use more intervals."),
    ],
)
def test_the_advice_depends_on_what_differs(slip_gait, sequence, error, remedy):
    gait = slip_gait.replace_fields(solver=slip_gait.solver.replace_fields(error_between_nodes=error))
    verdict = dataclasses.replace(verify(gait).verification, passed=False, sequence=sequence, reasons=("differs",))
    assert advise_on_replay(gait, verdict).endswith(remedy)


def test_no_setting_is_advised_for_a_wrong_robot(slip_gait, monkeypatch):
    fault = "the leg exchange changes the kinetic energy by 1 J"
    monkeypatch.setattr("gaitopt.simulation.verification._check_exchange", lambda *_: [fault])
    failed = verify(slip_gait)
    assert fault in failed.verification.reasons
    assert failed.solver.warnings == ()


@pytest.mark.parametrize("relative", [1e-4, -1e-3])
def test_a_torque_changed_a_little(slip_gait, relative):
    segments = tuple(dataclasses.replace(s, torque=(1 + relative) * s.torque) for s in slip_gait.motion.segments)
    said = reasons(with_motion(slip_gait, segments=segments))
    assert "state after touchdown deviates by" in said
    assert "allowed 1e-06" in said


def test_a_wrong_first_state(slip_gait):
    v = slip_gait.motion.segments[0].v.copy()
    v[2, 0] += 1e-4
    assert "state after touchdown deviates by" in reasons(with_first(slip_gait, v=v))


def test_a_foot_that_should_start_sliding_but_rests(slip_gait):
    v = slip_gait.motion.segments[0].v.copy()
    v[0, 0] = 0.0
    assert "instead of 'slip+ stick | slip+'" in reasons(with_first(slip_gait, v=v))


def test_more_friction_than_planned(slip_gait):
    said = reasons(with_parameters(slip_gait, friction=0.3))
    assert "the replay has the contact sequence 'slip+ stick | stick' instead of 'slip+ stick | slip+'" in said


def test_less_friction_than_planned(slip_gait):
    assert re.search(
        r"the replay stopped at 0\.\d+ s: The walker fell\.", str(reasons(with_parameters(slip_gait, friction=0.05)))
    )


def test_friction_beyond_painleve(slip_gait):
    """The foot slides from the start, where slip is not well posed: a verdict, no exception."""
    said = reasons(with_parameters(slip_gait, friction=5.0))
    assert "Painleve" in said
    assert "''" not in said


def test_infinite_friction_and_a_sliding_start(slip_gait):
    with pytest.raises(InputError, match="infinite friction cannot slide"):
        verify(with_parameters(slip_gait, friction=np.inf))


def test_a_slope(slip_gait):
    assert "state after touchdown deviates by" in reasons(with_parameters(slip_gait, slope=1e-4))


def test_a_landing_the_gait_does_not_have(slip_gait):
    """A step that begins stuck and lands sliding has a contact sequence too; the verdict names it."""
    v = slip_gait.motion.segments[0].v.copy()
    v[0, 0] = 0.0
    said = reasons(with_parameters(with_first(slip_gait, v=v), friction=0.139))
    assert "the replay has the contact sequence '" in said


def test_a_wrong_cost_in_the_plan(slip_gait):
    """The state and times agree, but the plan claims less work than its torques do."""
    segments = tuple(dataclasses.replace(s, work=0.9 * s.work, power=0.9 * s.power) for s in slip_gait.motion.segments)
    said = reasons(with_motion(slip_gait, segments=segments))
    assert said.startswith("cost of transport deviates by 1.1e-01, allowed 5e-03")
    assert "state" not in said


@pytest.mark.parametrize(
    ("field", "entry"), [("q_next", 2), ("q_next", 3), ("v_next", 0), ("v_next", 2), ("v_next", 3)]
)
def test_a_wrong_state_after_touchdown_in_the_plan(slip_gait, field, entry):
    jump = slip_gait.motion.jumps[0]
    claimed = getattr(jump, field).copy()
    claimed[entry] += 1e-4
    said = reasons(with_motion(slip_gait, jumps=(dataclasses.replace(jump, **{field: claimed}),)))
    assert said == "state after touchdown deviates by 1.0e-04, allowed 1e-06"


def test_a_wrong_period_in_the_plan(slip_gait):
    """The last sample is kept, so the walk is nearly the same; in the plan it takes longer."""
    *rest, last = slip_gait.motion.segments
    time = last.time.copy()
    time[-1] += 1e-4
    assert "period deviates by 1.0e-04 s" in reasons(
        with_motion(slip_gait, segments=(*rest, dataclasses.replace(last, time=time)))
    )


def test_tolerances_decide(slip_gait):
    strict = Tolerances(state=1e-12)
    assert "allowed 1e-12" in reasons(slip_gait, tolerances=strict)
    v = slip_gait.motion.segments[0].v.copy()
    v[2, 0] += 1e-7
    nudged = with_first(slip_gait, v=v)
    loose = Tolerances(state=1e-4, period=1e-4)
    assert verify(nudged, tolerances=loose).verification.passed


def test_a_gait_found_good_again_is_solved_again(slip_gait):
    bad = Verification(False, "", "fell", np.inf, 1.0, np.nan, np.nan, 0.0, ("why",))
    refuted = slip_gait.with_verification(bad)
    assert refuted.status is Status.NOT_VERIFIED
    assert verify(refuted).status is Status.SOLVED


def test_another_robot_is_refused(slip_gait, wheel):
    with pytest.raises(InputError, match="'rimless_wheel' is not the robot 'compass_biped' of the gait"):
        verify(slip_gait.with_robot(wheel))


def test_a_robot_outside_the_catalogue_must_be_given_for_an_old_file(tmp_path, write_old_file, compass):
    custom = load(write_old_file(tmp_path / "old.h5", "mine"))
    with pytest.raises(InputError, match="contains only the name of its robot, 'mine', which is not in the catalogue"):
        verify(custom)
    assert verify(custom.with_robot(dataclasses.replace(compass, name="mine"))).verification.passed


def test_two_steps_open_loop_repeat_the_step(slip_gait, compass):
    """The clock starts again at touchdown; the gait returns to its own start within the optimiser's accuracy."""
    walk = replay(slip_gait, steps=2)
    one, two = walk.motion.jumps
    assert str(walk.motion.sequence(1)) == "slip+ stick | slip+"
    np.testing.assert_allclose(two.v_next, one.v_next, atol=1e-5)
    np.testing.assert_allclose(walk.motion.segments[2].torque[:, 0], walk.motion.segments[0].torque[:, 0], rtol=1e-12)


def test_a_failed_replay_is_repeated_at_the_limit_of_double_precision(slip_gait, monkeypatch):
    engines, replay = [], verification.replay

    def record(gait, *, engine):
        engines.append(engine)
        return replay(gait, engine=engine)

    monkeypatch.setattr(verification, "replay", record)
    assert verify(slip_gait).verification.passed
    assert engines == [None]
    errors = [verify(slip_gait, tolerances=Tolerances(state=0.0)).verification.state_error]
    assert engines == [None, None, verification.FINEST]
    errors.append(verify(slip_gait, tolerances=Tolerances(state=0.0), engine=ScipyEngine()).verification.state_error)
    assert engines[3:] == [ScipyEngine()]
    assert errors[0] != errors[1]
