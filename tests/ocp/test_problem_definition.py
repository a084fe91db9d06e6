"""The problem of a failed solve is restored from the file of its gait."""

import pytest

from gaitopt import (
    Collocation,
    CostOfTransport,
    GaitProblem,
    InputError,
    Keyframes,
    Limits,
    MultipleShooting,
    RandomPerturbation,
    Status,
    WarmStart,
    compass_biped,
    load,
    save,
    solve,
)
from gaitopt.model.robots.monopod import monopod
from gaitopt.ocp import (
    FromPlanarGait,
    Guess,
    PlanarKeyframes,
    PlanarLimits,
    PlanarProblem,
    StabilityBound,
    Tracking,
    restore_problem,
)
from gaitopt.ocp.problem_definition import record_definition

BASE = GaitProblem(
    robot=compass_biped(),
    sequence="stick | stick",
    friction=0.02,
    speed=(0.5, 0.6),
    step_length=0.45,
    parameters={"leg_com": 0.7},
    limits=Limits(torque={"ankle": 6, "hip": 5}, angle={"th1": (-1, 1)}),
    transcription=Collocation(intervals=8),
)
CHANGES = {
    "plain": {},
    "free parameters and stability": {"free": {"leg_com": (0.6, 0.8)}, "stability": StabilityBound(radius=0.9)},
    "keyframes": {"guess": Keyframes((0, 1), {"th1": (-0.15, 0.15), "th2": (-0.2, 0.2)}), "slope": (0.0, 0.1)},
    "shooting": {"transcription": MultipleShooting(intervals=(8,)), "guess": RandomPerturbation(seed=3)},
}


def stored(problem, failed):
    return restore_problem(record_definition(failed, problem))


@pytest.fixture(scope="module")
def failed(slip_gait):
    """A gait whose status is not that of a solution."""
    return slip_gait.replace_fields(status=Status.FAILED, robot=BASE.robot)


@pytest.mark.parametrize("changes", CHANGES.values(), ids=CHANGES)
def test_every_field_is_restored(failed, changes):
    problem = BASE.replace(**changes)
    restored = stored(problem, failed)
    assert restored.describe() == problem.describe()
    assert (restored.transcription, restored.stability) == (problem.transcription, problem.stability)
    assert type(restored.guess) is type(problem.guess)


def test_a_guess_and_a_tracked_motion_are_restored_as_motions(failed, slip_gait):
    objective = 0.5 * CostOfTransport() + 2.0 * Tracking(slip_gait.motion, rate_weight=0.02)
    restored = stored(BASE.replace(objective=objective, guess=WarmStart(slip_gait)), failed)
    assert restored.objective.name == objective.name
    weight, tracking = restored.objective.terms()[1]
    assert (weight, tracking.rate_weight) == (2.0, 0.02)
    assert tracking.evaluate(slip_gait.motion) < 1e-6  # rad^2 s
    assert restored.guess.describe() == "a gait that was solved before"
    assert [segment.mode for segment in restored.guess.motion.segments] == list(slip_gait.sequence.phases)


def test_the_result_of_a_failed_solve_has_the_definition(tmp_path):
    gait = solve(BASE.replace(objective="torque_squared"))
    assert gait.status is Status.INFEASIBLE
    restored = restore_problem(load(save(gait, tmp_path / "failed.h5")))
    assert solve(restored).solver.conflicts == gait.solver.conflicts


def test_planar_problems_are_restored(planar_failure):
    problem, gait = planar_failure
    restored = restore_problem(gait)
    assert restored.describe() == problem.describe()
    keyframes = PlanarKeyframes((0, 0.2, 0.4), dict.fromkeys(problem.robot.coordinates, (0.0, 0.1, 0.0)))
    assert stored(problem.replace(guess=keyframes), gait).guess.describe() == keyframes.describe()
    guess = stored(problem.replace(guess=FromPlanarGait(gait)), gait).guess
    assert len(guess.phases) == 2


@pytest.fixture(scope="module")
def planar_failure():
    from gaitopt.ocp import Ipopt

    problem = PlanarProblem(
        robot=monopod(),
        sequence="foot stick > flight |",
        friction=1.0,
        speed=1.5,
        step_length=0.6,
        objective="torque_squared",
        limits=PlanarLimits(torque=0.1),
        transcription=Collocation(intervals=(6, 6)),
    )
    return problem, solve(problem, solver=Ipopt(max_iterations=5))


class Custom(Guess):
    """A guess of a user's script."""

    def durations(self, setting):
        raise NotImplementedError

    def sample(self, setting, time):
        raise NotImplementedError

    def describe(self):
        return "custom"


def test_custom_parts_and_solved_gaits_are_rejected(failed, slip_gait):
    with pytest.raises(InputError, match="the code of Custom is not in the file"):
        stored(BASE.replace(guess=Custom()), failed)
    with pytest.raises(InputError, match="has no definition of its problem, which only failed solves contain"):
        restore_problem(slip_gait)
