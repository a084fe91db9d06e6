import math

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt import InputError, Limits, Margins, Status, solve, verify
from gaitopt.ocp import PlanarLimits
from gaitopt.ocp.statement.limits import Range

ACTUATORS = ("ankle", "hip")
POSITIVE = st.floats(1e-6, 1e6)


def test_one_torque_limit_serves_every_actuator():
    assert Limits(torque=6).torques(ACTUATORS) == [6.0, 6.0]


def test_an_actuator_without_a_torque_limit_is_unlimited():
    assert Limits(torque={"hip": 3}).torques(ACTUATORS) == [math.inf, 3.0]


def test_a_limit_of_an_unknown_actuator_names_the_nearest():
    with pytest.raises(InputError, match=r"no actuator 'ancle'\. Did you mean 'ankle'"):
        Limits(torque={"ancle": 3}).torques(ACTUATORS)
    with pytest.raises(InputError, match=r"^PlanarLimits.torque: there is no actuator 'ancle'\. Did you mean 'ankle'"):
        PlanarLimits(torque={"ancle": 3}).torques(ACTUATORS)


@pytest.mark.parametrize("torque", [-1, math.nan, None, "strong", {"hip": -0.1}, {"hip": math.nan}])
def test_torque_limits_that_cannot_be(torque):
    with pytest.raises(InputError, match=r"^Limits\.torque of (every actuator|hip) must be"):
        Limits(torque=torque)


@pytest.mark.parametrize("rate", [0, {"hip": -1.0}])
def test_limits_of_torque_rates_are_checked_where_they_are_stated(rate):
    with pytest.raises(
        InputError, match=r"^Limits\.torque_rate of (every actuator|hip) must be greater than 0 \[N m/s\]"
    ):
        Limits(torque_rate=rate)


def test_angles_have_limits_of_their_own():
    limits = Limits(angle={"knee": (0.1, 1.2), "thigh": 0.5})
    assert limits.angles(("thigh", "knee", "torso")) == [(-0.5, 0.5), (0.1, 1.2), (-math.pi / 2, math.pi / 2)]
    assert Limits(angle=1).angles(("thigh", "knee")) == [(-1.0, 1.0)] * 2


@pytest.mark.parametrize(
    ("angle", "message"),
    [
        (0, "Limits.angle"),
        (-1, "Limits.angle"),
        (math.nan, "Limits.angle"),
        ("wide", "Limits.angle"),
        ({"knee": (1.2, 0.1)}, "Limits.angle of knee: the lower bound 1.2 must be below"),
        ({"knee": (0.1,)}, "Limits.angle of knee must be a number or a pair"),
        ({"knee": (math.nan, 1)}, "Limits.angle of knee"),
    ],
)
def test_angle_limits_that_cannot_be(angle, message):
    with pytest.raises(InputError, match=message):
        Limits(angle=angle)


def test_a_limit_of_an_unknown_angle_names_the_nearest():
    with pytest.raises(InputError, match=r"no angle 'nee'\. Did you mean 'knee'"):
        Limits(angle={"nee": 1}).angles(("thigh", "knee"))


@pytest.mark.parametrize("name", ["rate", "shortest_phase", "longest_step"])
@pytest.mark.parametrize("value", [0, -1, math.nan, "long"])
def test_other_limits_that_cannot_be(name, value):
    with pytest.raises(InputError, match=f"Limits.{name}"):
        Limits(**{name: value})


@pytest.mark.parametrize("value", [-1e-9, math.nan, math.inf, "high"])
def test_a_clearance_that_cannot_be(value):
    with pytest.raises(InputError, match=r"Limits\.clearance"):
        Limits(clearance=value)


MARGINS = [field.name for field in attrs.fields(Margins)]


@pytest.mark.parametrize("name", MARGINS)
@pytest.mark.parametrize("value", [-1e-9, math.nan, "wide", "0.5"])
def test_margins_that_cannot_be(name, value):
    with pytest.raises(InputError, match=f"Margins.{name}"):
        Margins(**{name: value})


@pytest.mark.parametrize("name", ["cone", "impact_cone", "normal_force"])
def test_a_margin_that_takes_everything_is_refused(name):
    with pytest.raises(InputError, match=f"Margins.{name} must be .* at most 0.99"):
        Margins(**{name: 1.0})


@pytest.mark.parametrize("name", MARGINS)
@pytest.mark.parametrize("value", [0, np.int64(0), np.float32(0.5)])
def test_a_margin_of_any_kind_of_number_is_a_float(name, value):
    """A whole number of slip_speed once crashed the solve."""
    kept = getattr(Margins(**{name: value}), name)
    assert type(kept) is float
    assert kept == float(value)


@pytest.mark.parametrize("name", ["rate", "shortest_phase", "longest_step", "clearance"])
def test_a_limit_of_any_kind_of_number_is_a_float(name):
    assert type(getattr(Limits(**{name: 1}), name)) is float
    assert type(getattr(Limits(**{name: np.float64(1)}), name)) is float


def test_margins_of_whole_numbers_are_solved_with(reference_problem):
    """Without margins the plan of the slipping gait is on the cone, and the replay leaves it."""
    margins = Margins(slip_speed=0, cone=0, separation=0)
    problem = reference_problem(sequence="slip+ stick | slip+", objective="torque_squared", margins=margins)
    gait = solve(problem)
    assert gait.status is Status.PLAN_INACCURATE
    assert not verify(gait).verification.passed
    assert verify(solve(problem.replace(sequence="stick | stick", friction=0.3))).status is Status.SOLVED


@pytest.mark.parametrize("sequence", ["stick | stick", "slip+ stick | slip+"])
def test_margins_of_the_touchdown_guard_are_inactive(solved, compass, sequence):
    """Other robots have guards in other units, but no walker of reasonable size comes near these margins."""
    motion, margins = solved(sequence=sequence).motion, Margins()
    jump = motion.jumps[0]
    _, rate, armed = (
        float(part) for part in compass.touchdown(jump.q, jump.v_minus, compass.vector(motion.parameters))
    )
    assert rate < -100 * margins.touchdown_rate  # [rad/s]
    assert armed > 100 * margins.touchdown_armed  # [rad]


@given(POSITIVE)
def test_a_number_fixes_a_target(value):
    assert Range.of(value, "speed", "m/s") == Range(value, value)


@given(POSITIVE, POSITIVE)
def test_a_pair_bounds_a_target(one, other):
    lower, upper = sorted((one, other))
    assert Range.of((lower, upper), "speed", "m/s") == Range(lower, upper)
    assert Range.of([lower, upper], "speed", "m/s") == Range(lower, upper)


def test_no_target_is_free():
    assert Range.of(None, "speed", "m/s") == Range(0.0, math.inf)


@given(POSITIVE, POSITIVE)
def test_a_pair_in_the_wrong_order_is_refused(one, other):
    lower, upper = sorted((one, other))
    if lower < upper:
        with pytest.raises(InputError, match=r"the lower bound .* must not exceed the upper bound"):
            Range.of((upper, lower), "speed", "m/s")


@pytest.mark.parametrize("target", [0, -1, math.nan, math.inf, "fast", (0.5,), (1, 2, 3), (), (0, 1), (math.nan, 1)])
def test_targets_that_cannot_be(target):
    with pytest.raises(InputError, match="speed"):
        Range.of(target, "speed", "m/s")
