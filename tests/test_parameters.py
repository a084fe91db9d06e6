"""Parameters: accepted values, and the messages for all others."""

import math
import pickle
from decimal import Decimal
from fractions import Fraction

import attrs
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from gaitopt import (
    Collocation,
    Execution,
    FigureStyle,
    GainSearchOptions,
    Homotopy,
    InputError,
    Ipopt,
    Limits,
    LqrWeights,
    Margins,
    MultipleShooting,
    Newton,
    Parameter,
    PushTest,
    RandomPerturbation,
    ScipyEngine,
    SettlingCriterion,
)
from gaitopt.parameters import (
    as_vector,
    callable_with,
    instance_of,
    optional,
    positive,
    recall_parameter,
    resolve,
    whole_number,
)
from gaitopt.simulation import Tolerances
from gaitopt.study import WalkTest

MASS = Parameter("mass", 2.0, "kg", "a mass", lower=0.0, lower_open=True)
SHARE = Parameter("share", 0.5, "1", "a share", lower=0.0, upper=1.0)
SLOPE = Parameter("slope", 0.0, "rad", "a slope", upper=1.5)
FRICTION = Parameter("friction", math.inf, "1", "friction", lower=0.0, infinite=True)


@given(st.floats(0, 1))
def test_values_inside_the_bounds_come_back_as_floats(value):
    assert SHARE.check(value) == value
    assert type(SHARE.check(value)) is float


@pytest.mark.parametrize("value", [3, np.float32(0.5), np.int64(1), np.array(0.25), Fraction(1, 4), Decimal("0.25")])
def test_anything_that_is_a_number_will_do(value):
    assert MASS.check(value) == float(value)


@pytest.mark.parametrize(
    "value", ["0.25", b"5", bytearray(b"5"), True, np.bool_(True), 1 + 0j, np.ma.masked_array([1.0])]
)
def test_what_python_converts_to_a_number_but_is_none_is_refused(value):
    with pytest.raises(InputError, match=r"mass must be a number \[kg\], got "):
        MASS.check(value)


def test_bounds_are_closed_unless_said_otherwise():
    assert (SHARE.check(0), SHARE.check(1)) == (0.0, 1.0)
    with pytest.raises(InputError, match=r"mass must be greater than 0 \[kg\], got 0\."):
        MASS.check(0)


@pytest.mark.parametrize(
    ("parameter", "value", "message"),
    [
        (MASS, -1, "mass must be greater than 0 [kg], got -1."),
        (SHARE, 1.5, "share must be at least 0 and at most 1, got 1.5."),
        (SHARE, -1e-9, "share must be at least 0 and at most 1, got -1e-09."),
        (SLOPE, 2, "slope must be at most 1.5 [rad], got 2. If the value is in degrees, state 0.03491 rad."),
        (MASS, math.nan, "mass must be a finite number [kg], got nan."),
        (MASS, math.inf, "mass must be a finite number [kg], got inf."),
        (FRICTION, math.nan, "friction must be a finite number, got nan."),
        (FRICTION, -math.inf, "friction must be at least 0, got -inf."),
        (MASS, "heavy", "mass must be a number [kg], got 'heavy'."),
        (MASS, None, "mass must be a number [kg], got None."),
        (MASS, [1.0], "mass must be a number [kg], got [1.0]."),
        (MASS, 1j, "mass must be a number [kg], got 1j."),
    ],
)
def test_a_value_that_cannot_be_is_named_with_unit_and_interval(parameter, value, message):
    with pytest.raises(InputError) as caught:
        parameter.check(value)
    assert str(caught.value) == message


def test_a_number_too_large_for_a_float_is_refused_like_any_other():
    with pytest.raises(InputError, match="mass must be a number"):
        MASS.check(10**400)


def test_infinity_only_where_it_has_a_meaning():
    assert FRICTION.check(math.inf) == math.inf


def test_defaults_fill_in_and_the_order_is_that_of_the_parameters():
    known = (MASS, SHARE, SLOPE)
    values = resolve(known, {"slope": 1, "mass": 3}, "robot")
    assert list(values.items()) == [("mass", 3.0), ("share", 0.5), ("slope", 1.0)]
    np.testing.assert_array_equal(as_vector(known, values), [3.0, 0.5, 1.0])
    assert as_vector((), {}).shape == (0,)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SettlingCriterion(steps=0), "SettlingCriterion.steps must be at least 1, got 0"),
        (lambda: SettlingCriterion(steps=2.5), "SettlingCriterion.steps must be a whole number, got 2.5"),
        (lambda: SettlingCriterion(longest_period=0), "SettlingCriterion.longest_period must be at least 1"),
        (lambda: SettlingCriterion(tolerance=-1), "SettlingCriterion.tolerance must be greater than 0"),
        (lambda: WalkTest(steps=0), "WalkTest.steps must be at least 1"),
        (lambda: WalkTest(resolution=2), "WalkTest.resolution must be greater than 0 and at most 1"),
        (lambda: GainSearchOptions(evaluations=0), "GainSearchOptions.evaluations must be at least 1"),
        (lambda: GainSearchOptions(seed=-1), "GainSearchOptions.seed must be at least 0"),
    ],
)
def test_options_that_cannot_be_are_named_with_their_class(make, message):
    with pytest.raises(InputError, match=message):
        make()


def test_a_vector_needs_every_value():
    with pytest.raises(InputError, match=r"The robot's parameter 'share' has no value\. Known: mass\."):
        as_vector((MASS, SHARE), {"mass": 3.0})


def test_an_unknown_name_is_named_with_its_owner_and_the_nearest_known_one():
    with pytest.raises(InputError) as caught:
        resolve((MASS, SHARE), {"mas": 1.0}, "Robot 'x'")
    assert str(caught.value) == "Robot 'x' has no parameter 'mas'. Did you mean 'mass'? Known: mass, share."


def test_a_default_is_checked_as_well():
    with pytest.raises(
        InputError, match=r"^The default of a parameter is invalid: wrong must be at least 0, got -1\.$"
    ):
        Parameter("wrong", -1.0, "1", "a wrong default", lower=0.0)


def test_a_bound_that_is_another_parameter():
    known = (Parameter("height", 1.0, "m", "a height"), Parameter("mark", 0.5, "m", "a mark", at_most="height"))
    assert resolve(known, {"mark": 1.0}, "robot") == {"height": 1.0, "mark": 1.0}
    with pytest.raises(InputError) as caught:
        resolve(known, {"mark": 1.5}, "robot")
    assert str(caught.value) == "mark (a mark) must be at most height = 1 [m], got 1.5."
    with pytest.raises(InputError, match=r"must be at most height = 0\.4 \[m\], got 0\.5, its default"):
        resolve(known, {"height": 0.4}, "robot")


@attrs.frozen(kw_only=True)
class Options:
    size: float = attrs.field(default=1.0, validator=positive("m", upper=2.0))
    count: int = attrs.field(default=3, validator=whole_number())
    limit: float | None = attrs.field(default=None, validator=optional(positive(infinite=True)))
    name: str = attrs.field(default="", validator=instance_of(str, example="a string"))
    work: object = attrs.field(default=print, validator=callable_with("a number"))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"size": 0}, "Options.size must be greater than 0 and at most 2 [m], got 0."),
        ({"size": math.inf}, "Options.size must be a finite number [m], got inf."),
        ({"size": "1"}, "Options.size must be a number, got '1'."),
        ({"size": 1j}, "Options.size must be a number, got 1j."),
        ({"count": 2.5}, "Options.count must be a whole number, got 2.5."),
        ({"count": True}, "Options.count must be a whole number, got True."),
        ({"limit": math.nan}, "Options.limit must be a finite number, got nan."),
        ({"name": 3}, "Options.name must be a string, got 3."),
        ({"work": 3}, "Options.work must be a function that is called with a number, got 3."),
    ],
)
def test_options_are_checked_when_they_are_made_and_changed(options, message):
    with pytest.raises(InputError) as failure:
        Options(**options)
    assert str(failure.value) == message
    with pytest.raises(InputError) as failure:
        attrs.evolve(Options(), **options)
    assert str(failure.value) == message


def test_options_may_be_none_or_infinite_where_that_is_meant():
    assert Options(limit=math.inf).limit == math.inf
    assert Options(limit=None, size=np.float64(1.5), count=np.int64(4)).count == 4


@pytest.mark.parametrize(
    "options",
    [
        Limits(torque=6),
        Margins(cone=0.05),
        Ipopt(max_iterations=3),
        Newton(),
        Homotopy(),
        Collocation(intervals=(3, 4)),
        MultipleShooting(intervals=5),
        RandomPerturbation(3),
        FigureStyle(),
        Tolerances(),
        ScipyEngine(),
        SettlingCriterion(),
        PushTest(),
        LqrWeights(),
        GainSearchOptions(),
        WalkTest(),
        Execution(),
    ],
    ids=lambda options: type(options).__name__,
)
def test_options_are_frozen_keys_of_caches_and_fit_for_other_processes(options):
    copy = pickle.loads(pickle.dumps(options))
    assert copy is not options
    assert copy == options
    assert hash(copy) == hash(options)
    with pytest.raises(attrs.exceptions.FrozenInstanceError):
        setattr(options, attrs.fields(type(options))[0].name, 1)


@pytest.mark.parametrize(("name", "lower"), [("leg_mass", 0.0), ("rest_length", 0.0), ("offset", -math.inf)])
def test_masses_and_lengths_are_not_negative_by_default(name, lower):
    assert Parameter(name, 1.0, "1", "").lower == lower
    assert Parameter(name, 1.0, "1", "", lower=-2.0).lower == -2.0


@pytest.mark.parametrize("bounds", [{}, {"lower": -math.inf}, {"upper": -2.0}, {"lower": 3.0, "whole": True}])
def test_numbers_with_any_bounds_are_checked(bounds):
    parameter = recall_parameter("offset", **bounds)
    assert parameter.check(parameter.default) == parameter.default
