"""Summaries: plain data that any JSON reader takes."""

import dataclasses
import json
import math

import numpy as np
import pytest

from gaitopt import InputError, Status, load
from gaitopt.motion import Conflict, Violation, summarise
from gaitopt.motion.energy import Ledger
from gaitopt.motion.gait_table import describe_energy, tabulate_gait
from gaitopt.motion.solve_table import NOT_YET_VERIFIED
from gaitopt.motion.summary import plain


def test_plain_data_has_no_number_json_cannot_carry():
    data = {"a": math.nan, "b": (math.inf, -math.inf), "c": np.float64(2.5), "d": [np.int64(3), "nan", True, None]}
    assert plain(data) == {"a": None, "b": ["inf", "-inf"], "c": 2.5, "d": [3, "nan", True, None]}
    assert type(plain(np.float64(1.0))) is float


def test_summary_survives_a_strict_json_reader(slip_gait):
    def refuse(constant):
        raise ValueError(constant)

    bad = dataclasses.replace(
        slip_gait,
        solver=dataclasses.replace(
            slip_gait.solver, objective=math.nan, violations=(Violation("here", "this", math.inf),)
        ),
    )
    summary = json.loads(json.dumps(summarise(bad)), parse_constant=refuse)
    assert summary["solver"]["objective"] is None
    assert summary["violations"] == [{"place": "here", "name": "this", "size": "inf"}]


def test_objective_and_energy_of_a_gait_on_level_ground(slip_gait):
    assert slip_gait.objective == slip_gait.solver.objective
    assert math.copysign(1.0, slip_gait.energy.gravity) == 1.0  # not -0.0


def test_conflicting_limits_are_shown(slip_gait):
    torque = Conflict(
        name="torque limit of hip",
        setting="Limits.torque",
        limit=6.0,
        missing=2.0,
        sufficient=8.04,
        unit="N m",
        separable=True,
    )
    condition = dataclasses.replace(torque, name="normal force", setting="sequence", sufficient=math.nan, unit="1")
    gait = slip_gait.with_failure(Status.INFEASIBLE, "no gait found", (torque, condition), seconds=2.0)
    assert gait.solver.solve_seconds == slip_gait.solver.solve_seconds + 2
    assert (gait.status, gait.solver.message) == (Status.INFEASIBLE, "no gait found")
    shown = [text for name, text in tabulate_gait(gait) if name == "conflict"]
    assert [text for name, text in tabulate_gait(gait) if name == "note"] == [NOT_YET_VERIFIED]
    assert shown == [
        "torque limit of hip (Limits.torque) is 6 N m: 8.04 N m alone would suffice",
        "normal force (sequence) is violated by 2",
    ]
    first, second = summarise(gait)["conflicts"]
    assert (first["name"], first["sufficient"], second["sufficient"]) == ("torque limit of hip", 8.04, None)
    with pytest.raises(InputError, match=r"\(infeasible\).* 8\.04 N m alone would suffice"):
        gait.require()


def test_summary_states_the_facts_of_the_gait(slip_gait):
    summary = summarise(slip_gait)
    segments = slip_gait.motion.segments
    assert summary["sequence"] == "slip+ stick | slip+"
    assert summary["period"] == pytest.approx(sum(phase["duration"] for phase in summary["phases"]), rel=1e-12)
    assert summary["foot_slide"] == pytest.approx(segments[0].q[0, -1] - segments[0].q[0, 0], rel=1e-12)
    assert summary["impact"]["ratio"] == pytest.approx(-0.14, rel=1e-6)  # a slip+ impact lies on the cone
    energy = summary["energy"]
    assert energy["actuator"] == pytest.approx(energy["impact_loss"] + energy["friction_loss"], rel=1e-5)


def test_dampers_and_springs_are_shown_where_there_are_any(slip_gait, damped):
    lost, stored = 0.25 * damped.period, 0.5 * damped.period
    energy = summarise(damped)["energy"]
    assert (energy["damping_loss"], energy["elastic_change"]) == pytest.approx((lost, stored))
    shown = dict(tabulate_gait(damped))["energy"]
    assert f"J + dampers {lost:.6f} J + elastic change {stored:.6f} J, balance error" in shown
    energy = summarise(slip_gait)["energy"]
    assert (energy["damping_loss"], energy["elastic_change"]) == (0, 0)
    shown = dict(tabulate_gait(slip_gait))["energy"]
    assert "dampers" not in shown
    assert "elastic" not in shown


def test_the_status_of_an_inaccurate_plan_does_not_contradict_its_replay(slip_gait):
    """The replay of a plan of error 2.5e-7 passes; the tolerance with which such a plan is accepted is stated."""
    solver = dataclasses.replace(slip_gait.solver, error_between_nodes=2.5e-7)
    gait = slip_gait.replace_fields(status=Status.PLAN_INACCURATE, solver=solver)
    assert gait.verification.passed
    text = dict(tabulate_gait(gait))["status"]
    assert "the replay follows the plan, but its error between nodes, 2.5e-07, exceeds the tolerance, 1.0e-07" in text
    assert "tolerance=1e-06" in text
    exact = dataclasses.replace(solver, error_between_nodes=1e-9)
    assert "see the warnings" in dict(tabulate_gait(gait.replace_fields(solver=exact)))["status"]
    unknown = dict(tabulate_gait(gait.replace_fields(verification=None)))["status"]
    assert unknown == f"plan_inaccurate: {Status.PLAN_INACCURATE.hint}"
    assert "would not follow" not in unknown


def test_an_energy_that_is_rounded_to_zero_has_no_sign():
    energy = Ledger(actuator=1.0, gravity=-1e-9, impact_loss=1.0, friction_loss=-1e-9, kinetic_change=0.0)
    assert "-0.0" not in describe_energy(energy)


def test_the_impulse_of_an_impact_its_mode_and_its_ratio_are_in_the_row_of_the_event():
    facts = tabulate_gait(load("docs/examples/heel_toe.h5"))
    events = [text for name, text in facts if name == "event"]
    assert events[1].endswith("impulse heel b (-0.909, 4.885) N s; heel b stick, impulse ratio -0.1861")
    assert "impact" not in {name for name, _ in facts}


@pytest.mark.parametrize(("stated", "text"), [(40, "50 intervals (refined from 40), "), (50, "50 intervals, ")])
def test_a_refined_grid_states_the_number_of_intervals_of_its_script(slip_gait, stated, text):
    script = {"file": "slip.py", "sha256": "0", "parameters": {"intervals": stated}, "set": []}
    gait = dataclasses.replace(
        slip_gait,
        problem={**slip_gait.problem, "intervals": [10, 40], "script": script},
        solver=dataclasses.replace(slip_gait.solver, cost_error=3e-4),
    )
    assert dict(tabulate_gait(gait))["grid"].startswith(text)
