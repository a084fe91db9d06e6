"""Summaries: plain data that any JSON reader takes."""

import dataclasses
import json
import math

import numpy as np
import pytest

from gaitopt.motion import Violation, summarise
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


def test_summary_states_the_facts_of_the_gait(slip_gait):
    summary = summarise(slip_gait)
    segments = slip_gait.motion.segments
    assert summary["sequence"] == "slip+ stick | slip+"
    assert summary["period"] == pytest.approx(sum(phase["duration"] for phase in summary["phases"]), rel=1e-12)
    assert summary["foot_slide"] == pytest.approx(segments[0].q[0, -1] - segments[0].q[0, 0], rel=1e-12)
    assert summary["impact"]["ratio"] == pytest.approx(-0.14, rel=1e-6)  # a slip+ impact lies on the cone
    energy = summary["energy"]
    assert energy["actuator"] == pytest.approx(energy["impact_loss"] + energy["friction_loss"], rel=1e-5)
