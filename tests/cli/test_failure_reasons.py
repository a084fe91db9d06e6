"""Reasons of failures in tables and in messages on standard error."""

from dataclasses import replace

import pytest

from gaitopt import InputError, Status
from gaitopt.cli.failed_solve import state_failure
from gaitopt.motion.gait_table import tabulate_gait


def test_reasons_of_a_failure_are_separated_by_semicolons_without_periods(slip_gait):
    """The first reason is a sentence of the simulator, which ends with a period."""
    replay = replace(
        slip_gait.verification,
        passed=False,
        reasons=("the replay stopped at 0.1 s: The walker fell.", "the replay has no touchdown"),
    )
    failed = slip_gait.with_verification(replay)
    table = dict(tabulate_gait(failed))["replay"]
    assert table == "failed: the replay stopped at 0.1 s: The walker fell; the replay has no touchdown"
    line = state_failure(failed)
    assert line.startswith(f"not_verified: replay: {table.removeprefix('failed: ')}. The optimiser converged, but")
    assert ".;" not in line


def test_warnings_of_an_inaccurate_plan_are_separated_alike(slip_gait):
    warned = slip_gait.solver.replace_fields(warnings=("use more intervals.", "the foot scuffs."))
    inaccurate = slip_gait.replace_fields(status=Status.PLAN_INACCURATE, solver=warned)
    with pytest.raises(InputError, match=r"use more intervals; the foot scuffs$"):
        inaccurate.require()
