"""A motion that is nan has no cost, no margin and no closed ledger, and can be summarised all the same."""

import json
import math
from dataclasses import replace

import numpy as np
import pytest

from gaitopt import Status, cost_of_transport, ledger
from gaitopt.motion import summarise
from gaitopt.motion.gait import cone_margin

FIELDS = (
    *("time", "q", "v", "torque", "force", "power", "work", "friction_work", "kinetic", "potential", "points"),
    *("damping_work", "elastic"),
)


def changed(gait, value, *names):
    """Return the motion of a gait whose last segment has a value in the middle of some of its fields."""
    *first, last = gait.motion.segments
    arrays = {name: getattr(last, name).copy() for name in names}
    for array in arrays.values():
        array[..., array.shape[-1] // 2] = value
    return replace(gait.motion, segments=(*first, replace(last, **arrays)))


@pytest.mark.parametrize("value", [np.nan, np.inf])
@pytest.mark.parametrize("name", ["work", "power"])
def test_work_that_is_not_finite_costs_nan(slip_gait, name, value):
    """The turning points of such a work once were looked for, which ended in a LinAlgError."""
    assert math.isnan(cost_of_transport(changed(slip_gait, value, name)))


def test_a_ledger_with_a_nan_does_not_close(slip_gait):
    energy = ledger(slip_gait.motion)
    for name in energy.__dataclass_fields__:
        assert replace(energy, **{name: math.nan}).relative_residual == math.inf
    assert replace(energy, **dict.fromkeys(energy.__dataclass_fields__, math.nan)).relative_residual == math.inf
    assert replace(energy, **dict.fromkeys(energy.__dataclass_fields__, 0.0)).relative_residual == 0.0


def test_a_force_that_is_nan_has_no_margin(slip_gait):
    assert cone_margin(changed(slip_gait, np.nan, "force")) == -math.inf


@pytest.mark.parametrize("value", [np.nan, np.inf, 0.0])
def test_a_failed_gait_of_any_numbers_is_summarised(slip_gait, value):
    motion = slip_gait.motion
    segments = tuple(
        replace(part, **{name: np.full_like(getattr(part, name), value) for name in FIELDS}) for part in motion.segments
    )
    jump = motion.jumps[0]
    names = ("impulse", "q", "v_minus", "v_plus", "q_next", "v_next")
    jump = replace(jump, **{name: np.full_like(getattr(jump, name), value) for name in names}, energy_lost=value)
    motion = replace(motion, segments=segments, jumps=(jump,))
    with np.errstate(all="ignore"):
        text = json.dumps(summarise(replace(slip_gait, status=Status.INVALID_NUMBER, motion=motion)), allow_nan=False)
    assert json.loads(text)["cost_of_transport"] in (None, 0.0)
