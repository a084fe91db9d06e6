"""Gait: its description, and the conditions under which it is accepted."""

import dataclasses

import numpy as np
import pytest
from scipy.integrate import trapezoid

from gaitopt import InputError, Mode, Status
from gaitopt.motion import Verification, Violation
from gaitopt.motion.gait import cone_margin


def verdict(passed):
    return Verification(passed, "stick | stick", "steps_done", 0.0, 0.0, 0.0, 0.1, 0.0, () if passed else ("why",))


def test_example_is_the_reference_gait(slip_gait):
    """The robot of Gamus & Or on level ground, 0.633 m/s, step 0.4713 m, friction 0.14: CoT 0.01586 (own numbers)."""
    assert str(slip_gait.sequence) == "slip+ stick | slip+"
    assert slip_gait.speed == pytest.approx(0.633, rel=1e-6)
    assert slip_gait.step_length == pytest.approx(0.4713, rel=1e-6)
    assert slip_gait.period == pytest.approx(0.4713 / 0.633, rel=1e-6)
    assert slip_gait.cost_of_transport == pytest.approx(0.01586, abs=1e-5)
    assert slip_gait.energy.relative_residual < 1e-6
    assert slip_gait.require() is slip_gait


def test_cost_of_the_example_is_its_own_work_over_its_own_weight(slip_gait):
    """Integrate |power| of the samples by the trapezoid rule, from torques and rates only."""
    total = 0.0
    for segment in slip_gait.motion.segments:
        fine = np.linspace(segment.time[0], segment.time[-1], 20001)
        rates = np.array([segment.v[2], segment.v[2] + segment.v[3]])
        for torque, rate in zip(segment.torque, rates, strict=True):
            power = np.interp(fine, segment.time, torque) * np.interp(fine, segment.time, rate)
            total += trapezoid(np.abs(power), fine)
    weight = (2 * 4.0 + 2.0) * 9.8
    assert slip_gait.cost_of_transport == pytest.approx(total / weight / slip_gait.step_length, rel=1e-3)


def test_an_unsolved_gait_refuses_and_names_its_worst_constraints(slip_gait):
    worst = tuple(Violation("phase 1 (stick), node 3", f"constraint {i}", 0.1 * i) for i in range(5))
    gait = dataclasses.replace(
        slip_gait, status=Status.INFEASIBLE, solver=dataclasses.replace(slip_gait.solver, violations=worst)
    )
    with pytest.raises(
        InputError, match=r"infeasible.*constraint 0 at phase 1 \(stick\), node 3 violated by 0.00e\+00"
    ):
        gait.require()
    with pytest.raises(InputError) as caught:
        gait.require()
    assert "constraint 3" not in str(caught.value)


@pytest.mark.parametrize(
    ("status", "passed", "after"),
    [
        (Status.SOLVED, True, Status.SOLVED),
        (Status.SOLVED, False, Status.NOT_VERIFIED),
        (Status.NOT_VERIFIED, True, Status.SOLVED),
        (Status.INFEASIBLE, True, Status.INFEASIBLE),
        (Status.ACCEPTABLE, False, Status.ACCEPTABLE),
    ],
)
def test_replay_refutes_a_solution_but_makes_none(slip_gait, status, passed, after):
    gait = dataclasses.replace(slip_gait, status=status).with_verification(verdict(passed))
    assert gait.status is after
    assert gait.verification.passed is passed


def test_cone_margin_is_the_smallest_of_the_sticking_samples(segment, motion):
    time = np.linspace(0, 1, 3)
    held = segment(time, force=np.array([[0.1, -0.4, 0.2], [1.0, 1.0, 2.0]]))
    sliding = segment(time, mode=Mode.SLIP_FORWARD, force=np.array([[-0.5] * 3, [1.0] * 3]))
    assert cone_margin(motion([sliding, held])) == pytest.approx(1 - 0.4 / 0.5)
    assert cone_margin(motion([held], friction=np.inf)) == 1.0
    assert np.isnan(cone_margin(motion([sliding])))


def test_a_gait_and_its_parts_are_shown_in_a_line(slip_gait, infeasible, not_a_number):
    shown = repr(slip_gait)
    assert shown == (
        "Gait('compass_biped', 'slip+ stick | slip+', solved, replay passed, cost of transport 0.0158534, 0.633 m/s, "
        "step length 0.4713 m)"
    )
    assert "infeasible" in repr(infeasible)
    assert "cost of transport nan" in repr(not_a_number)
    motion = slip_gait.motion
    assert repr(motion) == (
        "Motion(first step 'slip+ stick | slip+', segments: 2, touchdowns: 1, period 0.74455 s, travel 0.4713 m)"
    )
    assert repr(motion.segments[0]) == "Segment(slip+, step 0, 0 to 0.0196301 s, 21 samples)"
    assert repr(dataclasses.replace(motion, segments=(), jumps=())).startswith("Motion(segments: 0, touchdowns: 0")
