"""The same optimiser without hand-tuning: other words, frictions, masses, speeds, targets and slopes."""

import math
import time

import numpy as np
import pytest

from gaitopt import Status, solve

STICK, SLIP = "stick | stick", "slip+ stick | slip+"


def survives(gait):
    assert gait.status is Status.SOLVED, gait.solver.violations
    assert gait.verification.passed, gait.verification.reasons
    assert gait.verification.sequence == str(gait.sequence)
    assert gait.verification.state_error < 1e-6
    return True


@pytest.mark.parametrize("friction", [0.1, 0.2])
@pytest.mark.parametrize("sequence", [STICK, SLIP])
def test_other_frictions(solved, sequence, friction):
    assert survives(solved(sequence=sequence, friction=friction))


def test_less_friction_costs_more(solved):
    for sequence in (STICK, SLIP):
        costs = [solved(sequence=sequence, friction=friction).cost_of_transport for friction in (0.1, 0.14, 0.2)]
        assert costs[0] > costs[1] > costs[2]


@pytest.mark.slow
@pytest.mark.parametrize("sequence", ["slip+ stick slip- | slip+", "stick slip- | stick"])
def test_a_slip_that_begins_inside_the_step(solved, sequence):
    gait = solved(sequence=sequence, friction=0.12)
    assert survives(gait)
    motion = gait.motion
    stick, slide = motion.segments[-2:]
    # Onset: the sticking force is exactly on the cone, the foot starts from rest and moves backward only.
    assert stick.force[0, -1] / stick.force[1, -1] == pytest.approx(0.12, abs=1e-7)
    assert slide.v[0, 0] == 0
    assert np.all(slide.v[0, 1:] < 0)
    assert slide.slide < 0


@pytest.mark.parametrize("sequence", [STICK, SLIP])
def test_all_masses_and_torques_scaled_alike_change_nothing(solved, sequence):
    heavy = solved(sequence=sequence, masses=(8.0, 4.0), torque=12.0)
    assert survives(heavy)
    assert heavy.cost_of_transport == pytest.approx(solved(sequence=sequence).cost_of_transport, rel=1e-6)


@pytest.mark.parametrize("sequence", [STICK, SLIP])
def test_other_masses(solved, sequence):
    gait = solved(sequence=sequence, masses=(3.0, 6.0), torque=10.0)
    assert survives(gait)
    assert gait.motion.total_mass == 12.0


@pytest.mark.parametrize(("sequence", "speed"), [(STICK, 0.5), (SLIP, 0.7)])
def test_other_speeds(solved, sequence, speed):
    gait = solved(sequence=sequence, speed=speed)
    assert survives(gait)
    assert gait.speed == pytest.approx(speed, abs=1e-7)


def test_bounded_targets_are_no_dearer_than_a_point_inside_them(solved):
    free = solved(sequence=STICK, speed=(0.55, 0.7), step_length=(0.35, 0.6))
    assert survives(free)
    assert 0.55 - 1e-7 <= free.speed <= 0.7 + 1e-7
    assert 0.35 - 1e-7 <= free.step_length <= 0.6 + 1e-7
    assert free.cost_of_transport < solved(sequence=STICK).cost_of_transport


def test_downhill_the_slope_pays(solved):
    gait = solved(sequence=STICK, slope=math.radians(1), friction=0.3)
    assert survives(gait)
    assert gait.energy.gravity == pytest.approx(10 * 9.8 * 0.4713 * math.sin(math.radians(1)), rel=1e-6)
    assert gait.cost_of_transport < 0.5 * solved(sequence=STICK).cost_of_transport


def test_a_duration_on_its_bound_is_a_warning(solved):
    gait = solved(sequence=SLIP, friction=0.25)
    assert survives(gait)
    assert gait.motion.segments[0].duration == pytest.approx(5e-3, rel=1e-2)
    assert len(gait.solver.warnings) == 1
    assert gait.solver.warnings[0].startswith("phase 1 (slip+) lasts 0.005 s, the minimum")
    assert solved(sequence=SLIP).solver.warnings == ()


@pytest.mark.parametrize(
    "impossible",
    [
        {"torque": 0.1},
        {"speed": 1.5, "sequence": SLIP},
        {"friction": 0.01},
    ],
)
def test_where_there_is_no_gait_the_status_names_constraints(solved, impossible):
    gait = solved(**{"sequence": STICK, "intervals": 10, **impossible})
    assert not gait.status.ok
    assert gait.status in (Status.INFEASIBLE, Status.ITERATION_LIMIT)
    assert gait.verification is None
    violations = gait.solver.violations
    assert violations
    assert violations[0].size == gait.solver.constraint_violation > 1e-4
    assert [v.size for v in violations] == sorted((v.size for v in violations), reverse=True)
    for violation in violations:
        assert violation.place.startswith(("phase 1 (", "phase 2 (", "touchdown", "step"))
        assert violation.name


def test_a_failure_states_the_iterations_and_the_time_of_the_whole_solve(reference_problem):
    numbers, began = [], time.perf_counter()
    problem = reference_problem(friction=0.01, intervals=10)
    gait = solve(problem, starts=1, observer=lambda step: numbers.append(step.number))
    seconds = time.perf_counter() - began
    assert not gait.status.ok
    assert gait.solver.iterations == sum(number > 0 for number in numbers)
    assert gait.solver.build_seconds + gait.solver.solve_seconds > 0.6 * seconds


def test_the_same_problem_gives_the_same_gait(reference_problem):
    one, other = (solve(reference_problem(intervals=10)) for _ in range(2))
    for name, table in one.solution.unknowns.items():
        assert np.array_equal(table.values, other.solution.unknowns[name].values), name
