"""Further options of a problem: idle actuators, torque rates, a free slope, regeneration, other transcriptions."""

import math

import numpy as np
import pytest

from gaitopt import (
    Collocation,
    InputError,
    Limits,
    MultipleShooting,
    PositiveWork,
    Status,
    TorqueSquared,
    compass_biped,
    positive_work,
    solve,
)

SLIP = "slip+ stick | slip+"
SMOOTH = {"sequence": "stick | stick", "objective": TorqueSquared()}


def survives(gait):
    assert gait.status is Status.SOLVED, gait.solver.violations
    assert gait.verification.passed, gait.verification.reasons
    return gait


@pytest.mark.parametrize("idle", ["ankle", "hip"])
def test_an_idle_actuator_does_nothing_and_the_other_walks_alone(solved, idle):
    # One motor alone needs a downhill slope or more torque than 6 N m to walk this speed.
    limits = {"ankle": 30.0, "hip": 30.0} | {idle: 0}
    gait = survives(solved(sequence="stick | stick", friction=0.5, limits=Frozen(limits)))
    row = compass_biped().actuators.index(idle)
    assert not np.any(gait.motion.channel("torque")[row])
    assert np.any(gait.motion.channel("torque")[1 - row])
    assert gait.cost_of_transport > solved(sequence="stick | stick", friction=0.5).cost_of_transport
    assert not any(idle in name for name in gait.solution.unknowns["power"].rows)


class Frozen(Limits):
    """Limits with a mapping, hashable by identity, for the cache of solved gaits."""

    def __init__(self, torque):
        super().__init__(torque=torque)

    __hash__ = object.__hash__


def test_torque_rates_are_kept_and_cost_something(solved):
    free = solved(**SMOOTH, intervals=20)
    rate = 0.7 * _steepest(free)
    gait = survives(solved(**SMOOTH, intervals=20, limits=Limits(torque=6, torque_rate=rate)))
    assert _steepest(gait) == pytest.approx(rate, rel=1e-6)
    assert gait.solver.objective > free.solver.objective


def _steepest(gait):
    segment = gait.motion.segments[0]
    return float(np.max(np.abs(np.diff(segment.torque, axis=1) / np.diff(segment.time))))


def test_a_torque_rate_that_cannot_be():
    with pytest.raises(InputError, match=r"Limits\.torque_rate of hip must be greater than 0"):
        Limits(torque_rate={"hip": 0}).torque_rates(("ankle", "hip"))


def test_a_free_slope_goes_where_walking_is_cheapest(solved):
    """Down a steeper slope less work is needed, up to the slope at which a passive gait of this speed walks."""
    gait = survives(solved(**SMOOTH, slope=(0.0, 0.005), intervals=20))
    assert gait.motion.parameters["slope"] == pytest.approx(0.005, abs=1e-7)
    assert gait.problem["slope"] == [0.0, 0.005]
    given = survives(solved(**SMOOTH, slope=0.005, intervals=20))
    assert gait.solver.objective == pytest.approx(given.solver.objective, rel=1e-5)


def test_a_free_slope_finds_the_passive_gait(solved):
    # Gait A of Gamus & Or (2015) walks down 1 deg without torque at 0.633025 m/s with steps of 0.471357 m.
    gait = solved(
        **SMOOTH, slope=(0.0, 0.05), speed=0.471356685 / 0.744620868, step_length=0.471356685, friction=math.inf
    )
    assert gait.motion.parameters["slope"] == pytest.approx(math.radians(1), abs=1e-6)
    assert gait.solver.objective < 1e-6


@pytest.mark.parametrize("slope", [(0.1, 0.0), (0.0,), (0.0, math.nan), (0.0, 3.0), "steep"])
def test_a_slope_that_cannot_be(reference_problem, slope):
    with pytest.raises(InputError, match="slope"):
        reference_problem(slope=slope)


def test_regeneration_makes_braking_pay(solved):
    costs, negative = [], []
    for share in (0.0, 0.6):
        gait = survives(solved(sequence="stick | stick", objective=PositiveWork(regeneration=share), intervals=20))
        costs.append(gait.solver.objective)
        forward = positive_work(gait.motion)
        absolute = gait.cost_of_transport * gait.motion.total_mass * 9.8 * gait.step_length
        negative.append(absolute - forward)
        by_hand = (forward - share * negative[-1]) / (gait.motion.total_mass * 9.8 * gait.step_length)
        assert gait.solver.objective == pytest.approx(by_hand, rel=5e-3)
    assert costs[1] < costs[0]


@pytest.mark.slow
@pytest.mark.parametrize("sequence", ["stick | stick", SLIP])
def test_both_transcriptions_find_the_same_optimum(solved, sequence):
    own = solved(sequence=sequence)
    other = survives(solved(sequence=sequence, transcription=MultipleShooting()))
    assert other.cost_of_transport == pytest.approx(own.cost_of_transport, rel=1e-3)
    smooth = [
        survives(
            solved(sequence=sequence, objective=TorqueSquared(), transcription=kind(intervals=20))
        ).solver.objective
        for kind in (Collocation, MultipleShooting)
    ]
    assert smooth[0] == pytest.approx(smooth[1], rel=1e-5)


def test_free_speed_and_step_find_the_cheapest(reference_problem):
    bounded = solve(reference_problem(sequence="stick | stick", speed=(0.5, 0.7), step_length=(0.4, 0.6), intervals=20))
    fixed = solve(reference_problem(sequence="stick | stick", intervals=20))
    assert bounded.status is fixed.status is Status.SOLVED
    assert bounded.solver.objective < fixed.solver.objective
    assert 0.5 - 1e-7 <= bounded.speed <= 0.7 + 1e-7
    assert 0.4 - 1e-7 <= bounded.step_length <= 0.6 + 1e-7
