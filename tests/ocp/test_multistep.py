"""Gaits of several steps: start from rest, a slippery patch, period two, each verified by replay."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gaitopt import GaitProblem, InputError, Limits, Status, WarmStart, compass_biped, solve
from gaitopt.cli.file_check import examine_file
from gaitopt.ocp import MultiStepProblem, TorqueSquared, load_steps, save_steps, solve_steps, state_after_touchdown
from gaitopt.ocp.multistep.multistep_solver import _gait
from gaitopt.simulation import Tolerances, verify_steps

REST = {"th1_rate": 0.0, "th2_rate": 0.0}


def step(**changes):
    return GaitProblem(
        robot=compass_biped(),
        sequence="stick | stick",
        friction=0.2,
        speed=0.6,
        step_length=0.45,
        limits=Limits(torque=10),
        objective="torque_squared",
    ).replace(**changes)


@pytest.fixture(scope="module")
def periodic():
    return solve(step())


@pytest.fixture(scope="module")
def free(periodic):
    """Return a step whose speed and length are free, started from the periodic gait."""
    return step(speed=None, step_length=None, guess=WarmStart(periodic), limits=Limits(torque=20, longest_step=3))


def check_replay(gait, tolerance=1e-6):
    verified = verify_steps(gait)
    assert verified.status.ok, verified.verification.reasons
    assert verified.verification.state_error < tolerance
    return verified


def test_two_equal_steps_are_the_periodic_gait_twice(periodic):
    gait = check_replay(solve_steps(MultiStepProblem(steps=(step(), step()))))
    assert gait.objective == pytest.approx(2 * periodic.solver.objective, rel=1e-6)


def test_the_energy_balance_of_the_replay_is_checked():
    gait = solve_steps(MultiStepProblem(steps=(step(),)))
    verification = verify_steps(gait, tolerances=Tolerances(state=1e-5, energy=0.0)).verification
    assert not verification.passed
    assert "energy ledger" in verification.reasons[0]


def test_a_gait_of_period_two_has_steps_of_different_lengths():
    gait = check_replay(solve_steps(MultiStepProblem(steps=(step(), step(step_length=0.5)))))
    assert [plan.travel for plan in gait.plans] == pytest.approx([0.45, 0.5], abs=1e-6)
    after = gait.motion.jumps[1]
    first = gait.motion.segments[0]
    assert after.q_next[2:] == pytest.approx(first.q[2:, 0], abs=1e-8)
    assert after.v_next == pytest.approx(first.v[:, 0], abs=1e-8)
    assert np.abs(gait.motion.jumps[0].v_next - after.v_next).max() > 1e-2


def test_a_gait_is_read_from_its_file_and_replayed(periodic, tmp_path):
    state, steps = state_after_touchdown(periodic), (step(friction=0.25), step(limits=Limits(torque=20, rate=5)))
    gait = solve_steps(MultiStepProblem(steps=steps, start=state, end={}, footholds={1: (0.4, 0.5)}, name="two"))
    loaded = check_replay(load_steps(save_steps(gait, tmp_path / "two.h5")))
    assert examine_file(tmp_path / "two.h5")["content"] == "2 steps"
    assert loaded.sequences == gait.sequences
    assert loaded.objective == gait.objective
    assert loaded.problem.start == state
    assert loaded.problem.footholds == {1: (0.4, 0.5)}
    for restored, stated in zip(loaded.problem.steps, steps, strict=True):
        assert restored.describe() == stated.describe()
    with pytest.raises(InputError, match="objectives by name"):
        save_steps(
            gait.replace_fields(problem=gait.problem.replace(steps=(step(objective=2 * TorqueSquared()),) * 2)), "x.h5"
        )


def test_three_steps_lead_from_rest_to_the_periodic_gait(periodic, free):
    end = state_after_touchdown(periodic)
    gait = check_replay(solve_steps(MultiStepProblem(steps=(free,) * 3, start=REST, end=end)))
    first, last = gait.plans[0].segments[0], gait.plans[-1].jumps[0]
    assert np.abs(first.v[:, 0]).max() < 1e-9
    assert last.q_next[2:] == pytest.approx(periodic.motion.jumps[0].q_next[2:], abs=1e-6)
    assert last.v_next == pytest.approx(periodic.motion.jumps[0].v_next, abs=1e-6)


@pytest.mark.parametrize("sequence", ["stick | stick", "slip+ stick | slip+"])
def test_a_patch_of_friction_008_in_a_floor_of_02_is_crossed(periodic, free, sequence):
    state = state_after_touchdown(periodic)
    patch = free.replace(friction=0.08, sequence=sequence)
    problem = MultiStepProblem(
        steps=(free, free, patch, free, free), start=state, end=state, footholds={2: (0.75, 0.8), 3: (1.1, 1.3)}
    )
    gait = check_replay(solve_steps(problem))
    places = np.cumsum([plan.travel for plan in gait.plans])
    assert 0.75 - 1e-7 <= places[1] <= 0.8 + 1e-7
    assert 1.1 - 1e-7 <= places[2] <= 1.3 + 1e-7
    on_patch = [segment for segment in gait.plans[2].segments if not segment.mode.slips]
    demand = max(np.abs(segment.force[0] / segment.force[1]).max() for segment in on_patch)
    assert demand <= 0.08
    impact = gait.plans[1].jumps[0]
    assert abs(impact.impulse[0] / impact.impulse[1]) <= 0.08 * (1 + 1e-9)
    assert gait.motion.segments[-1].q[0, 0] == pytest.approx(places[3], abs=1e-3)


def test_the_same_steps_fail_on_a_floor_whose_patch_was_not_planned(periodic, free):
    """The replay, too, uses the ground of each step: without the patch in the plan, the foot slips there."""
    state = state_after_touchdown(periodic)
    planned = solve_steps(MultiStepProblem(steps=(free,) * 3, start=state, end=state))
    slippery = planned.problem.replace(steps=(free, free.replace(friction=0.08), free))
    verification = verify_steps(planned.replace_fields(problem=slippery)).verification
    assert not verification.passed
    assert "slip" in verification.sequence


def test_rest_directly_after_a_touchdown_is_infeasible(periodic, free):
    """The trailing foot must leave the ground: rest in double support is not part of the model."""
    start = state_after_touchdown(periodic)
    gait = solve_steps(MultiStepProblem(steps=(free, free), start=start, end=REST))
    assert not gait.status.ok
    assert gait.constraint_violation > 1e-4


@pytest.mark.parametrize(
    ("fields", "message"),
    [
        ({"steps": ()}, "at least one"),
        ({"start": REST}, "both be stated"),
        ({"start": {"th3": 0.0}, "end": {}}, "no coordinate 'th3'"),
        ({"start": {"th1": float("nan")}, "end": {}}, "finite"),
        ({"start": {"foot_speed": 0.1}, "end": {}}, "must be 0"),
        ({"footholds": {0: (0, 1)}}, "counted from 0"),
        ({"footholds": {1: (2, 1)}}, "lower, upper"),
        ({"footholds": {1: (math.inf, math.inf)}}, "lower < inf and upper > -inf"),
        ({"footholds": {1: (-math.inf, -math.inf)}}, "lower < inf and upper > -inf"),
        ({"expected_places": {1: math.nan}}, "must be finite, got nan"),
    ],
)
def test_invalid_problems_are_refused(fields, message):
    with pytest.raises(InputError, match=message):
        MultiStepProblem(**{"steps": (step(), step()), **fields})


def test_steps_of_different_robots_are_refused():
    with pytest.raises(InputError, match=r"differs from steps\[0\] in its robot or in the parameters"):
        MultiStepProblem(steps=(step(), step(parameters={"hip_mass": 3.0})))
    with pytest.raises(InputError, match=r"free parameters \['leg_com'\]"):
        MultiStepProblem(steps=(step(free={"leg_com": (0.3, 0.7)}),) * 2)
    with pytest.raises(InputError, match="MultiStepProblem"):
        solve_steps(step())


@pytest.mark.parametrize(
    ("finer_error", "finer_status", "status"),
    [
        (1e-3, Status.SOLVED, Status.SOLVED),
        (1e-9, Status.FAILED, Status.SOLVED),
        (1e-9, Status.INTERRUPTED, Status.INTERRUPTED),
        (1e-9, Status.TIME_LIMIT, Status.TIME_LIMIT),
    ],
)
def test_a_finer_grid_that_is_less_accurate_or_fails_leaves_the_coarser_solution(
    monkeypatch, finer_error, finer_status, status
):
    results = iter([(1e-6, Status.SOLVED), (finer_error, finer_status)])
    made = []

    def make_gait(*arguments):
        error, reached = next(results)
        made.append(replace(_gait(*arguments), error_between_nodes=error, status=reached))
        return made[-1]

    monkeypatch.setattr("gaitopt.ocp.multistep.multistep_solver._gait", make_gait)
    gait = solve_steps(MultiStepProblem(steps=(step(),)))
    assert len(made) == 2
    assert (gait.status, gait.error_between_nodes) == (status, 1e-6)
    assert gait.plans is made[0].plans
    assert gait.iterations == made[1].iterations
