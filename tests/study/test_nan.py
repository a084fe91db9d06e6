"""Studies rank a gait whose cost is nan last, and a step that ends in nan does not repeat."""

import math
from dataclasses import replace

import numpy as np
import pytest

from gaitopt import InputError, Status, compare, find_cycles, load_sweep_gait, sweep
from gaitopt.study import imitate, multistart
from gaitopt.study.comparison import Comparison
from gaitopt.study.gait_metrics import shortest_phase
from gaitopt.study.multistart import best, objective, solve_coarse


def costing(gait, cost, violation=0.0):
    return replace(gait, solver=replace(gait.solver, objective=cost, constraint_violation=violation))


def test_a_gait_whose_cost_is_nan_is_the_costliest(slip_gait):
    gaits = [costing(slip_gait, cost) for cost in (math.nan, 2.0, 1.0, math.nan)]
    assert objective(gaits[0]) == math.inf
    assert best(gaits) is gaits[2]


def test_a_failure_whose_violation_is_nan_is_not_the_nearest(infeasible):
    gaits = [costing(infeasible, 1.0, size) for size in (math.nan, 1.0, 2.0)]
    assert best(gaits) is gaits[1]


def test_a_start_that_ends_in_nan_has_led_nowhere(problem, infeasible, monkeypatch):
    tried = []
    monkeypatch.setattr(multistart, "solve_start", lambda *_: tried.append(0) or costing(infeasible, 1.0, math.nan))
    solve_coarse(problem, [infeasible] * 5)
    assert len(tried) == 2


def test_a_multiplier_that_is_nan_is_the_largest(slip_gait):
    found = Comparison({"a": slip_gait}, {"a": (0.5 + 0j, complex(math.nan, 0))})
    assert found.records()[0]["largest_multiplier"] == "inf"
    assert compare([slip_gait]).records()


def test_a_phase_whose_duration_is_nan_is_not_forgotten(not_a_number):
    assert math.isnan(shortest_phase(not_a_number))


def test_no_step_repeats_within_nan(compass):
    downhill = {"slope": math.radians(1), "friction": 0.3}
    gait = find_cycles(compass, downhill, sequence="stick | stick", starts=30)[0]
    assert imitate(compass, gait, {"slope": 0.0}).feasible
    assert not imitate(compass, gait, {"slope": 0.0}, tolerance=math.nan).feasible


def test_a_place_in_a_sweep_that_is_nan_is_refused(problem, tmp_path):
    sweep(problem, friction=[0.19], starts=1, path=tmp_path / "found.nc")
    assert load_sweep_gait(tmp_path / "found.nc", "stick | stick", friction=0.19).status is Status.SOLVED
    with pytest.raises(InputError, match="friction must be a finite number, got nan"):
        load_sweep_gait(tmp_path / "found.nc", "stick | stick", friction=np.nan)
