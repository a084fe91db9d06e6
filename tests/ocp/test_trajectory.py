"""From a decision vector to a motion, and the check of the plan between its nodes."""

import numpy as np
import pytest
from scipy.integrate import trapezoid

from gaitopt import CostOfTransport, Mode, MultipleShooting, Status, solve
from gaitopt.ocp.solution.trajectory import check_between_nodes, reconstruct_motion
from tests.ocp.nlp_examples import SCHEMES, example_nlp, unknowns

SLIP = "slip+ stick | slip+"


@pytest.fixture(scope="module")
def gait(solved):
    return solved(sequence=SLIP)


@pytest.fixture(scope="module")
def transcription(gait):
    counts = tuple(gait.problem["intervals"])
    return example_nlp(gait.sequence, counts, CostOfTransport(), SCHEMES[1])


def test_segments_join_in_time_and_state(gait):
    slide, stick = gait.motion.segments
    assert stick.time[0] == slide.time[-1]
    assert stick.q[:, 0] == pytest.approx(slide.q[:, -1])
    assert stick.v[:, 0] == pytest.approx(slide.v[:, -1], abs=1e-12)
    assert stick.torque[:, 0] == pytest.approx(slide.torque[:, -1])
    assert slide.time.size == 2 * 10 + 1
    assert stick.time.size == 2 * 40 + 1


def test_the_step_repeats_itself(gait):
    first, jump = gait.motion.segments[0], gait.motion.jumps[0]
    assert jump.q_next[2:] == pytest.approx(first.q[2:, 0], abs=1e-9)
    assert jump.v_next == pytest.approx(first.v[:, 0], abs=1e-9)
    assert jump.q_next[1] == pytest.approx(0, abs=1e-9)


def test_works_are_the_integrals_of_the_powers(gait):
    for segment in gait.motion.segments:
        for power, work in zip(segment.power, segment.work, strict=True):
            scale = np.max(np.abs(power)) * segment.duration
            assert trapezoid(power, segment.time) == pytest.approx(work[-1], abs=2e-3 * scale)


def test_friction_dissipates_only_while_sliding(gait):
    slide, stick = gait.motion.segments
    assert slide.mode is Mode.SLIP_FORWARD
    assert np.all(np.diff(slide.friction_work) > 0)
    assert not np.any(stick.friction_work)


def test_the_plan_read_again_is_the_same(gait, transcription):
    motion = reconstruct_motion(transcription, gait.motion.parameters, unknowns(gait, transcription))
    assert np.array_equal(motion.channel("q"), gait.motion.channel("q"))
    assert motion.period == gait.period


def test_the_error_between_nodes_grows_with_a_perturbation(gait, transcription):
    values = gait.motion.parameters
    x = unknowns(gait, transcription)
    assert check_between_nodes(transcription, values, x).drift == gait.solver.error_between_nodes < 2e-7
    x[transcription.variables["rates"][0, 30]] += 1e-3
    assert check_between_nodes(transcription, values, x).drift > 0.9e-3


def test_a_plan_is_followed_through_all_its_phases(gait, transcription):
    # Only the node that slide and stance share is off: the path goes by it and on to the other nodes of the stance.
    x, shared = unknowns(gait, transcription), transcription.phases[1].first
    x[transcription.variables["rates"][0, shared]] += 1e-3
    assert check_between_nodes(transcription, gait.motion.parameters, x).drift == pytest.approx(1e-3, rel=1e-4)


def test_a_coarse_plan_is_refined_until_it_holds_between_nodes(reference_problem):
    coarse = {tolerance: solve(_coarse(reference_problem, tolerance)) for tolerance in (np.inf, 1e-8)}
    assert all(gait.status is Status.SOLVED for gait in coarse.values())
    assert coarse[np.inf].problem["transcription"] == "multiple shooting, 1 substep"
    assert coarse[np.inf].solver.error_between_nodes > 1e-8
    assert int(coarse[1e-8].problem["transcription"].split()[2]) > 1
    assert coarse[1e-8].solver.error_between_nodes <= 1e-8


def _coarse(reference_problem, tolerance):
    return reference_problem(
        objective="torque_squared", transcription=MultipleShooting(intervals=10, tolerance=tolerance)
    )
