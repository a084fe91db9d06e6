"""Fronts and robust gaits at full size: ``pytest tests/benchmarks --benchmark-only -s``.

Targets: a front of 20 points takes at most the time of 25 cold solves on two processors, no point is dominated, and
both ends lead to the same front within 1e-5; one gait and one law survive 100 of 100 unseen frictions from 0.10 to 0.20
and 95 of 100 pushes of up to 0.15 rad/s, which the nominal optimum does not; 20 speeds with one shared design take at
most 3 times the processor time of 20 single solves with fixed parameters.
"""

import statistics
import time

import numpy as np

from gaitopt import Family, GaitProblem, Limits, Pareto, Scenarios, StabilityBound, compass_biped, solve
from gaitopt.design import check_scenarios, solve_scenarios

PROCESSORS, COLD_SOLVES = 2, 25


def slipping():
    return GaitProblem(
        robot=compass_biped(),
        sequence="slip+ stick | slip+",
        friction=0.14,
        speed=0.633,
        step_length=0.4713,
        limits=Limits(torque=6),
    )


def test_front_of_20_points(benchmark):
    solve(slipping())
    cold = []
    for _ in range(3):
        began = time.process_time()
        solve(slipping())
        cold.append(time.process_time() - began)
    began = time.process_time()
    front = benchmark.pedantic(lambda: Pareto(points=20).trace(slipping()), rounds=1, iterations=1)
    ratio = (time.process_time() - began) / statistics.median(cold)
    difference = np.abs(front.forward_cost.values / front.backward_cost.values - 1).max()
    print(f"\nprocessor time of {ratio:.1f} cold solves; the ends agree within {difference:.0e}")
    benchmark.extra_info.update(cold_solves=ratio, difference=difference)
    assert (front.front == 1).all()
    assert (front.verified == 1).all()
    assert difference < 1e-5
    assert ratio < PROCESSORS * COLD_SOLVES  # the two chains are independent


def test_front_of_20_spectral_radii(benchmark):
    lower, upper = 0.58, 0.624
    problem, cold = slipping(), []
    solve(problem)
    for radius in (lower, (lower + upper) / 2, upper):
        began = time.process_time()
        solve(problem.replace(stability=StabilityBound(radius=radius)))
        cold.append(time.process_time() - began)
    trade_off = Pareto(objectives=("cost", "spectral_radius"), bounds={"spectral_radius": (lower, upper)}, points=20)
    began = time.process_time()
    front = benchmark.pedantic(lambda: trade_off.trace(problem), rounds=1, iterations=1)
    ratio = (time.process_time() - began) / statistics.median(cold)
    difference = np.abs(front.forward_cost.values / front.backward_cost.values - 1).max()
    benchmark.extra_info.update(cold_solves=ratio, difference=difference)
    assert (front.front == 1).all()
    assert (front.verified == 1).all()
    assert difference < 1e-5
    assert ratio < PROCESSORS * COLD_SOLVES


def test_robust_gait(benchmark):
    problem = slipping().replace(sequence="stick | stick", friction=0.15, speed=0.6, step_length=0.45)
    scenarios = Scenarios(ranges={"friction": (0.1, 0.2)}, push=0.15)
    plan = benchmark.pedantic(lambda: solve_scenarios(problem, scenarios), rounds=1, iterations=1)
    robust = check_scenarios(plan.gait, plan.law, scenarios, count=100)
    nominal = check_scenarios(plan.nominal, plan.nominal_law, scenarios, count=100)
    print(
        f"\nadditional cost {plan.additional_cost:.3f}; survived {robust.survived} and {robust.recovered}, "
        f"nominal {nominal.survived}"
    )
    benchmark.extra_info.update(
        additional_cost=plan.additional_cost, survived=robust.survived, recovered=robust.recovered
    )
    assert robust.survived == 100
    assert robust.recovered >= 95
    assert nominal.survived < 95
    assert nominal.recovered < 95


def test_family_of_20_speeds(benchmark):
    free = {"leg_com": (0.4, 1.2), "hip_mass": (1.0, 3.0)}
    problem = slipping().replace(objective="torque_squared", free=free)
    problems = [problem.replace(speed=speed) for speed in np.linspace(0.55, 0.7, 20).tolist()]
    fixed = {name: problem.values[name] for name in free}
    solve(problem.fix_parameters(fixed))
    began = time.process_time()
    for one in problems:
        assert solve(one.fix_parameters(fixed)).status.ok
    singles, began = time.process_time() - began, time.process_time()
    result = benchmark.pedantic(lambda: Family(problems).solve(), rounds=1, iterations=1)
    ratio = (time.process_time() - began) / singles
    print(f"\nprocessor time of {ratio:.2f} times 20 single solves; design {result.design}")
    benchmark.extra_info.update(ratio=ratio)
    assert result.status.ok
    assert ratio < 3
