import math

import numpy as np
import pytest

from gaitopt import InputError, find_cycles, rimless_wheel, trace_branch

SLOPE = math.radians(13)


@pytest.fixture(scope="module")
def sticking():
    return find_cycles(rimless_wheel(), {"slope": SLOPE, "friction": 1.0}, starts=10)[0]


def test_branch_follows_the_closed_form(sticking):
    slopes = np.radians([13, 10, 7])
    branch = trace_branch(rimless_wheel(), {"friction": math.inf}, sticking, "slope", slopes)
    assert branch.ended == "all values reached"
    # McGeer's wheel: thd*^2 = beta^2 (thd*^2 + 4 g sin(pi/n) sin(alpha) / (l (1 + kappa))), energy over a step.
    kappa = 1 / 3
    beta = (math.cos(math.pi / 5) + kappa) / (1 + kappa)
    gained = 4 * 9.8 * math.sin(math.pi / 10) * np.sin(slopes) / (1 + kappa)
    expected = np.sqrt(beta**2 * gained / (1 - beta**2))
    wanted = [c.z[0] for v, c in zip(branch.values, branch.cycles, strict=True) if np.any(np.isclose(v, slopes))]
    assert wanted == pytest.approx(list(expected), rel=1e-10)


def test_branch_ends_where_the_gait_does(sticking):
    # The wheel no longer rolls over below 1.40 deg (Gamus & Or 2015, existence of Type A).
    branch = trace_branch(rimless_wheel(), {"friction": 1.0}, sticking, "slope", np.radians(np.linspace(13, 1, 13)))
    assert math.degrees(branch.values[-1]) == pytest.approx(1.40, abs=5e-3)
    assert branch.ended.startswith("no gait found beyond slope")


def test_branch_can_stop_at_a_change_of_word(sticking):
    values = np.linspace(1.0, 0.8, 5)
    branch = trace_branch(rimless_wheel(), {"slope": SLOPE}, sticking, "friction", values, same_word=True)
    assert branch.ended == "the word changes to 'stick slip+ | stick'"
    assert branch.values[-1] > 0.9141 - 0.05


def test_unknown_parameter_is_named(sticking):
    with pytest.raises(InputError, match="Did you mean 'friction'"):
        trace_branch(rimless_wheel(), {}, sticking, "fricton", [0.1])
